/* SPDX-License-Identifier: BSD-3-Clause
 * A vehicle that is asked for silhouettes and textures of the views it holds. */
#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ground_scene.h"
#include "thesis_tables.h"
#include "vehicle/arena.h"
#include "vehicle/vehicle.h"

#define N_VIEWS 8
#define WIDTH 640u
#define HEIGHT 480u

static oc_scene_t scene;
static oc_camera_t cameras[N_VIEWS];
static uint8_t pixels[N_VIEWS][WIDTH * HEIGHT];
static oc_vehicle_config_t config;
static oc_vehicle_t *vehicle;
static uint8_t *block;
static size_t block_bytes;
static uint8_t labels[OC_MAX_SILHOUETTE_CELLS], buf[OC_MAX_DATAGRAM_BYTES];

static void scene_make(void)
{
    scene = (oc_scene_t){.ground_z_m = 0.0, .cell_m = 0.04, .n_boxes = 2};
    for (int b = 0; b < 2; b++) {
        for (int k = 0; k < 3; k++) {
            scene.box_min_m[b][k] = k == 2 ? 0.0 : table_7_4_min_mm[b][k] / 1000.0;
            scene.box_max_m[b][k] = table_7_4_max_mm[b][k] / 1000.0;
        }
    }
    for (int i = 0; i < N_VIEWS; i++) {
        cameras[i] = oc_test_camera(&table_7_3, i);
        (void)oc_scene_render(&scene, &cameras[i], pixels[i]);
    }
}

static void drain(void)
{
    size_t n_bytes = 1;
    while (n_bytes > 0) {
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_next(vehicle, buf, sizeof buf, &n_bytes));
    }
}

/* View 10 i with a reported centre that is off by so much along X. */
static void push(int i, double off_m)
{
    oc_frame_t frame = {.image = {pixels[i], WIDTH, HEIGHT, WIDTH, 1},
                        .camera = cameras[i],
                        .utime_us = 1000000 * (i + 1),
                        .has_view_id = true,
                        .view_id = (uint16_t)(10 * i),
                        .is_forced = true};
    double centre[3];
    oc_pose_centre(&cameras[i].pose, centre);
    centre[0] += off_m;
    oc_pose_from_centre(cameras[i].pose.R, centre, &frame.camera.pose);
    for (int k = 0; k < 6; k++) frame.margin.v[k] = k < 3 ? 0.01 : 0.017;
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
}

void setUp(void)
{
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_init(&config, block, block_bytes, &vehicle));
    for (int i = 0; i < N_VIEWS; i++) push(i, 0.0);
    drain();
}

void tearDown(void) {}

static oc_silhouette_request_t request_for_all(void)
{
    oc_silhouette_request_t r = {.step_px = 2, .grow_percent = 15, .n_boxes = 2, .n_views = N_VIEWS};
    for (int b = 0; b < 2; b++) {
        r.boxes[b] = (oc_ground_box_t){.x_m = (scene.box_min_m[b][0] + scene.box_max_m[b][0]) / 2.0,
                                       .y_m = (scene.box_min_m[b][1] + scene.box_max_m[b][1]) / 2.0,
                                       .length_m = scene.box_max_m[b][0] - scene.box_min_m[b][0],
                                       .width_m = scene.box_max_m[b][1] - scene.box_min_m[b][1],
                                       .height_m = scene.box_max_m[b][2],
                                       .is_subject = true};
    }
    for (int i = 0; i < N_VIEWS; i++) r.views[i] = (oc_pose_step_t){.view = (uint16_t)(10 * i), .is_wanted = true};
    return r;
}

static oc_status_t ask(const oc_silhouette_request_t *r, uint16_t *key)
{
    const oc_packet_head_t head = {.vehicle = config.vehicle};
    uint8_t packet[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_silhouette_request(&head, r, packet, sizeof packet, &n_bytes, key));
    return oc_vehicle_handle(vehicle, packet, n_bytes);
}

