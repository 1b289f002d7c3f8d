/* SPDX-License-Identifier: BSD-3-Clause
 * Poses over time: interpolation against closed forms, what is answered when there is none, what is refused. */
#include "unity.h"

#include <poll.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#include "pose_track.h"
#include "thesis_tables.h"

#define GAP_US 100000

static oc_pose_track_t *track;
static oc_test_random_t random_numbers;

void setUp(void)
{
    track = oc_pose_track_create(16, GAP_US);
    TEST_ASSERT_NOT_NULL(track);
    random_numbers = oc_test_random_from(4711);
}

void tearDown(void)
{
    oc_pose_track_destroy(track);
}

static double uniform(double low, double high)
{
    return oc_test_uniform(&random_numbers, low, high);
}

/* A turn by `angle` about a unit axis. */
static void turn(const double axis[3], double angle, double q_wxyz[4])
{
    q_wxyz[0] = cos(angle / 2);
    for (int i = 0; i < 3; i++) q_wxyz[1 + i] = sin(angle / 2) * axis[i];
}

static void any_axis(double axis[3])
{
    double norm = 0;
    for (int i = 0; i < 3; i++) axis[i] = oc_test_normal(&random_numbers);
    for (int i = 0; i < 3; i++) norm += axis[i] * axis[i];
    for (int i = 0; i < 3; i++) axis[i] /= sqrt(norm);
}

static void multiply(const double a[4], const double b[4], double out[4])
{
    out[0] = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3];
    out[1] = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2];
    out[2] = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1];
    out[3] = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0];
}

static oc_body_pose_t at(int64_t utime_us)
{
    return (oc_body_pose_t){.utime_us = utime_us, .position_m = {(double)utime_us, 2, 3}, .q_wxyz = {1, 0, 0, 0}};
}

static void add(const oc_body_pose_t *pose)
{
    TEST_ASSERT_EQUAL(OC_OK, oc_pose_track_add(track, pose));
}

static void add_at(int64_t utime_us)
{
    const oc_body_pose_t pose = at(utime_us);
    add(&pose);
}

static oc_pose_answer_t ask(int64_t utime_us)
{
    oc_body_pose_t pose;
    return oc_pose_track_at(track, utime_us, &pose);
}

/* ---- asking ---- */

/* b is a turned by `angle` about an axis, so at a share of the time a is turned by that share of the angle. */
static void check_between(int draw, double angle)
{
    const char *text = oc_test_draw(&random_numbers, draw);
    double axis[3], q[4], step[4];
    oc_body_pose_t a = at(draw * 1000000LL + 1), b = a;
    any_axis(axis);
    turn(axis, uniform(-3, 3), a.q_wxyz);
    any_axis(axis);
    turn(axis, angle, step);
    multiply(step, a.q_wxyz, b.q_wxyz);
    for (int i = 0; i < 4 && draw % 2; i++) b.q_wxyz[i] = -b.q_wxyz[i]; /* the same rotation */
    for (int i = 0; i < 3; i++) {
        a.position_m[i] = uniform(-1e5, 1e5);
        b.position_m[i] = uniform(-1e5, 1e5);
    }
    b.utime_us += (int64_t)uniform(1, GAP_US + 0.999);
    add(&a);
    add(&b);
    for (int k = 0; k < 5; k++) {
        const int64_t span_us = b.utime_us - a.utime_us;
        const int64_t utime_us = a.utime_us + (int64_t)uniform(0, (double)span_us + 0.999);
        const double share = (double)(utime_us - a.utime_us) / (double)span_us;
        oc_body_pose_t pose;
        TEST_ASSERT_EQUAL_MESSAGE(OC_POSE_OK, oc_pose_track_at(track, utime_us, &pose), text);
        TEST_ASSERT_EQUAL_INT64(utime_us, pose.utime_us);
        turn(axis, share * angle, step);
        multiply(step, a.q_wxyz, q);
        double dot = 0;
        for (int i = 0; i < 4; i++) dot += q[i] * pose.q_wxyz[i];
        for (int i = 0; i < 4; i++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, q[i], dot < 0 ? -pose.q_wxyz[i] : pose.q_wxyz[i], text);
        for (int i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9 * 2e5, (1 - share) * a.position_m[i] + share * b.position_m[i],
                                              pose.position_m[i], text);
    }
}

