/* SPDX-License-Identifier: BSD-3-Clause
 * Rectification: table of raw pixel coordinates, then a bilinear gather. */
#include "rectify.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Where in the raw image a pixel comes from: corner of the 2x2 cell and the
 * weights of its right column and lower row in 1/256; x < 0 = outside. */
typedef struct rectify_cell {
    int32_t x, y;
    uint16_t wx, wy;
} rectify_cell_t;

struct oc_rectify {
    rectify_cell_t *table;
    uint8_t *px;
    bool has_table;
    oc_lens_t lens;
};

oc_rectify_t *oc_rectify_create(uint32_t max_width_px, uint32_t max_height_px)
{
    oc_rectify_t *rectify = calloc(1, sizeof *rectify);
    if (!rectify) return NULL;
    const size_t n = (size_t)max_width_px * max_height_px;
    rectify->table = malloc(n * sizeof *rectify->table);
    rectify->px = malloc(n * 3);
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

static rectify_cell_t rectify_cell(const oc_lens_t *lens, uint32_t x, uint32_t y)
{
    double raw_x, raw_y;
    oc_lens_distort(lens, x, y, &raw_x, &raw_y);
    rectify_cell_t cell = {-1, -1, 0, 0};
    if (!(raw_x >= 0 && raw_y >= 0 && raw_x < lens->raw.width_px - 1.0 && raw_y < lens->raw.height_px - 1.0))
        return cell;
    cell.x = (int32_t)raw_x;
    cell.y = (int32_t)raw_y;
    cell.wx = (uint16_t)lround((raw_x - cell.x) * 256);
    cell.wy = (uint16_t)lround((raw_y - cell.y) * 256);
    return cell;
}

static void rectify_make_table(oc_rectify_t *rectify, const oc_lens_t *lens)
{
    const oc_intrinsics_t *k = &lens->rectified;
    for (uint32_t y = 0; y < k->height_px; y++) {
        for (uint32_t x = 0; x < k->width_px; x++)
            rectify->table[(size_t)y * k->width_px + x] = rectify_cell(lens, x, y);
    }
    rectify->lens = *lens;
    rectify->has_table = true;
}

static void rectify_gather(const oc_raw_image_t *raw, rectify_cell_t cell, uint8_t out[3])
{
    if (cell.x < 0) {
        memset(out, 0, 3);
        return;
    }
    const uint8_t *top = raw->px + (size_t)cell.y * raw->stride_bytes + (size_t)cell.x * 3;
    const uint8_t *low = top + raw->stride_bytes;
    for (int c = 0; c < 3; c++) {
        const uint32_t a = (uint32_t)top[c] * (256u - cell.wx) + (uint32_t)top[3 + c] * cell.wx;
        const uint32_t b = (uint32_t)low[c] * (256u - cell.wx) + (uint32_t)low[3 + c] * cell.wx;
        out[c] = (uint8_t)((a * (256u - cell.wy) + b * cell.wy + 32768u) >> 16);
    }
}

oc_image_t oc_rectify_apply(oc_rectify_t *rectify, const oc_raw_image_t *raw, const oc_lens_t *lens)
{
    if (oc_lens_is_identity(lens)) return oc_image_from_raw(raw);
    const bool is_same = rectify->has_table && memcmp(&rectify->lens, lens, sizeof *lens) == 0;
    if (!is_same) rectify_make_table(rectify, lens);
    const oc_intrinsics_t *k = &lens->rectified;
    const size_t n = (size_t)k->width_px * k->height_px;
    for (size_t i = 0; i < n; i++) rectify_gather(raw, rectify->table[i], rectify->px + 3 * i);
    return (oc_image_t){rectify->px, k->width_px, k->height_px, 3 * k->width_px, 3};
}
