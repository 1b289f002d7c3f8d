/* SPDX-License-Identifier: BSD-3-Clause
 * A reference view warped over the ground onto a rectangle of a view, and how alike the two are, window by window. */
#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "vehicle/silhouette_internal.h"

/* Half sides of the windows of difference and correlation. */
#define DIFFERENCE_HALF 2u
#define THESIS_HALF 10u
#define LIKENESS_HALF 4u

/* Grey levels squared added to both variances: what noise alone is worth. */
#define NOISE_VARIANCE 4.0f

/* Differences are stored in quarters. */
#define DIFFERENCE_SCALE 4.0f

/* Textured ground that a view sees although a box should hide it: so alike, so much contrast, so little different. */
#define SURE_LIKENESS 0.9f
#define SURE_VARIANCE 36.0f
#define SURE_DIFFERENCE 15.0f

/* Thesis 6.3.1: t_S over a window of 21 x 21, here for each pixel. */
#define THESIS_DIFFERENCE 14.0f

#define MIN_SAMPLES 64u

/* ---- pixels ---- */

static uint8_t grey_of(const uint8_t *px)
{
    return (uint8_t)((77u * px[0] + 150u * px[1] + 29u * px[2] + 128u) / 256u);
}

/* 1 4 6 4 1 along a line of n values `pitch` apart, borders repeated; in place, with a window of what was. */
static void smooth_line(uint8_t *px, uint32_t n, size_t pitch)
{
    uint32_t a = px[0], b = px[0], c = px[0];
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t d = px[(i + 1u < n ? i + 1u : n - 1u) * pitch], e = px[(i + 2u < n ? i + 2u : n - 1u) * pitch];
        px[i * pitch] = (uint8_t)((a + 4u * b + 6u * c + 4u * d + e + 8u) / 16u);
        a = b;
        b = c;
        c = d;
    }
}

/* Down the columns of a whole row at once; two rows of what was are kept. */
static void smooth_columns(uint8_t *px, uint32_t n_values, uint32_t n_rows, uint8_t *above)
{
    uint8_t *a = above, *b = above + n_values;
    memcpy(a, px, n_values);
    memcpy(b, px, n_values);
    for (uint32_t y = 0; y < n_rows; y++) {
        uint8_t *c = px + (size_t)y * n_values;
        const uint8_t *d = px + (size_t)(y + 1u < n_rows ? y + 1u : n_rows - 1u) * n_values;
        const uint8_t *e = px + (size_t)(y + 2u < n_rows ? y + 2u : n_rows - 1u) * n_values;
        for (uint32_t i = 0; i < n_values; i++) {
            const uint32_t here = c[i];
            c[i] = (uint8_t)((a[i] + 4u * b[i] + 6u * here + 4u * d[i] + e[i] + 8u) / 16u);
            a[i] = b[i];
            b[i] = (uint8_t)here;
        }
    }
}

/* px: 3 channels, w x h. Grey on the side. */
static void smooth(oc_silhouette_ws_t *ws, uint8_t *px, uint8_t *grey, uint32_t w, uint32_t h)
{
    for (uint32_t y = 0; y < h; y++) {
        for (uint32_t c = 0; c < 3; c++) smooth_line(px + (size_t)y * 3u * w + c, w, 3);
    }
    smooth_columns(px, 3u * w, h, (uint8_t *)ws->row);
    for (size_t i = 0; i < (size_t)w * h; i++) grey[i] = grey_of(px + 3u * i);
}

void oc_compare_begin(oc_silhouette_ws_t *ws, const oc_sight_t *view, const oc_pixel_rect_t *rect)
{
    const uint32_t w = rect->x1 - rect->x0, h = rect->y1 - rect->y0, n = view->image.channels;
    for (uint32_t y = 0; y < h; y++) {
        const uint8_t *in = view->image.px + (size_t)(rect->y0 + y) * view->image.stride_bytes + (size_t)rect->x0 * n;
        uint8_t *out = ws->own + (size_t)y * 3u * w;
        for (uint32_t x = 0; x < w; x++) {
            for (uint32_t c = 0; c < 3; c++) out[3u * x + c] = in[x * n + (n == 3 ? c : 0)];
        }
    }
    smooth(ws, ws->own, ws->own_grey, w, h);
    memset(ws->difference, 255, (size_t)w * h);
    memset(ws->likeness, -128, (size_t)w * h);
    memset(ws->counts, 0, (size_t)w * h);
}

/* ---- light ---- */

typedef struct light {
    uint8_t table[3][256]; /* of a reference's values to the view's */
} light_t;

static bool reads(const oc_image_t *image, double u, double v)
{
    return u >= 1.0 && v >= 1.0 && u < image->width_px - 2.0 && v < image->height_px - 2.0;
}

