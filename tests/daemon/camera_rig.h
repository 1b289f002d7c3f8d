/* SPDX-License-Identifier: BSD-3-Clause
 * What the tests of cameras share: a source over fake devices, a clock, poses, frames. */
#ifndef OUTCROP_TESTS_DAEMON_CAMERA_RIG_H
#define OUTCROP_TESTS_DAEMON_CAMERA_RIG_H

#include "unity.h"

#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "allocation_guard.h"
#include "camera_source.h"
#include "fake_video.h"

#define WIDTH 64u
#define HEIGHT 48u
#define MS 1000000LL
#define UTC_OFFSET_NS 1700000000000000000LL

static oc_counters_t counters;
static oc_pose_track_t *poses;
static oc_gpio_t *gpio; /* NULL: no lines */
static oc_capture_t *source;
static oc_camera_source_config_t config;
static int64_t now_ns, utc_offset_ns;
static char told[512];
static uint32_t sequence[FCAM_CAMERAS];

static inline void read_clock(int64_t *before_ns, int64_t *utc_ns, int64_t *after_ns)
{
    *before_ns = *after_ns = now_ns;
    *utc_ns = now_ns + utc_offset_ns;
}

static inline void configure(uint32_t n_cameras, oc_pixel_format_t format)
{
    config = (oc_camera_source_config_t){.n_cameras = n_cameras, .has_fixed_margin = true, .pose_wait_ms = 100};
    for (int i = 0; i < 6; i++) config.margin.v[i] = 0.01;
    const oc_intrinsics_t k = {50, 50, 31.5, 23.5, WIDTH, HEIGHT};
    for (uint32_t i = 0; i < n_cameras; i++) {
        oc_camera_config_t *camera = &config.cameras[i];
        *camera = (oc_camera_config_t){.stall_ms = 1000, .retry_ms = 200, .lens = oc_lens_pinhole(&k)};
        snprintf(camera->name, sizeof camera->name, "cam%u", i);
        camera->wish = (oc_video_wish_t){.format = format, .width_px = WIDTH, .height_px = HEIGHT, .n_buffers = 6};
        snprintf(camera->wish.path, sizeof camera->wish.path, "/dev/fake%u", i);
        const double xyz[3] = {0.5, 0, 1}, rpy[3] = {0, 0.3, 0};
        camera->body_from_optical = oc_mount_from_xyzrpy(xyz, rpy);
    }
}

static inline void start(void)
{
    const oc_camera_source_parts_t parts = {
        .video = &fcam_video, .poses = poses, .gpio = gpio, .counters = &counters, .read_clock = read_clock};
    source = oc_camera_source_open(&config, &parts, told, sizeof told);
    TEST_ASSERT_NOT_NULL_MESSAGE(source, told);
}

static inline void rig_set_up(void)
{
    fcam_reset();
    memset(&counters, 0, sizeof counters);
    memset(sequence, 0, sizeof sequence);
    poses = oc_pose_track_create(64, 1000000);
    now_ns = 5000000000;
    utc_offset_ns = UTC_OFFSET_NS;
    source = NULL;
    configure(1, OC_PIXEL_YUYV);
}

static inline void rig_tear_down(void)
{
    if (source) source->close(source);
    oc_pose_track_destroy(poses);
    TEST_ASSERT_EQUAL_STRING("", fcam_account);
    for (int i = 0; i < FCAM_CAMERAS; i++) TEST_ASSERT_EQUAL(fcam_devices[i].n_opened, fcam_devices[i].n_closed);
}

static inline uint32_t count(oc_counter_t counter)
{
    return oc_counters_get(&counters, counter);
}

/* One call; messages are kept in `told`. */
static inline oc_capture_result_t next(oc_captured_t *frame)
{
    return source->next(source, now_ns, frame, told, sizeof told);
}

/* Call until there is neither a frame nor a message; the opener's thread is given time. Frames must not come. */
static inline void settle(void)
{
    for (int i = 0; i < 40; i++) {
        oc_captured_t frame;
        const oc_capture_result_t result = next(&frame);
        TEST_ASSERT_NOT_EQUAL(OC_CAPTURE_FRAME, result);
        if (result == OC_CAPTURE_NONE) usleep(1000);
    }
}

static inline void await_opened(uint32_t n)
{
    for (int i = 0; i < 30000 && count(OC_COUNT_CAMERA_OPENED) < n; i++) {
        oc_captured_t frame;
        if (next(&frame) == OC_CAPTURE_NONE) usleep(1000);
    }
    TEST_ASSERT_EQUAL(n, count(OC_COUNT_CAMERA_OPENED));
    settle();
}

static inline int64_t utime_of(int64_t mono_ns)
{
    return (mono_ns + utc_offset_ns) / 1000;
}

/* The body at x = its time in seconds, level, heading east. */
static inline void add_pose(int64_t mono_ns)
{
    const oc_body_pose_t pose = {
        .utime_us = utime_of(mono_ns), .position_m = {(double)mono_ns * 1e-9, 2, 0}, .q_wxyz = {1, 0, 0, 0}};
    TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(poses, &pose));
}

static inline size_t whole(void)
{
    return oc_pixel_format_bytes(config.cameras[0].wish.format,
                                 config.cameras[0].wish.format == OC_PIXEL_YUYV ? 2 * WIDTH : WIDTH, HEIGHT);
}

static inline fcam_event_t good(int camera, int64_t mono_ns)
{
    return (fcam_event_t){
        .result = OC_VIDEO_FRAME, .sequence = sequence[camera]++, .mono_ns = mono_ns, .n_bytes = whole()};
}

static inline void expect_frame(oc_captured_t *frame)
{
    for (int i = 0; i < 10; i++) {
        const oc_capture_result_t result = next(frame);
        if (result == OC_CAPTURE_FRAME) return;
        TEST_ASSERT_EQUAL_MESSAGE(OC_CAPTURE_ERROR, result, "no frame");
    }
    TEST_FAIL_MESSAGE("messages without end");
}

static inline void run_with_poses(void)
{
    start();
    add_pose(now_ns - 500 * MS);
    add_pose(now_ns + 400 * MS);
    await_opened(1);
}

#endif
