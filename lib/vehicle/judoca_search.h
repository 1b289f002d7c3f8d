/* SPDX-License-Identifier: BSD-3-Clause
 * Where junctions may be: a bit-parallel search for pixels of B+ from which edges run in two directions. */
#ifndef OUTCROP_VEHICLE_JUDOCA_SEARCH_H
#define OUTCROP_VEHICLE_JUDOCA_SEARCH_H

#include <stddef.h>
#include <stdint.h>

#include "core/status.h"
#include "vehicle/arena.h"
#include "vehicle/gradient.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Rays look this far at least and at most; the fit goes on from there. */
#define OC_SEARCH_MIN_RADIUS_PX 5
#define OC_SEARCH_MAX_RADIUS_PX 8

/* A place that looks like a junction: the middle of a cluster of such pixels. */
typedef struct oc_place {
    uint16_t x, y;
    uint16_t prescore;    /* contrast and strength, larger is better */
    uint32_t left, right; /* directions whose edge has its gradient on the left, right; bit d = d 32nds of a turn */
} oc_place_t;

/* Scratch of the search for one image size. */
typedef struct oc_search {
    oc_ray_table_t table;
    float ux[OC_RAYS], uy[OC_RAYS];
    uint32_t pitch, n_columns, n_tile_rows;
    uint64_t *edge;        /* [3 columns][OC_RAYS][pitch] B+ by direction of its gradient, grown by a pixel across */
    uint64_t *near;        /* [3 columns][OC_RAYS][pitch] the same with the two directions to each side */
    uint32_t edge_used[3]; /* directions that occur in a column */
    uint32_t near_used[3];
    uint16_t *tile;        /* [n_tile_rows + 2][8 columns + 16] orientations met per 8 x 8 pixels */
    oc_ray_block_t *block; /* [16] the 64 x 64 pixels under search */
    oc_place_t *place;     /* [max_places] */
    uint32_t max_places;
    uint32_t n_places; /* found, those over max_places not kept */
} oc_search_t;

/* Bytes that oc_search_init takes from the arena. */
size_t oc_search_size_bytes(uint32_t width_px, uint32_t height_px);

/* Take the planes; radius_px is clamped to the range above, s_j is the share of a ray's samples that must hold. */
OC_CHECKED oc_status_t oc_search_init(oc_search_t *search, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                                      int32_t radius_px, float s_j);

/* Fill place[] and n_places from the maps of the gradient, in a fixed order. */
void oc_search_run(oc_search_t *search, const oc_gradient_t *gradient);

/* Direction of a gradient in 32nds of a turn, 0 centred on +x and growing towards +y (down); (0, 0) gives 0. */
uint32_t oc_search_direction(int32_t dx, int32_t dy);

#ifdef __cplusplus
}
#endif
#endif
