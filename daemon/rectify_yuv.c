/* SPDX-License-Identifier: BSD-3-Clause
 * YUV to RGB in blocks: samples are brought into plain arrays, converted there
 * by loops that the compiler turns into vector instructions, and interleaved. */
#include "rectify_yuv.h"

#include <string.h>

#define BLOCK 64u

/* Luma over black in 1/128, chroma off the middle in 1/256: what 16 bits hold. */
typedef struct yuv_block {
    int16_t y[BLOCK], u[BLOCK], v[BLOCK];
} yuv_block_t;

typedef struct rgb_block {
    uint8_t r[BLOCK], g[BLOCK], b[BLOCK];
} rgb_block_t;

/* Where the samples of a format are: everything a constant once inlined. */
typedef struct yuv_layout {
    uint32_t y_step, y_first;     /* bytes between pixels, and to the first */
    uint32_t uv_step, u_at, v_at; /* the same of chroma samples */
    bool is_planar;               /* chroma has its own plane, of half the rows */
} yuv_layout_t;

static const yuv_layout_t yuyv = {2, 0, 4, 1, 3, false};
static const yuv_layout_t uyvy = {2, 1, 4, 0, 2, false};
static const yuv_layout_t nv12 = {1, 0, 2, 0, 1, true};

/* ---- BT.601 of limited range ---- */

/* High half of a product of 16-bit numbers, one instruction in vectors. */
static inline int16_t high_half(int16_t a, int16_t b)
{
    return (int16_t)((a * b) >> 16);
}

static inline uint8_t to_level(int v)
{
    const int level = (v + 16) >> 5;
    return (uint8_t)(level < 0 ? 0 : level > 255 ? 255 : level);
}

/* Sums in 1/32 of a level; factors in 1/16384 for luma and 1/8192 for chroma: 255/219, then 2 (1 - Kr),
 * 2 (1 - Kb) and their shares of green, times 255/224. What the floors take away on the mean is added
 * again, so that a level is at most 0.6 off the formula's real value. */
static void convert_block(const yuv_block_t *in, rgb_block_t *out)
{
    for (uint32_t i = 0; i < BLOCK; i++) {
        const int16_t y = high_half(in->y[i], 19077);
        const int16_t u = in->u[i], v = in->v[i];
        out->r[i] = to_level((int16_t)(y + high_half(v, 13075) + 1));
        out->g[i] = to_level((int16_t)(y - high_half(u, 3209) - high_half(v, 6660)));
        out->b[i] = to_level((int16_t)(y + high_half(u, 16525) + 1));
    }
}

static void interleave_block(const rgb_block_t *in, uint32_t n, uint8_t *rgb)
{
    for (uint32_t i = 0; i < n; i++) {
        rgb[3 * i] = in->r[i];
        rgb[3 * i + 1] = in->g[i];
        rgb[3 * i + 2] = in->b[i];
    }
}

/* ---- rows as they are ---- */

static inline const uint8_t *chroma_row(const oc_raw_image_t *raw, const yuv_layout_t *at, uint32_t luma_row)
{
    return at->is_planar ? raw->chroma + (size_t)(luma_row / 2) * raw->stride_bytes
                         : raw->px + (size_t)luma_row * raw->stride_bytes;
}

/* n pixels from an even one on; a pair's second pixel is made even where only its first is wanted. */
static inline void load_pairs(const uint8_t *luma, const uint8_t *chroma, const yuv_layout_t *at, uint32_t n,
                              yuv_block_t *out)
{
    for (uint32_t i = 0; i < n; i++) out->y[i] = (int16_t)((luma[at->y_step * i + at->y_first] - 16) * 128);
    for (uint32_t i = 0; i < (n + 1) / 2; i++) {
        const int16_t u = (int16_t)((chroma[at->uv_step * i + at->u_at] - 128) * 256);
        const int16_t v = (int16_t)((chroma[at->uv_step * i + at->v_at] - 128) * 256);
        out->u[2 * i] = out->u[2 * i + 1] = u;
        out->v[2 * i] = out->v[2 * i + 1] = v;
    }
}

static inline void convert_row(const oc_raw_image_t *raw, const yuv_layout_t *at, uint32_t y, uint8_t *rgb)
{
    const uint8_t *luma = raw->px + (size_t)y * raw->stride_bytes, *chroma = chroma_row(raw, at, y);
    yuv_block_t in;
    rgb_block_t out;
    memset(&in, 0, sizeof in);
    uint32_t x = 0;
    for (; x + BLOCK <= raw->width_px; x += BLOCK) {
        load_pairs(luma + at->y_step * x, chroma + at->uv_step * (x / 2), at, BLOCK, &in);
        convert_block(&in, &out);
        interleave_block(&out, BLOCK, rgb + 3 * x);
    }
    if (x == raw->width_px) return;
    load_pairs(luma + at->y_step * x, chroma + at->uv_step * (x / 2), at, raw->width_px - x, &in);
    convert_block(&in, &out);
    interleave_block(&out, raw->width_px - x, rgb + 3 * x);
}

