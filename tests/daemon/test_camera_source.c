/* SPDX-License-Identifier: BSD-3-Clause
 * Cameras as a source of frames: what comes out, when, with which pose, and what every fault is counted as. The clock,
 * the devices and the poses are the test's. */
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
static oc_capture_t *source;
static oc_camera_source_config_t config;
static int64_t now_ns, utc_offset_ns;
static char told[512];
static uint32_t sequence[FAKE_CAMERAS];

static void read_clock(int64_t *before_ns, int64_t *utc_ns, int64_t *after_ns)
{
    *before_ns = *after_ns = now_ns;
    *utc_ns = now_ns + utc_offset_ns;
}

static void configure(uint32_t n_cameras, oc_pixel_format_t format)
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

static void start(void)
{
    const oc_camera_source_parts_t parts = {
        .video = &fake_video, .poses = poses, .counters = &counters, .read_clock = read_clock};
    source = oc_camera_source_open(&config, &parts, told, sizeof told);
    TEST_ASSERT_NOT_NULL_MESSAGE(source, told);
}

void setUp(void)
{
    fake_reset();
    memset(&counters, 0, sizeof counters);
    memset(sequence, 0, sizeof sequence);
    poses = oc_pose_track_create(64, 1000000);
    now_ns = 5000000000;
    utc_offset_ns = UTC_OFFSET_NS;
    source = NULL;
    configure(1, OC_PIXEL_YUYV);
}

void tearDown(void)
{
    if (source) source->close(source);
    oc_pose_track_destroy(poses);
    TEST_ASSERT_EQUAL_STRING("", fake_account);
    for (int i = 0; i < FAKE_CAMERAS; i++) TEST_ASSERT_EQUAL(fake_devices[i].n_opened, fake_devices[i].n_closed);
}

static uint32_t count(oc_counter_t counter)
{
    return oc_counters_get(&counters, counter);
}

/* One call; messages are kept in `told`. */
static oc_capture_result_t next(oc_captured_t *frame)
{
    return source->next(source, now_ns, frame, told, sizeof told);
}

/* Call until there is neither a frame nor a message; the opener's thread is given time. Frames must not come. */
static void settle(void)
{
    for (int i = 0; i < 40; i++) {
        oc_captured_t frame;
        const oc_capture_result_t result = next(&frame);
        TEST_ASSERT_NOT_EQUAL(OC_CAPTURE_FRAME, result);
        if (result == OC_CAPTURE_NONE) usleep(1000);
    }
}

static void await_opened(uint32_t n)
{
    for (int i = 0; i < 30000 && count(OC_COUNT_CAMERA_OPENED) < n; i++) {
        oc_captured_t frame;
        if (next(&frame) == OC_CAPTURE_NONE) usleep(1000);
    }
    TEST_ASSERT_EQUAL(n, count(OC_COUNT_CAMERA_OPENED));
    settle();
}

static int64_t utime_of(int64_t mono_ns)
{
    return (mono_ns + utc_offset_ns) / 1000;
}

/* The body at x = its time in seconds, level, heading east. */
static void add_pose(int64_t mono_ns)
{
    const oc_body_pose_t pose = {
        .utime_us = utime_of(mono_ns), .position_m = {(double)mono_ns * 1e-9, 2, 0}, .q_wxyz = {1, 0, 0, 0}};
    TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(poses, &pose));
}

static size_t whole(void)
{
    return oc_pixel_format_bytes(config.cameras[0].wish.format,
                                 config.cameras[0].wish.format == OC_PIXEL_YUYV ? 2 * WIDTH : WIDTH, HEIGHT);
}

static fake_event_t good(int camera, int64_t mono_ns)
{
    return (fake_event_t){
        .result = OC_VIDEO_FRAME, .sequence = sequence[camera]++, .mono_ns = mono_ns, .n_bytes = whole()};
}

static void expect_frame(oc_captured_t *frame)
{
    for (int i = 0; i < 10; i++) {
        const oc_capture_result_t result = next(frame);
        if (result == OC_CAPTURE_FRAME) return;
        TEST_ASSERT_EQUAL_MESSAGE(OC_CAPTURE_ERROR, result, "no frame");
    }
    TEST_FAIL_MESSAGE("messages without end");
}

static void run_with_poses(void)
{
    start();
    add_pose(now_ns - 500 * MS);
    add_pose(now_ns + 400 * MS);
    await_opened(1);
}

/* ---- frames and poses ---- */

