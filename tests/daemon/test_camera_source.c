/* SPDX-License-Identifier: BSD-3-Clause
 * Cameras as a source of frames: what comes out, when, with which pose, and what every fault is counted as. The clock,
 * the devices and the poses are the test's. */
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "allocation_guard.h"
#include "camera_rig.h"

void setUp(void)
{
    rig_set_up();
}

void tearDown(void)
{
    rig_tear_down();
}

/* ---- frames and poses ---- */

static void a_frame_has_the_pose_of_its_own_time_and_the_drivers_own_bytes(void)
{
    config.cameras[0].delay_us = 3000;
    run_with_poses();
    const int64_t exposed_ns = now_ns - 20 * MS;
    fcam_add(0, good(0, exposed_ns));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_EQUAL_INT64(utime_of(exposed_ns) - 3000, frame.utime_us);
    double centre[3];
    oc_pose_centre(&frame.camera.pose, centre);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, (double)exposed_ns * 1e-9 - 0.003 + 0.5, centre[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2, centre[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1, centre[2]);
    TEST_ASSERT_EQUAL_DOUBLE(0.01, frame.margin.v[4]);
    TEST_ASSERT_EQUAL_PTR(fcam_devices[0].bytes[0], frame.raw.px); /* not copied */
    TEST_ASSERT_EQUAL(OC_PIXEL_YUYV, frame.raw.format);
    TEST_ASSERT_EQUAL(2 * WIDTH, frame.raw.stride_bytes);
    TEST_ASSERT_EQUAL(1, fcam_n_held(0));
    settle();
    TEST_ASSERT_EQUAL(0, fcam_n_held(0)); /* given back at the next call */
}

static void nv12_has_its_chroma_below_its_luma(void)
{
    configure(1, OC_PIXEL_NV12);
    run_with_poses();
    fcam_add(0, good(0, now_ns));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_EQUAL_PTR(frame.raw.px + WIDTH * HEIGHT, frame.raw.chroma);
}

static void a_frame_waits_for_its_pose_and_no_longer_than_told(void)
{
    run_with_poses();
    fcam_add(0, good(0, now_ns + 10 * MS)); /* slightly ahead of its time, as drivers are */
    now_ns += 450 * MS;
    fcam_add(0, good(0, now_ns)); /* 50 ms after the last pose */
    oc_captured_t frame;
    expect_frame(&frame);
    settle();
    TEST_ASSERT_EQUAL(1, fcam_n_held(0)); /* the second one waits where it is */
    add_pose(now_ns + 1 * MS);
    expect_frame(&frame);
    TEST_ASSERT_EQUAL_INT64(utime_of(now_ns), frame.utime_us);

    fcam_add(0, good(0, now_ns + 20 * MS));
    now_ns += 20 * MS;
    settle();
    int64_t wake_ns;
    struct pollfd fds[OC_MAX_CAPTURE_FDS];
    TEST_ASSERT_EQUAL(3, source->wait(source, fds, &wake_ns)); /* opener, poses, the camera */
    TEST_ASSERT_EQUAL_INT64(now_ns + 100 * MS, wake_ns);
    now_ns = wake_ns - 1;
    settle();
    TEST_ASSERT_EQUAL(0, count(OC_COUNT_FRAMES_NO_POSE));
    now_ns = wake_ns;
    settle();
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_NO_POSE));
    TEST_ASSERT_EQUAL(0, fcam_n_held(0));
}

static void a_frame_older_than_all_poses_goes_at_once(void)
{
    run_with_poses();
    fcam_add(0, good(0, now_ns - 600 * MS));
    settle();
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_NO_POSE));
}

static void the_oldest_waiting_frame_makes_room(void)
{
    start();
    await_opened(1); /* no poses at all */
    for (int i = 0; i < 5; i++) fcam_add(0, good(0, now_ns + i * MS));
    settle();
    TEST_ASSERT_EQUAL(2, count(OC_COUNT_FRAMES_OVERRUN)); /* 6 buffers: three may wait */
    TEST_ASSERT_EQUAL(3, fcam_n_held(0));
    add_pose(now_ns - MS);
    add_pose(now_ns + 20 * MS);
    oc_captured_t frame;
    for (int i = 2; i < 5; i++) {
        expect_frame(&frame);
        TEST_ASSERT_EQUAL_INT64(utime_of(now_ns + i * MS), frame.utime_us);
    }
    settle();
}

