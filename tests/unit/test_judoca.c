/* SPDX-License-Identifier: BSD-3-Clause
 * The junction detector on exact scenes: place, directions, kind, noise, invariances, limits, and bad input. */
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "edge_scene.h"
#include "vehicle/judoca.h"

#define SEED 568817959u
#define CELL 64
#define BOARD 240

static oc_judoca_ws_t ws;
static void *memory;
static float fine[(BOARD + 2 * EDGE_REACH) * EDGE_SAMPLES * (BOARD + 2 * EDGE_REACH) * EDGE_SAMPLES];
static uint8_t px[BOARD * BOARD];
static oc_junction_t found[OC_MAX_JUNCTIONS];
static uint32_t n_found;
static edge_random_t rng;

static void make(uint32_t width, uint32_t height, const oc_judoca_params_t *params)
{
    free(memory);
    const size_t bytes = oc_judoca_size_bytes(width, height, params);
    TEST_ASSERT_TRUE(bytes > 0);
    memory = malloc(bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, memory, bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_init(&ws, &arena, width, height, params));
}

/* The thesis' setting: all branches of one length. */
static oc_judoca_params_t fixed_length(int32_t lambda_px)
{
    oc_judoca_params_t params = oc_judoca_defaults();
    params.lambda_px = params.lambda_min_px = lambda_px;
    return params;
}

static void detect(uint32_t width, uint32_t height)
{
    const oc_image_t image = {px, width, height, width, 1};
    n_found = UINT32_MAX;
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_detect(&ws, &image, found, OC_MAX_JUNCTIONS, &n_found));
    TEST_ASSERT_TRUE(n_found <= ws.params.max_junctions);
}

/* What every junction must satisfy, whatever the image. */
static void check_shape(uint32_t width, uint32_t height)
{
    for (uint32_t i = 0; i < n_found; i++) {
        const oc_junction_t *j = &found[i];
        TEST_ASSERT_TRUE(j->x_px >= 0 && j->x_px <= (float)(width - 1));
        TEST_ASSERT_TRUE(j->y_px >= 0 && j->y_px <= (float)(height - 1));
        TEST_ASSERT_TRUE(j->score > 0 && (i == 0 || j->score <= found[i - 1].score));
        TEST_ASSERT_TRUE(j->n_branches >= 2 && j->n_branches <= OC_MAX_BRANCHES);
        TEST_ASSERT_EQUAL_UINT8(OC_LABEL_UNKNOWN, j->label);
        for (uint32_t b = 0; b < j->n_branches; b++) {
            TEST_ASSERT_TRUE(j->branch[b].angle_rad >= 0 && (double)j->branch[b].angle_rad < 2 * EDGE_PI);
            TEST_ASSERT_TRUE(b == 0 || j->branch[b].angle_rad >= j->branch[b - 1].angle_rad);
            TEST_ASSERT_TRUE(j->branch[b].strength > 0 && j->branch[b].strength <= 1);
            TEST_ASSERT_TRUE(j->branch[b].length_px > 0);
        }
        for (uint32_t k = 0; k < i; k++) {
            const float dx = j->x_px - found[k].x_px, dy = j->y_px - found[k].y_px;
            TEST_ASSERT_TRUE(dx * dx + dy * dy >= 2.99f * 2.99f);
        }
    }
}

/* Nearest junction to a point, its distance to *gap; NULL when there is none. */
static const oc_junction_t *nearest(double x, double y, double *gap)
{
    const oc_junction_t *best = NULL;
    *gap = 1e9;
    for (uint32_t i = 0; i < n_found; i++) {
        const double d = hypot((double)found[i].x_px - x, (double)found[i].y_px - y);
        if (d < *gap) {
            *gap = d;
            best = &found[i];
        }
    }
    return best;
}

/* Largest deviation of the true directions from the nearest branch, radians. */
static double worst_angle(const oc_junction_t *j, const double angle_rad[], int n)
{
    double worst = 0;
    for (int i = 0; i < n; i++) {
        double least = EDGE_PI;
        for (uint32_t b = 0; b < j->n_branches; b++) {
            least = fmin(least, edge_between((double)j->branch[b].angle_rad, angle_rad[i]));
        }
        worst = fmax(worst, least);
    }
    return worst;
}

