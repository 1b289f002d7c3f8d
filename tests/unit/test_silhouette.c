/* SPDX-License-Identifier: BSD-3-Clause
 * Silhouettes of two boxes of the thesis' second scene, ray-cast, against what the rays really hit. */
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground_scene.h"
#include "thesis_tables.h"
#include "vehicle/silhouette.h"
#include "vehicle/silhouette_internal.h"

#define N_VIEWS 8
#define WIDTH 640u
#define HEIGHT 480u

static oc_scene_t scene;
static oc_sight_t sights[N_VIEWS], others[N_VIEWS];
static uint8_t pixels[N_VIEWS][WIDTH * HEIGHT];
static uint8_t changed[N_VIEWS][WIDTH * HEIGHT];
static oc_ground_box_t boxes[2];
static oc_silhouette_ws_t ws;
static void *block;
static size_t block_bytes;

static void scene_make(void)
{
    scene = (oc_scene_t){.ground_z_m = 0.0, .cell_m = 0.04, .n_boxes = 2};
    for (int b = 0; b < 2; b++) {
        double size[3];
        for (int k = 0; k < 3; k++) {
            scene.box_min_m[b][k] = table_7_4_min_mm[b][k] / 1000.0;
            scene.box_max_m[b][k] = table_7_4_max_mm[b][k] / 1000.0;
        }
        scene.box_min_m[b][2] = 0.0;
        for (int k = 0; k < 3; k++) size[k] = scene.box_max_m[b][k] - scene.box_min_m[b][k];
        boxes[b] = (oc_ground_box_t){.x_m = (scene.box_min_m[b][0] + scene.box_max_m[b][0]) / 2.0,
                                     .y_m = (scene.box_min_m[b][1] + scene.box_max_m[b][1]) / 2.0,
                                     .length_m = size[0],
                                     .width_m = size[1],
                                     .height_m = size[2],
                                     .is_subject = true};
    }
    for (int i = 0; i < N_VIEWS; i++) {
        sights[i].camera = oc_test_camera(&table_7_3, i);
        sights[i].image = oc_scene_render(&scene, &sights[i].camera, pixels[i]);
    }
    block_bytes = oc_silhouette_size_bytes(WIDTH, HEIGHT) + OC_ARENA_ALIGN;
    block = malloc(block_bytes);
}

void setUp(void)
{
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, block, block_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_silhouette_init(&ws, &arena, WIDTH, HEIGHT));
    TEST_ASSERT_TRUE(arena.used <= block_bytes);
}

void tearDown(void) {}

/* The views but i. */
static uint32_t others_of(const oc_sight_t from[N_VIEWS], int i)
{
    uint32_t n = 0;
    for (int k = 0; k < N_VIEWS; k++) {
        if (k != i) others[n++] = from[k];
    }
    return n;
}

typedef struct tally {
    uint32_t n_obstacle, n_lost, n_ground, n_false, n_unknown;
} tally_t;

/* Against the rays, inside the projection and 2 px off every border between labels. */
static void tally_add(const oc_sight_t *view, const oc_silhouette_task_t *task, const oc_pixel_rect_t *rect,
                      const uint8_t *labels, tally_t *t)
{
    oc_hull_t hull;
    TEST_ASSERT_TRUE(oc_hull_of_box(&task->boxes[task->subject], task->grow, &view->camera, &hull));
    const uint32_t w = rect->x1 - rect->x0;
    for (uint32_t y = rect->y0; y < rect->y1; y++) {
        for (uint32_t x = rect->x0; x < rect->x1; x++) {
            if (!oc_hull_contains(&hull, x, y)) continue;
            const oc_junction_t here = {.x_px = (float)x, .y_px = (float)y};
            const oc_label_t truth = oc_scene_truth(&scene, &view->camera, &here);
            double point[3];
            const bool is_box = oc_scene_hit(&scene, &view->camera, x, y, point) >= 8;
            if (is_box != (truth == OC_LABEL_OBSTACLE)) continue;
            const uint8_t label = labels[(size_t)(y - rect->y0) * w + (x - rect->x0)];
            TEST_ASSERT_TRUE(label <= 2);
            t->n_unknown += label == OC_LABEL_UNKNOWN;
            t->n_obstacle += is_box;
            t->n_ground += !is_box;
            t->n_lost += is_box && label == OC_LABEL_GROUND;
            t->n_false += !is_box && label == OC_LABEL_OBSTACLE;
        }
    }
}

static tally_t find_all(const oc_sight_t from[N_VIEWS], double grow)
{
    tally_t tally = {0};
    int n_found = 0;
    for (int i = 0; i < N_VIEWS; i++) {
        const uint32_t n = others_of(from, i);
        for (uint32_t b = 0; b < 2; b++) {
            const oc_silhouette_task_t task = {.boxes = boxes, .n_boxes = 2, .subject = b, .grow = grow};
            oc_pixel_rect_t rect;
            const uint8_t *labels;
            const oc_status_t status = oc_silhouette_find(&ws, &from[i], others, n, &task, &rect, &labels);
            if (status == OC_E_DEGENERATE) continue;
            TEST_ASSERT_EQUAL(OC_OK, status);
            tally_add(&from[i], &task, &rect, labels, &tally);
            n_found++;
        }
    }
    TEST_ASSERT_TRUE(n_found >= 12);
    return tally;
}

