/* SPDX-License-Identifier: BSD-3-Clause
 * Corners on exact scenes and against their definition; the share of the list they get beside junctions. */
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "edge_scene.h"
#include "vehicle/corner.h"
#include "vehicle/judoca.h"

#define SEED 19880831u
#define CELL 64
#define WIDE 203
#define HIGH 131

static oc_gradient_t gradient;
static oc_corner_ws_t corners;
static oc_judoca_ws_t ws;
static void *memory;
static float fine[(CELL + 2 * EDGE_REACH) * EDGE_SAMPLES * (CELL + 2 * EDGE_REACH) * EDGE_SAMPLES];
static uint8_t px[WIDE * HIGH];
static oc_junction_t found[OC_MAX_JUNCTIONS], other[OC_MAX_JUNCTIONS];
static edge_random_t rng;

static void make(uint32_t width, uint32_t height, uint32_t cell_px, oc_simd_t simd)
{
    free(memory);
    const size_t bytes =
        OC_ARENA_ALIGN + oc_gradient_size_bytes(width, height) + oc_corner_size_bytes(width, height, cell_px);
    memory = malloc(bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, memory, bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_gradient_init(&gradient, &arena, width, height, 1.2f, simd));
    TEST_ASSERT_EQUAL(OC_OK, oc_corner_init(&corners, &arena, width, height, cell_px));
}

static uint32_t find(float floor, uint32_t cap)
{
    const oc_image_t image = {px, gradient.width_px, gradient.height_px, gradient.width_px, 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_gradient_compute(&gradient, &image, 6.0f));
    return oc_corner_find(&corners, &gradient, floor, found, cap);
}

/* Spots of all sizes: natural texture, near enough. */
static void render_spots(double contrast, int x0, int x1)
{
    for (int y = 0; y < HIGH; y++) {
        for (int x = x0; x < x1; x++) px[y * WIDE + x] = 100;
    }
    for (int k = 0; k < 600; k++) {
        const double at_x = edge_uniform(&rng, x0, x1), at_y = edge_uniform(&rng, 0, HIGH);
        const double radius = edge_uniform(&rng, 1.5, 4), add = edge_uniform(&rng, -contrast, contrast);
        for (int y = 0; y < HIGH; y++) {
            for (int x = x0; x < x1; x++) {
                const double ex = (x - at_x) / radius, ey = (y - at_y) / radius;
                const double level = px[y * WIDE + x] + add * exp(-0.5 * (ex * ex + ey * ey));
                px[y * WIDE + x] = (uint8_t)(level < 0 ? 0 : level > 255 ? 255 : level);
            }
        }
    }
}

static void check_corner(const oc_junction_t *c, uint32_t width, uint32_t height)
{
    const float least = (float)OC_CORNER_MARGIN_PX - (float)OC_CORNER_REACH_PX;
    TEST_ASSERT_TRUE(c->x_px >= least && c->x_px <= (float)(width - 1u) - least);
    TEST_ASSERT_TRUE(c->y_px >= least && c->y_px <= (float)(height - 1u) - least);
    TEST_ASSERT_TRUE(c->n_branches == 1 && c->kind == OC_KIND_CORNER && c->label == OC_LABEL_UNKNOWN);
    TEST_ASSERT_TRUE(c->branch[0].angle_rad >= 0 && (double)c->branch[0].angle_rad < 2 * EDGE_PI);
    TEST_ASSERT_TRUE(isfinite(c->score) && c->score > 0);
}

/* ---- one corner ---- */