static void render_fan(const edge_fan_t *fan)
{
    edge_render(edge_fan_level, fan, CELL, CELL, fine, px);
}

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

static void corners_of_every_kind_are_found_and_named(void)
{
    const struct {
        edge_fan_t fan;
        oc_junction_kind_t kind;
    } cases[] = {
        {{32.3, 31.6, 2, {0.4, 1.97}, {200, 60}}, OC_KIND_L},
        {{31.8, 32.1, 2, {1.0, 3.1}, {40, 120}}, OC_KIND_L},
        {{32.0, 32.5, 3, {0.3, 1.9, 0.3 + EDGE_PI}, {40, 110, 200}}, OC_KIND_T},
        {{31.7, 31.9, 3, {0.5, 2.5, 4.7}, {40, 110, 200}}, OC_KIND_Y},
        {{32.2, 31.5, 4, {0.2, 1.7, 0.2 + EDGE_PI, 1.7 + EDGE_PI}, {60, 190, 60, 190}}, OC_KIND_X},
    };
    const oc_judoca_params_t params = oc_judoca_defaults();
    make(CELL, CELL, &params);
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        render_fan(&cases[i].fan);
        detect(CELL, CELL);
        TEST_ASSERT_EQUAL_UINT32(1, n_found);
        TEST_ASSERT_EQUAL_UINT8(cases[i].kind, found[0].kind);
        TEST_ASSERT_EQUAL_UINT8(cases[i].fan.n, found[0].n_branches);
        TEST_ASSERT_DOUBLE_WITHIN(0.06, cases[i].fan.x_px, (double)found[0].x_px);
        TEST_ASSERT_DOUBLE_WITHIN(0.06, cases[i].fan.y_px, (double)found[0].y_px);
        TEST_ASSERT_TRUE(worst_angle(&found[0], cases[i].fan.angle_rad, cases[i].fan.n) < 0.009);
        check_shape(CELL, CELL);
    }
}

static void straight_edges_and_lines_are_no_junctions(void)
{
    const oc_judoca_params_t params = oc_judoca_defaults();
    make(CELL, CELL, &params);
    for (int i = 0; i < 24; i++) {
        const double a = 0.01 + i * EDGE_PI / 24;
        const edge_fan_t edge = {31.7, 32.2, 2, {a, a + EDGE_PI}, {60, 180}};
        render_fan(&edge);
        detect(CELL, CELL);
        TEST_ASSERT_EQUAL_UINT32(0, n_found);
    }
    memset(px, 90, sizeof px);
    for (int y = 0; y < CELL; y++) px[y * CELL + 30] = px[y * CELL + 31] = 200;
    detect(CELL, CELL);
    TEST_ASSERT_EQUAL_UINT32(0, n_found);
}

/* One fan of random sectors, contrasts 40 to 120 grey levels, angles from 45 degrees. */
static edge_fan_t random_fan(void)
{
    edge_fan_t fan = {edge_uniform(&rng, 31.5, 32.5), edge_uniform(&rng, 31.5, 32.5), 0, {0}, {0}};
    const double least = EDGE_PI / 4;
    fan.n = 2 + (int)edge_uniform(&rng, 0, 1.999);
    for (;;) {
        for (int i = 0; i < fan.n; i++) fan.angle_rad[i] = edge_uniform(&rng, 0.01, 6.27);
        for (int i = 1; i < fan.n; i++) {
            for (int k = i; k > 0 && fan.angle_rad[k] < fan.angle_rad[k - 1]; k--) {
                const double swap = fan.angle_rad[k];
                fan.angle_rad[k] = fan.angle_rad[k - 1];
                fan.angle_rad[k - 1] = swap;
            }
        }
        bool good = true;
        for (int i = 0; i < fan.n; i++) {
            const double d = edge_between(fan.angle_rad[i], fan.angle_rad[(i + 1) % fan.n]);
            if (d < least || (fan.n == 2 && d > EDGE_PI - least / 2)) good = false;
        }
        if (good) break;
    }
    fan.level[0] = edge_uniform(&rng, 30, 70);
    fan.level[1] = fan.level[0] + edge_uniform(&rng, 40, 80);
    fan.level[2] = fan.level[1] + edge_uniform(&rng, 40, 80);
    return fan;
}

