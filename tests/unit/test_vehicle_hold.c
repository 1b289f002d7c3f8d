/* SPDX-License-Identifier: BSD-3-Clause
 * Views that are held back until a mark, a recall or a resend sets them free. */
#include <stdio.h>

#include "vehicle_rig.h"

#define START_US 1700000000000000

static oc_view_part_t part_; /* 90 kB */

/* ---- what must happen, written down plainly ---- */

typedef struct model_view {
    uint16_t view;
    int64_t utime_us;
    bool is_held, is_announcement_due, is_unsent, is_again;
} model_view_t;

static model_view_t stored[4]; /* oldest first */
static uint32_t n_stored, n_recalled, n_dropped, n_pushed;

void setUp(void)
{
    rig_set_up();
    config.hold_views = true;
    config.keyframe.min_move_m = 0;
    config.keyframe.min_turn_rad = 0;
    config.keyframe.min_sharpness = 0;
    vehicle_start();
    n_stored = n_recalled = n_dropped = n_pushed = 0;
}

void tearDown(void)
{
    canaries_check();
}

static oc_push_report_t push_held(int i, bool is_forced)
{
    oc_frame_t frame = frame_of(i);
    frame.utime_us = START_US + 1000000 * (int64_t)n_pushed++;
    frame.is_forced = is_forced;
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_TRUE(report.is_keyframe);
    if (n_stored == 4) {
        n_dropped += !stored[0].is_held && stored[0].is_unsent;
        memmove(&stored[0], &stored[1], 3 * sizeof stored[0]);
        n_stored--;
    }
    stored[n_stored++] = (model_view_t){.view = report.view,
                                        .utime_us = frame.utime_us,
                                        .is_held = !is_forced,
                                        .is_announcement_due = !is_forced,
                                        .is_unsent = is_forced};
    return report;
}

static void model_free(model_view_t *view)
{
    if (!view->is_held) {
        view->is_again = view->is_again || !view->is_unsent;
        return;
    }
    view->is_held = view->is_announcement_due = false;
    view->is_unsent = true;
    n_recalled++;
}

static void recall(int64_t from_us, int64_t to_us)
{
    uint32_t n = 99, n_expected = 0;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_recall(vehicle, from_us, to_us, &n));
    for (uint32_t i = 0; i < n_stored; i++) {
        if (stored[i].utime_us < from_us || stored[i].utime_us > to_us) continue;
        model_free(&stored[i]);
        n_expected++;
    }
    TEST_ASSERT_EQUAL(n_expected, n);
}

static model_view_t *model_of(uint16_t view)
{
    for (uint32_t i = 0; i < n_stored; i++) {
        if (stored[i].view == view) return &stored[i];
    }
    TEST_FAIL_MESSAGE("a packet of a view that has left the ring");
    return NULL;
}

/* Everything that waits comes out, and it is what the model owes. */
static void drain_and_compare(void)
{
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    uint32_t n_announced[4] = {0}, n_whole[4] = {0};
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0;) {
        if (head.type == OC_PACKET_ANNOUNCE) {
            oc_announce_t announce;
            TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_announce(buf, n_bytes, &announce));
            n_announced[model_of(announce.view) - stored]++;
        } else if (head.type == OC_PACKET_VIEW) {
            TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part_));
            model_view_t *view = model_of(part_.head.view);
            TEST_ASSERT_FALSE_MESSAGE(view->is_held, "a held view was sent");
            n_whole[view - stored] += part_.head.is_last;
        } else {
            TEST_ASSERT_EQUAL(OC_PACKET_RELABEL, head.type);
            oc_relabel_t relabel;
            TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_relabel(buf, n_bytes, &relabel));
            TEST_ASSERT_FALSE_MESSAGE(model_of(relabel.view)->is_held, "a held view was relabelled");
        }
    }
    for (uint32_t i = 0; i < n_stored; i++) {
        TEST_ASSERT_EQUAL(stored[i].is_announcement_due, n_announced[i]);
        TEST_ASSERT_EQUAL(stored[i].is_unsent + stored[i].is_again, n_whole[i]);
        stored[i].is_announcement_due = stored[i].is_unsent = stored[i].is_again = false;
    }
}

/* ---- tests ---- */