/* Blur rounds a corner off, so that its point lies inside, on the bisector, by the same amount everywhere. */
static void the_corner_of_a_quadrant_is_found_wherever_it_lies_and_however_it_is_turned(void)
{
    make(CELL, CELL, 40, OC_SIMD_AUTO);
    double sum = 0, squares = 0, worst_across = 0, worst_turn = 0;
    int n = 0;
    for (int turn = 0; turn < 16; turn++) {
        for (int k = 0; k < 4; k++) {
            const double a = (turn + 0.37) * EDGE_PI / 8, b = fmod(a + EDGE_PI / 2, 2 * EDGE_PI);
            const double bright = 190, dark = 60, middle = a + EDGE_PI / 4;
            const edge_fan_t fan = {edge_uniform(&rng, 31.5, 32.5),
                                    edge_uniform(&rng, 31.5, 32.5),
                                    2,
                                    {fmin(a, b), fmax(a, b)},
                                    {a < b ? bright : dark, a < b ? dark : bright}};
            edge_render(edge_fan_level, &fan, CELL, CELL, fine, px);
            TEST_ASSERT_EQUAL_UINT32(1, find(3.0f, OC_MAX_JUNCTIONS));
            check_corner(&found[0], CELL, CELL);
            const double ex = (double)found[0].x_px - fan.x_px, ey = (double)found[0].y_px - fan.y_px;
            const double inwards = ex * cos(middle) + ey * sin(middle), across = ey * cos(middle) - ex * sin(middle);
            sum += inwards;
            squares += inwards * inwards;
            worst_across = fmax(worst_across, fabs(across));
            worst_turn = fmax(worst_turn, edge_between((double)found[0].branch[0].angle_rad, middle));
            n++;
        }
    }
    const double mean = sum / n, spread = sqrt(squares / n - mean * mean);
    char text[160];
    snprintf(text, sizeof text, "inwards %.3f px, sd %.3f px, across at most %.3f px, orientation %.4f rad", mean,
             spread, worst_across, worst_turn);
    TEST_ASSERT_TRUE_MESSAGE(fabs(mean - 0.67) < 0.05 && spread < 0.1 && worst_across < 0.2 && worst_turn < 0.15, text);
}

static void straight_edges_and_flat_images_have_none(void)
{
    make(CELL, CELL, 40, OC_SIMD_AUTO);
    for (int turn = 0; turn < 16; turn++) {
        const double a = turn * EDGE_PI / 16;
        const edge_fan_t fan = {31.7, 32.2, 2, {a, a + EDGE_PI}, {20, 230}};
        edge_render(edge_fan_level, &fan, CELL, CELL, fine, px);
        TEST_ASSERT_EQUAL_UINT32(0, find(3.0f, OC_MAX_JUNCTIONS));
    }
    memset(px, 77, sizeof px);
    TEST_ASSERT_EQUAL_UINT32(0, find(1e-6f, OC_MAX_JUNCTIONS));
}

/* ---- against the definition ---- */

static double strength[HIGH][WIDE];

/* The window's sum at once, in double precision. */
static double direct_strength(int x, int y)
{
    static const int weight[5] = {1, 4, 6, 4, 1};
    double xx = 0, xy = 0, yy = 0;
    for (int j = -2; j <= 2; j++) {
        for (int i = -2; i <= 2; i++) {
            const int16_t *d = gradient.dxdy + 2 * ((y + j) * WIDE + x + i);
            const double w = weight[j + 2] * weight[i + 2], gx = d[0] >> 4, gy = d[1] >> 4;
            xx += w * gx * gx, xy += w * gx * gy, yy += w * gy * gy;
        }
    }
    const double smaller = 0.5 * (xx + yy) - hypot(0.5 * (xx - yy), xy);
    return sqrt(fmax(smaller, 0) / 256) / 16;
}

static bool is_direct_peak(int x, int y, double floor)
{
    for (int j = -3; j <= 3; j++) {
        for (int i = -3; i <= 3; i++) {
            if ((i != 0 || j != 0) && strength[y + j][x + i] >= strength[y][x]) return false;
        }
    }
    return strength[y][x] >= floor;
}

/* Foerstner's point: least squares over the lines across every pixel's derivative. */
static void direct_point(int x, int y, double *at_x, double *at_y)
{
    double xx = 0, xy = 0, yy = 0, px_sum = 0, py_sum = 0;
    for (int j = -4; j <= 4; j++) {
        for (int i = -4; i <= 4; i++) {
            const int16_t *d = gradient.dxdy + 2 * ((y + j) * WIDE + x + i);
            const double w = (5 - abs(i)) * (5 - abs(j)), gx = d[0], gy = d[1];
            xx += w * gx * gx, xy += w * gx * gy, yy += w * gy * gy;
            px_sum += w * gx * (gx * i + gy * j), py_sum += w * gy * (gx * i + gy * j);
        }
    }
    const double det = xx * yy - xy * xy;
    const double ex = (yy * px_sum - xy * py_sum) / det, ey = (xx * py_sum - xy * px_sum) / det;
    const bool is_kept = det > 0.02 * (xx + yy) * (xx + yy) && hypot(ex, ey) <= 3;
    *at_x = x + (is_kept ? ex : 0), *at_y = y + (is_kept ? ey : 0);
}