/* Recall, precision and errors over random fans; the figures that are held. */
static void check_fans(const oc_judoca_params_t *params, double variance, double recall, double precision,
                       double rms_px, double rms_rad)
{
    const int n_fans = 60;
    make(CELL, CELL, params);
    int hits = 0, false_hits = 0;
    double squares = 0, angles = 0;
    for (int i = 0; i < n_fans; i++) {
        const edge_fan_t fan = random_fan();
        render_fan(&fan);
        edge_add_noise(&rng, variance, px, CELL * CELL);
        detect(CELL, CELL);
        double gap;
        const oc_junction_t *j = nearest(fan.x_px, fan.y_px, &gap);
        false_hits += (int)n_found - (gap < 2.0);
        if (gap >= 2.0) continue;
        hits++;
        squares += gap * gap;
        const double worst = worst_angle(j, fan.angle_rad, fan.n);
        if (worst < 0.25) angles += worst * worst;
    }
    char text[160];
    (void)snprintf(text, sizeof text, "seed %u: recall %.3f precision %.3f rms %.3f px, worst branch %.4f rad", SEED,
                   hits / (double)n_fans, hits / (double)(hits + false_hits), sqrt(squares / hits),
                   sqrt(angles / hits));
    printf("variance %.0f, %s\n", variance, text);
    TEST_ASSERT_TRUE_MESSAGE(hits >= recall * n_fans, text);
    TEST_ASSERT_TRUE_MESSAGE(hits >= precision * (hits + false_hits), text);
    TEST_ASSERT_TRUE_MESSAGE(sqrt(squares / hits) <= rms_px, text);
    TEST_ASSERT_TRUE_MESSAGE(sqrt(angles / hits) <= rms_rad, text);
}

static void random_corners_are_found_without_noise(void)
{
    const oc_judoca_params_t grown = oc_judoca_defaults();
    const oc_judoca_params_t fixed = fixed_length(10);
    check_fans(&grown, 0, 0.98, 0.99, 0.06, 0.0052);
    check_fans(&fixed, 0, 0.98, 0.99, 0.06, 0.0052); /* 0.3 degrees */
}

static void random_corners_are_found_in_noise(void)
{
    const oc_judoca_params_t grown = oc_judoca_defaults();
    const oc_judoca_params_t fixed = fixed_length(10);
    check_fans(&grown, 100, 0.97, 0.95, 0.42, 0.055);
    check_fans(&fixed, 100, 0.97, 0.95, 0.50, 0.060);
}

/* Inverse of the map that puts a board of 26 px squares, tilted, into the image. */
static const edge_board_t board = {
    {1.0 / 26, 0.12 / 26, -0.31, -0.09 / 26, 1.05 / 26, 0.27, 0.0003, 0.0005, 1.0}, 60, 190};

/* Image of a board corner: solves board_from_image (x, y, 1) ~ (u, v, 1). */
static void board_corner(double u, double v, double *x, double *y)
{
    const double *h = board.board_from_image;
    const double a = h[0] - u * h[6], b = h[1] - u * h[7], c = u * h[8] - h[2];
    const double d = h[3] - v * h[6], e = h[4] - v * h[7], f = v * h[8] - h[5];
    *x = (c * e - b * f) / (a * e - b * d);
    *y = (a * f - c * d) / (a * e - b * d);
}

