/* SPDX-License-Identifier: BSD-3-Clause
 * What the tests of the ground filter share: four rendered views of two boxes with their junctions. Include once, in a
 * test's own file. */
#ifndef OUTCROP_UNIT_GROUND_RIG_H
#define OUTCROP_UNIT_GROUND_RIG_H

#include "unity.h"

#include <stdlib.h>
#include <string.h>

#include "core/homography.h"
#include "core/plane.h"
#include "ground_scene.h"
#include "thesis_tables.h"
#include "vehicle/ground.h"
#include "vehicle/judoca.h"

#define N_VIEWS 4
#define WIDTH 640u
#define HEIGHT 480u

/* The two obstacles of table 7.4 seen from rows d, e, f, g of table 7.3. */
static oc_scene_t scene;
static oc_camera_t cameras[N_VIEWS];
static uint8_t pixels[N_VIEWS][WIDTH * HEIGHT];
static oc_junction_t junctions[N_VIEWS][OC_MAX_JUNCTIONS];
static uint32_t n_junctions[N_VIEWS];

static oc_ground_ws_t ws;
static oc_ground_params_t params;
static oc_ground_votes_t votes[N_VIEWS][OC_MAX_JUNCTIONS];
static oc_test_random_t random_;
static float worth[OC_GROUND_CELLS];

static oc_judoca_ws_t judoca;
static void *judoca_block;

static inline void detect(const uint8_t *px, oc_junction_t out[], uint32_t *n)
{
    const oc_image_t image = {px, WIDTH, HEIGHT, WIDTH, 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_detect(&judoca, &image, out, OC_MAX_JUNCTIONS, n));
}

static inline void scene_make(void)
{
    scene = (oc_scene_t){.ground_z_m = 0.0, .cell_m = 0.04, .n_boxes = 2};
    for (int b = 0; b < 2; b++) {
        for (int k = 0; k < 3; k++) {
            scene.box_min_m[b][k] = table_7_4_min_mm[b][k] / 1000.0;
            scene.box_max_m[b][k] = table_7_4_max_mm[b][k] / 1000.0;
        }
        scene.box_min_m[b][2] = 0.0;
    }
    oc_judoca_params_t detection = oc_judoca_defaults();
    const size_t n_bytes = oc_judoca_size_bytes(WIDTH, HEIGHT, &detection) + OC_ARENA_ALIGN;
    judoca_block = malloc(n_bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, judoca_block, n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_init(&judoca, &arena, WIDTH, HEIGHT, &detection));
    for (int i = 0; i < N_VIEWS; i++) {
        cameras[i] = oc_test_camera(&table_7_3, 3 + i);
        (void)oc_scene_render(&scene, &cameras[i], pixels[i]);
        detect(pixels[i], junctions[i], &n_junctions[i]);
    }
}

void setUp(void)
{
    params = oc_ground_defaults();
    random_ = oc_test_random_from(20041);
    memset(votes, 0, sizeof votes);
}

void tearDown(void) {}

static inline oc_ground_view_t view_of(int i, double margin_m, double margin_rad)
{
    oc_ground_view_t view = {.view = (uint16_t)i,
                             .grey = {pixels[i], WIDTH, HEIGHT, WIDTH, 1},
                             .camera = cameras[i],
                             .junctions = junctions[i],
                             .n_junctions = n_junctions[i]};
    for (int k = 0; k < 3; k++) {
        view.margin.v[k] = margin_m;
        view.margin.v[3 + k] = margin_rad;
    }
    return view;
}

/* The pose as a sensor with that margin would report it. */
static inline void perturb(oc_ground_view_t *view)
{
    oc_pose6_t six;
    oc_pose_to_6(&view->camera.pose, &six);
    for (int k = 0; k < 6; k++) six.v[k] += oc_test_uniform(&random_, -1.0, 1.0) * view->margin.v[k];
    oc_pose_from_6(&six, &view->camera.pose);
}

#endif
