/* SPDX-License-Identifier: BSD-3-Clause
 * Correlation of windows under a homography. */
#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "vehicle/ground_internal.h"

/* Below this, on every third sample, the whole window is not looked at. */
#define QUICK_NCC 0.3f

/* A peak of this height in the middle of the search is not doubted. */
#define CLEAR_NCC 0.8f

/* Grey levels; a flatter window correlates with anything. */
#define MIN_SD 1.5f

/* A block may differ by this share of the patch's contrast: shading, resampling. */
#define BLOCK_NOISE 0.1f

/* More of a window's variance than this is never put down to noise. */
#define MAX_NOISE_SHARE 0.3f

/* Four floats side by side. Sums are kept lane by lane and added up in one fixed
 * order, so that every machine gets the same bits. */
typedef float lanes_t __attribute__((vector_size(16)));
typedef int32_t int_lanes_t __attribute__((vector_size(16)));
#define N_LANES 4u

static lanes_t lanes_of(float x)
{
    return (lanes_t){x, x, x, x};
}

static lanes_t lanes_load(const float *p)
{
    lanes_t v;
    memcpy(&v, p, sizeof v);
    return v;
}

static float lanes_sum(lanes_t v)
{
    return (v[0] + v[1]) + (v[2] + v[3]);
}

/* ---- reading windows ---- */

/* A square of samples: H (at + (c, r) step) + shift for c, r in -half .. half. */
typedef struct window_read {
    const double *H, *at, *shift;
    int32_t half, step;
} window_read_t;

/* Are all samples inside the image, with a neighbour to the right and below? In
 * front of both cameras a square becomes a convex figure, so its corners tell. */
static bool window_is_inside(const oc_image_t *grey, const window_read_t *w)
{
    const double max_x = grey->width_px - 1.01, max_y = grey->height_px - 1.01;
    for (int k = 0; k < 4; k++) {
        double x, y;
        const double cx = w->at[0] + (k % 2 ? w->half : -w->half), cy = w->at[1] + (k / 2 ? w->half : -w->half);
        if (!(oc_homography_apply(w->H, cx, cy, &x, &y) > 0.0)) return false;
        x += w->shift[0];
        y += w->shift[1];
        if (!(x >= 0.01 && y >= 0.01 && x <= max_x && y <= max_y)) return false;
    }
    return true;
}

/* Four neighbouring bytes of each lane's sample, and between them. */
static lanes_t lanes_sample(const oc_image_t *grey, lanes_t u, lanes_t v)
{
    const int_lanes_t ix = __builtin_convertvector(u, int_lanes_t), iy = __builtin_convertvector(v, int_lanes_t);
    const lanes_t ax = u - __builtin_convertvector(ix, lanes_t), ay = v - __builtin_convertvector(iy, lanes_t);
    int_lanes_t p0, p1, q0, q1;
    for (uint32_t k = 0; k < N_LANES; k++) {
        const uint8_t *p = grey->px + (size_t)(uint32_t)iy[k] * grey->stride_bytes + (uint32_t)ix[k];
        p0[k] = p[0];
        p1[k] = p[1];
        q0[k] = p[grey->stride_bytes];
        q1[k] = p[grey->stride_bytes + 1u];
    }
    const lanes_t left = __builtin_convertvector(p0, lanes_t), below = __builtin_convertvector(q0, lanes_t);
    const lanes_t top = left + ax * __builtin_convertvector(p1 - p0, lanes_t);
    const lanes_t bottom = below + ax * __builtin_convertvector(q1 - q0, lanes_t);
    return top + ay * (bottom - top);
}