static void a_tilted_chessboard_is_located_to_hundredths(void)
{
    edge_render(edge_board_level, &board, BOARD, BOARD, fine, px);
    const oc_judoca_params_t both[] = {oc_judoca_defaults(), fixed_length(10)};
    for (int p = 0; p < 2; p++) {
        make(BOARD, BOARD, &both[p]);
        detect(BOARD, BOARD);
        check_shape(BOARD, BOARD);
        int n = 0;
        double squares = 0, angles = 0;
        for (int v = -2; v < 14; v++) {
            for (int u = -2; u < 14; u++) {
                double x, y, along[2][2], gap;
                board_corner(u, v, &x, &y);
                if (!(x > 14 && y > 14 && x < BOARD - 15 && y < BOARD - 15)) continue;
                board_corner(u + 0.01, v, &along[0][0], &along[0][1]);
                board_corner(u, v + 0.01, &along[1][0], &along[1][1]);
                double angle[4];
                for (int k = 0; k < 4; k++) {
                    const double sign = k < 2 ? 1 : -1;
                    angle[k] = atan2(sign * (along[k % 2][1] - y), sign * (along[k % 2][0] - x)) + 2 * EDGE_PI;
                }
                const oc_junction_t *j = nearest(x, y, &gap);
                TEST_ASSERT_TRUE(gap < 0.15);
                TEST_ASSERT_EQUAL_UINT8(OC_KIND_X, j->kind);
                n++;
                squares += gap * gap;
                const double worst = worst_angle(j, angle, 4);
                angles += worst * worst;
            }
        }
        char text[96];
        (void)snprintf(text, sizeof text, "%d corners: rms %.4f px, worst branch %.4f rad", n, sqrt(squares / n),
                       sqrt(angles / n));
        printf("%s\n", text);
        TEST_ASSERT_TRUE_MESSAGE(n > 40, text);
        TEST_ASSERT_TRUE_MESSAGE(sqrt(squares / n) <= 0.015, text);
        /* Worst of four branches; 0.12 degrees. */
        TEST_ASSERT_TRUE_MESSAGE(sqrt(angles / n) <= 0.0021, text);
    }
}

/* Thesis figure 3.5: the angles of a triangle. */
static void the_angles_of_triangles_sum_to_180_degrees(void)
{
    const struct {
        int32_t lambda_px;
        double mean, spread;
    } cases[] = {{10, 0.4, 0.6}, {15, 0.2, 0.35}};
    for (int c = 0; c < 2; c++) {
        const oc_judoca_params_t params = fixed_length(cases[c].lambda_px);
        make(120, 120, &params);
        double sum = 0, squares = 0;
        int n = 0;
        for (int i = 0; i < 24; i++) {
            edge_triangle_t t = {{0}, {0}, edge_uniform(&rng, 150, 230), edge_uniform(&rng, 30, 90)};
            const double turn = edge_uniform(&rng, 0, 2 * EDGE_PI);
            const double part[3] = {0, edge_uniform(&rng, 1.6, 2.4), edge_uniform(&rng, 3.9, 4.6)};
            for (int k = 0; k < 3; k++) {
                t.x_px[k] = 60 + 42 * cos(turn + part[k]);
                t.y_px[k] = 60 + 42 * sin(turn + part[k]);
            }
            edge_render(edge_triangle_level, &t, 120, 120, fine, px);
            detect(120, 120);
            double total = 0;
            for (int k = 0; k < 3; k++) {
                double gap;
                const oc_junction_t *j = nearest(t.x_px[k], t.y_px[k], &gap);
                TEST_ASSERT_TRUE(gap < 1.0);
                TEST_ASSERT_EQUAL_UINT8(2, j->n_branches);
                total += edge_between((double)j->branch[0].angle_rad, (double)j->branch[1].angle_rad);
            }
            const double off = total * 180 / EDGE_PI - 180;
            sum += off;
            squares += off * off;
            n++;
        }
        char text[96];
        (void)snprintf(text, sizeof text, "seed %u lambda %d: mean %+.2f rms %.2f deg", SEED, cases[c].lambda_px,
                       sum / n, sqrt(squares / n));
        printf("%s\n", text);
        TEST_ASSERT_TRUE_MESSAGE(fabs(sum / n) <= cases[c].mean, text);
        TEST_ASSERT_TRUE_MESSAGE(sqrt(squares / n) <= cases[c].spread, text);
    }
}

/* A picture with many corners of all sorts, not square, width not a multiple of 8. */
static void render_mixed(int width, int height)
{
    edge_render(edge_board_level, &board, width, height, fine, px);
    for (int k = 0; k < 14; k++) {
        const int x0 = (int)edge_uniform(&rng, 5, width - 40), y0 = (int)edge_uniform(&rng, 5, height - 40);
        const int w = (int)edge_uniform(&rng, 9, 30), h = (int)edge_uniform(&rng, 9, 30);
        const uint8_t level = (uint8_t)edge_uniform(&rng, 10, 250);
        for (int y = y0; y < y0 + h; y++) memset(px + y * width + x0, level, (size_t)w);
    }
    edge_add_noise(&rng, 9, px, (size_t)(width * height));
}