void oc_yuv_row(const oc_raw_image_t *raw, uint32_t y, uint8_t *rgb)
{
    if (raw->format == OC_PIXEL_YUYV) convert_row(raw, &yuyv, y, rgb);
    if (raw->format == OC_PIXEL_UYVY) convert_row(raw, &uyvy, y, rgb);
    if (raw->format == OC_PIXEL_NV12) convert_row(raw, &nv12, y, rgb);
}

/* ---- through the table ---- */

/* The same place between chroma samples, which are half as many: cell and weight in 1/512. Beyond the
 * outermost samples those serve. */
static inline uint32_t chroma_cell(uint32_t luma, uint32_t weight, uint32_t n_samples, uint32_t *chroma_weight)
{
    const int32_t at = (int32_t)(256 * luma + weight) - 128, last = (int32_t)(512 * (n_samples - 1));
    const uint32_t place = (uint32_t)(at < 0 ? 0 : at > last ? last : at);
    const uint32_t cell = place / 512 < n_samples - 2 ? place / 512 : n_samples - 2;
    *chroma_weight = place - 512 * cell;
    return cell;
}

/* Bilinear between four numbers; weights are shares of 1 << x_bits and 1 << y_bits, and the sum has both
 * bits behind the point. Each number may be two, each in 32 bits, of which 26 are used. */
static inline uint64_t blend(const uint64_t v[4], uint32_t wx, int x_bits, uint32_t wy, int y_bits)
{
    const uint64_t top = v[0] * ((1u << x_bits) - wx) + v[1] * wx;
    const uint64_t low = v[2] * ((1u << x_bits) - wx) + v[3] * wx;
    return top * ((1u << y_bits) - wy) + low * wy;
}

static inline uint32_t luma_of(const oc_raw_image_t *raw, const yuv_layout_t *at, oc_rectify_cell_t cell)
{
    const uint8_t *top = raw->px + (size_t)cell.y * raw->stride_bytes + at->y_step * cell.x + at->y_first;
    const uint8_t *low = top + raw->stride_bytes;
    const uint64_t v[4] = {top[0], top[at->y_step], low[0], low[at->y_step]};
    return (uint32_t)blend(v, cell.wx, 8, cell.wy, 8);
}

/* A chroma sample: U in the lower half, V in the upper. */
static inline uint64_t uv_pair(const uint8_t *sample, const yuv_layout_t *at)
{
    return sample[at->u_at] | (uint64_t)sample[at->v_at] << 32;
}

static inline void gather_pixel(const oc_raw_image_t *raw, const yuv_layout_t *at, oc_rectify_cell_t cell,
                                yuv_block_t *out, uint32_t i)
{
    uint32_t wx, wy = cell.wy, row = cell.y;
    const int y_bits = at->is_planar ? 9 : 8, drop = 9 + y_bits - 8;
    const uint32_t column = chroma_cell(cell.x, cell.wx, (raw->width_px + 1) / 2, &wx);
    if (at->is_planar) row = chroma_cell(cell.y, cell.wy, (raw->height_px + 1) / 2, &wy);
    const uint8_t *plane = at->is_planar ? raw->chroma : raw->px;
    const uint8_t *top = plane + (size_t)row * raw->stride_bytes + at->uv_step * column, *low = top + raw->stride_bytes;
    const uint64_t v[4] = {uv_pair(top, at), uv_pair(top + at->uv_step, at), uv_pair(low, at),
                           uv_pair(low + at->uv_step, at)};
    const uint64_t uv = blend(v, wx, 9, wy, y_bits);
    out->y[i] = (int16_t)((int32_t)(luma_of(raw, at, cell) >> 9) - 16 * 128);
    out->u[i] = (int16_t)((int32_t)((uint32_t)uv >> drop) - 128 * 256);
    out->v[i] = (int16_t)((int32_t)((uint32_t)(uv >> 32) >> drop) - 128 * 256);
}

static inline void gather_row(const oc_raw_image_t *raw, const yuv_layout_t *at, const oc_rectify_cell_t *cells,
                              uint32_t n, uint8_t *rgb)
{
    yuv_block_t in;
    rgb_block_t out;
    memset(&in, 0, sizeof in);
    for (uint32_t x = 0; x < n; x += BLOCK) {
        const uint32_t n_here = n - x < BLOCK ? n - x : BLOCK;
        for (uint32_t i = 0; i < n_here; i++) {
            if (cells[x + i].x == OC_RECTIFY_OUTSIDE)
                in.y[i] = in.u[i] = in.v[i] = 0;
            else
                gather_pixel(raw, at, cells[x + i], &in, i);
        }
        convert_block(&in, &out);
        interleave_block(&out, n_here, rgb + 3 * x);
    }
}

void oc_yuv_gather(const oc_raw_image_t *raw, const oc_rectify_cell_t *cells, uint32_t n, uint8_t *rgb)
{
    if (raw->format == OC_PIXEL_YUYV) gather_row(raw, &yuyv, cells, n, rgb);
    if (raw->format == OC_PIXEL_UYVY) gather_row(raw, &uyvy, cells, n, rgb);
    if (raw->format == OC_PIXEL_NV12) gather_row(raw, &nv12, cells, n, rgb);
}
