/* SPDX-License-Identifier: BSD-3-Clause
 * Corners: points where the grey levels change in every direction, each with an orientation. The second kind of point,
 * for natural texture, where no straight edges meet. */
#ifndef OUTCROP_VEHICLE_CORNER_H
#define OUTCROP_VEHICLE_CORNER_H

#include <stddef.h>
#include <stdint.h>

#include "core/junction.h"
#include "core/status.h"
#include "vehicle/arena.h"
#include "vehicle/gradient.h"

#ifdef __cplusplus
extern "C" {
#endif

/* No corner is nearer to the image's border. */
#define OC_CORNER_MARGIN_PX 7u

/* A corner's strength is the largest within this many pixels, along rows and columns. */
#define OC_CORNER_REACH_PX 3

/* Corners that one cell of the spread may hold. */
#define OC_CORNER_PER_CELL 12u

/* A maximum of the strength; the place is the pixel's. */
typedef struct oc_corner_peak {
    float strength; /* grey levels per px */
    uint16_t x, y;
} oc_corner_peak_t;

/* Scratch for one image size. In the header only so that callers can place it. */
typedef struct oc_corner_ws {
    uint32_t width_px, height_px;
    uint32_t cell_px, n_cols, n_cells;
    int32_t *tensor;        /* [N_TENSOR_ROWS][width], rows on their way */
    float *strength;        /* [N_STRENGTH_ROWS][width] */
    uint8_t *is_peak;       /* [width], padded to whole words */
    uint16_t *n_in_cell;    /* [n_cells] */
    oc_corner_peak_t *peak; /* [n_cells][OC_CORNER_PER_CELL], best of each cell first */
    uint64_t *order;        /* [n_cells * OC_CORNER_PER_CELL] sort keys */
} oc_corner_ws_t;

/* Bytes that oc_corner_init takes, padding included; 0 for sides outside
 * OC_MIN_IMAGE_SIDE..OC_MAX_IMAGE_SIDE or a cell_px outside 8..OC_MAX_IMAGE_SIDE. */
size_t oc_corner_size_bytes(uint32_t width_px, uint32_t height_px, uint32_t cell_px);

/* Take scratch for gradients of this size: O(width), and 16 bytes for each of
 * OC_CORNER_PER_CELL places in each cell of cell_px x cell_px pixels.
 *
 * OC_E_ARG for what oc_corner_size_bytes refuses, OC_E_SPACE when the arena is too small. */
OC_CHECKED oc_status_t oc_corner_init(oc_corner_ws_t *ws, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                                      uint32_t cell_px);

/* Find the corners of the image whose derivatives are in gradient, of the size given to init.
 *
 * The derivatives' outer products are summed under a 5 x 5 binomial window. A corner is a strict local maximum of the
 * smaller eigenvalue of that sum (Shi & Tomasi 1994; Harris & Stephens 1988 is the same matrix): its root, the
 * strength, in grey levels per px, is what the image changes at least by in any direction. The place is Foerstner &
 * Guelch's point (1987), the least-squares intersection of the edge lines of all pixels of the window round the
 * maximum, or the maximum itself where that is further off than OC_CORNER_REACH_PX. The orientation is that of the
 * mean derivative, from dark to bright.
 *
 * floor    least strength, grey levels per px, > 0
 * out      [cap], strongest first of those that are shared over the cells: one branch, its angle the orientation and
 *          its length the reach; kind OC_KIND_CORNER; score on the junctions' scale, see docs/design.md
 *
 * Returns how many, at most cap. Integers, IEEE divisions and square roots in one order: the same bits on every
 * machine. O(width * height); figures in docs/measurements.md. */
uint32_t oc_corner_find(oc_corner_ws_t *ws, const oc_gradient_t *gradient, float floor, oc_junction_t out[],
                        uint32_t cap);

#ifdef __cplusplus
}
#endif
#endif