/* Share of the junctions a[] that some found[] equals, after mapping. */
static double share_found_again(const oc_junction_t a[], uint32_t n, int width, int height, int turn)
{
    uint32_t same = 0;
    for (uint32_t i = 0; i < n; i++) {
        double x = (double)a[i].x_px, y = (double)a[i].y_px, gap;
        if (turn == 1) x = width - 1 - x;
        if (turn == 2) y = height - 1 - y;
        if (turn == 3) {
            const double swap = x;
            x = height - 1 - y;
            y = swap;
        }
        const oc_junction_t *j = nearest(x, y, &gap);
        same += j && gap < 0.1 && j->n_branches == a[i].n_branches;
    }
    return same / (double)n;
}

static void mirrored_and_turned_images_give_the_same_junctions(void)
{
    enum { WIDE = 203, HIGH = 171 };
    static uint8_t original[WIDE * HIGH];
    static oc_junction_t before[OC_MAX_JUNCTIONS];
    const oc_judoca_params_t params = oc_judoca_defaults();
    render_mixed(WIDE, HIGH);
    memcpy(original, px, sizeof original);
    make(WIDE, HIGH, &params);
    detect(WIDE, HIGH);
    const uint32_t n = n_found;
    memcpy(before, found, sizeof before);
    TEST_ASSERT_TRUE(n > 50);
    for (int turn = 1; turn <= 3; turn++) {
        const int width = turn == 3 ? HIGH : WIDE, height = turn == 3 ? WIDE : HIGH;
        for (int y = 0; y < height; y++) {
            for (int x = 0; x < width; x++) {
                const int from_x = turn == 1 ? WIDE - 1 - x : turn == 3 ? y : x;
                const int from_y = turn == 2 ? HIGH - 1 - y : turn == 3 ? HIGH - 1 - x : y;
                px[y * width + x] = original[from_y * WIDE + from_x];
            }
        }
        make((uint32_t)width, (uint32_t)height, &params);
        detect((uint32_t)width, (uint32_t)height);
        /* Ties of equal magnitude and the tables' rounding fall the other way. */
        TEST_ASSERT_TRUE(share_found_again(before, n, WIDE, HIGH, turn) >= 0.93);
        TEST_ASSERT_UINT32_WITHIN(n / 20 + 2, n, n_found);
    }
}

static void stride_history_and_size_do_not_matter(void)
{
    enum { WIDE = 101, HIGH = 77, STRIDE = 130 };
    static uint8_t padded[STRIDE * HIGH];
    static oc_junction_t before[OC_MAX_JUNCTIONS];
    const oc_judoca_params_t params = oc_judoca_defaults();
    make(WIDE, HIGH, &params);
    render_mixed(WIDE, HIGH);
    detect(WIDE, HIGH);
    const uint32_t n = n_found;
    memcpy(before, found, n * sizeof before[0]);
    TEST_ASSERT_TRUE(n > 5);

    memset(padded, 0xEE, sizeof padded);
    for (int y = 0; y < HIGH; y++) memcpy(padded + y * STRIDE, px + y * WIDE, WIDE);
    for (int i = 0; i < WIDE * HIGH; i++) px[i] = (uint8_t)edge_uniform(&rng, 0, 255);
    detect(WIDE, HIGH);
    const oc_image_t image = {padded, WIDE, HIGH, STRIDE, 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_detect(&ws, &image, found, OC_MAX_JUNCTIONS, &n_found));
    TEST_ASSERT_EQUAL_UINT32(n, n_found);
    TEST_ASSERT_EQUAL_MEMORY(before, found, n * sizeof before[0]);
}

