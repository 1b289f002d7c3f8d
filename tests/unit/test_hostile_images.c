/* SPDX-License-Identifier: BSD-3-Clause
 * The doors of the detector and of the vehicle: pictures of every kind and size, pictures that are none, and guard
 * bytes round everything that is handed in or written. */
#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground_scene.h"
#include "thesis_tables.h"
#include "vehicle/vehicle.h"

#define GUARD_BYTES 512u
#define GUARD 0x5au

typedef enum kind { BLACK, WHITE, SATURATED, NOISE, CHECKS, STRIPES, TILES, N_KINDS } kind_t;

/* A piece of memory with guard bytes on both sides. */
typedef struct guarded {
    uint8_t *block, *bytes;
    size_t n_bytes;
} guarded_t;

static guarded_t picture, arena_block, answers;
static uint64_t rng;

static guarded_t guarded_make(size_t n_bytes)
{
    const size_t rounded = (n_bytes + 63u) / 64u * 64u;
    guarded_t g = {aligned_alloc(64, rounded + 2u * GUARD_BYTES), NULL, n_bytes};
    TEST_ASSERT_NOT_NULL(g.block);
    memset(g.block, GUARD, rounded + 2u * GUARD_BYTES);
    g.bytes = g.block + GUARD_BYTES;
    return g;
}

static void guarded_check(const guarded_t *g)
{
    if (!g->block) return;
    for (size_t i = 0; i < GUARD_BYTES; i++) {
        TEST_ASSERT_EQUAL_HEX8(GUARD, g->block[i]);
        TEST_ASSERT_EQUAL_HEX8(GUARD, g->bytes[g->n_bytes + i]);
    }
}

static void guarded_free(guarded_t *g)
{
    free(g->block);
    *g = (guarded_t){NULL, NULL, 0};
}

void setUp(void)
{
    rng = 88172645463325252u;
}

void tearDown(void)
{
    guarded_check(&picture);
    guarded_check(&arena_block);
    guarded_check(&answers);
    guarded_free(&picture);
    guarded_free(&arena_block);
    guarded_free(&answers);
}

static uint8_t next_byte(void)
{
    rng ^= rng << 13;
    rng ^= rng >> 7;
    rng ^= rng << 17;
    return (uint8_t)(rng >> 32);
}

static uint8_t level_of(kind_t kind, uint32_t x, uint32_t y)
{
    switch (kind) {
    case BLACK: return 0;
    case WHITE: return 255;
    case SATURATED: return (uint8_t)(x / 23u % 2u == y / 19u % 2u ? 255 : 0); /* steps of full height */
    case NOISE: return next_byte();
    case CHECKS: return (uint8_t)((x + y) % 2u * 255u);
    case STRIPES: return (uint8_t)(x / 2u % 2u * 255u);
    case TILES: return (uint8_t)oc_scene_hash((int32_t)(x / 31u), (int32_t)(y / 29u), 1);
    default: return 128;
    }
}

/* Rows stride_bytes apart; what lies between them, and round all of it, is GUARD. */
static oc_image_t picture_make(kind_t kind, uint32_t width_px, uint32_t height_px, uint32_t stride_bytes)
{
    guarded_free(&picture);
    picture = guarded_make((size_t)(height_px - 1u) * stride_bytes + width_px);
    for (uint32_t y = 0; y < height_px; y++) {
        for (uint32_t x = 0; x < width_px; x++) picture.bytes[(size_t)y * stride_bytes + x] = level_of(kind, x, y);
    }
    const oc_image_t image = {picture.bytes, width_px, height_px, stride_bytes, 1};
    return image;
}

/* Nothing of the picture, of what lies between its rows, or round it has changed. */
static uint32_t picture_sum(void)
{
    uint32_t sum = 1;
    for (size_t i = 0; i < picture.n_bytes; i++) sum = sum * 31u + picture.bytes[i];
    return sum;
}