/* Read a window; rows are out_stride apart, a multiple of the lanes. False when it sticks out of the image. */
static bool window_warp(const oc_image_t *grey, const window_read_t *w, float *out, uint32_t out_stride)
{
    if (!window_is_inside(grey, w)) return false;
    const uint32_t n = 2u * (uint32_t)(w->half / w->step) + 1u;
    float column[GROUND_WIDE_STRIDE]; /* behind the last: the last again, so that lanes never leave the window */
    for (uint32_t c = 0; c < GROUND_WIDE_STRIDE; c++) {
        column[c] = (float)(-w->half + (int32_t)(c < n ? c : n - 1u) * w->step);
    }
    const double *H = w->H, *at = w->at;
    const lanes_t shift_x = lanes_of((float)w->shift[0]), shift_y = lanes_of((float)w->shift[1]);
    const lanes_t gx = lanes_of((float)H[0]), gy = lanes_of((float)H[3]), gw = lanes_of((float)H[6]);
    for (uint32_t r = 0; r < n; r++) {
        const double y = at[1] + (-w->half + (int32_t)r * w->step);
        const lanes_t bx = lanes_of((float)(H[0] * at[0] + H[1] * y + H[2]));
        const lanes_t by = lanes_of((float)(H[3] * at[0] + H[4] * y + H[5]));
        const lanes_t bw = lanes_of((float)(H[6] * at[0] + H[7] * y + H[8]));
        for (uint32_t c = 0; c < n; c += N_LANES) {
            const lanes_t f = lanes_load(column + c), depth = bw + gw * f;
            const lanes_t v = lanes_sample(grey, (bx + gx * f) / depth + shift_x, (by + gy * f) / depth + shift_y);
            memcpy(out + r * out_stride + c, &v, sizeof v);
        }
    }
    return true;
}

/* Read an upright window of n x n samples, n odd: the same four weights everywhere. */
static bool window_copy(const oc_image_t *grey, const double at[2], uint32_t n, float *out, uint32_t out_stride)
{
    const double half = n / 2u, x0 = at[0] - half, y0 = at[1] - half; /* NOLINT(bugprone-integer-division) */
    const double x1 = at[0] + half, y1 = at[1] + half;
    if (!(x0 >= 0.01 && y0 >= 0.01 && x1 <= grey->width_px - 1.01 && y1 <= grey->height_px - 1.01)) return false;
    const uint32_t ix = (uint32_t)x0, iy = (uint32_t)y0;
    const float ax = (float)(x0 - ix), ay = (float)(y0 - iy);
    const float w00 = (1.0f - ax) * (1.0f - ay), w01 = ax * (1.0f - ay), w10 = (1.0f - ax) * ay, w11 = ax * ay;
    for (uint32_t r = 0; r < n; r++) {
        const uint8_t *p = grey->px + (size_t)(iy + r) * grey->stride_bytes + ix, *q = p + grey->stride_bytes;
        float *o = out + r * out_stride;
        for (uint32_t c = 0; c < n; c++) {
            o[c] = (w00 * (float)p[c] + w01 * (float)p[c + 1u]) + (w10 * (float)q[c] + w11 * (float)q[c + 1u]);
        }
    }
    return true;
}

/* 1 2 1 down and across: n + 2 rows and columns become n. out may be in. */
static void window_smooth(const float *in, uint32_t in_stride, uint32_t n, float *out, uint32_t out_stride)
{
    float row[3][GROUND_WIDE_STRIDE];
    for (uint32_t r = 0; r < n + 2u; r++) {
        const float *p = in + r * in_stride;
        float *q = row[r % 3u];
        for (uint32_t c = 0; c < n; c++) q[c] = 0.25f * (p[c] + p[c + 2u]) + 0.5f * p[c + 1u];
        if (r < 2u) continue;
        const float *a = row[(r - 2u) % 3u], *b = row[(r - 1u) % 3u];
        float *o = out + (r - 2u) * out_stride;
        for (uint32_t c = 0; c < n; c++) o[c] = 0.25f * (a[c] + q[c]) + 0.5f * b[c];
    }
}

/* Read n x n samples, n odd, smoothed or not. Scratch holds what smoothing needs round them. */
static bool window_take(const oc_image_t *grey, const double H[9], const double at[2], uint32_t n, bool is_smooth,
                        float scratch[GROUND_MAX_WIDE_PX * GROUND_WIDE_STRIDE], float *out, uint32_t out_stride)
{
    static const double still[2] = {0, 0};
    window_read_t read = {.H = H, .at = at, .shift = still, .half = (int32_t)(n / 2u), .step = 1};
    if (!is_smooth) return window_warp(grey, &read, out, out_stride);
    read.half++;
    if (!window_warp(grey, &read, scratch, GROUND_WIDE_STRIDE)) return false;
    window_smooth(scratch, GROUND_WIDE_STRIDE, n, out, out_stride);
    return true;
}