static void between_two_poses_the_path_is_straight_and_the_turn_even(void)
{
    static const double angles[] = {0, 1e-12, 1e-7, 1.9e-4, 2.1e-4, 1e-3, 0.1, 1, 2, 3, 3.14};
    int draw = 0;
    for (int i = 0; i < 11; i++) {
        for (int k = 0; k < 40; k++) check_between(draw++, angles[i]);
    }
    for (int k = 0; k < 1000; k++) check_between(draw++, uniform(-3.14, 3.14));
}

static void at_a_pose_it_is_that_pose_to_the_bit(void)
{
    oc_body_pose_t poses[5];
    for (int i = 0; i < 5; i++) {
        memset(&poses[i], 0, sizeof poses[i]);
        poses[i] = at(i * 2LL * GAP_US); /* too far apart for what lies between */
        turn((const double[3]){0, 0.6, 0.8}, 0.3 * i, poses[i].q_wxyz);
        poses[i].has_covariance = i == 2;
        for (int k = 0; k < 36 && i == 2; k++) poses[i].covariance[k] = k % 7 ? 0 : 0.1 * k;
        add(&poses[i]);
    }
    for (int i = 0; i < 5; i++) {
        oc_body_pose_t pose;
        TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, poses[i].utime_us, &pose));
        TEST_ASSERT_EQUAL_INT64(poses[i].utime_us, pose.utime_us);
        TEST_ASSERT_EQUAL_MEMORY(poses[i].position_m, pose.position_m, sizeof pose.position_m);
        TEST_ASSERT_EQUAL_MEMORY(poses[i].q_wxyz, pose.q_wxyz, sizeof pose.q_wxyz);
        TEST_ASSERT_EQUAL(poses[i].has_covariance, pose.has_covariance);
        TEST_ASSERT_EQUAL_MEMORY(poses[i].covariance, pose.covariance, sizeof pose.covariance);
    }
}

static void between_two_poses_the_larger_covariance_holds(void)
{
    for (int larger = 0; larger < 2; larger++) {
        for (int has = 0; has < 4; has++) {
            oc_body_pose_t pose, ends[2] = {at(larger * 8000000 + has * 1000000 + 5), at(0)};
            ends[1].utime_us = ends[0].utime_us + 10;
            for (int i = 0; i < 2; i++) {
                ends[i].has_covariance = (has >> i & 1) != 0;
                for (int k = 0; k < 6; k++) ends[i].covariance[7 * k] = i == larger ? 4 : 1;
                add(&ends[i]);
            }
            for (int t = 1; t < 10; t++) {
                TEST_ASSERT_EQUAL(OC_POSE_OK, oc_pose_track_at(track, ends[0].utime_us + t, &pose));
                TEST_ASSERT_EQUAL(has == 3, pose.has_covariance);
                if (has == 3)
                    TEST_ASSERT_EQUAL_MEMORY(ends[larger].covariance, pose.covariance, sizeof pose.covariance);
            }
        }
    }
}

static void nothing_is_known_outside(void)
{
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, ask(0));
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, ask(INT64_MIN));
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, ask(INT64_MAX));
    TEST_ASSERT_EQUAL_INT64(INT64_MIN, oc_pose_track_newest_us(track));
    add_at(1000);
    TEST_ASSERT_EQUAL(OC_POSE_NEVER, ask(999));
    TEST_ASSERT_EQUAL(OC_POSE_OK, ask(1000));
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, ask(1001));
    add_at(1000 + GAP_US);
    add_at(1000 + 2 * GAP_US + 1); /* one too far */
    TEST_ASSERT_EQUAL(OC_POSE_OK, ask(1001));
    TEST_ASSERT_EQUAL(OC_POSE_OK, ask(1000 + GAP_US));
    TEST_ASSERT_EQUAL(OC_POSE_NEVER, ask(1001 + GAP_US));
    TEST_ASSERT_EQUAL(OC_POSE_NEVER, ask(1000 + 2 * GAP_US));
    TEST_ASSERT_EQUAL(OC_POSE_OK, ask(1001 + 2 * GAP_US));
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, ask(1002 + 2 * GAP_US));
    TEST_ASSERT_EQUAL(OC_POSE_NEVER, ask(INT64_MIN));
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, ask(INT64_MAX));
    TEST_ASSERT_EQUAL_INT64(1001 + 2 * GAP_US, oc_pose_track_newest_us(track));
}

