/* SPDX-License-Identifier: BSD-3-Clause
 * The keyframe policy: movement, turning, sharpness, and that nothing starves it. */
#include "unity.h"

#include <string.h>

#include "thesis_tables.h"
#include "vehicle/keyframe.h"

static oc_keyframe_t policy;
static oc_keyframe_params_t params;

void setUp(void)
{
    params = oc_keyframe_defaults();
    params.min_move_m = 0.5;
    params.min_turn_rad = 0.2;
    oc_keyframe_init(&policy, &params);
}

void tearDown(void) {}

/* At (x, 0, 1), turned about the vertical. */
static oc_pose_t pose_at(double x_m, double pan_rad)
{
    oc_pose_t pose;
    double R[9];
    const double centre[3] = {x_m, 0.0, 1.0};
    oc_thesis_from_pts(pan_rad, OC_TEST_RAD(70.0), 0.0, R);
    oc_cv_from_thesis(R, R);
    oc_pose_from_centre(R, centre, &pose);
    return pose;
}

static bool offer(double x_m, double pan_rad, float sharpness)
{
    const oc_pose_t pose = pose_at(x_m, pan_rad);
    const bool is_wanted = oc_keyframe_wants(&policy, &pose, sharpness);
    if (is_wanted) oc_keyframe_accept(&policy, &pose);
    return is_wanted;
}

static void first_frame_is_taken_even_when_blurred(void)
{
    TEST_ASSERT_TRUE(offer(0.0, 0.0, 0.0f));
}

static void frames_are_taken_after_moving_far_enough(void)
{
    TEST_ASSERT_TRUE(offer(0.0, 0.0, 100.0f));
    TEST_ASSERT_FALSE(offer(0.49, 0.0, 100.0f));
    TEST_ASSERT_TRUE(offer(0.51, 0.0, 100.0f));
    TEST_ASSERT_FALSE(offer(0.9, 0.0, 100.0f)); /* counted from the last keyframe */
    TEST_ASSERT_TRUE(offer(1.02, 0.0, 100.0f));
}

static void frames_are_taken_after_turning_far_enough(void)
{
    TEST_ASSERT_TRUE(offer(0.0, 0.0, 100.0f));
    TEST_ASSERT_FALSE(offer(0.0, 0.19, 100.0f)); /* pan turns about the vertical: the whole angle */
    TEST_ASSERT_TRUE(offer(0.0, 0.21, 100.0f));
    TEST_ASSERT_FALSE(offer(0.0, 0.21, 100.0f));
}

static void blurred_frames_wait_for_a_sharp_one_but_not_for_ever(void)
{
    TEST_ASSERT_TRUE(offer(0.0, 0.0, 100.0f));
    TEST_ASSERT_FALSE(offer(0.6, 0.0, 30.0f));
    TEST_ASSERT_TRUE(offer(0.6, 0.0, 95.0f));
    TEST_ASSERT_FALSE(offer(1.2, 0.0, 30.0f));
    TEST_ASSERT_TRUE(offer(1.61, 0.0, 30.0f)); /* twice the distance */
}

static void sharpness_follows_a_duller_scene(void)
{
    TEST_ASSERT_TRUE(offer(0.0, 0.0, 100.0f));
    bool is_taken = false;
    for (int i = 0; i < 40 && !is_taken; i++) is_taken = offer(0.6, 0.0, 20.0f);
    TEST_ASSERT_TRUE(is_taken);
}

static void policy_does_not_move_before_a_frame_is_accepted(void)
{
    const oc_pose_t start = pose_at(0.0, 0.0), far = pose_at(3.0, 0.0);
    TEST_ASSERT_TRUE(oc_keyframe_wants(&policy, &start, 1.0f));
    oc_keyframe_accept(&policy, &start);
    TEST_ASSERT_TRUE(oc_keyframe_wants(&policy, &far, 1.0f));
    TEST_ASSERT_TRUE(oc_keyframe_wants(&policy, &far, 1.0f));
}

static void sharpness_is_the_mean_squared_laplacian(void)
{
    enum { N = 32 };
    uint8_t px[N * N];
    const oc_image_t image = {px, N, N, N, 1};
    memset(px, 77, sizeof px);
    TEST_ASSERT_EQUAL_FLOAT(0.0f, oc_keyframe_sharpness(&image));
    /* A slope has none. */
    for (int i = 0; i < N * N; i++) px[i] = (uint8_t)(4 * (i / N) + 2 * (i % N));
    TEST_ASSERT_EQUAL_FLOAT(0.0f, oc_keyframe_sharpness(&image));
    /* Every pixel of one colour of a chessboard of 0 and 10: |4 * 10|. */
    for (int i = 0; i < N * N; i++) px[i] = (uint8_t)(10 * ((i / N + i % N) % 2));
    TEST_ASSERT_EQUAL_FLOAT(1600.0f, oc_keyframe_sharpness(&image));
}

static void parameters_outside_their_ranges_are_refused(void)
{
    oc_keyframe_params_t p;
    TEST_ASSERT_TRUE(oc_keyframe_params_are_valid(&params));
    p = params, p.min_move_m = (double)NAN;
    TEST_ASSERT_FALSE(oc_keyframe_params_are_valid(&p));
    p = params, p.min_turn_rad = -0.1;
    TEST_ASSERT_FALSE(oc_keyframe_params_are_valid(&p));
    p = params, p.min_sharpness = 1.1f;
    TEST_ASSERT_FALSE(oc_keyframe_params_are_valid(&p));
    p = params, p.sharpness_gain = 0.0f;
    TEST_ASSERT_FALSE(oc_keyframe_params_are_valid(&p));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(first_frame_is_taken_even_when_blurred);
    RUN_TEST(frames_are_taken_after_moving_far_enough);
    RUN_TEST(frames_are_taken_after_turning_far_enough);
    RUN_TEST(blurred_frames_wait_for_a_sharp_one_but_not_for_ever);
    RUN_TEST(sharpness_follows_a_duller_scene);
    RUN_TEST(policy_does_not_move_before_a_frame_is_accepted);
    RUN_TEST(sharpness_is_the_mean_squared_laplacian);
    RUN_TEST(parameters_outside_their_ranges_are_refused);
    return UNITY_END();
}