static void of_two_cameras_the_older_frame_comes_first_and_an_absent_one_delays_nobody(void)
{
    configure(3, OC_PIXEL_YUYV);
    fcam_devices[1].gate_fd = eventfd(0, EFD_CLOEXEC); /* opening camera 1 takes most of the test */
    start();
    add_pose(now_ns - 500 * MS);
    add_pose(now_ns + 500 * MS);
    await_opened(2);
    fcam_add(0, good(0, now_ns));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_EQUAL(0, frame.camera_index);
    fcam_add(0, (fcam_event_t){.result = OC_VIDEO_GONE}); /* lost and found again meanwhile */
    settle();
    now_ns += 200 * MS;
    await_opened(3);
    const uint64_t one = 1;
    TEST_ASSERT_EQUAL(8, write(fcam_devices[1].gate_fd, &one, sizeof one));
    await_opened(4);
    fcam_add(0, good(0, now_ns + 30 * MS));
    fcam_add(2, good(2, now_ns + 10 * MS));
    fcam_add(1, good(1, now_ns + 20 * MS));
    now_ns += 30 * MS;
    const int order[] = {2, 1, 0};
    for (int i = 0; i < 3; i++) {
        expect_frame(&frame);
        TEST_ASSERT_EQUAL(order[i], frame.camera_index);
    }
    close(fcam_devices[1].gate_fd);
}

/* ---- faults of frames ---- */

static void damaged_and_dated_wrongly_is_counted_by_cause(void)
{
    run_with_poses();
    fcam_event_t event = good(0, now_ns);
    event.is_flagged = true;
    fcam_add(0, event);
    event = good(0, now_ns + 1 * MS);
    event.n_bytes = whole() - 1;
    fcam_add(0, event);
    sequence[0] += 4; /* four lost */
    fcam_add(0, good(0, now_ns + 2 * MS));
    fcam_add(0, good(0, now_ns + 2 * MS));     /* not later */
    fcam_add(0, good(0, now_ns + 90 * MS));    /* in the future */
    fcam_add(0, good(0, now_ns - 60000 * MS)); /* of another clock */
    oc_captured_t frame;
    expect_frame(&frame);
    settle();
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_FLAGGED));
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_CORRUPT));
    TEST_ASSERT_EQUAL(4, count(OC_COUNT_FRAMES_LOST));
    TEST_ASSERT_EQUAL(3, count(OC_COUNT_FRAMES_BAD_TIME));
    TEST_ASSERT_EQUAL(0, fcam_n_held(0));
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_CAMERA_OPENED)); /* no reason to open it again */
}

static void a_jpeg_that_does_not_decode_is_dropped_when_its_turn_comes(void)
{
    configure(1, OC_PIXEL_MJPG);
    run_with_poses();
    fcam_event_t event = good(0, now_ns);
    event.n_bytes = 3000; /* of one value */
    fcam_add(0, event);
    settle();
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_CORRUPT));
    TEST_ASSERT_EQUAL(0, fcam_n_held(0));
}

static void a_clock_that_is_set_is_told(void)
{
    run_with_poses();
    now_ns += 1100 * MS;
    utc_offset_ns += 500 * MS; /* slewed */
    fcam_add(0, good(0, now_ns - MS));
    settle();
    TEST_ASSERT_EQUAL(0, count(OC_COUNT_CLOCK_STEPS));
    now_ns += 1100 * MS;
    utc_offset_ns -= 60000 * MS;
    oc_captured_t frame;
    TEST_ASSERT_EQUAL(OC_CAPTURE_ERROR, next(&frame));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(told, "clock"), told);
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_CLOCK_STEPS));
}

/* ---- faults of cameras ---- */

