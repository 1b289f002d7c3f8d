/* SPDX-License-Identifier: BSD-3-Clause
 * Encoding within a bound: never over it, and the best quality that fits. */
#include "unity.h"

#include <stdlib.h>
#include <string.h>

#include "pixel_codec.h"

#define SIDE 96u

static uint8_t px[3u * SIDE * SIDE];
static const oc_image_t image = {px, SIDE, SIDE, 3u * SIDE, 3};
static uint8_t out[65536];

void setUp(void)
{
    srand(7);
    for (uint32_t y = 0; y < SIDE; y++) {
        for (uint32_t x = 0; x < SIDE; x++) {
            for (uint32_t c = 0; c < 3; c++)
                px[3u * (y * SIDE + x) + c] = (uint8_t)((x / 8 + y / 8) % 2 * 120 + c * 20 + (unsigned)rand() % 40);
        }
    }
    memset(out, 0xa5, sizeof out);
}

void tearDown(void) {}

static size_t size_at(int quality)
{
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    TEST_ASSERT_TRUE(oc_pixel_encode(&image, OC_CODEC_WEBP, quality, &bytes, &n_bytes));
    oc_pixel_free(OC_CODEC_WEBP, bytes);
    return n_bytes;
}

static void both_codecs_make_their_own_format(void)
{
    uint8_t *bytes = NULL;
    size_t n_bytes = 0;
    TEST_ASSERT_TRUE(oc_pixel_encode(&image, OC_CODEC_WEBP, 50, &bytes, &n_bytes));
    TEST_ASSERT_EQUAL_MEMORY("RIFF", bytes, 4);
    oc_pixel_free(OC_CODEC_WEBP, bytes);
    TEST_ASSERT_TRUE(oc_pixel_encode(&image, OC_CODEC_JPEG, 50, &bytes, &n_bytes));
    TEST_ASSERT_EQUAL_HEX8(0xff, bytes[0]);
    TEST_ASSERT_EQUAL_HEX8(0xd8, bytes[1]);
    oc_pixel_free(OC_CODEC_JPEG, bytes);
    TEST_ASSERT_FALSE(oc_pixel_encode(&image, OC_CODEC_AVIF, 50, &bytes, &n_bytes));
}

static void stays_within_the_bound_and_wastes_no_quality(void)
{
    const size_t smallest = size_at(0), largest = size_at(60);
    TEST_ASSERT_TRUE(smallest < largest);
    size_t before = 0;
    for (size_t cap = smallest; cap < largest + 200; cap += 1 + (largest - smallest) / 40) {
        size_t n_bytes = 0;
        TEST_ASSERT_TRUE(oc_pixel_encode_within(&image, 60, out, cap, &n_bytes));
        TEST_ASSERT_TRUE(n_bytes <= cap);
        TEST_ASSERT_TRUE(n_bytes >= before); /* more room, never fewer bytes */
        TEST_ASSERT_EACH_EQUAL_UINT8(0xa5, out + cap, 64);
        before = n_bytes;
    }
    TEST_ASSERT_EQUAL(largest, before); /* with room enough the quality that was asked for */
}

static void is_as_good_as_trying_every_quality(void)
{
    const size_t cap = (size_at(0) + size_at(60)) / 2;
    size_t best = 0, n_bytes = 0;
    for (int quality = 0; quality <= 60; quality++) {
        const size_t size = size_at(quality);
        if (size <= cap && size > best) best = size;
    }
    TEST_ASSERT_TRUE(oc_pixel_encode_within(&image, 60, out, cap, &n_bytes));
    TEST_ASSERT_EQUAL(best, n_bytes);
}

static void says_so_when_nothing_fits(void)
{
    size_t n_bytes = 77;
    TEST_ASSERT_FALSE(oc_pixel_encode_within(&image, 60, out, size_at(0) - 1, &n_bytes));
    TEST_ASSERT_EQUAL(77, n_bytes);
    TEST_ASSERT_EACH_EQUAL_UINT8(0xa5, out, sizeof out);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(both_codecs_make_their_own_format);
    RUN_TEST(stays_within_the_bound_and_wastes_no_quality);
    RUN_TEST(is_as_good_as_trying_every_quality);
    RUN_TEST(says_so_when_nothing_fits);
    return UNITY_END();
}
