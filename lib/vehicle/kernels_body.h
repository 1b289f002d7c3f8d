/* SPDX-License-Identifier: BSD-3-Clause
 * The kernels themselves. Included once by each kernels_LEVEL.c, which says how it is compiled:
 * OC_KERNELS_TABLE, OC_KERNELS_LEVEL, and OC_KERNELS_SCALAR for the twin without vectors.
 *
 * Loops are written so that a compiler sees independent lanes; nothing is summed across lanes here, so every level
 * gives the same bits. */
#ifndef OUTCROP_VEHICLE_KERNELS_BODY_H
#define OUTCROP_VEHICLE_KERNELS_BODY_H

#include <math.h>
#include <string.h>

#include "vehicle/kernels.h"
#include "vehicle/kernels_branch_body.h"
#include "vehicle/simd.h"

/* tan 22.5 degrees in 1/128: which neighbours lie along a gradient. */
#define TAN_22_128 53

/* ---- gradient rows ---- */

KERNEL_INLINE void down_radius(const uint8_t *const rows[], const uint16_t kernel[], const int32_t radius,
                               uint32_t width, uint16_t *restrict out)
{
    const uint8_t *row[2 * OC_GRADIENT_MAX_RADIUS + 1];
    uint16_t weight[OC_GRADIENT_MAX_RADIUS + 1];
    for (int32_t i = 0; i <= 2 * radius; i++) row[i] = rows[i];
    for (int32_t i = 0; i <= radius; i++) weight[i] = kernel[i];
    for (int32_t x = 0; x < (int32_t)width; x++) {
        uint16_t sum = (uint16_t)(row[radius][x] * weight[0]);
        for (int32_t i = 1; i <= radius; i++) {
            const uint16_t both = (uint16_t)(row[radius - i][x] + row[radius + i][x]);
            sum = (uint16_t)(sum + (uint16_t)(both * weight[i]));
        }
        out[x] = (uint16_t)(sum >> 1); /* 255 * 256 fits 16 bits; two of these will too */
    }
}

static void kernel_down(const uint8_t *const rows[], const uint16_t kernel[], int32_t radius, uint32_t width,
                        uint16_t *out)
{
    switch (radius) { /* a constant radius keeps the sum in registers */
    case 3: down_radius(rows, kernel, 3, width, out); break;
    case 4: down_radius(rows, kernel, 4, width, out); break;
    case 5: down_radius(rows, kernel, 5, width, out); break;
    default: down_radius(rows, kernel, radius, width, out); break;
    }
}

KERNEL_INLINE void across_radius(const uint16_t *restrict in, const uint16_t kernel[], const int32_t radius,
                                 uint32_t width, int16_t *restrict out)
{
    uint16_t weight[OC_GRADIENT_MAX_RADIUS + 1];
    for (int32_t i = 0; i <= radius; i++) weight[i] = (uint16_t)(kernel[i] << 8);
    for (int32_t x = 0; x < (int32_t)width; x++) {
        uint16_t sum = (uint16_t)(((uint32_t)in[x] * weight[0]) >> 16);
        for (int32_t i = 1; i <= radius; i++) {
            const uint16_t both = (uint16_t)(in[x - i] + in[x + i]);
            sum = (uint16_t)(sum + (uint16_t)(((uint32_t)both * weight[i]) >> 16));
        }
        out[x] = (int16_t)sum;
    }
}

static void kernel_across(const uint16_t *in, const uint16_t kernel[], int32_t radius, uint32_t width, int16_t *out)
{
    switch (radius) {
    case 3: across_radius(in, kernel, 3, width, out); break;
    case 4: across_radius(in, kernel, 4, width, out); break;
    case 5: across_radius(in, kernel, 5, width, out); break;
    default: across_radius(in, kernel, radius, width, out); break;
    }
}

static void kernel_differ(const int16_t *restrict above, const int16_t *restrict here, const int16_t *restrict below,
                          uint32_t width, int16_t *restrict dxdy, int16_t *restrict dx, int16_t *restrict dy,
                          int16_t *restrict magnitude)
{
    for (int32_t x = 0; x < (int32_t)width; x++) {
        dx[x] = (int16_t)(here[x + 1] - here[x - 1]);
        dy[x] = (int16_t)(below[x] - above[x]);
    }
    for (int32_t x = 0; x < (int32_t)width; x++) {
        dxdy[2 * x] = dx[x];
        dxdy[2 * x + 1] = dy[x];
    }
    for (int32_t x = 0; x < (int32_t)width; x++) {
        const float gx = dx[x];
        const float gy = dy[x];
        const int32_t m = (int32_t)(sqrtf(gx * gx + gy * gy) + 0.5f);
        magnitude[x] = (int16_t)(m < INT16_MAX ? m : INT16_MAX);
    }
}

