/* SPDX-License-Identifier: BSD-3-Clause
 * Rotations, poses, projection and lens distortion of core/camera.h.
 */
#include "unity.h"

#include "core/camera.h"
#include "core/mat3.h"
#include "thesis_tables.h"

void setUp(void) {}

void tearDown(void) {}

/* ---- the thesis' rotations ---- */

/* Rw, Rp, Rk of thesis Eq 4.9-4.11: passive turns about x, y and z. */
static void turn_about(int axis, double angle, double R[9])
{
    const int i = (axis + 1) % 3, j = (axis + 2) % 3;
    oc_mat3_identity(R);
    R[3 * i + i] = R[3 * j + j] = cos(angle);
    R[3 * i + j] = sin(angle);
    R[3 * j + i] = -sin(angle);
}

static double angle_difference(double a, double b)
{
    return fabs(remainder(a - b, 2.0 * OC_TEST_PI));
}

static void rotations_of_both_angle_systems_are_products_of_single_turns(void)
{
    oc_test_random_t r = oc_test_random_from(412);
    for (int draw = 0; draw < 2000; draw++) {
        double a[3], one[9], product[9], R[9];
        for (int i = 0; i < 3; i++) a[i] = oc_test_uniform(&r, -OC_TEST_PI, OC_TEST_PI);
        /* Eq 4.12: R = R_kappa R_phi R_omega. */
        turn_about(0, a[0], product);
        turn_about(1, a[1], one);
        oc_mat3_mul(one, product, product);
        turn_about(2, a[2], one);
        oc_mat3_mul(one, product, product);
        oc_thesis_from_opk(a[0], a[1], a[2], R);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, 0.0, oc_test_difference(product, R, 9), oc_test_draw(&r, draw));
        /* Eq 4.13: R = R_swing R_tilt R_pan; pan turns the other way. */
        turn_about(2, -a[0], product);
        turn_about(0, a[1], one);
        oc_mat3_mul(one, product, product);
        turn_about(2, a[2], one);
        oc_mat3_mul(one, product, product);
        oc_thesis_from_pts(a[0], a[1], a[2], R);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, 0.0, oc_test_difference(product, R, 9), oc_test_draw(&r, draw));
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, oc_mat3_det(R));
    }
}

/* Thesis Eq 4.14-4.19 written with atan2. */
static void angles_convert_by_the_printed_formulas_in_atan2_form(void)
{
    oc_test_random_t r = oc_test_random_from(414);
    for (int draw = 0; draw < 2000; draw++) {
        const double w = oc_test_uniform(&r, -OC_TEST_PI, OC_TEST_PI);
        const double p = oc_test_uniform(&r, OC_TEST_RAD(-89.9), OC_TEST_RAD(89.9));
        const double k = oc_test_uniform(&r, -OC_TEST_PI, OC_TEST_PI);
        const char *where = oc_test_draw(&r, draw);
        double pan, tilt, swing, w2, p2, k2, R[9], R2[9];
        oc_pts_from_opk(w, p, k, &pan, &tilt, &swing);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-7, acos(cos(w) * cos(p)), tilt, where);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0, angle_difference(pan, atan2(-sin(p), sin(w) * cos(p))), where);
        const double r13 = -cos(w) * sin(p) * cos(k) + sin(w) * sin(k);
        const double r23 = cos(w) * sin(p) * sin(k) + sin(w) * cos(k);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0, angle_difference(swing, atan2(r13, r23)), where);

        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0, angle_difference(w, atan2(sin(tilt) * cos(pan), cos(tilt))), where);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-6, p, asin(-sin(tilt) * sin(pan)), where);
        const double k_y = sin(swing) * cos(pan) - cos(swing) * cos(tilt) * sin(pan);
        const double k_x = cos(swing) * cos(pan) + sin(swing) * cos(tilt) * sin(pan);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0, angle_difference(k, atan2(k_y, k_x)), where);

        oc_opk_from_pts(pan, tilt, swing, &w2, &p2, &k2);
        oc_thesis_from_opk(w, p, k, R);
        oc_thesis_from_opk(w2, p2, k2, R2);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-13, 0.0, oc_test_difference(R, R2, 9), where);
        oc_thesis_from_pts(pan, tilt, swing, R2);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-13, 0.0, oc_test_difference(R, R2, 9), where);
    }
}

