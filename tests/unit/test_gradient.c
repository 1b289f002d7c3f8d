/* SPDX-License-Identifier: BSD-3-Clause
 * The gradient against ramps, a direct convolution and its own mirror images; the edge maps against their definition. */
#include "unity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "edge_scene.h"
#include "vehicle/gradient.h"

#define W 67
#define H 45
#define SEED 20040519u

static oc_gradient_t gradient;
static void *memory;
static oc_simd_t level;
static uint8_t px[H * W];

static void make(uint32_t width, uint32_t height, float sigma)
{
    const size_t bytes = oc_gradient_size_bytes(width, height) + OC_ARENA_ALIGN;
    memory = malloc(bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, memory, bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_gradient_init(&gradient, &arena, width, height, sigma, level));
}

static const float kThreshold = 8.0f;

/* The planes of the last image as tests want them. */
static int16_t dx[H * W], dy[H * W];

static int magnitude(int i)
{
    const double m = hypot((double)dx[i], (double)dy[i]);
    return m < INT16_MAX ? (int)(m + 0.5) : INT16_MAX;
}

static bool map_has(const uint64_t *map, int x, int y)
{
    return map[oc_bitmap_at(gradient.pitch, (uint32_t)x / 64u, (uint32_t)y)] >> (x % 64) & 1u;
}

static void compute(const uint8_t *pixels, uint32_t stride)
{
    const oc_image_t image = {pixels, W, H, stride, 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_gradient_compute(&gradient, &image, kThreshold));
    for (int i = 0; i < W * H; i++) {
        dx[i] = gradient.dxdy[2 * i];
        dy[i] = gradient.dxdy[2 * i + 1];
    }
}

static void fill_random(void)
{
    edge_random_t random = {SEED};
    for (int i = 0; i < W * H; i++) px[i] = (uint8_t)edge_uniform(&random, 0, 255.999);
}

void setUp(void)
{
    memory = NULL;
}

void tearDown(void)
{
    free(memory);
}

static void a_ramp_reads_its_slope_in_the_stated_unit(void)
{
    make(W, H, 1.2f);
    for (int y = 0; y < H; y++) {
        for (int x = 0; x < W; x++) px[y * W + x] = (uint8_t)(20 + 2 * x + y);
    }
    compute(px, W);
    for (int y = 10; y < H - 10; y++) {
        for (int x = 10; x < W - 10; x++) {
            const int i = y * W + x;
            TEST_ASSERT_INT_WITHIN(4, 2 * OC_GRADIENT_ONE, dx[i]);
            TEST_ASSERT_INT_WITHIN(4, OC_GRADIENT_ONE, dy[i]);
            TEST_ASSERT_INT_WITHIN(5, (int)(sqrt(5.0) * OC_GRADIENT_ONE), magnitude(i));
        }
    }
}

static void flat_images_have_no_gradient_even_at_the_border(void)
{
    make(W, H, 1.5f);
    for (int grey = 0; grey < 256; grey += 51) {
        memset(px, grey, sizeof px);
        compute(px, W);
        for (int i = 0; i < W * H; i++) TEST_ASSERT_EQUAL_INT(0, magnitude(i));
        TEST_ASSERT_EQUAL_UINT32(0, gradient.n_thin);
    }
}

static void it_agrees_with_a_direct_gaussian_derivative(void)
{
    const float sigmas[] = {0.6f, 1.0f, 1.2f, 2.0f, 3.0f};
    fill_random();
    for (int s = 0; s < 5; s++) {
        make(W, H, sigmas[s]);
        compute(px, W);
        double sum = 0, squares = 0;
        for (int y = 12; y < H - 12; y++) {
            for (int x = 12; x < W - 12; x++) {
                double g = 0, norm = 0;
                for (int v = -10; v <= 10; v++) {
                    for (int u = -10; u <= 10; u++) {
                        const double e = exp(-0.5 * (u * u + v * v) / (double)(sigmas[s] * sigmas[s]));
                        g += e * 0.5 * (px[(y + v) * W + x + u + 1] - px[(y + v) * W + x + u - 1]);
                        norm += e;
                    }
                }
                const double error = dx[y * W + x] / (double)OC_GRADIENT_ONE - g / norm;
                sum += error * error;
                squares += g / norm * (g / norm);
            }
        }
        /* Kernel weights are multiples of 1/256, which tells on wide kernels. */
        const double tolerance = sigmas[s] < 1.9f ? 0.02 : 0.06;
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(tolerance, 0.0, sqrt(sum / squares), "seed 20040519");
        free(memory);
        memory = NULL;
    }
}

