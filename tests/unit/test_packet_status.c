/* SPDX-License-Identifier: BSD-3-Clause
 * The small packets: announcements, status with its counters, recall requests. */
#include "unity.h"

#include <stdio.h>

#include "core/packet.h"

static const oc_packet_head_t sender = {.vehicle = 3, .sequence = 65535};
static uint8_t buf[OC_MAX_DATAGRAM_BYTES];
static size_t n_bytes;

void setUp(void) {}

void tearDown(void) {}

static void announcements_and_status_are_small_and_come_back(void)
{
    const oc_announce_t announce = {.view = 65535, .utime_us = ((int64_t)1 << 56) - 1};
    oc_announce_t announce_back;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_announce(&sender, &announce, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_TRUE(n_bytes <= 24);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_announce(buf, n_bytes, &announce_back));
    TEST_ASSERT_TRUE(announce_back.view == 65535 && announce_back.utime_us == announce.utime_us);

    oc_vehicle_status_t status = {.uptime_s = UINT32_MAX, .n_views = 3, .newest_view = 2, .bytes_sent = 77};
    oc_vehicle_status_t status_back;
    status.counters[OC_COUNT_SEND_FAILED] = UINT32_MAX;
    status.counters[OC_COUNT_FRAMES_IN] = 1;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_status(&sender, &status, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_TRUE(n_bytes <= 100);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_status(buf, n_bytes, &status_back));
    TEST_ASSERT_TRUE(status_back.uptime_s == UINT32_MAX && status_back.n_views == 3 && status_back.newest_view == 2);
    TEST_ASSERT_TRUE(status_back.bytes_sent == 77 && !status_back.is_source_done);
    TEST_ASSERT_EQUAL_UINT32((1u << 30) - 1u, status_back.counters[OC_COUNT_SEND_FAILED]);
    TEST_ASSERT_EQUAL_UINT32(1, status_back.counters[OC_COUNT_FRAMES_IN]);
}

static void a_status_fits_the_smallest_datagram_whatever_it_counts(void)
{
    oc_vehicle_status_t status = {
        .uptime_s = UINT32_MAX, .n_views = UINT16_MAX, .newest_view = UINT16_MAX, .bytes_sent = UINT32_MAX};
    status.area = (oc_area_t){true, -3.5, 3.5, -3.25, 3.5, 1.5};
    for (int i = 0; i < OC_N_COUNTERS; i++) status.counters[i] = UINT32_MAX;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_status(&sender, &status, buf, OC_MIN_DATAGRAM_BYTES, &n_bytes));
    printf("largest status: %zu bytes\n", n_bytes);

    /* A year at 30 frames a second with one view and ten poses a second, and a thousand of everything that goes wrong. */
    for (int i = 0; i < OC_N_COUNTERS; i++) status.counters[i] = 1000;
    status.counters[OC_COUNT_FRAMES_IN] = status.counters[OC_COUNT_FRAMES_NOT_KEY] = 946080000;
    status.counters[OC_COUNT_VIEWS_SENT] = 31536000;
    status.counters[OC_COUNT_POSES_IN] = 315360000;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_status(&sender, &status, buf, OC_MIN_DATAGRAM_BYTES, &n_bytes));
    printf("after a bad year: %zu bytes\n", n_bytes);
    TEST_ASSERT_TRUE(n_bytes <= 120);

    /* A good month: what has never gone wrong costs a bit. */
    for (int i = 0; i < OC_N_COUNTERS; i++) {
        const bool is_normal = i <= OC_COUNT_VIEWS_SENT || i == OC_COUNT_POSES_IN || i == OC_COUNT_CAMERA_OPENED;
        status.counters[i] = is_normal ? 80000000 : 0;
    }
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_status(&sender, &status, buf, OC_MIN_DATAGRAM_BYTES, &n_bytes));
    printf("after a good month: %zu bytes\n", n_bytes);
    TEST_ASSERT_TRUE(n_bytes <= 80);
}

static void recall_requests_come_back(void)
{
    oc_recall_request_t back;
    const oc_recall_request_t good[] = {{.is_relative = true, .last_ms = UINT32_MAX},
                                        {.is_relative = true, .last_ms = 0},
                                        {.from_us = 0, .to_us = ((int64_t)1 << 56) - 1},
                                        {.from_us = 77, .to_us = 77}};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_recall(&sender, &good[i], buf, sizeof buf, &n_bytes));
        TEST_ASSERT_TRUE(n_bytes <= 24);
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_recall(buf, n_bytes, &back));
        TEST_ASSERT_TRUE(back.is_relative == good[i].is_relative && back.last_ms == good[i].last_ms);
        TEST_ASSERT_TRUE(back.from_us == good[i].from_us && back.to_us == good[i].to_us);
    }
    const oc_recall_request_t bad[] = {
        {.from_us = 2, .to_us = 1}, {.from_us = -1, .to_us = 1}, {.to_us = (int64_t)1 << 56}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_recall(&sender, &bad[i], buf, sizeof buf, &n_bytes));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(announcements_and_status_are_small_and_come_back);
    RUN_TEST(a_status_fits_the_smallest_datagram_whatever_it_counts);
    RUN_TEST(recall_requests_come_back);
    return UNITY_END();
}
