/* SPDX-License-Identifier: BSD-3-Clause
 * Cameras on the body: hand-made cases, and margins against finite differences. */
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pose_track.h"

#define PI 3.14159265358979323846
#define DEG (PI / 180)

void setUp(void) {}

void tearDown(void) {}

static double uniform(double low, double high)
{
    return low + (high - low) * rand() / RAND_MAX;
}

static oc_pose_t mount_of(double x, double y, double z, double roll, double pitch, double yaw)
{
    const double xyz[3] = {x, y, z}, rpy[3] = {roll * DEG, pitch * DEG, yaw * DEG};
    return oc_mount_from_xyzrpy(xyz, rpy);
}

/* Where a camera on a body sees a point of the world, in pixels from the principal point; focal length 100. */
static void sees(const oc_body_pose_t *body, const oc_pose_t *mount, double x, double y, double z, double expected_x,
                 double expected_y)
{
    const oc_camera_t camera = {.k = {100, 100, 0, 0, 640, 480}, .pose = oc_pose_of_camera(body, mount)};
    const double point[3] = {x, y, z};
    double px, py;
    TEST_ASSERT_TRUE(oc_camera_project(&camera, point, &px, &py) > 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected_x, px);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected_y, py);
}

static void a_camera_looks_where_it_is_mounted(void)
{
    const oc_body_pose_t east = {.position_m = {10, 20, 0}, .q_wxyz = {1, 0, 0, 0}};
    const double half = sqrt(0.5);
    const oc_body_pose_t north = {.position_m = {10, 20, 0}, .q_wxyz = {half, 0, 0, half}};

    oc_pose_t mount = mount_of(0, 0, 0, 0, 0, 0);
    sees(&east, &mount, 15, 20, 0, 0, 0);   /* straight ahead */
    sees(&east, &mount, 15, 21, 0, -20, 0); /* a metre to the left: left in the picture */
    sees(&east, &mount, 15, 20, 1, 0, -20); /* a metre up: up in the picture */
    sees(&north, &mount, 10, 25, 0, 0, 0);  /* the body turned left */
    mount = mount_of(0.5, 0, 1, 0, 45, 0);  /* half a metre ahead, a metre up, 45 degrees down */
    sees(&east, &mount, 11.5, 20, 0, 0, 0);
    mount = mount_of(0, 0, 0, 0, 0, 90); /* looks left */
    sees(&east, &mount, 10, 27, 0, 0, 0);
    mount = mount_of(0, 0, 0, 90, 0, 0); /* rolled: its left is up */
    sees(&east, &mount, 15, 20, 1, -20, 0);
    mount = mount_of(0, 0.2, 0, 0, 0, 0); /* 20 cm to the left */
    sees(&north, &mount, 9.8, 25, 0, 0, 0);
}

/* ---- margins ---- */

static void turn_about(const double d[3], const double q[4], double out[4])
{
    const double angle = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    double s[4] = {1, 0, 0, 0};
    if (angle > 0) {
        s[0] = cos(angle / 2);
        for (int i = 0; i < 3; i++) s[1 + i] = sin(angle / 2) * d[i] / angle;
    }
    out[0] = s[0] * q[0] - s[1] * q[1] - s[2] * q[2] - s[3] * q[3];
    out[1] = s[0] * q[1] + s[1] * q[0] + s[2] * q[3] - s[3] * q[2];
    out[2] = s[0] * q[2] - s[1] * q[3] + s[2] * q[0] + s[3] * q[1];
    out[3] = s[0] * q[3] + s[1] * q[2] - s[2] * q[1] + s[3] * q[0];
}

/* The camera's six parameters when the body is moved and turned by `change`, about the world's axes. */
static oc_pose6_t six_of(const oc_body_pose_t *body, const oc_pose_t *mount, const double change[6])
{
    oc_body_pose_t moved = *body;
    for (int i = 0; i < 3; i++) moved.position_m[i] += change[i];
    turn_about(change + 3, body->q_wxyz, moved.q_wxyz);
    const oc_pose_t camera = oc_pose_of_camera(&moved, mount);
    oc_pose6_t six;
    oc_pose_to_6(&camera, &six);
    return six;
}

static double wrapped(double angle)
{
    return remainder(angle, 2 * PI);
}

