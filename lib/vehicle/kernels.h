/* SPDX-License-Identifier: BSD-3-Clause
 * The loops that take the detector's time, compiled for several instruction sets and once more without any vectors.
 * All give the same bits: integers, IEEE square roots, sums in one fixed order. */
#ifndef OUTCROP_VEHICLE_KERNELS_H
#define OUTCROP_VEHICLE_KERNELS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef enum oc_simd {
    OC_SIMD_AUTO = 0,   /* the best that this processor has */
    OC_SIMD_SCALAR = 1, /* plain C, the twin that the others are held against */
    OC_SIMD_BASE = 2,   /* what every processor of the target has: SSE2, NEON */
    OC_SIMD_AVX2 = 3
} oc_simd_t;

/* Half width of the largest Gaussian. */
#define OC_GRADIENT_MAX_RADIUS 9

/* Directions of the ray search: multiples of a 32nd turn, y down. */
#define OC_RAYS 32u

/* Samples of one ray, from the circle inwards to FIRST_SAMPLE. */
#define OC_RAY_MAX_SAMPLES 8u

/* The rays: pixels of a small circle and the way there, relative to the centre. */
typedef struct oc_ray_table {
    uint32_t n_samples;                     /* of every ray */
    uint32_t n_spare;                       /* samples that may miss, 0..3 */
    int8_t dx[OC_RAYS][OC_RAY_MAX_SAMPLES]; /* [0] is on the circle */
    int8_t dy[OC_RAYS][OC_RAY_MAX_SAMPLES];
} oc_ray_table_t;

/* What four rows of 64 pixels see. Ray r = direction d with the gradient on
 * its left (r = d) or on its right (r = OC_RAYS + d). */
typedef struct oc_ray_block {
    uint64_t ray[2u * OC_RAYS][4]; /* pixels whose ray holds */
    uint64_t weak[4];              /* pixels with two rays that are neither equal nor opposite */
    uint64_t strong[4];            /* the same of rays without a miss */
} oc_ray_block_t;

/* Samples of one branch; OC_FIT_SAMPLES is a multiple of every vector length. */
#define OC_FIT_SAMPLES 32u
#define OC_FIT_MAX_REACH 2

/* Widths of a ridge's Gaussian, px: s across the edge, st along it, where the central difference adds less. */
typedef struct oc_fit_blur {
    float s, st, inv_s, inv_st, inv_s2; /* inv_s2 = 1 / s^2 */
} oc_fit_blur_t;

/* One branch seen along its major axis, so that x and y share the code. */
typedef struct oc_fit_walk {
    const int16_t *dxdy;
    int32_t step_major, step_minor; /* pixels, into the planes */
    int32_t n_minor;                /* image size across */
    int32_t first, sign;            /* first major coordinate and its step */
    uint32_t n;                     /* samples to take, all inside the image along the major axis */
    float a_major, a_minor;         /* apex */
    int32_t nx, ny;                 /* normal on the side of the gradient, 1/2^14 */
    float own_major, own_minor;     /* unit vector along the branch */
    float per_major;                /* 1 / own_major */
    float to_d;                     /* the minor axis on the normal (-uy, ux) */
    float floor;                    /* least derivative of an edge point */
    float crowded_px;               /* nearer than this another ridge may hide a sample */
    float shortest_px;              /* up to here missing samples end nothing */
    float far_px;                   /* samples from here on tell the blur */
    uint32_t self;                  /* lane of the crowd */
    uint32_t axis;                  /* the major one: 0 x, 1 y */
    int32_t reach;                  /* half width of the search across, 0..OC_FIT_MAX_REACH */
    bool has_model; /* branches end at the apex and add to each other; without, the reach is the largest */
} oc_fit_walk_t;

/* All branches of a fit, one per lane; lanes from n on hold any numbers. Of those at the end the strongest OC_MAX_BRANCHES
 * leave. */
#define OC_FIT_MAX_BRANCHES 8u
typedef struct oc_fit_crowd {
    uint32_t n;
    float ux[OC_FIT_MAX_BRANCHES], uy[OC_FIT_MAX_BRANCHES]; /* along the branch */
    float side[OC_FIT_MAX_BRANCHES];                        /* of the gradient */
    float amplitude[OC_FIT_MAX_BRANCHES];                   /* of the ridge */
} oc_fit_crowd_t;

/* A ridge further off than this many of its widths adds nothing. */
#define OC_FIT_RIVAL_WIDTHS 3.0f

/* Samples of a branch, outwards; t along it from the apex, d across it on the normal (-uy, ux), px. */
typedef struct oc_fit_profile {
    float t[OC_FIT_SAMPLES], d[OC_FIT_SAMPLES];
    float gain[OC_FIT_SAMPLES];  /* share of the full ridge this near to the apex */
    float value[OC_FIT_SAMPLES]; /* derivative at the ridge */
    float bend[OC_FIT_SAMPLES];  /* 2 value - before - after */
    /* Bit m = sample m. */
    uint32_t place;   /* positions: edges that say where, before two missing in a row end the branch */
    uint32_t edge;    /* all edges, those that do not say where only where no ridge hides them */
    uint32_t tried;   /* positions and samples that no ridge hides */
    uint32_t n_short; /* positions up to half a pixel beyond the shortest length */
} oc_fit_profile_t;

