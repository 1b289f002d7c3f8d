/* SPDX-License-Identifier: BSD-3-Clause
 * The thread of the lines on lines that the test plays. Times are compared with each other, never with a stopwatch:
 * on a loaded machine all may come late, but nothing may come in a wrong order, be lost uncounted or hang. */
#include <dirent.h>
#include <poll.h>
#include <stdlib.h>

#include "allocation_guard.h"
#include "gpio_rig.h"

static fake_set_t sets[FAKE_MAX_SETS];

void setUp(void)
{
    rig_set_up();
}

void tearDown(void)
{
    guard_is_armed = false;
    rig_tear_down();
}

/* Rises and falls take turns, a rise first, and every pulse lasts at least as long as asked for. */
static void check_pulses(fake_role_t role, uint32_t pulse_us)
{
    const uint32_t n = fake_sets_of(role, sets);
    for (uint32_t i = 0; i < n; i++) {
        TEST_ASSERT_EQUAL_MESSAGE(i % 2 == 0, sets[i].is_active, fake_names[role]);
        if (i % 2 == 1) TEST_ASSERT_TRUE(sets[i].at_ns - sets[i - 1].at_ns >= pulse_us * 1000LL);
    }
}

/* ---- periodic trigger ---- */

/* Every beat of the clock is a pulse or counted. The first beat lies between the two times. */
static void check_beats(int64_t before_ns, int64_t after_ns)
{
    const int64_t period_ns = (int64_t)((double)NS_PER_S / config.trigger_rate_hz);
    const uint32_t n = fake_sets_of(FAKE_TRIGGER, sets);
    int64_t last_ns = 0, n_beats = count_of(OC_COUNT_PULSES_MISSED);
    for (uint32_t i = 0; i < n; i++) {
        if (sets[i].is_active) last_ns = sets[i].at_ns;
        n_beats += sets[i].is_active;
    }
    char text[128];
    snprintf(text, sizeof text, "%lld beats in %.1f to %.1f periods", (long long)n_beats,
             (double)(last_ns - after_ns) / (double)period_ns, (double)(last_ns - before_ns) / (double)period_ns);
    TEST_ASSERT_TRUE_MESSAGE(n_beats >= (last_ns - after_ns) / period_ns - 1, text);
    TEST_ASSERT_TRUE_MESSAGE(n_beats <= (last_ns - before_ns) / period_ns + 3, text);
}

static void a_periodic_trigger_loses_no_beat_uncounted(void)
{
    config.trigger.is_used = true;
    const int64_t before_ns = fake_now_ns();
    open_all_right();
    const int64_t after_ns = fake_now_ns();
    FAKE_AWAIT(fake_now_ns() - after_ns > NS_PER_S && fake_count(FAKE_TRIGGER, false) >= 20);
    oc_gpio_frame(gpio); /* changes nothing */
    close_now();
    check_pulses(FAKE_TRIGGER, config.trigger_pulse_us);
    check_beats(before_ns, after_ns);
}

static void a_held_up_trigger_counts_the_beats_it_missed_and_gives_no_burst(void)
{
    config.trigger.is_used = true;
    const int64_t before_ns = fake_now_ns();
    open_all_right();
    const int64_t after_ns = fake_now_ns();
    FAKE_AWAIT(fake_count(FAKE_TRIGGER, false) >= 3);
    fake_hold();
    const int64_t held_ns = fake_now_ns();
    FAKE_AWAIT(fake_now_ns() - held_ns > 10 * 20 * NS_PER_MS);
    const uint32_t n_before = fake_count(FAKE_TRIGGER, true);
    fake_release();
    FAKE_AWAIT(fake_count(FAKE_TRIGGER, false) >= n_before + 5);
    close_now();
    TEST_ASSERT_TRUE(count_of(OC_COUNT_PULSES_MISSED) >= 7);
    check_pulses(FAKE_TRIGGER, config.trigger_pulse_us);
    check_beats(before_ns, after_ns);
}

/* The start of the pulse that was set at rises[i]: after the set before it and not after its own. Asked for by times
 * going back from there, as the thread may have been held up between the two. */