static void a_frame_has_the_pose_of_its_own_time_and_the_drivers_own_bytes(void)
{
    config.cameras[0].delay_us = 3000;
    run_with_poses();
    const int64_t exposed_ns = now_ns - 20 * MS;
    fake_add(0, good(0, exposed_ns));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_EQUAL_INT64(utime_of(exposed_ns) - 3000, frame.utime_us);
    double centre[3];
    oc_pose_centre(&frame.camera.pose, centre);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, (double)exposed_ns * 1e-9 - 0.003 + 0.5, centre[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2, centre[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1, centre[2]);
    TEST_ASSERT_EQUAL_DOUBLE(0.01, frame.margin.v[4]);
    TEST_ASSERT_EQUAL_PTR(fake_devices[0].bytes[0], frame.raw.px); /* not copied */
    TEST_ASSERT_EQUAL(OC_PIXEL_YUYV, frame.raw.format);
    TEST_ASSERT_EQUAL(2 * WIDTH, frame.raw.stride_bytes);
    TEST_ASSERT_EQUAL(1, fake_n_held(0));
    settle();
    TEST_ASSERT_EQUAL(0, fake_n_held(0)); /* given back at the next call */
}

static void nv12_has_its_chroma_below_its_luma(void)
{
    configure(1, OC_PIXEL_NV12);
    run_with_poses();
    fake_add(0, good(0, now_ns));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_EQUAL_PTR(frame.raw.px + WIDTH * HEIGHT, frame.raw.chroma);
}

static void a_frame_waits_for_its_pose_and_no_longer_than_told(void)
{
    run_with_poses();
    fake_add(0, good(0, now_ns + 10 * MS)); /* slightly ahead of its time, as drivers are */
    now_ns += 450 * MS;
    fake_add(0, good(0, now_ns)); /* 50 ms after the last pose */
    oc_captured_t frame;
    expect_frame(&frame);
    settle();
    TEST_ASSERT_EQUAL(1, fake_n_held(0)); /* the second one waits where it is */
    add_pose(now_ns + 1 * MS);
    expect_frame(&frame);
    TEST_ASSERT_EQUAL_INT64(utime_of(now_ns), frame.utime_us);

    fake_add(0, good(0, now_ns + 20 * MS));
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
    TEST_ASSERT_EQUAL(0, fake_n_held(0));
}

static void a_frame_older_than_all_poses_goes_at_once(void)
{
    run_with_poses();
    fake_add(0, good(0, now_ns - 600 * MS));
    settle();
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_NO_POSE));
}

static void the_oldest_waiting_frame_makes_room(void)
{
    start();
    await_opened(1); /* no poses at all */
    for (int i = 0; i < 5; i++) fake_add(0, good(0, now_ns + i * MS));
    settle();
    TEST_ASSERT_EQUAL(2, count(OC_COUNT_FRAMES_OVERRUN)); /* 6 buffers: three may wait */
    TEST_ASSERT_EQUAL(3, fake_n_held(0));
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
    fake_devices[1].gate_fd = eventfd(0, EFD_CLOEXEC); /* opening camera 1 takes until the end of the test */
    start();
    add_pose(now_ns - 500 * MS);
    add_pose(now_ns + 500 * MS);
    await_opened(1); /* camera 0; the opener is busy with camera 1 */
    fake_add(0, good(0, now_ns));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_EQUAL(0, frame.camera_index);
    const uint64_t one = 1;
    TEST_ASSERT_EQUAL(8, write(fake_devices[1].gate_fd, &one, sizeof one));
    await_opened(3);
    fake_add(0, good(0, now_ns + 30 * MS));
    fake_add(2, good(2, now_ns + 10 * MS));
    fake_add(1, good(1, now_ns + 20 * MS));
    now_ns += 30 * MS;
    const int order[] = {2, 1, 0};
    for (int i = 0; i < 3; i++) {
        expect_frame(&frame);
        TEST_ASSERT_EQUAL(order[i], frame.camera_index);
    }
    close(fake_devices[1].gate_fd);
}

/* ---- faults of frames ---- */

static void damaged_and_dated_wrongly_is_counted_by_cause(void)
{
    run_with_poses();
    fake_event_t event = good(0, now_ns);
    event.is_flagged = true;
    fake_add(0, event);
    event = good(0, now_ns + 1 * MS);
    event.n_bytes = whole() - 1;
    fake_add(0, event);
    sequence[0] += 4; /* four lost */
    fake_add(0, good(0, now_ns + 2 * MS));
    fake_add(0, good(0, now_ns + 2 * MS));     /* not later */
    fake_add(0, good(0, now_ns + 90 * MS));    /* in the future */
    fake_add(0, good(0, now_ns - 60000 * MS)); /* of another clock */
    oc_captured_t frame;
    expect_frame(&frame);
    settle();
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_FLAGGED));
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_CORRUPT));
    TEST_ASSERT_EQUAL(4, count(OC_COUNT_FRAMES_LOST));
    TEST_ASSERT_EQUAL(3, count(OC_COUNT_FRAMES_BAD_TIME));
    TEST_ASSERT_EQUAL(0, fake_n_held(0));
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_CAMERA_OPENED)); /* no reason to open it again */
}

static void a_jpeg_that_does_not_decode_is_dropped_when_its_turn_comes(void)
{
    configure(1, OC_PIXEL_MJPG);
    run_with_poses();
    fake_event_t event = good(0, now_ns);
    event.n_bytes = 3000; /* of one value */
    fake_add(0, event);
    settle();
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_FRAMES_CORRUPT));
    TEST_ASSERT_EQUAL(0, fake_n_held(0));
}