/* 64 pixels of a row. Of two equal neighbours the first in reading order is
 * the maximum. */
KERNEL_INLINE void thin_word(const int16_t *restrict above, const int16_t *restrict here, const int16_t *restrict below,
                             const int16_t *restrict dx, const int16_t *restrict dy, int16_t threshold,
                             int16_t thick[restrict 64], int16_t thin[restrict 64])
{
    for (int32_t x = 0; x < 64; x++) {
        const int16_t ax = (int16_t)(dx[x] < 0 ? -dx[x] : dx[x]);
        const int16_t ay = (int16_t)(dy[x] < 0 ? -dy[x] : dy[x]);
        const uint16_t low_x = (uint16_t)((uint16_t)((uint16_t)((uint16_t)ax >> 5) * TAN_22_128) >> 2);
        const uint16_t low_y = (uint16_t)((uint16_t)((uint16_t)((uint16_t)ay >> 5) * TAN_22_128) >> 2);
        const int16_t flat = ay <= (int16_t)low_x ? -1 : 0;  /* gradient along x */
        const int16_t steep = ax <= (int16_t)low_y ? -1 : 0; /* along y */
        const int16_t same = (int16_t)(dx[x] ^ dy[x]) >= 0 ? -1 : 0;
        const int16_t diagonal_before = (int16_t)((same & above[x - 1]) | (~same & above[x + 1]));
        const int16_t diagonal_after = (int16_t)((same & below[x + 1]) | (~same & below[x - 1]));
        const int16_t upright_before = (int16_t)((steep & above[x]) | (~steep & diagonal_before));
        const int16_t upright_after = (int16_t)((steep & below[x]) | (~steep & diagonal_after));
        const int16_t before = (int16_t)((flat & here[x - 1]) | (~flat & upright_before));
        const int16_t after = (int16_t)((flat & here[x + 1]) | (~flat & upright_after));
        const int16_t m = here[x];
        const int16_t is_thick = m >= threshold ? -1 : 0;
        const int16_t is_first = m > before ? -1 : 0;
        const int16_t is_last = m >= after ? -1 : 0;
        thick[x] = is_thick;
        thin[x] = (int16_t)(is_thick & is_first & is_last);
    }
}

static void kernel_thin(const int16_t *above, const int16_t *here, const int16_t *below, const int16_t *dx,
                        const int16_t *dy, uint32_t width, int16_t threshold, uint64_t thick[], uint64_t thin[])
{
    for (uint32_t x = 0; x < width; x += 64) {
        int16_t most = 0;
        for (uint32_t i = 0; i < 64; i++) most = here[x + i] > most ? here[x + i] : most;
        thick[x / 64u] = thin[x / 64u] = 0;
        if (most < threshold) continue;

        int16_t thick_mask[64], thin_mask[64];
        thin_word(above + x, here + x, below + x, dx + x, dy + x, threshold, thick_mask, thin_mask);
        thick[x / 64u] = oc_bits_of_masks(thick_mask);
        thin[x / 64u] = oc_bits_of_masks(thin_mask);
    }
}

/* ---- rays ---- */

/* The plane that ray r looks at: its gradient is a quarter turn to the left or right. */
KERNEL_INLINE uint32_t ray_plane(uint32_t r)
{
    const uint32_t direction = r % OC_RAYS;
    return (direction + (r < OC_RAYS ? OC_RAYS / 4u : 3u * OC_RAYS / 4u)) % OC_RAYS;
}

static void kernel_spread(const uint64_t *const from[OC_RAYS], uint64_t *const to[OC_RAYS], uint32_t n)
{
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        const uint64_t *restrict a = from[(d + OC_RAYS - 2u) % OC_RAYS], *restrict b =
                                                                             from[(d + OC_RAYS - 1u) % OC_RAYS];
        const uint64_t *restrict c = from[d], *restrict e = from[(d + 1u) % OC_RAYS];
        const uint64_t *restrict f = from[(d + 2u) % OC_RAYS];
        uint64_t *restrict out = to[d];
        for (uint32_t i = 0; i < n; i++) out[i] = a[i] | b[i] | c[i] | e[i] | f[i];
    }
}

#if defined(OC_KERNELS_SCALAR)

