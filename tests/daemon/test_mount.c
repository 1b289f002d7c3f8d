/* SPDX-License-Identifier: BSD-3-Clause
 * Mounts against cases worked out by hand, camera poses by what they see, margins against random draws of the body. */
#include "unity.h"

#include <stdlib.h>
#include <string.h>

#include "pose_track.h"
#include "thesis_tables.h"

static oc_test_random_t random_numbers;

void setUp(void)
{
    random_numbers = oc_test_random_from(20260);
}

void tearDown(void) {}

static double uniform(double low, double high)
{
    return oc_test_uniform(&random_numbers, low, high);
}

static oc_pose_t mount_deg(double x_m, double y_m, double z_m, double roll_deg, double pitch_deg, double yaw_deg)
{
    return oc_mount_from_xyzrpy((const double[3]){x_m, y_m, z_m},
                                (const double[3]){OC_TEST_RAD(roll_deg), OC_TEST_RAD(pitch_deg), OC_TEST_RAD(yaw_deg)});
}

/* ---- mounts ---- */

/* Where the optical x (right in the picture), y (down in the picture) and z (viewing) axes point on the body. */
static void check_axes(const oc_pose_t *mount, const double right[3], const double down[3], const double view[3])
{
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, right[i], mount->R[3 * i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, down[i], mount->R[3 * i + 1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, view[i], mount->R[3 * i + 2]);
    }
}

static void mounts_worked_out_by_hand(void)
{
    const double c = 0.93969262078590843, s = 0.34202014332566871; /* of 20 degrees */
    const struct {
        double rpy_deg[3], right[3], down[3], view[3];
    } cases[] = {
        {{0, 0, 0}, {0, -1, 0}, {0, 0, -1}, {1, 0, 0}},    /* forward */
        {{0, 20, 0}, {0, -1, 0}, {-s, 0, -c}, {c, 0, -s}}, /* down by 20 */
        {{0, 90, 0}, {0, -1, 0}, {-1, 0, 0}, {0, 0, -1}},  /* straight down, the top of the picture ahead */
        {{0, 0, 90}, {1, 0, 0}, {0, 0, -1}, {0, 1, 0}},    /* to the left */
        {{0, 0, -90}, {-1, 0, 0}, {0, 0, -1}, {0, -1, 0}}, /* to the right */
        {{0, 0, 180}, {0, 1, 0}, {0, 0, -1}, {-1, 0, 0}},  /* back */
        {{90, 0, 0}, {0, 0, -1}, {0, 1, 0}, {1, 0, 0}},    /* its left side up: right in the picture is down */
        {{180, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}},    /* upside down */
        {{0, 20, 90}, {1, 0, 0}, {0, -s, -c}, {0, c, -s}}, /* to the left and down */
        {{90, 20, 0}, {-s, 0, -c}, {0, 1, 0}, {c, 0, -s}}, /* rolled, then down */
        {{90, 0, 90}, {0, 0, -1}, {-1, 0, 0}, {0, 1, 0}},  /* rolled, then to the left */
        {{20, 0, 0}, {0, -c, -s}, {0, s, -c}, {1, 0, 0}},  /* left side up a little: right in the picture sinks */
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const double *a = cases[i].rpy_deg;
        const oc_pose_t mount = mount_deg(0.5, -0.25, 1.75, a[0], a[1], a[2]);
        check_axes(&mount, cases[i].right, cases[i].down, cases[i].view);
        TEST_ASSERT_EQUAL_DOUBLE(0.5, mount.t[0]);
        TEST_ASSERT_EQUAL_DOUBLE(-0.25, mount.t[1]);
        TEST_ASSERT_EQUAL_DOUBLE(1.75, mount.t[2]);
    }
}

static void every_mount_is_a_rotation(void)
{
    for (int draw = 0; draw < 2000; draw++) {
        const oc_pose_t mount = mount_deg(0, 0, 0, uniform(-360, 360), uniform(-360, 360), uniform(-360, 360));
        TEST_ASSERT_TRUE_MESSAGE(oc_pose_is_valid(&mount), oc_test_draw(&random_numbers, draw));
    }
}

/* ---- camera poses ---- */

static const oc_intrinsics_t k_500 = {500, 500, 320, 240, 640, 480};