static void a_camera_that_goes_comes_back_with_its_settings(void)
{
    config.cameras[0].wish.controls = (oc_video_controls_t){.has_gain = true, .gain = 7};
    fcam_devices[0].n_controls_refused = 2;
    run_with_poses();
    const oc_video_result_t ways[] = {OC_VIDEO_GONE, OC_VIDEO_FAULT};
    for (uint32_t i = 0; i < 2; i++) {
        now_ns += 10 * MS;
        fcam_add(0, good(0, now_ns));
        fcam_add(0, (fcam_event_t){.result = ways[i]});
        memset(&fcam_devices[0].last_wish, 0, sizeof fcam_devices[0].last_wish);
        settle(); /* the frame went with its camera: its buffer does not exist any more */
        TEST_ASSERT_EQUAL(i + 1, count(OC_COUNT_CAMERA_LOST));
        now_ns += 200 * MS;
        sequence[0] = 0; /* numbers begin anew: nothing was lost */
        await_opened(i + 2);
        TEST_ASSERT_EQUAL(7, fcam_devices[0].last_wish.controls.gain);
    }
    TEST_ASSERT_EQUAL(6, count(OC_COUNT_CONTROLS_REFUSED));
    TEST_ASSERT_EQUAL(0, count(OC_COUNT_FRAMES_LOST));
    fcam_devices[0].is_giving_back_refused = true;
    fcam_add(0, (fcam_event_t){.result = OC_VIDEO_FRAME, .is_flagged = true, .mono_ns = now_ns});
    settle();
    TEST_ASSERT_EQUAL(3, count(OC_COUNT_CAMERA_LOST));
    fcam_devices[0].is_giving_back_refused = false;
}

static void silence_is_a_stall(void)
{
    run_with_poses();
    now_ns += 999 * MS;
    settle();
    TEST_ASSERT_EQUAL(0, count(OC_COUNT_CAMERA_STALLS));
    now_ns += 1 * MS;
    settle();
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_CAMERA_STALLS));
    now_ns += 200 * MS;
    await_opened(2);
    TEST_ASSERT_EQUAL(0, count(OC_COUNT_CAMERA_LOST));
}

static void an_absent_camera_is_told_once_a_spell(void)
{
    fcam_devices[0].is_there = false;
    start();
    int n_told = 0;
    for (int i = 0; i < 50; i++) {
        oc_captured_t frame;
        for (int k = 0; k < 20; k++) {
            const oc_capture_result_t result = next(&frame);
            if (result == OC_CAPTURE_ERROR) {
                TEST_ASSERT_NOT_NULL_MESSAGE(strstr(told, "camera cam0: /dev/fake0: No such file"), told);
                n_told++;
            }
            if (result == OC_CAPTURE_NONE) usleep(200);
        }
        now_ns += 200 * MS;
    }
    TEST_ASSERT_EQUAL(1, n_told);
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_CAMERA_FAULTS));
    fcam_devices[0].is_there = true;
    await_opened(1);
    fcam_add(0, (fcam_event_t){.result = OC_VIDEO_GONE});
    fcam_devices[0].is_there = false;
    settle();
    now_ns += 2000 * MS;
    settle();
    TEST_ASSERT_EQUAL(2, count(OC_COUNT_CAMERA_FAULTS)); /* another spell */
}

static void what_was_told_last_is_how_it_stands(void)
{
    run_with_poses();
    now_ns += 2000 * MS;
    fcam_add(0, (fcam_event_t){.result = OC_VIDEO_GONE});
    oc_captured_t frame;
    char last[sizeof told] = "";
    for (int i = 0; i < 3000 && (count(OC_COUNT_CAMERA_OPENED) < 2 || i < 300); i++) {
        if (next(&frame) == OC_CAPTURE_ERROR) memcpy(last, told, sizeof last);
        usleep(200);
        if (i % 10 == 9) now_ns += 10 * MS; /* back within a second */
    }
    now_ns += 1000 * MS;
    for (int i = 0; i < 5; i++) {
        if (next(&frame) == OC_CAPTURE_ERROR) memcpy(last, told, sizeof last);
    }
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(last, "YUYV 64x48"), last);
}