static void caps_hold_and_keep_the_image_covered(void)
{
    oc_judoca_params_t params = oc_judoca_defaults();
    make(BOARD, BOARD, &params);
    render_mixed(BOARD, BOARD);
    detect(BOARD, BOARD);
    const uint32_t all = n_found;
    TEST_ASSERT_TRUE(all > 60);

    const oc_image_t image = {px, BOARD, BOARD, BOARD, 1};
    const uint32_t caps[] = {0, 1, 7, 30};
    for (int i = 0; i < 4; i++) {
        memset(found, 0xCC, sizeof found);
        TEST_ASSERT_EQUAL(OC_OK, oc_judoca_detect(&ws, &image, found, caps[i], &n_found));
        TEST_ASSERT_EQUAL_UINT32(caps[i], n_found);
        TEST_ASSERT_EQUAL_UINT32(all - caps[i], ws.stats.n_dropped);
        TEST_ASSERT_EACH_EQUAL_HEX8(0xCC, &found[caps[i]], sizeof found[0]);
        check_shape(BOARD, BOARD);
    }
    int quarter[4] = {0};
    for (uint32_t i = 0; i < n_found; i++) {
        quarter[(found[i].x_px > BOARD / 2) + 2 * (found[i].y_px > BOARD / 2)]++;
    }
    for (int q = 0; q < 4; q++) TEST_ASSERT_TRUE(quarter[q] >= 3);

    params.max_junctions = 11;
    params.max_candidates = 16;
    make(BOARD, BOARD, &params);
    detect(BOARD, BOARD);
    TEST_ASSERT_TRUE(n_found <= 11 && ws.stats.n_fitted <= 16);
}

static void hostile_images_give_a_list_in_order_or_nothing(void)
{
    const struct {
        uint32_t width, height;
    } sizes[] = {{32, 32}, {33, 47}, {200, 32}, {BOARD, BOARD}};
    for (int s = 0; s < 4; s++) {
        const uint32_t w = sizes[s].width, h = sizes[s].height;
        oc_judoca_params_t params = oc_judoca_defaults();
        for (int kind = 0; kind < 7; kind++) {
            params.lambda_px = kind == 6 ? OC_JUDOCA_MAX_LAMBDA_PX : 10;
            params.lambda_min_px = kind == 5 ? 4 : 6;
            params.t_b = kind == 4 ? 0.0f : 6.0f;
            params.method = kind == 3 ? OC_JUDOCA_THESIS : OC_JUDOCA_REFINED;
            params.min_distance_px = 3.0f;
            make(w, h, &params);
            for (uint32_t i = 0; i < w * h; i++) {
                const uint32_t x = i % w, y = i / w;
                px[i] = (uint8_t)(kind == 0   ? 0
                                  : kind == 1 ? 255
                                  : kind == 2 ? 255 * ((x ^ y) & 1u)
                                              : edge_uniform(&rng, 0, 255.9));
            }
            detect(w, h);
            if (kind < 2) TEST_ASSERT_EQUAL_UINT32(0, n_found);
            if (kind != 3) check_shape(w, h);
        }
    }
}

static void bad_images_are_refused_and_nothing_is_written(void)
{
    const oc_judoca_params_t params = oc_judoca_defaults();
    make(CELL, CELL, &params);
    const oc_image_t bad[] = {{NULL, CELL, CELL, CELL, 1},   {px, CELL, CELL, CELL - 1, 1},
                              {px, CELL - 1, CELL, CELL, 1}, {px, CELL, CELL, 3 * CELL, 3},
                              {px, CELL, CELL + 1, CELL, 1}, {px, 0, 0, 0, 1},
                              {px, 5000, CELL, 5000, 1},     {px, CELL, CELL, CELL, 2}};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        memset(found, 0xCC, sizeof found);
        n_found = 77;
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_judoca_detect(&ws, &bad[i], found, OC_MAX_JUNCTIONS, &n_found));
        TEST_ASSERT_EQUAL_UINT32(77, n_found);
        TEST_ASSERT_EACH_EQUAL_HEX8(0xCC, found, sizeof found);
    }
}