static void all_maxima_of_the_definition_are_found_and_no_others(void)
{
    make(WIDE, HIGH, 8, OC_SIMD_AUTO); /* cells too small for more maxima than they hold */
    render_spots(60, 0, WIDE);
    const float floor = 3.0f;
    const uint32_t n = find(floor, OC_MAX_JUNCTIONS);
    for (int y = 4; y < HIGH - 4; y++) {
        for (int x = 4; x < WIDE - 4; x++) strength[y][x] = direct_strength(x, y);
    }
    uint32_t n_direct = 0, n_same = 0;
    for (int y = 7; y < HIGH - 7; y++) {
        for (int x = 7; x < WIDE - 7; x++) {
            if (!is_direct_peak(x, y, (double)floor)) continue;
            n_direct++;
            double at_x, at_y;
            direct_point(x, y, &at_x, &at_y);
            const double s = strength[y][x];
            for (uint32_t i = 0; i < n; i++) {
                const double gap = hypot((double)found[i].x_px - at_x, (double)found[i].y_px - at_y);
                n_same += gap < 1e-3 && fabs((double)found[i].score - 2 * s / (s + 10)) < 1e-5;
            }
        }
    }
    TEST_ASSERT_TRUE(n_direct > 100 && n < OC_MAX_JUNCTIONS);
    TEST_ASSERT_EQUAL_UINT32(n_direct, n);
    TEST_ASSERT_EQUAL_UINT32(n_direct, n_same);
}

static void a_turned_image_has_the_same_corners_turned(void)
{
    static uint8_t upright[WIDE * HIGH];
    make(WIDE, HIGH, 8, OC_SIMD_AUTO);
    render_spots(60, 0, WIDE);
    memcpy(upright, px, sizeof px);
    const uint32_t n = find(3.0f, OC_MAX_JUNCTIONS);
    memcpy(other, found, sizeof other);

    make(HIGH, WIDE, 8, OC_SIMD_AUTO);
    for (int y = 0; y < HIGH; y++) {
        for (int x = 0; x < WIDE; x++) px[x * HIGH + (HIGH - 1 - y)] = upright[y * WIDE + x];
    }
    const uint32_t n_turned = find(3.0f, OC_MAX_JUNCTIONS);
    uint32_t n_same = 0;
    for (uint32_t i = 0; i < n; i++) {
        const double x = HIGH - 1 - (double)other[i].y_px, y = (double)other[i].x_px;
        for (uint32_t k = 0; k < n_turned; k++) {
            const double gap = hypot((double)found[k].x_px - x, (double)found[k].y_px - y);
            const double turned = (double)other[i].branch[0].angle_rad + EDGE_PI / 2;
            n_same += gap < 0.05 && edge_between((double)found[k].branch[0].angle_rad, turned) < 0.1;
        }
    }
    TEST_ASSERT_TRUE(n_same * 100 >= n * 95); /* the filter's rounding is not symmetric */
}

/* ---- limits ---- */

static void a_limit_is_shared_over_the_image(void)
{
    make(WIDE, HIGH, 40, OC_SIMD_AUTO);
    render_spots(70, 0, 100);
    render_spots(45, 100, WIDE);
    const uint32_t n_all = find(1.0f, OC_MAX_JUNCTIONS);
    TEST_ASSERT_TRUE(n_all > 80);
    uint32_t n_strong_right = 0, n_right = 0;
    for (uint32_t i = 0; i < 40; i++) n_strong_right += found[i].x_px > 100.0f;
    const uint32_t n = find(1.0f, 40);
    TEST_ASSERT_EQUAL_UINT32(40, n);
    for (uint32_t i = 0; i < n; i++) {
        check_corner(&found[i], WIDE, HIGH);
        TEST_ASSERT_TRUE(i == 0 || found[i].score <= found[i - 1].score);
        n_right += found[i].x_px > 100.0f;
    }
    TEST_ASSERT_TRUE(n_right > n_strong_right); /* the weaker half gets more than its strength alone would */
    TEST_ASSERT_EQUAL_UINT32(0, find(1.0f, 0));
}

static void no_cell_gives_more_than_it_holds(void)
{
    make(WIDE, HIGH, 256, OC_SIMD_AUTO);
    render_spots(60, 0, WIDE);
    TEST_ASSERT_EQUAL_UINT32(OC_CORNER_PER_CELL, find(3.0f, OC_MAX_JUNCTIONS));
    memcpy(other, found, sizeof other);
    make(WIDE, HIGH, 8, OC_SIMD_AUTO);
    find(3.0f, OC_MAX_JUNCTIONS);
    TEST_ASSERT_EQUAL_MEMORY(found, other, OC_CORNER_PER_CELL * sizeof found[0]); /* the strongest */
}