static void a_camera_that_flaps_fills_no_disk(void)
{
    run_with_poses();
    int n_told = 0;
    for (uint32_t i = 0; i < 30; i++) {
        fcam_add(0, (fcam_event_t){.result = OC_VIDEO_GONE});
        for (int k = 0; k < 3000 && count(OC_COUNT_CAMERA_OPENED) < i + 2; k++) {
            oc_captured_t frame;
            const oc_capture_result_t result = next(&frame);
            n_told += result == OC_CAPTURE_ERROR;
            if (result == OC_CAPTURE_NONE) usleep(200);
            if (k % 10 == 9) now_ns += 10 * MS;
        }
    }
    const int64_t seconds = (now_ns - 5000000000) / 1000000000 + 1;
    TEST_ASSERT_TRUE(n_told <= seconds + 1);
    TEST_ASSERT_EQUAL(30, count(OC_COUNT_CAMERA_LOST));
}

/* ---- the rest ---- */

static void its_description_is_json_whatever_the_names_are(void)
{
    configure(2, OC_PIXEL_YUYV);
    fcam_devices[1].is_there = false;
    snprintf(fcam_devices[1].absent_text, sizeof fcam_devices[1].absent_text, "bad \"text\" \\ \n\x7f");
    start();
    await_opened(1);
    now_ns += 50 * MS;
    settle();
    static char text[8192];
    text[0] = '[';
    const size_t n = source->describe(source, text + 1, sizeof text - 2);
    snprintf(text + 1 + n, sizeof text - 1 - n, "]");
    json_error_t fault;
    json_t *cameras = json_loads(text, JSON_REJECT_DUPLICATES, &fault);
    TEST_ASSERT_NOT_NULL_MESSAGE(cameras, text);
    TEST_ASSERT_EQUAL(2, json_array_size(cameras));
    const json_t *first = json_array_get(cameras, 0), *second = json_array_get(cameras, 1);
    TEST_ASSERT_EQUAL_STRING("streaming", json_string_value(json_object_get(first, "state")));
    TEST_ASSERT_EQUAL_STRING("Fake \"cam\\?", json_string_value(json_object_get(first, "card")));
    TEST_ASSERT_NOT_NULL(strstr(json_string_value(json_object_get(second, "error")), "bad \"text\" \\ ??"));
    json_decref(cameras);
    TEST_ASSERT_TRUE(source->describe(source, text, 40) < 40); /* too small: nothing half-written */
}

static void the_thread_of_the_frames_never_asks_the_heap(void)
{
    run_with_poses();
    for (int i = 0; i < 200; i++) {
        now_ns += MS;
        fcam_event_t event = good(0, now_ns);
        event.is_flagged = i % 7 == 3;
        fcam_add(0, event);
        oc_captured_t frame;
        struct pollfd fds[OC_MAX_CAPTURE_FDS];
        int64_t wake_ns;
        guard_is_armed = true;
        (void)next(&frame);
        (void)source->wait(source, fds, &wake_ns);
        guard_is_armed = false;
    }
    TEST_ASSERT_TRUE(count(OC_COUNT_FRAMES_FLAGGED) > 20);
}