static void singular_attitudes_still_give_back_their_rotation(void)
{
    oc_test_random_t r = oc_test_random_from(90);
    const double tilts[] = {0.0, 1e-12, 1e-8, OC_TEST_PI};
    for (int draw = 0; draw < 200; draw++) {
        const double a = oc_test_uniform(&r, -3.0, 3.0), b = oc_test_uniform(&r, -3.0, 3.0);
        double R[9], R2[9], x, y, z;
        oc_thesis_from_pts(a, tilts[draw % 4], b, R);
        oc_pts_from_thesis(R, &x, &y, &z);
        oc_thesis_from_pts(x, y, z, R2);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, 0.0, oc_test_difference(R, R2, 9), oc_test_draw(&r, draw));
        /* phi = +-90 degrees, where omega and kappa turn about one axis. */
        oc_thesis_from_opk(a, (draw % 2 ? 1 : -1) * (OC_TEST_PI / 2.0 - tilts[draw % 3]), b, R);
        oc_opk_from_thesis(R, &x, &y, &z);
        oc_thesis_from_opk(x, y, z, R2);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, 0.0, oc_test_difference(R, R2, 9), oc_test_draw(&r, draw));
    }
}

static void attitudes_of_section_4_6_and_figure_4_1_agree(void)
{
    double a[9], b[9];
    oc_thesis_from_pts(OC_TEST_RAD(90), OC_TEST_RAD(70), 0, a);
    oc_thesis_from_opk(0, OC_TEST_RAD(-70), OC_TEST_RAD(-90), b);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.0, oc_test_difference(a, b, 9));
    oc_thesis_from_pts(0, OC_TEST_RAD(90), 0, a);
    oc_thesis_from_opk(OC_TEST_RAD(90), 0, 0, b);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.0, oc_test_difference(a, b, 9));
}

static void pan_is_the_azimuth_clockwise_from_north_and_tilt_is_from_nadir(void)
{
    oc_test_random_t r = oc_test_random_from(426);
    for (int draw = 0; draw < 100; draw++) {
        const double pan = oc_test_uniform(&r, -3.0, 3.0), tilt = oc_test_uniform(&r, 0.0, 3.0);
        const double axis[3] = {sin(tilt) * sin(pan), sin(tilt) * cos(pan), -cos(tilt)};
        double R[9];
        oc_thesis_from_pts(pan, tilt, oc_test_uniform(&r, -3.0, 3.0), R);
        oc_cv_from_thesis(R, R);
        /* The third row of R_cv is the optical axis. */
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-14, 0.0, oc_test_difference(axis, R + 6, 3), oc_test_draw(&r, draw));
    }
}

static void opencv_and_thesis_rotations_convert_into_each_other_in_place(void)
{
    double R[9], back[9];
    oc_test_thesis_rotation(&table_7_1, 4, R);
    oc_cv_from_thesis(R, back);
    TEST_ASSERT_EQUAL_DOUBLE(R[0], back[0]);
    TEST_ASSERT_EQUAL_DOUBLE(-R[3], back[3]);
    TEST_ASSERT_EQUAL_DOUBLE(-R[8], back[8]);
    oc_cv_from_thesis(back, back);
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(R, back, 9);
}

/* ---- intrinsics ---- */

static void focal_lengths_follow_from_the_film_format(void)
{
    const double focal_mm[3] = {4.3, 6.0, 3.6};
    const double fx[3] = {779.361, 1087.480, 652.488}, fy[3] = {752.022, 1049.333, 629.600};
    for (int i = 0; i < 3; i++) {
        const oc_intrinsics_t k =
            oc_intrinsics_from_format(focal_mm[i], OC_TEST_FORMAT_WIDTH_MM, OC_TEST_FORMAT_HEIGHT_MM, 640, 480);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, fx[i], k.fx_px);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, fy[i], k.fy_px);
        TEST_ASSERT_EQUAL_DOUBLE(319.5, k.cx_px);
        TEST_ASSERT_EQUAL_DOUBLE(239.5, k.cy_px);
        TEST_ASSERT_TRUE(oc_intrinsics_is_valid(&k));
    }
}

