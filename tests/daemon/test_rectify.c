/* SPDX-License-Identifier: BSD-3-Clause
 * Rectification against closed forms: smooth pictures sampled where the lens says, in every pixel format. */
#include "unity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "rectify.h"

#define MAX_WIDTH 163u
#define MAX_HEIGHT 121u
#define PADDING 10u /* bytes behind each row that must never show */

/* Exactly as large as the picture, so that the address sanitizer sees any step beyond it. */
static uint8_t *raw_px, *raw_chroma;
static oc_rectify_t *rectify;

static const oc_pixel_format_t formats[] = {OC_PIXEL_GREY, OC_PIXEL_RGB, OC_PIXEL_YUYV, OC_PIXEL_UYVY, OC_PIXEL_NV12};
#define N_FORMATS 5

static oc_intrinsics_t camera_of(uint32_t width_px, uint32_t height_px)
{
    return (oc_intrinsics_t){.width_px = width_px,
                             .height_px = height_px,
                             .fx_px = 140,
                             .fy_px = 138,
                             .cx_px = width_px * 0.51,
                             .cy_px = height_px * 0.48};
}

void setUp(void)
{
    rectify = oc_rectify_create(MAX_WIDTH, MAX_HEIGHT);
    TEST_ASSERT_NOT_NULL(rectify);
}

static void release(void)
{
    free(raw_px);
    free(raw_chroma);
    raw_px = raw_chroma = NULL;
}

void tearDown(void)
{
    oc_rectify_destroy(rectify);
    release();
}

/* ---- pictures ---- */

/* Slow waves, so that bilinear interpolation is within a level of the truth. Channels of a YUV picture
 * are Y, U, V within a range that makes no colour out of gamut by more than a clamp sees. */
static double wave(double x, double y, int channel)
{
    return 128 + 60 * sin(x * 0.06 + channel) + 50 * cos(y * 0.05 + 0.02 * x);
}

static double wave_yuv(double x, double y, int channel)
{
    if (channel == 0) return 126 + 50 * sin(x * 0.06) + 40 * cos(y * 0.05 + 0.02 * x);
    return 128 + 12 * sin(x * 0.03 + channel) + 12 * cos(y * 0.025 + channel);
}

static uint8_t clamp_level(double v)
{
    return (uint8_t)lround(fmin(fmax(v, 0), 255));
}

/* A picture without pixels of its own until filled; stride with padding of 0xee. */
static oc_raw_image_t make_raw(oc_pixel_format_t format, uint32_t width_px, uint32_t height_px)
{
    release();
    const uint32_t stride = oc_pixel_format_row_bytes(format, width_px) + PADDING, n_uv_rows = (height_px + 1) / 2;
    const size_t cut = PADDING; /* the last row has no padding */
    raw_px = malloc((size_t)stride * height_px - cut);
    raw_chroma = malloc((size_t)stride * n_uv_rows - cut);
    TEST_ASSERT_TRUE(raw_px && raw_chroma);
    memset(raw_px, 0xee, (size_t)stride * height_px - cut);
    memset(raw_chroma, 0xee, (size_t)stride * n_uv_rows - cut);
    return (oc_raw_image_t){format, width_px, height_px, stride, raw_px, format == OC_PIXEL_NV12 ? raw_chroma : NULL};
}

static uint8_t *sample_at(const oc_raw_image_t *raw, uint32_t x, uint32_t y, int channel)
{
    uint8_t *row = raw_px + (size_t)y * raw->stride_bytes;
    uint8_t *chroma = raw_chroma + (size_t)(y / 2) * raw->stride_bytes;
    switch (raw->format) {
    case OC_PIXEL_GREY: return row + x;
    case OC_PIXEL_RGB: return row + 3 * x + channel;
    case OC_PIXEL_YUYV: return channel == 0 ? row + 2 * x : row + 4 * (x / 2) + (channel == 1 ? 1 : 3);
    case OC_PIXEL_UYVY: return channel == 0 ? row + 2 * x + 1 : row + 4 * (x / 2) + (channel == 1 ? 0 : 2);
    case OC_PIXEL_NV12: return channel == 0 ? row + x : chroma + 2 * (x / 2) + (channel - 1);
    case OC_PIXEL_MJPG: break;
    }
    TEST_FAIL();
    return NULL;
}