static bool ray_sample(const uint64_t *left, const uint64_t *mid, const uint64_t *right, int32_t x, int32_t y)
{
    const uint64_t *word = x < 0 ? left : x > 63 ? right : mid;
    return (word[y] >> ((uint32_t)x & 63u)) & 1u;
}

/* Misses of a ray from one pixel, or n_spare + 1 when it does not hold. */
static uint32_t ray_misses(const oc_ray_table_t *table, uint32_t direction, const uint64_t *left, const uint64_t *mid,
                           const uint64_t *right, int32_t x, int32_t y)
{
    uint32_t misses = 0;
    for (uint32_t s = 0; s < table->n_samples; s++) {
        if (ray_sample(left, mid, right, x + table->dx[direction][s], y + table->dy[direction][s])) continue;
        misses++;
        if (s == 0 || misses > table->n_spare) return table->n_spare + 1u;
    }
    return misses;
}

static bool rays_have_pair(const bool holds[OC_RAYS])
{
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        for (uint32_t apart = 3; apart <= 13; apart++) {
            if (holds[d] && holds[(d + apart) % OC_RAYS]) return true;
        }
    }
    return false;
}

static void rays_of_pixel(const oc_ray_table_t *table, const uint64_t *const left[], const uint64_t *const mid[],
                          const uint64_t *const right[], int32_t x, int32_t y, oc_ray_block_t *block)
{
    bool holds[OC_RAYS] = {false}, is_whole[OC_RAYS] = {false};
    for (uint32_t r = 0; r < 2u * OC_RAYS; r++) {
        const uint32_t p = ray_plane(r), direction = r % OC_RAYS;
        const uint32_t misses = ray_misses(table, direction, left[p], mid[p], right[p], x, y);
        if (misses > table->n_spare) continue;
        block->ray[r][y] |= (uint64_t)1 << x;
        holds[direction] = true;
        is_whole[direction] |= misses == 0;
    }
    if (rays_have_pair(holds)) block->weak[y] |= (uint64_t)1 << x;
    if (rays_have_pair(is_whole)) block->strong[y] |= (uint64_t)1 << x;
}

static void kernel_rays(const oc_ray_table_t *table, const uint64_t *const left[OC_RAYS],
                        const uint64_t *const mid[OC_RAYS], const uint64_t *const right[OC_RAYS], uint32_t live,
                        const uint64_t wanted[4], oc_ray_block_t *block)
{
    (void)live;
    memset(block, 0, sizeof *block);
    for (int32_t y = 0; y < 4; y++) {
        for (int32_t x = 0; x < 64; x++) {
            if ((wanted[y] >> x) & 1u) rays_of_pixel(table, left, mid, right, x, y, block);
        }
    }
}

#else

KERNEL_INLINE oc_words_t words_load(const uint64_t *from)
{
    oc_words_t words;
    memcpy(&words, from, sizeof words);
    return words;
}

/* Pixels k columns further, and where the word ends those of the one beside it. */
KERNEL_INLINE oc_words_t ray_to_right(const uint64_t *mid, const uint64_t *right, int32_t k)
{
    return (words_load(mid) >> k) | (words_load(right) << 1 << (63 - k));
}

KERNEL_INLINE oc_words_t ray_to_left(const uint64_t *mid, const uint64_t *left, int32_t k)
{
    return (words_load(mid) << k) | (words_load(left) >> 1 >> (63 - k));
}

/* Misses are counted in two bit planes; more than n_spare kills. */
KERNEL_INLINE oc_words_t ray_too_many(uint32_t n_spare, oc_words_t ones, oc_words_t twos, oc_words_t carry)
{
    if (n_spare == 0) return ones | twos | carry;
    if (n_spare == 1) return twos | carry;
    if (n_spare == 2) return (ones & twos) | carry;
    return carry;
}

/* Sample s of all rays of one direction. */
KERNEL_INLINE oc_words_t ray_sample(const oc_ray_table_t *table, uint32_t direction, uint32_t s, const uint64_t *side,
                                    const uint64_t *mid, bool is_left)
{
    const int32_t dx = table->dx[direction][s], dy = table->dy[direction][s];
    return is_left ? ray_to_left(mid + dy, side + dy, -dx) : ray_to_right(mid + dy, side + dy, dx);
}

