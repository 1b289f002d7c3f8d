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
#include "vehicle/simd.h"

#define KERNEL_INLINE static inline __attribute__((always_inline))

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

KERNEL_INLINE oc_words_t ray_shifted(const uint64_t *left, const uint64_t *mid, const uint64_t *right, int32_t dx,
                                     int32_t dy)
{
    const oc_words_t here = words_load(mid + dy);
    if (dx > 0) return (here >> dx) | (words_load(right + dy) << (64 - dx));
    if (dx < 0) return (here << -dx) | (words_load(left + dy) >> (64 + dx));
    return here;
}

/* Misses are counted in two bit planes; more than n_spare kills. */
KERNEL_INLINE oc_words_t ray_too_many(uint32_t n_spare, oc_words_t ones, oc_words_t twos, oc_words_t carry)
{
    if (n_spare == 0) return ones | twos | carry;
    if (n_spare == 1) return twos | carry;
    if (n_spare == 2) return (ones & twos) | carry;
    return carry;
}

KERNEL_INLINE oc_words_t ray_follow(const oc_ray_table_t *table, uint32_t direction, const uint64_t *left,
                                    const uint64_t *mid, const uint64_t *right, oc_words_t alive, oc_words_t *whole)
{
    const int8_t *dx = table->dx[direction], *dy = table->dy[direction];
    oc_words_t ones = {0}, twos = {0};
    alive &= ray_shifted(left, mid, right, dx[0], dy[0]);
    for (uint32_t s = 1; s < table->n_samples; s++) {
        if ((s & 1u) && !oc_words_any(&alive)) break;
        const oc_words_t miss = ~ray_shifted(left, mid, right, dx[s], dy[s]);
        const oc_words_t up = ones & miss;
        ones ^= miss;
        const oc_words_t carry = twos & up;
        twos ^= up;
        alive &= ~ray_too_many(table->n_spare, ones, twos, carry);
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

static void kernel_rays(const oc_ray_table_t *table, const uint64_t *const left[OC_RAYS],
                        const uint64_t *const mid[OC_RAYS], const uint64_t *const right[OC_RAYS], uint32_t live,
                        const uint64_t wanted[4], oc_ray_block_t *block)
{
    oc_words_t holds[OC_RAYS], wholes[OC_RAYS], any = {0};
    for (uint32_t d = 0; d < OC_RAYS; d++) holds[d] = wholes[d] = any;
    const oc_words_t start = words_load(wanted);
    for (uint32_t r = 0; r < 2u * OC_RAYS; r++) {
        const uint32_t p = ray_plane(r), direction = r % OC_RAYS;
        if (!(live >> p & 1u)) {
            memset(block->ray[r], 0, sizeof block->ray[r]);
            continue;
        }
        oc_words_t whole;
        const oc_words_t alive = ray_follow(table, direction, left[p], mid[p], right[p], start, &whole);
        memcpy(block->ray[r], &alive, sizeof alive);
        holds[direction] |= alive;
        wholes[direction] |= whole;
        any |= alive;
    }
    const oc_words_t weak = rays_paired(holds), strong = rays_paired(wholes);
    memcpy(block->weak, &weak, sizeof weak);
    memcpy(block->strong, &strong, sizeof strong);
}

#endif

/* ---- branch profiles ---- */

/* exp(-x^2 / 2), to 0.002. */
KERNEL_INLINE float bell(float x)
{
    float y = x * x;
    y = y < 16.0f ? y : 16.0f;
    float u = 1.0f - y * (1.0f / 64.0f) + y * y * (1.0f / 8192.0f);
    u *= u;
    u *= u;
    u *= u;
    u *= u;
    return u * u;
}

/* Integral of the unit Gaussian up to x, to 0.0014: a least-squares polynomial that reaches 0 and 1 at 3. */
KERNEL_INLINE float step_up(float x)
{
    x = x < 3.0f ? x : 3.0f;
    x = x > -3.0f ? x : -3.0f;
    const float y = x * x;
    return 0.5f +
           x * (0.39817785f + y * (-0.064430813f + y * (0.0083782524f + y * (-0.00064844084f + y * 2.1710264e-05f))));
}

#define MAX_TAPS (2 * OC_FIT_MAX_REACH + 3)

/* Derivatives round the expected line: tap k of sample m. */
typedef struct kernel_taps {
    uint32_t n_lanes;                       /* samples, rounded up to whole vectors */
    int32_t pair[MAX_TAPS][OC_FIT_SAMPLES]; /* dx and dy as they lie in memory */
    float along[MAX_TAPS][OC_FIT_SAMPLES];  /* the same turned into the branch's frame: along the branch */
    float normal[MAX_TAPS][OC_FIT_SAMPLES]; /* across it */
    float major[OC_FIT_SAMPLES];            /* from the apex */
    float centre[OC_FIT_SAMPLES];           /* middle tap from the apex, minor */
    float expected[OC_FIT_SAMPLES];         /* the line from the middle tap */
    int32_t is_inside[OC_FIT_SAMPLES];
} kernel_taps_t;

KERNEL_INLINE void taps_take(const oc_fit_walk_t *walk, kernel_taps_t *taps, const int32_t reach)
{
    const int32_t half = reach + 1, n_taps = 2 * half + 1, highest = walk->n_minor - 1 - half;
    const float slope = walk->slope, a_major = walk->a_major, a_minor = walk->a_minor;
    const int32_t first = walk->first, sign = walk->sign, n = (int32_t)walk->n;
    int32_t at[OC_FIT_SAMPLES];
    taps->n_lanes = (walk->n + 7u) / 8u * 8u;
    for (int32_t m = 0; m < (int32_t)taps->n_lanes; m++) {
        const int32_t major = first + sign * (m < n ? m : n - 1);
        const float from_apex = (float)major - a_major;
        const float expected = a_minor + from_apex * slope;
        /* Away from the image by less than the shift, so the cut is a floor. */
        const int32_t nearest = (int32_t)(expected + 64.5f) - 64;
        const int32_t low = nearest < half ? half : nearest;
        const int32_t centre = low > highest ? highest : low;
        at[m] = major * walk->step_major + (centre - half) * walk->step_minor;
        taps->major[m] = from_apex;
        taps->centre[m] = (float)centre - a_minor;
        taps->expected[m] = expected - (float)centre;
        taps->is_inside[m] = (int32_t)(centre == nearest) & (int32_t)(m < n);
    }
    for (uint32_t m = 0; m < taps->n_lanes; m++) {
        const int16_t *from = walk->dxdy + 2 * (ptrdiff_t)at[m];
        for (int32_t k = 0; k < n_taps; k++, from += 2 * walk->step_minor) {
            memcpy(&taps->pair[k][m], from, sizeof(int32_t));
        }
    }
    const float nx = walk->nx, ny = walk->ny;
    for (int32_t k = 0; k < n_taps; k++) {
        for (uint32_t m = 0; m < taps->n_lanes; m++) {
            const int32_t pair = taps->pair[k][m];
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
            const float dx = (float)(int16_t)(uint16_t)((uint32_t)pair & 0xffffu), dy = (float)(pair >> 16);
#else
            const float dx = (float)(pair >> 16), dy = (float)(int16_t)(uint16_t)((uint32_t)pair & 0xffffu);
#endif
            taps->normal[k][m] = dx * nx + dy * ny;
            taps->along[k][m] = dy * nx - dx * ny;
        }
    }
}

/* The three taps at the ridge, and where their middle is. */
typedef struct kernel_ridge {
    float before[OC_FIT_SAMPLES], middle[OC_FIT_SAMPLES], after[OC_FIT_SAMPLES];
    float along[OC_FIT_SAMPLES];
    float offset[OC_FIT_SAMPLES]; /* from the middle tap */
} kernel_ridge_t;

KERNEL_INLINE void ridge_find(const kernel_taps_t *taps, kernel_ridge_t *ridge, const int32_t reach)
{
    for (uint32_t m = 0; m < taps->n_lanes; m++) {
        float before = taps->normal[0][m], middle = taps->normal[1][m], after = taps->normal[2][m];
        float along = taps->along[1][m], offset = (float)-reach;
        for (int32_t k = 2; k <= 2 * reach + 1; k++) {
            const float here = taps->normal[k][m];
            const bool is_higher = here > middle;
            before = is_higher ? taps->normal[k - 1][m] : before;
            after = is_higher ? taps->normal[k + 1][m] : after;
            along = is_higher ? taps->along[k][m] : along;
            offset = is_higher ? (float)(k - 1 - reach) : offset;
            middle = is_higher ? here : middle;
        }
        ridge->before[m] = before;
        ridge->middle[m] = middle;
        ridge->after[m] = after;
        ridge->along[m] = along;
        ridge->offset[m] = offset;
    }
}

/* Lanes that hold the samples up to a distance from the apex. */
KERNEL_INLINE uint32_t lanes_until(const oc_fit_walk_t *walk, const kernel_taps_t *taps, float reach_px)
{
    const float major = walk->own_major < 0.0f ? -walk->own_major : walk->own_major;
    const float first = taps->major[0] < 0.0f ? -taps->major[0] : taps->major[0];
    const float n = reach_px * major - first + 1.0f;
    if (!(n < (float)taps->n_lanes)) return taps->n_lanes;
    return n > 0.0f ? ((uint32_t)n + 7u) / 8u * 8u : 0u;
}

/* Take off what a rival branch adds to the three taps. */
KERNEL_INLINE void ridge_clear(const oc_fit_walk_t *walk, const kernel_taps_t *taps, const oc_fit_rival_t *rival,
                               float inv_s, float inv_st, kernel_ridge_t *ridge)
{
    const bool flat = walk->is_flat;
    const float u_major = flat ? rival->ux : rival->uy, u_minor = flat ? rival->uy : rival->ux;
    const float amplitude = rival->amplitude;
    const uint32_t n_lanes = lanes_until(walk, taps, rival->reach_px);
    for (uint32_t m = 0; m < n_lanes; m++) {
        const float minor = taps->centre[m] + ridge->offset[m];
        const float t = (taps->major[m] * u_major + minor * u_minor) * inv_st, dt = u_minor * inv_st;
        const float d = (minor * u_major - taps->major[m] * u_minor) * inv_s, dd = u_major * inv_s;
        ridge->before[m] -= amplitude * bell(d - dd) * step_up(t - dt);
        ridge->middle[m] -= amplitude * bell(d) * step_up(t);
        ridge->after[m] -= amplitude * bell(d + dd) * step_up(t + dt);
    }
}

/* The branch's own ridge rises along the branch; a profile that is not square
 * to it sees that as slope. */
KERNEL_INLINE void ridge_level(const oc_fit_walk_t *walk, const kernel_taps_t *taps, float inv_st,
                               kernel_ridge_t *ridge)
{
    const float u_major = walk->own_major * inv_st, u_minor = walk->own_minor * inv_st;
    const uint32_t n_lanes = lanes_until(walk, taps, 3.0f / inv_st + 1.0f);
    for (uint32_t m = 0; m < n_lanes; m++) {
        const float minor = taps->centre[m] + ridge->offset[m];
        const float t = taps->major[m] * u_major + minor * u_minor;
        const float here = step_up(t);
        ridge->before[m] *= here / (step_up(t - u_minor) + 0.01f);
        ridge->after[m] *= here / (step_up(t + u_minor) + 0.01f);
        ridge->middle[m] *= here / (here + 0.01f);
    }
}

/* Vertex of the parabola through the three taps, put right for a Gaussian. */
KERNEL_INLINE void ridge_peak(const oc_fit_walk_t *walk, const kernel_taps_t *taps, const kernel_ridge_t *ridge,
                              float s2, float inv_st, const float most, oc_fit_profile_t *out)
{
    /* The minor axis on the normal and along the branch. */
    const float to_d = walk->is_flat ? walk->own_major : -walk->own_major, to_t = walk->own_minor;
    const float per_major = 1.0f / walk->own_major;
    const float gain = 0.25f / s2 + (1.0f / 24.0f) / (s2 * s2);
    const float floor = walk->floor;
    for (uint32_t m = 0; m < taps->n_lanes; m++) {
        const float middle = ridge->middle[m];
        const float bend = 2.0f * middle - ridge->before[m] - ridge->after[m];
        const float slope = ridge->after[m] - ridge->before[m];
        const bool is_bent = bend > 0.0f;
        const float p = 0.5f * slope / (is_bent ? bend : 1.0f);
        const float near = p > 0.5f ? 0.5f : (p < -0.5f ? -0.5f : p);
        const float aside = ridge->along[m] < 0.0f ? -ridge->along[m] : ridge->along[m];
        const float across = ridge->offset[m] + p + gain * near * (1.0f - 4.0f * near * near) - taps->expected[m];
        const float t = taps->major[m] * per_major + across * to_t;
        out->t[m] = t;
        out->d[m] = across * to_d;
        out->gain[m] = step_up(t * inv_st);
        out->value[m] = middle;
        out->bend[m] = bend;
        const int32_t is_edge = (int32_t)(middle > floor) & (int32_t)(aside <= 0.62f * middle) & taps->is_inside[m];
        const int32_t is_placed = (int32_t)is_bent & (int32_t)(p <= most) & (int32_t)(p >= -most);
        out->found[m] = is_edge + (is_edge & is_placed);
    }
}

KERNEL_INLINE void profile_reach(const oc_fit_walk_t *walk, const oc_fit_rival_t rivals[], uint32_t n_rivals, float s2,
                                 float inv_s, float inv_st, oc_fit_profile_t *out, const int32_t reach)
{
    kernel_taps_t taps;
    kernel_ridge_t ridge;
    taps_take(walk, &taps, reach);
    ridge_find(&taps, &ridge, reach);
    for (uint32_t j = 0; j < n_rivals; j++) ridge_clear(walk, &taps, &rivals[j], inv_s, inv_st, &ridge);
    if (walk->has_model) ridge_level(walk, &taps, inv_st, &ridge);
    /* Without a search the ridge may be nearer to the next pixel. */
    ridge_peak(walk, &taps, &ridge, s2, inv_st, reach == 0 ? 1.0f : 0.51f, out);
}

static void kernel_profile(const oc_fit_walk_t *walk, const oc_fit_rival_t rivals[], uint32_t n_rivals, float s2,
                           float inv_s, float inv_st, oc_fit_profile_t *out)
{
    switch (walk->reach) {
    case 0: profile_reach(walk, rivals, n_rivals, s2, inv_s, inv_st, out, 0); break;
    case 1: profile_reach(walk, rivals, n_rivals, s2, inv_s, inv_st, out, 1); break;
    default: profile_reach(walk, rivals, n_rivals, s2, inv_s, inv_st, out, 2); break;
    }
}

/* ---- sums ---- */

typedef float lanes_t __attribute__((vector_size(32)));
typedef int32_t lanes_mask_t __attribute__((vector_size(32)));

KERNEL_INLINE lanes_t lanes_load(const float *from)
{
    lanes_t v;
    memcpy(&v, from, sizeof v);
    return v;
}

KERNEL_INLINE lanes_t lanes_where(lanes_mask_t mask, lanes_t v)
{
    return (lanes_t)(mask & (lanes_mask_t)v);
}

/* Lanes are summed apart and added up in one fixed order. */
KERNEL_INLINE float lanes_sum(lanes_t v)
{
    return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

static void kernel_sums(const oc_fit_profile_t *p, uint32_t end, float far_px, oc_fit_sums_t *sums)
{
    static const lanes_mask_t order = {0, 1, 2, 3, 4, 5, 6, 7};
    lanes_t w = {0}, wt = w, wtt = w, wd = w, wtd = w, wdd = w, value = w, bend = w, level = w;
    for (uint32_t m = 0; m < end; m += 8) {
        lanes_mask_t found;
        memcpy(&found, p->found + m, sizeof found);
        const lanes_mask_t counts = (found == 2) & (order < (int32_t)(end - m));
        const lanes_t t = lanes_load(p->t + m), d = lanes_load(p->d + m);
        const lanes_t gain = lanes_where(counts, lanes_load(p->gain + m));
        const lanes_t v = lanes_where(counts, lanes_load(p->value + m));
        const lanes_mask_t is_far = counts & (t >= far_px);
        const lanes_t weight = gain * gain, weight_t = weight * t, weight_d = weight * d;
        w += weight;
        wt += weight_t;
        wtt += weight_t * t;
        wd += weight_d;
        wtd += weight_t * d;
        wdd += weight_d * d;
        value += v * gain;
        bend += lanes_where(is_far, lanes_load(p->bend + m));
        level += lanes_where(is_far, v);
    }
    *sums = (oc_fit_sums_t){lanes_sum(w),   lanes_sum(wt),    lanes_sum(wtt),  lanes_sum(wd),   lanes_sum(wtd),
                            lanes_sum(wdd), lanes_sum(value), lanes_sum(bend), lanes_sum(level)};
}

/* ---- round the apex ---- */

static void kernel_ring(const oc_ring_table_t *table, const int16_t *apex, int32_t width, float floor,
                        float ring[OC_RAYS])
{
    float gx[OC_RING_SAMPLES][OC_RAYS], gy[OC_RING_SAMPLES][OC_RAYS];
    for (uint32_t s = 0; s < OC_RING_SAMPLES; s++) {
        for (uint32_t d = 0; d < OC_RAYS; d++) {
            const int16_t *at = apex + 2 * (table->dy[s][d] * width + table->dx[s][d]);
            gx[s][d] = at[0];
            gy[s][d] = at[1];
        }
    }
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        float sum = 0.0f;
        int32_t n_front = 0, n_back = 0;
        for (uint32_t s = 0; s < OC_RING_SAMPLES; s++) {
            const float v = table->ux[d] * gy[s][d] - table->uy[d] * gx[s][d];
            sum += v;
            n_front += (int32_t)(v > floor);
            n_back += (int32_t)(v < -floor);
        }
        const int32_t n_steady = sum > 0.0f ? n_front : n_back;
        ring[d] = n_steady >= (int32_t)OC_RING_SAMPLES - 1 ? sum * (1.0f / OC_RING_SAMPLES) : 0.0f;
    }
}

const oc_kernels_t OC_KERNELS_TABLE = {
    .level = OC_KERNELS_LEVEL,
    .down = kernel_down,
    .across = kernel_across,
    .differ = kernel_differ,
    .thin = kernel_thin,
    .spread = kernel_spread,
    .rays = kernel_rays,
    .ring = kernel_ring,
    .profile = kernel_profile,
    .sums = kernel_sums,
};

#endif