static bool is_yuv(oc_pixel_format_t format)
{
    return format != OC_PIXEL_GREY && format != OC_PIXEL_RGB;
}

/* Chroma where its samples are: in the middle of the pixels they serve. */
static void fill_with_waves(const oc_raw_image_t *raw)
{
    const bool is_planar = raw->format == OC_PIXEL_NV12;
    for (uint32_t y = 0; y < raw->height_px; y++) {
        for (uint32_t x = 0; x < raw->width_px; x++) {
            if (!is_yuv(raw->format)) {
                for (int c = 0; c < (raw->format == OC_PIXEL_RGB ? 3 : 1); c++)
                    *sample_at(raw, x, y, c) = clamp_level(wave(x, y, c));
                continue;
            }
            *sample_at(raw, x, y, 0) = clamp_level(wave_yuv(x, y, 0));
            for (int c = 1; c < 3; c++)
                *sample_at(raw, x, y, c) = clamp_level(wave_yuv((x & ~1u) + 0.5, is_planar ? (y & ~1u) + 0.5 : y, c));
        }
    }
}

/* The formula of BT.601 with real numbers. */
static void rgb_of(double y, double u, double v, double rgb[3])
{
    const double kr = 0.299, kb = 0.114, kg = 1 - kr - kb;
    const double luma = (y - 16) * 255 / 219, pb = (u - 128) * 255 / 224, pr = (v - 128) * 255 / 224;
    rgb[0] = luma + 2 * (1 - kr) * pr;
    rgb[1] = luma - 2 * (1 - kb) * kb / kg * pb - 2 * (1 - kr) * kr / kg * pr;
    rgb[2] = luma + 2 * (1 - kb) * pb;
    for (int c = 0; c < 3; c++) rgb[c] = fmin(fmax(rgb[c], 0), 255);
}

static void expected_at(oc_pixel_format_t format, double x, double y, double rgb[3])
{
    if (is_yuv(format)) {
        rgb_of(wave_yuv(x, y, 0), wave_yuv(x, y, 1), wave_yuv(x, y, 2), rgb);
        return;
    }
    for (int c = 0; c < 3; c++) rgb[c] = wave(x, y, c);
}

/* ---- through lenses ---- */

/* Every pixel against the closed form; returns how many are black. In the outermost pixel chroma has
 * nothing to interpolate with, which the slow waves forgive. */
static int check_lens(oc_pixel_format_t format, const oc_lens_t *lens)
{
    const oc_raw_image_t raw = make_raw(format, lens->raw.width_px, lens->raw.height_px);
    fill_with_waves(&raw);
    const oc_image_t flat = oc_rectify_apply(rectify, &raw, lens);
    TEST_ASSERT_TRUE(oc_image_is_valid(&flat));
    TEST_ASSERT_EQUAL(lens->rectified.width_px, flat.width_px);
    TEST_ASSERT_EQUAL(lens->rectified.height_px, flat.height_px);
    TEST_ASSERT_EQUAL(oc_pixel_format_channels(format), flat.channels);
    const double reach = oc_lens_reach(lens), tolerance = is_yuv(format) ? 2.6 : 1.6;
    int n_outside = 0;
    for (uint32_t y = 0; y < flat.height_px; y++) {
        for (uint32_t x = 0; x < flat.width_px; x++) {
            double raw_x, raw_y, rgb[3] = {0, 0, 0};
            const bool is_seen = oc_lens_find(lens, reach, x, y, &raw_x, &raw_y);
            if (is_seen) expected_at(format, raw_x, raw_y, rgb);
            n_outside += !is_seen;
            const uint8_t *px = flat.px + (size_t)y * flat.stride_bytes + x * flat.channels;
            for (uint32_t c = 0; c < flat.channels; c++)
                TEST_ASSERT_DOUBLE_WITHIN(is_seen ? tolerance : 0.0, rgb[c], px[c]);
        }
    }
    TEST_ASSERT_TRUE(n_outside < (int)(flat.width_px * flat.height_px) / 2);
    return n_outside;
}

