/* SPDX-License-Identifier: BSD-3-Clause
 * What the detector says of T junctions, and which junctions it keeps when there are too many. */
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "edge_scene.h"
#include "vehicle/judoca.h"

#define SEED 20041215u
#define CELL 64
#define SIDE 480

static oc_judoca_ws_t ws;
static void *memory;
static float fine[(CELL + 2 * EDGE_REACH) * EDGE_SAMPLES * (CELL + 2 * EDGE_REACH) * EDGE_SAMPLES];
static uint8_t px[SIDE * SIDE];
static oc_junction_t found[OC_MAX_JUNCTIONS];
static uint32_t n_found;
static edge_random_t rng;

void setUp(void)
{
    memory = NULL;
    rng.state = SEED;
}

void tearDown(void)
{
    free(memory);
    memory = NULL;
}

static void make(uint32_t side, const oc_judoca_params_t *params)
{
    free(memory);
    const size_t n_bytes = oc_judoca_size_bytes(side, side, params);
    memory = malloc(n_bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, memory, n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_init(&ws, &arena, side, side, params));
}

static void detect(uint32_t side)
{
    const oc_image_t image = {px, side, side, side, 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_detect(&ws, &image, found, OC_MAX_JUNCTIONS, &n_found));
}

/* ---- T junctions ---- */

/* A bar at an angle and a stem to one side of it; all three sectors differ by 45 grey levels or more. */
static edge_fan_t random_t(double *bar_rad)
{
    edge_fan_t fan = {edge_uniform(&rng, 31.5, 32.5), edge_uniform(&rng, 31.5, 32.5), 3, {0}, {0}};
    const double bar = edge_uniform(&rng, 0.01, EDGE_PI - 0.01);
    const double stem = bar + edge_uniform(&rng, EDGE_PI / 4, 3 * EDGE_PI / 4);
    fan.angle_rad[0] = bar;
    fan.angle_rad[1] = stem < bar + EDGE_PI ? stem : bar + EDGE_PI;
    fan.angle_rad[2] = bar + EDGE_PI;
    fan.level[0] = edge_uniform(&rng, 20, 60);
    fan.level[1] = fan.level[0] + edge_uniform(&rng, 45, 80);
    fan.level[2] = fan.level[1] + edge_uniform(&rng, 45, 80);
    *bar_rad = bar;
    return fan;
}

static void t_junctions_are_named_and_their_bar_is_marked(void)
{
    enum { N = 120 };
    int n_named = 0, n_marked = 0;
    double worst = 0;
    const oc_judoca_params_t params = oc_judoca_defaults();
    make(CELL, &params);
    for (int i = 0; i < N; i++) {
        double bar_rad;
        const edge_fan_t fan = random_t(&bar_rad);
        edge_render(edge_fan_level, &fan, CELL, CELL, fine, px);
        detect(CELL);
        for (uint32_t k = 0; k < n_found; k++) {
            const oc_junction_t *j = &found[k];
            if (hypot((double)j->x_px - fan.x_px, (double)j->y_px - fan.y_px) > 1 || j->n_branches != 3) continue;
            n_named += j->kind == OC_KIND_T;
            const uint8_t straight = oc_junction_straight_branches(j->branch, j->n_branches);
            uint8_t expected = 0;
            for (uint32_t b = 0; b < 3; b++) {
                const double angle = (double)j->branch[b].angle_rad;
                const double off = fmin(edge_between(angle, bar_rad), edge_between(angle, bar_rad + EDGE_PI));
                if (off > 0.3) continue;
                expected |= (uint8_t)(1u << b);
                worst = fmax(worst, off);
            }
            n_marked += straight == expected;
        }
    }
    char text[128];
    (void)snprintf(text, sizeof text, "seed %u: of %d, %d named, %d marked, worst of a bar %.4f rad", SEED, N, n_named,
                   n_marked, worst);
    printf("%s\n", text);
    TEST_ASSERT_TRUE_MESSAGE(n_named >= N * 97 / 100 && n_marked >= N * 97 / 100, text);
    TEST_ASSERT_TRUE_MESSAGE(worst < 0.02, text);
}

/* ---- limits ---- */

/* Squares on a grid of 60 px with 28 px sides: a strong and a weak one side by side. */
#define PITCH 60
#define N_STRONG (SIDE / PITCH * (SIDE / PITCH) / 2 * 4)

static bool is_strong_square(int x, int y)
{
    return (x / PITCH + y / PITCH) % 2 == 0;
}

static void render_squares(double noise)
{
    for (int y = 0; y < SIDE; y++) {
        for (int x = 0; x < SIDE; x++) {
            const bool inside = x % PITCH >= 15 && x % PITCH < 43 && y % PITCH >= 15 && y % PITCH < 43;
            px[y * SIDE + x] = (uint8_t)(inside ? is_strong_square(x, y) ? 190 : 110 : 80);
        }
    }
    edge_add_noise(&rng, noise, px, sizeof px);
}

static uint32_t count_strong(void)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < n_found; i++) n += is_strong_square((int)found[i].x_px, (int)found[i].y_px);
    return n;
}

static void a_limit_keeps_the_corners_of_higher_contrast(void)
{
    oc_judoca_params_t params = oc_judoca_defaults();
    render_squares(4);
    make(SIDE, &params);
    detect(SIDE);
    TEST_ASSERT_EQUAL_UINT32(N_STRONG, count_strong());
    TEST_ASSERT_EQUAL_UINT32(2 * N_STRONG, n_found);
    /* Best score first. */
    for (uint32_t i = 0; i < N_STRONG; i++) {
        TEST_ASSERT_TRUE(is_strong_square((int)found[i].x_px, (int)found[i].y_px));
    }

    params.max_junctions = N_STRONG;
    make(SIDE, &params);
    detect(SIDE);
    TEST_ASSERT_EQUAL_UINT32(N_STRONG, n_found);
    TEST_ASSERT_TRUE(count_strong() >= N_STRONG * 9 / 10);
}

static void a_limit_leaves_no_part_of_the_picture_out(void)
{
    oc_judoca_params_t params = oc_judoca_defaults();
    const uint32_t limits[] = {32, 48, 64, 100, 128, 200};
    for (int i = 0; i < 6; i++) {
        params.max_junctions = limits[i];
        render_squares(4);
        make(SIDE, &params);
        detect(SIDE);
        TEST_ASSERT_EQUAL_UINT32(limits[i], n_found);
        uint32_t in_quarter[16] = {0};
        for (uint32_t k = 0; k < n_found; k++) {
            in_quarter[(int)found[k].y_px * 4 / SIDE * 4 + (int)found[k].x_px * 4 / SIDE]++;
        }
        char text[64];
        for (int q = 0; q < 16; q++) {
            (void)snprintf(text, sizeof text, "%u of %u in sixteenth %d", (unsigned)in_quarter[q], (unsigned)n_found,
                           q);
            TEST_ASSERT_TRUE_MESSAGE(in_quarter[q] >= limits[i] / 16 / 4 + 1, text);
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(t_junctions_are_named_and_their_bar_is_marked);
    RUN_TEST(a_limit_keeps_the_corners_of_higher_contrast);
    RUN_TEST(a_limit_leaves_no_part_of_the_picture_out);
    return UNITY_END();
}
