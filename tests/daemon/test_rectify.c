/* SPDX-License-Identifier: BSD-3-Clause
 * Rectification against the closed form: a smooth picture sampled where oc_distort says. */
#include "unity.h"

#include <math.h>
#include <string.h>

#include "rectify.h"

#define WIDTH 160u
#define HEIGHT 120u

static uint8_t raw_px[3u * WIDTH * HEIGHT];
static const oc_image_t raw = {raw_px, WIDTH, HEIGHT, 3u * WIDTH, 3};
static oc_intrinsics_t k;
static oc_rectify_t *rectify;

/* Slow waves, so that bilinear interpolation is within a grey level of the truth. */
static double wave(double x, double y, int channel)
{
    return 128 + 60 * sin(x * 0.06 + channel) + 50 * cos(y * 0.05 + 0.02 * x);
}

static oc_image_t apply_plumb_bob(const oc_distortion_t *distortion)
{
    const oc_raw_image_t pixels = oc_raw_from_image(&raw);
    const oc_lens_t lens = oc_lens_plumb_bob(&k, distortion);
    return oc_rectify_apply(rectify, &pixels, &lens);
}

void setUp(void)
{
    k = (oc_intrinsics_t){.width_px = WIDTH, .height_px = HEIGHT, .fx_px = 140, .fy_px = 138, .cx_px = 82, .cy_px = 57};
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            for (int c = 0; c < 3; c++) raw_px[3u * (y * WIDTH + x) + (uint32_t)c] = (uint8_t)lround(wave(x, y, c));
        }
    }
    rectify = oc_rectify_create(WIDTH, HEIGHT);
    TEST_ASSERT_NOT_NULL(rectify);
}

void tearDown(void)
{
    oc_rectify_destroy(rectify);
}

/* Returns how many pixels the raw picture does not show. */
static int check_against_closed_form(const oc_distortion_t *distortion)
{
    const oc_image_t flat = apply_plumb_bob(distortion);
    TEST_ASSERT_EQUAL(WIDTH, flat.width_px);
    TEST_ASSERT_EQUAL(HEIGHT, flat.height_px);
    int n_inside = 0, n_outside = 0;
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            double raw_x, raw_y;
            oc_distort(&k, distortion, x, y, &raw_x, &raw_y);
            const bool is_inside = raw_x >= 0 && raw_y >= 0 && raw_x < WIDTH - 1.0 && raw_y < HEIGHT - 1.0;
            n_inside += is_inside;
            n_outside += !is_inside;
            for (int c = 0; c < 3; c++) {
                const double expected = is_inside ? wave(raw_x, raw_y, c) : 0;
                TEST_ASSERT_DOUBLE_WITHIN(is_inside ? 1.6 : 0.0, expected, flat.px[3u * (y * WIDTH + x) + (uint32_t)c]);
            }
        }
    }
    TEST_ASSERT_TRUE(n_inside > (int)(WIDTH * HEIGHT) / 2);
    return n_outside;
}

static void pixels_come_from_where_the_lens_put_them(void)
{
    const oc_distortion_t barrel = {{-0.25, 0.08, 0.001, -0.002, 0.01}};
    const oc_distortion_t cushion = {{0.2, 0.05, -0.003, 0.001, 0}};
    (void)check_against_closed_form(&barrel);
    TEST_ASSERT_TRUE(check_against_closed_form(&cushion) > 0);
    (void)check_against_closed_form(&barrel); /* the table is made anew when the lens changes */
}

static void no_distortion_changes_nothing(void)
{
    const oc_distortion_t none = {{0, 0, 0, 0, 0}};
    const oc_image_t flat = apply_plumb_bob(&none);
    for (uint32_t y = 0; y + 1 < HEIGHT; y++)
        TEST_ASSERT_EQUAL_UINT8_ARRAY(raw_px + 3u * y * WIDTH, flat.px + 3u * y * WIDTH, 3u * (WIDTH - 1u));
}

static void a_wild_lens_gives_black_not_a_crash(void)
{
    const oc_distortion_t wild = {{1e6, -1e6, 1e6, 1e6, 1e6}};
    const oc_image_t flat = apply_plumb_bob(&wild);
    TEST_ASSERT_EQUAL_UINT8(0, flat.px[0]);
    TEST_ASSERT_EQUAL_UINT8(0, flat.px[3u * WIDTH * HEIGHT - 1u]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(pixels_come_from_where_the_lens_put_them);
    RUN_TEST(no_distortion_changes_nothing);
    RUN_TEST(a_wild_lens_gives_black_not_a_crash);
    return UNITY_END();
}
