/* SPDX-License-Identifier: BSD-3-Clause
 * Monotonic time to UTC, read through a clock of the test's own. */
#include "unity.h"

#include <stdio.h>
#include <stdlib.h>

#include "clock_map.h"

static int64_t true_ns, offset_ns, width_ns;

void setUp(void)
{
    true_ns = 1000000000000;
    offset_ns = 1700000000000000000;
}

void tearDown(void) {}

/* Readings take up to width_ns, UTC is read anywhere between. */
static void read_noisily(int64_t *before_ns, int64_t *utc_ns, int64_t *after_ns)
{
    const int64_t took_ns = rand() % width_ns;
    *before_ns = true_ns;
    *utc_ns = true_ns + offset_ns + (took_ns > 0 ? rand() % took_ns : 0);
    true_ns += took_ns;
    *after_ns = true_ns;
}

static void the_offset_is_right_within_the_uncertainty_it_tells(void)
{
    const unsigned seed = 3;
    printf("seed %u\n", seed);
    srand(seed);
    for (int i = 0; i < 5000; i++) {
        oc_clock_map_t map = {.is_set = false};
        width_ns = 1 + rand() % 100000;
        offset_ns = 1600000000000000000 + (int64_t)rand() * 100000000;
        TEST_ASSERT_FALSE(oc_clock_map_update(&map, true_ns, 1000000000, read_noisily));
        TEST_ASSERT_TRUE(llabs(map.offset_ns - offset_ns) <= map.uncertainty_ns);
        TEST_ASSERT_TRUE(map.uncertainty_ns <= width_ns);
        const int64_t utime_us = oc_clock_map_utime_us(&map, true_ns);
        TEST_ASSERT_TRUE(llabs(utime_us * 1000 - (true_ns + offset_ns)) <= map.uncertainty_ns + 500);
    }
}

static void it_is_read_once_a_second_and_a_step_is_told_from_slewing(void)
{
    oc_clock_map_t map = {.is_set = false};
    width_ns = 1000;
    TEST_ASSERT_FALSE(oc_clock_map_update(&map, true_ns, 1000000000, read_noisily));
    const int64_t first_ns = map.read_ns, first_offset_ns = map.offset_ns;
    offset_ns += 5000000000;
    TEST_ASSERT_FALSE(oc_clock_map_update(&map, first_ns + 999999999, 1000000000, read_noisily)); /* not yet */
    TEST_ASSERT_EQUAL_INT64(first_offset_ns, map.offset_ns);
    TEST_ASSERT_TRUE(oc_clock_map_update(&map, first_ns + 1000000000, 1000000000, read_noisily));
    for (int i = 2; i < 100; i++) {
        offset_ns += i % 2 ? 500000 : -500000; /* 500 ppm either way */
        TEST_ASSERT_FALSE(oc_clock_map_update(&map, first_ns + i * 1000000000LL, 1000000000, read_noisily));
        TEST_ASSERT_TRUE(llabs(map.offset_ns - offset_ns) <= map.uncertainty_ns);
    }
    offset_ns -= 3600000000000;
    TEST_ASSERT_TRUE(oc_clock_map_update(&map, first_ns + 200000000000LL, 1000000000, read_noisily));
}

static void the_systems_own_clocks_agree_with_it(void)
{
    oc_clock_map_t map = {.is_set = false};
    (void)oc_clock_map_update(&map, oc_mono_ns(), 1000000000, NULL);
    TEST_ASSERT_TRUE(map.is_set && map.uncertainty_ns >= 0);
    TEST_ASSERT_TRUE(oc_clock_map_utime_us(&map, oc_mono_ns()) > 1600000000000000); /* after 2020 */
    TEST_ASSERT_EQUAL_INT64(0, oc_clock_map_utime_us(&map, -map.offset_ns - 5000)); /* never before 1970 */
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_offset_is_right_within_the_uncertainty_it_tells);
    RUN_TEST(it_is_read_once_a_second_and_a_step_is_told_from_slewing);
    RUN_TEST(the_systems_own_clocks_agree_with_it);
    return UNITY_END();
}