static void obstacles_are_kept_and_open_ground_is_ground(void)
{
    const tally_t t = find_all(sights, 0.15);
    printf("obstacle %u px, lost %.2f %%; ground %u px, taken for obstacle %.2f %%; unknown %.1f %%\n", t.n_obstacle,
           100.0 * t.n_lost / t.n_obstacle, t.n_ground, 100.0 * t.n_false / t.n_ground,
           100.0 * t.n_unknown / (t.n_obstacle + t.n_ground));
    TEST_ASSERT_TRUE(t.n_lost * 50u <= t.n_obstacle);
    TEST_ASSERT_TRUE(t.n_false * 12u <= t.n_ground);
    TEST_ASSERT_TRUE(t.n_unknown * 5u < 3u * (t.n_obstacle + t.n_ground));
}

/* Exposure up and down between the views: the labels hardly change. */
static void light_that_changes_from_view_to_view_is_evened(void)
{
    oc_sight_t lit[N_VIEWS];
    for (int i = 0; i < N_VIEWS; i++) {
        lit[i] = sights[i];
        lit[i].image.px = changed[i];
        const double gain = i % 2 ? 0.7 : 1.1, offset = 8.0 * (i % 3);
        for (uint32_t p = 0; p < WIDTH * HEIGHT; p++) {
            const double v = pixels[i][p] * gain + offset;
            changed[i][p] = (uint8_t)(v > 255.0 ? 255.0 : v);
        }
    }
    const tally_t t = find_all(lit, 0.15);
    TEST_ASSERT_TRUE(t.n_lost * 33u <= t.n_obstacle);
    TEST_ASSERT_TRUE(t.n_false * 8u <= t.n_ground);
}

/* Ground without obstacles: nothing may be seen standing, however large the box that is asked about. */
static void empty_ground_is_ground_or_unknown(void)
{
    oc_sight_t bare[N_VIEWS];
    const oc_scene_t full = scene;
    scene.n_boxes = 0;
    for (int i = 0; i < N_VIEWS; i++) {
        bare[i] = sights[i];
        bare[i].image = oc_scene_render(&scene, &bare[i].camera, changed[i]);
    }
    const tally_t t = find_all(bare, 0.5);
    scene = full;
    TEST_ASSERT_EQUAL(0, t.n_obstacle);
    TEST_ASSERT_TRUE(t.n_ground > 10000);
    TEST_ASSERT_TRUE(t.n_false * 100u <= t.n_ground);
}

/* No other view, only the view itself, only one beside it: nothing can be told, so nothing is. */
static void without_parallax_all_is_unknown(void)
{
    const oc_silhouette_task_t task = {.boxes = boxes, .n_boxes = 2, .subject = 0, .grow = 0.1};
    oc_sight_t beside = sights[6];
    beside.camera.pose.t[0] += 0.001;
    const oc_sight_t same[2] = {sights[6], beside};
    for (uint32_t n = 0; n <= 2; n++) {
        oc_pixel_rect_t rect;
        const uint8_t *labels;
        TEST_ASSERT_EQUAL(OC_OK, oc_silhouette_find(&ws, &sights[6], same, n, &task, &rect, &labels));
        oc_hull_t hull;
        TEST_ASSERT_TRUE(oc_hull_of_box(&boxes[0], 0.1, &sights[6].camera, &hull));
        for (uint32_t y = rect.y0; y < rect.y1; y++) {
            for (uint32_t x = rect.x0; x < rect.x1; x++) {
                if (!oc_hull_contains(&hull, x, y)) continue;
                TEST_ASSERT_EQUAL(OC_LABEL_UNKNOWN, labels[(y - rect.y0) * (rect.x1 - rect.x0) + (x - rect.x0)]);
            }
        }
    }
}

static void the_thesis_votes_leave_nothing_unknown(void)
{
    const uint32_t n = others_of(sights, 6);
    oc_silhouette_task_t task = {.boxes = boxes, .n_boxes = 2, .subject = 0, .grow = 0.1};
    task.method = OC_SILHOUETTE_THESIS;
    oc_pixel_rect_t rect;
    const uint8_t *labels;
    TEST_ASSERT_EQUAL(OC_OK, oc_silhouette_find(&ws, &sights[6], others, n, &task, &rect, &labels));
    const size_t n_px = (size_t)(rect.x1 - rect.x0) * (rect.y1 - rect.y0);
    size_t n_obstacle = 0;
    for (size_t i = 0; i < n_px; i++) {
        TEST_ASSERT_TRUE(labels[i] != OC_LABEL_UNKNOWN);
        n_obstacle += labels[i] == OC_LABEL_OBSTACLE;
    }
    TEST_ASSERT_TRUE(n_obstacle > n_px / 10);
}

