/* SPDX-License-Identifier: BSD-3-Clause
 * Correlation of windows under a homography. */
#include <math.h>

#include "core/homography.h"
#include "vehicle/ground_internal.h"

/* Below this, on every third sample, the whole window is not looked at. */
#define QUICK_NCC 0.3f

/* Grey levels; a flatter window correlates with anything. */
#define MIN_SD 1.5f

/* Read the window whose sample (c, r) is at H (x + (c - half) step, ...) + shift. */
static bool warp_window(const oc_image_t *grey, const double H[9], const double at[2], const double shift[2],
                        int32_t half, int32_t step, float *out)
{
    const float max_x = (float)(grey->width_px - 1u);
    const float max_y = (float)(grey->height_px - 1u);
    const size_t stride = grey->stride_bytes;
    const float shift_x = (float)shift[0], shift_y = (float)shift[1];
    const float gx = (float)H[0], gy = (float)H[3], gw = (float)H[6];
    for (int32_t r = -half; r <= half; r += step) {
        const double y = at[1] + r;
        const float bx = (float)(H[0] * at[0] + H[1] * y + H[2]);
        const float by = (float)(H[3] * at[0] + H[4] * y + H[5]);
        const float bw = (float)(H[6] * at[0] + H[7] * y + H[8]);
        for (int32_t c = -half; c <= half; c += step) {
            const float f = (float)c;
            const float w = bw + gw * f;
            const float u = (bx + gx * f) / w + shift_x;
            const float v = (by + gy * f) / w + shift_y;
            if (!(u >= 0.0f && v >= 0.0f && u < max_x && v < max_y)) return false;
            const uint32_t ix = (uint32_t)u, iy = (uint32_t)v;
            const float ax = u - (float)ix, ay = v - (float)iy;
            const uint8_t *p = grey->px + (size_t)iy * stride + ix;
            const uint8_t *q = p + stride;
            const float top = (float)p[0] + ax * (float)(p[1] - p[0]);
            const float bottom = (float)q[0] + ax * (float)(q[1] - q[0]);
            *out++ = top + ay * (bottom - top);
        }
    }
    return true;
}

/* Zero mean, unit length. Returns the standard deviation before. */
static float window_normalise(float *v, uint32_t n)
{
    float sum = 0.0f;
    for (uint32_t i = 0; i < n; i++) sum += v[i];
    const float mean = sum / (float)n;
    float squares = 0.0f;
    for (uint32_t i = 0; i < n; i++) {
        v[i] -= mean;
        squares += v[i] * v[i];
    }
    if (!(squares > 0.0f)) return 0.0f;
    const float scale = 1.0f / sqrtf(squares);
    for (uint32_t i = 0; i < n; i++) v[i] *= scale;
    return sqrtf(squares / (float)n);
}

bool oc_ground_patch_take(const oc_image_t *grey, double x_px, double y_px, uint32_t n, ground_patch_t *patch)
{
    static const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const double still[2] = {0, 0};
    const double at[2] = {x_px, y_px};
    patch->n = n;
    if (!warp_window(grey, same, at, still, (int32_t)(n / 2u), 1, patch->v)) return false;
    patch->sd = window_normalise(patch->v, n * n);
    return patch->sd >= MIN_SD;
}

/* Every third sample of the patch against the same of the other window. */
static float correlate_quick(const ground_patch_t *patch, const float *sparse, uint32_t first)
{
    float sa = 0.0f, sb = 0.0f, saa = 0.0f, sbb = 0.0f, sab = 0.0f;
    uint32_t count = 0;
    for (uint32_t r = first; r < patch->n; r += 3u) {
        for (uint32_t c = first; c < patch->n; c += 3u) {
            const float a = patch->v[r * patch->n + c];
            const float b = sparse[count++];
            sa += a;
            sb += b;
            saa += a * a;
            sbb += b * b;
            sab += a * b;
        }
    }
    const float n = (float)count;
    const float va = saa - sa * sa / n, vb = sbb - sb * sb / n;
    if (!(va > 0.0f && vb > 0.0f)) return 1.0f; /* says nothing */
    return (sab - sa * sb / n) / sqrtf(va * vb);
}

