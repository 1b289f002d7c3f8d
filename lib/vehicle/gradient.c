/* SPDX-License-Identifier: BSD-3-Clause
 * Gaussian derivative and the edge maps B and B+, row by row in one pass. */
#include "vehicle/gradient.h"

#include <math.h>
#include <string.h>

/* Elements before the first pixel of a scratch row: the replicated border. */
#define LEAD 16u
static_assert(LEAD > OC_GRADIENT_MAX_RADIUS, "the border holds a kernel's arm and one more");

/* Scratch rows: 1 after the vertical pass, 3 filtered, 3 of magnitudes, 2 of
 * dx and 2 of dy, and one of dx, dy pairs for the noise. */
enum {
    ROW_DOWN,
    ROW_FILTERED,
    ROW_MAGNITUDE = ROW_FILTERED + 3,
    ROW_DX = ROW_MAGNITUDE + 3,
    ROW_DY = ROW_DX + 2,
    ROW_PAIRS = ROW_DY + 2,
    N_ROWS = ROW_PAIRS + 2
};

/* Bins of the magnitude histogram, 1/64 grey level per px each. */
#define NOISE_BINS 2048u

static bool gradient_size_is_valid(uint32_t width_px, uint32_t height_px)
{
    return width_px >= OC_MIN_IMAGE_SIDE && width_px <= OC_MAX_IMAGE_SIDE && height_px >= OC_MIN_IMAGE_SIDE &&
           height_px <= OC_MAX_IMAGE_SIDE;
}

/* A scratch row carries the border on both sides and whole words of pixels. */
static size_t gradient_row_length(uint32_t width_px)
{
    return 64u * oc_bitmap_columns(width_px) + 2u * LEAD;
}

static int16_t *gradient_row(const oc_gradient_t *gradient, uint32_t row)
{
    return gradient->row + row * gradient_row_length(gradient->width_px) + LEAD;
}

/* Integer kernel whose 2 r + 1 weights sum to exactly 256, so that a constant
 * image has no gradient and full contrast fits 16 bits. */
static void gradient_build_kernel(oc_gradient_t *gradient, float sigma_px)
{
    const float step = -0.5f / (sigma_px * sigma_px);
    float weight[OC_GRADIENT_MAX_RADIUS + 1];
    float sum = 0.0f;
    for (int32_t i = 0; i <= OC_GRADIENT_MAX_RADIUS; i++) {
        weight[i] = expf(step * (float)(i * i));
        sum += i == 0 ? weight[i] : 2.0f * weight[i];
    }

    int32_t rest = 256;
    gradient->radius = 0;
    for (int32_t i = OC_GRADIENT_MAX_RADIUS; i > 0; i--) {
        const int32_t w = (int32_t)lrintf(256.0f * weight[i] / sum);
        gradient->kernel[i] = (uint16_t)w;
        if (w > 0 && gradient->radius == 0) gradient->radius = i;
        rest -= 2 * w;
    }
    gradient->kernel[0] = (uint16_t)rest;
}

typedef struct gradient_pieces {
    size_t dxdy, map, row, word; /* bytes */
} gradient_pieces_t;

static gradient_pieces_t gradient_measure(uint32_t width_px, uint32_t height_px)
{
    return (gradient_pieces_t){
        .dxdy = (size_t)width_px * height_px * 2u * sizeof(int16_t),
        .map = oc_bitmap_words(width_px, height_px) * sizeof(uint64_t),
        .row = N_ROWS * gradient_row_length(width_px) * sizeof(int16_t),
        .word = 2u * (size_t)oc_bitmap_columns(width_px) * sizeof(uint64_t),
    };
}

size_t oc_gradient_size_bytes(uint32_t width_px, uint32_t height_px)
{
    if (!gradient_size_is_valid(width_px, height_px)) return 0;

    const gradient_pieces_t p = gradient_measure(width_px, height_px);
    return oc_arena_cost(p.dxdy) + 2u * oc_arena_cost(p.map) + oc_arena_cost(p.row) + oc_arena_cost(p.word);
}

