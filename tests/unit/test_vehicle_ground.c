/* SPDX-License-Identifier: BSD-3-Clause
 * The ground filter inside the vehicle: which labels change when later views come, and which must not. */
#include "vehicle_rig.h"

void setUp(void)
{
    rig_set_up();
    config.stored_views = N_VIEWS;
    vehicle_start();
}

void tearDown(void)
{
    canaries_check();
}

static const oc_junction_t *junctions_of(uint16_t view, uint32_t *n)
{
    const oc_junction_t *junctions = NULL;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_junctions(vehicle, view, &junctions, n));
    return junctions;
}

static uint32_t count(uint16_t view, oc_label_t label)
{
    uint32_t n, found = 0;
    const oc_junction_t *junctions = junctions_of(view, &n);
    for (uint32_t i = 0; i < n; i++) found += junctions[i].label == label;
    return found;
}

/* The base never hears of them; to change them later would be to lose them twice. */
static void what_was_left_out_as_ground_stays_ground(void)
{
    static uint8_t at_push[N_VIEWS][OC_MAX_JUNCTIONS];
    uint32_t n_ground = 0;
    for (int i = 0; i < N_VIEWS; i++) {
        uint32_t n;
        const uint16_t view = push(i).view;
        const oc_junction_t *junctions = junctions_of(view, &n);
        for (uint32_t k = 0; k < n; k++) at_push[view][k] = junctions[k].label;
    }
    for (uint16_t view = 0; view < N_VIEWS; view++) {
        uint32_t n;
        const oc_junction_t *junctions = junctions_of(view, &n);
        for (uint32_t k = 0; k < n; k++) {
            if (at_push[view][k] != OC_LABEL_GROUND) continue;
            n_ground++;
            TEST_ASSERT_EQUAL(OC_LABEL_GROUND, junctions[k].label);
            TEST_ASSERT_GREATER_THAN(200, junctions[k].confidence);
        }
    }
    TEST_ASSERT_GREATER_THAN(50, n_ground);
}

static void the_first_view_is_decided_by_those_that_follow(void)
{
    const uint16_t first = push(1).view;
    uint32_t n;
    (void)junctions_of(first, &n);
    TEST_ASSERT_EQUAL(n, count(first, OC_LABEL_UNKNOWN));
    (void)push(2);
    const uint32_t open = count(first, OC_LABEL_UNKNOWN);
    TEST_ASSERT_LESS_THAN(n * 3 / 4, open);
    TEST_ASSERT_GREATER_THAN(n / 5, count(first, OC_LABEL_GROUND));
    TEST_ASSERT_GREATER_THAN(5, count(first, OC_LABEL_OBSTACLE));
    (void)push(3);
    TEST_ASSERT_LESS_OR_EQUAL(open, count(first, OC_LABEL_UNKNOWN));
}

static void the_same_frames_give_the_same_labels(void)
{
    static oc_junction_t before[N_VIEWS][OC_MAX_JUNCTIONS];
    uint32_t n_before[N_VIEWS], n;
    for (int run = 0; run < 2; run++) {
        vehicle_start();
        for (int i = 0; i < N_VIEWS; i++) (void)push(i);
        for (uint16_t view = 0; view < N_VIEWS; view++) {
            const oc_junction_t *junctions = junctions_of(view, &n);
            if (run == 1) TEST_ASSERT_EQUAL(n_before[view], n);
            for (uint32_t k = 0; k < n; k++) {
                if (run == 0) before[view][k] = junctions[k];
                TEST_ASSERT_EQUAL(before[view][k].label, junctions[k].label);
                TEST_ASSERT_EQUAL(before[view][k].confidence, junctions[k].confidence);
            }
            n_before[view] = n;
        }
    }
}

/* More judges find more of the ground, and call no more of the boxes ground. */
static void more_references_find_more_ground(void)
{
    uint32_t n_right[2] = {0}, n_wrong[2] = {0};
    for (int run = 0; run < 2; run++) {
        config.ground.max_references = run == 0 ? 1 : 4;
        vehicle_start();
        for (int i = 0; i < N_VIEWS; i++) (void)push(i);
        for (uint16_t view = 0; view < N_VIEWS; view++) {
            uint32_t n;
            const oc_junction_t *junctions = junctions_of(view, &n);
            for (uint32_t k = 0; k < n; k++) {
                if (junctions[k].label != OC_LABEL_GROUND) continue;
                const bool is_right = oc_scene_truth(&scene, &cameras[view], &junctions[k]) == OC_LABEL_GROUND;
                (is_right ? n_right : n_wrong)[run]++;
            }
        }
    }
    TEST_ASSERT_GREATER_THAN(n_right[0], n_right[1]);
    TEST_ASSERT_LESS_OR_EQUAL(n_right[1] / 50, n_wrong[1]);
}

int main(void)
{
    UNITY_BEGIN();
    scene_make();
    RUN_TEST(what_was_left_out_as_ground_stays_ground);
    RUN_TEST(the_first_view_is_decided_by_those_that_follow);
    RUN_TEST(the_same_frames_give_the_same_labels);
    RUN_TEST(more_references_find_more_ground);
    free(block);
    return UNITY_END();
}
