/* SPDX-License-Identifier: BSD-3-Clause
 * What the vehicle sends: views, resends, relabels, patches, and how it meets a flood of requests. */
#include "vehicle_rig.h"

static oc_view_part_t part_; /* 90 kB */

void setUp(void)
{
    rig_set_up();
}

void tearDown(void)
{
    canaries_check();
}

/* ---- views out ---- */

static void a_view_comes_out_as_its_report_says(void)
{
    for (int i = 0; i < 3; i++) {
        const oc_push_report_t report = push(i);
        TEST_ASSERT_EQUAL(i, report.view);
        TEST_ASSERT_EQUAL(report.n_found, report.n_ground + report.n_obstacle + report.n_unknown);
        TEST_ASSERT_EQUAL(i > 0, report.n_ties > 0);
        TEST_ASSERT_EQUAL(i > 0, report.n_ground > 20);
        uint32_t n_junctions = 0, n_ties = 0, n_last = 0, n_parts = 0;
        uint8_t buf[OC_MAX_DATAGRAM_BYTES];
        oc_packet_head_t head;
        size_t n_bytes;
        while ((n_bytes = next(buf, &head)) > 0) {
            if (head.type != OC_PACKET_VIEW) continue;
            TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part_));
            TEST_ASSERT_EQUAL(n_parts++, part_.head.part);
            TEST_ASSERT_EQUAL(n_junctions, part_.first_junction);
            TEST_ASSERT_EQUAL(0, n_last);
            n_last += part_.head.is_last;
            n_junctions += part_.n_junctions;
            n_ties += part_.n_ties;
            for (uint32_t k = 0; k < part_.n_junctions; k++) {
                TEST_ASSERT_NOT_EQUAL(OC_LABEL_GROUND, part_.junctions[k].label);
            }
        }
        TEST_ASSERT_EQUAL(1, n_last);
        TEST_ASSERT_TRUE(n_parts > 1);
        TEST_ASSERT_EQUAL(report.n_sent, n_junctions);
        TEST_ASSERT_EQUAL(report.n_ties, n_ties);
    }
    TEST_ASSERT_EQUAL(3, counter(OC_COUNT_VIEWS_SENT));
    TEST_ASSERT_EQUAL(3, counter(OC_COUNT_FRAMES_IN));
}

static void newest_view_goes_first_and_sequence_numbers_ascend(void)
{
    (void)push(0);
    (void)push(1);
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    uint16_t last_view = 1, expected = 0;
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0;) {
        TEST_ASSERT_EQUAL(expected++, head.sequence);
        if (head.type != OC_PACKET_VIEW) continue;
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part_));
        TEST_ASSERT_TRUE(part_.head.view <= last_view);
        last_view = part_.head.view;
    }
    TEST_ASSERT_EQUAL(0, last_view);
    TEST_ASSERT_EQUAL(expected, oc_vehicle_next_sequence(vehicle));
}

static void a_buffer_smaller_than_the_datagram_is_refused(void)
{
    (void)push(0);
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes = 4242;
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_vehicle_next(vehicle, buf, config.datagram_bytes - 1u, &n_bytes));
    TEST_ASSERT_EQUAL(4242, n_bytes);
    TEST_ASSERT_TRUE(drain() > 1);
}

static void a_view_of_nothing_is_announced(void)
{
    static uint8_t flat[WIDTH * HEIGHT];
    memset(flat, 90, sizeof flat);
    oc_frame_t frame = frame_of(0);
    frame.image.px = flat;
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_EQUAL(0, report.n_sent);
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    oc_announce_t announce;
    size_t n_bytes = next(buf, &head);
    TEST_ASSERT_EQUAL(OC_PACKET_ANNOUNCE, head.type);
    TEST_ASSERT_TRUE(n_bytes <= 24);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_announce(buf, n_bytes, &announce));
    TEST_ASSERT_EQUAL(report.view, announce.view);
    TEST_ASSERT_TRUE(announce.utime_us == frame.utime_us);
    TEST_ASSERT_EQUAL(0, next(buf, &head));
    TEST_ASSERT_EQUAL(OC_OK, ask_resend(report.view, UINT32_MAX));
    TEST_ASSERT_TRUE(next(buf, &head) > 0);
    TEST_ASSERT_EQUAL(OC_PACKET_ANNOUNCE, head.type);
    TEST_ASSERT_EQUAL(0, next(buf, &head));
}

static void no_more_junctions_are_sent_than_configured_and_the_best_ones(void)
{
    config.max_sent_junctions = 20;
    vehicle_start();
    const oc_push_report_t report = push(0);
    TEST_ASSERT_EQUAL(20, report.n_sent);
    TEST_ASSERT_EQUAL(report.n_found - 20u, counter(OC_COUNT_JUNCTIONS_CAPPED));
    const oc_junction_t *all;
    uint32_t n;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_junctions(vehicle, report.view, &all, &n));
    TEST_ASSERT_EQUAL(report.n_found, n);
    for (uint32_t i = 20; i < n; i++) TEST_ASSERT_TRUE(all[i].score <= all[19].score);
}