/* Values of open ground that both see, on a grid over the whole view. */
static uint32_t samples_take(const oc_silhouette_ws_t *ws, const oc_comparison_t *cmp)
{
    const oc_image_t *own = &cmp->view->image, *ref = &cmp->reference->image;
    const double area = (double)own->width_px * own->height_px;
    const uint32_t step = (uint32_t)ceil(sqrt(area / OC_SILHOUETTE_SAMPLES));
    uint32_t n = 0;
    for (uint32_t y = step / 2; y < own->height_px; y += step) {
        for (uint32_t x = step / 2; x < own->width_px && n < OC_SILHOUETTE_SAMPLES; x += step) {
            double u, v;
            if (oc_boxes_have(ws->own_boxes, own->width_px, x, y)) continue;
            if (!(oc_homography_apply(cmp->to_reference, x, y, &u, &v) > 0.0) || !reads(ref, u, v)) continue;
            const uint32_t iu = (uint32_t)(u + 0.5), iv = (uint32_t)(v + 0.5);
            if (oc_boxes_have(ws->ref_boxes, ref->width_px, iu, iv)) continue;
            const uint8_t *a = own->px + (size_t)y * own->stride_bytes + (size_t)x * own->channels;
            const uint8_t *b = ref->px + (size_t)iv * ref->stride_bytes + (size_t)iu * ref->channels;
            for (uint32_t c = 0; c < 3; c++) {
                ws->samples[(size_t)(2u * c) * OC_SILHOUETTE_SAMPLES + n] = a[own->channels == 3 ? c : 0];
                ws->samples[(size_t)(2u * c + 1u) * OC_SILHOUETTE_SAMPLES + n] = b[ref->channels == 3 ? c : 0];
            }
            n++;
        }
    }
    return n;
}

static void mean_and_spread(const float *v, uint32_t n, float *mean, float *spread)
{
    float sum = 0.0f, squares = 0.0f;
    for (uint32_t i = 0; i < n; i++) sum += v[i];
    *mean = sum / (float)n;
    for (uint32_t i = 0; i < n; i++) squares += (v[i] - *mean) * (v[i] - *mean);
    *spread = sqrtf(squares / (float)n);
}

/* Median of own - gain * ref, by a histogram of whole grey levels. */
static float median_offset(const float *own, const float *ref, uint32_t n, float gain)
{
    uint16_t bins[1024];
    memset(bins, 0, sizeof bins);
    for (uint32_t i = 0; i < n; i++) {
        const float d = own[i] - gain * ref[i] + 512.0f;
        bins[d > 0.0f ? (d < 1023.0f ? (uint32_t)(d + 0.5f) : 1023u) : 0u]++;
    }
    uint32_t below = 0, bin = 0;
    while (bin < 1023u && below + bins[bin] < (n + 1u) / 2u) below += bins[bin++];
    return (float)bin - 512.0f;
}

/* Gain by the ratio of spreads, offset by the median difference: obstacles among the samples move neither far. */
static bool light_find(const oc_silhouette_ws_t *ws, const oc_comparison_t *cmp, light_t *light)
{
    const bool is_evened = cmp->method == OC_SILHOUETTE_BEST;
    const uint32_t n = is_evened ? samples_take(ws, cmp) : 0;
    if (is_evened && n < MIN_SAMPLES) return false;
    for (uint32_t c = 0; c < 3; c++) {
        float gain = 1.0f, offset = 0.0f;
        if (is_evened) {
            const float *own = ws->samples + (size_t)(2u * c) * OC_SILHOUETTE_SAMPLES;
            const float *ref = own + OC_SILHOUETTE_SAMPLES;
            float own_mean, own_spread, ref_mean, ref_spread;
            mean_and_spread(own, n, &own_mean, &own_spread);
            mean_and_spread(ref, n, &ref_mean, &ref_spread);
            gain = fminf(fmaxf(own_spread / fmaxf(ref_spread, 1e-3f), 0.5f), 2.0f);
            offset = median_offset(own, ref, n, gain);
        }
        for (uint32_t v = 0; v < 256; v++) {
            light->table[c][v] = (uint8_t)(fminf(fmaxf(gain * (float)v + offset, 0.0f), 255.0f) + 0.5f);
        }
    }
    return true;
}

/* ---- warp ---- */

