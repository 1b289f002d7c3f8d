/* SPDX-License-Identifier: BSD-3-Clause
 * 8x8 grey blocks: exact-integer transform, quantiser, run and level codes. */
#include "core/blocks.h"

#include <stdbool.h>
#include <string.h>

#define SIDE 8
#define N_SAMPLES 64

/* Fixed points: transform matrix 2^13, coefficients 2^3. */
#define MATRIX_SHIFT 13u
#define COEF_SHIFT 3u
#define COEF_MAX 16383 /* orthonormal coefficients of +-128 lie in +-1024 */
#define LEVEL_MAX 4095

/* Orthonormal cosine basis, row = frequency: round(8192 c(u) cos((2 x + 1) u pi / 16)). */
static const int32_t basis[SIDE][SIDE] = {
    {2896, 2896, 2896, 2896, 2896, 2896, 2896, 2896},     {4017, 3406, 2276, 799, -799, -2276, -3406, -4017},
    {3784, 1567, -1567, -3784, -3784, -1567, 1567, 3784}, {3406, -799, -4017, -2276, 2276, 4017, 799, -3406},
    {2896, -2896, -2896, 2896, 2896, -2896, -2896, 2896}, {2276, -4017, 799, 3406, -3406, -799, 4017, -2276},
    {1567, -3784, 3784, -1567, -1567, 3784, -3784, 1567}, {799, -2276, 3406, -4017, 4017, -3406, 2276, -799},
};

/* Diagonals from low to high frequency. */
static const uint8_t zigzag[N_SAMPLES] = {
    0,  1,  8,  16, 9,  2,  3,  10, 17, 24, 32, 25, 18, 11, 4,  5,  12, 19, 26, 33, 40, 48,
    41, 34, 27, 20, 13, 6,  7,  14, 21, 28, 35, 42, 49, 56, 57, 50, 43, 36, 29, 22, 15, 23,
    30, 37, 44, 51, 58, 59, 52, 45, 38, 31, 39, 46, 53, 60, 61, 54, 47, 55, 62, 63,
};

/* Halves away from zero; shifting a negative number is left to no compiler. */
static int32_t shift_rounded(int32_t value, unsigned shift)
{
    const int32_t half = (int32_t)1 << (shift - 1u);
    return value >= 0 ? (value + half) >> shift : -((-value + half) >> shift);
}

static int32_t clamp(int32_t value, int32_t low, int32_t high)
{
    return value < low ? low : value > high ? high : value;
}

/* ---- transform ---- */

/* Rows, then columns. No row of the basis sums to more than 23,168 in size:
 * sums stay below 2^22 and 2^27. */
static void transform(const uint8_t px[N_SAMPLES], int32_t coef[N_SAMPLES])
{
    int32_t rows[N_SAMPLES];
    for (int y = 0; y < SIDE; y++) {
        for (int u = 0; u < SIDE; u++) {
            int32_t sum = 0;
            for (int x = 0; x < SIDE; x++) {
                sum += basis[u][x] * (px[y * SIDE + x] - 128);
            }
            rows[y * SIDE + u] = shift_rounded(sum, MATRIX_SHIFT - COEF_SHIFT);
        }
    }
    for (int u = 0; u < SIDE; u++) {
        for (int v = 0; v < SIDE; v++) {
            int32_t sum = 0;
            for (int y = 0; y < SIDE; y++) {
                sum += basis[v][y] * rows[y * SIDE + u];
            }
            coef[v * SIDE + u] = shift_rounded(sum, MATRIX_SHIFT);
        }
    }
}

/* Columns, then rows. No column of the basis sums to more than 21,641 in size:
 * with |coef| < 2^14 sums stay below 2^29 and 2^30. */