/* Takes all silhouettes; a bit for each view and box. */
static uint32_t take_all(uint16_t key, uint32_t *n_obstacle_cells)
{
    uint32_t got = 0;
    for (;;) {
        size_t n_bytes = 0;
        oc_silhouette_t s;
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_next(vehicle, buf, sizeof buf, &n_bytes));
        if (n_bytes == 0) return got;
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_silhouette(buf, n_bytes, &s, labels, sizeof labels));
        TEST_ASSERT_TRUE(s.key == key && s.view % 10 == 0 && s.box < 2);
        const uint32_t bit = 1u << (s.view / 10u * 2u + s.box);
        TEST_ASSERT_EQUAL_MESSAGE(0, got & bit, "the same silhouette twice");
        got |= bit;
        for (uint32_t i = 0; i < (uint32_t)s.n_cols * s.n_rows; i++)
            *n_obstacle_cells += labels[i] == OC_LABEL_OBSTACLE;
    }
}

static void every_box_in_every_wanted_view_is_answered_once(void)
{
    oc_silhouette_request_t r = request_for_all();
    uint16_t key;
    uint32_t n_cells = 0, n_again = 0;
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key));
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key)); /* a duplicate joins the one that waits */
    TEST_ASSERT_EQUAL_HEX32(0xffffu, take_all(key, &n_cells));
    TEST_ASSERT_TRUE(n_cells > 10000);
    for (int i = 0; i < N_VIEWS; i++) r.views[i].is_wanted = i == 3;
    r.boxes[0].is_subject = true;
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key));
    TEST_ASSERT_EQUAL_HEX32(3u << 6, take_all(key, &n_again));
    TEST_ASSERT_TRUE(n_again > 0);
}

/* The refined pose comes as a step from the reported one: steps that undo an error give the labels of the truth. */
static void steps_are_taken_from_the_reported_pose(void)
{
    oc_silhouette_request_t r = request_for_all();
    uint16_t key;
    uint32_t n_true = 0, n_off = 0, n_mended = 0;
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key));
    (void)take_all(key, &n_true);
    for (int i = 0; i < N_VIEWS; i++) r.views[i].turn_rad[2] = 0.05 * (i % 2 ? 1 : -1);
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key));
    (void)take_all(key, &n_off);
    TEST_ASSERT_TRUE(n_off > n_true + n_true / 5u); /* ground that does not fit looks like obstacle */

    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_init(&config, block, block_bytes, &vehicle));
    for (int i = 0; i < N_VIEWS; i++) {
        push(i, 0.02 * (i % 3 - 1));
        r.views[i].turn_rad[2] = 0.0;
        r.views[i].move_m[0] = -0.02 * (i % 3 - 1);
    }
    drain();
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key));
    (void)take_all(key, &n_mended);
    TEST_ASSERT_UINT32_WITHIN(n_true / 50u, n_true, n_mended);
}

static void views_that_are_gone_are_counted(void)
{
    oc_silhouette_request_t r = request_for_all();
    uint16_t key;
    uint32_t n_cells = 0;
    r.views[7].view = 77;
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key));
    TEST_ASSERT_EQUAL_HEX32(0x3fffu, take_all(key, &n_cells));
    for (int i = 0; i < N_VIEWS - 1; i++) r.views[i].is_wanted = false;
    TEST_ASSERT_EQUAL(OC_E_STATE, ask(&r, &key));
    oc_vehicle_status_t status;
    oc_vehicle_get_status(vehicle, &status);
    TEST_ASSERT_EQUAL(2, status.counters[OC_COUNT_REQUESTS_GONE]);
}

static void a_box_nobody_sees_is_answered_with_nothing_known(void)
{
    oc_silhouette_request_t r = request_for_all();
    uint16_t key;
    size_t n_bytes;
    oc_silhouette_t s;
    r.n_boxes = 1;
    r.boxes[0].x_m = 900.0;
    for (int i = 1; i < N_VIEWS; i++) r.views[i].is_wanted = false;
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key));
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_next(vehicle, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_silhouette(buf, n_bytes, &s, labels, sizeof labels));
    TEST_ASSERT_TRUE(s.n_cols == 1 && s.n_rows == 1 && labels[0] == OC_LABEL_UNKNOWN);
}