static uint32_t detect(const oc_image_t *image, const oc_judoca_params_t *params, uint32_t cap)
{
    static oc_judoca_ws_t ws;
    guarded_free(&arena_block);
    guarded_free(&answers);
    arena_block = guarded_make(oc_judoca_size_bytes(image->width_px, image->height_px, params));
    answers = guarded_make(cap * sizeof(oc_junction_t));
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, arena_block.bytes, arena_block.n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_init(&ws, &arena, image->width_px, image->height_px, params));
    const uint32_t before = picture_sum();
    uint32_t n = UINT32_MAX;
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_detect(&ws, image, (oc_junction_t *)(void *)answers.bytes, cap, &n));
    TEST_ASSERT_TRUE(n <= cap && n <= params->max_junctions);
    TEST_ASSERT_EQUAL_HEX32(before, picture_sum());
    guarded_check(&picture);
    guarded_check(&arena_block);
    guarded_check(&answers);
    return n;
}

static const oc_junction_t *found(void)
{
    return (const oc_junction_t *)(const void *)answers.bytes;
}

static void check_found(uint32_t n, const oc_image_t *image)
{
    for (uint32_t i = 0; i < n; i++) {
        const oc_junction_t *j = &found()[i];
        TEST_ASSERT_TRUE(j->x_px >= 0.0f && j->x_px <= (float)(image->width_px - 1u));
        TEST_ASSERT_TRUE(j->y_px >= 0.0f && j->y_px <= (float)(image->height_px - 1u));
        TEST_ASSERT_TRUE(j->n_branches >= 2 && j->n_branches <= OC_MAX_BRANCHES);
        TEST_ASSERT_TRUE(isfinite(j->score) && (i == 0 || j->score <= found()[i - 1].score));
    }
}

/* ---- the detector's door ---- */

static void every_kind_of_picture_of_every_shape_is_survived(void)
{
    const uint32_t sizes[][3] = {{32, 32, 32}, {33, 32, 33},    {32, 33, 64},   {47, 61, 47},    {63, 64, 1000},
                                 {65, 35, 67}, {127, 129, 131}, {201, 32, 201}, {32, 203, 4096}, {255, 127, 256}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        for (int kind = 0; kind < N_KINDS; kind++) {
            const oc_image_t image = picture_make((kind_t)kind, sizes[s][0], sizes[s][1], sizes[s][2]);
            oc_judoca_params_t params = oc_judoca_defaults();
            uint32_t n = detect(&image, &params, OC_MAX_JUNCTIONS);
            check_found(n, &image);
            if (kind == BLACK || kind == WHITE) TEST_ASSERT_EQUAL_UINT32(0, n);
            if ((kind == SATURATED || kind == TILES) && sizes[s][0] > 60 && sizes[s][1] > 60) TEST_ASSERT_TRUE(n > 0);

            params.t_b = 0.0f; /* threshold out of the noise, widest kernel, longest and shortest branches */
            params.sigma_px = OC_GRADIENT_MAX_SIGMA_PX;
            params.lambda_px = OC_JUDOCA_MAX_LAMBDA_PX;
            params.lambda_min_px = 4;
            n = detect(&image, &params, OC_MAX_JUNCTIONS);
            check_found(n, &image);
            params.method = OC_JUDOCA_THESIS;
            n = detect(&image, &params, OC_MAX_JUNCTIONS);
            check_found(n, &image);
        }
    }
}

#define CELLS 4u

/* Every sixteenth of the picture has its share of the junctions: a quarter of it at least, three times it at most. */
static void check_spread(uint32_t n, const oc_image_t *image)
{
    uint32_t in_cell[CELLS * CELLS] = {0};
    char text[96];
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t col = (uint32_t)found()[i].x_px * CELLS / image->width_px;
        const uint32_t row = (uint32_t)found()[i].y_px * CELLS / image->height_px;
        in_cell[row * CELLS + col]++;
    }
    for (uint32_t i = 0; i < CELLS * CELLS; i++) {
        (void)snprintf(text, sizeof text, "%u of %u in cell %u of a picture %u px wide", (unsigned)in_cell[i],
                       (unsigned)n, (unsigned)i, (unsigned)image->width_px);
        TEST_ASSERT_TRUE_MESSAGE(in_cell[i] >= n / (CELLS * CELLS) / 4u, text);
        TEST_ASSERT_TRUE_MESSAGE(in_cell[i] <= n / (CELLS * CELLS) * 3u, text);
    }
}