static void full_contrast_does_not_overflow(void)
{
    make(W, H, 0.6f);
    for (int i = 0; i < W * H; i++) px[i] = i % W < W / 2 ? 0 : 255;
    compute(px, W);
    const int row = (H / 2) * W;
    int largest = 0;
    for (int x = 0; x < W; x++) {
        TEST_ASSERT_TRUE(dx[row + x] >= 0);
        TEST_ASSERT_EQUAL_INT(0, dy[row + x]);
        if (dx[row + x] > largest) largest = dx[row + x];
    }
    TEST_ASSERT_TRUE(largest > 80 * OC_GRADIENT_ONE && largest <= 128 * OC_GRADIENT_ONE);
}

static void mirroring_the_image_mirrors_the_gradient_exactly(void)
{
    static uint8_t mirrored[H * W];
    static int16_t dx0[H * W], dy0[H * W];
    make(W, H, 1.2f);
    fill_random();
    compute(px, W);
    memcpy(dx0, dx, sizeof dx);
    memcpy(dy0, dy, sizeof dy);
    for (int y = 0; y < H; y++) {
        for (int x = 0; x < W; x++) mirrored[y * W + x] = px[y * W + W - 1 - x];
    }
    compute(mirrored, W);
    for (int y = 0; y < H; y++) {
        for (int x = 0; x < W; x++) {
            TEST_ASSERT_EQUAL_INT16(-dx0[y * W + W - 1 - x], dx[y * W + x]);
            TEST_ASSERT_EQUAL_INT16(dy0[y * W + W - 1 - x], dy[y * W + x]);
        }
    }
}

static void the_stride_does_not_matter(void)
{
    static uint8_t wide[H * (W + 13)];
    static int16_t dx0[H * W];
    make(W, H, 1.2f);
    fill_random();
    compute(px, W);
    memcpy(dx0, dx, sizeof dx);
    memset(wide, 0x5A, sizeof wide);
    for (int y = 0; y < H; y++) memcpy(wide + y * (W + 13), px + y * W, W);
    compute(wide, W + 13);
    TEST_ASSERT_EQUAL_INT16_ARRAY(dx0, dx, H * W);
}

static void thin_pixels_are_ridge_tops_of_thick_ones(void)
{
    make(W, H, 1.2f);
    fill_random();
    compute(px, W);
    uint32_t n = 0, n_thick = 0;
    for (int y = 0; y < H; y++) {
        for (int x = 0; x < W; x++) {
            const int i = y * W + x;
            const bool inside = x >= 2 && y >= 2 && x < W - 2 && y < H - 2;
            const bool thick = inside && magnitude(i) >= 8 * OC_GRADIENT_ONE;
            TEST_ASSERT_EQUAL(thick, map_has(gradient.thick, x, y));
            n_thick += thick;
            if (!map_has(gradient.thin, x, y)) continue;
            n++;
            const double a = atan2(dy[i], dx[i]);
            /* The border between neighbours is rounded: 32 units of a derivative. */
            if (fabs(fabs(sin(a)) - 0.38268) < 0.02 || fabs(fabs(cos(a)) - 0.38268) < 0.02) continue;
            const int step = (int)lrint(sin(a) * 1.3065) * W + (int)lrint(cos(a) * 1.3065);
            TEST_ASSERT_TRUE(thick);
            TEST_ASSERT_TRUE(magnitude(i) >= magnitude(i + step));
            TEST_ASSERT_TRUE(magnitude(i) >= magnitude(i - step));
        }
    }
    TEST_ASSERT_EQUAL_UINT32(n, gradient.n_thin);
    TEST_ASSERT_TRUE(n > 50 && n < n_thick * 2 / 3);
    const oc_image_t image = {px, W, H, W, 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_gradient_compute(&gradient, &image, 1e9f));
    TEST_ASSERT_EQUAL_UINT32(0, gradient.n_thin);
}