oc_status_t oc_gradient_init(oc_gradient_t *gradient, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                             float sigma_px, oc_simd_t simd)
{
    OC_ASSERT(gradient && arena);

    if (!gradient_size_is_valid(width_px, height_px)) return OC_E_ARG;
    if (!(sigma_px >= OC_GRADIENT_MIN_SIGMA_PX && sigma_px <= OC_GRADIENT_MAX_SIGMA_PX)) {
        return OC_E_ARG;
    }

    const gradient_pieces_t p = gradient_measure(width_px, height_px);
    const size_t bytes[5] = {p.dxdy, p.map, p.map, p.row, p.word};
    void *piece[5];
    for (uint32_t i = 0; i < 5; i++) {
        const oc_status_t status = oc_arena_take(arena, bytes[i], &piece[i]);
        if (status != OC_OK) return status;
    }

    memset(gradient, 0, sizeof *gradient);
    gradient->width_px = width_px;
    gradient->height_px = height_px;
    gradient->kernels = oc_kernels_get(simd);
    gradient->dxdy = piece[0];
    gradient->pitch = oc_bitmap_pitch(height_px);
    gradient->thick = piece[1];
    gradient->thin = piece[2];
    gradient->row = piece[3];
    gradient->word = piece[4];
    gradient_build_kernel(gradient, sigma_px);
    return OC_OK;
}

static const uint8_t *gradient_image_row(const oc_image_t *grey, int32_t y)
{
    const int32_t last = (int32_t)grey->height_px - 1;
    const int32_t clamped = y < 0 ? 0 : y > last ? last : y;
    return grey->px + (size_t)clamped * grey->stride_bytes;
}

/* Filtered row y (which may lie outside the image) with one replicated pixel at each end. */
static void gradient_filter(const oc_gradient_t *gradient, const oc_image_t *grey, int32_t y, int16_t *out)
{
    const uint32_t width = gradient->width_px;
    const int32_t radius = gradient->radius;
    const uint8_t *rows[2 * OC_GRADIENT_MAX_RADIUS + 1];
    for (int32_t i = -radius; i <= radius; i++) rows[i + radius] = gradient_image_row(grey, y + i);

    uint16_t *down = (uint16_t *)gradient_row(gradient, ROW_DOWN);
    gradient->kernels->down(rows, gradient->kernel, radius, width, down);
    for (int32_t i = 1; i <= radius; i++) {
        down[-i] = down[0];
        down[width - 1u + (uint32_t)i] = down[width - 1u];
    }
    gradient->kernels->across(down, gradient->kernel, radius, width, out);
    out[-1] = out[0];
    out[width] = out[width - 1u];
}

static bool gradient_takes(const oc_gradient_t *gradient, const oc_image_t *grey)
{
    return oc_image_is_valid(grey) && grey->channels == 1 && grey->width_px == gradient->width_px &&
           grey->height_px == gradient->height_px;
}

/* Maps of row y, whose magnitudes and those of the rows beside it are ready. */
static void gradient_map_row(oc_gradient_t *gradient, uint32_t y, int16_t threshold)
{
    const uint32_t width = gradient->width_px, n = oc_bitmap_columns(width);
    uint64_t *thick = gradient->word, *thin = gradient->word + n;
    gradient->kernels->thin(
        gradient_row(gradient, ROW_MAGNITUDE + (y + 2u) % 3u), gradient_row(gradient, ROW_MAGNITUDE + y % 3u),
        gradient_row(gradient, ROW_MAGNITUDE + (y + 1u) % 3u), gradient_row(gradient, ROW_DX + y % 2u),
        gradient_row(gradient, ROW_DY + y % 2u), width, threshold, thick, thin);
    for (uint32_t c = 0; c < n; c++) {
        uint64_t inside = ~(uint64_t)0;
        if (c == 0) inside <<= 2;
        if (64u * c + 64u > width - 2u) {
            const uint32_t rest = width - 2u > 64u * c ? width - 2u - 64u * c : 0;
            inside &= ((uint64_t)1 << rest) - 1u;
        }
        const size_t at = oc_bitmap_at(gradient->pitch, c, y);
        gradient->thick[at] = thick[c] & inside;
        gradient->thin[at] = thin[c] & inside;
        gradient->n_thin += (uint32_t)__builtin_popcountll(thin[c] & inside);
    }
}