/* Against a plain list of everything that was ever added. */
static void the_ring_keeps_the_newest(void)
{
    enum { N = 400 };
    int64_t times_us[N], utime_us = -5000000;
    for (int n = 0; n < N; n++) {
        utime_us += (int64_t)uniform(1, 1.5 * GAP_US);
        times_us[n] = utime_us;
        add_at(utime_us);
        const int oldest = n < 15 ? 0 : n - 15;
        for (int k = 0; k < 40; k++) {
            const int64_t asked_us =
                times_us[oldest] - 100 + (int64_t)uniform(0, (double)(utime_us - times_us[oldest]) + 200);
            oc_pose_answer_t expected = OC_POSE_NEVER;
            for (int i = oldest; i <= n; i++) {
                if (asked_us == times_us[i]) expected = OC_POSE_OK;
                if (i > oldest && asked_us > times_us[i - 1] && asked_us < times_us[i])
                    expected = times_us[i] - times_us[i - 1] <= GAP_US ? OC_POSE_OK : OC_POSE_NEVER;
            }
            if (asked_us > utime_us) expected = OC_POSE_NOT_YET;
            oc_body_pose_t pose;
            TEST_ASSERT_EQUAL(expected, oc_pose_track_at(track, asked_us, &pose));
            if (expected == OC_POSE_OK) TEST_ASSERT_DOUBLE_WITHIN(1e-6, (double)asked_us, pose.position_m[0]);
        }
    }
}

static void it_calls_when_poses_come(void)
{
    struct pollfd fd = {oc_pose_track_fd(track), POLLIN, 0};
    TEST_ASSERT_EQUAL(0, poll(&fd, 1, 0));
    add_at(1);
    add_at(2);
    TEST_ASSERT_EQUAL(1, poll(&fd, 1, 0));
    oc_pose_track_clear(track);
    TEST_ASSERT_EQUAL(0, poll(&fd, 1, 0));
    oc_pose_track_clear(track); /* does not block */
    const oc_body_pose_t late = at(2);
    TEST_ASSERT_EQUAL(OC_E_STATE, oc_pose_track_add(track, &late));
    TEST_ASSERT_EQUAL(0, poll(&fd, 1, 0));
}

/* ---- order ---- */

static oc_status_t try_at(int64_t utime_us)
{
    const oc_body_pose_t pose = at(utime_us);
    return oc_pose_track_add(track, &pose);
}

static void what_is_not_newer_is_dropped(void)
{
    add_at(1000000);
    for (int i = 0; i < 1000; i++) { /* repeated, or now and then one that overtook */
        TEST_ASSERT_EQUAL(OC_E_STATE, try_at(1000000 + 1000 * i));
        for (int k = 0; k < i % 10; k++) TEST_ASSERT_EQUAL(OC_E_STATE, try_at(500000 + 1000 * i + k));
        TEST_ASSERT_EQUAL(OC_OK, try_at(1001000 + 1000 * i));
    }
    for (int i = 0; i < 100; i++) TEST_ASSERT_EQUAL(OC_E_STATE, try_at(7)); /* one message again and again */
    for (int i = 0; i < 100; i++) TEST_ASSERT_EQUAL(OC_E_STATE, try_at(900 - i));
    TEST_ASSERT_EQUAL_INT64(2000000, oc_pose_track_newest_us(track));
}

static void a_clock_that_was_set_back_is_followed(void)
{
    for (int i = 0; i < 30; i++) add_at(100000000 + 1000 * i);
    for (int i = 0; i < 10; i++) TEST_ASSERT_EQUAL(OC_E_STATE, try_at(5000 + 1000 * i));
    TEST_ASSERT_EQUAL(OC_POSE_OK, ask(100029000));
    for (int i = 10; i < 40; i++) TEST_ASSERT_EQUAL(OC_OK, try_at(5000 + 1000 * i));
    TEST_ASSERT_EQUAL_INT64(44000, oc_pose_track_newest_us(track));
    TEST_ASSERT_EQUAL(OC_POSE_OK, ask(43500));
    TEST_ASSERT_EQUAL(OC_POSE_NEVER, ask(1000));
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, ask(100029000));
}

/* ---- what is a pose ---- */

static void what_is_not_a_number_is_no_pose(void)
{
    static const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, 1e300, 1e10};
    oc_body_pose_t pose = at(1);
    for (int k = 0; k < 5; k++) {
        for (int i = 0; i < 3; i++) {
            pose = at(1);
            pose.position_m[i] = bad[k];
            TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose));
        }
        for (int i = 0; i < 4; i++) {
            pose = at(1);
            pose.q_wxyz[i] = bad[k];
            TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose));
        }
        for (int i = 0; i < 36 && k < 4; i++) {
            pose = at(1);
            pose.has_covariance = true;
            pose.covariance[i] = pose.covariance[6 * (i % 6) + i / 6] = bad[k];
            TEST_ASSERT_EQUAL(OC_E_ARG, oc_pose_track_add(track, &pose));
        }
    }
    TEST_ASSERT_EQUAL(OC_E_ARG, try_at(INT64_MAX));
    TEST_ASSERT_EQUAL(OC_E_ARG, try_at(INT64_MIN));
    TEST_ASSERT_EQUAL(OC_POSE_NOT_YET, ask(0));
    pose = at(1);
    pose.covariance[3] = (double)NAN; /* of no meaning without has_covariance */
    add(&pose);
}