static int64_t start_of(const fake_set_t *rises, uint32_t i)
{
    const int64_t step_ns = (int64_t)((double)NS_PER_S / config.trigger_rate_hz / 2);
    const int64_t end_ns = i > 0 ? rises[i - 1].at_ns : rises[i].at_ns - 100 * step_ns;
    for (int64_t at_ns = rises[i].at_ns; at_ns > end_ns; at_ns -= step_ns) {
        int64_t start_ns;
        if (oc_gpio_pulse_of(gpio, at_ns, &start_ns) && start_ns > end_ns) return start_ns;
    }
    TEST_FAIL_MESSAGE("a pulse that was given is not known");
    return 0;
}

static void a_frame_finds_the_last_pulse_before_it(void)
{
    config.trigger.is_used = true;
    config.trigger_rate_hz = 200;
    open_all_right();
    FAKE_AWAIT(fake_count(FAKE_TRIGGER, true) >= 100);
    fake_hold(); /* the thread stands still, so that no pulse is forgotten meanwhile */
    fake_sleep_us(50000);
    uint32_t n = fake_sets_of(FAKE_TRIGGER, sets), n_rises = 0;
    for (uint32_t i = 0; i < n; i++) {
        if (sets[i].is_active) sets[n_rises++] = sets[i];
    }
    enum { N = 60 }; /* of 64 that are kept */
    const fake_set_t *rises = &sets[n_rises - N];
    int64_t starts_ns[N];
    for (uint32_t i = 0; i < N; i++) starts_ns[i] = start_of(rises, i);
    const int64_t period_ns = NS_PER_S / 200;
    srand(7);
    for (int draw = 0; draw < 20000; draw++) {
        const int64_t span_ns = rises[N - 1].at_ns - starts_ns[0];
        const int64_t at_ns = starts_ns[0] + (int64_t)((double)span_ns * rand() / RAND_MAX);
        int last = 0;
        while (last + 1 < N && starts_ns[last + 1] <= at_ns) last++;
        int64_t found_ns = -1;
        const bool is_found = oc_gpio_pulse_of(gpio, at_ns, &found_ns);
        TEST_ASSERT_EQUAL(at_ns - starts_ns[last] <= period_ns, is_found);
        if (is_found) TEST_ASSERT_EQUAL_INT64(starts_ns[last], found_ns);
    }
    fake_release();
}

static void a_frame_before_the_first_pulse_or_a_period_after_the_last_has_none(void)
{
    config.trigger.is_used = true;
    config.trigger_rate_hz = 0.1;
    open_all_right();
    FAKE_AWAIT(fake_count(FAKE_TRIGGER, false) == 1);
    int64_t start_ns = 0, again_ns = 0;
    TEST_ASSERT_TRUE(oc_gpio_pulse_of(gpio, fake_now_ns(), &start_ns));
    TEST_ASSERT_TRUE(oc_gpio_pulse_of(gpio, start_ns, &again_ns));
    TEST_ASSERT_EQUAL_INT64(start_ns, again_ns);
    TEST_ASSERT_FALSE(oc_gpio_pulse_of(gpio, start_ns - 1, &again_ns));
    TEST_ASSERT_TRUE(oc_gpio_pulse_of(gpio, start_ns + 10 * NS_PER_S, &again_ns));
    TEST_ASSERT_FALSE(oc_gpio_pulse_of(gpio, start_ns + 10 * NS_PER_S + 1, &again_ns));
}

static void a_pulse_that_was_not_given_has_no_frames(void)
{
    config.trigger.is_used = true;
    FAKE_CHANGE(FAKE_TRIGGER, is_stuck, true);
    open_all_right();
    FAKE_AWAIT(count_of(OC_COUNT_GPIO_FAULTS) == 1);
    fake_sleep_us(100000);
    fake_hold();
    fake_sleep_us(30000);
    fake_release();
    TEST_ASSERT_EQUAL(1, count_of(OC_COUNT_GPIO_FAULTS)); /* told once */
    FAKE_CHANGE(FAKE_TRIGGER, is_stuck, false);
    FAKE_AWAIT(fake_count(FAKE_TRIGGER, true) >= 1);
    (void)fake_sets_of(FAKE_TRIGGER, sets);
    const fake_set_t *first = sets[0].is_active ? &sets[0] : &sets[1];
    const int64_t start_ns = start_of(first, 0);
    int64_t stuck_ns;
    for (int ms = 0; ms < 60; ms++) TEST_ASSERT_FALSE(oc_gpio_pulse_of(gpio, start_ns - 1 - ms * NS_PER_MS, &stuck_ns));
    FAKE_CHANGE(FAKE_TRIGGER, is_stuck, true);
    FAKE_AWAIT(count_of(OC_COUNT_GPIO_FAULTS) == 2); /* a new fault */
}