static void more_questions_than_there_is_room_for_are_counted(void)
{
    oc_silhouette_request_t r = request_for_all();
    uint16_t key;
    for (int i = 0; i < 5; i++) {
        r.grow_percent = (uint8_t)(10 + i);
        TEST_ASSERT_EQUAL(i < 4 ? OC_OK : OC_E_SPACE, ask(&r, &key));
    }
    oc_vehicle_status_t status;
    oc_vehicle_get_status(vehicle, &status);
    TEST_ASSERT_EQUAL(1, status.counters[OC_COUNT_REQUESTS_FULL]);
}

static void textures_show_all_until_silhouettes_say_where_the_ground_is(void)
{
    static uint8_t tile[64 * 64 * 3], masked[64 * 64 * 3];
    oc_image_mut_t out = {tile, 64, 64, 192, 3};
    oc_texture_request_t t = {.view = 60, .step_px = 4, .tile_px = 64, .is_masked = true};
    uint32_t n_all = 0, n_solid = 0;
    for (uint16_t i = 0; i < 6; i++) { /* tiles of 256 px: 3 x 2 */
        uint32_t n;
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_texture(vehicle, &t, i, &out, &n));
        n_all += n;
    }
    TEST_ASSERT_EQUAL(WIDTH * HEIGHT, n_all);
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_vehicle_texture(vehicle, &t, 6, &out, &n_all));
    /* Each texel is the mean of 4 x 4 pixels. */
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_texture(vehicle, &t, 0, &out, &n_all));
    for (uint32_t k = 0; k < 500; k++) {
        const uint32_t c = k * 37u % 64u, r = k * 11u % 64u;
        uint32_t sum = 8;
        for (uint32_t p = 0; p < 16; p++) sum += pixels[6][(4u * r + p / 4u) * WIDTH + 4u * c + p % 4u];
        TEST_ASSERT_EQUAL_UINT8(sum / 16u, tile[3u * (64u * r + c) + k % 3u]);
    }

    const oc_silhouette_request_t r = request_for_all();
    uint16_t key;
    uint32_t n_cells = 0;
    TEST_ASSERT_EQUAL(OC_OK, ask(&r, &key));
    (void)take_all(key, &n_cells);
    out.px = masked;
    for (uint16_t i = 0; i < 6; i++) {
        uint32_t n;
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_texture(vehicle, &t, i, &out, &n));
        n_solid += n;
    }
    TEST_ASSERT_TRUE(n_solid > 1000 && n_solid < WIDTH * HEIGHT / 2u);
    t.view = 61;
    TEST_ASSERT_EQUAL(OC_E_STATE, oc_vehicle_texture(vehicle, &t, 0, &out, &n_solid));
}

static void one_that_takes_no_part_refuses(void)
{
    oc_vehicle_config_t without = config;
    without.with_silhouettes = false;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_init(&without, block, block_bytes, &vehicle));
    const oc_silhouette_request_t r = request_for_all();
    uint16_t key;
    TEST_ASSERT_EQUAL(OC_E_FORMAT, ask(&r, &key));
}

int main(void)
{
    scene_make();
    config = oc_vehicle_defaults();
    config.stored_views = N_VIEWS;
    config.keep_colour = false;
    block_bytes = oc_vehicle_size(&config);
    block = aligned_alloc(OC_ARENA_ALIGN, block_bytes);
    UNITY_BEGIN();
    RUN_TEST(every_box_in_every_wanted_view_is_answered_once);
    RUN_TEST(steps_are_taken_from_the_reported_pose);
    RUN_TEST(views_that_are_gone_are_counted);
    RUN_TEST(a_box_nobody_sees_is_answered_with_nothing_known);
    RUN_TEST(more_questions_than_there_is_room_for_are_counted);
    RUN_TEST(textures_show_all_until_silhouettes_say_where_the_ground_is);
    RUN_TEST(one_that_takes_no_part_refuses);
    free(block);
    return UNITY_END();
}