static void a_clock_that_is_set_is_told(void)
{
    run_with_poses();
    now_ns += 1100 * MS;
    utc_offset_ns += 500 * MS; /* slewed */
    fake_add(0, good(0, now_ns - MS));
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
    fake_devices[0].n_controls_refused = 2;
    run_with_poses();
    const oc_video_result_t ways[] = {OC_VIDEO_GONE, OC_VIDEO_FAULT};
    for (uint32_t i = 0; i < 2; i++) {
        now_ns += 10 * MS;
        fake_add(0, good(0, now_ns));
        fake_add(0, (fake_event_t){.result = ways[i]});
        memset(&fake_devices[0].last_wish, 0, sizeof fake_devices[0].last_wish);
        settle(); /* the frame went with its camera: its buffer does not exist any more */
        TEST_ASSERT_EQUAL(i + 1, count(OC_COUNT_CAMERA_LOST));
        now_ns += 200 * MS;
        sequence[0] = 0; /* numbers begin anew: nothing was lost */
        await_opened(i + 2);
        TEST_ASSERT_EQUAL(7, fake_devices[0].last_wish.controls.gain);
    }
    TEST_ASSERT_EQUAL(6, count(OC_COUNT_CONTROLS_REFUSED));
    TEST_ASSERT_EQUAL(0, count(OC_COUNT_FRAMES_LOST));
    fake_devices[0].is_giving_back_refused = true;
    fake_add(0, (fake_event_t){.result = OC_VIDEO_FRAME, .is_flagged = true, .mono_ns = now_ns});
    settle();
    TEST_ASSERT_EQUAL(3, count(OC_COUNT_CAMERA_LOST));
    fake_devices[0].is_giving_back_refused = false;
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
    fake_devices[0].is_there = false;
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
    fake_devices[0].is_there = true;
    await_opened(1);
    fake_add(0, (fake_event_t){.result = OC_VIDEO_GONE});
    fake_devices[0].is_there = false;
    settle();
    now_ns += 2000 * MS;
    settle();
    TEST_ASSERT_EQUAL(2, count(OC_COUNT_CAMERA_FAULTS)); /* another spell */
}

static void a_camera_that_flaps_fills_no_disk(void)
{
    run_with_poses();
    int n_told = 0;
    for (uint32_t i = 0; i < 30; i++) {
        fake_add(0, (fake_event_t){.result = OC_VIDEO_GONE});
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
    fake_devices[1].is_there = false;
    snprintf(fake_devices[1].absent_text, sizeof fake_devices[1].absent_text, "bad \"text\" \\ \n\x7f");
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
        fake_event_t event = good(0, now_ns);
        event.is_flagged = i % 7 == 3;
        fake_add(0, event);
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
        if (fake_is_open(0, count(OC_COUNT_CAMERA_OPENED), FAKE_QUEUE)) {
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
        if (fake_is_open(0, count(OC_COUNT_CAMERA_OPENED), 7)) {
            fake_event_t event = good(0, now_ns - rand() % 30 * MS);
            event.is_flagged = rand() % 20 == 0;
            if (rand() % 20 == 0) event.n_bytes = (size_t)rand() % whole();
            fake_add(0, event);
            n_given++;
        }
        if (rand() % 500 == 0 && fake_is_open(0, count(OC_COUNT_CAMERA_OPENED), 7)) {
            /* Frames before it are taken in, and those that wait then go with the camera. */
            pthread_mutex_lock(&fake_lock);
            n_given -= fake_devices[0].n_events;
            fake_devices[0].n_events = 0;
            pthread_mutex_unlock(&fake_lock);
            n_lost_with_camera += fake_n_held(0);
            fake_add(0, (fake_event_t){.result = OC_VIDEO_GONE});
        }
        oc_captured_t frame;
        const oc_capture_result_t result = next(&frame);
        if (result == OC_CAPTURE_FRAME) {
            TEST_ASSERT_TRUE_MESSAGE(frame.utime_us > last_us, "out of order");
            last_us = frame.utime_us;
            n_out++;
        }
        if (fake_n_held(0) > 4) TEST_FAIL_MESSAGE("too many buffers are kept");
    }
    now_ns += 500 * MS;
    oc_captured_t frame;
    while (next(&frame) == OC_CAPTURE_FRAME) n_out++;
    const uint32_t n_counted = count(OC_COUNT_FRAMES_FLAGGED) + count(OC_COUNT_FRAMES_CORRUPT) +
                               count(OC_COUNT_FRAMES_BAD_TIME) + count(OC_COUNT_FRAMES_NO_POSE) +
                               count(OC_COUNT_FRAMES_OVERRUN);
    pthread_mutex_lock(&fake_lock);
    n_lost_with_camera += fake_devices[0].n_discarded + fake_devices[0].n_events;
    pthread_mutex_unlock(&fake_lock);
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
    RUN_TEST(a_camera_that_flaps_fills_no_disk);
    RUN_TEST(its_description_is_json_whatever_the_names_are);
    RUN_TEST(the_thread_of_the_frames_never_asks_the_heap);
    RUN_TEST(every_frame_is_handed_out_or_counted);
    return UNITY_END();
}