static void intrinsics_out_of_range_are_refused(void)
{
    const oc_intrinsics_t good = oc_test_camera(&table_5_1, 0).k;
    oc_intrinsics_t k = good;
    TEST_ASSERT_TRUE(oc_intrinsics_is_valid(&k));
    const double bad_focal[] = {0.0, -1.0, (double)NAN, (double)INFINITY};
    for (int i = 0; i < 4; i++) {
        k = good;
        k.fx_px = bad_focal[i];
        TEST_ASSERT_FALSE(oc_intrinsics_is_valid(&k));
        k = good;
        k.fy_px = bad_focal[i];
        TEST_ASSERT_FALSE(oc_intrinsics_is_valid(&k));
    }
    const double bad_centre[] = {-3.0 * 640 - 1, 4.0 * 640 + 1, (double)NAN, (double)-INFINITY};
    for (int i = 0; i < 4; i++) {
        k = good;
        k.cx_px = bad_centre[i];
        TEST_ASSERT_FALSE(oc_intrinsics_is_valid(&k));
        k = good;
        k.cy_px = bad_centre[i];
        TEST_ASSERT_FALSE(oc_intrinsics_is_valid(&k));
    }
    const uint32_t bad_side[] = {0, 31, 4097};
    for (int i = 0; i < 3; i++) {
        k = good;
        k.width_px = bad_side[i];
        TEST_ASSERT_FALSE(oc_intrinsics_is_valid(&k));
        k = good;
        k.height_px = bad_side[i];
        TEST_ASSERT_FALSE(oc_intrinsics_is_valid(&k));
    }
    k = good;
    k.cx_px = 4.0 * 640;
    TEST_ASSERT_TRUE(oc_intrinsics_is_valid(&k));
}

/* ---- poses ---- */

static void poses_that_are_no_rotation_are_refused(void)
{
    const oc_pose_t good = oc_test_camera(&table_7_3, 2).pose;
    TEST_ASSERT_TRUE(oc_pose_is_valid(&good));
    oc_pose_t bad = good;
    bad.R[4] += 1e-5;
    TEST_ASSERT_FALSE(oc_pose_is_valid(&bad));
    bad = good;
    bad.R[4] += 1e-8;
    TEST_ASSERT_TRUE(oc_pose_is_valid(&bad));
    bad = good;
    for (int i = 0; i < 3; i++) bad.R[i] = -bad.R[i];
    TEST_ASSERT_FALSE(oc_pose_is_valid(&bad));
    for (int i = 0; i < 9; i++) {
        bad = good;
        bad.R[i] = (double)NAN;
        TEST_ASSERT_FALSE(oc_pose_is_valid(&bad));
    }
    for (int i = 0; i < 3; i++) {
        bad = good;
        bad.t[i] = i ? (double)NAN : (double)INFINITY;
        TEST_ASSERT_FALSE(oc_pose_is_valid(&bad));
    }
}

static void six_parameters_give_the_pose_back(void)
{
    oc_test_random_t r = oc_test_random_from(6);
    for (int draw = 0; draw < 500; draw++) {
        oc_pose6_t six, again;
        oc_pose_t pose;
        for (int i = 0; i < 6; i++) six.v[i] = oc_test_uniform(&r, -1.5, 1.5);
        oc_pose_from_6(&six, &pose);
        TEST_ASSERT_TRUE_MESSAGE(oc_pose_is_valid(&pose), oc_test_draw(&r, draw));
        oc_pose_to_6(&pose, &again);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, oc_test_difference(six.v, again.v, 6), oc_test_draw(&r, draw));
    }
}

