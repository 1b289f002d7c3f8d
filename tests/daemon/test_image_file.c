/* SPDX-License-Identifier: BSD-3-Clause
 * Pictures from files: PNG exactly, JPEG nearly, and nothing from broken ones. */
#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include <jpeglib.h>
#include <png.h>

#include "image_file.h"

#define WIDTH 80u
#define HEIGHT 56u

static char path[64];
static char error[512];
static uint8_t px[3u * WIDTH * HEIGHT], out_px[3u * WIDTH * HEIGHT];
static oc_image_mut_t out = {out_px, WIDTH, HEIGHT, 3u * WIDTH, 3};

void setUp(void)
{
    strcpy(path, "/tmp/outcrop_image_XXXXXX");
    const int fd = mkstemp(path);
    TEST_ASSERT_TRUE(fd >= 0);
    close(fd);
    for (uint32_t i = 0; i < sizeof px; i++) px[i] = (uint8_t)(20u + i % 3u * 40u + i / 3u % WIDTH + i / (3u * WIDTH));
    memset(out_px, 0xcc, sizeof out_px);
}

void tearDown(void)
{
    unlink(path);
}

static void write_png(uint32_t format)
{
    png_image png = {.version = PNG_IMAGE_VERSION, .width = WIDTH, .height = HEIGHT, .format = format};
    TEST_ASSERT_TRUE(png_image_write_to_file(&png, path, 0, px, 0, NULL));
}

static void write_jpeg(bool is_progressive)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    FILE *file = fopen(path, "wb");
    TEST_ASSERT_NOT_NULL(file);
    jpeg_stdio_dest(&jpeg, file);
    jpeg.image_width = WIDTH;
    jpeg.image_height = HEIGHT;
    jpeg.input_components = 3;
    jpeg.in_color_space = JCS_RGB;
    jpeg_set_defaults(&jpeg);
    jpeg_set_quality(&jpeg, 97, TRUE);
    if (is_progressive) jpeg_simple_progression(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    while (jpeg.next_scanline < HEIGHT) {
        JSAMPROW row = px + (size_t)jpeg.next_scanline * 3u * WIDTH;
        jpeg_write_scanlines(&jpeg, &row, 1);
    }
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    fclose(file);
}

static long file_bytes(void)
{
    FILE *file = fopen(path, "rb");
    TEST_ASSERT_NOT_NULL(file);
    fseek(file, 0, SEEK_END);
    const long n = ftell(file);
    fclose(file);
    return n;
}

static void check_error(void)
{
    TEST_ASSERT_EQUAL_MESSAGE(0, strncmp(error, path, strlen(path)), error);
    TEST_ASSERT_NULL_MESSAGE(strchr(error, '\n'), error);
    TEST_ASSERT_TRUE_MESSAGE(strlen(error) > strlen(path) + 4, error);
}

static void check_size(void)
{
    uint32_t width_px = 0, height_px = 0;
    TEST_ASSERT_TRUE_MESSAGE(oc_image_file_size(path, &width_px, &height_px, error, sizeof error), error);
    TEST_ASSERT_EQUAL(WIDTH, width_px);
    TEST_ASSERT_EQUAL(HEIGHT, height_px);
}

static void png_comes_out_as_it_went_in(void)
{
    write_png(PNG_FORMAT_RGB);
    check_size();
    TEST_ASSERT_TRUE_MESSAGE(oc_image_file_read(path, &out, error, sizeof error), error);
    TEST_ASSERT_EQUAL_UINT8_ARRAY(px, out_px, sizeof px);
}

static void grey_png_fills_all_channels(void)
{
    write_png(PNG_FORMAT_GRAY);
    TEST_ASSERT_TRUE_MESSAGE(oc_image_file_read(path, &out, error, sizeof error), error);
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        for (uint32_t c = 0; c < 3; c++) TEST_ASSERT_EQUAL_UINT8(px[i], out_px[3 * i + c]);
    }
}

