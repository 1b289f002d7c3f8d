/* SPDX-License-Identifier: BSD-3-Clause
 * Inputs that the test plays: the enable line and marks, their bounces, and lines that die, hang up or swing. */
#include <poll.h>
#include <stdlib.h>

#include "gpio_rig.h"

void setUp(void)
{
    rig_set_up();
}

void tearDown(void)
{
    rig_tear_down();
}

static bool has_news(int timeout_ms)
{
    struct pollfd fd = {oc_gpio_fd(gpio), POLLIN, 0};
    return poll(&fd, 1, timeout_ms) == 1;
}

/* ---- enable ---- */

static void nothing_wired_is_enabled_and_silent(void)
{
    open_all_right();
    TEST_ASSERT_TRUE(oc_gpio_is_enabled(gpio));
    oc_gpio_frame(gpio);
    int64_t at_ns;
    TEST_ASSERT_FALSE(oc_gpio_take_mark(gpio, &at_ns));
    TEST_ASSERT_FALSE(oc_gpio_pulse_of(gpio, fake_now_ns(), &at_ns));
    TEST_ASSERT_FALSE(has_news(50));
}

static void open_enable(int level)
{
    config.enable.is_used = true;
    FAKE_CHANGE(FAKE_ENABLE, level, level);
    open_all_right();
}

static void the_enable_input_counts_from_the_start(void)
{
    open_enable(0);
    TEST_ASSERT_FALSE(oc_gpio_is_enabled(gpio));
    close_now();
    open_enable(1);
    TEST_ASSERT_TRUE(oc_gpio_is_enabled(gpio));
}

static void an_enable_input_that_cannot_be_read_is_told_at_the_start(void)
{
    config.enable.is_used = config.trigger.is_used = true;
    FAKE_CHANGE(FAKE_ENABLE, level, -1);
    gpio = oc_gpio_open(&config, &fake_ops, &counters, error, sizeof error);
    TEST_ASSERT_NULL(gpio);
    TEST_ASSERT_NOT_NULL(strstr(error, "enable"));
    TEST_ASSERT_EQUAL(1, fake_lines[FAKE_TRIGGER].n_closed);
    TEST_ASSERT_EQUAL(1, fake_lines[FAKE_ENABLE].n_closed);
}

static void the_enable_input_follows_its_edges(void)
{
    open_enable(1);
    const int64_t begin_ns = fake_now_ns();
    for (int i = 0; i < 40; i++) {
        const int level = i % 2;
        FAKE_CHANGE(FAKE_ENABLE, level, level);
        fake_edge(FAKE_ENABLE, level == 1, fake_now_ns());
        TEST_ASSERT_TRUE(has_news(60000));
        oc_gpio_clear(gpio);
        TEST_ASSERT_EQUAL(level == 1, oc_gpio_is_enabled(gpio));
        TEST_ASSERT_FALSE(has_news(0));
    }
    TEST_ASSERT_TRUE(fake_now_ns() - begin_ns < 25 * NS_PER_S); /* not only when it is read again, once a second */
}

static void a_quiet_input_costs_nothing(void)
{
    config.mark.is_used = true;
    open_enable(1);
    const int64_t begin_ns = fake_now_ns();
    FAKE_AWAIT(fake_look(FAKE_ENABLE).n_gets >= 3);
    fake_sleep_us(100000);
    const uint32_t n_gets = fake_look(FAKE_ENABLE).n_gets;
    TEST_ASSERT_TRUE(n_gets <= 2 + (fake_now_ns() - begin_ns) / NS_PER_S);
    TEST_ASSERT_EQUAL(0, fake_look(FAKE_MARK).n_takes);
}

static void a_lost_edge_of_the_enable_input_heals(void)
{
    open_enable(1);
    FAKE_CHANGE(FAKE_ENABLE, level, 0);
    TEST_ASSERT_TRUE(has_news(60000));
    TEST_ASSERT_FALSE(oc_gpio_is_enabled(gpio));
}

static void a_dead_enable_input_stays_as_it_was_and_is_told_once(void)
{
    open_enable(0);
    FAKE_CHANGE(FAKE_ENABLE, level, -1);
    FAKE_CHANGE(FAKE_ENABLE, is_dead, true);
    fake_edge(FAKE_ENABLE, true, fake_now_ns());
    FAKE_AWAIT(count_of(OC_COUNT_GPIO_FAULTS) > 0);
    const uint32_t n_gets = fake_look(FAKE_ENABLE).n_gets;
    FAKE_AWAIT(fake_look(FAKE_ENABLE).n_gets >= n_gets + 2); /* still asked now and then */
    TEST_ASSERT_FALSE(oc_gpio_is_enabled(gpio));
    TEST_ASSERT_EQUAL(1, count_of(OC_COUNT_GPIO_FAULTS));
    TEST_ASSERT_TRUE(fake_look(FAKE_ENABLE).n_takes <= 2); /* its edges no more */
    FAKE_CHANGE(FAKE_ENABLE, level, 1);
    FAKE_AWAIT(oc_gpio_is_enabled(gpio));
}

static void an_input_that_hangs_up_is_polled_no_more(void)
{
    config.mark.is_used = true;
    open_all_right();
    pthread_mutex_lock(&fake_lock);
    close(fake_lines[FAKE_MARK].pipe_fds[1]);
    fake_lines[FAKE_MARK].pipe_fds[1] = -1;
    pthread_mutex_unlock(&fake_lock);
    FAKE_AWAIT(count_of(OC_COUNT_GPIO_FAULTS) == 1);
    fake_sleep_us(200000);
    TEST_ASSERT_TRUE(fake_look(FAKE_MARK).n_takes <= 3);
    TEST_ASSERT_EQUAL(1, count_of(OC_COUNT_GPIO_FAULTS));
}