static void the_largest_picture_is_taken(void)
{
    const oc_judoca_params_t params = oc_judoca_defaults();
    const kind_t kinds[] = {TILES, SATURATED};
    for (int k = 0; k < 2; k++) {
        const oc_image_t image = picture_make(kinds[k], OC_MAX_IMAGE_SIDE, OC_MAX_IMAGE_SIDE, OC_MAX_IMAGE_SIDE);
        TEST_ASSERT_EQUAL_UINT32(params.max_junctions, detect(&image, &params, OC_MAX_JUNCTIONS));
        check_found(params.max_junctions, &image);
        check_spread(params.max_junctions, &image);
    }
    TEST_ASSERT_EQUAL_size_t(0, oc_judoca_size_bytes(OC_MAX_IMAGE_SIDE + 1u, 64, &params));
    TEST_ASSERT_EQUAL_size_t(0, oc_judoca_size_bytes(64, OC_MIN_IMAGE_SIDE - 1u, &params));
    TEST_ASSERT_EQUAL_size_t(0, oc_judoca_size_bytes(UINT32_MAX, UINT32_MAX, &params));
}

/* Thousands of corners of one score: none of the limits on the way may take one side of the picture only. */
static void many_equal_corners_are_kept_all_over_the_picture(void)
{
    const oc_judoca_params_t params = oc_judoca_defaults();
    const uint32_t sides[] = {1024, 2048};
    const uint32_t squares[][2] = {{23, 19}, {8, 8}, {16, 16}, {32, 32}, {40, 40}, {41, 37}};
    for (int s = 0; s < 2; s++) {
        for (int k = 0; k < 6; k++) {
            const oc_image_t image = picture_make(BLACK, sides[s], sides[s], sides[s]);
            for (uint32_t y = 0; y < sides[s]; y++) {
                for (uint32_t x = 0; x < sides[s]; x++) {
                    picture.bytes[y * sides[s] + x] = x / squares[k][0] % 2u == y / squares[k][1] % 2u ? 255 : 0;
                }
            }
            TEST_ASSERT_EQUAL_UINT32(params.max_junctions, detect(&image, &params, OC_MAX_JUNCTIONS));
            check_found(params.max_junctions, &image);
            check_spread(params.max_junctions, &image);
        }
    }
}

/* Noise has junctions everywhere: a cap must not keep one corner of the picture. */
static void a_cap_is_spread_over_the_picture(void)
{
    enum { SIDE = 480 };
    const oc_image_t image = picture_make(NOISE, SIDE, SIDE, SIDE);
    oc_judoca_params_t params = oc_judoca_defaults();
    const uint32_t caps[] = {64, 200, 600};
    for (size_t c = 0; c < 3; c++) {
        params.max_junctions = caps[c];
        const uint32_t n = detect(&image, &params, OC_MAX_JUNCTIONS);
        TEST_ASSERT_EQUAL_UINT32(caps[c], n);
        check_spread(n, &image);
    }
}

/* Neither may the limit on the fits. */
static void a_limit_on_the_fits_is_spread_over_the_picture(void)
{
    enum { SIDE = 512 };
    oc_judoca_params_t params = oc_judoca_defaults();
    const kind_t kinds[] = {NOISE, TILES, SATURATED};
    const uint32_t limits[] = {1000, 400, 800}; /* of noise few make a junction, and a corner has several places */
    for (int k = 0; k < 3; k++) {
        const oc_image_t image = picture_make(kinds[k], SIDE, SIDE, SIDE);
        params.max_candidates = limits[k];
        const uint32_t n = detect(&image, &params, OC_MAX_JUNCTIONS);
        TEST_ASSERT_TRUE(n >= 64 && n < params.max_candidates);
        check_spread(n, &image);
    }
}

/* ---- the vehicle's door ---- */

#define WIDTH 160u
#define HEIGHT 120u

static oc_vehicle_t *vehicle;

static void vehicle_start(void)
{
    oc_vehicle_config_t config = oc_vehicle_defaults();
    config.max_width_px = WIDTH;
    config.max_height_px = HEIGHT;
    config.stored_views = 3;
    guarded_free(&arena_block);
    arena_block = guarded_make(oc_vehicle_size(&config));
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_init(&config, arena_block.bytes, arena_block.n_bytes, &vehicle));
}

