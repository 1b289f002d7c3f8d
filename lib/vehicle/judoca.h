/* SPDX-License-Identifier: BSD-3-Clause
 * JUDOCA: junctions where straight edges meet, with their branch directions. */
#ifndef OUTCROP_VEHICLE_JUDOCA_H
#define OUTCROP_VEHICLE_JUDOCA_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/image.h"
#include "core/junction.h"
#include "core/status.h"
#include "vehicle/arena.h"
#include "vehicle/corner.h"
#include "vehicle/gradient.h"
#include "vehicle/judoca_search.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Largest branch length. */
#define OC_JUDOCA_MAX_LAMBDA_PX 24

/* Places fitted per image: what the parameter may say, and when it says
 * nothing, the least and one more per so many pixels. */
#define OC_JUDOCA_MAX_CANDIDATES 262144u
#define OC_JUDOCA_LEAST_CANDIDATES 512u
#define OC_JUDOCA_PX_PER_CANDIDATE 144u

/* Fits kept per image before the nearest duplicates are dropped; 96 bytes each. */
#define OC_JUDOCA_MAX_FOUND 8192u

typedef enum oc_judoca_method {
    OC_JUDOCA_REFINED = 0, /* branches fitted to sub-pixel edges, apex is their intersection */
    OC_JUDOCA_THESIS = 1   /* thesis 3.3: integer apex, chord angles, strength only */
} oc_judoca_method_t;

/* Tunables: unit, legal range, default. Start from oc_judoca_defaults() and
 * change what you must. */
typedef struct oc_judoca_params {
    float sigma_px;          /* of the Gaussian before the derivative, 0.6..3; 1.2 */
    float t_b;               /* threshold of the thick map B, grey levels per px of the unit-gain
                        * derivative, 0.5..100; 6. 0 = from the image's own noise */
    float t_b_noise_k;       /* when t_b is 0: t_b = k * oc_gradient_noise(), kept within
                        * [OC_JUDOCA_MIN_T_B, OC_JUDOCA_MAX_T_B]; 1..20; 5 */
    float s_j;               /* least share of a branch that lies on an edge (thesis s_J), 0.3..1; 0.6 */
    int32_t lambda_px;       /* longest branch (thesis lambda), 6..OC_JUDOCA_MAX_LAMBDA_PX; 10 */
    int32_t lambda_min_px;   /* shortest branch, 4..lambda_px; 6. lambda_px = all of one length */
    float min_angle_rad;     /* two branches closer than this are one, 0.1..1; 0.26 */
    float min_bend_rad;      /* a pair this near to pi is a line, not a corner, 0.05..1; 0.26 */
    float max_rms_px;        /* an edge that leaves its line by more is no branch, 0.1..2; 0.6 */
    float max_apex_sigma_px; /* an apex less certain than this is dropped, 0.1..3; 1 */
    float min_distance_px;   /* of two apices nearer than this the better stays, 1..20; 3 */
    uint32_t max_junctions;  /* kept per image, 1..OC_MAX_JUNCTIONS; 600 */
    uint32_t max_corners;    /* corners (corner.h) found beside the junctions, 0..OC_MAX_JUNCTIONS; they share
                              * max_junctions and min_distance_px with these by score. 0 = none; 0 */
    uint32_t max_candidates; /* places fitted per image, those of best pre-score, shared over the image,
                              * 16..OC_JUDOCA_MAX_CANDIDATES; 0 = OC_JUDOCA_LEAST_CANDIDATES and one per
                              * OC_JUDOCA_PX_PER_CANDIDATE pixels. Never more than OC_JUDOCA_MAX_FOUND.
                              * Bounds the time; 0 */
    uint32_t spread_cell_px; /* side of the cells that share max_junctions when it
                              * binds, 8..4096; 40 */
    oc_judoca_method_t method;
    oc_simd_t simd; /* instruction set; OC_SIMD_AUTO. All give the same junctions */
} oc_judoca_params_t;

