/* SPDX-License-Identifier: BSD-3-Clause
 * Names and sizes of pixel formats. */
#include "pixel_format.h"

#include <string.h>

static const char *const names[] = {
    [OC_PIXEL_GREY] = "GREY", [OC_PIXEL_RGB] = "RGB",   [OC_PIXEL_YUYV] = "YUYV",
    [OC_PIXEL_UYVY] = "UYVY", [OC_PIXEL_NV12] = "NV12", [OC_PIXEL_MJPG] = "MJPG",
};

#define N_FORMATS (sizeof names / sizeof *names)

const char *oc_pixel_format_name(oc_pixel_format_t format)
{
    return (unsigned)format < N_FORMATS ? names[format] : "?";
}

bool oc_pixel_format_from_name(const char *name, oc_pixel_format_t *format)
{
    for (unsigned i = 0; i < N_FORMATS; i++) {
        if (strcmp(name, names[i]) != 0) continue;
        *format = (oc_pixel_format_t)i;
        return true;
    }
    return false;
}

size_t oc_pixel_format_bytes(oc_pixel_format_t format, uint32_t stride_bytes, uint32_t height_px)
{
    const size_t luma = (size_t)stride_bytes * height_px;
    if (format == OC_PIXEL_MJPG) return 0;
    return format == OC_PIXEL_NV12 ? luma + (size_t)stride_bytes * ((height_px + 1u) / 2u) : luma;
}

uint32_t oc_pixel_format_row_bytes(oc_pixel_format_t format, uint32_t width_px)
{
    switch (format) {
    case OC_PIXEL_GREY: return width_px;
    case OC_PIXEL_RGB: return 3u * width_px;
    case OC_PIXEL_YUYV:
    case OC_PIXEL_UYVY: return width_px % 2u == 0 ? 2u * width_px : 0;
    case OC_PIXEL_NV12: return width_px + width_px % 2u;
    case OC_PIXEL_MJPG: break;
    }
    return 0;
}

static bool is_side(uint32_t side_px)
{
    return side_px >= OC_MIN_IMAGE_SIDE && side_px <= OC_MAX_IMAGE_SIDE;
}

bool oc_raw_image_is_valid(const oc_raw_image_t *raw)
{
    if (!is_side(raw->width_px) || !is_side(raw->height_px)) return false;
    const uint32_t row_bytes = oc_pixel_format_row_bytes(raw->format, raw->width_px);
    if (row_bytes == 0 || raw->stride_bytes < row_bytes || !raw->px) return false;
    return raw->format != OC_PIXEL_NV12 || raw->chroma;
}

uint32_t oc_pixel_format_channels(oc_pixel_format_t format)
{
    return format == OC_PIXEL_GREY ? 1 : 3;
}

oc_raw_image_t oc_raw_from_image(const oc_image_t *image)
{
    return (oc_raw_image_t){.format = image->channels == 1 ? OC_PIXEL_GREY : OC_PIXEL_RGB,
                            .width_px = image->width_px,
                            .height_px = image->height_px,
                            .stride_bytes = image->stride_bytes,
                            .px = image->px};
}

oc_image_t oc_image_from_raw(const oc_raw_image_t *raw)
{
    if (raw->format != OC_PIXEL_GREY && raw->format != OC_PIXEL_RGB) return (oc_image_t){NULL, 0, 0, 0, 0};
    return (oc_image_t){raw->px, raw->width_px, raw->height_px, raw->stride_bytes,
                        oc_pixel_format_channels(raw->format)};
}
