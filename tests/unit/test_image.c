/* SPDX-License-Identifier: BSD-3-Clause
 * Image views, sampling, luminance and status texts.
 */
#include "unity.h"

#include <math.h>
#include <string.h>

#include "core/image.h"

#define SIDE 32u

static uint8_t pixels[SIDE * (SIDE * 3u + 5u)];

static oc_image_t image_of(uint32_t channels)
{
    const oc_image_t image = {pixels, SIDE, SIDE, SIDE * channels + 5u, channels};
    return image;
}

void setUp(void)
{
    for (size_t i = 0; i < sizeof pixels; i++) pixels[i] = (uint8_t)(i * 37u + i / 7u);
}

void tearDown(void) {}

static void views_of_wrong_shape_are_refused(void)
{
    const oc_image_t good = image_of(1);
    TEST_ASSERT_TRUE(oc_image_is_valid(&good));
    oc_image_t bad = good;
    bad.px = NULL;
    TEST_ASSERT_FALSE(oc_image_is_valid(&bad));
    const uint32_t sides[] = {0, 31, 4097, UINT32_MAX};
    for (int i = 0; i < 4; i++) {
        bad = good;
        bad.width_px = sides[i];
        bad.stride_bytes = UINT32_MAX;
        TEST_ASSERT_FALSE(oc_image_is_valid(&bad));
        bad = good;
        bad.height_px = sides[i];
        TEST_ASSERT_FALSE(oc_image_is_valid(&bad));
    }
    const uint32_t channels[] = {0, 2, 4};
    for (int i = 0; i < 3; i++) {
        bad = good;
        bad.channels = channels[i];
        bad.stride_bytes = 1000;
        TEST_ASSERT_FALSE(oc_image_is_valid(&bad));
    }
    bad = image_of(3);
    bad.stride_bytes = SIDE * 3u - 1u;
    TEST_ASSERT_FALSE(oc_image_is_valid(&bad));
    bad.stride_bytes = SIDE * 3u;
    TEST_ASSERT_TRUE(oc_image_is_valid(&bad));
}

/* The weights of floor and ceil, as thesis Eq 4.23-4.25 has them, are both 0 at an integer. */
static void samples_at_integers_are_the_pixels(void)
{
    const oc_image_t image = image_of(1);
    for (uint32_t y = 0; y + 1 < SIDE; y++) {
        for (uint32_t x = 0; x + 1 < SIDE; x++) {
            const uint8_t pixel = pixels[y * image.stride_bytes + x];
            TEST_ASSERT_EQUAL_FLOAT((float)pixel, oc_image_sample(&image, (float)x, (float)y));
        }
    }
}

static void samples_between_pixels_are_bilinear(void)
{
    const oc_image_t image = image_of(1);
    const float steps[] = {0.125f, 0.5f, 0.75f};
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            const float a = steps[i], b = steps[k];
            const uint8_t *p = pixels + 9 * image.stride_bytes + 17, *q = p + image.stride_bytes;
            const float expected = (1 - a) * (1 - b) * (float)p[0] + a * (1 - b) * (float)p[1] +
                                   (1 - a) * b * (float)q[0] + a * b * (float)q[1];
            TEST_ASSERT_FLOAT_WITHIN(1e-3f, expected, oc_image_sample(&image, 17.0f + a, 9.0f + b));
        }
    }
}

static void samples_outside_are_negative(void)
{
    const oc_image_t image = image_of(1);
    const float last = (float)(SIDE - 1);
    const float bad[] = {-1e-3f, last, last + 0.5f, 1e30f, -1e30f, (float)NAN, (float)INFINITY};
    for (int i = 0; i < 7; i++) {
        TEST_ASSERT_TRUE(oc_image_sample(&image, bad[i], 3.0f) < 0.0f);
        TEST_ASSERT_TRUE(oc_image_sample(&image, 3.0f, bad[i]) < 0.0f);
    }
    TEST_ASSERT_TRUE(oc_image_sample(&image, nextafterf(last, 0.0f), 0.0f) >= 0.0f);
}