static void a_quaternion_has_unit_length(void)
{
    static const struct {
        double length;
        oc_status_t expected;
    } cases[] = {{0, OC_E_ARG}, {0.5, OC_E_ARG}, {0.9985, OC_E_ARG}, {0.9995, OC_OK},
                 {1, OC_OK},    {1.0005, OC_OK}, {1.0015, OC_E_ARG}, {2, OC_E_ARG}};
    for (int i = 0; i < 8; i++) {
        oc_body_pose_t pose = at(i + 1);
        double axis[3];
        any_axis(axis);
        turn(axis, 1.0, pose.q_wxyz);
        for (int k = 0; k < 4; k++) pose.q_wxyz[k] *= cases[i].length;
        TEST_ASSERT_EQUAL(cases[i].expected, oc_pose_track_add(track, &pose));
    }
}

static oc_status_t try_covariance(const double c[36])
{
    static int64_t utime_us = 1;
    oc_body_pose_t pose = at(++utime_us);
    pose.has_covariance = true;
    memcpy(pose.covariance, c, sizeof pose.covariance);
    return oc_pose_track_add(track, &pose);
}

/* scale (A A^T) scale, A with `rank` columns; metres and radians of very different size. */
static void any_covariance(int rank, double c[36])
{
    double a[36] = {0}, scale[6];
    const double metres = pow(10, uniform(-6, 3)), radians = pow(10, uniform(-8, 0));
    for (int i = 0; i < 6; i++) {
        scale[i] = (i < 3 ? metres : radians) * pow(10, uniform(-1, 0));
        for (int k = 0; k < rank; k++) a[6 * i + k] = oc_test_normal(&random_numbers);
    }
    for (int i = 0; i < 36; i++) {
        c[i] = 0;
        for (int k = 0; k < rank; k++) c[i] += a[6 * (i / 6) + k] * a[6 * (i % 6) + k];
        c[i] *= scale[i / 6] * scale[i % 6];
    }
}

static void covariances_of_every_rank_and_scale_are_accepted(void)
{
    double c[36];
    for (int draw = 0; draw < 3000; draw++) {
        any_covariance(draw % 7, c);
        TEST_ASSERT_EQUAL_MESSAGE(OC_OK, try_covariance(c), oc_test_draw(&random_numbers, draw));
        for (int i = 0; i < 36; i++) c[i] = (double)(float)c[i]; /* a publisher in single precision */
        TEST_ASSERT_EQUAL_MESSAGE(OC_OK, try_covariance(c), oc_test_draw(&random_numbers, draw));
    }
}

/* A plane's covariance turned into the world: what does not vary becomes a little more or less than 0. */
static void rounding_around_zero_is_accepted(void)
{
    for (int draw = 0; draw < 1000; draw++) {
        double R[9], c[36] = {0}, axis[3], q[4];
        const double own[3] = {uniform(0, 4), uniform(0, 4), 0};
        any_axis(axis);
        turn(axis, uniform(-3, 3), q);
        TEST_ASSERT_EQUAL(OC_OK, oc_rotation_from_quat(q, R));
        for (int i = 0; i < 9; i++) {
            for (int k = 0; k < 3; k++) c[6 * (i / 3) + i % 3] += R[3 * (i / 3) + k] * own[k] * R[3 * (i % 3) + k];
        }
        for (int i = 0; i < 3; i++) c[7 * i] -= 1e-15;
        TEST_ASSERT_EQUAL_MESSAGE(OC_OK, try_covariance(c), oc_test_draw(&random_numbers, draw));
    }
}