static void transform_back(const int32_t coef[N_SAMPLES], uint8_t px[N_SAMPLES])
{
    int32_t columns[N_SAMPLES];
    for (int u = 0; u < SIDE; u++) {
        for (int y = 0; y < SIDE; y++) {
            int32_t sum = 0;
            for (int v = 0; v < SIDE; v++) {
                sum += basis[v][y] * coef[v * SIDE + u];
            }
            columns[y * SIDE + u] = shift_rounded(sum, MATRIX_SHIFT);
        }
    }
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            int32_t sum = 0;
            for (int u = 0; u < SIDE; u++) {
                sum += basis[u][x] * columns[y * SIDE + u];
            }
            px[y * SIDE + x] = (uint8_t)clamp(shift_rounded(sum, MATRIX_SHIFT + COEF_SHIFT) + 128, 0, 255);
        }
    }
}

/* ---- quantiser ---- */

/* Steps grow gently with the frequency: errors are judged by correlation, not by eye. */
static int32_t frequency_step(int32_t step, int u, int v)
{
    return step * (16 + u + v) / 16;
}

static int32_t coef_of(int32_t level, int32_t step)
{
    const int32_t to_eighths = 2;
    return clamp(level * step / to_eighths, -COEF_MAX, COEF_MAX);
}

/* Rounds towards zero below 2/3 of a step (1/2 for the mean level): a small
 * coefficient costs more bits than it is worth. */
static int32_t level_of(int32_t coef, int32_t step, bool is_mean)
{
    const int32_t size_sixteenths = 2 * (coef < 0 ? -coef : coef);
    const int32_t offset = is_mean ? step / 2 : step / 3;
    const int32_t level = clamp((size_sixteenths + offset) / step, 0, LEVEL_MAX);
    return coef < 0 ? -level : level;
}

/* ---- adaptive Exp-Golomb symbols ---- */

#define MEAN_SHIFT 4u

static unsigned adaptive_order(const oc_adaptive_t *symbol)
{
    unsigned order = 0;
    while (order < 10u && (symbol->sum >> (MEAN_SHIFT + order)) > 1u) {
        order++;
    }
    return order;
}

static void adaptive_learn(oc_adaptive_t *symbol, uint32_t value)
{
    symbol->sum += value;
    symbol->sum -= symbol->sum >> MEAN_SHIFT;
}

static void adaptive_put(oc_adaptive_t *symbol, oc_bit_writer_t *writer, uint32_t value)
{
    oc_bits_put_golomb(writer, value, adaptive_order(symbol));
    adaptive_learn(symbol, value);
}

/* Anything over max fails the reader. */
static uint32_t adaptive_get(oc_adaptive_t *symbol, oc_bit_reader_t *reader, uint32_t max)
{
    const uint32_t value = oc_bits_get_golomb(reader, adaptive_order(symbol));
    if (value > max) reader->has_failed = true;
    if (reader->has_failed) return 0;
    adaptive_learn(symbol, value);
    return value;
}

/* ---- coder ---- */

void oc_block_coder_init(oc_block_coder_t *coder, unsigned quality)
{
    OC_ASSERT(coder && quality >= OC_MIN_BLOCK_QUALITY && quality <= OC_MAX_BLOCK_QUALITY);
    /* 32 * 2^(i / 5): a step of 2 grey levels in sixteenths, and its fifths of an octave. */
    static const int32_t fifths[5] = {32, 37, 42, 49, 56};
    const unsigned coarser = OC_MAX_BLOCK_QUALITY - quality;
    const int32_t step = fifths[coarser % 5u] << (coarser / 5u);
    memset(coder, 0, sizeof *coder);
    for (int v = 0; v < SIDE; v++) {
        for (int u = 0; u < SIDE; u++) {
            coder->step[v * SIDE + u] = frequency_step(step, u, v);
        }
    }
    coder->dc.sum = 4u << MEAN_SHIFT;
    coder->count.sum = 6u << MEAN_SHIFT;
}

/* Levels shrink along the zigzag, runs grow. */
static oc_adaptive_t *level_symbol(oc_block_coder_t *coder, unsigned at)
{
    return &coder->level[at < 3u ? 0 : at < 10u ? 1 : 2];
}

static oc_adaptive_t *run_symbol(oc_block_coder_t *coder, unsigned at)
{
    return &coder->run[at < 10u ? 0 : 1];
}

