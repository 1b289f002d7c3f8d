/* SPDX-License-Identifier: BSD-3-Clause
 * Body poses over time against closed forms, and two threads at one track. */
#include "unity.h"

#include <math.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pose_track.h"

#define PI 3.14159265358979323846
#define T0 1700000000000000

static oc_pose_track_t *track;

void setUp(void)
{
    track = oc_pose_track_create(16, 250000);
    TEST_ASSERT_NOT_NULL(track);
}

void tearDown(void)
{
    oc_pose_track_destroy(track);
}

static double uniform(double low, double high)
{
    return low + (high - low) * rand() / RAND_MAX;
}

/* A turn by an angle about an axis. */
static void turn(const double axis[3], double angle, double q[4])
{
    const double n = sqrt(axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2]);
    q[0] = cos(angle / 2);
    for (int i = 0; i < 3; i++) q[1 + i] = sin(angle / 2) * axis[i] / n;
}

static void multiply(const double a[4], const double b[4], double out[4])
{
    out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

static oc_body_pose_t pose_at(int64_t utime_us)
{
    return (oc_body_pose_t){.utime_us = utime_us, .q_wxyz = {1, 0, 0, 0}};
}

static void between_two_poses_it_moves_evenly_and_turns_on_the_shorter_arc(void)
{
    const unsigned seed = 7;
    printf("seed %u\n", seed);
    srand(seed);
    for (int round = 0; round < 500; round++) {
        oc_pose_track_destroy(track);
        track = oc_pose_track_create(4, 250000);
        oc_body_pose_t a = pose_at(T0), b = pose_at(T0 + 1 + rand() % 250000), got;
        const double axis[3] = {uniform(-1, 1), uniform(-1, 1), uniform(0.1, 1)}, angle = uniform(0, PI - 0.01);
        double step[4], start_axis[3] = {uniform(-1, 1), uniform(0.1, 1), uniform(-1, 1)};
        turn(start_axis, uniform(-PI, PI), a.q_wxyz);
        turn(axis, angle, step);
        multiply(step, a.q_wxyz, b.q_wxyz);
        const double sign = rand() % 2 ? 1 : -1; /* the same turn by the other name */
        for (int i = 0; i < 4; i++) b.q_wxyz[i] *= sign;
        for (int i = 0; i < 3; i++) {
            a.position_m[i] = uniform(-100, 100);
            b.position_m[i] = a.position_m[i] + uniform(-1, 1);
        }
        TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(track, &a));
        TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(track, &b));
        const int64_t at_us = T0 + rand() % (b.utime_us - T0 + 1);
        const double share = (double)(at_us - T0) / (double)(b.utime_us - T0);
        TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, at_us, &got));
        TEST_ASSERT_EQUAL_INT64(at_us, got.utime_us);
        double part[4], expected[4];
        turn(axis, share * angle, part);
        multiply(part, a.q_wxyz, expected);
        double dot = 0;
        for (int i = 0; i < 4; i++) dot += expected[i] * got.q_wxyz[i];
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1, fabs(dot));
        for (int i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, a.position_m[i] + share * (b.position_m[i] - a.position_m[i]),
                                      got.position_m[i]);
    }
}

static void nothing_is_guessed_outside_or_across_a_gap(void)
{
    oc_body_pose_t got, pose;
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, oc_pose_track_at(track, T0, &got));
    TEST_ASSERT_EQUAL_INT64(INT64_MIN, oc_pose_track_newest_us(track));
    const int64_t times[] = {T0, T0 + 250000, T0 + 500001, T0 + 600000};
    for (int i = 0; i < 4; i++) {
        pose = pose_at(times[i]);
        TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(track, &pose));
    }
    TEST_ASSERT_EQUAL_INT64(T0 + 600000, oc_pose_track_newest_us(track));
    TEST_ASSERT_EQUAL(OC_POSE_NEVER, oc_pose_track_at(track, T0 - 1, &got));
    TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, T0, &got));
    TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, T0 + 125000, &got));
    TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, T0 + 250000, &got));    /* at the edge of the gap */
    TEST_ASSERT_EQUAL(OC_POSE_NEVER, oc_pose_track_at(track, T0 + 250001, &got)); /* one microsecond too wide */
    TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, T0 + 500001, &got));
    TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, T0 + 600000, &got));
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, oc_pose_track_at(track, T0 + 600001, &got));
}

static void the_ring_keeps_the_newest(void)
{
    oc_body_pose_t got;
    for (int i = 0; i < 100; i++) {
        oc_body_pose_t pose = pose_at(T0 + i * 100000);
        pose.position_m[0] = i;
        TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(track, &pose));
        pose.utime_us -= i % 2;
        TEST_ASSERT_EQUAL(OC_E_STATE, oc_pose_track_add(track, &pose)); /* not newer */
        for (int k = i; k >= 0; k--) {
            const oc_pose_answer_t answer = oc_pose_track_at(track, T0 + k * 100000, &got);
            TEST_ASSERT_EQUAL(k > i - 16 ? OC_POSE_OK : OC_POSE_NEVER, answer);
            if (answer == OC_POSE_OK) TEST_ASSERT_EQUAL_DOUBLE(k, got.position_m[0]);
        }
    }
}