static void pixels_come_from_where_the_lens_put_them(void)
{
    const oc_intrinsics_t k = camera_of(160, 120);
    const oc_distortion_t barrel = {{-0.25, 0.08, 0.001, -0.002, 0.01}}, cushion = {{0.2, 0.05, -0.003, 0.001, 0}};
    const oc_lens_t lenses[] = {oc_lens_plumb_bob(&k, &barrel),
                                oc_lens_plumb_bob(&k, &cushion),
                                {OC_LENS_FISHEYE, {-0.05, 0.01, 0.002, -0.001}, k, k}};
    for (int i = 0; i < N_FORMATS; i++) {
        (void)check_lens(formats[i], &lenses[0]);
        TEST_ASSERT_TRUE(check_lens(formats[i], &lenses[1]) > 0);
        (void)check_lens(formats[i], &lenses[2]);
        (void)check_lens(formats[i], &lenses[0]); /* the table is made anew when the lens changes */
    }
}

static void any_sides_will_do(void)
{
    static const uint32_t sides[][2] = {{32, 32}, {64, 33}, {66, 47}, {33, 64}, {161, 121}, {163, 119}, {127, 32}};
    const oc_distortion_t bent = {{-0.1, 0.02, 0.001, 0.001, 0}};
    for (unsigned s = 0; s < sizeof sides / sizeof *sides; s++) {
        for (int i = 0; i < N_FORMATS; i++) {
            if (oc_pixel_format_row_bytes(formats[i], sides[s][0]) == 0) continue;
            const oc_intrinsics_t k = camera_of(sides[s][0], sides[s][1]);
            oc_lens_t lens = oc_lens_plumb_bob(&k, &bent);
            (void)check_lens(formats[i], &lens);
            lens.rectified = camera_of(97, 55); /* smaller or larger than raw */
            lens.rectified.fx_px = 160.0 * 97 / sides[s][0];
            lens.rectified.fy_px = 160.0 * 55 / sides[s][1];
            (void)check_lens(formats[i], &lens);
        }
    }
}

/* Ramps of whole levels are interpolated exactly: channel 0 downwards, 1 to the right by the level of a
 * chroma sample, 2 downwards by that. */
static double ramp(oc_pixel_format_t format, double x, double y, int channel)
{
    const bool is_planar = format == OC_PIXEL_NV12;
    if (channel == 0) return 80 + y;
    if (channel == 1) return is_yuv(format) ? 80 + 2 * fmin(fmax((x - 0.5) / 2, 0), 48) : 80 + x;
    return 90 + (is_planar ? 2 * fmin(fmax((y - 0.5) / 2, 0), 40) : y);
}

static void fill_with_ramps(const oc_raw_image_t *raw)
{
    for (uint32_t p = 0; p < raw->width_px * raw->height_px; p++) {
        const uint32_t x = p % raw->width_px, y = p / raw->width_px;
        const bool is_halved = is_yuv(raw->format), is_planar = raw->format == OC_PIXEL_NV12;
        *sample_at(raw, x, y, 0) = (uint8_t)(80 + y);
        if (raw->format == OC_PIXEL_GREY) continue;
        *sample_at(raw, x, y, 1) = (uint8_t)(80 + (is_halved ? x & ~1u : x));
        *sample_at(raw, x, y, 2) = (uint8_t)(90 + (is_planar ? y & ~1u : y));
    }
}

/* So that half a pixel off is seen, in chroma too; beyond the outermost chroma samples those hold. */
static void check_ramps(const oc_raw_image_t *raw, const oc_lens_t *lens)
{
    const oc_image_t flat = oc_rectify_apply(rectify, raw, lens);
    const uint32_t width = flat.width_px;
    for (uint32_t p = 0; p < width * flat.height_px; p++) {
        double x, y, rgb[3] = {0, 0, 0};
        const bool is_seen = oc_lens_find(lens, oc_lens_reach(lens), p % width, p / width, &x, &y);
        for (int c = 0; c < 3 && is_seen; c++) rgb[c] = ramp(raw->format, x, y, c);
        if (is_seen && is_yuv(raw->format)) rgb_of(rgb[0], rgb[1], rgb[2], rgb);
        const double tolerance = is_yuv(raw->format) ? 0.65 : 0.51;
        for (uint32_t c = 0; c < flat.channels; c++)
            TEST_ASSERT_DOUBLE_WITHIN(is_seen ? tolerance : 0.0, rgb[c], flat.px[flat.channels * p + c]);
    }
}

