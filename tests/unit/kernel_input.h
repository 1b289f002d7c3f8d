/* SPDX-License-Identifier: BSD-3-Clause
 * Input for the detector's kernels: random numbers, bit planes, ray tables, and rays as plain sets of pixels. */
#ifndef OUTCROP_TESTS_KERNEL_INPUT_H
#define OUTCROP_TESTS_KERNEL_INPUT_H

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <string.h>

#include "vehicle/kernels.h"

/* Repeatable random numbers (xorshift), state not 0. */
typedef struct kernel_random {
    uint64_t state;
} kernel_random_t;

static inline uint64_t kernel_next(kernel_random_t *random)
{
    random->state ^= random->state << 13;
    random->state ^= random->state >> 7;
    random->state ^= random->state << 17;
    return random->state * 0x2545f4914f6cdd1du;
}

/* 0..limit - 1 */
static inline uint32_t kernel_below(kernel_random_t *random, uint32_t limit)
{
    return (uint32_t)((kernel_next(random) >> 32) * limit >> 32);
}

static inline float kernel_uniform(kernel_random_t *random, float low, float high)
{
    return low + (high - low) * (float)(kernel_next(random) >> 40) / 16777216.0f;
}

/* Bits with a share of: none, an eighth, a quarter, a half, three quarters, all. */
static inline uint64_t kernel_word(kernel_random_t *random, uint32_t share)
{
    const uint64_t a = kernel_next(random), b = kernel_next(random), c = kernel_next(random);
    switch (share) {
    case 0: return 0;
    case 1: return a & b & c;
    case 2: return a & b;
    case 3: return a;
    case 4: return a | b;
    default: return UINT64_MAX;
    }
}

#define KERNEL_ROWS 24
#define KERNEL_FIRST_ROW 10 /* of the block, rows before and after it are looked at */

/* Three columns of planes round one block. */
typedef struct kernel_planes {
    uint64_t left[OC_RAYS][KERNEL_ROWS], mid[OC_RAYS][KERNEL_ROWS], right[OC_RAYS][KERNEL_ROWS];
    const uint64_t *left_at[OC_RAYS], *mid_at[OC_RAYS], *right_at[OC_RAYS];
    uint32_t live;
} kernel_planes_t;

/* Some planes empty, the others thin to crowded; planes that are not live are empty, those that are may be. */
static inline void kernel_planes_fill(kernel_random_t *random, kernel_planes_t *planes)
{
    const uint32_t crowd = kernel_below(random, 4) + 2u;
    planes->live = (uint32_t)kernel_word(random, kernel_below(random, 3) + 3u);
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        planes->left_at[d] = planes->left[d] + KERNEL_FIRST_ROW;
        planes->mid_at[d] = planes->mid[d] + KERNEL_FIRST_ROW;
        planes->right_at[d] = planes->right[d] + KERNEL_FIRST_ROW;
        const bool is_live = planes->live >> d & 1u;
        for (uint32_t i = 0; i < KERNEL_ROWS; i++) {
            const uint32_t share = is_live ? crowd : 0;
            planes->left[d][i] = kernel_word(random, share);
            planes->mid[d][i] = kernel_word(random, share);
            planes->right[d][i] = kernel_word(random, share);
        }
    }
}

/* A table as the search makes it: any radius, samples and misses. */
static inline void kernel_table_any(kernel_random_t *random, oc_ray_table_t *table)
{
    const int32_t radius = (int32_t)kernel_below(random, 4) + 5;
    table->n_samples = (uint32_t)radius - 1u;
    table->n_spare = kernel_below(random, 4);
    memset(table->dx, 0, sizeof table->dx);
    memset(table->dy, 0, sizeof table->dy);
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        for (uint32_t s = 0; s < table->n_samples; s++) {
            const double angle = d * 6.283185307179586 / OC_RAYS, t = radius - (int32_t)s;
            table->dx[d][s] = (int8_t)lrint(t * cos(angle));
            table->dy[d][s] = (int8_t)lrint(t * sin(angle));
        }
    }
}

/* Is the pixel (x, y) of the block's frame in the plane of edges whose gradient points along d? */
static inline bool kernel_plane_has(const kernel_planes_t *planes, uint32_t d, int32_t x, int32_t y)
{
    const uint64_t *column = x < 0 ? planes->left[d] : x < 64 ? planes->mid[d] : planes->right[d];
    return column[KERNEL_FIRST_ROW + y] >> ((uint32_t)(x + 64) % 64u) & 1u;
}

/* Two directions that are neither equal nor opposite: 3 to 13 steps of a 32nd turn apart, either way round. */
static inline bool kernel_has_pair(uint32_t directions)
{
    for (uint32_t a = 0; a < OC_RAYS; a++) {
        for (uint32_t b = 0; b < a; b++) {
            const uint32_t turn = a - b < 16u ? a - b : 32u - (a - b);
            if (directions >> a & directions >> b & 1u && turn >= 3 && turn <= 13) return true;
        }
    }
    return false;
}

/* From the definition: a ray holds when its sample on the circle is set and at most n_spare of the others are not. */
static inline void kernel_rays_expected(const oc_ray_table_t *table, const kernel_planes_t *planes,
                                        const uint64_t wanted[4], oc_ray_block_t *block)
{
    memset(block, 0, sizeof *block);
    for (int32_t y = 0; y < 4; y++) {
        for (int32_t x = 0; x < 64; x++) {
            if (!(wanted[y] >> x & 1u)) continue;
            uint32_t holds = 0, is_whole = 0;
            for (uint32_t side = 0; side < 2; side++) {
                for (uint32_t d = 0; d < OC_RAYS; d++) {
                    const uint32_t gradient = (d + (side == 0 ? 8u : 24u)) % OC_RAYS; /* a quarter turn left or right */
                    uint32_t n_set = 0;
                    for (uint32_t s = 0; s < table->n_samples; s++) {
                        n_set += kernel_plane_has(planes, gradient, x + table->dx[d][s], y + table->dy[d][s]);
                    }
                    const bool on_circle = kernel_plane_has(planes, gradient, x + table->dx[d][0], y + table->dy[d][0]);
                    if (!on_circle || n_set + table->n_spare < table->n_samples) continue;
                    block->ray[side * OC_RAYS + d][y] |= (uint64_t)1 << x;
                    holds |= 1u << d;
                    if (n_set == table->n_samples) is_whole |= 1u << d;
                }
            }
            if (kernel_has_pair(holds)) block->weak[y] |= (uint64_t)1 << x;
            if (kernel_has_pair(is_whole)) block->strong[y] |= (uint64_t)1 << x;
        }
    }
}

#endif