/* Weighted sums over the ridge positions of one branch, in its own frame at
 * the apex: t along the branch, d across it, px. */
typedef struct oc_fit_sums {
    float w, wt, wtt, wd, wtd, wdd;
    float value;       /* of derivative times gain; w = gain^2 */
    float bend, level; /* of far samples: sum of 2 v - before - after, and of v */
    uint32_t n;        /* positions */
    float share;       /* edges of the samples that count, up to the last position */
    float last_px;     /* t of the last position */
} oc_fit_sums_t;

/* One branch on its way through the kernel. */
typedef struct oc_fit_track {
    oc_fit_walk_t walk; /* with samples */
    oc_fit_profile_t profile;
    oc_fit_sums_t *sums; /* out */
} oc_fit_track_t;

/* Round the apex: derivatives across OC_RAYS directions. */
#define OC_RING_SAMPLES 5u
typedef struct oc_ring_table {
    float ux[OC_RAYS], uy[OC_RAYS];
    int16_t across[OC_RAYS][2];           /* the normal (-uy, ux), 1/2^14 */
    int32_t at[OC_RING_SAMPLES][OC_RAYS]; /* pixels from the apex' into the planes */
} oc_ring_table_t;

typedef struct oc_kernels {
    oc_simd_t level;

    /* Gaussian down the columns: rows[0 .. 2 radius] are image rows, out in 1/128 grey level. */
    void (*down)(const uint8_t *const rows[], const uint16_t kernel[], int32_t radius, uint32_t width, uint16_t *out);

    /* Gaussian along the row, in[-radius .. width + radius). */
    void (*across)(const uint16_t *in, const uint16_t kernel[], int32_t radius, uint32_t width, int16_t *out);

    /* Central differences of filtered rows (here[-1 .. width]) and their magnitude, at most INT16_MAX. */
    void (*differ)(const int16_t *above, const int16_t *here, const int16_t *below, uint32_t width, int16_t *dxdy,
                   int16_t *dx, int16_t *dy, int16_t *magnitude);

    /* B and B+ of a row from three rows of magnitudes, each with a zero before
     * it and zeros up to a multiple of 64 behind it; one word per 64 pixels. */
    void (*thin)(const int16_t *above, const int16_t *here, const int16_t *below, const int16_t *dx, const int16_t *dy,
                 uint32_t width, int16_t threshold, uint64_t thick[], uint64_t thin[]);

    /* OR of each direction's plane with the two to each side: n words each, n a multiple of 4. */
    void (*spread)(const uint64_t *const from[OC_RAYS], uint64_t *const to[OC_RAYS], uint32_t n);

    /* Rays of the pixels set in wanted[4]. mid[d] is the block's first row in
     * the plane of edges whose gradient points along d, left[d] and right[d]
     * the same in the columns beside it; planes not set in live are empty. */
    void (*rays)(const oc_ray_table_t *table, const uint64_t *const left[OC_RAYS], const uint64_t *const mid[OC_RAYS],
                 const uint64_t *const right[OC_RAYS], uint32_t live, const uint64_t wanted[4], oc_ray_block_t *block);

    /* Derivative across each direction, mean of the samples; 0 unless all but one of them are beyond floor with the
     * mean's sign. apex points to the pair of the apex' pixel. Returns the directions, bit d, of at least the contrast
     * in which it is greatest. */
    uint32_t (*ring)(const oc_ring_table_t *table, const int16_t *apex, float floor, float contrast,
                     float ring[OC_RAYS]);

    /* Cotangent of the angle to the nearest other branch, for each; 0 without an acute angle. */
    void (*acute)(const oc_fit_crowd_t *crowd, float cot[OC_FIT_MAX_BRANCHES]);

    /* Ridge positions along n branches of one crowd, what the others add to its derivative near the apex taken off, and
     * the sums over them. All have a model or none. */
    void (*follow)(oc_fit_track_t track[], uint32_t n, const oc_fit_crowd_t *crowd, const oc_fit_blur_t *blur);

    /* Sums over some positions, bit m = sample m, at least one. */
    void (*sums)(const oc_fit_profile_t *profile, uint32_t places, float far_px, oc_fit_sums_t *sums);
} oc_kernels_t;

/* The kernels of a level, or of the best below it that this processor has. */
const oc_kernels_t *oc_kernels_get(oc_simd_t level);

extern const oc_kernels_t oc_kernels_scalar;
extern const oc_kernels_t oc_kernels_base;
#if defined(__x86_64__)
extern const oc_kernels_t oc_kernels_avx2;
#endif

#ifdef __cplusplus
}
#endif
#endif