static void the_tail_that_parts_do_not_hold_is_dropped_and_counted(void)
{
    config.max_sent_junctions = OC_MAX_JUNCTIONS;
    config.judoca.max_junctions = OC_MAX_JUNCTIONS;
    config.judoca.max_candidates = 8192;
    config.datagram_bytes = OC_MIN_DATAGRAM_BYTES;
    vehicle_start();
    /* Noise is full of junctions. */
    static uint8_t noise[WIDTH * HEIGHT];
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        noise[i] = (uint8_t)(oc_scene_hash((int32_t)(i % WIDTH / 7u), (int32_t)(i / WIDTH / 7u), 3) % 200u);
    }
    oc_frame_t frame = frame_of(0);
    frame.image.px = noise;
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_GREATER_THAN(600, report.n_found);
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    uint32_t n_junctions = 0, n_last = 0, n_parts = 0;
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0; n_parts++) {
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part_));
        n_junctions += part_.n_junctions;
        n_last += part_.head.is_last;
    }
    TEST_ASSERT_TRUE(n_parts <= 32);
    TEST_ASSERT_EQUAL(1, n_last);
    TEST_ASSERT_EQUAL(report.n_sent, n_junctions);
    TEST_ASSERT_TRUE(counter(OC_COUNT_JUNCTIONS_CAPPED) >= report.n_found - report.n_sent);
}

/* ---- resends and relabels ---- */

/* Same packet but for the sequence number and the CRC. */
static void expect_same_body(const uint8_t *a, size_t n_a, const uint8_t *b, size_t n_b)
{
    TEST_ASSERT_EQUAL(n_a, n_b);
    TEST_ASSERT_EQUAL_MEMORY(a, b, 2);
    TEST_ASSERT_EQUAL_MEMORY(a + 4, b + 4, n_a - 6u);
}

static void resends_repeat_the_same_bytes_whatever_came_between(void)
{
    static uint8_t first[32][OC_MAX_DATAGRAM_BYTES];
    size_t n_first[32];
    uint32_t n_parts = 0;
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    (void)push(0);
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0; n_parts++) {
        memcpy(first[n_parts], buf, n_bytes);
        n_first[n_parts] = n_bytes;
    }
    TEST_ASSERT_TRUE(n_parts >= 2);
    (void)push(1); /* relabels view 0 */
    (void)drain();

    TEST_ASSERT_EQUAL(OC_OK, ask_resend(0, UINT32_MAX));
    TEST_ASSERT_EQUAL(OC_OK, ask_resend(0, UINT32_MAX)); /* asking twice is asking once */
    uint32_t n_again = 0;
    bool has_relabel = false;
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0;) {
        has_relabel = has_relabel || head.type == OC_PACKET_RELABEL;
        if (head.type != OC_PACKET_VIEW) continue;
        expect_same_body(first[n_again], n_first[n_again], buf, n_bytes);
        n_again++;
    }
    TEST_ASSERT_EQUAL(n_parts, n_again);
    TEST_ASSERT_TRUE(has_relabel); /* what has changed since comes along */

    TEST_ASSERT_EQUAL(OC_OK, ask_resend(0, 2));
    const size_t n_bytes = next(buf, &head);
    expect_same_body(first[1], n_first[1], buf, n_bytes);
    (void)drain();
    TEST_ASSERT_EQUAL(OC_OK, ask_resend(0, 1u << 31)); /* there is no such part */
    TEST_ASSERT_EQUAL(0, drain());
}

/* The base's picture of a view after parts and relabels equals the vehicle's. */
static void relabels_carry_the_labels_in_transmit_order(void)
{
    static oc_junction_t known[OC_MAX_JUNCTIONS];
    uint32_t n_known = 0, n_relabels = 0, n_changed = 0;
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    oc_relabel_t relabel;
    (void)push(0);
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0;) {
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part_));
        memcpy(&known[n_known], part_.junctions, part_.n_junctions * sizeof *known);
        n_known += part_.n_junctions;
    }
    (void)push(1);
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0;) {
        if (head.type != OC_PACKET_RELABEL) continue;
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_relabel(buf, n_bytes, &relabel));
        TEST_ASSERT_EQUAL(0, relabel.view);
        n_relabels++;
        TEST_ASSERT_TRUE((uint32_t)relabel.first + relabel.n <= n_known);
        for (uint32_t k = 0; k < relabel.n; k++) {
            n_changed += known[relabel.first + k].label != relabel.labels[k];
            known[relabel.first + k].label = relabel.labels[k];
        }
    }
    TEST_ASSERT_TRUE(n_relabels >= 1 && n_changed > 20);
    const oc_junction_t *truth;
    uint32_t n;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_junctions(vehicle, 0, &truth, &n));
    for (uint32_t k = 0; k < n_known; k++) {
        uint32_t best = 0;
        float best_d = 1e9f;
        for (uint32_t i = 0; i < n; i++) {
            const float d = fabsf(truth[i].x_px - known[k].x_px) + fabsf(truth[i].y_px - known[k].y_px);
            if (d < best_d) best = i, best_d = d;
        }
        TEST_ASSERT_TRUE(best_d <= 0.13f);
        TEST_ASSERT_EQUAL(truth[best].label, known[k].label);
    }
    TEST_ASSERT_EQUAL(0, drain());
}