static void an_input_that_swings_without_end_does_not_hold_up_the_outputs(void)
{
    config.trigger.is_used = config.mark.is_used = true;
    FAKE_CHANGE(FAKE_MARK, is_swinging, true);
    open_all_right();
    fake_edge(FAKE_MARK, true, fake_now_ns()); /* never read: poll finds the line readable every time */
    FAKE_AWAIT(fake_look(FAKE_MARK).n_edges > 1000 && fake_count(FAKE_TRIGGER, false) >= 10);
    close_now();
}

/* ---- marks ---- */

static void a_mark_is_taken_once_with_its_time(void)
{
    config.mark.is_used = true;
    open_all_right();
    int64_t mark_ns = 0;
    TEST_ASSERT_FALSE(oc_gpio_take_mark(gpio, &mark_ns));
    fake_edge(FAKE_MARK, true, 123456789012);
    TEST_ASSERT_TRUE(has_news(60000));
    oc_gpio_clear(gpio);
    TEST_ASSERT_TRUE(oc_gpio_take_mark(gpio, &mark_ns));
    TEST_ASSERT_EQUAL_INT64(123456789012, mark_ns);
    TEST_ASSERT_FALSE(oc_gpio_take_mark(gpio, &mark_ns));
    TEST_ASSERT_EQUAL(0, count_of(OC_COUNT_MARKS_DROPPED));
}

/* Sends edges at once, and waits until the thread has them all. */
static void send_edges(const oc_gpio_edge_t *edges, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) fake_edge(FAKE_MARK, edges[i].is_active, edges[i].mono_ns);
    FAKE_AWAIT(fake_look(FAKE_MARK).n_edges == n);
    const uint32_t n_nones = fake_look(FAKE_MARK).n_nones;
    fake_edge(FAKE_MARK, false, edges[n - 1].mono_ns + 1); /* wakes it once more when it has read already */
    FAKE_AWAIT(fake_look(FAKE_MARK).n_edges == n + 1 && fake_look(FAKE_MARK).n_nones > n_nones);
}

static void a_switch_that_bounces_both_ways_is_one_mark(void)
{
    static const struct {
        bool is_active;
        int ms;
    } stroke[] = {{true, 1000},  {false, 1001}, {true, 1003},  {false, 1004}, {true, 1005},
                  {false, 1500}, {true, 1501},  {false, 1503}, {true, 1504},  {false, 1506}};
    enum { N = sizeof stroke / sizeof *stroke };
    oc_gpio_edge_t edges[N];
    for (int i = 0; i < N; i++) edges[i] = (oc_gpio_edge_t){stroke[i].is_active, stroke[i].ms * NS_PER_MS};
    config.mark.is_used = true;
    open_all_right();
    send_edges(edges, N);
    int64_t mark_ns;
    TEST_ASSERT_TRUE(oc_gpio_take_mark(gpio, &mark_ns));
    TEST_ASSERT_EQUAL_INT64(1000 * NS_PER_MS, mark_ns);
    TEST_ASSERT_EQUAL(0, count_of(OC_COUNT_MARKS_DROPPED));
}

static void of_several_marks_the_first_is_kept_and_the_rest_counted(void)
{
    enum { N = 100 };
    for (unsigned seed = 1; seed <= 20; seed++) {
        setUp();
        srand(seed);
        config.mark.is_used = true;
        config.mark_debounce_ms = seed % 4 * 25; /* 0 as well */
        oc_gpio_edge_t edges[N];
        int64_t at_ns = 5 * NS_PER_S, last_ns = INT64_MIN / 2, first_ns = 0;
        uint32_t n_marks = 0;
        for (int i = 0; i < N; i++) {
            at_ns += rand() % 3 ? rand() % 30 * NS_PER_MS : rand() % 200 * NS_PER_MS;
            edges[i] = (oc_gpio_edge_t){i % 2 == 0 || rand() % 10 == 0, at_ns};
            const bool is_mark = edges[i].is_active && at_ns - last_ns >= config.mark_debounce_ms * NS_PER_MS;
            if (is_mark && n_marks++ == 0) first_ns = at_ns;
            last_ns = at_ns;
        }
        open_all_right();
        send_edges(edges, N);
        char text[32];
        snprintf(text, sizeof text, "seed %u", seed);
        int64_t mark_ns = 0;
        TEST_ASSERT_TRUE_MESSAGE(oc_gpio_take_mark(gpio, &mark_ns), text);
        TEST_ASSERT_EQUAL_INT64_MESSAGE(first_ns, mark_ns, text);
        TEST_ASSERT_EQUAL_MESSAGE(n_marks - 1, count_of(OC_COUNT_MARKS_DROPPED), text);
        close_now();
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(nothing_wired_is_enabled_and_silent);
    RUN_TEST(the_enable_input_counts_from_the_start);
    RUN_TEST(an_enable_input_that_cannot_be_read_is_told_at_the_start);
    RUN_TEST(the_enable_input_follows_its_edges);
    RUN_TEST(a_quiet_input_costs_nothing);
    RUN_TEST(a_lost_edge_of_the_enable_input_heals);
    RUN_TEST(a_dead_enable_input_stays_as_it_was_and_is_told_once);
    RUN_TEST(an_input_that_hangs_up_is_polled_no_more);
    RUN_TEST(an_input_that_swings_without_end_does_not_hold_up_the_outputs);
    RUN_TEST(a_mark_is_taken_once_with_its_time);
    RUN_TEST(a_switch_that_bounces_both_ways_is_one_mark);
    RUN_TEST(of_several_marks_the_first_is_kept_and_the_rest_counted);
    return UNITY_END();
}
