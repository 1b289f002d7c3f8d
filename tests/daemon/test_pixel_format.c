/* SPDX-License-Identifier: BSD-3-Clause
 * Pixel formats: names, sizes of rows and frames, and which raw pictures are refused. */
#include "unity.h"

#include "pixel_format.h"

static const oc_pixel_format_t formats[] = {OC_PIXEL_GREY, OC_PIXEL_RGB,  OC_PIXEL_YUYV,
                                            OC_PIXEL_UYVY, OC_PIXEL_NV12, OC_PIXEL_MJPG};

void setUp(void) {}

void tearDown(void) {}

static void names_lead_back_to_their_formats(void)
{
    for (unsigned i = 0; i < sizeof formats / sizeof *formats; i++) {
        oc_pixel_format_t found = OC_PIXEL_GREY;
        TEST_ASSERT_TRUE(oc_pixel_format_from_name(oc_pixel_format_name(formats[i]), &found));
        TEST_ASSERT_EQUAL(formats[i], found);
    }
    oc_pixel_format_t untouched = OC_PIXEL_NV12;
    const char *const strangers[] = {"", "?", "yuyv", "YUYV ", "YUY", "BGR"};
    for (unsigned i = 0; i < sizeof strangers / sizeof *strangers; i++)
        TEST_ASSERT_FALSE(oc_pixel_format_from_name(strangers[i], &untouched));
    TEST_ASSERT_EQUAL(OC_PIXEL_NV12, untouched);
    TEST_ASSERT_EQUAL_STRING("?", oc_pixel_format_name((oc_pixel_format_t)6));
}

static void rows_and_frames_have_the_bytes_of_the_v4l2_documents(void)
{
    TEST_ASSERT_EQUAL(641, oc_pixel_format_row_bytes(OC_PIXEL_GREY, 641));
    TEST_ASSERT_EQUAL(1923, oc_pixel_format_row_bytes(OC_PIXEL_RGB, 641));
    TEST_ASSERT_EQUAL(1280, oc_pixel_format_row_bytes(OC_PIXEL_YUYV, 640));
    TEST_ASSERT_EQUAL(1280, oc_pixel_format_row_bytes(OC_PIXEL_UYVY, 640));
    TEST_ASSERT_EQUAL(640, oc_pixel_format_row_bytes(OC_PIXEL_NV12, 640));
    TEST_ASSERT_EQUAL(642, oc_pixel_format_row_bytes(OC_PIXEL_NV12, 641));
    TEST_ASSERT_EQUAL(0, oc_pixel_format_row_bytes(OC_PIXEL_YUYV, 641));
    TEST_ASSERT_EQUAL(0, oc_pixel_format_row_bytes(OC_PIXEL_UYVY, 641));
    TEST_ASSERT_EQUAL(0, oc_pixel_format_row_bytes(OC_PIXEL_MJPG, 640));
    TEST_ASSERT_EQUAL(0, oc_pixel_format_row_bytes(OC_PIXEL_GREY, 0));

    TEST_ASSERT_EQUAL(640 * 480, oc_pixel_format_bytes(OC_PIXEL_GREY, 640, 480));
    TEST_ASSERT_EQUAL(640 * 480 * 3 / 2, oc_pixel_format_bytes(OC_PIXEL_NV12, 640, 480));
    TEST_ASSERT_EQUAL(640 * (481 + 241), oc_pixel_format_bytes(OC_PIXEL_NV12, 640, 481));
    TEST_ASSERT_EQUAL(0, oc_pixel_format_bytes(OC_PIXEL_MJPG, 640, 480));
}

static void only_whole_pictures_are_valid(void)
{
    static const uint8_t px[1];
    const oc_raw_image_t good = {OC_PIXEL_NV12, 64, 48, 64, px, px};
    TEST_ASSERT_TRUE(oc_raw_image_is_valid(&good));
    oc_raw_image_t bad[10];
    for (int i = 0; i < 10; i++) bad[i] = good;
    bad[0].chroma = NULL;
    bad[1].px = NULL;
    bad[2].stride_bytes = 63;
    bad[3].width_px = OC_MIN_IMAGE_SIDE - 1;
    bad[4].height_px = OC_MAX_IMAGE_SIDE + 1;
    bad[5].format = OC_PIXEL_MJPG;
    bad[6].format = OC_PIXEL_YUYV; /* 64 bytes are half a row */
    bad[7].format = (oc_pixel_format_t)17;
    bad[8].width_px = UINT32_MAX;
    bad[9].format = OC_PIXEL_UYVY;
    bad[9].width_px = 63; /* odd */
    bad[9].stride_bytes = 128;
    for (int i = 0; i < 10; i++) TEST_ASSERT_FALSE(oc_raw_image_is_valid(&bad[i]));
    oc_raw_image_t odd = good;
    odd.width_px = 63;
    odd.height_px = 47;
    TEST_ASSERT_TRUE(oc_raw_image_is_valid(&odd));
    odd.format = OC_PIXEL_YUYV;
    odd.stride_bytes = 128;
    TEST_ASSERT_FALSE(oc_raw_image_is_valid(&odd));
    odd.width_px = 64;
    odd.chroma = NULL;
    TEST_ASSERT_TRUE(oc_raw_image_is_valid(&odd));
}

static void images_and_raw_pictures_share_their_pixels(void)
{
    static const uint8_t px[3 * 64 * 48];
    for (uint32_t channels = 1; channels <= 3; channels += 2) {
        const oc_image_t image = {px, 64, 48, 64 * channels, channels};
        const oc_raw_image_t raw = oc_raw_from_image(&image);
        const oc_image_t back = oc_image_from_raw(&raw);
        TEST_ASSERT_TRUE(oc_raw_image_is_valid(&raw));
        TEST_ASSERT_EQUAL_PTR(px, back.px);
        TEST_ASSERT_EQUAL(channels, back.channels);
        TEST_ASSERT_EQUAL(64 * channels, back.stride_bytes);
    }
    const oc_raw_image_t yuyv = {OC_PIXEL_YUYV, 64, 48, 128, px, NULL};
    TEST_ASSERT_NULL(oc_image_from_raw(&yuyv).px);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(names_lead_back_to_their_formats);
    RUN_TEST(rows_and_frames_have_the_bytes_of_the_v4l2_documents);
    RUN_TEST(only_whole_pictures_are_valid);
    RUN_TEST(images_and_raw_pictures_share_their_pixels);
    return UNITY_END();
}
