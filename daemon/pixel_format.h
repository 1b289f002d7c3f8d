/* SPDX-License-Identifier: BSD-3-Clause
 * Pixels as a camera or a file gives them, before rectification. */
#ifndef OUTCROP_DAEMON_PIXEL_FORMAT_H
#define OUTCROP_DAEMON_PIXEL_FORMAT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum oc_pixel_format {
    OC_PIXEL_GREY, /* 8 bit */
    OC_PIXEL_RGB,  /* interleaved, 24 bit */
    OC_PIXEL_YUYV, /* 4:2:2, Y0 U Y1 V */
    OC_PIXEL_UYVY, /* 4:2:2, U Y0 V Y1 */
    OC_PIXEL_NV12, /* 4:2:0, a plane Y, then a plane U V */
    OC_PIXEL_MJPG  /* one JPEG per frame; never in an oc_raw_image_t */
} oc_pixel_format_t;

/* Borrowed pixels. Y is BT.601 of limited range (16 to 235), as UVC cameras send. */
typedef struct oc_raw_image {
    oc_pixel_format_t format;
    uint32_t width_px, height_px;
    uint32_t stride_bytes; /* of px; of the chroma plane as well */
    const uint8_t *px;
    const uint8_t *chroma; /* NV12 only */
} oc_raw_image_t;

/* "YUYV", "UYVY", "NV12", "GREY", "MJPG", "RGB"; "?" for what is none. Static storage. */
const char *oc_pixel_format_name(oc_pixel_format_t format);
/* By that name; false when it is none. */
bool oc_pixel_format_from_name(const char *name, oc_pixel_format_t *format);

/* Bytes of a whole frame with this stride; 0 for MJPG. */
size_t oc_pixel_format_bytes(oc_pixel_format_t format, uint32_t stride_bytes, uint32_t height_px);

/* The least stride of a row of this width. 0 where there is none: MJPG, width 0, and an odd width of
 * YUYV or UYVY, whose pixels come in pairs. NV12 may be odd both ways; a row is then padded to a pair. */
uint32_t oc_pixel_format_row_bytes(oc_pixel_format_t format, uint32_t width_px);

/* What a source must see to before it hands pixels on: a size within OC_MIN_IMAGE_SIDE..OC_MAX_IMAGE_SIDE
 * that the format can have, a stride of at least one row, and all planes there. */
bool oc_raw_image_is_valid(const oc_raw_image_t *raw);

/* Channels of what rectification makes of it: 1 for GREY, else 3. */
uint32_t oc_pixel_format_channels(oc_pixel_format_t format);

/* A grey or RGB image as raw pixels, and back (an empty image for other formats). */
oc_raw_image_t oc_raw_from_image(const oc_image_t *image);
oc_image_t oc_image_from_raw(const oc_raw_image_t *raw);

#ifdef __cplusplus
}
#endif
#endif
