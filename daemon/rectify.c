/* SPDX-License-Identifier: BSD-3-Clause
 * Rectification: table of raw pixel coordinates, then a bilinear gather. */
#include "rectify.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "rectify_yuv.h"

struct oc_rectify {
    oc_rectify_cell_t *table; /* in rows, as pixels are written; cells of a row lie close to each other in raw */
    uint8_t *px;
    size_t max_px;
    bool has_table;
    oc_lens_t lens; /* of the table */
};

oc_rectify_t *oc_rectify_create(uint32_t max_width_px, uint32_t max_height_px)
{
    oc_rectify_t *rectify = calloc(1, sizeof *rectify);
    if (!rectify) return NULL;
    rectify->max_px = (size_t)max_width_px * max_height_px;
    rectify->table = malloc(rectify->max_px * sizeof *rectify->table);
    rectify->px = malloc(rectify->max_px * 3);
    if (!rectify->table || !rectify->px) {
        oc_rectify_destroy(rectify);
        return NULL;
    }
    return rectify;
}

void oc_rectify_destroy(oc_rectify_t *rectify)
{
    if (!rectify) return;
    free(rectify->table);
    free(rectify->px);
    free(rectify);
}

/* ---- the table ---- */

/* The last centre belongs to the cell before it, with its whole weight. */
static uint16_t cell_corner(double v_px, uint32_t side_px, uint16_t *weight)
{
    const uint32_t whole = (uint32_t)v_px, corner = whole < side_px - 2u ? whole : side_px - 2u;
    *weight = (uint16_t)lround((v_px - corner) * 256);
    return (uint16_t)corner;
}

static oc_rectify_cell_t make_cell(const oc_lens_t *lens, double reach, uint32_t x, uint32_t y)
{
    oc_rectify_cell_t cell = {OC_RECTIFY_OUTSIDE, 0, 0, 0};
    double raw_x, raw_y;
    if (!oc_lens_find(lens, reach, x, y, &raw_x, &raw_y)) return cell;
    cell.x = cell_corner(raw_x, lens->raw.width_px, &cell.wx);
    cell.y = cell_corner(raw_y, lens->raw.height_px, &cell.wy);
    return cell;
}

static void make_table(oc_rectify_t *rectify, const oc_lens_t *lens)
{
    const oc_intrinsics_t *k = &lens->rectified;
    const double reach = oc_lens_reach(lens);
    oc_rectify_cell_t *cell = rectify->table;
    for (uint32_t y = 0; y < k->height_px; y++) {
        for (uint32_t x = 0; x < k->width_px; x++) *cell++ = make_cell(lens, reach, x, y);
    }
    rectify->lens = *lens;
    rectify->has_table = true;
}

/* ---- grey and RGB through it ---- */

static inline uint8_t blend(const uint8_t *top, const uint8_t *low, uint32_t step, uint32_t wx, uint32_t wy)
{
    const uint32_t a = top[0] * (256u - wx) + top[step] * wx;
    const uint32_t b = low[0] * (256u - wx) + low[step] * wx;
    return (uint8_t)((a * (256u - wy) + b * wy + 32768u) >> 16);
}

static inline void gather_bytes(const oc_raw_image_t *raw, const oc_rectify_cell_t *cells, uint32_t n,
                                uint32_t channels, uint8_t *out)
{
    for (uint32_t i = 0; i < n; i++, out += channels) {
        const oc_rectify_cell_t cell = cells[i];
        if (cell.x == OC_RECTIFY_OUTSIDE) {
            memset(out, 0, channels);
            continue;
        }
        const uint8_t *top = raw->px + (size_t)cell.y * raw->stride_bytes + (size_t)cell.x * channels;
        const uint8_t *low = top + raw->stride_bytes;
        for (uint32_t c = 0; c < channels; c++) out[c] = blend(top + c, low + c, channels, cell.wx, cell.wy);
    }
}

static void gather_row(const oc_raw_image_t *raw, const oc_rectify_cell_t *cells, uint32_t n, uint8_t *out)
{
    if (raw->format == OC_PIXEL_GREY)
        gather_bytes(raw, cells, n, 1, out);
    else if (raw->format == OC_PIXEL_RGB)
        gather_bytes(raw, cells, n, 3, out);
    else
        oc_yuv_gather(raw, cells, n, out);
}

/* ---- pictures ---- */

static oc_image_t straight(oc_rectify_t *rectify, const oc_raw_image_t *raw)
{
    if (raw->format == OC_PIXEL_GREY || raw->format == OC_PIXEL_RGB) return oc_image_from_raw(raw);
    const uint32_t stride_bytes = 3 * raw->width_px;
    for (uint32_t y = 0; y < raw->height_px; y++) oc_yuv_row(raw, y, rectify->px + (size_t)y * stride_bytes);
    return (oc_image_t){rectify->px, raw->width_px, raw->height_px, stride_bytes, 3};
}

static oc_image_t through_table(oc_rectify_t *rectify, const oc_raw_image_t *raw, const oc_lens_t *lens)
{
    if (!rectify->has_table || !oc_lens_is_equal(&rectify->lens, lens)) make_table(rectify, lens);
    const oc_intrinsics_t *k = &lens->rectified;
    const uint32_t channels = oc_pixel_format_channels(raw->format), stride_bytes = channels * k->width_px;
    for (uint32_t y = 0; y < k->height_px; y++)
        gather_row(raw, rectify->table + (size_t)y * k->width_px, k->width_px, rectify->px + (size_t)y * stride_bytes);
    return (oc_image_t){rectify->px, k->width_px, k->height_px, stride_bytes, channels};
}

oc_image_t oc_rectify_apply(oc_rectify_t *rectify, const oc_raw_image_t *raw, const oc_lens_t *lens)
{
    const oc_image_t none = {NULL, 0, 0, 0, 0};
    if (!oc_raw_image_is_valid(raw) || !oc_lens_is_valid(lens)) return none;
    if (raw->width_px != lens->raw.width_px || raw->height_px != lens->raw.height_px) return none;
    if ((size_t)lens->rectified.width_px * lens->rectified.height_px > rectify->max_px) return none;
    return oc_lens_is_identity(lens) ? straight(rectify, raw) : through_table(rectify, raw, lens);
}
