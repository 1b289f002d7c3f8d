/* SPDX-License-Identifier: BSD-3-Clause
 * The YUV half of rectification: rows of YUYV, UYVY or NV12 become RGB, straight or through the table. */
#ifndef OUTCROP_DAEMON_RECTIFY_YUV_H
#define OUTCROP_DAEMON_RECTIFY_YUV_H

#include <stdint.h>

#include "pixel_format.h"

/* Where in the raw picture a pixel comes from: the corner of a 2x2 cell of
 * pixel centres, at most side - 2, and the weights of its right column and
 * lower row in 1/256, at most 256. x = OC_RECTIFY_OUTSIDE: nowhere. */
typedef struct oc_rectify_cell {
    uint16_t x, y;
    uint16_t wx, wy;
} oc_rectify_cell_t;

#define OC_RECTIFY_OUTSIDE 0xffffu

/* Row y as it is; each chroma sample serves all of its pixels. rgb: 3 * width_px bytes. */
void oc_yuv_row(const oc_raw_image_t *raw, uint32_t y, uint8_t *rgb);

/* n pixels through the table: luma and chroma bilinear, chroma samples being
 * in the middle of the pixels that they serve. rgb: 3 * n bytes. */
void oc_yuv_gather(const oc_raw_image_t *raw, const oc_rectify_cell_t *cells, uint32_t n, uint8_t *rgb);

#endif