static void a_held_view_is_announced_and_comes_whole_when_it_is_recalled(void)
{
    const oc_push_report_t report = push_held(0, false);
    TEST_ASSERT_TRUE(report.n_sent > 0);
    drain_and_compare();
    TEST_ASSERT_EQUAL(0, drain());
    recall(START_US + 1, START_US + 100); /* another time */
    TEST_ASSERT_EQUAL(0, drain());
    recall(START_US, START_US);
    drain_and_compare();
    TEST_ASSERT_EQUAL(1, counter(OC_COUNT_RECALLED));
    TEST_ASSERT_EQUAL(1, counter(OC_COUNT_VIEWS_SENT));
    recall(START_US, START_US); /* once more: it is no longer held, but sent again */
    drain_and_compare();
    TEST_ASSERT_EQUAL(1, counter(OC_COUNT_RECALLED));
}

static void labels_that_changed_while_it_was_held_follow(void)
{
    (void)push_held(0, false);
    drain_and_compare();
    (void)push_held(1, false); /* decides junctions of view 0 */
    drain_and_compare();
    recall(START_US, START_US);
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    uint32_t n_views = 0, n_relabels = 0;
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0;) {
        n_views += head.type == OC_PACKET_VIEW;
        if (head.type == OC_PACKET_RELABEL) TEST_ASSERT_TRUE_MESSAGE(n_views > 0, "labels before their view");
        n_relabels += head.type == OC_PACKET_RELABEL;
    }
    TEST_ASSERT_TRUE(n_views > 1 && n_relabels >= 1);
}

static void a_forced_view_goes_at_once_and_a_resend_sets_a_held_one_free(void)
{
    (void)push_held(0, true);
    (void)push_held(1, false);
    drain_and_compare();
    TEST_ASSERT_EQUAL(OC_OK, ask_resend(stored[1].view, 1));
    model_free(&stored[1]);
    drain_and_compare();
}

static void pixels_of_a_held_view_can_be_had(void)
{
    const oc_push_report_t report = push_held(0, false);
    TEST_ASSERT_EQUAL(OC_OK, ask_patch(report.view, 8, 0, 20));
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    TEST_ASSERT_TRUE(next(buf, &head) > 0 && head.type == OC_PACKET_ANNOUNCE);
    TEST_ASSERT_TRUE(next(buf, &head) > 0 && head.type == OC_PACKET_PATCH);
}

static void a_stretch_of_time_that_ends_before_it_begins_is_refused(void)
{
    uint32_t n = 7;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_vehicle_recall(vehicle, 2, 1, &n));
    TEST_ASSERT_EQUAL(7, n);
}

static void whatever_happens_is_what_the_plain_model_says(void)
{
    const unsigned seed = 20261125;
    printf("seed %u\n", seed);
    srand(seed);
    for (int i = 0; i < 600; i++) {
        const int what = rand() % 10;
        if (what < 4) {
            (void)push_held(rand() % N_VIEWS, rand() % 5 == 0);
        } else if (what < 6) {
            const int64_t from_us = START_US + 1000000 * (int64_t)(rand() % (int)(n_pushed + 1));
            recall(from_us - rand() % 6 * 1000000, from_us);
        } else if (what < 7 && n_stored > 0) {
            model_view_t *view = &stored[rand() % (int)n_stored];
            TEST_ASSERT_EQUAL(OC_OK, ask_resend(view->view, UINT32_MAX));
            model_free(view);
        } else {
            drain_and_compare();
        }
        TEST_ASSERT_EQUAL(n_recalled, counter(OC_COUNT_RECALLED));
        TEST_ASSERT_EQUAL(n_dropped, counter(OC_COUNT_VIEWS_DROPPED));
    }
    TEST_ASSERT_TRUE(n_recalled > 20 && n_dropped > 5 && n_pushed > 100);
}

int main(void)
{
    scene_make();
    UNITY_BEGIN();
    RUN_TEST(a_held_view_is_announced_and_comes_whole_when_it_is_recalled);
    RUN_TEST(labels_that_changed_while_it_was_held_follow);
    RUN_TEST(a_forced_view_goes_at_once_and_a_resend_sets_a_held_one_free);
    RUN_TEST(pixels_of_a_held_view_can_be_had);
    RUN_TEST(a_stretch_of_time_that_ends_before_it_begins_is_refused);
    RUN_TEST(whatever_happens_is_what_the_plain_model_says);
    free(block);
    return UNITY_END();
}