/* d six / d change by central differences. */
static void differences(const oc_body_pose_t *body, const oc_pose_t *mount, double jacobian[6][6])
{
    for (int j = 0; j < 6; j++) {
        double up[6] = {0}, down[6] = {0};
        up[j] = 1e-6;
        down[j] = -1e-6;
        const oc_pose6_t a = six_of(body, mount, up), b = six_of(body, mount, down);
        for (int i = 0; i < 6; i++) {
            const double difference = i < 3 ? a.v[i] - b.v[i] : wrapped(a.v[i] - b.v[i]);
            jacobian[i][j] = difference / 2e-6;
        }
    }
}

static oc_body_pose_t random_body(double scale)
{
    oc_body_pose_t body = {.has_covariance = true};
    double a[36], norm = 0;
    for (int i = 0; i < 3; i++) body.position_m[i] = uniform(-50, 50);
    for (int i = 0; i < 4; i++) {
        body.q_wxyz[i] = uniform(-1, 1);
        norm += body.q_wxyz[i] * body.q_wxyz[i];
    }
    for (int i = 0; i < 4; i++) body.q_wxyz[i] /= sqrt(norm);
    for (int i = 0; i < 36; i++) a[i] = uniform(-scale, scale);
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++) {
            for (int k = 0; k < 6; k++) body.covariance[6 * i + j] += a[6 * i + k] * a[6 * j + k];
        }
    }
    return body;
}

static void margins_are_the_covariance_carried_over(void)
{
    const unsigned seed = 5;
    printf("seed %u\n", seed);
    srand(seed);
    const oc_margin_t none = {{0}};
    int n_compared = 0;
    for (int round = 0; round < 500; round++) {
        const oc_body_pose_t body = random_body(0.01);
        const oc_pose_t mount = mount_of(uniform(-2, 2), uniform(-2, 2), uniform(-2, 2), uniform(-180, 180),
                                         uniform(-90, 90), uniform(-180, 180));
        const oc_margin_t margin = oc_margin_of_camera(&body, &mount, &none);
        double jacobian[6][6];
        differences(&body, &mount, jacobian);
        for (int i = 0; i < 6; i++) {
            double variance = 0;
            for (int j = 0; j < 6; j++) {
                for (int k = 0; k < 6; k++) variance += jacobian[i][j] * body.covariance[6 * j + k] * jacobian[i][k];
            }
            const double expected = sqrt(3 * variance);
            if (i >= 3 && expected > 0.7) continue; /* cut at 45 degrees */
            TEST_ASSERT_DOUBLE_WITHIN(1e-4 * expected + 1e-9, expected, margin.v[i]);
            n_compared++;
        }
    }
    TEST_ASSERT_TRUE(n_compared > 2900);
}

static void a_camera_that_looks_level_to_the_east_has_finite_wide_angles(void)
{
    oc_body_pose_t body = {.q_wxyz = {1, 0, 0, 0}, .has_covariance = true};
    for (int i = 0; i < 6; i++) body.covariance[7 * i] = 1e-4;
    const oc_margin_t none = {{0}};
    const oc_pose_t mount = mount_of(0, 0, 1, 0, 0, 0);
    const oc_margin_t margin = oc_margin_of_camera(&body, &mount, &none);
    for (int i = 0; i < 6; i++) TEST_ASSERT_TRUE(isfinite(margin.v[i]) && margin.v[i] > 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 45 * DEG, margin.v[3]); /* omega and kappa cannot be told apart */
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 45 * DEG, margin.v[5]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, sqrt(3e-4), margin.v[4]);
}

static void margins_are_never_below_the_least(void)
{
    const oc_margin_t least = {{0.1, 0.2, 0.3, 0.01, 0.02, 0.03}};
    oc_body_pose_t body = random_body(1e-5);
    const oc_pose_t mount = mount_of(0, 0, 1, 0, 30, 0);
    oc_margin_t margin = oc_margin_of_camera(&body, &mount, &least);
    for (int i = 0; i < 6; i++) TEST_ASSERT_TRUE(margin.v[i] >= least.v[i] && margin.v[i] < least.v[i] + 1e-2);
    body.has_covariance = false;
    margin = oc_margin_of_camera(&body, &mount, &least);
    TEST_ASSERT_EQUAL_MEMORY(&least, &margin, sizeof least);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_camera_looks_where_it_is_mounted);
    RUN_TEST(margins_are_the_covariance_carried_over);
    RUN_TEST(a_camera_that_looks_level_to_the_east_has_finite_wide_angles);
    RUN_TEST(margins_are_never_below_the_least);
    return UNITY_END();
}