static void expect_seen(const oc_body_pose_t *body, const oc_pose_t *mount, const double p_in_world[3], double x_px,
                        double y_px, double depth_m)
{
    const oc_camera_t camera = {k_500, oc_pose_of_camera(body, mount)};
    double x = 0, y = 0;
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, depth_m, oc_camera_project(&camera, p_in_world, &x, &y));
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, x_px, x);
    TEST_ASSERT_DOUBLE_WITHIN(1e-8, y_px, y);
}

static void a_camera_sees_known_points_where_they_must_be(void)
{
    const double half = 0.70710678118654752;
    /* At (10, 20, 0), heading north (+Y): turned left by 90 degrees from east. Camera 1 m ahead, 2 m up. */
    const oc_body_pose_t north = {.position_m = {10, 20, 0}, .q_wxyz = {half, 0, 0, half}};
    oc_pose_t mount = mount_deg(1, 0, 2, 0, 0, 0);
    expect_seen(&north, &mount, (const double[3]){10, 26, 2}, 320, 240, 5);   /* straight ahead */
    expect_seen(&north, &mount, (const double[3]){11, 26, 2}, 420, 240, 5);   /* 1 m to the east is right */
    expect_seen(&north, &mount, (const double[3]){10, 26, 0}, 320, 440, 5);   /* the ground is below */
    mount = mount_deg(1, 0, 2, 0, 90, 0);                                     /* looks straight down */
    expect_seen(&north, &mount, (const double[3]){10, 21, 0}, 320, 240, 2);   /* its foot */
    expect_seen(&north, &mount, (const double[3]){10, 21.4, 0}, 320, 140, 2); /* ahead is up in the picture */
    mount = mount_deg(0, 0.5, 1, 0, 0, 90);                                   /* to the left, which is west */
    expect_seen(&north, &mount, (const double[3]){4.5, 20, 1}, 320, 240, 5);
    expect_seen(&north, &mount, (const double[3]){4.5, 21, 1}, 420, 240, 5); /* north is right */
    mount = mount_deg(0, 0, 1, 0, OC_TEST_DEG(atan(0.25)), 0);               /* down by atan 1/4 */
    expect_seen(&north, &mount, (const double[3]){10, 24, 0}, 320, 240, sqrt(17));
    /* Heading east, leaning: its left side up by 90 degrees, so that body z points to the right, south. */
    const oc_body_pose_t leaning = {.position_m = {0, 0, 5}, .q_wxyz = {half, half, 0, 0}};
    mount = mount_deg(0, 0, 2, 0, 0, 0);
    expect_seen(&leaning, &mount, (const double[3]){10, -2, 5}, 320, 240, 10);
    expect_seen(&leaning, &mount, (const double[3]){10, -2, 4}, 370, 240, 10); /* down is right in the picture */
}

static void any_body(oc_body_pose_t *body)
{
    double norm = 0;
    *body = (oc_body_pose_t){.position_m = {uniform(-50, 50), uniform(-50, 50), uniform(0, 5)}};
    for (int i = 0; i < 4; i++) body->q_wxyz[i] = oc_test_normal(&random_numbers);
    for (int i = 0; i < 4; i++) norm += body->q_wxyz[i] * body->q_wxyz[i];
    for (int i = 0; i < 4; i++) body->q_wxyz[i] /= sqrt(norm);
}

/* A point given in the camera, carried out to the body and the world by hand, comes back. */
static void camera_and_world_undo_each_other(void)
{
    for (int draw = 0; draw < 2000; draw++) {
        oc_body_pose_t body;
        double R[9];
        any_body(&body);
        TEST_ASSERT_EQUAL(OC_OK, oc_rotation_from_quat(body.q_wxyz, R));
        for (int i = 0; i < 4; i++) body.q_wxyz[i] *= draw % 2 ? 1.0009 : 0.9991; /* what still counts as a unit */
        const oc_pose_t mount = mount_deg(uniform(-2, 2), uniform(-2, 2), uniform(-2, 2), uniform(-180, 180),
                                          uniform(-90, 90), uniform(-180, 180));
        const oc_pose_t camera = oc_pose_of_camera(&body, &mount);
        TEST_ASSERT_TRUE_MESSAGE(oc_pose_is_valid(&camera), oc_test_draw(&random_numbers, draw));
        double in_cam[3], in_body[3], in_world[3], back[3];
        for (int i = 0; i < 3; i++) in_cam[i] = uniform(-20, 20);
        oc_mat3_mul_vec(mount.R, in_cam, in_body);
        for (int i = 0; i < 3; i++) in_body[i] += mount.t[i];
        oc_mat3_mul_vec(R, in_body, in_world);
        for (int i = 0; i < 3; i++) in_world[i] += body.position_m[i];
        oc_mat3_mul_vec(camera.R, in_world, back);
        for (int i = 0; i < 3; i++)
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, in_cam[i], back[i] + camera.t[i],
                                              oc_test_draw(&random_numbers, draw));
    }
}