static void composing_and_inverting_poses_move_points_accordingly(void)
{
    oc_pose_t a = oc_test_camera(&table_7_1, 0).pose;
    const oc_pose_t b = oc_test_camera(&table_7_3, 5).pose;
    const double p[3] = {0.3, -1.2, 2.5};
    double step[3], q[3];
    oc_mat3_mul_vec(b.R, p, step);
    for (int i = 0; i < 3; i++) step[i] += b.t[i];
    oc_mat3_mul_vec(a.R, step, q);
    for (int i = 0; i < 3; i++) q[i] += a.t[i];

    oc_pose_t both, back;
    oc_pose_compose(&a, &b, &both);
    oc_mat3_mul_vec(both.R, p, step);
    for (int i = 0; i < 3; i++) step[i] += both.t[i];
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.0, oc_test_difference(q, step, 3));

    oc_pose_invert(&both, &back);
    oc_mat3_mul_vec(back.R, q, step);
    for (int i = 0; i < 3; i++) step[i] += back.t[i];
    TEST_ASSERT_DOUBLE_WITHIN(1e-14, 0.0, oc_test_difference(p, step, 3));
    oc_pose_compose(&a, &b, &a);
    TEST_ASSERT_EQUAL_MEMORY(&both, &a, sizeof a);
}

static void quaternions_and_rotations_convert_in_every_branch(void)
{
    oc_test_random_t r = oc_test_random_from(44);
    for (int draw = 0; draw < 2000; draw++) {
        double q[4], R[9], again[4], norm = 0.0;
        for (int i = 0; i < 4; i++) q[i] = oc_test_normal(&r);
        /* One draw in four is a half turn, w = 0, about a random axis. */
        if (draw % 4 == 0) q[0] = 0.0;
        for (int i = 0; i < 4; i++) norm += q[i] * q[i];
        for (int i = 0; i < 4; i++) q[i] /= sqrt(norm) * (q[0] < 0.0 ? -1.0 : 1.0);
        TEST_ASSERT_EQUAL(OC_OK, oc_rotation_from_quat(q, R));
        const oc_pose_t pose = {{R[0], R[1], R[2], R[3], R[4], R[5], R[6], R[7], R[8]}, {0, 0, 0}};
        TEST_ASSERT_TRUE_MESSAGE(oc_pose_is_valid(&pose), oc_test_draw(&r, draw));
        oc_quat_from_rotation(R, again);
        double dot = 0.0;
        for (int i = 0; i < 4; i++) dot += q[i] * again[i];
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 1.0, fabs(dot), oc_test_draw(&r, draw));
        TEST_ASSERT_TRUE(again[0] >= 0.0);
    }
}

static void a_quaternion_turns_the_right_way_and_must_be_of_unit_length(void)
{
    const double quarter_about_z[4] = {sqrt(0.5), 0, 0, sqrt(0.5)};
    const double expected[9] = {0, -1, 0, 1, 0, 0, 0, 0, 1};
    double R[9] = {42};
    const double bad[4][4] = {{0, 0, 0, 0}, {1.01, 0, 0, 0}, {(double)NAN, 0, 0, 1}, {(double)INFINITY, 0, 0, 0}};
    for (int i = 0; i < 4; i++) TEST_ASSERT_EQUAL(OC_E_ARG, oc_rotation_from_quat(bad[i], R));
    TEST_ASSERT_EQUAL_DOUBLE(42, R[0]);
    TEST_ASSERT_EQUAL(OC_OK, oc_rotation_from_quat(quarter_about_z, R));
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.0, oc_test_difference(expected, R, 9));
}

/* ---- projection ---- */