static void samples_are_where_the_format_has_them(void)
{
    for (int i = 0; i < N_FORMATS; i++) {
        const uint32_t width = oc_pixel_format_row_bytes(formats[i], 97) == 0 ? 98 : 97;
        const oc_intrinsics_t k = camera_of(width, 81);
        oc_lens_t lens = oc_lens_pinhole(&k);
        const oc_raw_image_t raw = make_raw(formats[i], width, 81);
        fill_with_ramps(&raw);
        lens.rectified.fx_px *= 1.37;
        lens.rectified.fy_px *= 1.21;
        for (int shift = -1; shift <= 1; shift++) { /* over the borders as well */
            lens.rectified.cx_px = k.cx_px * 1.37 + shift * 50.3;
            lens.rectified.cy_px = k.cy_px * 1.21 + shift * 40.6;
            check_ramps(&raw, &lens);
        }
    }
}

/* Shifted by whole pixels: nothing is interpolated, and the outermost rows and columns are there. */
static void a_crop_is_the_part_that_it_shows(void)
{
    for (int i = 0; i < 2; i++) {
        const oc_raw_image_t raw = make_raw(formats[i], 161, 121);
        const uint32_t channels = oc_pixel_format_channels(formats[i]);
        for (uint32_t y = 0; y < 121; y++) {
            for (uint32_t x = 0; x < 161 * channels; x++) raw_px[y * raw.stride_bytes + x] = (uint8_t)rand();
        }
        /* Numbers that rounding leaves alone: the last centre is exactly that. */
        const oc_intrinsics_t k = {
            .width_px = 161, .height_px = 121, .fx_px = 128, .fy_px = 128, .cx_px = 80, .cy_px = 60};
        oc_lens_t lens = oc_lens_pinhole(&k);
        lens.rectified.width_px = 100;
        lens.rectified.height_px = 71;
        lens.rectified.cx_px -= 61;
        lens.rectified.cy_px -= 50;
        const oc_image_t flat = oc_rectify_apply(rectify, &raw, &lens);
        for (uint32_t y = 0; y < 71; y++)
            TEST_ASSERT_EQUAL_UINT8_ARRAY(raw_px + (y + 50) * raw.stride_bytes + 61 * channels,
                                          flat.px + y * flat.stride_bytes, 100 * channels);
    }
}

/* ---- without distortion ---- */

static void grey_and_rgb_without_distortion_are_not_copied(void)
{
    const oc_intrinsics_t k = camera_of(161, 120);
    const oc_lens_t lens = oc_lens_pinhole(&k);
    for (int i = 0; i < 2; i++) {
        const oc_raw_image_t raw = make_raw(formats[i], 161, 120);
        const oc_image_t flat = oc_rectify_apply(rectify, &raw, &lens);
        TEST_ASSERT_EQUAL_PTR(raw_px, flat.px);
        TEST_ASSERT_EQUAL(raw.stride_bytes, flat.stride_bytes);
        TEST_ASSERT_EQUAL(oc_pixel_format_channels(formats[i]), flat.channels);
    }
}

/* All values of chroma, odd sides, tails of blocks: the formula at every pixel, each chroma sample serving
 * its two or four pixels. */
static void yuv_without_distortion_is_the_formula(void)
{
    static const uint32_t sides[][2] = {{32, 32}, {160, 121}, {130, 64}, {62, 40}, {161, 121}};
    for (unsigned s = 0; s < sizeof sides / sizeof *sides; s++) {
        for (int i = 2; i < N_FORMATS; i++) {
            if (oc_pixel_format_row_bytes(formats[i], sides[s][0]) == 0) continue;
            const oc_raw_image_t raw = make_raw(formats[i], sides[s][0], sides[s][1]);
            const oc_intrinsics_t k = camera_of(sides[s][0], sides[s][1]);
            const oc_lens_t lens = oc_lens_pinhole(&k);
            for (uint32_t p = 0; p < sides[s][0] * sides[s][1]; p++) {
                for (int c = 0; c < 3; c++) *sample_at(&raw, p % sides[s][0], p / sides[s][0], c) = (uint8_t)rand();
            }
            const oc_image_t flat = oc_rectify_apply(rectify, &raw, &lens);
            TEST_ASSERT_TRUE(oc_image_is_valid(&flat));
            for (uint32_t p = 0; p < sides[s][0] * sides[s][1]; p++) {
                const uint32_t x = p % sides[s][0], y = p / sides[s][0];
                double rgb[3];
                rgb_of(*sample_at(&raw, x, y, 0), *sample_at(&raw, x, y, 1), *sample_at(&raw, x, y, 2), rgb);
                for (int c = 0; c < 3; c++)
                    TEST_ASSERT_DOUBLE_WITHIN(0.6, rgb[c], flat.px[y * flat.stride_bytes + 3 * x + (uint32_t)c]);
            }
        }
    }
}