float oc_ground_correlate(const ground_patch_t *patch, const double at[2], const oc_image_t *grey, const double H[9],
                          const double to[2])
{
    double x, y;
    if (oc_homography_apply(H, at[0], at[1], &x, &y) == 0.0) return -1.0f;
    const double shift[2] = {to[0] - x, to[1] - y};

    const int32_t half = (int32_t)(patch->n / 2u);
    const int32_t sparse_half = half - half % 3;
    float window[OC_MAX_GROUND_WINDOW_PX * OC_MAX_GROUND_WINDOW_PX];
    if (!warp_window(grey, H, at, shift, sparse_half, 3, window)) return -1.0f;
    if (correlate_quick(patch, window, (uint32_t)(half - sparse_half)) < QUICK_NCC) return -1.0f;

    if (!warp_window(grey, H, at, shift, half, 1, window)) return -1.0f;
    const uint32_t n = patch->n * patch->n;
    if (window_normalise(window, n) < MIN_SD) return -1.0f;
    float ncc = 0.0f;
    for (uint32_t i = 0; i < n; i++) ncc += patch->v[i] * window[i];
    return ncc;
}

/* Correlation of the patch with the n x n window of a wider one whose corner is at (c, r). */
static float correlate_at(const ground_patch_t *patch, const float *wide, uint32_t wide_n, uint32_t c, uint32_t r,
                          float *sd)
{
    const uint32_t n = patch->n;
    float sum = 0.0f, squares = 0.0f, product = 0.0f;
    for (uint32_t y = 0; y < n; y++) {
        const float *a = patch->v + y * n;
        const float *b = wide + (r + y) * wide_n + c;
        for (uint32_t x = 0; x < n; x++) {
            sum += b[x];
            squares += b[x] * b[x];
            product += a[x] * b[x];
        }
    }
    const float count = (float)(n * n);
    const float variance = squares / count - (sum / count) * (sum / count);
    if (!(variance > MIN_SD * MIN_SD)) return -1.0f;
    *sd = sqrtf(variance);
    return product / sqrtf(variance * count); /* the patch has zero mean and unit length */
}

/* Vertex of the parabola through three values, within half a step of the middle. */
static float vertex(float before, float middle, float after)
{
    const float bend = before - 2.0f * middle + after;
    if (!(bend < -1e-6f) || before < -0.5f || after < -0.5f) return 0.0f;
    const float v = 0.5f * (before - after) / bend;
    return v > 0.5f ? 0.5f : (v < -0.5f ? -0.5f : v);
}

void oc_ground_look_up(const ground_patch_t *patch, const double at[2], const oc_image_t *grey, const double H[9],
                       ground_lookup_t *found)
{
    enum { SIDE = 2 * GROUND_SEARCH_PX + 1 };
    static const double still[2] = {0, 0};
    *found = (ground_lookup_t){.is_inside = false, .ncc = -1.0f};

    float wide[GROUND_MAX_WIDE_PX * GROUND_MAX_WIDE_PX];
    const uint32_t wide_n = patch->n + 2u * GROUND_SEARCH_PX;
    if (!warp_window(grey, H, at, still, (int32_t)(wide_n / 2u), 1, wide)) return;
    found->is_inside = true;

    float ncc[SIDE][SIDE], sd[SIDE][SIDE];
    uint32_t best_c = GROUND_SEARCH_PX, best_r = GROUND_SEARCH_PX;
    for (uint32_t r = 0; r < SIDE; r++) {
        for (uint32_t c = 0; c < SIDE; c++) {
            sd[r][c] = 0.0f;
            ncc[r][c] = correlate_at(patch, wide, wide_n, c, r, &sd[r][c]);
            if (ncc[r][c] > ncc[best_r][best_c]) {
                best_c = c;
                best_r = r;
            }
        }
    }
    found->ncc = ncc[best_r][best_c];
    found->sd = sd[best_r][best_c];
    found->dx_px = (float)best_c - GROUND_SEARCH_PX;
    found->dy_px = (float)best_r - GROUND_SEARCH_PX;
    if (best_c > 0 && best_c + 1 < SIDE) {
        found->dx_px += vertex(ncc[best_r][best_c - 1], found->ncc, ncc[best_r][best_c + 1]);
    }
    if (best_r > 0 && best_r + 1 < SIDE) {
        found->dy_px += vertex(ncc[best_r - 1][best_c], found->ncc, ncc[best_r + 1][best_c]);
    }
}