static void bad_parameters_have_no_size_and_no_workspace(void)
{
    const oc_judoca_params_t good = oc_judoca_defaults();
    TEST_ASSERT_TRUE(oc_judoca_params_are_valid(&good));
    TEST_ASSERT_EQUAL_size_t(0, oc_judoca_size_bytes(31, 64, &good));
    TEST_ASSERT_EQUAL_size_t(0, oc_judoca_size_bytes(64, 4097, &good));

    oc_judoca_params_t bad[16];
    for (int i = 0; i < 16; i++) bad[i] = good;
    bad[0].sigma_px = NAN;
    bad[1].t_b = -1.0f;
    bad[2].t_b = NAN;
    bad[3].t_b_noise_k = 0.0f;
    bad[4].s_j = 1.1f;
    bad[5].lambda_px = OC_JUDOCA_MAX_LAMBDA_PX + 1;
    bad[6].lambda_min_px = bad[6].lambda_px + 1;
    bad[7].lambda_min_px = 3;
    bad[8].min_angle_rad = 0.0f;
    bad[9].min_bend_rad = NAN;
    bad[10].max_rms_px = 0.0f;
    bad[11].max_apex_sigma_px = INFINITY;
    bad[12].min_distance_px = 0.5f;
    bad[13].max_junctions = OC_MAX_JUNCTIONS + 1;
    bad[14].max_candidates = 15;
    bad[15].spread_cell_px = 0;
    for (int i = 0; i < 16; i++) {
        oc_judoca_ws_t refused;
        oc_arena_t arena = {NULL, 0, 0};
        TEST_ASSERT_FALSE(oc_judoca_params_are_valid(&bad[i]));
        TEST_ASSERT_EQUAL_size_t(0, oc_judoca_size_bytes(64, 64, &bad[i]));
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_judoca_init(&refused, &arena, 64, 64, &bad[i]));
    }
}

static void a_byte_too_few_is_noticed(void)
{
    const oc_judoca_params_t params = oc_judoca_defaults();
    const size_t bytes = oc_judoca_size_bytes(100, 80, &params);
    memory = malloc(bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, memory, bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_init(&ws, &arena, 100, 80, &params));
    const size_t needed = arena.used;
    TEST_ASSERT_TRUE(needed <= bytes);
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, memory, bytes));
    arena.size = needed - OC_ARENA_ALIGN;
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_judoca_init(&ws, &arena, 100, 80, &params));
}

static void the_thesis_method_gives_whole_pixels_near_the_corners(void)
{
    oc_judoca_params_t params = fixed_length(10);
    params.method = OC_JUDOCA_THESIS;
    params.s_j = 0.5f;
    make(BOARD, BOARD, &params);
    edge_render(edge_board_level, &board, BOARD, BOARD, fine, px);
    detect(BOARD, BOARD);
    int near_a_corner = 0, corners = 0;
    for (int v = -2; v < 14; v++) {
        for (int u = -2; u < 14; u++) {
            double x, y, gap;
            board_corner(u, v, &x, &y);
            if (!(x > 14 && y > 14 && x < BOARD - 15 && y < BOARD - 15)) continue;
            corners++;
            const oc_junction_t *j = nearest(x, y, &gap);
            if (gap < 3.0) near_a_corner++;
            TEST_ASSERT_NOT_NULL(j);
            TEST_ASSERT_EQUAL_FLOAT(floorf(j->x_px), j->x_px);
            TEST_ASSERT_EQUAL_FLOAT(floorf(j->y_px), j->y_px);
        }
    }
    TEST_ASSERT_TRUE(near_a_corner >= corners * 8 / 10);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(corners_of_every_kind_are_found_and_named);
    RUN_TEST(straight_edges_and_lines_are_no_junctions);
    RUN_TEST(random_corners_are_found_without_noise);
    RUN_TEST(random_corners_are_found_in_noise);
    RUN_TEST(a_tilted_chessboard_is_located_to_hundredths);
    RUN_TEST(the_angles_of_triangles_sum_to_180_degrees);
    RUN_TEST(mirrored_and_turned_images_give_the_same_junctions);
    RUN_TEST(stride_history_and_size_do_not_matter);
    RUN_TEST(caps_hold_and_keep_the_image_covered);
    RUN_TEST(hostile_images_give_a_list_in_order_or_nothing);
    RUN_TEST(bad_images_are_refused_and_nothing_is_written);
    RUN_TEST(bad_parameters_have_no_size_and_no_workspace);
    RUN_TEST(a_byte_too_few_is_noticed);
    RUN_TEST(the_thesis_method_gives_whole_pixels_near_the_corners);
    return UNITY_END();
}