/* All 16.7 million colours, through pictures of one colour in each pair; levels of full black and white are exact. */
static void every_colour_is_within_a_level_of_the_formula(void)
{
    const oc_raw_image_t raw = make_raw(OC_PIXEL_YUYV, 160, 112);
    const oc_intrinsics_t k = camera_of(160, 112);
    const oc_lens_t lens = oc_lens_pinhole(&k);
    const uint32_t pairs = 80 * 112;
    double worst = 0;
    for (uint32_t first = 0; first < 1u << 23; first += pairs) {
        for (uint32_t i = 0; i < pairs; i++) {
            const uint32_t code = first + i; /* V, U, upper half of Y with both values of its lowest bit */
            uint8_t *px = raw_px + (i / 80) * raw.stride_bytes + 4 * (i % 80);
            px[0] = (uint8_t)(code << 1);
            px[2] = (uint8_t)(px[0] + 1);
            px[1] = (uint8_t)(code >> 7);
            px[3] = (uint8_t)(code >> 15);
        }
        const oc_image_t flat = oc_rectify_apply(rectify, &raw, &lens);
        for (uint32_t i = 0; i < 2 * pairs; i++) {
            const uint8_t *px = raw_px + (i / 160) * raw.stride_bytes + 4 * (i % 160 / 2);
            double rgb[3];
            rgb_of(px[i % 2 * 2], px[1], px[3], rgb);
            for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(rgb[c] - flat.px[3 * i + (uint32_t)c]));
        }
    }
    TEST_ASSERT_TRUE(worst >= 0.5 && worst < 0.6);
}

static void black_and_white_are_exact(void)
{
    const oc_distortion_t bent = {{-0.1, 0, 0, 0, 0}}, none = {{0, 0, 0, 0, 0}};
    const oc_intrinsics_t k = camera_of(64, 48);
    for (int i = 2; i < N_FORMATS; i++) {
        for (int is_white = 0; is_white < 2; is_white++) {
            const oc_raw_image_t raw = make_raw(formats[i], 64, 48);
            for (uint32_t p = 0; p < 64 * 48; p++) {
                *sample_at(&raw, p % 64, p / 64, 0) = is_white ? 235 : 16;
                *sample_at(&raw, p % 64, p / 64, 1) = *sample_at(&raw, p % 64, p / 64, 2) = 128;
            }
            for (int is_bent = 0; is_bent < 2; is_bent++) {
                const oc_lens_t lens = oc_lens_plumb_bob(&k, is_bent ? &bent : &none);
                const oc_image_t flat = oc_rectify_apply(rectify, &raw, &lens);
                TEST_ASSERT_EACH_EQUAL_UINT8(is_white ? 255 : 0, flat.px, 3 * 64 * 48);
            }
        }
    }
}

/* ---- what goes wrong ---- */

/* The picture of a lens that turns back: white everywhere, and yet black beyond the fold. */
static void beyond_the_fold_all_is_black(void)
{
    const oc_intrinsics_t k = {
        .width_px = 160, .height_px = 120, .fx_px = 60, .fy_px = 60, .cx_px = 79.5, .cy_px = 59.5};
    const oc_lens_t lenses[] = {{OC_LENS_PLUMB_BOB, {-0.5, 0, 0, 0, 0}, k, k},    /* fold at sqrt(2/3) */
                                {OC_LENS_FISHEYE, {-1 / 1.2, 0, 0, 0, 0}, k, k}}; /* at tan(sqrt(0.4)) */
    const double folds[] = {sqrt(2.0 / 3) * 60, tan(sqrt(0.4)) * 60};
    for (int l = 0; l < 2; l++) {
        for (int i = 0; i < N_FORMATS; i++) {
            const oc_raw_image_t raw = make_raw(formats[i], 160, 120);
            for (uint32_t p = 0; p < 160 * 120; p++) {
                for (int c = 0; c < 3; c++)
                    *sample_at(&raw, p % 160, p / 160, c) = is_yuv(formats[i]) ? (c ? 128 : 235) : 255;
            }
            const oc_image_t flat = oc_rectify_apply(rectify, &raw, &lenses[l]);
            for (uint32_t p = 0; p < 160 * 120; p++) {
                const double r = hypot(p % 160 - 79.5, p / 160 - 59.5);
                TEST_ASSERT_EQUAL(r < folds[l] ? 255 : 0, flat.px[p * flat.channels]);
            }
        }
    }
}