/* Zero mean, unit length; zeros behind the samples. Returns the standard deviation before. */
static float window_normalise(float *v, uint32_t n)
{
    const uint32_t width = (n + N_LANES - 1u) / N_LANES * N_LANES;
    lanes_t sum = {0};
    for (uint32_t r = 0; r < n; r++) {
        float *row = v + r * GROUND_PATCH_STRIDE;
        for (uint32_t c = n; c < GROUND_PATCH_STRIDE; c++) row[c] = 0.0f;
        for (uint32_t c = 0; c < width; c += N_LANES) sum += lanes_load(row + c);
    }
    const float mean = lanes_sum(sum) / (float)(n * n);
    lanes_t squares = {0};
    for (uint32_t r = 0; r < n; r++) {
        float *row = v + r * GROUND_PATCH_STRIDE;
        for (uint32_t c = 0; c < n; c++) row[c] -= mean;
        for (uint32_t c = 0; c < width; c += N_LANES) squares += lanes_load(row + c) * lanes_load(row + c);
    }
    const float length2 = lanes_sum(squares);
    if (!(length2 > 0.0f)) return 0.0f;
    const float scale = 1.0f / sqrtf(length2);
    for (uint32_t r = 0; r < n; r++) {
        for (uint32_t c = 0; c < n; c++) v[r * GROUND_PATCH_STRIDE + c] *= scale;
    }
    return sqrtf(length2 / (float)(n * n));
}

bool oc_ground_patch_take(const oc_image_t *grey, const double at[2], uint32_t n, bool is_smooth, ground_patch_t *patch)
{
    float scratch[GROUND_MAX_WIDE_PX * GROUND_WIDE_STRIDE];
    patch->n = n;
    if (!window_copy(grey, at, is_smooth ? n + 2u : n, is_smooth ? scratch : patch->v,
                     is_smooth ? GROUND_WIDE_STRIDE : GROUND_PATCH_STRIDE)) {
        return false;
    }
    if (is_smooth) window_smooth(scratch, GROUND_WIDE_STRIDE, n, patch->v, GROUND_PATCH_STRIDE);
    patch->sd = window_normalise(patch->v, n);
    return patch->sd >= MIN_SD;
}

/* ---- one place ---- */