/* ---- per frame ---- */

static void every_frame_has_its_pulse(void)
{
    config.trigger.is_used = true;
    config.trigger_mode = OC_TRIGGER_PER_FRAME;
    config.trigger_rate_hz = 0; /* of no meaning here */
    open_all_right();
    fake_sleep_us(50000);
    TEST_ASSERT_EQUAL(0, fake_count(FAKE_TRIGGER, true));
    int64_t pulse_ns;
    for (uint32_t i = 1; i <= 20; i++) {
        const int64_t frame_ns = fake_now_ns();
        oc_gpio_frame(gpio);
        FAKE_AWAIT(fake_count(FAKE_TRIGGER, false) == i);
        const uint32_t n = fake_sets_of(FAKE_TRIGGER, sets);
        TEST_ASSERT_EQUAL(2 * i, n);
        TEST_ASSERT_TRUE(sets[n - 2].at_ns >= frame_ns);
        TEST_ASSERT_FALSE(oc_gpio_pulse_of(gpio, fake_now_ns(), &pulse_ns));
    }
    check_pulses(FAKE_TRIGGER, config.trigger_pulse_us);
    TEST_ASSERT_EQUAL(0, count_of(OC_COUNT_PULSES_MISSED));
}

/* Frames that come faster than their pulses end: pulses keep their length and end, the rest is counted. */
static void check_crowded_frames(fake_role_t role, uint32_t pulse_us)
{
    open_all_right();
    uint32_t n = 0;
    while (fake_count(role, true) < 4 || count_of(OC_COUNT_PULSES_MISSED) < 4) {
        TEST_ASSERT_TRUE_MESSAGE(n < 20000, "frames put pulses off for ever, or none was crowded");
        oc_gpio_frame(gpio);
        n++;
        fake_sleep_us(2000);
    }
    FAKE_AWAIT(fake_count(role, true) + count_of(OC_COUNT_PULSES_MISSED) == n);
    FAKE_AWAIT(fake_count(role, false) == fake_count(role, true));
    check_pulses(role, pulse_us);
}

static void crowded_frames_lengthen_no_trigger_pulse(void)
{
    config.trigger.is_used = true;
    config.trigger_mode = OC_TRIGGER_PER_FRAME;
    config.trigger_pulse_us = 30000;
    check_crowded_frames(FAKE_TRIGGER, 30000);
}

static void crowded_frames_do_not_put_off_the_strobe_for_ever(void)
{
    config.strobe.is_used = true;
    config.strobe_delay_us = 30000;
    check_crowded_frames(FAKE_STROBE, 1000);
}

static void crowded_frames_lengthen_no_strobe(void)
{
    config.strobe.is_used = true;
    config.strobe_pulse_us = 30000;
    check_crowded_frames(FAKE_STROBE, 30000);
}

static void the_strobe_follows_the_frame_after_its_delay(void)
{
    config.strobe.is_used = true;
    config.strobe_delay_us = 20000;
    open_all_right();
    const int64_t frame_ns = fake_now_ns();
    oc_gpio_frame(gpio);
    FAKE_AWAIT(fake_count(FAKE_STROBE, false) == 1);
    check_pulses(FAKE_STROBE, config.strobe_pulse_us);
    TEST_ASSERT_TRUE(sets[0].at_ns - frame_ns >= 20 * NS_PER_MS);
}

