/* SPDX-License-Identifier: BSD-3-Clause
 * From raw pixels to a rectified grey or RGB picture in one pass: lens
 * distortion removed by a fixed look-up table, colours converted on the way,
 * nothing copied before. */
#ifndef OUTCROP_DAEMON_RECTIFY_H
#define OUTCROP_DAEMON_RECTIFY_H

#include <stdbool.h>
#include <stdint.h>

#include "core/camera.h"
#include "core/image.h"
#include "lens.h"
#include "pixel_format.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct oc_rectify oc_rectify_t;

/* A rectifier whose pictures are at most this many pixels: 11 bytes each, all
 * allocated here. NULL when there is no memory. One per camera, or the table
 * is made anew at each change between them. */
oc_rectify_t *oc_rectify_create(uint32_t max_width_px, uint32_t max_height_px);
void oc_rectify_destroy(oc_rectify_t *rectify);

/* The pinhole picture of a raw one, lens->rectified, bilinear. Pixels that the
 * raw picture does not show, or that lie beyond the lens' reach, are black. The
 * table is made anew only when the lens changes (some 0.1 us a pixel); without
 * distortion none is used. Grey raw pixels give 1 channel, others 3.
 *
 * The result is borrowed until the next call, and until the raw picture goes:
 * grey or RGB without distortion is passed through. An empty image (px NULL)
 * where raw is not valid (oc_raw_image_is_valid), its size is not lens->raw's,
 * lens is not valid, or lens->rectified is larger than the rectifier. */
oc_image_t oc_rectify_apply(oc_rectify_t *rectify, const oc_raw_image_t *raw, const oc_lens_t *lens);

#ifdef __cplusplus
}
#endif
#endif