static void boxes_that_are_not_in_sight_say_so(void)
{
    const uint32_t n = others_of(sights, 0);
    oc_ground_box_t far[1] = {boxes[0]};
    oc_silhouette_task_t task = {.boxes = far, .n_boxes = 1};
    oc_pixel_rect_t rect = {7, 7, 7, 7};
    const uint8_t *labels = NULL;
    far[0].x_m = 500.0; /* beside the image */
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_silhouette_find(&ws, &sights[0], others, n, &task, &rect, &labels));
    double centre[3];
    oc_pose_centre(&sights[0].camera.pose, centre);
    far[0].x_m = centre[0], far[0].y_m = centre[1], far[0].height_m = 2.0 * centre[2]; /* round the camera */
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_silhouette_find(&ws, &sights[0], others, n, &task, &rect, &labels));
    TEST_ASSERT_TRUE(labels == NULL && rect.x0 == 7);
    task.subject = 1;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_silhouette_find(&ws, &sights[0], others, n, &task, &rect, &labels));
    task.subject = 0, task.grow = NAN;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_silhouette_find(&ws, &sights[0], others, n, &task, &rect, &labels));
}

static void spans_of_a_hull_are_what_its_edges_say(void)
{
    uint32_t seed = 77;
    for (int i = 0; i < 200; i++) {
        oc_ground_box_t box = boxes[i % 2];
        seed = oc_scene_hash((int32_t)seed, i, 3);
        box.yaw_rad = (seed % 1000u) * 0.00314;
        box.height_m *= 0.2 + (seed >> 10) % 100u * 0.02;
        oc_hull_t hull;
        if (!oc_hull_of_box(&box, 0.1, &sights[i % N_VIEWS].camera, &hull)) continue;
        oc_pixel_rect_t rect;
        if (!oc_hull_rect(&hull, WIDTH, HEIGHT, &rect)) continue;
        for (uint32_t y = rect.y0; y < rect.y1; y++) {
            double from, to;
            const bool is_any = oc_hull_span(&hull, y, &from, &to);
            for (uint32_t x = rect.x0; x < rect.x1; x += 3) {
                const bool is_in = is_any && x >= from && x <= to;
                TEST_ASSERT_EQUAL(oc_hull_contains(&hull, x, y), is_in);
            }
        }
    }
}

static void cells_say_what_most_of_their_pixels_say(void)
{
    const oc_pixel_rect_t rect = {3, 2, 9, 6};
    const uint8_t labels[24] = {2, 2, 2, 2, 2, 2, 2, 2, 2, 2, 1, 1, 0, 0, 0, 2, 1, 2, 0, 0, 0, 2, 2, 1};
    uint8_t cells[24];
    oc_silhouette_t out = {.view = 4, .key = 9, .box = 1};
    oc_silhouette_to_cells(&rect, labels, 2, &out, cells);
    TEST_ASSERT_TRUE(out.view == 4 && out.key == 9 && out.box == 1 && out.step_px == 2);
    TEST_ASSERT_TRUE(out.col == 1 && out.row == 1 && out.n_cols == 4 && out.n_rows == 2);
    const uint8_t expected[8] = {2, 2, 2, 1, 0, 0, 2, 1};
    TEST_ASSERT_EQUAL_MEMORY(expected, cells, sizeof expected);
}

static void the_room_is_as_large_as_is_said(void)
{
    const uint32_t sizes[][2] = {{32, 32}, {33, 65}, {640, 480}, {1921, 1081}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        const size_t n_bytes = oc_silhouette_size_bytes(sizes[i][0], sizes[i][1]);
        uint8_t *room = aligned_alloc(64, n_bytes);
        oc_arena_t arena;
        oc_silhouette_ws_t made;
        TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, room, n_bytes));
        TEST_ASSERT_EQUAL(OC_OK, oc_silhouette_init(&made, &arena, sizes[i][0], sizes[i][1]));
        TEST_ASSERT_EQUAL_size_t(n_bytes, arena.used);
        free(room);
    }
}

int main(void)
{
    scene_make();
    UNITY_BEGIN();
    RUN_TEST(obstacles_are_kept_and_open_ground_is_ground);
    RUN_TEST(light_that_changes_from_view_to_view_is_evened);
    RUN_TEST(empty_ground_is_ground_or_unknown);
    RUN_TEST(without_parallax_all_is_unknown);
    RUN_TEST(the_thesis_votes_leave_nothing_unknown);
    RUN_TEST(boxes_that_are_not_in_sight_say_so);
    RUN_TEST(spans_of_a_hull_are_what_its_edges_say);
    RUN_TEST(cells_say_what_most_of_their_pixels_say);
    RUN_TEST(the_room_is_as_large_as_is_said);
    free(block);
    return UNITY_END();
}
