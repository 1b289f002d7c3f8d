/* SPDX-License-Identifier: BSD-3-Clause
 * What the tests of the vehicle share: a small rendered site, a vehicle between
 * canaries, frames to push, packets to pull and requests to make. */
#ifndef OUTCROP_UNIT_VEHICLE_RIG_H
#define OUTCROP_UNIT_VEHICLE_RIG_H

#include "unity.h"

#include <stdlib.h>
#include <string.h>

#include "core/plane.h"
#include "ground_scene.h"
#include "thesis_tables.h"
#include "vehicle/vehicle.h"

#define WIDTH 320u
#define HEIGHT 240u
#define N_VIEWS 5
#define CANARY_BYTES 4096u

static oc_scene_t scene;
static oc_camera_t cameras[N_VIEWS];
static uint8_t pixels[N_VIEWS][WIDTH * HEIGHT];
static uint8_t colours[N_VIEWS][3 * WIDTH * HEIGHT];

static oc_vehicle_config_t config;
static oc_vehicle_t *vehicle;
static uint8_t *block; /* canary, vehicle, canary */
static size_t block_bytes;

static inline void scene_make(void)
{
    scene = (oc_scene_t){.cell_m = 0.06, .n_boxes = 2};
    for (int b = 0; b < 2; b++) {
        for (int k = 0; k < 3; k++) {
            scene.box_min_m[b][k] = table_7_4_min_mm[b][k] / 1000.0;
            scene.box_max_m[b][k] = table_7_4_max_mm[b][k] / 1000.0;
        }
        scene.box_min_m[b][2] = 0.0;
    }
    for (int i = 0; i < N_VIEWS; i++) {
        cameras[i] = oc_test_camera(&table_7_3, 2 + i);
        cameras[i].k = oc_intrinsics_from_format(table_7_3.focal_mm, OC_TEST_FORMAT_WIDTH_MM, OC_TEST_FORMAT_HEIGHT_MM,
                                                 WIDTH, HEIGHT);
        (void)oc_scene_render(&scene, &cameras[i], pixels[i]);
        for (uint32_t p = 0; p < WIDTH * HEIGHT; p++) memset(&colours[i][3 * p], pixels[i][p], 3);
    }
}

static inline void vehicle_start(void)
{
    free(block);
    block_bytes = oc_vehicle_size(&config);
    TEST_ASSERT_TRUE(block_bytes > 0);
    const size_t rounded = (block_bytes + 63u) / 64u * 64u;
    block = aligned_alloc(64, rounded + 2u * CANARY_BYTES);
    TEST_ASSERT_NOT_NULL(block);
    memset(block, 0xa5, rounded + 2u * CANARY_BYTES);
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_init(&config, block + CANARY_BYTES, block_bytes, &vehicle));
}

static inline void canaries_check(void)
{
    for (size_t i = 0; i < CANARY_BYTES; i++) {
        TEST_ASSERT_EQUAL_HEX8(0xa5, block[i]);
        TEST_ASSERT_EQUAL_HEX8(0xa5, block[CANARY_BYTES + block_bytes + i]);
    }
}

static inline void rig_set_up(void)
{
    config = oc_vehicle_defaults();
    config.vehicle = 7;
    config.max_width_px = WIDTH;
    config.max_height_px = HEIGHT;
    config.stored_views = 4;
    config.datagram_bytes = 600;
    vehicle_start();
}

static inline oc_frame_t frame_of(int i)
{
    oc_frame_t frame = {.image = {pixels[i], WIDTH, HEIGHT, WIDTH, 1},
                        .camera = cameras[i],
                        .utime_us = 1700000000000000 + 1000000 * i,
                        .is_forced = true};
    for (int k = 0; k < 3; k++) {
        frame.margin.v[k] = 0.01;
        frame.margin.v[3 + k] = OC_TEST_RAD(1.0);
    }
    return frame;
}

static inline oc_push_report_t push(int i)
{
    const oc_frame_t frame = frame_of(i);
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_TRUE(report.is_keyframe);
    return report;
}

static inline uint32_t counter(oc_counter_t which)
{
    oc_vehicle_status_t status = {0};
    oc_vehicle_get_status(vehicle, &status);
    return status.counters[which];
}

/* One datagram, or 0 bytes. */
static inline size_t next(uint8_t buf[OC_MAX_DATAGRAM_BYTES], oc_packet_head_t *head)
{
    size_t n_bytes = 999999;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_next(vehicle, buf, OC_MAX_DATAGRAM_BYTES, &n_bytes));
    TEST_ASSERT_TRUE(n_bytes <= config.datagram_bytes);
    if (n_bytes == 0) return 0;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_head(buf, n_bytes, head));
    TEST_ASSERT_EQUAL(7, head->vehicle);
    return n_bytes;
}

static inline uint32_t drain(void)
{
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    uint32_t n = 0;
    while (next(buf, &head) > 0) n++;
    return n;
}

static inline oc_status_t ask_resend(uint16_t view, uint32_t parts)
{
    const oc_packet_head_t head = {.type = OC_PACKET_RESEND_REQUEST, .vehicle = 7};
    const oc_resend_request_t request = {.view = view, .parts = parts};
    uint8_t buf[64];
    size_t n_bytes;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_resend(&head, &request, buf, sizeof buf, &n_bytes));
    return oc_vehicle_handle(vehicle, buf, n_bytes);
}

static inline oc_status_t ask_patch(uint16_t view, uint8_t quality, uint16_t first, uint16_t n)
{
    const oc_packet_head_t head = {.type = OC_PACKET_PATCH_REQUEST, .vehicle = 7};
    oc_patch_request_t request = {.view = view, .quality = quality, .n_blocks = n};
    for (uint16_t i = 0; i < n; i++) request.blocks[i] = (uint16_t)(first + i);
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes;
    uint16_t taken;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_patch_request(&head, &request, buf, sizeof buf, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(n, taken);
    return oc_vehicle_handle(vehicle, buf, n_bytes);
}

#endif