static void luminance_has_the_stated_weights(void)
{
    static uint8_t grey_px[SIDE * 40u];
    oc_image_mut_t grey = {grey_px, SIDE, SIDE, 40, 1};
    const oc_image_t image = image_of(3);
    memset(grey_px, 0xEE, sizeof grey_px);
    memset(pixels, 255, 3);
    TEST_ASSERT_EQUAL(OC_OK, oc_image_to_grey(&image, &grey));
    TEST_ASSERT_EQUAL_UINT8(255, grey_px[0]);
    for (uint32_t y = 0; y < SIDE; y++) {
        for (uint32_t x = 0; x < SIDE; x++) {
            const uint8_t *p = pixels + y * image.stride_bytes + 3 * x;
            TEST_ASSERT_EQUAL_UINT8((77 * p[0] + 150 * p[1] + 29 * p[2] + 128) / 256, grey_px[y * 40 + x]);
        }
        /* What lies between the rows is not ours to write. */
        for (uint32_t x = SIDE; x < 40; x++) TEST_ASSERT_EQUAL_UINT8(0xEE, grey_px[y * 40 + x]);
    }
}

static void luminance_of_a_grey_image_is_a_copy(void)
{
    static uint8_t grey_px[SIDE * SIDE];
    oc_image_mut_t grey = {grey_px, SIDE, SIDE, SIDE, 1};
    const oc_image_t image = image_of(1);
    TEST_ASSERT_EQUAL(OC_OK, oc_image_to_grey(&image, &grey));
    for (uint32_t y = 0; y < SIDE; y++) {
        TEST_ASSERT_EQUAL_UINT8_ARRAY(pixels + y * image.stride_bytes, grey_px + y * SIDE, SIDE);
    }
}

static void luminance_refuses_other_shapes_and_writes_nothing(void)
{
    static uint8_t grey_px[SIDE * SIDE * 3u];
    const oc_image_mut_t good = {grey_px, SIDE, SIDE, SIDE, 1};
    const oc_image_t image = image_of(3);
    oc_image_mut_t bad[5] = {good, good, good, good, good};
    bad[0].channels = 3;
    bad[0].stride_bytes = 3 * SIDE;
    bad[1].width_px = SIDE + 1;
    bad[2].height_px = SIDE + 1;
    bad[3].stride_bytes = SIDE - 1;
    bad[4].px = NULL;
    memset(grey_px, 0x55, sizeof grey_px);
    for (int i = 0; i < 5; i++) TEST_ASSERT_EQUAL(OC_E_ARG, oc_image_to_grey(&image, &bad[i]));
    oc_image_t broken = image;
    broken.channels = 2;
    oc_image_mut_t grey = good;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_image_to_grey(&broken, &grey));
    TEST_ASSERT_EACH_EQUAL_UINT8(0x55, grey_px, sizeof grey_px);
}

static void every_status_has_its_own_text(void)
{
    for (int a = OC_E_STATE; a <= OC_OK; a++) {
        TEST_ASSERT_NOT_NULL(oc_status_text((oc_status_t)a));
        for (int b = OC_E_STATE; b < a; b++) {
            TEST_ASSERT_TRUE(strcmp(oc_status_text((oc_status_t)a), oc_status_text((oc_status_t)b)) != 0);
        }
    }
    TEST_ASSERT_EQUAL_STRING("unknown status", oc_status_text((oc_status_t)-99));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(views_of_wrong_shape_are_refused);
    RUN_TEST(samples_at_integers_are_the_pixels);
    RUN_TEST(samples_between_pixels_are_bilinear);
    RUN_TEST(samples_outside_are_negative);
    RUN_TEST(luminance_has_the_stated_weights);
    RUN_TEST(luminance_of_a_grey_image_is_a_copy);
    RUN_TEST(luminance_refuses_other_shapes_and_writes_nothing);
    RUN_TEST(every_status_has_its_own_text);
    return UNITY_END();
}