/* ---- margins ---- */

static const oc_margin_t none;

/* A lower triangle L with unit-sized position and rotation parts; C = L L^T. */
static void any_factor(double metres, double radians, double l[36])
{
    for (int i = 0; i < 36; i++)
        l[i] = i % 6 > i / 6 ? 0 : (i / 6 < 3 ? metres : radians) * oc_test_normal(&random_numbers);
}

static void square(const double l[36], double c[36])
{
    for (int i = 0; i < 36; i++) {
        c[i] = 0;
        for (int k = 0; k < 6; k++) c[i] += l[6 * (i / 6) + k] * l[6 * (i % 6) + k];
    }
}

/* The body moved by e[0..2] and turned about the world's axes by the rotation vector e[3..5]. */
static oc_body_pose_t disturbed(const oc_body_pose_t *body, const double e[6])
{
    oc_body_pose_t out = *body;
    const double angle = sqrt(e[3] * e[3] + e[4] * e[4] + e[5] * e[5]), s = angle > 0 ? sin(angle / 2) / angle : 0.5;
    const double d[4] = {cos(angle / 2), s * e[3], s * e[4], s * e[5]}, *q = body->q_wxyz;
    out.q_wxyz[0] = d[0] * q[0] - d[1] * q[1] - d[2] * q[2] - d[3] * q[3];
    out.q_wxyz[1] = d[0] * q[1] + d[1] * q[0] + d[2] * q[3] - d[3] * q[2];
    out.q_wxyz[2] = d[0] * q[2] - d[1] * q[3] + d[2] * q[0] + d[3] * q[1];
    out.q_wxyz[3] = d[0] * q[3] + d[1] * q[2] - d[2] * q[1] + d[3] * q[0];
    for (int i = 0; i < 3; i++) out.position_m[i] += e[i];
    return out;
}

static oc_pose6_t six_of(const oc_body_pose_t *body, const oc_pose_t *mount)
{
    const oc_pose_t camera = oc_pose_of_camera(body, mount);
    oc_pose6_t six;
    oc_pose_to_6(&camera, &six);
    return six;
}

static double difference(const oc_pose6_t *a, const oc_pose6_t *b, int i)
{
    const double d = a->v[i] - b->v[i];
    return i < 3 ? d : remainder(d, 2 * OC_TEST_PI);
}

static bool any_view(oc_body_pose_t *body, oc_pose_t *mount)
{
    any_body(body);
    *mount = mount_deg(uniform(-3, 3), uniform(-3, 3), uniform(-3, 3), uniform(-180, 180), uniform(-90, 90),
                       uniform(-180, 180));
    return fabs(six_of(body, mount).v[4]) < OC_TEST_RAD(80);
}