static void noise_is_measured_within_a_tenth(void)
{
    edge_random_t random = {SEED};
    static uint8_t noisy[256 * 256];
    make(256, 256, 1.5f);
    memset(noisy, 128, sizeof noisy);
    edge_add_noise(&random, 400, noisy, sizeof noisy);
    const oc_image_t image = {noisy, 256, 256, 256, 1};
    float noise = 0;
    TEST_ASSERT_EQUAL(OC_OK, oc_gradient_noise(&gradient, &image, &noise));
    /* sd of a Gaussian derivative of white noise = n / (sqrt(8 pi) sigma^2); the
     * central difference widens the kernel a little. */
    const double sigma2 = 1.5 * 1.5 + 1.0 / 3.0;
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.18, 20.0 * 0.1995 / sigma2, (double)noise, "seed 20040519");
}

/* Every level against the twin, on widths around whole words. */
static void all_levels_give_the_same_planes_and_maps(void)
{
    static uint8_t noisy[45 * 200];
    static int16_t planes[2 * 45 * 200];
    static uint64_t thin[(45 + 36) * 6];
    edge_random_t random = {SEED};
    for (size_t i = 0; i < sizeof noisy; i++) noisy[i] = (uint8_t)edge_uniform(&random, 0, 255.999);
    const uint32_t widths[] = {32, 63, 64, 65, 127, 128, 129, 191, 200};
    const float sigmas[] = {0.6f, 1.2f, 1.5f, 1.8f, 2.6f};
    for (int w = 0; w < 9; w++) {
        const oc_image_t image = {noisy, widths[w], 45, 200, 1};
        const size_t n_px = widths[w] * 45u, n_words = oc_bitmap_words(widths[w], 45);
        for (int s = 0; s < 5; s++) {
            for (int l = OC_SIMD_SCALAR; l <= OC_SIMD_AVX2; l++) {
                level = (oc_simd_t)l;
                make(widths[w], 45, sigmas[s]);
                TEST_ASSERT_EQUAL(OC_OK, oc_gradient_compute(&gradient, &image, 5.0f));
                if (l == OC_SIMD_SCALAR) {
                    memcpy(planes, gradient.dxdy, n_px * 4u);
                    memcpy(thin, gradient.thin, n_words * 8u);
                    TEST_ASSERT_TRUE(gradient.n_thin > 10);
                }
                TEST_ASSERT_EQUAL_MEMORY(planes, gradient.dxdy, n_px * 4u);
                TEST_ASSERT_EQUAL_MEMORY(thin, gradient.thin, n_words * 8u);
                free(memory);
                memory = NULL;
            }
        }
    }
    level = OC_SIMD_AUTO;
}

static void bad_sizes_images_and_parameters_are_refused(void)
{
    TEST_ASSERT_EQUAL_size_t(0, oc_gradient_size_bytes(OC_MIN_IMAGE_SIDE - 1, 64));
    TEST_ASSERT_EQUAL_size_t(0, oc_gradient_size_bytes(64, OC_MAX_IMAGE_SIDE + 1));
    static uint8_t block[1 << 16];
    oc_arena_t arena;
    oc_gradient_t g;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, block, sizeof block));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_gradient_init(&g, &arena, 31, 64, 1.2f, OC_SIMD_AUTO));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_gradient_init(&g, &arena, 64, 64, NAN, OC_SIMD_AUTO));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_gradient_init(&g, &arena, 64, 64, 3.1f, OC_SIMD_AUTO));
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_gradient_init(&g, &arena, 640, 480, 1.2f, OC_SIMD_AUTO));
    make(W, H, 1.2f);
    const oc_image_t bad[] = {{NULL, W, H, W, 1}, {px, W, H, W - 1, 1}, {px, W - 1, H, W, 1}, {px, W / 3, H, W, 3}};
    for (int i = 0; i < 4; i++) TEST_ASSERT_EQUAL(OC_E_ARG, oc_gradient_compute(&gradient, &bad[i], 6.0f));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_ramp_reads_its_slope_in_the_stated_unit);
    RUN_TEST(flat_images_have_no_gradient_even_at_the_border);
    RUN_TEST(it_agrees_with_a_direct_gaussian_derivative);
    RUN_TEST(full_contrast_does_not_overflow);
    RUN_TEST(mirroring_the_image_mirrors_the_gradient_exactly);
    RUN_TEST(the_stride_does_not_matter);
    RUN_TEST(thin_pixels_are_ridge_tops_of_thick_ones);
    RUN_TEST(noise_is_measured_within_a_tenth);
    RUN_TEST(all_levels_give_the_same_planes_and_maps);
    RUN_TEST(bad_sizes_images_and_parameters_are_refused);
    return UNITY_END();
}
