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