static void bad_sizes_and_small_arenas_are_refused(void)
{
    TEST_ASSERT_TRUE(oc_corner_size_bytes(640, 480, 40) > 0);
    TEST_ASSERT_EQUAL_size_t(0, oc_corner_size_bytes(31, 480, 40));
    TEST_ASSERT_EQUAL_size_t(0, oc_corner_size_bytes(640, 4097, 40));
    TEST_ASSERT_EQUAL_size_t(0, oc_corner_size_bytes(640, 480, 7));
    TEST_ASSERT_EQUAL_size_t(0, oc_corner_size_bytes(640, 480, 4097));
    static uint8_t block[4096];
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, block, sizeof block));
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_corner_init(&corners, &arena, 640, 480, 40));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_corner_init(&corners, &arena, 640, 480, 0));
}

/* ---- hostile images ---- */

static void render_hostile(int kind)
{
    for (int i = 0; i < WIDE * HIGH; i++) {
        const int x = i % WIDE, y = i / WIDE;
        const uint8_t noise = (uint8_t)edge_uniform(&rng, 0, 255.999);
        const uint8_t value[6] = {0,
                                  255,
                                  noise,
                                  (uint8_t)(noise & 1 ? 255 : 0),
                                  (uint8_t)((x / 5 + y / 5) % 2 ? 255 : 0),
                                  (uint8_t)((x + y) % 2 ? 255 : 0)};
        px[i] = value[kind];
    }
}

static void whatever_the_image_the_answer_is_in_order(void)
{
    const uint32_t sizes[][2] = {{32, 32}, {33, 61}, {WIDE, 32}, {32, HIGH}, {WIDE, HIGH}};
    for (size_t s = 0; s < sizeof sizes / sizeof sizes[0]; s++) {
        make(sizes[s][0], sizes[s][1], 16, OC_SIMD_AUTO);
        for (int kind = 0; kind < 6; kind++) {
            render_hostile(kind);
            const uint32_t n = find(1e-6f, OC_MAX_JUNCTIONS);
            TEST_ASSERT_TRUE(n <= OC_MAX_JUNCTIONS);
            for (uint32_t i = 0; i < n; i++) check_corner(&found[i], sizes[s][0], sizes[s][1]);
            if (kind < 2) TEST_ASSERT_EQUAL_UINT32(0, n);
        }
    }
}

/* A window full of the steepest derivatives: both eigenvalues are the largest there are, 2^30 before the root. */
static void the_largest_sums_fit(void)
{
    make(CELL, CELL, 40, OC_SIMD_AUTO);
    memset(gradient.dxdy, 0, 2 * CELL * CELL * sizeof gradient.dxdy[0]);
    for (int y = 30; y < 35; y++) {
        for (int x = 30; x < 35; x++) {
            gradient.dxdy[2 * (y * CELL + x)] = INT16_MIN;
            gradient.dxdy[2 * (y * CELL + x) + 1] = (x + y) % 2 ? INT16_MIN : INT16_MAX;
        }
    }
    TEST_ASSERT_EQUAL_UINT32(1, oc_corner_find(&corners, &gradient, 100.0f, found, OC_MAX_JUNCTIONS));
    check_corner(&found[0], CELL, CELL);
    TEST_ASSERT_FLOAT_WITHIN(1e-3f, 2.0f * 128.0f / 138.0f, found[0].score);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 32.0f, found[0].x_px);
    TEST_ASSERT_FLOAT_WITHIN(0.01f, 32.0f, found[0].y_px);
}

/* ---- beside junctions ---- */

static uint32_t detect(const oc_judoca_params_t *params, uint32_t cap, oc_junction_t out[])
{
    free(memory);
    const size_t bytes = oc_judoca_size_bytes(WIDE, HIGH, params);
    TEST_ASSERT_TRUE(bytes > 0);
    memory = malloc(bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, memory, bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_init(&ws, &arena, WIDE, HIGH, params));
    const oc_image_t image = {px, WIDE, HIGH, WIDE, 1};
    uint32_t n;
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_detect(&ws, &image, out, cap, &n));
    return n;
}

static uint32_t count_corners(const oc_junction_t list[], uint32_t n)
{
    uint32_t n_corners = 0;
    for (uint32_t i = 0; i < n; i++) n_corners += list[i].kind == OC_KIND_CORNER;
    return n_corners;
}

