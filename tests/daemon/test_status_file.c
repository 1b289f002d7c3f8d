/* SPDX-License-Identifier: BSD-3-Clause
 * The status file: whole, readable, honest about a daemon that is gone; and the percentiles in it. */
#include "unity.h"

#include <errno.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

#include "latency.h"
#include "status_file.h"

static char folder[] = "/tmp/outcrop-status-XXXXXX";
static char path[64];
static oc_latency_t latency, empty;
static oc_vehicle_status_t status;

void setUp(void)
{
    memset(&latency, 0, sizeof latency);
    memset(&status, 0, sizeof status);
}

void tearDown(void)
{
    unlink(path);
}

/* ---- percentiles ---- */

static int compare(const void *a, const void *b)
{
    const int64_t x = *(const int64_t *)a, y = *(const int64_t *)b;
    return (x > y) - (x < y);
}

static void percentiles_are_those_of_the_sorted_list(void)
{
    enum { N = 2000 };
    static int64_t us[N];
    srand(7);
    for (int round = 0; round < 20; round++) {
        memset(&latency, 0, sizeof latency);
        const int n = 1 + rand() % N;
        for (int i = 0; i < n; i++) {
            us[i] = rand() % (round % 2 ? 2000 : 450000);
            oc_latency_add(&latency, us[i]);
        }
        qsort(us, (size_t)n, sizeof *us, compare);
        for (int per_mille = 1; per_mille <= 1000; per_mille += 37) {
            const double share = per_mille / 1000.0;
            const int64_t exact = us[(int)ceil(share * n) - 1], got = oc_latency_percentile_us(&latency, share);
            TEST_ASSERT_TRUE_MESSAGE(got >= exact && got <= exact + OC_LATENCY_BIN_US, "one bin at most above");
        }
        TEST_ASSERT_EQUAL_INT64(us[n - 1], latency.max_us);
    }
}

static void what_is_longer_than_the_bins_is_told_by_the_longest(void)
{
    TEST_ASSERT_EQUAL_INT64(0, oc_latency_percentile_us(&empty, 0.99));
    oc_latency_add(&latency, 90000000);
    oc_latency_add(&latency, -5);
    TEST_ASSERT_EQUAL_INT64(90000000, oc_latency_percentile_us(&latency, 0.99));
    TEST_ASSERT_TRUE(oc_latency_percentile_us(&latency, 0.5) <= OC_LATENCY_BIN_US);
}

/* ---- the file ---- */

static size_t describe(const oc_capture_t *self, char *text, size_t text_bytes)
{
    (void)self;
    return (size_t)snprintf(text, text_bytes, "{\"name\":\"front\",\"state\":\"streaming\",\"frames\":12}");
}

static const oc_capture_t capture = {.describe = describe};

static bool write_file(const char *where, int64_t utime_us)
{
    const oc_status_report_t report = {.status = &status,
                                       .vehicle = 9,
                                       .utime_us = utime_us,
                                       .bytes_sent = 123456789012ull,
                                       .frame = &latency,
                                       .view = &empty,
                                       .capture = &capture};
    return oc_status_file_write(where, &report);
}

static int64_t now_us(void)
{
    struct timespec t;
    clock_gettime(CLOCK_REALTIME, &t);
    return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

static void the_file_is_json_with_every_counter(void)
{
    for (uint32_t i = 0; i < OC_N_COUNTERS; i++) status.counters[i] = UINT32_MAX - i;
    status.n_views = 3;
    status.newest_view = 2;
    oc_latency_add(&latency, 4200);
    TEST_ASSERT_TRUE(write_file(path, now_us()));
    json_error_t fault;
    json_t *root = json_load_file(path, JSON_REJECT_DUPLICATES, &fault);
    TEST_ASSERT_NOT_NULL_MESSAGE(root, fault.text);
    const json_t *counters = json_object_get(root, "counters");
    TEST_ASSERT_EQUAL(OC_N_COUNTERS, json_object_size(counters));
    for (uint32_t i = 0; i < OC_N_COUNTERS; i++)
        TEST_ASSERT_EQUAL_INT64(UINT32_MAX - i,
                                json_integer_value(json_object_get(counters, oc_counter_name((oc_counter_t)i))));
    TEST_ASSERT_EQUAL_INT64(123456789012ll, json_integer_value(json_object_get(root, "bytes_sent")));
    const json_t *cameras = json_object_get(root, "cameras");
    TEST_ASSERT_EQUAL_STRING("front", json_string_value(json_object_get(json_array_get(cameras, 0), "name")));
    json_decref(root);
    struct stat info;
    char beside[80];
    snprintf(beside, sizeof beside, "%s.new", path);
    TEST_ASSERT_EQUAL(-1, stat(beside, &info)); /* nothing half-written is left */
}

static void what_cannot_be_written_is_an_error(void)
{
    TEST_ASSERT_FALSE(write_file("/nowhere/at/all.json", 0));
    TEST_ASSERT_EQUAL(ENOENT, errno);
    static char too_long[700];
    memset(too_long, 'a', sizeof too_long - 1);
    TEST_ASSERT_FALSE(write_file(too_long, 0));
    TEST_ASSERT_EQUAL(ENAMETOOLONG, errno);
    TEST_ASSERT_FALSE(write_file(folder, 0)); /* a folder is there already */
    char beside[80];
    snprintf(beside, sizeof beside, "%s.new", folder);
    unlink(beside);
}

static void only_a_fresh_file_of_a_living_daemon_is_running(void)
{
    TEST_ASSERT_TRUE(write_file(path, now_us()));
    TEST_ASSERT_EQUAL(0, oc_status_file_print(path, false));
    TEST_ASSERT_EQUAL(0, oc_status_file_print(path, true));
    TEST_ASSERT_TRUE(write_file(path, now_us() - 60000000));
    TEST_ASSERT_EQUAL(1, oc_status_file_print(path, false));
    TEST_ASSERT_EQUAL(1, oc_status_file_print("/nowhere/at/all.json", false));

    static const char *const texts[] = {"", "[]", "{}", "{\"program\":3}", "{\"program\":\"outcropd\"}", "\xff"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        FILE *file = fopen(path, "w");
        fputs(texts[i], file);
        fclose(file);
        TEST_ASSERT_EQUAL_MESSAGE(1, oc_status_file_print(path, false), texts[i]);
    }
}

int main(void)
{
    if (!mkdtemp(folder)) return 1;
    snprintf(path, sizeof path, "%s/status.json", folder);
    UNITY_BEGIN();
    RUN_TEST(percentiles_are_those_of_the_sorted_list);
    RUN_TEST(what_is_longer_than_the_bins_is_told_by_the_longest);
    RUN_TEST(the_file_is_json_with_every_counter);
    RUN_TEST(what_cannot_be_written_is_an_error);
    RUN_TEST(only_a_fresh_file_of_a_living_daemon_is_running);
    const int failed = UNITY_END();
    rmdir(folder);
    return failed;
}