/* One row of the reference over the ground, and what it knows there. Where nothing: the view's own values. */
static void warp_row(oc_silhouette_ws_t *ws, const oc_comparison_t *cmp, const light_t *light, uint32_t y)
{
    const oc_image_t *ref = &cmp->reference->image;
    const uint32_t w = cmp->rect.x1 - cmp->rect.x0, n = ref->channels;
    const double *H = cmp->to_reference;
    const double gx = cmp->rect.x0, gy = (double)cmp->rect.y0 + y;
    const float a0 = (float)(H[0] * gx + H[1] * gy + H[2]), a1 = (float)H[0];
    const float b0 = (float)(H[3] * gx + H[4] * gy + H[5]), b1 = (float)H[3];
    const float c0 = (float)(H[6] * gx + H[7] * gy + H[8]), c1 = (float)H[6];
    const float limit_u = (float)ref->width_px - 2.0f, limit_v = (float)ref->height_px - 2.0f;
    uint8_t *out = ws->warped + (size_t)y * 3u * w, *mask = ws->mask + (size_t)y * w;
    const uint8_t *own = ws->own + (size_t)y * 3u * w;
    float *us = ws->row, *vs = ws->row + w;
    for (uint32_t x = 0; x < w; x++) {
        const float depth = c0 + c1 * (float)x;
        const float inverse = 1.0f / depth;
        us[x] = depth > 0.0f ? (a0 + a1 * (float)x) * inverse : -1.0f;
        vs[x] = (b0 + b1 * (float)x) * inverse;
    }
    for (uint32_t x = 0; x < w; x++) {
        const float u = us[x], v = vs[x];
        if (!(u >= 1.0f && v >= 1.0f && u < limit_u && v < limit_v)) {
            mask[x] = OC_SEES_NOTHING;
            memcpy(out + 3u * x, own + 3u * x, 3);
            continue;
        }
        const uint32_t iu = (uint32_t)u, iv = (uint32_t)v;
        const uint32_t fu = (uint32_t)((u - (float)iu) * 256.0f), fv = (uint32_t)((v - (float)iv) * 256.0f);
        const uint8_t *p = ref->px + (size_t)iv * ref->stride_bytes + (size_t)iu * n, *q = p + ref->stride_bytes;
        const bool is_hidden = oc_boxes_have(ws->ref_boxes, ref->width_px, iu + (fu >> 7), iv + (fv >> 7));
        mask[x] = is_hidden ? OC_SEES_A_BOX : OC_SEES_GROUND;
        for (uint32_t c = 0; c < 3; c++) {
            const uint32_t k = n == 3 ? c : 0;
            const uint32_t top = p[k] * (256u - fu) + p[k + n] * fu, low = q[k] * (256u - fu) + q[k + n] * fu;
            out[3u * x + c] = light->table[c][(top * (256u - fv) + low * fv + 32768u) >> 16];
        }
    }
}

/* ---- windows ---- */

/* Sums down the columns of a window. */
enum { SUM_N, SUM_A, SUM_B, SUM_AA, SUM_BB, SUM_AB, SUM_N_NEAR, SUM_D, N_SUMS };

/* Add (sign 1) or take away (-1) row y of the correlation's sums. */
static void likeness_row(oc_silhouette_ws_t *ws, uint32_t w, uint32_t y, int32_t sign)
{
    const uint8_t *a = ws->own_grey + (size_t)y * w, *b = ws->warped_grey + (size_t)y * w;
    const uint8_t *mask = ws->mask + (size_t)y * w;
    int32_t *n = ws->columns + SUM_N * w, *sa = ws->columns + SUM_A * w, *sb = ws->columns + SUM_B * w;
    int32_t *saa = ws->columns + SUM_AA * w, *sbb = ws->columns + SUM_BB * w, *sab = ws->columns + SUM_AB * w;
    for (uint32_t x = 0; x < w; x++) {
        const int32_t m = mask[x] != OC_SEES_NOTHING ? sign : 0, av = a[x], bv = b[x];
        n[x] += m;
        sa[x] += m * av;
        sb[x] += m * bv;
        saa[x] += m * av * av;
        sbb[x] += m * bv * bv;
        sab[x] += m * av * bv;
    }
}

static void difference_row(oc_silhouette_ws_t *ws, uint32_t w, uint32_t y, int32_t sign)
{
    const uint8_t *a = ws->own + (size_t)y * 3u * w, *b = ws->warped + (size_t)y * 3u * w;
    const uint8_t *mask = ws->mask + (size_t)y * w;
    int32_t *n = ws->columns + SUM_N_NEAR * w, *sum = ws->columns + SUM_D * w;
    for (uint32_t x = 0; x < w; x++) {
        int32_t d = 0;
        for (uint32_t c = 0; c < 3; c++) {
            const int32_t one = (int32_t)a[3u * x + c] - (int32_t)b[3u * x + c];
            d += one < 0 ? -one : one;
        }
        const int32_t m = mask[x] != OC_SEES_NOTHING ? sign : 0;
        n[x] += m;
        sum[x] += m * d;
    }
}