static void what_is_no_pose_is_refused(void)
{
    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    oc_body_pose_t pose;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            pose = pose_at(T0);
            pose.position_m[k] = bad[i];
            TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose));
        }
        for (int k = 0; k < 4; k++) {
            pose = pose_at(T0);
            pose.q_wxyz[k] = bad[i];
            TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose));
        }
        for (int k = 0; k < 36; k++) {
            pose = pose_at(T0);
            pose.has_covariance = true;
            pose.covariance[k] = bad[i];
            TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose));
        }
    }
    const double norms[] = {0, 0.998, 1.002, 2, -1.002};
    for (int i = 0; i < 5; i++) {
        pose = pose_at(T0);
        pose.q_wxyz[0] = norms[i];
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose));
    }
    TEST_ASSERT_EQUAL_INT64(INT64_MIN, oc_pose_track_newest_us(track));
}

/* A A^T with A of the given rank. */
static void random_covariance(int rank, double scale, double c[36])
{
    double a[36];
    for (int i = 0; i < 36; i++) a[i] = i % 6 < rank ? uniform(-scale, scale) : 0;
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++) {
            c[6 * i + j] = 0;
            for (int k = 0; k < 6; k++) c[6 * i + j] += a[6 * i + k] * a[6 * j + k];
        }
    }
}

static void covariances_are_told_from_other_matrices(void)
{
    const unsigned seed = 11;
    printf("seed %u\n", seed);
    srand(seed);
    for (int round = 0; round < 2000; round++) {
        oc_body_pose_t pose = pose_at(T0 + round * 2);
        pose.has_covariance = true;
        random_covariance(round % 7, pow(10, uniform(-6, 3)), pose.covariance);
        TEST_ASSERT_EQUAL_MESSAGE(OC_OK, oc_pose_track_add(track, &pose), "a covariance");

        pose.utime_us++;
        random_covariance(6, 1, pose.covariance);
        const int i = rand() % 6, j = (i + 1 + rand() % 5) % 6;
        if (round % 2) {
            pose.covariance[6 * i + j] += 1e-3; /* not symmetric */
        } else {
            pose.covariance[7 * i] = -1e-3; /* a negative variance */
        }
        TEST_ASSERT_EQUAL_MESSAGE(OC_E_ARG, oc_pose_track_add(track, &pose), "no covariance");
    }
    oc_body_pose_t pose = pose_at(T0 + 10000);
    pose.has_covariance = true;
    for (int i = 0; i < 6; i++) pose.covariance[7 * i] = 1;
    pose.covariance[1] = pose.covariance[6] = 1.1; /* correlated more than wholly */
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose));
}

static void the_worse_neighbour_tells_the_covariance(void)
{
    oc_body_pose_t pose = pose_at(T0), got;
    pose.has_covariance = true;
    pose.covariance[0] = 4;
    TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(track, &pose));
    pose.utime_us += 1000;
    pose.covariance[0] = 9;
    TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(track, &pose));
    pose.utime_us += 1000;
    pose.has_covariance = false;
    TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(track, &pose));
    TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, T0 + 1, &got));
    TEST_ASSERT_TRUE(got.has_covariance && got.covariance[0] == 9);
    TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, T0 + 1500, &got));
    TEST_ASSERT_FALSE(got.has_covariance);
}

/* ---- two threads ---- */

static atomic_bool is_over;

static void *add_many(void *user)
{
    (void)user;
    for (int i = 0; i < 20000; i++) {
        oc_body_pose_t pose = pose_at(T0 + i * 1000);
        pose.position_m[0] = i;
        if (oc_pose_track_add(track, &pose) != OC_OK) break;
    }
    atomic_store(&is_over, true);
    return NULL;
}

static void one_thread_adds_while_another_asks(void)
{
    pthread_t thread;
    atomic_store(&is_over, false);
    TEST_ASSERT_EQUAL(0, pthread_create(&thread, NULL, add_many, NULL));
    uint64_t n_found = 0;
    while (!atomic_load(&is_over) || n_found == 0) {
        struct pollfd fd = {oc_pose_track_fd(track), POLLIN, 0};
        if (poll(&fd, 1, 1000) > 0) oc_pose_track_clear(track);
        const int64_t newest_us = oc_pose_track_newest_us(track);
        oc_body_pose_t got;
        if (newest_us == INT64_MIN || oc_pose_track_at(track, newest_us - 500, &got) != OC_POSE_OK) continue;
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, (double)(newest_us - 500 - T0) / 1000, got.position_m[0]);
        n_found++;
    }
    pthread_join(thread, NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(between_two_poses_it_moves_evenly_and_turns_on_the_shorter_arc);
    RUN_TEST(nothing_is_guessed_outside_or_across_a_gap);
    RUN_TEST(the_ring_keeps_the_newest);
    RUN_TEST(what_is_no_pose_is_refused);
    RUN_TEST(covariances_are_told_from_other_matrices);
    RUN_TEST(the_worse_neighbour_tells_the_covariance);
    RUN_TEST(one_thread_adds_while_another_asks);
    return UNITY_END();
}