/* Whatever is thrown at it: every frame is handed out or counted, in order, and no buffer goes astray. */
static void every_frame_is_handed_out_or_counted(void)
{
    const unsigned seed = 20261125;
    printf("seed %u\n", seed);
    srand(seed);
    run_with_poses();
    uint32_t n_given = 0, n_out = 0, n_lost_with_camera = 0;
    int64_t last_us = 0, posed_ns = now_ns + 400 * MS;
    for (int i = 0; i < 20000; i++) {
        /* The opener's thread has its own pace: time stands still for it. */
        if (fcam_is_open(0, count(OC_COUNT_CAMERA_OPENED), FCAM_QUEUE)) {
            now_ns += rand() % 40 * MS;
        } else {
            now_ns += MS;
            usleep(200);
        }
        if (rand() % 3 == 0 && posed_ns < now_ns + 100 * MS) {
            posed_ns = (now_ns > posed_ns ? now_ns : posed_ns) + (1 + rand() % 300) * MS;
            if (rand() % 40 == 0) posed_ns += 1200 * MS; /* farther apart than poses may be */
            add_pose(posed_ns);
        }
        if (fcam_is_open(0, count(OC_COUNT_CAMERA_OPENED), 7)) {
            fcam_event_t event = good(0, now_ns - rand() % 30 * MS);
            event.is_flagged = rand() % 20 == 0;
            if (rand() % 20 == 0) event.n_bytes = (size_t)rand() % whole();
            fcam_add(0, event);
            n_given++;
        }
        if (rand() % 500 == 0 && fcam_is_open(0, count(OC_COUNT_CAMERA_OPENED), 7)) {
            /* Frames before it are taken in, and those that wait then go with the camera. */
            pthread_mutex_lock(&fcam_lock);
            n_given -= fcam_devices[0].n_events;
            fcam_devices[0].n_events = 0;
            pthread_mutex_unlock(&fcam_lock);
            n_lost_with_camera += fcam_n_held(0);
            fcam_add(0, (fcam_event_t){.result = OC_VIDEO_GONE});
        }
        oc_captured_t frame;
        const oc_capture_result_t result = next(&frame);
        if (result == OC_CAPTURE_FRAME) {
            TEST_ASSERT_TRUE_MESSAGE(frame.utime_us > last_us, "out of order");
            last_us = frame.utime_us;
            n_out++;
        }
        if (fcam_n_held(0) > 4) TEST_FAIL_MESSAGE("too many buffers are kept");
    }
    now_ns += 500 * MS;
    oc_captured_t frame;
    while (next(&frame) == OC_CAPTURE_FRAME) n_out++;
    const uint32_t n_counted = count(OC_COUNT_FRAMES_FLAGGED) + count(OC_COUNT_FRAMES_CORRUPT) +
                               count(OC_COUNT_FRAMES_BAD_TIME) + count(OC_COUNT_FRAMES_NO_POSE) +
                               count(OC_COUNT_FRAMES_OVERRUN);
    pthread_mutex_lock(&fcam_lock);
    n_lost_with_camera += fcam_devices[0].n_discarded + fcam_devices[0].n_events;
    pthread_mutex_unlock(&fcam_lock);
    printf("%u frames: %u handed out, %u counted, at most %u gone with their camera; %u without a pose\n", n_given,
           n_out, n_counted, n_lost_with_camera, count(OC_COUNT_FRAMES_NO_POSE));
    TEST_ASSERT_TRUE(n_out + n_counted <= n_given);
    TEST_ASSERT_TRUE(n_out + n_counted + n_lost_with_camera >= n_given);
    TEST_ASSERT_TRUE(n_out > 1000 && count(OC_COUNT_FRAMES_NO_POSE) > 0 && count(OC_COUNT_CAMERA_LOST) > 5);
}

int main(void)
{
    guard_install();
    UNITY_BEGIN();
    RUN_TEST(a_frame_has_the_pose_of_its_own_time_and_the_drivers_own_bytes);
    RUN_TEST(nv12_has_its_chroma_below_its_luma);
    RUN_TEST(a_frame_waits_for_its_pose_and_no_longer_than_told);
    RUN_TEST(a_frame_older_than_all_poses_goes_at_once);
    RUN_TEST(the_oldest_waiting_frame_makes_room);
    RUN_TEST(of_two_cameras_the_older_frame_comes_first_and_an_absent_one_delays_nobody);
    RUN_TEST(damaged_and_dated_wrongly_is_counted_by_cause);
    RUN_TEST(a_jpeg_that_does_not_decode_is_dropped_when_its_turn_comes);
    RUN_TEST(a_clock_that_is_set_is_told);
    RUN_TEST(a_camera_that_goes_comes_back_with_its_settings);
    RUN_TEST(silence_is_a_stall);
    RUN_TEST(an_absent_camera_is_told_once_a_spell);
    RUN_TEST(what_was_told_last_is_how_it_stands);
    RUN_TEST(a_camera_that_flaps_fills_no_disk);
    RUN_TEST(its_description_is_json_whatever_the_names_are);
    RUN_TEST(the_thread_of_the_frames_never_asks_the_heap);
    RUN_TEST(every_frame_is_handed_out_or_counted);
    return UNITY_END();
}