static void a_wild_lens_gives_black_not_a_crash(void)
{
    static const double sizes[] = {1, 1e3, 1e6, 1e30, 1e99, 1e150, 1e300};
    const oc_intrinsics_t k = camera_of(160, 120);
    for (unsigned s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        for (int signs = 0; signs < 32; signs++) {
            oc_lens_t lens = {.model = signs % 2 ? OC_LENS_FISHEYE : OC_LENS_PLUMB_BOB, .raw = k, .rectified = k};
            for (int i = 0; i < 5; i++) lens.k[i] = signs >> i & 1 ? sizes[s] : -sizes[s];
            if (signs % 3 == 0) lens.rectified.fx_px = 1e-300;
            if (signs % 5 == 0) lens.raw.fy_px = 1e300;
            const oc_raw_image_t raw = make_raw(formats[signs % N_FORMATS], 160, 120);
            memset(raw_px, 0x80, (size_t)raw.stride_bytes * 119);
            const oc_image_t flat = oc_rectify_apply(rectify, &raw, &lens);
            TEST_ASSERT_NOT_NULL(flat.px);
            TEST_ASSERT_EQUAL_UINT8(0, flat.px[0]);
            TEST_ASSERT_EQUAL_UINT8(0, flat.px[(size_t)flat.stride_bytes * flat.height_px - 1u]);
        }
    }
}

static void expect_empty(const oc_raw_image_t *raw, const oc_lens_t *lens)
{
    const oc_image_t flat = oc_rectify_apply(rectify, raw, lens);
    TEST_ASSERT_NULL(flat.px);
    TEST_ASSERT_FALSE(oc_image_is_valid(&flat));
}

static void what_does_not_fit_gives_an_empty_picture(void)
{
    const oc_raw_image_t raw = make_raw(OC_PIXEL_NV12, 64, 48);
    const oc_intrinsics_t k = camera_of(64, 48);
    oc_lens_t lens = oc_lens_pinhole(&k);
    TEST_ASSERT_NOT_NULL(oc_rectify_apply(rectify, &raw, &lens).px);
    oc_raw_image_t other = raw;
    other.chroma = NULL;
    expect_empty(&other, &lens);
    other = raw;
    other.width_px = 63; /* a valid picture, but not this lens' */
    expect_empty(&other, &lens);
    other = raw;
    other.format = OC_PIXEL_MJPG;
    expect_empty(&other, &lens);
    lens.k[2] = (double)NAN;
    expect_empty(&raw, &lens);
    lens = oc_lens_pinhole(&k);
    lens.rectified.width_px = MAX_WIDTH + 1;
    lens.rectified.height_px = MAX_HEIGHT;
    expect_empty(&raw, &lens);
    lens.rectified.width_px = MAX_WIDTH;
    TEST_ASSERT_NOT_NULL(oc_rectify_apply(rectify, &raw, &lens).px);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(pixels_come_from_where_the_lens_put_them);
    RUN_TEST(any_sides_will_do);
    RUN_TEST(samples_are_where_the_format_has_them);
    RUN_TEST(a_crop_is_the_part_that_it_shows);
    RUN_TEST(grey_and_rgb_without_distortion_are_not_copied);
    RUN_TEST(yuv_without_distortion_is_the_formula);
    RUN_TEST(every_colour_is_within_a_level_of_the_formula);
    RUN_TEST(black_and_white_are_exact);
    RUN_TEST(beyond_the_fold_all_is_black);
    RUN_TEST(a_wild_lens_gives_black_not_a_crash);
    RUN_TEST(what_does_not_fit_gives_an_empty_picture);
    return UNITY_END();
}
