/* SPDX-License-Identifier: BSD-3-Clause
 * Poses of other programs: both types decoded, everything else refused. */
#include "unity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "bot_core_pose_t.h"
#include "core/camera.h"
#include "outcrop_pose_t.h"
#include "pose_lcm.h"

static uint8_t bytes[1024];
static int n_bytes;

void setUp(void) {}

void tearDown(void) {}

static void encode_outcrop(void)
{
    outcrop_pose_t out = {.utime = 1700000000000001, .position = {1, -2, 3}, .orientation = {0.5, 0.5, -0.5, 0.5}};
    out.has_covariance = 1;
    for (int i = 0; i < 36; i++) out.covariance[i] = i * 0.25;
    n_bytes = outcrop_pose_t_encode(bytes, 0, sizeof bytes, &out);
    TEST_ASSERT_EQUAL(outcrop_pose_t_encoded_size(&out), n_bytes);
}

static void encode_bot_core(double w, double x, double y, double z)
{
    const bot_core_pose_t out = {.utime = 77, .pos = {4, 5, 6}, .orientation = {w, x, y, z}};
    n_bytes = bot_core_pose_t_encode(bytes, 0, sizeof bytes, &out);
    TEST_ASSERT_TRUE(n_bytes > 0);
}

static void our_own_type_comes_through_as_it_is(void)
{
    oc_body_pose_t pose;
    encode_outcrop();
    TEST_ASSERT_TRUE(oc_pose_decode(OC_POSE_OUTCROP, bytes, (size_t)n_bytes, &pose));
    TEST_ASSERT_EQUAL_INT64(1700000000000001, pose.utime_us);
    TEST_ASSERT_TRUE(pose.position_m[1] == -2 && pose.q_wxyz[2] == -0.5 && pose.has_covariance);
    TEST_ASSERT_EQUAL_DOUBLE(35 * 0.25, pose.covariance[35]);
}

/* World directions of the body's forward, left and up. */
static void axes_are(double w, double x, double y, double z, const double forward[3], const double up[3])
{
    oc_body_pose_t pose;
    double R[9];
    encode_bot_core(w, x, y, z);
    TEST_ASSERT_TRUE(oc_pose_decode(OC_POSE_BOT_CORE, bytes, (size_t)n_bytes, &pose));
    TEST_ASSERT_FALSE(pose.has_covariance);
    TEST_ASSERT_EQUAL_INT64(77, pose.utime_us);
    TEST_ASSERT_EQUAL_DOUBLE(6, pose.position_m[2]);
    TEST_ASSERT_EQUAL(OC_OK, oc_rotation_from_quat(pose.q_wxyz, R));
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, forward[i], R[3 * i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, up[i], R[3 * i + 2]);
    }
}

/* bot_core's body has its z down: level and heading east it is turned by 180 degrees about x. */
static void a_body_with_z_down_is_turned_up(void)
{
    const double half = sqrt(0.5);
    axes_are(0, 1, 0, 0, (const double[]){1, 0, 0}, (const double[]){0, 0, 1});       /* level, east */
    axes_are(0, half, half, 0, (const double[]){0, 1, 0}, (const double[]){0, 0, 1}); /* level, north */
    axes_are(1, 0, 0, 0, (const double[]){1, 0, 0}, (const double[]){0, 0, -1});      /* on its back */
    axes_are(half, half, 0, 0, (const double[]){1, 0, 0}, (const double[]){0, 1, 0}); /* rolled to its right side */
}

static void the_fingerprint_is_the_published_one(void)
{
    encode_bot_core(1, 0, 0, 0);
    const uint64_t published = 0x170b77d82958082fu; /* of utime, pos, vel, orientation, rotation_rate, accel */
    const uint64_t folded = published << 1 | published >> 63;
    for (int i = 0; i < 8; i++) TEST_ASSERT_EQUAL_HEX8(folded >> (56 - 8 * i), bytes[i]);
    TEST_ASSERT_EQUAL(144, n_bytes);
}

static void what_is_cut_or_of_another_type_is_refused(void)
{
    oc_body_pose_t pose = {.utime_us = 5};
    for (int type = 0; type < 2; type++) {
        const oc_pose_type_t other = type == 0 ? OC_POSE_BOT_CORE : OC_POSE_OUTCROP;
        if (type == 0) {
            encode_outcrop();
        } else {
            encode_bot_core(1, 0, 0, 0);
        }
        TEST_ASSERT_FALSE(oc_pose_decode(other, bytes, (size_t)n_bytes, &pose));
        for (int n = 0; n < n_bytes + 40; n++) {
            uint8_t *exact = malloc((size_t)n + 1u); /* so that a sanitizer sees what is read beyond */
            memcpy(exact, bytes, (size_t)n);
            TEST_ASSERT_EQUAL(n == n_bytes, oc_pose_decode((oc_pose_type_t)type, exact, (size_t)n, &pose));
            free(exact);
        }
        for (int i = 0; i < 8; i++) {
            bytes[i] ^= 1;
            TEST_ASSERT_FALSE(oc_pose_decode((oc_pose_type_t)type, bytes, (size_t)n_bytes, &pose));
            bytes[i] ^= 1;
        }
    }
}

static void values_that_are_no_pose_do_not_get_past_the_track(void)
{
    oc_pose_track_t *track = oc_pose_track_create(8, 1000);
    srand(3);
    int n_taken = 0;
    for (int round = 0; round < 5000; round++) {
        encode_outcrop();
        bytes[8 + rand() % (n_bytes - 8)] ^= (uint8_t)(1 + rand() % 255);
        oc_body_pose_t pose;
        TEST_ASSERT_TRUE(oc_pose_decode(OC_POSE_OUTCROP, bytes, (size_t)n_bytes, &pose));
        n_taken += oc_pose_track_add(track, &pose) == OC_OK;
    }
    TEST_ASSERT_TRUE(n_taken < 5000);
    oc_pose_track_destroy(track);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(our_own_type_comes_through_as_it_is);
    RUN_TEST(a_body_with_z_down_is_turned_up);
    RUN_TEST(the_fingerprint_is_the_published_one);
    RUN_TEST(what_is_cut_or_of_another_type_is_refused);
    RUN_TEST(values_that_are_no_pose_do_not_get_past_the_track);
    return UNITY_END();
}
