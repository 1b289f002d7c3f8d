/* SPDX-License-Identifier: BSD-3-Clause
 * Borrowed views of 8-bit pixels. The library never owns an image. */
#ifndef OUTCROP_CORE_IMAGE_H
#define OUTCROP_CORE_IMAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Sides of an image in pixels that Outcrop works on. */
#define OC_MIN_IMAGE_SIDE 32u
#define OC_MAX_IMAGE_SIDE 4096u

/* Grey (1 channel) or interleaved RGB (3 channels); row y starts at
 * px + y * stride_bytes. Integer coordinates are pixel centres. */
typedef struct oc_image {
    const uint8_t *px;
    uint32_t width_px, height_px, stride_bytes;
    uint32_t channels; /* 1 or 3 */
} oc_image_t;

/* The same, for a callee that writes. */
typedef struct oc_image_mut {
    uint8_t *px;
    uint32_t width_px, height_px, stride_bytes;
    uint32_t channels;
} oc_image_mut_t;

/* Both sides within the limits above, channels 1 or 3, rows do not overlap,
 * px not NULL. */
bool oc_image_is_valid(const oc_image_t *image);

/* Bilinear sample of a one-channel image at (x_px, y_px).
 *
 * Uses floor and floor + 1 (the thesis' ceil in 4.5 gives weight 0 + 0 at
 * integers). Returns a negative number when the 2x2 neighbourhood is not
 * wholly inside, or a coordinate is not a number. */
float oc_image_sample(const oc_image_t *image, float x_px, float y_px);

/* Luminance Y = (77 R + 150 G + 29 B + 128) / 256 of an RGB image, or a copy of a grey one.
 * grey must have one channel and the same size; OC_E_ARG otherwise. */
OC_CHECKED oc_status_t oc_image_to_grey(const oc_image_t *image, oc_image_mut_t *grey);

#ifdef __cplusplus
}
#endif
#endif