static void transparent_pixels_do_not_show_the_picture_before(void)
{
    static uint8_t clear[4u * WIDTH * HEIGHT]; /* alpha 0 everywhere */
    png_image png = {.version = PNG_IMAGE_VERSION, .width = WIDTH, .height = HEIGHT, .format = PNG_FORMAT_RGBA};
    TEST_ASSERT_TRUE(png_image_write_to_file(&png, path, 0, clear, 0, NULL));
    TEST_ASSERT_TRUE_MESSAGE(oc_image_file_read(path, &out, error, sizeof error), error);
    TEST_ASSERT_EACH_EQUAL_UINT8(0, out_px, sizeof out_px);
}

static void jpeg_comes_out_nearly_as_it_went_in(void)
{
    for (int progressive = 0; progressive < 2; progressive++) {
        write_jpeg(progressive);
        check_size();
        TEST_ASSERT_TRUE_MESSAGE(oc_image_file_read(path, &out, error, sizeof error), error);
        for (size_t i = 0; i < sizeof px; i++) TEST_ASSERT_UINT8_WITHIN(12, px[i], out_px[i]);
    }
}

/* From its last `tail` bytes on. */
static void cut_anywhere_it_is_refused(void (*write)(void), long tail)
{
    write();
    const long whole = file_bytes();
    for (long n = whole - tail; n >= 0; n -= 1 + whole / 60) {
        TEST_ASSERT_EQUAL(0, truncate(path, n));
        char place[64];
        snprintf(place, sizeof place, "cut at %ld of %ld", n, whole);
        TEST_ASSERT_FALSE_MESSAGE(oc_image_file_read(path, &out, error, sizeof error), place);
        check_error();
    }
}

static void write_rgb_png(void)
{
    write_png(PNG_FORMAT_RGB);
}

static void write_plain_jpeg(void)
{
    write_jpeg(false);
}

static void write_progressive_jpeg(void)
{
    write_jpeg(true);
}

static void a_cut_png_is_refused(void)
{
    cut_anywhere_it_is_refused(write_rgb_png, 13); /* the end chunk's 12 bytes hold no pixels */
}

static void a_cut_jpeg_is_refused(void)
{
    cut_anywhere_it_is_refused(write_plain_jpeg, 3);
    cut_anywhere_it_is_refused(write_progressive_jpeg, 3);
}

static void a_picture_of_another_size_is_refused_and_writes_nothing(void)
{
    oc_image_mut_t small = {out_px, WIDTH - 1u, HEIGHT, 3u * (WIDTH - 1u), 3};
    for (int kind = 0; kind < 2; kind++) {
        if (kind == 0) write_rgb_png();
        if (kind == 1) write_plain_jpeg();
        TEST_ASSERT_FALSE(oc_image_file_read(path, &small, error, sizeof error));
        check_error();
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, "is 80x56, expected 79x56"), error);
        TEST_ASSERT_EACH_EQUAL_UINT8(0xcc, out_px, sizeof out_px);
    }
}

static void what_is_no_picture_is_refused(void)
{
    FILE *file = fopen(path, "wb");
    TEST_ASSERT_NOT_NULL(file);
    fputs("P6 80 56 255 and so on", file);
    fclose(file);
    uint32_t width_px = 1, height_px = 2;
    TEST_ASSERT_FALSE(oc_image_file_size(path, &width_px, &height_px, error, sizeof error));
    check_error();
    TEST_ASSERT_EQUAL(1, width_px);
    TEST_ASSERT_EQUAL(2, height_px);
    unlink(path);
    TEST_ASSERT_FALSE(oc_image_file_size(path, &width_px, &height_px, error, sizeof error));
    check_error();
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(png_comes_out_as_it_went_in);
    RUN_TEST(grey_png_fills_all_channels);
    RUN_TEST(transparent_pixels_do_not_show_the_picture_before);
    RUN_TEST(jpeg_comes_out_nearly_as_it_went_in);
    RUN_TEST(a_cut_png_is_refused);
    RUN_TEST(a_cut_jpeg_is_refused);
    RUN_TEST(a_picture_of_another_size_is_refused_and_writes_nothing);
    RUN_TEST(what_is_no_picture_is_refused);
    return UNITY_END();
}