static int16_t gradient_threshold(float t_b)
{
    const float scaled = t_b * (float)OC_GRADIENT_ONE;
    if (!(scaled < (float)INT16_MAX)) return INT16_MAX;
    return scaled > 1.0f ? (int16_t)lrintf(scaled) : 1;
}

oc_status_t oc_gradient_compute(oc_gradient_t *gradient, const oc_image_t *grey, float t_b)
{
    OC_ASSERT(gradient && gradient->dxdy && grey);

    if (!gradient_takes(gradient, grey)) return OC_E_ARG;

    const int32_t height = (int32_t)gradient->height_px;
    const uint32_t width = gradient->width_px;
    const int16_t threshold = gradient_threshold(t_b);
    int16_t *filtered[3];
    for (uint32_t i = 0; i < 3; i++) filtered[i] = gradient_row(gradient, ROW_FILTERED + i);

    /* Row y of the filter completes the derivative of y - 1 and the maps of
     * y - 2. The first and last two rows of the maps stay empty. */
    gradient->n_thin = 0;
    for (int32_t y = -1; y <= height; y++) {
        int16_t *newest = filtered[2];
        gradient_filter(gradient, grey, y, newest);
        if (y >= 1) {
            const uint32_t at = (uint32_t)(y - 1);
            gradient->kernels->differ(filtered[0], filtered[1], newest, width, gradient->dxdy + 2u * (size_t)at * width,
                                      gradient_row(gradient, ROW_DX + at % 2u),
                                      gradient_row(gradient, ROW_DY + at % 2u),
                                      gradient_row(gradient, ROW_MAGNITUDE + at % 3u));
            if (at >= 3u && at + 1u < (uint32_t)height) gradient_map_row(gradient, at - 1u, threshold);
        }
        filtered[2] = filtered[0];
        filtered[0] = filtered[1];
        filtered[1] = newest;
    }
    return OC_OK;
}

/* Add one row's magnitudes to the histogram. */
static void noise_count_row(const oc_gradient_t *gradient, const oc_image_t *grey, uint32_t y, uint32_t histogram[])
{
    int16_t *filtered[3];
    for (uint32_t i = 0; i < 3; i++) {
        filtered[i] = gradient_row(gradient, ROW_FILTERED + i);
        gradient_filter(gradient, grey, (int32_t)(y + i) - 1, filtered[i]);
    }
    int16_t *magnitude = gradient_row(gradient, ROW_MAGNITUDE);
    gradient->kernels->differ(filtered[0], filtered[1], filtered[2], gradient->width_px,
                              gradient_row(gradient, ROW_PAIRS), gradient_row(gradient, ROW_DX),
                              gradient_row(gradient, ROW_DY), magnitude);
    for (uint32_t x = 0; x < gradient->width_px; x++) {
        const uint32_t bin = (uint32_t)magnitude[x] >> 2;
        histogram[bin < NOISE_BINS ? bin : NOISE_BINS - 1u]++;
    }
}

oc_status_t oc_gradient_noise(oc_gradient_t *gradient, const oc_image_t *grey, float *noise)
{
    OC_ASSERT(gradient && gradient->dxdy && grey && noise);

    if (!gradient_takes(gradient, grey)) return OC_E_ARG;

    uint32_t histogram[NOISE_BINS] = {0};
    uint32_t n = 0;
    for (uint32_t y = OC_GRADIENT_NOISE_STEP / 2u; y < gradient->height_px; y += OC_GRADIENT_NOISE_STEP) {
        noise_count_row(gradient, grey, y, histogram);
        n += gradient->width_px;
    }
    uint32_t below = 0, bin = 0;
    while (bin < NOISE_BINS - 1u && below + histogram[bin] < (n + 1u) / 2u) below += histogram[bin++];
    /* Median of a Rayleigh variable = 1.1774 sd of one component. */
    *noise = ((float)bin + 0.5f) * 4.0f / ((float)OC_GRADIENT_ONE * 1.1774f);
    return OC_OK;
}
