/* SPDX-License-Identifier: BSD-3-Clause
 * libwebp and libjpeg-turbo behind one call. */
#include "pixel_codec.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>
#include <webp/encode.h>

typedef struct jpeg_trap {
    struct jpeg_error_mgr base;
    jmp_buf back;
} jpeg_trap_t;

static void jpeg_trap_exit(j_common_ptr info)
{
    longjmp(((jpeg_trap_t *)info->err)->back, 1);
}

static void jpeg_write(struct jpeg_compress_struct *jpeg, const oc_image_t *image, int quality)
{
    jpeg->image_width = image->width_px;
    jpeg->image_height = image->height_px;
    jpeg->input_components = (int)image->channels;
    jpeg->in_color_space = image->channels == 3 ? JCS_RGB : JCS_GRAYSCALE;
    jpeg_set_defaults(jpeg);
    jpeg_set_quality(jpeg, quality, TRUE);
    jpeg->optimize_coding = TRUE;
    jpeg_start_compress(jpeg, TRUE);
    while (jpeg->next_scanline < jpeg->image_height) {
        /* libjpeg's row type is not const, but it only reads. */
        JSAMPROW row = (JSAMPROW)(uintptr_t)(image->px + (size_t)jpeg->next_scanline * image->stride_bytes);
        jpeg_write_scanlines(jpeg, &row, 1);
    }
    jpeg_finish_compress(jpeg);
}

static bool jpeg_encode(const oc_image_t *image, int quality, uint8_t **bytes, size_t *n_bytes)
{
    struct jpeg_compress_struct jpeg;
    jpeg_trap_t trap;
    unsigned char *volatile out = NULL;
    unsigned long size = 0;
    jpeg.err = jpeg_std_error(&trap.base);
    trap.base.error_exit = jpeg_trap_exit;
    if (setjmp(trap.back)) {
        jpeg_destroy_compress(&jpeg);
        free(out);
        return false;
    }
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, (unsigned char **)(uintptr_t)&out, &size);
    jpeg_write(&jpeg, image, quality);
    jpeg_destroy_compress(&jpeg);
    *bytes = out;
    *n_bytes = size;
    return true;
}

static bool webp_encode(const oc_image_t *image, int quality, uint8_t **bytes, size_t *n_bytes)
{
    WebPConfig config;
    WebPPicture picture;
    WebPMemoryWriter writer;
    if (image->channels != 3) return false;
    if (!WebPConfigPreset(&config, WEBP_PRESET_PICTURE, (float)quality) || !WebPPictureInit(&picture)) return false;
    config.method = 6;
    config.segments = 1;
    picture.width = (int)image->width_px;
    picture.height = (int)image->height_px;
    WebPMemoryWriterInit(&writer);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    const bool is_ok =
        WebPPictureImportRGB(&picture, image->px, (int)image->stride_bytes) && WebPEncode(&config, &picture);
    WebPPictureFree(&picture);
    if (!is_ok) {
        WebPMemoryWriterClear(&writer);
        return false;
    }
    *bytes = writer.mem;
    *n_bytes = writer.size;
    return true;
}

bool oc_pixel_encode(const oc_image_t *image, oc_codec_t codec, int quality, uint8_t **bytes, size_t *n_bytes)
{
    if (codec == OC_CODEC_JPEG) return jpeg_encode(image, quality, bytes, n_bytes);
    if (codec == OC_CODEC_WEBP) return webp_encode(image, quality, bytes, n_bytes);
    return false;
}

void oc_pixel_free(oc_codec_t codec, uint8_t *bytes)
{
    if (codec == OC_CODEC_WEBP) {
        WebPFree(bytes);
    } else {
        free(bytes);
    }
}

bool oc_pixel_encode_within(const oc_image_t *image, int quality, uint8_t *out, size_t cap, size_t *n_bytes)
{
    int low = 0, high = quality, next = quality;
    bool is_found = false;
    while (low <= high) {
        uint8_t *bytes = NULL;
        size_t size = 0;
        if (!webp_encode(image, next, &bytes, &size)) return false;
        if (size <= cap) {
            memcpy(out, bytes, size);
            *n_bytes = size;
            is_found = true;
            low = next + 1;
        } else {
            high = next - 1;
        }
        WebPFree(bytes);
        next = (low + high) / 2;
    }
    return is_found;
}