/* A frame whose camera has the image's size. */
static oc_frame_t frame_around(const oc_image_t *image)
{
    oc_frame_t frame = {.image = *image, .camera = oc_test_camera(&table_7_3, 2), .utime_us = 1, .is_forced = true};
    const uint32_t w = image->width_px ? image->width_px : 1u, h = image->height_px ? image->height_px : 1u;
    frame.camera.k =
        oc_intrinsics_from_format(table_7_3.focal_mm, OC_TEST_FORMAT_WIDTH_MM, OC_TEST_FORMAT_HEIGHT_MM, w, h);
    for (int m = 0; m < 6; m++) frame.margin.v[m] = 0.01;
    return frame;
}

static oc_status_t push(const oc_image_t *image)
{
    const oc_frame_t frame = frame_around(image);
    oc_push_report_t report;
    const oc_status_t status = oc_vehicle_push(vehicle, &frame, &report);
    guarded_check(&arena_block);
    guarded_check(&picture);
    return status;
}

static void drain(void)
{
    guarded_t datagram = guarded_make(OC_MAX_DATAGRAM_BYTES);
    for (size_t n_bytes = 1; n_bytes > 0;) {
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_next(vehicle, datagram.bytes, datagram.n_bytes, &n_bytes));
        TEST_ASSERT_TRUE(n_bytes <= datagram.n_bytes);
    }
    guarded_check(&datagram);
    guarded_free(&datagram);
}

static void frames_that_are_none_are_refused(void)
{
    vehicle_start();
    const oc_image_t good = picture_make(SATURATED, WIDTH, HEIGHT, WIDTH);
    oc_image_t bad;
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.px = NULL, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.stride_bytes = 0, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.stride_bytes = WIDTH - 1u, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.channels = 3, push(&bad))); /* rows would overlap */
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.channels = 0, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.channels = UINT32_MAX, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.width_px = 0, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.height_px = OC_MIN_IMAGE_SIDE - 1u, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.height_px = OC_MAX_IMAGE_SIDE + 1u, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_ARG, (bad = good, bad.width_px = bad.stride_bytes = UINT32_MAX, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_LIMIT, (bad = good, bad.width_px = bad.stride_bytes = WIDTH + 1u, push(&bad)));
    TEST_ASSERT_EQUAL(OC_E_LIMIT, (bad = good, bad.height_px = HEIGHT + 1u, push(&bad)));

    oc_vehicle_status_t status = {0};
    oc_vehicle_get_status(vehicle, &status);
    TEST_ASSERT_EQUAL(0, status.n_views);
    TEST_ASSERT_EQUAL(OC_OK, push(&good));
    oc_vehicle_get_status(vehicle, &status);
    TEST_ASSERT_EQUAL(1, status.n_views);
}

static void every_kind_of_frame_passes_through_the_vehicle(void)
{
    const uint32_t sizes[][3] = {{WIDTH, HEIGHT, WIDTH}, {33, 47, 33}, {32, 32, 500}, {WIDTH, 35, WIDTH + 1u}};
    vehicle_start();
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        for (int kind = 0; kind < N_KINDS; kind++) {
            const oc_image_t image = picture_make((kind_t)kind, sizes[s][0], sizes[s][1], sizes[s][2]);
            const uint32_t before = picture_sum();
            TEST_ASSERT_EQUAL(OC_OK, push(&image));
            drain();
            TEST_ASSERT_EQUAL_HEX32(before, picture_sum());
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_kind_of_picture_of_every_shape_is_survived);
    RUN_TEST(the_largest_picture_is_taken);
    RUN_TEST(many_equal_corners_are_kept_all_over_the_picture);
    RUN_TEST(a_cap_is_spread_over_the_picture);
    RUN_TEST(a_limit_on_the_fits_is_spread_over_the_picture);
    RUN_TEST(frames_that_are_none_are_refused);
    RUN_TEST(every_kind_of_frame_passes_through_the_vehicle);
    return UNITY_END();
}