static void the_strobe_follows_the_trigger_after_its_delay(void)
{
    config.trigger.is_used = config.strobe.is_used = true;
    config.trigger_rate_hz = 0.1;
    config.strobe_delay_us = 10000;
    open_all_right();
    FAKE_AWAIT(fake_count(FAKE_STROBE, false) == 1);
    TEST_ASSERT_EQUAL(2, fake_sets_of(FAKE_TRIGGER, sets));
    const int64_t start_ns = start_of(sets, 0);
    check_pulses(FAKE_STROBE, config.strobe_pulse_us);
    TEST_ASSERT_TRUE(sets[0].at_ns - start_ns >= 10 * NS_PER_MS);
}

static void every_trigger_pulse_has_its_strobe(void)
{
    config.trigger.is_used = config.strobe.is_used = true;
    config.strobe_delay_us = 5000;
    open_all_right();
    FAKE_AWAIT(fake_count(FAKE_STROBE, false) >= 20);
    oc_gpio_frame(gpio); /* has none of its own */
    close_now();
    check_pulses(FAKE_STROBE, config.strobe_pulse_us);
    const uint32_t n_triggers = fake_count(FAKE_TRIGGER, true), n_strobes = fake_count(FAKE_STROBE, true);
    TEST_ASSERT_TRUE(n_strobes <= n_triggers);
    TEST_ASSERT_TRUE(n_strobes + 1 + count_of(OC_COUNT_PULSES_MISSED) >= n_triggers);
}

/* ---- heartbeat ---- */

static void the_heartbeat_beats_only_while_frames_come(void)
{
    config.heartbeat.is_used = true;
    open_all_right();
    FAKE_AWAIT(fake_count(FAKE_HEARTBEAT, false) >= 4);
    TEST_ASSERT_EQUAL(0, fake_count(FAKE_HEARTBEAT, true));
    int64_t frame_ns = 0;
    while (fake_count(FAKE_HEARTBEAT, true) < 4) {
        frame_ns = fake_now_ns();
        oc_gpio_frame(gpio);
        fake_sleep_us(5000);
    }
    uint32_t n = fake_sets_of(FAKE_HEARTBEAT, sets);
    for (uint32_t i = 1; i < n; i++) TEST_ASSERT_FALSE(sets[i].is_active && sets[i - 1].is_active);
    FAKE_AWAIT(fake_now_ns() - frame_ns > 3 * NS_PER_S + 10 * NS_PER_MS);
    n = fake_sets_of(FAKE_HEARTBEAT, sets);
    FAKE_AWAIT(fake_sets_of(FAKE_HEARTBEAT, sets) >= n + 6);
    for (uint32_t i = n + 1; i < n + 6; i++) TEST_ASSERT_FALSE(sets[i].is_active);
}

/* ---- opening and closing ---- */

static void use_all_lines(void)
{
    config.trigger.is_used = config.strobe.is_used = config.heartbeat.is_used = true;
    config.enable.is_used = config.mark.is_used = true;
}

static int n_open_files(void)
{
    int n = 0;
    DIR *dir = opendir("/proc/self/fd");
    TEST_ASSERT_NOT_NULL(dir);
    while (readdir(dir)) n++;
    closedir(dir);
    return n;
}

static void every_line_is_closed_once_and_outputs_are_inactive(void)
{
    use_all_lines();
    config.trigger_pulse_us = 19000; /* in the middle of a pulse, most likely */
    const int n_files = n_open_files();
    for (int i = 0; i < 5; i++) {
        fake_reset();
        open_all_right();
        FAKE_AWAIT(fake_count(FAKE_TRIGGER, true) >= 2);
        close_now();
        for (int role = 0; role < FAKE_N_ROLES; role++) {
            TEST_ASSERT_EQUAL(1, fake_lines[role].n_opened);
            TEST_ASSERT_EQUAL(1, fake_lines[role].n_closed);
            TEST_ASSERT_FALSE(fake_lines[role].is_active);
            TEST_ASSERT_EQUAL(role < FAKE_ENABLE, fake_lines[role].is_output);
        }
    }
    TEST_ASSERT_EQUAL(n_files, n_open_files());
}