/* The thesis' A_th R [I | -C], A_th = [-fx 0 cx; 0 fy cy; 0 0 1], equals -P. */
static void the_thesis_projection_matrix_is_minus_ours(void)
{
    const oc_test_table_t *tables[3] = {&table_5_1, &table_7_1, &table_7_3};
    for (int t = 0; t < 3; t++) {
        for (int row = 0; row < tables[t]->n; row++) {
            const oc_camera_t c = oc_test_camera(tables[t], row);
            const double A[9] = {-c.k.fx_px, 0, c.k.cx_px, 0, c.k.fy_px, c.k.cy_px, 0, 0, 1};
            double R[9], AR[9], centre[3], last[3], P[12];
            oc_test_thesis_rotation(tables[t], row, R);
            oc_mat3_mul(A, R, AR);
            oc_pose_centre(&c.pose, centre);
            oc_mat3_mul_vec(AR, centre, last);
            oc_camera_matrix(&c, P);
            for (int i = 0; i < 9; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-10, -AR[i], P[4 * (i / 3) + i % 3]);
            for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-9, last[i], P[4 * i + 3]);
        }
    }
}

static void depth_is_minus_the_third_row_of_the_thesis_rotation_times_the_offset(void)
{
    oc_test_random_t r = oc_test_random_from(55);
    const oc_camera_t c = oc_test_camera(&table_7_1, 5);
    double R[9], centre[3], P[12];
    oc_test_thesis_rotation(&table_7_1, 5, R);
    oc_pose_centre(&c.pose, centre);
    oc_camera_matrix(&c, P);
    for (int draw = 0; draw < 200; draw++) {
        double p[3], offset[3], x = -1, y = -1;
        for (int i = 0; i < 3; i++) p[i] = oc_test_uniform(&r, -1.0, 1.0);
        oc_vec3_sub(p, centre, offset);
        const double depth = oc_camera_project(&c, p, &x, &y);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, -oc_vec3_dot(R + 6, offset), depth, oc_test_draw(&r, draw));
        if (depth <= 0.0) {
            TEST_ASSERT_EQUAL_DOUBLE(-1, x);
            TEST_ASSERT_EQUAL_DOUBLE(-1, y);
            continue;
        }
        const double u = oc_vec3_dot(P, p) + P[3], v = oc_vec3_dot(P + 4, p) + P[7];
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8 * (1 + fabs(x)), u / depth, x, oc_test_draw(&r, draw));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8 * (1 + fabs(y)), v / depth, y, oc_test_draw(&r, draw));
        double ray[3], across[3];
        oc_camera_ray(&c, x, y, ray);
        TEST_ASSERT_DOUBLE_WITHIN(1e-14, 1.0, oc_vec3_norm(ray));
        oc_vec3_cross(ray, offset, across);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, oc_vec3_norm(across), oc_test_draw(&r, draw));
        TEST_ASSERT_TRUE(oc_vec3_dot(ray, offset) > 0.0);
    }
    const double nowhere[3] = {(double)NAN, 0, 0};
    double x = 7, y = 7;
    TEST_ASSERT_FALSE(oc_camera_project(&c, nowhere, &x, &y) > 0.0);
    TEST_ASSERT_EQUAL_DOUBLE(7, x);
}

/* ---- lens distortion ---- */

static void undistortion_undoes_distortion_over_the_image(void)
{
    const oc_intrinsics_t k = {500, 510, 320, 240, 640, 480};
    const oc_distortion_t d = {{-0.28, 0.09, 0.0012, -0.0008, -0.01}};
    for (int y = 0; y < 480; y += 37) {
        for (int x = 0; x < 640; x += 41) {
            double xd, yd, xu = 0, yu = 0;
            oc_distort(&k, &d, x, y, &xd, &yd);
            TEST_ASSERT_EQUAL(OC_OK, oc_undistort(&k, &d, xd, yd, &xu, &yu));
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, x, xu);
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, y, yu);
        }
    }
}

static void distortion_is_the_plumb_bob_model(void)
{
    const oc_intrinsics_t k = {100, 100, 0, 0, 640, 480};
    const oc_distortion_t radial = {{0.1, 0.01, 0, 0, 0.001}}, tangential = {{0, 0, 0.01, 0.02, 0}};
    double x, y;
    /* At (1, 2): r2 = 5. Radial 1 + .5 + .25 + .125; tangential by hand. */
    oc_distort(&k, &radial, 100, 200, &x, &y);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 187.5, x);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 375.0, y);
    oc_distort(&k, &tangential, 100, 200, &x, &y);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 100 + 100 * (2 * 0.01 * 2 + 0.02 * (5 + 2)), x);
    TEST_ASSERT_DOUBLE_WITHIN(1e-10, 200 + 100 * (0.01 * (5 + 8) + 2 * 0.02 * 2), y);
}