static void corners_join_the_junctions_without_crowding_them(void)
{
    render_spots(60, 0, WIDE);
    oc_judoca_params_t params = oc_judoca_defaults();
    const uint32_t n_before = detect(&params, OC_MAX_JUNCTIONS, found);
    TEST_ASSERT_EQUAL_UINT32(0, count_corners(found, n_before));
    TEST_ASSERT_EQUAL_UINT32(0, ws.stats.n_corners);

    params.max_corners = 200;
    const uint32_t n = detect(&params, OC_MAX_JUNCTIONS, found), n_corners = count_corners(found, n);
    TEST_ASSERT_TRUE(n > n_before && n_corners > 50 && n_corners <= 200);
    for (uint32_t i = 0; i < n; i++) {
        TEST_ASSERT_TRUE(i == 0 || found[i].score <= found[i - 1].score);
        for (uint32_t k = 0; k < i; k++)
            TEST_ASSERT_TRUE(hypotf(found[i].x_px - found[k].x_px, found[i].y_px - found[k].y_px) >= 2.999f);
    }
    params.max_junctions = 50;
    TEST_ASSERT_EQUAL_UINT32(50, detect(&params, OC_MAX_JUNCTIONS, found));
    TEST_ASSERT_EQUAL_UINT32(7, detect(&params, 7, found));
}

static void the_corners_of_squares_stay_junctions(void)
{
    memset(px, 60, sizeof px);
    for (int k = 0; k < 6; k++) {
        for (int y = 20; y < 60; y++) memset(px + (y + k % 2 * 50) * WIDE + 15 + k / 2 * 60, 190, 40);
    }
    oc_judoca_params_t params = oc_judoca_defaults();
    TEST_ASSERT_EQUAL_UINT32(24, detect(&params, OC_MAX_JUNCTIONS, found));
    params.max_corners = OC_MAX_JUNCTIONS;
    TEST_ASSERT_EQUAL_UINT32(24, detect(&params, OC_MAX_JUNCTIONS, found));
    for (int i = 0; i < 24; i++) TEST_ASSERT_EQUAL_UINT8(OC_KIND_L, found[i].kind);
}

static void all_instruction_sets_give_the_same_bits(void)
{
    render_spots(60, 0, WIDE);
    oc_judoca_params_t params = oc_judoca_defaults();
    params.max_corners = 300;
    params.simd = OC_SIMD_SCALAR;
    const uint32_t n = detect(&params, OC_MAX_JUNCTIONS, found);
    TEST_ASSERT_TRUE(count_corners(found, n) > 50);
    for (int simd = OC_SIMD_BASE; simd <= OC_SIMD_AVX2; simd++) {
        params.simd = (oc_simd_t)simd;
        TEST_ASSERT_EQUAL_UINT32(n, detect(&params, OC_MAX_JUNCTIONS, other));
        TEST_ASSERT_EQUAL_MEMORY(found, other, n * sizeof found[0]);
    }
}

static void out_of_range_counts_are_refused(void)
{
    oc_judoca_params_t params = oc_judoca_defaults();
    params.max_corners = OC_MAX_JUNCTIONS;
    TEST_ASSERT_TRUE(oc_judoca_params_are_valid(&params));
    params.max_corners = OC_MAX_JUNCTIONS + 1u;
    TEST_ASSERT_FALSE(oc_judoca_params_are_valid(&params));
}

void setUp(void)
{
    rng.state = SEED;
}

void tearDown(void)
{
    free(memory);
    memory = NULL;
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_corner_of_a_quadrant_is_found_wherever_it_lies_and_however_it_is_turned);
    RUN_TEST(straight_edges_and_flat_images_have_none);
    RUN_TEST(all_maxima_of_the_definition_are_found_and_no_others);
    RUN_TEST(a_turned_image_has_the_same_corners_turned);
    RUN_TEST(a_limit_is_shared_over_the_image);
    RUN_TEST(no_cell_gives_more_than_it_holds);
    RUN_TEST(bad_sizes_and_small_arenas_are_refused);
    RUN_TEST(whatever_the_image_the_answer_is_in_order);
    RUN_TEST(the_largest_sums_fit);
    RUN_TEST(corners_join_the_junctions_without_crowding_them);
    RUN_TEST(the_corners_of_squares_stay_junctions);
    RUN_TEST(all_instruction_sets_give_the_same_bits);
    RUN_TEST(out_of_range_counts_are_refused);
    return UNITY_END();
}
