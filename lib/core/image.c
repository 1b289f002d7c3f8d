/* SPDX-License-Identifier: BSD-3-Clause
 * Image views: check, sample, luminance.
 */
#include "core/image.h"

#include <math.h>
#include <string.h>

static bool shape_is_valid(const void *px, uint32_t width_px, uint32_t height_px, uint32_t stride_bytes,
                           uint32_t channels)
{
    if (px == NULL) return false;
    if (width_px < OC_MIN_IMAGE_SIDE || width_px > OC_MAX_IMAGE_SIDE) return false;
    if (height_px < OC_MIN_IMAGE_SIDE || height_px > OC_MAX_IMAGE_SIDE) return false;
    if (channels != 1 && channels != 3) return false;
    return stride_bytes >= width_px * channels;
}

bool oc_image_is_valid(const oc_image_t *image)
{
    OC_ASSERT(image);

    return shape_is_valid(image->px, image->width_px, image->height_px, image->stride_bytes, image->channels);
}

float oc_image_sample(const oc_image_t *image, float x_px, float y_px)
{
    OC_ASSERT(image && image->channels == 1);

    /* Written so that NaN fails. The casts below are then in range. */
    if (!(x_px >= 0.0f && y_px >= 0.0f)) return -1.0f;
    if (!(x_px < (float)(image->width_px - 1) && y_px < (float)(image->height_px - 1))) return -1.0f;

    const uint32_t x = (uint32_t)x_px;
    const uint32_t y = (uint32_t)y_px;
    const float fx = x_px - (float)x;
    const float fy = y_px - (float)y;
    const uint8_t *p = image->px + (size_t)y * image->stride_bytes + x;
    const uint8_t *q = p + image->stride_bytes;
    const float top = (float)p[0] + fx * (float)(p[1] - p[0]);
    const float bottom = (float)q[0] + fx * (float)(q[1] - q[0]);
    return top + fy * (bottom - top);
}

static void grey_row(const uint8_t *rgb, uint8_t *grey, uint32_t width_px)
{
    for (uint32_t x = 0; x < width_px; x++) {
        const unsigned sum = 77u * rgb[3 * x] + 150u * rgb[3 * x + 1] + 29u * rgb[3 * x + 2] + 128u;
        grey[x] = (uint8_t)(sum >> 8);
    }
}

oc_status_t oc_image_to_grey(const oc_image_t *image, oc_image_mut_t *grey)
{
    OC_ASSERT(image && grey);

    if (!oc_image_is_valid(image)) return OC_E_ARG;
    if (!shape_is_valid(grey->px, grey->width_px, grey->height_px, grey->stride_bytes, grey->channels)) return OC_E_ARG;
    if (grey->channels != 1) return OC_E_ARG;
    if (grey->width_px != image->width_px || grey->height_px != image->height_px) return OC_E_ARG;

    for (uint32_t y = 0; y < image->height_px; y++) {
        const uint8_t *from = image->px + (size_t)y * image->stride_bytes;
        uint8_t *to = grey->px + (size_t)y * grey->stride_bytes;
        if (image->channels == 1)
            memmove(to, from, image->width_px);
        else
            grey_row(from, to, image->width_px);
    }
    return OC_OK;
}