static void undistortion_that_does_not_settle_says_so_and_writes_nothing(void)
{
    const oc_intrinsics_t k = {100, 100, 320, 240, 640, 480};
    const oc_distortion_t strong = {{-0.5, 0, 0, 0, 0}}, none = {{0}};
    double x = 5, y = 5;
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_undistort(&k, &strong, 640, 480, &x, &y));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_undistort(&k, &none, (double)NAN, 0, &x, &y));
    TEST_ASSERT_EQUAL_DOUBLE(5, x);
    TEST_ASSERT_EQUAL_DOUBLE(5, y);
    TEST_ASSERT_EQUAL(OC_OK, oc_undistort(&k, &none, 12.5, 400, &x, &y));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 12.5, x);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 400, y);
}

/* ---- small matrices ---- */

static void inverse_and_solve_refuse_singular_and_not_a_number(void)
{
    const double singular[9] = {1, 2, 3, 2, 4, 6, 1, 0, 1}, b[3] = {1, 2, 3};
    double out[9] = {42}, x[3] = {0}, check[3];
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_mat3_inverse(singular, out));
    double bad[9] = {1, 0, 0, 0, 1, 0, 0, 0, (double)NAN};
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_mat3_inverse(bad, out));
    bad[8] = (double)INFINITY;
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_mat3_inverse(bad, out));
    TEST_ASSERT_EQUAL_DOUBLE(42, out[0]);

    oc_test_random_t r = oc_test_random_from(3);
    for (int draw = 0; draw < 200; draw++) {
        double a[9], product[9], eye[9];
        for (int i = 0; i < 9; i++) a[i] = oc_test_uniform(&r, -1, 1);
        if (fabs(oc_mat3_det(a)) < 1e-3) continue;
        oc_mat3_identity(eye);
        TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(a, out));
        oc_mat3_mul(a, out, product);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-11, 0.0, oc_test_difference(product, eye, 9), oc_test_draw(&r, draw));
        TEST_ASSERT_EQUAL(OC_OK, oc_mat3_solve(a, b, x));
        oc_mat3_mul_vec(a, x, check);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-11, 0.0, oc_test_difference(check, b, 3), oc_test_draw(&r, draw));
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(rotations_of_both_angle_systems_are_products_of_single_turns);
    RUN_TEST(angles_convert_by_the_printed_formulas_in_atan2_form);
    RUN_TEST(singular_attitudes_still_give_back_their_rotation);
    RUN_TEST(attitudes_of_section_4_6_and_figure_4_1_agree);
    RUN_TEST(pan_is_the_azimuth_clockwise_from_north_and_tilt_is_from_nadir);
    RUN_TEST(opencv_and_thesis_rotations_convert_into_each_other_in_place);
    RUN_TEST(focal_lengths_follow_from_the_film_format);
    RUN_TEST(intrinsics_out_of_range_are_refused);
    RUN_TEST(poses_that_are_no_rotation_are_refused);
    RUN_TEST(six_parameters_give_the_pose_back);
    RUN_TEST(composing_and_inverting_poses_move_points_accordingly);
    RUN_TEST(quaternions_and_rotations_convert_in_every_branch);
    RUN_TEST(a_quaternion_turns_the_right_way_and_must_be_of_unit_length);
    RUN_TEST(the_thesis_projection_matrix_is_minus_ours);
    RUN_TEST(depth_is_minus_the_third_row_of_the_thesis_rotation_times_the_offset);
    RUN_TEST(undistortion_undoes_distortion_over_the_image);
    RUN_TEST(distortion_is_the_plumb_bob_model);
    RUN_TEST(undistortion_that_does_not_settle_says_so_and_writes_nothing);
    RUN_TEST(inverse_and_solve_refuse_singular_and_not_a_number);
    return UNITY_END();
}
