/* SPDX-License-Identifier: BSD-3-Clause
 * The link's framing: packets round trip, everything else is refused. */
#include "unity.h"

#include <lcm/lcm.h>
#include <stdlib.h>
#include <string.h>

#include "link_lcm.h"
#include "outcrop_packet_t.h"

#define CHANNEL "OCD"

static uint8_t packet[OC_MAX_DATAGRAM_BYTES], payload[OC_MAX_DATAGRAM_BYTES + OC_LCM_PAYLOAD_BYTES + 1u];
static char error[512];
static uint8_t heard[OC_MAX_DATAGRAM_BYTES];
static size_t heard_bytes;
static int n_heard;

void setUp(void)
{
    for (size_t i = 0; i < sizeof packet; i++) packet[i] = (uint8_t)(i * 7 + 3);
    n_heard = 0;
}

void tearDown(void) {}

static void on_packet(void *user, const uint8_t *bytes, size_t n_bytes)
{
    TEST_ASSERT_EQUAL_PTR(packet, user);
    memcpy(heard, bytes, n_bytes);
    heard_bytes = n_bytes;
    n_heard++;
}

static oc_link_t *open_memq(void)
{
    oc_link_t *link = oc_link_open("memq://", CHANNEL, "memq://", CHANNEL, on_packet, packet, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(link, error);
    return link;
}

static void a_wrapped_packet_unwraps_to_itself(void)
{
    for (size_t n = 1; n <= OC_MAX_DATAGRAM_BYTES; n++) {
        TEST_ASSERT_EQUAL(n + OC_LCM_PAYLOAD_BYTES, oc_link_wrap(packet, n, payload));
        size_t n_bytes = 0;
        const uint8_t *inside = oc_link_unwrap(payload, n + OC_LCM_PAYLOAD_BYTES, &n_bytes);
        TEST_ASSERT_NOT_NULL(inside);
        TEST_ASSERT_EQUAL(n, n_bytes);
        TEST_ASSERT_EQUAL_MEMORY(packet, inside, n);
    }
}

static void the_payload_is_what_lcm_itself_would_make(void)
{
    outcrop_packet_t message = {.n = 300, .data = packet};
    uint8_t theirs[400];
    const int n_theirs = outcrop_packet_t_encode(theirs, 0, sizeof theirs, &message);
    TEST_ASSERT_EQUAL(310, n_theirs);
    TEST_ASSERT_EQUAL(310, oc_link_wrap(packet, 300, payload));
    TEST_ASSERT_EQUAL_MEMORY(theirs, payload, 310);
}

static void what_is_no_packet_is_refused(void)
{
    const size_t n = 100, whole = n + OC_LCM_PAYLOAD_BYTES;
    size_t n_bytes = 55;
    for (size_t i = 0; i < OC_LCM_PAYLOAD_BYTES; i++) { /* wrong fingerprint, wrong n */
        oc_link_wrap(packet, n, payload);
        payload[i] ^= 1;
        TEST_ASSERT_NULL(oc_link_unwrap(payload, whole, &n_bytes));
    }
    oc_link_wrap(packet, n, payload);
    for (size_t cut = 0; cut < whole; cut++) TEST_ASSERT_NULL(oc_link_unwrap(payload, cut, &n_bytes));
    TEST_ASSERT_NULL(oc_link_unwrap(payload, whole + 1, &n_bytes));
    oc_link_wrap(packet, 0, payload);
    TEST_ASSERT_NULL(oc_link_unwrap(payload, OC_LCM_PAYLOAD_BYTES, &n_bytes)); /* empty */
    oc_link_wrap(packet, OC_MAX_DATAGRAM_BYTES, payload);
    payload[8] = (OC_MAX_DATAGRAM_BYTES + 1u) >> 8;
    payload[9] = (OC_MAX_DATAGRAM_BYTES + 1u) & 0xffu;
    TEST_ASSERT_NULL(oc_link_unwrap(payload, sizeof payload, &n_bytes)); /* oversize */
    TEST_ASSERT_EQUAL(55, n_bytes);
}

static void packets_cross_memq_and_others_are_counted(void)
{
    oc_link_t *link = open_memq();
    TEST_ASSERT_TRUE(oc_link_send(link, packet, 700));
    TEST_ASSERT_EQUAL(1, oc_link_handle(link, 100));
    TEST_ASSERT_EQUAL(1, n_heard);
    TEST_ASSERT_EQUAL(700, heard_bytes);
    TEST_ASSERT_EQUAL_MEMORY(packet, heard, 700);
    TEST_ASSERT_EQUAL(0, oc_link_handle(link, 10));

    TEST_ASSERT_FALSE(oc_link_send(link, packet, 0));
    TEST_ASSERT_FALSE(oc_link_send(link, packet, OC_MAX_DATAGRAM_BYTES + 1u));
    const oc_link_counts_t counts = oc_link_get_counts(link);
    TEST_ASSERT_EQUAL_UINT64(1, counts.sent);
    TEST_ASSERT_EQUAL_UINT64(2, counts.send_failed);
    TEST_ASSERT_EQUAL_UINT64(1, counts.received);
    TEST_ASSERT_EQUAL_UINT64(0, counts.ill_formed);
    oc_link_close(link);
}

static void says_in_one_line_what_is_wrong_with_a_url(void)
{
    static const char *const urls[] = {"udpm://1.2.3:7667", "udpm://239.0.0.1:99999?ttl=0", "udpm://somewhere:7667",
                                       "nonsense"};
    for (size_t i = 0; i < sizeof urls / sizeof *urls; i++) {
        error[0] = '\0';
        TEST_ASSERT_NULL_MESSAGE(oc_link_open(urls[i], "A", "memq://", "B", on_packet, packet, error, sizeof error),
                                 urls[i]);
        TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, urls[i]), error);
        TEST_ASSERT_NULL_MESSAGE(strchr(error, '\n'), error);
    }
    TEST_ASSERT_TRUE(oc_link_has_route("memq://", error, sizeof error));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_wrapped_packet_unwraps_to_itself);
    RUN_TEST(the_payload_is_what_lcm_itself_would_make);
    RUN_TEST(what_is_no_packet_is_refused);
    RUN_TEST(packets_cross_memq_and_others_are_counted);
    RUN_TEST(says_in_one_line_what_is_wrong_with_a_url);
    return UNITY_END();
}