/* Most rays end at the first sample; which of the others do is not worth a branch. */
KERNEL_INLINE oc_words_t ray_follow(const oc_ray_table_t *table, uint32_t direction, const uint64_t *side,
                                    const uint64_t *mid, bool is_left, oc_words_t alive, oc_words_t *whole,
                                    const uint32_t n_samples, const uint32_t n_spare)
{
    alive &= ray_sample(table, direction, 0, side, mid, is_left);
    *whole = alive;
    if (!oc_words_any(&alive)) return alive;
    if (n_samples == 5 && n_spare == 2) { /* two of four */
        const oc_words_t a = ray_sample(table, direction, 1, side, mid, is_left);
        const oc_words_t b = ray_sample(table, direction, 2, side, mid, is_left);
        const oc_words_t c = ray_sample(table, direction, 3, side, mid, is_left);
        const oc_words_t e = ray_sample(table, direction, 4, side, mid, is_left);
        *whole = alive & (a & b) & (c & e);
        return alive & ((a & b) | (c & e) | ((a | b) & (c | e)));
    }
    oc_words_t ones = {0}, twos = {0};
    for (uint32_t s = 1; s < n_samples; s++) {
        const oc_words_t miss = ~ray_sample(table, direction, s, side, mid, is_left);
        const oc_words_t up = ones & miss;
        ones ^= miss;
        const oc_words_t carry = twos & up;
        twos ^= up;
        alive &= ~ray_too_many(n_spare, ones, twos, carry);
    }
    *whole = alive & ~(ones | twos);
    return alive;
}

/* Pixels that have two directions 3 to 13 steps apart. */
KERNEL_INLINE oc_words_t rays_paired(const oc_words_t holds[OC_RAYS])
{
    oc_words_t two[OC_RAYS], four[OC_RAYS], eight[OC_RAYS], paired = {0};
    for (uint32_t d = 0; d < OC_RAYS; d++) two[d] = holds[d] | holds[(d + 1u) % OC_RAYS];
    for (uint32_t d = 0; d < OC_RAYS; d++) four[d] = two[d] | two[(d + 2u) % OC_RAYS];
    for (uint32_t d = 0; d < OC_RAYS; d++) eight[d] = four[d] | four[(d + 4u) % OC_RAYS];
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        paired |= holds[d] & (eight[(d + 3u) % OC_RAYS] | four[(d + 10u) % OC_RAYS]);
    }
    return paired;
}

KERNEL_INLINE void rays_follow(const oc_ray_table_t *table, const uint64_t *const left[OC_RAYS],
                               const uint64_t *const mid[OC_RAYS], const uint64_t *const right[OC_RAYS], uint32_t live,
                               const uint64_t wanted[4], oc_ray_block_t *block, const uint32_t n_samples,
                               const uint32_t n_spare)
{
    const oc_words_t start = words_load(wanted), none = {0};
    oc_words_t holds[OC_RAYS], wholes[OC_RAYS], any = none;
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        holds[d] = wholes[d] = none;
        for (uint32_t r = d; r < 2u * OC_RAYS; r += OC_RAYS) {
            const uint32_t p = ray_plane(r);
            oc_words_t alive = none, whole = none;
            if (live >> p & 1u) {
                alive = table->dx[d][0] < 0
                            ? ray_follow(table, d, left[p], mid[p], true, start, &whole, n_samples, n_spare)
                            : ray_follow(table, d, right[p], mid[p], false, start, &whole, n_samples, n_spare);
            }
            memcpy(block->ray[r], &alive, sizeof alive);
            holds[d] |= alive;
            wholes[d] |= whole;
        }
        any |= holds[d];
    }
    const bool has_any = oc_words_any(&any);
    const oc_words_t weak = has_any ? rays_paired(holds) : none, strong = has_any ? rays_paired(wholes) : none;
    memcpy(block->weak, &weak, sizeof weak);
    memcpy(block->strong, &strong, sizeof strong);
}

static void kernel_rays(const oc_ray_table_t *table, const uint64_t *const left[OC_RAYS],
                        const uint64_t *const mid[OC_RAYS], const uint64_t *const right[OC_RAYS], uint32_t live,
                        const uint64_t wanted[4], oc_ray_block_t *block)
{
    const uint32_t n = table->n_samples;
    if (n == 5 && table->n_spare == 2) {
        rays_follow(table, left, mid, right, live, wanted, block, 5, 2);
    } else {
        rays_follow(table, left, mid, right, live, wanted, block, n, table->n_spare);
    }
}

#endif

const oc_kernels_t OC_KERNELS_TABLE = {
    .level = OC_KERNELS_LEVEL,
    .down = kernel_down,
    .across = kernel_across,
    .differ = kernel_differ,
    .thin = kernel_thin,
    .spread = kernel_spread,
    .rays = kernel_rays,
    .ring = kernel_ring,
    .acute = kernel_acute,
    .follow = kernel_follow,
    .sums = kernel_sums,
};

#endif
