/* SPDX-License-Identifier: BSD-3-Clause
 * PNG by libpng's simplified interface, JPEG by libjpeg-turbo. */
#include "image_file.h"

#include <errno.h>
#include <png.h>
#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>

typedef struct jpeg_trap {
    struct jpeg_error_mgr base;
    jmp_buf back;
    char text[JMSG_LENGTH_MAX];
} jpeg_trap_t;

static void jpeg_trap_exit(j_common_ptr info)
{
    jpeg_trap_t *trap = (jpeg_trap_t *)info->err;
    trap->base.format_message(info, trap->text);
    longjmp(trap->back, 1);
}

/* libjpeg calls a truncated or corrupt scan a warning and goes on with grey
 * pixels; here it is a failure. */
static void jpeg_trap_message(j_common_ptr info, int level)
{
    if (level < 0) jpeg_trap_exit(info);
}

static FILE *image_open(const char *path, uint8_t magic[8], char *error, size_t error_bytes)
{
    FILE *file = fopen(path, "rb");
    if (!file) {
        snprintf(error, error_bytes, "%s: %s", path, strerror(errno));
        return NULL;
    }
    memset(magic, 0, 8);
    if (fread(magic, 1, 8, file) < 8) {
        snprintf(error, error_bytes, "%s: too short to be a picture", path);
        fclose(file);
        return NULL;
    }
    rewind(file);
    return file;
}

/* With out NULL only the size is read. */
static bool jpeg_read(FILE *file, const char *path, oc_image_mut_t *out, uint32_t size[2], char *error,
                      size_t error_bytes)
{
    struct jpeg_decompress_struct jpeg;
    jpeg_trap_t trap;
    jpeg.err = jpeg_std_error(&trap.base);
    trap.base.error_exit = jpeg_trap_exit;
    trap.base.emit_message = jpeg_trap_message;
    if (setjmp(trap.back)) {
        snprintf(error, error_bytes, "%s: %s", path, trap.text);
        jpeg_destroy_decompress(&jpeg);
        return false;
    }
    jpeg_create_decompress(&jpeg);
    jpeg_stdio_src(&jpeg, file);
    jpeg_read_header(&jpeg, TRUE);
    size[0] = jpeg.image_width;
    size[1] = jpeg.image_height;
    if (out && out->width_px == size[0] && out->height_px == size[1]) {
        jpeg.out_color_space = JCS_RGB;
        jpeg_start_decompress(&jpeg);
        while (jpeg.output_scanline < jpeg.output_height) {
            JSAMPROW row = out->px + (size_t)jpeg.output_scanline * out->stride_bytes;
            jpeg_read_scanlines(&jpeg, &row, 1);
        }
        jpeg_finish_decompress(&jpeg);
    }
    jpeg_destroy_decompress(&jpeg);
    return true;
}

static bool png_read(FILE *file, const char *path, oc_image_mut_t *out, uint32_t size[2], char *error,
                     size_t error_bytes)
{
    png_image png = {.version = PNG_IMAGE_VERSION};
    bool is_ok = png_image_begin_read_from_stdio(&png, file) != 0;
    if (is_ok) {
        size[0] = png.width;
        size[1] = png.height;
        if (out && out->width_px == size[0] && out->height_px == size[1]) {
            png.format = PNG_FORMAT_RGB;
            const png_color black = {0, 0, 0}; /* under transparent pixels; else they would keep the last picture's */
            is_ok = png_image_finish_read(&png, &black, out->px, (png_int_32)out->stride_bytes, NULL) != 0;
        }
    }
    if (!is_ok) snprintf(error, error_bytes, "%s: %s", path, png.message);
    png_image_free(&png);
    return is_ok;
}

static bool image_read(const char *path, oc_image_mut_t *out, uint32_t size[2], char *error, size_t error_bytes)
{
    uint8_t magic[8];
    FILE *file = image_open(path, magic, error, error_bytes);
    if (!file) return false;
    bool is_ok = false;
    if (png_sig_cmp(magic, 0, 8) == 0) {
        is_ok = png_read(file, path, out, size, error, error_bytes);
    } else if (magic[0] == 0xff && magic[1] == 0xd8) {
        is_ok = jpeg_read(file, path, out, size, error, error_bytes);
    } else {
        snprintf(error, error_bytes, "%s: neither PNG nor JPEG", path);
    }
    fclose(file);
    return is_ok;
}

bool oc_image_file_size(const char *path, uint32_t *width_px, uint32_t *height_px, char *error, size_t error_bytes)
{
    uint32_t size[2];
    if (!image_read(path, NULL, size, error, error_bytes)) return false;
    *width_px = size[0];
    *height_px = size[1];
    return true;
}

bool oc_image_file_read(const char *path, oc_image_mut_t *out, char *error, size_t error_bytes)
{
    uint32_t size[2];
    if (!image_read(path, out, size, error, error_bytes)) return false;
    if (size[0] != out->width_px || size[1] != out->height_px) {
        snprintf(error, error_bytes, "%s: is %ux%u, expected %ux%u", path, size[0], size[1], out->width_px,
                 out->height_px);
        return false;
    }
    return true;
}
