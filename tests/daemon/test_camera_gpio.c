/* SPDX-License-Identifier: BSD-3-Clause
 * Cameras and lines together: frames that nobody wants, marks and the frames they choose, times of trigger pulses. */
#include <stdio.h>

#include "camera_rig.h"
#include "fake_gpio.h"

static void lines(const oc_gpio_config_t *wired)
{
    gpio = oc_gpio_open(wired, &fake_ops, &counters, told, sizeof told);
    TEST_ASSERT_NOT_NULL_MESSAGE(gpio, told);
}

void setUp(void)
{
    rig_set_up();
    fake_reset();
    gpio = NULL;
}

void tearDown(void)
{
    rig_tear_down();
    oc_gpio_close(gpio);
    gpio = NULL;
}

/* A mark dated on the test's own clock; returns when the line's thread has taken it. */
static void mark(int64_t mono_ns)
{
    fake_edge(FAKE_MARK, true, mono_ns);
    struct pollfd fd = {oc_gpio_fd(gpio), POLLIN, 0};
    TEST_ASSERT_EQUAL_MESSAGE(1, poll(&fd, 1, 60000), "nobody was told of the mark");
}

static void start_with_marks(void)
{
    lines(&(oc_gpio_config_t){.mark = {.is_used = true, .line = "mark"}, .trigger_rate_hz = 1});
    run_with_poses();
}

static void frames_while_the_line_is_off_are_counted_and_the_camera_streams_on(void)
{
    lines(&(oc_gpio_config_t){.enable = {.is_used = true, .line = "enable"}, .trigger_rate_hz = 1});
    run_with_poses(); /* the line is off */
    for (int i = 0; i < 20; i++) {
        now_ns += 10 * MS;
        fcam_add(0, good(0, now_ns));
        settle();
    }
    TEST_ASSERT_EQUAL(20, count(OC_COUNT_FRAMES_DISABLED));
    TEST_ASSERT_EQUAL(0, fcam_n_held(0));
    FAKE_CHANGE(FAKE_ENABLE, level, 1);
    fake_edge(FAKE_ENABLE, true, now_ns);
    FAKE_AWAIT(oc_gpio_is_enabled(gpio));
    now_ns += 10 * MS;
    fcam_add(0, good(0, now_ns));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_FALSE(frame.is_forced);
    TEST_ASSERT_EQUAL(0, count(OC_COUNT_CAMERA_STALLS));
}

static void a_mark_chooses_the_first_frame_exposed_at_or_after_it(void)
{
    start_with_marks();
    oc_captured_t frame;
    for (int i = 0; i < 3; i++) fcam_add(0, good(0, now_ns + i * 10 * MS));
    now_ns += 30 * MS;
    mark(now_ns - 20 * MS); /* exactly the second of the three */
    const bool expected[] = {false, true, false};
    for (int i = 0; i < 3; i++) {
        expect_frame(&frame);
        TEST_ASSERT_EQUAL(expected[i], frame.is_forced);
    }
    TEST_ASSERT_EQUAL(1, count(OC_COUNT_MARKS));
    mark(now_ns + 5 * MS); /* before its frame has come */
    settle();
    fcam_add(0, good(0, now_ns + 4 * MS));
    fcam_add(0, good(0, now_ns + 6 * MS));
    now_ns += 6 * MS;
    expect_frame(&frame);
    TEST_ASSERT_FALSE(frame.is_forced);
    expect_frame(&frame);
    TEST_ASSERT_TRUE(frame.is_forced);
}

static void a_mark_outlives_the_frame_it_chose(void)
{
    start_with_marks();
    /* Waiting without a pose, chosen, and pushed out by newer ones. */
    now_ns += 450 * MS;
    for (int i = 0; i < 3; i++) fcam_add(0, good(0, now_ns + i * MS));
    settle();
    mark(now_ns);
    settle();
    for (int i = 3; i < 5; i++) fcam_add(0, good(0, now_ns + i * MS));
    settle();
    TEST_ASSERT_EQUAL(2, count(OC_COUNT_FRAMES_OVERRUN));
    add_pose(now_ns + 10 * MS);
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_TRUE(frame.is_forced);
    expect_frame(&frame);
    TEST_ASSERT_FALSE(frame.is_forced);
    expect_frame(&frame);
}

static void a_mark_outlives_the_camera(void)
{
    start_with_marks();
    now_ns += 450 * MS;
    fcam_add(0, good(0, now_ns)); /* waits for its pose */
    settle();
    mark(now_ns - MS);
    settle();
    fcam_add(0, (fcam_event_t){.result = OC_VIDEO_GONE});
    settle();
    now_ns += 200 * MS;
    await_opened(2);
    add_pose(now_ns + 50 * MS);
    fcam_add(0, good(0, now_ns + MS));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_TRUE(frame.is_forced);
}

static void each_of_two_marks_has_its_frame(void)
{
    start_with_marks();
    mark(now_ns + 5 * MS);
    settle();
    mark(now_ns + 25 * MS);
    settle();
    const bool expected[] = {false, true, false, true};
    for (int i = 0; i < 4; i++) {
        fcam_add(0, good(0, now_ns));
        oc_captured_t frame;
        expect_frame(&frame);
        TEST_ASSERT_EQUAL(expected[i], frame.is_forced);
        now_ns += 10 * MS;
    }
    TEST_ASSERT_EQUAL(2, count(OC_COUNT_MARKS));
}

static void a_triggered_camera_is_dated_by_its_pulse(void)
{
    config.cameras[0].is_hardware_triggered = true;
    lines(&(oc_gpio_config_t){.trigger = {.is_used = true, .line = "trigger"},
                              .trigger_mode = OC_TRIGGER_PERIODIC,
                              .trigger_rate_hz = 20,
                              .trigger_pulse_us = 1000});
    FAKE_AWAIT(fake_count(FAKE_TRIGGER, true) >= 3);
    int64_t pulse_ns = 0;
    now_ns = fake_now_ns();
    TEST_ASSERT_TRUE(oc_gpio_pulse_of(gpio, now_ns, &pulse_ns));
    add_pose(now_ns - 900 * MS);
    add_pose(now_ns + 50 * MS);
    start();
    await_opened(1);
    fcam_add(0, good(0, now_ns));
    oc_captured_t frame;
    expect_frame(&frame);
    TEST_ASSERT_INT64_WITHIN(1, utime_of(pulse_ns), frame.utime_us);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(frames_while_the_line_is_off_are_counted_and_the_camera_streams_on);
    RUN_TEST(a_mark_chooses_the_first_frame_exposed_at_or_after_it);
    RUN_TEST(a_mark_outlives_the_frame_it_chose);
    RUN_TEST(a_mark_outlives_the_camera);
    RUN_TEST(each_of_two_marks_has_its_frame);
    RUN_TEST(a_triggered_camera_is_dated_by_its_pulse);
    return UNITY_END();
}