/* Every third sample of the patch against the same of the other window. */
static float correlate_quick(const ground_patch_t *patch, const float *sparse, uint32_t first)
{
    float sa = 0.0f, sb = 0.0f, saa = 0.0f, sbb = 0.0f, sab = 0.0f;
    uint32_t count = 0;
    for (uint32_t r = first; r < patch->n; r += 3u) {
        for (uint32_t c = first; c < patch->n; c += 3u) {
            const float a = patch->v[r * GROUND_PATCH_STRIDE + c];
            const float b = sparse[(r / 3u) * GROUND_PATCH_STRIDE + c / 3u];
            count++;
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

/* Product of a patch with the window of the same size whose first sample is b. */
static float window_product(const ground_patch_t *patch, const float *b, uint32_t b_stride)
{
    const uint32_t width = (patch->n + N_LANES - 1u) / N_LANES * N_LANES;
    lanes_t sum = {0};
    for (uint32_t r = 0; r < patch->n; r++) {
        const float *p = patch->v + r * GROUND_PATCH_STRIDE, *q = b + r * b_stride;
        for (uint32_t c = 0; c < width; c += N_LANES) sum += lanes_load(p + c) * lanes_load(q + c);
    }
    return lanes_sum(sum);
}

float oc_ground_correlate(const ground_patch_t *patch, const double at[2], const oc_image_t *grey, const double H[9],
                          const double to[2])
{
    double x, y;
    if (oc_homography_apply(H, at[0], at[1], &x, &y) == 0.0) return -1.0f;
    const double shift[2] = {to[0] - x, to[1] - y};

    const int32_t half = (int32_t)(patch->n / 2u);
    const int32_t sparse_half = half - half % 3;
    float window[OC_MAX_GROUND_WINDOW_PX * GROUND_PATCH_STRIDE];
    const window_read_t sparse = {.H = H, .at = at, .shift = shift, .half = sparse_half, .step = 3};
    const window_read_t dense = {.H = H, .at = at, .shift = shift, .half = half, .step = 1};
    if (!window_warp(grey, &sparse, window, GROUND_PATCH_STRIDE)) return -1.0f;
    if (correlate_quick(patch, window, (uint32_t)(half - sparse_half)) < QUICK_NCC) return -1.0f;

    if (!window_warp(grey, &dense, window, GROUND_PATCH_STRIDE)) return -1.0f;
    if (window_normalise(window, patch->n) < MIN_SD) return -1.0f;
    return window_product(patch, window, GROUND_PATCH_STRIDE);
}

/* ---- looking a patch up ---- */

enum { SIDE = 2 * GROUND_SEARCH_PX + 1 };

/* Variance, times n^2, of every n x n window of the wide one; in place of sums over each anew. */
static void window_variances(const float *wide, uint32_t n, float out[SIDE][SIDE])
{
    for (uint32_t r = 0; r < SIDE; r++) {
        float sum[GROUND_WIDE_STRIDE] = {0}, squares[GROUND_WIDE_STRIDE] = {0}; /* of columns */
        for (uint32_t y = r; y < r + n; y++) {
            const float *row = wide + y * GROUND_WIDE_STRIDE;
            for (uint32_t c = 0; c < GROUND_WIDE_STRIDE; c++) {
                sum[c] += row[c];
                squares[c] += row[c] * row[c];
            }
        }
        float s = 0.0f, q = 0.0f;
        for (uint32_t c = 0; c < n; c++) {
            s += sum[c];
            q += squares[c];
        }
        for (uint32_t c = 0; c < SIDE; c++) {
            out[r][c] = q - s * s / (float)(n * n);
            if (c + 1 == SIDE) break;
            s += sum[c + n] - sum[c];
            q += squares[c + n] - squares[c];
        }
    }
}

/* Vertex of the parabola through three values, within half a step of the middle. */
static float vertex(float before, float middle, float after)
{
    const float bend = before - 2.0f * middle + after;
    if (!(bend < -1e-6f) || before < -0.5f || after < -0.5f) return 0.0f;
    const float v = 0.5f * (before - after) / bend;
    return v > 0.5f ? 0.5f : (v < -0.5f ? -0.5f : v);
}

/* Take the mean away: sums of squares stay exact enough, and zero is what lies behind the samples. */
static void wide_centre(float *wide, uint32_t wide_n)
{
    float sum = 0.0f;
    for (uint32_t r = 0; r < wide_n; r++) {
        for (uint32_t c = 0; c < wide_n; c++) sum += wide[r * GROUND_WIDE_STRIDE + c];
    }
    const float mean = sum / (float)(wide_n * wide_n);
    for (uint32_t r = 0; r < wide_n; r++) {
        float *row = wide + r * GROUND_WIDE_STRIDE;
        for (uint32_t c = 0; c < wide_n; c++) row[c] -= mean;
        for (uint32_t c = wide_n; c < GROUND_WIDE_STRIDE; c++) row[c] = 0.0f;
    }
}

/* Correlations at whole pixels, and the best of them. */
typedef struct peak {
    float ncc[SIDE][SIDE];
    float variance[SIDE][SIDE]; /* times n^2 */
    uint32_t c, r;
} peak_t;

/* Correlate within `reach` of the middle. */
static void peak_search(const ground_patch_t *patch, const float *wide, uint32_t reach, peak_t *peak)
{
    const float least = MIN_SD * MIN_SD * (float)(patch->n * patch->n);
    peak->c = peak->r = GROUND_SEARCH_PX;
    for (uint32_t r = GROUND_SEARCH_PX - reach; r <= GROUND_SEARCH_PX + reach; r++) {
        for (uint32_t c = GROUND_SEARCH_PX - reach; c <= GROUND_SEARCH_PX + reach; c++) {
            const float product = window_product(patch, wide + r * GROUND_WIDE_STRIDE + c, GROUND_WIDE_STRIDE);
            const float variance = peak->variance[r][c];
            peak->ncc[r][c] = variance > least ? product / sqrtf(variance) : -1.0f;
        }
    }
    for (uint32_t r = GROUND_SEARCH_PX - reach; r <= GROUND_SEARCH_PX + reach; r++) {
        for (uint32_t c = GROUND_SEARCH_PX - reach; c <= GROUND_SEARCH_PX + reach; c++) {
            if (!(peak->ncc[r][c] > peak->ncc[peak->r][peak->c])) continue;
            peak->c = c;
            peak->r = r;
        }
    }
}

/* Best correlation over whole pixels, and the parabolas' vertex round it. False
 * when the best is at the end of the search. */
static bool peak_find(const ground_patch_t *patch, const float *wide, ground_lookup_t *found)
{
    peak_t peak;
    window_variances(wide, patch->n, peak.variance);
    /* Most of the ground is where it should be, and seen at once. */
    peak_search(patch, wide, 1, &peak);
    uint32_t reach = 1;
    if (peak.c != GROUND_SEARCH_PX || peak.r != GROUND_SEARCH_PX || peak.ncc[peak.r][peak.c] < CLEAR_NCC) {
        reach = GROUND_SEARCH_PX;
        peak_search(patch, wide, reach, &peak);
    }
    const float best = peak.ncc[peak.r][peak.c];
    found->ncc = best;
    found->shift_px[0] = (float)peak.c - GROUND_SEARCH_PX;
    found->shift_px[1] = (float)peak.r - GROUND_SEARCH_PX;
    if (peak.c == GROUND_SEARCH_PX - reach || peak.c == GROUND_SEARCH_PX + reach) return false;
    if (peak.r == GROUND_SEARCH_PX - reach || peak.r == GROUND_SEARCH_PX + reach) return false;
    found->shift_px[0] += vertex(peak.ncc[peak.r][peak.c - 1], best, peak.ncc[peak.r][peak.c + 1]);
    found->shift_px[1] += vertex(peak.ncc[peak.r - 1][peak.c], best, peak.ncc[peak.r + 1][peak.c]);
    return true;
}

/* Least squares step of the window over the patch (both normalised), and how
 * well the answer is known: noise over contrast across both axes. */
static bool shift_step(const ground_patch_t *patch, const float *window, float step[2], float cov[3])
{
    float xx = 0.0f, xy = 0.0f, yy = 0.0f, ex = 0.0f, ey = 0.0f, ee = 0.0f;
    for (uint32_t r = 1; r + 1 < patch->n; r++) {
        const float *a = patch->v + r * GROUND_PATCH_STRIDE, *b = window + r * GROUND_PATCH_STRIDE;
        for (uint32_t c = 1; c + 1 < patch->n; c++) {
            const float gx = 0.5f * (b[c + 1] - b[c - 1]);
            const float gy = 0.5f * (b[c + GROUND_PATCH_STRIDE] - (b - GROUND_PATCH_STRIDE)[c]);
            const float e = a[c] - b[c];
            xx += gx * gx;
            xy += gx * gy;
            yy += gy * gy;
            ex += gx * e;
            ey += gy * e;
            ee += e * e;
        }
    }
    const float det = xx * yy - xy * xy;
    if (!(det > 1e-6f * (xx + yy) * (xx + yy))) return false;
    step[0] = (yy * ex - xy * ey) / det;
    step[1] = (xx * ey - xy * ex) / det;
    const float side = (float)(patch->n - 2u);
    const float variance = ee / (side * side);
    cov[0] = variance * yy / det;
    cov[1] = -variance * xy / det;
    cov[2] = variance * xx / det;
    return true;
}

/* The window is cut into ninths. A corner of the ground agrees all round; at the
 * foot or the rim of an obstacle one side does not, however well the rest does.
 * 1 - (difference over the contrast of both and of the noise), the worst of nine. */
static float blocks_worst(const ground_patch_t *patch, const float *window, float noise_sd)
{
    const float floor_sd = MIN_SD + BLOCK_NOISE * patch->sd;
    const float floor2 = floor_sd * floor_sd + 0.5f * noise_sd * noise_sd;
    const float noise2 = floor2 / (patch->sd * patch->sd * (float)(patch->n * patch->n));
    float worst = 1.0f;
    for (uint32_t k = 0; k < 9; k++) {
        const uint32_t r0 = patch->n * (k / 3u) / 3u, r1 = patch->n * (k / 3u + 1u) / 3u;
        const uint32_t c0 = patch->n * (k % 3u) / 3u, c1 = patch->n * (k % 3u + 1u) / 3u;
        float a1 = 0.0f, a2 = 0.0f, b1 = 0.0f, b2 = 0.0f, e2 = 0.0f;
        for (uint32_t r = r0; r < r1; r++) {
            for (uint32_t c = c0; c < c1; c++) {
                const float a = patch->v[r * GROUND_PATCH_STRIDE + c], b = window[r * GROUND_PATCH_STRIDE + c];
                a1 += a;
                b1 += b;
                a2 += a * a;
                b2 += b * b;
                e2 += (a - b) * (a - b);
            }
        }
        const float count = (float)((r1 - r0) * (c1 - c0));
        const float contrast = a2 - a1 * a1 / count + b2 - b1 * b1 / count;
        const float agreement = 1.0f - e2 / (contrast + 2.0f * count * noise2);
        if (agreement < worst) worst = agreement;
    }
    return worst;
}

/* From the peak over whole pixels to a fraction of one, by least squares; and
 * how the window agrees there. scratch: contents are lost. */
static void shift_refine(const ground_patch_t *patch, const double at[2], const oc_image_t *grey, const double H[9],
                         const ground_photo_t *photo, float scratch[GROUND_MAX_WIDE_PX * GROUND_WIDE_STRIDE],
                         ground_lookup_t *found)
{
    const uint32_t n = patch->n;
    float window[OC_MAX_GROUND_WINDOW_PX * GROUND_PATCH_STRIDE], step[2] = {0.0f, 0.0f};
    for (int round = 0; round < 2; round++) {
        const double there[2] = {at[0] + (double)found->shift_px[0], at[1] + (double)found->shift_px[1]};
        if (!window_take(grey, H, there, n, photo->is_smooth, scratch, window, GROUND_PATCH_STRIDE)) return;
        if (window_normalise(window, n) < MIN_SD) return;
        const float ncc = window_product(patch, window, GROUND_PATCH_STRIDE);
        if (round > 0 && ncc < found->ncc) { /* a step too far */
            found->shift_px[0] -= step[0];
            found->shift_px[1] -= step[1];
            return;
        }
        found->ncc = ncc;
        found->worst_block = blocks_worst(patch, window, (float)photo->noise_sd);
        if (!shift_step(patch, window, step, found->cov_px2)) return;
        if (round == 1 || !(fabsf(step[0]) <= 0.7f && fabsf(step[1]) <= 0.7f)) return;
        found->shift_px[0] += step[0];
        found->shift_px[1] += step[1];
    }
}

void oc_ground_look_up(const ground_patch_t *patch, const double at[2], const oc_image_t *grey, const double H[9],
                       const ground_photo_t *photo, ground_lookup_t *found)
{
    *found = (ground_lookup_t){.is_inside = false, .ncc = -1.0f, .worst_block = -1.0f};

    float wide[GROUND_MAX_WIDE_PX * GROUND_WIDE_STRIDE];
    const uint32_t wide_n = patch->n + 2u * GROUND_SEARCH_PX;
    if (!window_take(grey, H, at, wide_n, photo->is_smooth, wide, wide, GROUND_WIDE_STRIDE)) return;
    found->is_inside = true;
    wide_centre(wide, wide_n);
    found->is_at_border = !peak_find(patch, wide, found);
    if (!found->is_at_border) shift_refine(patch, at, grey, H, photo, wide, found);

    /* Noise in both windows lowers the correlation of what is the same. */
    const float share = 0.5f * (float)(photo->noise_sd * photo->noise_sd) / (patch->sd * patch->sd);
    const float ncc = found->ncc / (1.0f - (share < MAX_NOISE_SHARE ? share : MAX_NOISE_SHARE));
    found->ncc = ncc < 1.0f ? ncc : 1.0f;
}

/* ---- noise ---- */

#define NOISE_BINS 512u

double oc_ground_noise_sd(const oc_image_t *grey)
{
    /* The mask 1 -2 1, -2 4 -2, 1 -2 1 sees no slope and no edge along an axis; noise of standard deviation s makes
     * it 6 s. The lower third of what it gives comes from where there is nothing else. */
    uint32_t count[NOISE_BINS] = {0}, n = 0;
    for (uint32_t y = 1; y + 1 < grey->height_px; y += 3u) {
        const uint8_t *q = grey->px + (size_t)y * grey->stride_bytes;
        const uint8_t *p = q - grey->stride_bytes, *r = q + grey->stride_bytes;
        for (uint32_t x = 1; x + 1 < grey->width_px; x += 3u) {
            const int32_t v = p[x - 1] - 2 * p[x] + p[x + 1] - 2 * q[x - 1] + 4 * q[x] - 2 * q[x + 1] + r[x - 1] -
                              2 * r[x] + r[x + 1];
            const uint32_t size = (uint32_t)(v < 0 ? -v : v);
            count[size < NOISE_BINS ? size : NOISE_BINS - 1u]++;
            n++;
        }
    }
    uint32_t below = 0, bin = 0;
    while (bin + 1u < NOISE_BINS && 10u * (below + count[bin]) < 3u * n) below += count[bin++];
    return bin / (6.0 * 0.3853); /* 30 % of a normal lie within 0.3853 s */
}