/* Sums of 2 half + 1 columns round each, as far as there are any. */
static void across(const int32_t *columns, uint32_t w, uint32_t half, float *out)
{
    int32_t sum = 0;
    for (uint32_t x = 0; x < half && x < w; x++) sum += columns[x];
    for (uint32_t x = 0; x < w; x++) {
        if (x + half < w) sum += columns[x + half];
        if (x > half) sum -= columns[x - half - 1u];
        out[x] = (float)sum;
    }
}

/* What one row of windows says, into the best so far. */
static void row_judge(oc_silhouette_ws_t *ws, uint32_t w, uint32_t y, oc_silhouette_method_t method)
{
    float *sums[N_SUMS];
    for (uint32_t k = 0; k < N_SUMS; k++) sums[k] = ws->row + (size_t)k * w;
    const uint32_t near_half = method == OC_SILHOUETTE_THESIS ? THESIS_HALF : DIFFERENCE_HALF;
    for (uint32_t k = 0; k < N_SUMS; k++) {
        across(ws->columns + (size_t)k * w, w, k >= SUM_N_NEAR ? near_half : LIKENESS_HALF, sums[k]);
    }
    const uint8_t *mask = ws->mask + (size_t)y * w;
    uint8_t *least = ws->difference + (size_t)y * w, *counts = ws->counts + (size_t)y * w;
    int8_t *most = ws->likeness + (size_t)y * w;
    for (uint32_t x = 0; x < w; x++) {
        const float n = fmaxf(sums[SUM_N][x], 1.0f), inverse = 1.0f / n;
        const float mean_a = sums[SUM_A][x] * inverse, mean_b = sums[SUM_B][x] * inverse;
        const float var_a = fmaxf(sums[SUM_AA][x] * inverse - mean_a * mean_a, 0.0f) + NOISE_VARIANCE;
        const float var_b = fmaxf(sums[SUM_BB][x] * inverse - mean_b * mean_b, 0.0f) + NOISE_VARIANCE;
        const float likeness = (sums[SUM_AB][x] * inverse - mean_a * mean_b + NOISE_VARIANCE) / sqrtf(var_a * var_b);
        const float difference = sums[SUM_D][x] / (3.0f * fmaxf(sums[SUM_N_NEAR][x], 1.0f));
        if (mask[x] == OC_SEES_NOTHING) continue;
        if (method == OC_SILHOUETTE_THESIS) { /* low four bits: ground, high: obstacle */
            counts[x] = (uint8_t)(counts[x] + (difference > THESIS_DIFFERENCE ? 16u : 1u));
        } else if (mask[x] == OC_SEES_GROUND) {
            const float d = fminf(difference * DIFFERENCE_SCALE, 255.0f), l = fmaxf(likeness, -1.0f) * 100.0f;
            if (d < least[x]) least[x] = (uint8_t)d;
            if (l > most[x]) most[x] = (int8_t)l;
            counts[x] = (uint8_t)(counts[x] + 1u);
        } else if (likeness > SURE_LIKENESS && var_b > SURE_VARIANCE + NOISE_VARIANCE && difference < SURE_DIFFERENCE) {
            counts[x] = (uint8_t)(counts[x] + 16u);
        }
    }
}

bool oc_compare_add(oc_silhouette_ws_t *ws, const oc_comparison_t *cmp)
{
    light_t light;
    if (!light_find(ws, cmp, &light)) return false;
    const uint32_t w = cmp->rect.x1 - cmp->rect.x0, h = cmp->rect.y1 - cmp->rect.y0;
    for (uint32_t y = 0; y < h; y++) warp_row(ws, cmp, &light, y);
    smooth(ws, ws->warped, ws->warped_grey, w, h);

    const uint32_t near_half = cmp->method == OC_SILHOUETTE_THESIS ? THESIS_HALF : DIFFERENCE_HALF;
    memset(ws->columns, 0, (size_t)N_SUMS * w * sizeof ws->columns[0]);
    for (uint32_t y = 0; y < LIKENESS_HALF && y < h; y++) likeness_row(ws, w, y, 1);
    for (uint32_t y = 0; y < near_half && y < h; y++) difference_row(ws, w, y, 1);
    for (uint32_t y = 0; y < h; y++) {
        if (y + LIKENESS_HALF < h) likeness_row(ws, w, y + LIKENESS_HALF, 1);
        if (y > LIKENESS_HALF) likeness_row(ws, w, y - LIKENESS_HALF - 1u, -1);
        if (y + near_half < h) difference_row(ws, w, y + near_half, 1);
        if (y > near_half) difference_row(ws, w, y - near_half - 1u, -1);
        row_judge(ws, w, y, cmp->method);
    }
    return true;
}
