/* SPDX-License-Identifier: BSD-3-Clause
 * Lens distortion removed by a fixed look-up table. */
#ifndef OUTCROP_DAEMON_RECTIFY_H
#define OUTCROP_DAEMON_RECTIFY_H

#include <stdbool.h>
#include <stdint.h>

#include "core/camera.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct oc_rectify oc_rectify_t;

/* A rectifier for RGB images of at most this size: 15 bytes a pixel, all
 * allocated here. NULL when there is no memory. */
oc_rectify_t *oc_rectify_create(uint32_t max_width_px, uint32_t max_height_px);
void oc_rectify_destroy(oc_rectify_t *rectify);

/* The pinhole image of a distorted one, same intrinsics, bilinear; pixels that
 * the raw image does not show become black. The table is made anew only when
 * camera or distortion change. The result is borrowed until the next call. */
oc_image_t oc_rectify_apply(oc_rectify_t *rectify, const oc_image_t *raw, const oc_intrinsics_t *k,
                            const oc_distortion_t *distortion);

#ifdef __cplusplus
}
#endif
#endif