/* J by central differences of the six parameters themselves: margin = sqrt(3 diag(J C J^T)). */
static void margins_are_what_the_six_parameters_do(void)
{
    for (int draw = 0; draw < 2000; draw++) {
        oc_body_pose_t body;
        oc_pose_t mount;
        double l[36], J[36];
        if (!any_view(&body, &mount)) continue;
        any_factor(0.1, 1e-5, l); /* small turns, so that only the first order is left */
        square(l, body.covariance);
        body.has_covariance = true;
        for (int k = 0; k < 6; k++) {
            const double h = 1e-5;
            double e[6] = {0};
            e[k] = h;
            const oc_body_pose_t plus = disturbed(&body, e);
            e[k] = -h;
            const oc_body_pose_t minus = disturbed(&body, e);
            const oc_pose6_t a = six_of(&plus, &mount), b = six_of(&minus, &mount);
            for (int i = 0; i < 6; i++) J[6 * i + k] = difference(&a, &b, i) / (2 * h);
        }
        const oc_margin_t margin = oc_margin_of_camera(&body, &mount, &none);
        for (int i = 0; i < 6; i++) {
            double variance = 0;
            for (int m = 0; m < 36; m++) variance += J[6 * i + m / 6] * body.covariance[m] * J[6 * i + m % 6];
            const double half = sqrt(3 * variance), expected = i < 3 ? half : fmin(half, OC_TEST_PI / 4);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5 * expected + 1e-9, expected, margin.v[i],
                                              oc_test_draw(&random_numbers, draw));
        }
    }
}

/* Bodies drawn from the covariance: the parameters' spread is the margin over sqrt 3. */
static void margins_are_what_random_bodies_do(void)
{
    enum { N = 20000 };
    for (int draw = 0, n = 0; n < 8; draw++) {
        oc_body_pose_t body;
        oc_pose_t mount;
        double l[36], sum[6] = {0};
        if (!any_view(&body, &mount) || fabs(six_of(&body, &mount).v[4]) > OC_TEST_RAD(60)) continue;
        n++;
        any_factor(0.02, 0.002, l);
        square(l, body.covariance);
        body.has_covariance = true;
        const oc_pose6_t middle = six_of(&body, &mount);
        for (int k = 0; k < N; k++) {
            double e[6] = {0}, z[6];
            for (int i = 0; i < 6; i++) z[i] = oc_test_normal(&random_numbers);
            for (int i = 0; i < 36; i++) e[i / 6] += l[i] * z[i % 6];
            const oc_body_pose_t other = disturbed(&body, e);
            const oc_pose6_t six = six_of(&other, &mount);
            for (int i = 0; i < 6; i++) sum[i] += difference(&six, &middle, i) * difference(&six, &middle, i);
        }
        const oc_margin_t margin = oc_margin_of_camera(&body, &mount, &none);
        for (int i = 0; i < 6; i++) /* the spread of N draws is known to 0.5 %, one sigma */
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.03 * margin.v[i], margin.v[i], sqrt(3 * sum[i] / N),
                                              oc_test_draw(&random_numbers, draw));
    }
}

static void a_lever_carries_turns_to_the_centre(void)
{
    oc_body_pose_t body = {.q_wxyz = {1, 0, 0, 0}, .has_covariance = true};
    body.covariance[35] = 1e-4; /* heading, sigma 0.01 */
    const oc_pose_t ahead = mount_deg(2, 0, 0, 0, 30, 0);
    oc_margin_t margin = oc_margin_of_camera(&body, &ahead, &none);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, margin.v[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.02 * sqrt(3), margin.v[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0, margin.v[2]);
    body.covariance[7] = 4e-4; /* y moves by 0.02 as the heading turns back: the camera stays where it is */
    body.covariance[11] = body.covariance[31] = -2e-4;
    margin = oc_margin_of_camera(&body, &ahead, &none);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0, margin.v[1]);
}

static void without_a_covariance_the_least_is_all(void)
{
    const oc_margin_t least = {{0.1, 0.2, 0.3, 0.01, 0.02, 0.03}};
    oc_body_pose_t body = {.q_wxyz = {1, 0, 0, 0}};
    for (int i = 0; i < 6; i++) body.covariance[7 * i] = 1;
    const oc_pose_t mount = mount_deg(1, 2, 3, 0, 30, 0);
    oc_margin_t margin = oc_margin_of_camera(&body, &mount, &least);
    TEST_ASSERT_EQUAL_MEMORY(&least, &margin, sizeof margin);
    body.has_covariance = true;
    margin = oc_margin_of_camera(&body, &mount, &least);
    for (int i = 0; i < 6; i++) TEST_ASSERT_TRUE(margin.v[i] > least.v[i]);
    for (int i = 3; i < 6; i++) TEST_ASSERT_TRUE(margin.v[i] <= OC_TEST_PI / 4 + 1e-15);
    memset(body.covariance, 0, sizeof body.covariance);
    margin = oc_margin_of_camera(&body, &mount, &least);
    TEST_ASSERT_EQUAL_MEMORY(&least, &margin, sizeof margin);
}