/* A covariance less more than its own extent along one direction is none, in whatever units. */
static void what_has_a_negative_direction_is_refused(void)
{
    for (int draw = 0; draw < 3000; draw++) {
        double c[36], v[6], scale[6];
        any_covariance(6, c);
        for (int i = 0; i < 6; i++) {
            scale[i] = sqrt(c[7 * i]);
            v[i] = oc_test_normal(&random_numbers);
        }
        /* v^T C' v < 0 with C' = C - s (D v)(D v)^T, where w = D^-1 (v / |v|^2) sees s all of it. */
        double own = 0, norm = 0;
        for (int i = 0; i < 6; i++) norm += v[i] * v[i];
        for (int i = 0; i < 36; i++) own += v[i / 6] / scale[i / 6] * c[i] * v[i % 6] / scale[i % 6] / norm / norm;
        const double s = own * 1.5 + 0.01;
        for (int i = 0; i < 36; i++) c[i] -= s * scale[i / 6] * v[i / 6] * scale[i % 6] * v[i % 6];
        TEST_ASSERT_EQUAL_MESSAGE(OC_E_ARG, try_covariance(c), oc_test_draw(&random_numbers, draw));
    }
}

static void what_is_not_symmetric_is_refused(void)
{
    for (int draw = 0; draw < 500; draw++) {
        double c[36];
        any_covariance(6, c);
        const int i = (int)uniform(0, 6), j = (i + 1 + (int)uniform(0, 5)) % 6;
        c[6 * i + j] += 1e-3 * sqrt(c[7 * i] * c[7 * j]);
        TEST_ASSERT_EQUAL_MESSAGE(OC_E_ARG, try_covariance(c), oc_test_draw(&random_numbers, draw));
    }
}

static void what_does_not_vary_correlates_with_nothing(void)
{
    double c[36] = {0};
    TEST_ASSERT_EQUAL(OC_OK, try_covariance(c));
    c[0] = c[28] = 1; /* x and the turn about y */
    TEST_ASSERT_EQUAL(OC_OK, try_covariance(c));
    c[4] = c[24] = 1; /* fully correlated */
    TEST_ASSERT_EQUAL(OC_OK, try_covariance(c));
    c[4] = c[24] = 1.01;
    TEST_ASSERT_EQUAL(OC_E_ARG, try_covariance(c));
    c[4] = c[24] = 0;
    c[3] = c[18] = 1e-6; /* with the turn about x, which does not */
    TEST_ASSERT_EQUAL(OC_E_ARG, try_covariance(c));
    c[3] = c[18] = 0;
    c[35] = -1e-9;
    TEST_ASSERT_EQUAL(OC_OK, try_covariance(c));
    c[35] = -1e-5;
    TEST_ASSERT_EQUAL(OC_E_ARG, try_covariance(c));
}

/* ---- two threads ---- */

static void *adder(void *user)
{
    (void)user;
    for (int64_t i = 1; i <= 20000; i++) {
        oc_body_pose_t pose = at(10 * i);
        pose.position_m[1] = 3 * pose.position_m[0];
        if (oc_pose_track_add(track, &pose) != OC_OK) abort();
    }
    return NULL;
}

static void one_thread_adds_while_another_asks(void)
{
    pthread_t thread;
    TEST_ASSERT_EQUAL(0, pthread_create(&thread, NULL, adder, NULL));
    int64_t newest_us = INT64_MIN;
    uint32_t n_found = 0;
    while (newest_us < 200000 || n_found == 0) {
        newest_us = oc_pose_track_newest_us(track);
        const int64_t asked_us = newest_us < 200 ? 5 : newest_us - (int64_t)uniform(0, 150);
        oc_body_pose_t pose;
        if (oc_pose_track_at(track, asked_us, &pose) == OC_POSE_OK) {
            n_found++;
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, (double)asked_us, pose.position_m[0]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-5, 3 * (double)asked_us, pose.position_m[1]);
        }
        oc_pose_track_clear(track);
    }
    pthread_join(thread, NULL);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(between_two_poses_the_path_is_straight_and_the_turn_even);
    RUN_TEST(at_a_pose_it_is_that_pose_to_the_bit);
    RUN_TEST(between_two_poses_the_larger_covariance_holds);
    RUN_TEST(nothing_is_known_outside);
    RUN_TEST(the_ring_keeps_the_newest);
    RUN_TEST(it_calls_when_poses_come);
    RUN_TEST(what_is_not_newer_is_dropped);
    RUN_TEST(a_clock_that_was_set_back_is_followed);
    RUN_TEST(what_is_not_a_number_is_no_pose);
    RUN_TEST(a_quaternion_has_unit_length);
    RUN_TEST(covariances_of_every_rank_and_scale_are_accepted);
    RUN_TEST(rounding_around_zero_is_accepted);
    RUN_TEST(what_has_a_negative_direction_is_refused);
    RUN_TEST(what_is_not_symmetric_is_refused);
    RUN_TEST(what_does_not_vary_correlates_with_nothing);
    RUN_TEST(one_thread_adds_while_another_asks);
    return UNITY_END();
}