static void what_fails_to_open_leaves_nothing_open(void)
{
    use_all_lines();
    const int n_files = n_open_files();
    for (int k = 0; k < FAKE_N_ROLES; k++) {
        fake_reset();
        fake_opens_left = k;
        gpio = oc_gpio_open(&config, &fake_ops, &counters, error, sizeof error);
        TEST_ASSERT_NULL(gpio);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, fake_names[k]), error);
        for (int role = 0; role < FAKE_N_ROLES; role++) {
            TEST_ASSERT_EQUAL(role < k, fake_lines[role].n_opened);
            TEST_ASSERT_EQUAL(role < k, fake_lines[role].n_closed);
        }
        TEST_ASSERT_EQUAL(0, fake_n_sets);
    }
    TEST_ASSERT_EQUAL(n_files, n_open_files());
}

static void the_lines_are_asked_for_as_configured(void)
{
    use_all_lines();
    config.mark = (oc_gpio_name_t){.is_used = true, .line = "button", .is_active_low = true, .bias = OC_GPIO_BIAS_UP};
    config.strobe = (oc_gpio_name_t){.is_used = true, .chip = "gpiochip3", .offset = 17};
    open_all_right();
    TEST_ASSERT_EQUAL_STRING("button", fake_lines[FAKE_MARK].name.line);
    TEST_ASSERT_TRUE(fake_lines[FAKE_MARK].name.is_active_low);
    TEST_ASSERT_EQUAL(OC_GPIO_BIAS_UP, fake_lines[FAKE_MARK].name.bias);
    TEST_ASSERT_EQUAL_STRING("gpiochip3", fake_lines[FAKE_STROBE].name.chip);
    TEST_ASSERT_EQUAL(17, fake_lines[FAKE_STROBE].name.offset);
}

/* All threads are under the guard, so that pulses and marks are as well. */
static void nothing_is_allocated_after_the_start(void)
{
    use_all_lines();
    config.trigger_mode = OC_TRIGGER_PER_FRAME;
    open_all_right();
    oc_gpio_frame(gpio);
    FAKE_AWAIT(fake_count(FAKE_TRIGGER, false) == 1); /* the thread has started: that may allocate */
    const int64_t begin_ns = fake_now_ns();
    guard_is_armed = true;
    for (int i = 0; i < 2000 && (i < 50 || fake_count(FAKE_STROBE, false) < 3); i++) {
        int64_t at_ns;
        oc_gpio_frame(gpio);
        fake_edge(FAKE_MARK, i % 2 == 0, begin_ns + i * 60 * NS_PER_MS);
        fake_sleep_us(2000);
        oc_gpio_clear(gpio);
        (void)oc_gpio_take_mark(gpio, &at_ns);
        (void)oc_gpio_pulse_of(gpio, fake_now_ns(), &at_ns);
        (void)oc_gpio_is_enabled(gpio);
    }
    TEST_ASSERT_TRUE(fake_count(FAKE_STROBE, false) >= 3);
    guard_is_armed = false;
}

int main(void)
{
    guard_install();
    UNITY_BEGIN();
    RUN_TEST(a_periodic_trigger_loses_no_beat_uncounted);
    RUN_TEST(a_held_up_trigger_counts_the_beats_it_missed_and_gives_no_burst);
    RUN_TEST(a_frame_finds_the_last_pulse_before_it);
    RUN_TEST(a_frame_before_the_first_pulse_or_a_period_after_the_last_has_none);
    RUN_TEST(a_pulse_that_was_not_given_has_no_frames);
    RUN_TEST(every_frame_has_its_pulse);
    RUN_TEST(crowded_frames_lengthen_no_trigger_pulse);
    RUN_TEST(crowded_frames_do_not_put_off_the_strobe_for_ever);
    RUN_TEST(crowded_frames_lengthen_no_strobe);
    RUN_TEST(the_strobe_follows_the_frame_after_its_delay);
    RUN_TEST(the_strobe_follows_the_trigger_after_its_delay);
    RUN_TEST(every_trigger_pulse_has_its_strobe);
    RUN_TEST(the_heartbeat_beats_only_while_frames_come);
    RUN_TEST(every_line_is_closed_once_and_outputs_are_inactive);
    RUN_TEST(what_fails_to_open_leaves_nothing_open);
    RUN_TEST(the_lines_are_asked_for_as_configured);
    RUN_TEST(nothing_is_allocated_after_the_start);
    return UNITY_END();
}
