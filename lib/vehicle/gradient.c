/* SPDX-License-Identifier: BSD-3-Clause
 * Gaussian derivative, magnitude, and the edge maps B and B+. */
#include "vehicle/gradient.h"

#include <math.h>
#include <string.h>

/* Filtered rows alive at a time (above, here, below) and one for the vertical pass. */
#define ROWS 4u

/* Bins of the magnitude histogram, 1/64 grey level per px each. */
#define NOISE_BINS 2048u

static bool gradient_size_is_valid(uint32_t width_px, uint32_t height_px)
{
    return width_px >= OC_MIN_IMAGE_SIDE && width_px <= OC_MAX_IMAGE_SIDE && height_px >= OC_MIN_IMAGE_SIDE &&
           height_px <= OC_MAX_IMAGE_SIDE;
}

/* A filtered row carries the replicated border on both sides. */
static size_t gradient_row_length(uint32_t width_px)
{
    return (size_t)width_px + 2u * (OC_GRADIENT_MAX_RADIUS + 1u);
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

size_t oc_gradient_size_bytes(uint32_t width_px, uint32_t height_px)
{
    if (!gradient_size_is_valid(width_px, height_px)) return 0;

    const size_t area = (size_t)width_px * height_px;
    return 3u * oc_arena_cost(area * sizeof(uint16_t)) + oc_arena_cost(area) +
           oc_arena_cost(ROWS * gradient_row_length(width_px) * sizeof(uint16_t));
}

oc_status_t oc_gradient_init(oc_gradient_t *gradient, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                             float sigma_px)
{
    OC_ASSERT(gradient && arena);

    if (!gradient_size_is_valid(width_px, height_px)) return OC_E_ARG;
    if (!(sigma_px >= OC_GRADIENT_MIN_SIGMA_PX && sigma_px <= OC_GRADIENT_MAX_SIGMA_PX)) {
        return OC_E_ARG;
    }

    const size_t area = (size_t)width_px * height_px;
    const size_t row_bytes = ROWS * gradient_row_length(width_px) * sizeof(uint16_t);
    void *piece[5];
    const size_t bytes[5] = {area * sizeof(int16_t), area * sizeof(int16_t), area * sizeof(uint16_t), area, row_bytes};
    for (uint32_t i = 0; i < 5; i++) {
        const oc_status_t status = oc_arena_take(arena, bytes[i], &piece[i]);
        if (status != OC_OK) return status;
    }

    memset(gradient, 0, sizeof *gradient);
    gradient->width_px = width_px;
    gradient->height_px = height_px;
    gradient->dx = piece[0];
    gradient->dy = piece[1];
    gradient->magnitude = piece[2];
    gradient->edge = piece[3];
    gradient->row = piece[4];
    gradient_build_kernel(gradient, sigma_px);
    return OC_OK;
}

static const uint8_t *gradient_image_row(const oc_image_t *grey, int32_t y)
{
    const int32_t last = (int32_t)grey->height_px - 1;
    const int32_t clamped = y < 0 ? 0 : y > last ? last : y;
    return grey->px + (size_t)clamped * grey->stride_bytes;
}

/* Vertical pass of image row y into out[0 .. width), units of 1/256 level.
 * Exact: 255 * 256 fits 16 bits. */
static void gradient_filter_down(const oc_gradient_t *gradient, const oc_image_t *grey, int32_t y,
                                 uint16_t *restrict out)
{
    const uint32_t width = gradient->width_px;
    const uint8_t *mid = gradient_image_row(grey, y);
    const uint16_t centre = gradient->kernel[0];
    for (uint32_t x = 0; x < width; x++) out[x] = (uint16_t)(mid[x] * centre);

    for (int32_t i = 1; i <= gradient->radius; i++) {
        const uint8_t *above = gradient_image_row(grey, y - i);
        const uint8_t *below = gradient_image_row(grey, y + i);
        const uint16_t w = gradient->kernel[i];
        for (uint32_t x = 0; x < width; x++) {
            out[x] = (uint16_t)(out[x] + (uint16_t)((uint16_t)(above[x] + below[x]) * w));
        }
    }
}

static void gradient_replicate_ends(uint16_t *row, uint32_t width)
{
    for (uint32_t i = 1; i <= OC_GRADIENT_MAX_RADIUS + 1u; i++) {
        *(row - i) = row[0];
        row[width - 1u + i] = row[width - 1u];
    }
}

/* Horizontal pass, in[-r .. width + r) to out[0 .. width). Each product is cut
 * to 16 bits, at most r / 256 of a level too dark, the same everywhere. */
static void gradient_filter_across(const oc_gradient_t *gradient, const uint16_t *restrict in, uint16_t *restrict out)
{
    const uint32_t width = gradient->width_px;
    const uint32_t centre = gradient->kernel[0];
    for (uint32_t x = 0; x < width; x++) out[x] = (uint16_t)((in[x] * centre) >> 8);

    for (int32_t i = 1; i <= gradient->radius; i++) {
        const uint32_t w = gradient->kernel[i];
        const uint16_t *left = in - i;
        const uint16_t *right = in + i;
        for (uint32_t x = 0; x < width; x++) {
            out[x] = (uint16_t)(out[x] + ((left[x] * w) >> 8) + ((right[x] * w) >> 8));
        }
    }
}

static void gradient_differ(const oc_gradient_t *gradient, uint32_t y, const uint16_t *above, const uint16_t *here,
                            const uint16_t *below)
{
    const uint32_t width = gradient->width_px;
    int16_t *restrict dx = gradient->dx + (size_t)y * width;
    int16_t *restrict dy = gradient->dy + (size_t)y * width;
    uint16_t *restrict magnitude = gradient->magnitude + (size_t)y * width;
    for (uint32_t x = 0; x < width; x++) {
        const uint16_t *left = here - 1;
        dx[x] = (int16_t)((here[x + 1] >> 1) - (left[x] >> 1));
        dy[x] = (int16_t)((below[x] >> 1) - (above[x] >> 1));
    }
    for (uint32_t x = 0; x < width; x++) {
        const float gx = dx[x];
        const float gy = dy[x];
        magnitude[x] = (uint16_t)(int32_t)(sqrtf(gx * gx + gy * gy) + 0.5f);
    }
}

oc_status_t oc_gradient_compute(oc_gradient_t *gradient, const oc_image_t *grey)
{
    OC_ASSERT(gradient && gradient->dx && grey);

    if (!oc_image_is_valid(grey) || grey->channels != 1) return OC_E_ARG;
    if (grey->width_px != gradient->width_px || grey->height_px != gradient->height_px) {
        return OC_E_ARG;
    }

    const uint32_t width = gradient->width_px;
    const size_t pitch = gradient_row_length(width);
    uint16_t *first = gradient->row + OC_GRADIENT_MAX_RADIUS + 1;
    uint16_t *down = first + 3u * pitch;
    uint16_t *filtered[3] = {first, first + pitch, first + 2u * pitch};
    const int32_t height = (int32_t)gradient->height_px;

    /* Row y needs filtered rows y - 1 .. y + 1; one step behind the filter. */
    for (int32_t y = -1; y <= height; y++) {
        uint16_t *newest = filtered[2];
        gradient_filter_down(gradient, grey, y, down);
        gradient_replicate_ends(down, width);
        gradient_filter_across(gradient, down, newest);
        gradient_replicate_ends(newest, width);
        if (y >= 1) {
            gradient_differ(gradient, (uint32_t)(y - 1), filtered[0], filtered[1], newest);
        }
        filtered[2] = filtered[0];
        filtered[0] = filtered[1];
        filtered[1] = newest;
    }
    return OC_OK;
}

float oc_gradient_noise(const oc_gradient_t *gradient)
{
    OC_ASSERT(gradient && gradient->magnitude);

    uint32_t histogram[NOISE_BINS] = {0};
    const size_t area = (size_t)gradient->width_px * gradient->height_px;
    for (size_t i = 0; i < area; i++) {
        const uint32_t bin = gradient->magnitude[i] >> 2;
        histogram[bin < NOISE_BINS ? bin : NOISE_BINS - 1u]++;
    }

    size_t below = 0;
    uint32_t bin = 0;
    while (bin < NOISE_BINS - 1u && below + histogram[bin] < (area + 1) / 2) {
        below += histogram[bin++];
    }
    /* Median of a Rayleigh variable = 1.1774 sd of one component. */
    return ((float)bin + 0.5f) * 4.0f / ((float)OC_GRADIENT_ONE * 1.1774f);
}

/* Offset in reading order of the neighbour that lies along the gradient. */
static int32_t gradient_neighbour(int32_t dx, int32_t dy, int32_t pitch)
{
    const int32_t ax = dx < 0 ? -dx : dx;
    const int32_t ay = dy < 0 ? -dy : dy;
    /* tan(22.5 deg) = 53 / 128 within 0.04 deg. */
    if (128 * ay <= 53 * ax) return 1;
    if (128 * ax < 53 * ay) return pitch;
    return (dx < 0) == (dy < 0) ? pitch + 1 : pitch - 1;
}

uint32_t oc_gradient_edges(oc_gradient_t *gradient, float t_b)
{
    OC_ASSERT(gradient && gradient->edge);

    const uint32_t width = gradient->width_px;
    const float scaled = t_b * (float)OC_GRADIENT_ONE;
    uint16_t threshold = UINT16_MAX;
    if (scaled < (float)UINT16_MAX) threshold = scaled > 1.0f ? (uint16_t)lrintf(scaled) : 1u;

    uint32_t n_thin = 0;
    memset(gradient->edge, 0, (size_t)width * gradient->height_px);
    for (uint32_t y = 2; y + 2 < gradient->height_px; y++) {
        const size_t row = (size_t)y * width;
        for (uint32_t x = 2; x + 2 < width; x++) {
            const uint16_t *m = gradient->magnitude + row + x;
            if (*m < threshold) continue;

            const int32_t step = gradient_neighbour(gradient->dx[row + x], gradient->dy[row + x], (int32_t)width);
            const bool thin = *m > *(m - step) && *m >= *(m + step);
            gradient->edge[row + x] = thin ? OC_EDGE_THICK | OC_EDGE_THIN : OC_EDGE_THICK;
            n_thin += thin;
        }
    }
    return n_thin;
}

/* Sector within a quarter turn, 0..4, of a direction with ax, ay >= 0. The
 * borders are tan 11.25, 33.75, 56.25 and 78.75 degrees in 1/1024. */
static uint32_t gradient_quarter_sector(int32_t ax, int32_t ay)
{
    if (1024 * ay < 204 * ax) return 0;
    if (1024 * ay < 684 * ax) return 1;
    if (684 * ay < 1024 * ax) return 2;
    if (204 * ay < 1024 * ax) return 3;
    return 4;
}

uint32_t oc_gradient_sector(int32_t dx, int32_t dy)
{
    const uint32_t s = dx == 0 && dy == 0 ? 0 : gradient_quarter_sector(dx < 0 ? -dx : dx, dy < 0 ? -dy : dy);
    if (dx >= 0) return dy >= 0 ? s : (16u - s) & 15u;
    return dy >= 0 ? 8u - s : 8u + s;
}