static void levels_put(oc_block_coder_t *coder, oc_bit_writer_t *writer, const int32_t levels[N_SAMPLES])
{
    uint32_t n_left = 0;
    for (unsigned i = 1; i < N_SAMPLES; i++) {
        n_left += levels[zigzag[i]] != 0;
    }
    adaptive_put(&coder->count, writer, n_left);
    unsigned next = 1;
    for (unsigned i = 1; n_left > 0; i++) {
        const int32_t level = levels[zigzag[i]];
        if (level == 0) continue;
        if (N_SAMPLES - next > n_left) adaptive_put(run_symbol(coder, next), writer, i - next);
        adaptive_put(level_symbol(coder, i), writer, (uint32_t)(level < 0 ? -level : level) - 1u);
        oc_bits_put(writer, level < 0, 1);
        next = i + 1u;
        n_left--;
    }
}

void oc_block_encode(oc_block_coder_t *coder, oc_bit_writer_t *writer, const uint8_t px[OC_BLOCK_SAMPLES],
                     int32_t dc_predicted, int32_t *dc_level)
{
    OC_ASSERT(coder && writer && px && dc_level);
    int32_t coef[N_SAMPLES], levels[N_SAMPLES];
    transform(px, coef);
    for (int i = 0; i < N_SAMPLES; i++) {
        levels[i] = level_of(coef[i], coder->step[i], i == 0);
    }
    adaptive_put(&coder->dc, writer, oc_bits_from_signed(levels[0] - dc_predicted));
    levels_put(coder, writer, levels);
    *dc_level = levels[0];
}

static void levels_get(oc_block_coder_t *coder, oc_bit_reader_t *reader, int32_t levels[N_SAMPLES])
{
    uint32_t n_left = adaptive_get(&coder->count, reader, N_SAMPLES - 1u);
    unsigned next = 1;
    for (; n_left > 0 && !reader->has_failed; n_left--) {
        const uint32_t spare = N_SAMPLES - next - n_left;
        const unsigned at = next + (spare > 0 ? adaptive_get(run_symbol(coder, next), reader, spare) : 0);
        const int32_t size = (int32_t)adaptive_get(level_symbol(coder, at), reader, LEVEL_MAX - 1u) + 1;
        levels[zigzag[at]] = oc_bits_get(reader, 1) == 1 ? -size : size;
        next = at + 1u;
    }
}

void oc_block_decode(oc_block_coder_t *coder, oc_bit_reader_t *reader, uint8_t px[OC_BLOCK_SAMPLES],
                     int32_t dc_predicted, int32_t *dc_level)
{
    OC_ASSERT(coder && reader && px && dc_level);
    int32_t levels[N_SAMPLES] = {0}, coef[N_SAMPLES];
    levels[0] = dc_predicted + oc_bits_to_signed(adaptive_get(&coder->dc, reader, 4u * LEVEL_MAX + 1u));
    if (levels[0] < -LEVEL_MAX || levels[0] > LEVEL_MAX) reader->has_failed = true;
    levels_get(coder, reader, levels);
    if (reader->has_failed) return;
    for (int i = 0; i < N_SAMPLES; i++) {
        coef[i] = coef_of(levels[i], coder->step[i]);
    }
    transform_back(coef, px);
    *dc_level = levels[0];
}

void oc_block_cut(const oc_image_t *grey, uint32_t bx, uint32_t by, uint8_t px[OC_BLOCK_SAMPLES])
{
    OC_ASSERT(grey && px && grey->channels == 1);
    for (uint32_t y = 0; y < SIDE; y++) {
        const uint32_t row = by * SIDE + y;
        const uint8_t *line =
            grey->px + (size_t)(row < grey->height_px ? row : grey->height_px - 1u) * grey->stride_bytes;
        for (uint32_t x = 0; x < SIDE; x++) {
            const uint32_t column = bx * SIDE + x;
            px[y * SIDE + x] = line[column < grey->width_px ? column : grey->width_px - 1u];
        }
    }
}