/* A camera that looks level to the east (phi = -90 or 90 degrees) or next to it. */
static void next_to_the_pole_margins_are_finite_and_not_too_small(void)
{
    static const double off_deg[] = {0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-2, 0.1, 1, 3, 10};
    for (int draw = 0; draw < 4000; draw++) {
        const double yaw_deg = (draw % 2 ? 180 : 0) + (draw % 4 < 2 ? 1 : -1) * off_deg[draw / 4 % 10];
        const oc_pose_t mount = mount_deg(uniform(-2, 2), uniform(-2, 2), uniform(-2, 2),
                                          draw % 3 ? uniform(-180, 180) : 0, draw % 5 ? 0 : uniform(-2, 2), yaw_deg);
        oc_body_pose_t body = {.q_wxyz = {1, 0, 0, 0}, .has_covariance = true};
        double l[36];
        any_factor(0.02, 0.002, l);
        square(l, body.covariance);
        const char *text = oc_test_draw(&random_numbers, draw);
        const oc_pose6_t middle = six_of(&body, &mount);
        TEST_ASSERT_TRUE_MESSAGE(fabs(middle.v[4]) > OC_TEST_RAD(77), text);
        const oc_margin_t margin = oc_margin_of_camera(&body, &mount, &none);
        for (int i = 0; i < 6; i++) TEST_ASSERT_TRUE_MESSAGE(isfinite(margin.v[i]) && margin.v[i] > 0, text);
        for (int i = 3; i < 6; i++) TEST_ASSERT_TRUE_MESSAGE(margin.v[i] <= OC_TEST_PI / 4 + 1e-15, text);
        if (off_deg[draw / 4 % 10] < 0.01 && draw % 5) { /* not to be told apart: all that the link carries */
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, OC_TEST_PI / 4, margin.v[3], text);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, OC_TEST_PI / 4, margin.v[5], text);
        }
        double sum = 0; /* phi itself: how far the view is off the world's X, whichever way it strays */
        for (int k = 0; k < 300; k++) {
            double e[6] = {0}, z[6];
            for (int i = 0; i < 6; i++) z[i] = oc_test_normal(&random_numbers);
            for (int i = 0; i < 36; i++) e[i / 6] += l[i] * z[i % 6];
            const oc_body_pose_t other = disturbed(&body, e);
            const oc_pose6_t six = six_of(&other, &mount);
            sum += (six.v[4] - middle.v[4]) * (six.v[4] - middle.v[4]);
        }
        TEST_ASSERT_TRUE_MESSAGE(margin.v[4] > 0.75 * sqrt(3 * sum / 300), text); /* of 300 draws known to 6 % */
    }
}

static void the_largest_covariance_that_is_taken_gives_numbers(void)
{
    const oc_pose_t mount = mount_deg(1, 2, 3, 4, 5, 0);
    oc_body_pose_t body = {.q_wxyz = {1, 0, 0, 0}, .has_covariance = true};
    for (int i = 0; i < 36; i++) body.covariance[i] = i % 7 == 0 || i % 2 ? 1e30 : -1e30;
    const oc_margin_t margin = oc_margin_of_camera(&body, &mount, &none);
    for (int i = 0; i < 6; i++) TEST_ASSERT_TRUE(isfinite(margin.v[i]) && margin.v[i] >= 0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(mounts_worked_out_by_hand);
    RUN_TEST(every_mount_is_a_rotation);
    RUN_TEST(a_camera_sees_known_points_where_they_must_be);
    RUN_TEST(camera_and_world_undo_each_other);
    RUN_TEST(margins_are_what_the_six_parameters_do);
    RUN_TEST(margins_are_what_random_bodies_do);
    RUN_TEST(a_lever_carries_turns_to_the_centre);
    RUN_TEST(without_a_covariance_the_least_is_all);
    RUN_TEST(next_to_the_pole_margins_are_finite_and_not_too_small);
    RUN_TEST(the_largest_covariance_that_is_taken_gives_numbers);
    return UNITY_END();
}