/* Bounds of a threshold taken from the noise, grey levels per px. */
#define OC_JUDOCA_MIN_T_B 2.0f
#define OC_JUDOCA_MAX_T_B 20.0f

/* What one call of oc_judoca_detect met; counts of pixels, places, junctions. */
typedef struct oc_judoca_stats {
    float t_b;          /* threshold in force */
    uint32_t n_thin;    /* pixels of B+ */
    uint32_t n_places;  /* places that looked like a junction */
    uint32_t n_fitted;  /* of these, within max_candidates */
    uint32_t n_found;   /* junctions before max_junctions and cap */
    uint32_t n_corners; /* of these, corners that were found beside the junctions */
    uint32_t n_dropped; /* junctions lost to max_junctions or cap */
} oc_judoca_stats_t;

/* A junction waiting for its place in the answer. */
typedef struct oc_judoca_rank {
    float key;      /* larger first */
    uint32_t index; /* into found; the smaller wins a tie */
} oc_judoca_rank_t;

struct oc_judoca_thesis;

/* Tables and maps for one image size. In the header only so that callers can
 * place it; read `stats` and `gradient` after a call, nothing else. */
typedef struct oc_judoca_ws {
    oc_judoca_params_t params;
    oc_judoca_stats_t stats;
    oc_gradient_t gradient; /* of the last image */
    oc_search_t search;
    oc_ring_table_t ring[2];         /* looks round an apex: near it, further out */
    uint64_t *done;                  /* bitmap: apices that have been fitted */
    oc_junction_t *found;            /* [OC_JUDOCA_MAX_FOUND] */
    oc_judoca_rank_t *rank;          /* [OC_JUDOCA_MAX_FOUND] */
    uint16_t *next;                  /* [OC_JUDOCA_MAX_FOUND] list of the junctions in one square of the owner map */
    uint16_t *owner;                 /* first junction of each square, + 1 */
    uint16_t *cell;                  /* junctions met per spread cell */
    oc_corner_ws_t corner;           /* with max_corners only */
    struct oc_judoca_thesis *thesis; /* the literal method's tables, NULL with the other */
} oc_judoca_ws_t;

/* Defaults tuned for repeatability across views 20 to 40 degrees apart. */
oc_judoca_params_t oc_judoca_defaults(void);

/* Every field in its range. */
bool oc_judoca_params_are_valid(const oc_judoca_params_t *params);

/* Bytes to give to oc_judoca_init, padding included; 0 when the sides are not
 * within OC_MIN_IMAGE_SIDE..OC_MAX_IMAGE_SIDE or params are not valid. */
size_t oc_judoca_size_bytes(uint32_t width_px, uint32_t height_px, const oc_judoca_params_t *params);

/* Take maps for images of exactly this size from the arena and build the ray
 * tables. params are copied.
 *
 * OC_E_ARG for a bad size or params, OC_E_SPACE when the arena is too small;
 * ws is then not usable. */
OC_CHECKED oc_status_t oc_judoca_init(oc_judoca_ws_t *ws, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                                      const oc_judoca_params_t *params);

/* Find the junctions of a grey image (thesis 3.3; what is added is in
 * docs/design.md: growing branches, line fits, sub-pixel apex).
 *
 * ws     made for the image's size; one per thread
 * grey   one channel, any stride
 * out    [cap], best score first: apex in px, branches sorted by angle, kind
 *        set, label OC_LABEL_UNKNOWN, confidence 0
 * count  out, 0..min(cap, params.max_junctions)
 *
 * OC_E_ARG for an image that is not valid, not grey or not of the size given
 * to init; nothing is written then. An image without junctions is OC_OK with
 * count 0. The same image gives the same answer, bit for bit, whatever its
 * stride and whatever was detected before.
 *
 * O(width * height) and O(max_candidates); figures in docs/measurements.md. */
OC_CHECKED oc_status_t oc_judoca_detect(oc_judoca_ws_t *ws, const oc_image_t *grey, oc_junction_t out[], uint32_t cap,
                                        uint32_t *count);

#ifdef __cplusplus
}
#endif
#endif