/* ---- patches ---- */

static void patches_cover_what_was_asked_once(void)
{
    (void)push(0);
    (void)drain();
    TEST_ASSERT_EQUAL(OC_OK, ask_patch(0, 12, 100, 200));
    TEST_ASSERT_EQUAL(OC_OK, ask_patch(0, 12, 150, 200)); /* overlaps: merged */
    TEST_ASSERT_EQUAL(OC_OK, ask_patch(0, 5, 100, 10));   /* coarser than what waits: nothing to add */
    bool is_seen[1200] = {false};
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    oc_patch_t *patch = malloc(sizeof *patch);
    uint32_t n = 0;
    double error = 0.0;
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0;) {
        TEST_ASSERT_EQUAL(OC_PACKET_PATCH, head.type);
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_patch(buf, n_bytes, patch));
        TEST_ASSERT_EQUAL(12, patch->quality);
        for (uint32_t b = 0; b < patch->n_blocks; b++, n++) {
            const uint32_t block_ = patch->blocks[b];
            TEST_ASSERT_FALSE(is_seen[block_]);
            is_seen[block_] = true;
            for (uint32_t k = 0; k < 64; k++) {
                const uint32_t x = block_ % 40u * 8u + k % 8u, y = block_ / 40u * 8u + k / 8u;
                error += fabs((double)patch->px[b][k] - (double)pixels[0][y * WIDTH + x]);
            }
        }
    }
    free(patch);
    TEST_ASSERT_EQUAL(250, n);
    for (uint32_t b = 100; b < 350; b++) TEST_ASSERT_TRUE(is_seen[b]);
    TEST_ASSERT_TRUE(error / (250.0 * 64.0) < 12.0);
}

static void a_flood_of_requests_is_refused_and_counted(void)
{
    for (int i = 0; i < 3; i++) (void)push(i);
    (void)drain();
    uint32_t n_taken = 0, n_refused = 0;
    for (uint16_t view = 0; view < 3; view++) {
        for (uint8_t quality = 1; quality <= 31; quality++) { /* finer each time: never covered by what waits */
            const oc_status_t status = ask_patch(view, quality, 3, 2);
            n_taken += status == OC_OK;
            n_refused += status == OC_E_SPACE;
        }
    }
    TEST_ASSERT_EQUAL(64, n_taken);
    TEST_ASSERT_EQUAL(93 - 64, n_refused);
    TEST_ASSERT_EQUAL(n_refused, counter(OC_COUNT_REQUESTS_FULL));
    TEST_ASSERT_EQUAL(64, drain());
    TEST_ASSERT_EQUAL(OC_OK, ask_patch(0, 9, 3, 2));
    TEST_ASSERT_EQUAL(1, drain());
}

static void ill_formed_requests_are_refused_and_counted(void)
{
    (void)push(0);
    (void)drain();
    TEST_ASSERT_EQUAL(OC_E_FORMAT, ask_patch(0, 9, 1199, 2)); /* 40 x 30 blocks */
    uint8_t buf[64] = {0};
    size_t n_bytes;
    const oc_packet_head_t head = {.type = OC_PACKET_ANNOUNCE, .vehicle = 7};
    const oc_announce_t announce = {.view = 0, .utime_us = 5};
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_announce(&head, &announce, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, oc_vehicle_handle(vehicle, buf, n_bytes)); /* not a request */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, oc_vehicle_handle(vehicle, buf, 3));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, oc_vehicle_handle(vehicle, NULL, 0));
    TEST_ASSERT_EQUAL(4, counter(OC_COUNT_REQUESTS_BAD));
    const oc_packet_head_t other = {.type = OC_PACKET_RESEND_REQUEST, .vehicle = 8};
    const oc_resend_request_t request = {.view = 0, .parts = 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_resend(&other, &request, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_handle(vehicle, buf, n_bytes)); /* another vehicle's */
    TEST_ASSERT_EQUAL(0, drain());
    TEST_ASSERT_EQUAL(4, counter(OC_COUNT_REQUESTS_BAD));
}

int main(void)
{
    UNITY_BEGIN();
    scene_make();
    RUN_TEST(a_view_comes_out_as_its_report_says);
    RUN_TEST(newest_view_goes_first_and_sequence_numbers_ascend);
    RUN_TEST(a_buffer_smaller_than_the_datagram_is_refused);
    RUN_TEST(a_view_of_nothing_is_announced);
    RUN_TEST(no_more_junctions_are_sent_than_configured_and_the_best_ones);
    RUN_TEST(the_tail_that_parts_do_not_hold_is_dropped_and_counted);
    RUN_TEST(resends_repeat_the_same_bytes_whatever_came_between);
    RUN_TEST(relabels_carry_the_labels_in_transmit_order);
    RUN_TEST(patches_cover_what_was_asked_once);
    RUN_TEST(a_flood_of_requests_is_refused_and_counted);
    RUN_TEST(ill_formed_requests_are_refused_and_counted);
    free(block);
    return UNITY_END();
}
