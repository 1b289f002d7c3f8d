/* SPDX-License-Identifier: BSD-3-Clause
 * The fundamental matrix, its compatibility with homographies, and triangulation.
 */
#include "unity.h"

#include <string.h>

#include "core/epipolar.h"
#include "core/plane.h"
#include "thesis_tables.h"

static oc_camera_t left, right;

void setUp(void)
{
    left = oc_test_camera(&table_5_1, 0);
    right = oc_test_camera(&table_5_1, 1);
}

void tearDown(void) {}

static void use_pair(int i)
{
    left = oc_test_camera(thesis_pairs[i].table, thesis_pairs[i].left);
    right = oc_test_camera(thesis_pairs[i].table, thesis_pairs[i].right);
}

static void camera_m(const oc_camera_t *c, double M[9])
{
    double P[12];
    oc_camera_matrix(c, P);
    for (int i = 0; i < 9; i++) M[i] = P[4 * (i / 3) + i % 3];
}

/* A point within 80 mm of the origin, above the ground. */
static void scene_point(oc_test_random_t *r, double p[3])
{
    for (int i = 0; i < 3; i++) p[i] = oc_test_uniform(r, i < 2 ? -0.05 : 0.0, i < 2 ? 0.05 : 0.1);
}

/* ---- the fundamental matrix ---- */

/* Eq 2.32 in three orders, 2.35 = 5.7 and 2.49. */
static void forms_of_the_fundamental_matrix_agree_on_every_pair(void)
{
    for (int i = 0; i < 5; i++) {
        use_pair(i);
        const char *name = thesis_pairs[i].name;
        double F[9], M1[9], M2[9], M1_inv[9] = {0}, M2_inv_t[9] = {0}, c1[3], c2[3], d[3], s[9], v[3], form[9], t[9];
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&left, &right, F));
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, oc_mat3_norm(F));
        camera_m(&left, M1);
        camera_m(&right, M2);
        TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(M1, M1_inv));
        TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(M2, M2_inv_t));
        oc_mat3_transpose(M2_inv_t, M2_inv_t);
        oc_pose_centre(&left.pose, c1);
        oc_pose_centre(&right.pose, c2);
        oc_vec3_sub(c1, c2, d);

        /* (A'R')^-T [C - C']x (AR)^-1 */
        oc_mat3_skew(d, s);
        oc_mat3_mul(M2_inv_t, s, form);
        oc_mat3_mul(form, M1_inv, form);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, 0.0, oc_test_scaled_difference(F, form), name);
        /* [e']x A'R' (AR)^-1 */
        oc_mat3_mul_vec(M2, d, v);
        oc_mat3_skew(v, s);
        oc_mat3_mul(s, M2, form);
        oc_mat3_mul(form, M1_inv, form);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, 0.0, oc_test_scaled_difference(F, form), name);
        /* (A'R')^-T (AR)^T [AR (C - C')]x */
        oc_mat3_mul_vec(M1, d, v);
        oc_mat3_skew(v, s);
        oc_mat3_transpose(M1, t);
        oc_mat3_mul(M2_inv_t, t, form);
        oc_mat3_mul(form, s, form);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, 0.0, oc_test_scaled_difference(F, form), name);
    }
}

/* Eq 2.49, 2.53: A'^-T [t]x R A^-1. */
static void the_essential_form_agrees_on_every_pair(void)
{
    for (int i = 0; i < 5; i++) {
        use_pair(i);
        double F[9], s[9], form[9], K1_inv[9] = {0}, K2_inv[9] = {0};
        oc_pose_t left_inverse, relative;
        const double K1[9] = {left.k.fx_px, 0, left.k.cx_px, 0, left.k.fy_px, left.k.cy_px, 0, 0, 1};
        const double K2[9] = {right.k.fx_px, 0, right.k.cx_px, 0, right.k.fy_px, right.k.cy_px, 0, 0, 1};
        TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(K1, K1_inv));
        TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(K2, K2_inv));
        oc_mat3_transpose(K2_inv, K2_inv);
        oc_pose_invert(&left.pose, &left_inverse);
        oc_pose_compose(&right.pose, &left_inverse, &relative);
        oc_mat3_skew(relative.t, s);
        oc_mat3_mul(s, relative.R, form);
        oc_mat3_mul(form, K1_inv, form);
        oc_mat3_mul(K2_inv, form, form);
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&left, &right, F));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, 0.0, oc_test_scaled_difference(F, form), thesis_pairs[i].name);
    }
}

/* Eq 2.34: [(AR)^-1; 0] is a right inverse of P, not its pseudo-inverse P^T (P P^T)^-1;
 * [e']x P' of either gives the same F. */
static void both_right_inverses_of_equation_2_34_give_the_same_f(void)
{
    use_pair(3);
    double P[12], P2[12], M1[9], M1_inv[9] = {0}, PPt[9], PPt_inv[9] = {0}, pinv[12], e1[3], e2[3], s[9], F[9], form[9];
    oc_camera_matrix(&left, P);
    oc_camera_matrix(&right, P2);
    camera_m(&left, M1);
    TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(M1, M1_inv));
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            PPt[3 * r + c] = oc_vec3_dot(P + 4 * r, P + 4 * c) + P[4 * r + 3] * P[4 * c + 3];
        }
    }
    TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(PPt, PPt_inv));
    double largest = 0.0;
    for (int r = 0; r < 4; r++) {
        for (int c = 0; c < 3; c++) {
            pinv[3 * r + c] = P[r] * PPt_inv[c] + P[4 + r] * PPt_inv[3 + c] + P[8 + r] * PPt_inv[6 + c];
            largest = fmax(largest, fabs(pinv[3 * r + c] - (r < 3 ? M1_inv[3 * r + c] : 0.0)));
        }
    }
    TEST_ASSERT_TRUE(largest > 1e-3);
    oc_epipolar_epipoles(&left, &right, e1, e2);
    oc_mat3_skew(e2, s);
    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&left, &right, F));
    for (int which = 0; which < 2; which++) {
        for (int r = 0; r < 3; r++) {
            for (int c = 0; c < 3; c++) {
                double sum = 0.0;
                for (int k = 0; k < 3; k++) sum += P2[4 * r + k] * (which ? pinv[3 * k + c] : M1_inv[3 * k + c]);
                form[3 * r + c] = sum + (which ? P2[4 * r + 3] * pinv[9 + c] : 0.0);
            }
        }
        oc_mat3_mul(s, form, form);
        TEST_ASSERT_DOUBLE_WITHIN(1e-8, 0.0, oc_test_scaled_difference(F, form));
    }
}

static void images_of_a_point_lie_on_each_other_s_epipolar_lines(void)
{
    for (int i = 0; i < 5; i++) {
        use_pair(i);
        oc_test_random_t r = oc_test_random_from(232);
        double F[9];
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&left, &right, F));
        for (int draw = 0; draw < 50; draw++) {
            double p[3], x, y, x2, y2, l[3];
            scene_point(&r, p);
            oc_camera_project(&left, p, &x, &y);
            oc_camera_project(&right, p, &x2, &y2);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-6, 0.0, oc_epipolar_distance_px(F, x, y, x2, y2),
                                              oc_test_draw(&r, draw));
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-6, 0.0, oc_epipolar_sampson_px(F, x, y, x2, y2),
                                              oc_test_draw(&r, draw));
            /* 3 px off along the normal is a distance of 3 px. */
            TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_line(F, x, y, l));
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3.0, oc_epipolar_distance_px(F, x, y, x2 + 3 * l[0], y2 + 3 * l[1]));
        }
    }
}

static void the_sampson_distance_is_the_distance_to_the_nearest_satisfying_pair(void)
{
    use_pair(3);
    oc_test_random_t r = oc_test_random_from(13);
    double F[9];
    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&left, &right, F));
    for (int draw = 0; draw < 50; draw++) {
        double p[3], v[4], start[4];
        scene_point(&r, p);
        oc_camera_project(&left, p, &v[0], &v[1]);
        oc_camera_project(&right, p, &v[2], &v[3]);
        for (int i = 0; i < 4; i++) v[i] += oc_test_normal(&r);
        memcpy(start, v, sizeof v);
        const double sampson = oc_epipolar_sampson_px(F, v[0], v[1], v[2], v[3]);
        /* Steepest descent onto m'^T F m = 0 converges to the nearest pair for errors this small. */
        for (int step = 0; step < 5; step++) {
            const double m2[3] = {v[2], v[3], 1};
            double l[3], l_left[3];
            oc_mat3_mul_point(F, v[0], v[1], l);
            oc_mat3_mul_vec_t(F, m2, l_left);
            const double g[4] = {l_left[0], l_left[1], l[0], l[1]};
            const double g2 = g[0] * g[0] + g[1] * g[1] + g[2] * g[2] + g[3] * g[3];
            const double e = oc_vec3_dot(m2, l);
            for (int i = 0; i < 4; i++) v[i] -= e / g2 * g[i];
        }
        double moved = 0.0;
        for (int i = 0; i < 4; i++) moved += (v[i] - start[i]) * (v[i] - start[i]);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.01 + 0.01 * fabs(sampson), sqrt(moved), fabs(sampson),
                                          oc_test_draw(&r, draw));
    }
}

static void f_is_compatible_with_the_ground_homography(void)
{
    for (int i = 0; i < 5; i++) {
        use_pair(i);
        const char *name = thesis_pairs[i].name;
        double F[9], H[9], Ft[9], FtH[9], sum[9], e1[3], e2[3], He[3], s[9], form[9], across[3];
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&left, &right, F));
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&left, &right, H));
        oc_mat3_transpose(F, Ft);
        oc_mat3_mul(Ft, H, FtH);
        oc_mat3_transpose(FtH, sum);
        for (int k = 0; k < 9; k++) sum[k] += FtH[k];
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0.0, oc_mat3_norm(sum) / oc_mat3_norm(FtH), name);
        oc_epipolar_epipoles(&left, &right, e1, e2);
        oc_mat3_skew(e2, s);
        oc_mat3_mul(s, H, form);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, 0.0, oc_test_scaled_difference(F, form), name);
        oc_mat3_mul_vec(H, e1, He);
        oc_vec3_normalise(He);
        oc_vec3_normalise(e2);
        oc_vec3_cross(He, e2, across);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-7, 0.0, oc_vec3_norm(across), name);
        /* l = H^T l' is the left epipolar line of the transferred point. */
        double l2[3], l1[3], x2, y2;
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_line(F, 300, 260, l2));
        oc_mat3_mul_vec_t(H, l2, l1);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, (l1[0] * 300 + l1[1] * 260 + l1[2]) / hypot(l1[0], l1[1]));
        oc_homography_apply(H, 300, 260, &x2, &y2);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-6, 0.0, oc_epipolar_distance_px(F, 300, 260, x2, y2), name);
    }
}

static void pairs_of_one_centre_and_pixels_at_the_epipole_are_refused(void)
{
    double F[9] = {42}, e1[3], e2[3], l[3] = {42};
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_epipolar_fundamental(&left, &left, F));
    TEST_ASSERT_EQUAL_DOUBLE(42, F[0]);
    /* A camera ahead of another has its epipole in the image. */
    right = left;
    right.pose.t[2] -= 0.1;
    right.pose.t[0] += 0.003;
    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&left, &right, F));
    oc_epipolar_epipoles(&left, &right, e1, e2);
    const double x = e1[0] / e1[2], y = e1[1] / e1[2];
    TEST_ASSERT_TRUE(x > 0 && x < 640 && y > 0 && y < 480);
    oc_mat3_mul_point(F, x, y, l);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, oc_vec3_norm(l));
    const double whole[9] = {0, -1, 200, 1, 0, -300, -200, 300, 0};
    l[0] = 42;
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_epipolar_line(whole, 300, 200, l));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_epipolar_line(whole, (double)NAN, 200, l));
    TEST_ASSERT_EQUAL_DOUBLE(42, l[0]);
    TEST_ASSERT_TRUE(isnan(oc_epipolar_distance_px(whole, 300, 200, 10, 10)));
    TEST_ASSERT_TRUE(isnan(oc_epipolar_sampson_px(whole, 300, 200, 300, 200)));
    TEST_ASSERT_FALSE(isnan(oc_epipolar_sampson_px(whole, 300, 200, 10, 10)));
}

/* ---- points from rays ---- */

/* The common perpendicular by its own two equations. */
static void perpendicular_midpoint(const double c1[3], const double u[3], const double c2[3], const double v[3],
                                   double p[3], double *gap)
{
    double base[3], ends[2][3], across[3];
    oc_vec3_sub(c2, c1, base);
    const double uv = oc_vec3_dot(u, v), bu = oc_vec3_dot(base, u), bv = oc_vec3_dot(base, v);
    const double s = (bu - uv * bv) / (1 - uv * uv), t = (uv * bu - bv) / (1 - uv * uv);
    for (int i = 0; i < 3; i++) {
        ends[0][i] = c1[i] + s * u[i];
        ends[1][i] = c2[i] + t * v[i];
        p[i] = (ends[0][i] + ends[1][i]) / 2;
    }
    oc_vec3_sub(ends[0], ends[1], across);
    *gap = oc_vec3_norm(across);
}

static void equation_2_77_is_the_middle_of_the_common_perpendicular(void)
{
    oc_test_random_t r = oc_test_random_from(277);
    for (int draw = 0; draw < 2000; draw++) {
        const char *where = oc_test_draw(&r, draw);
        use_pair(draw % 5);
        double c1[3], c2[3], u[3], v[3], expected[3], gap, pixel[4];
        for (int i = 0; i < 4; i++) pixel[i] = oc_test_uniform(&r, 0, i % 2 ? 480 : 640);
        oc_pose_centre(&left.pose, c1);
        oc_pose_centre(&right.pose, c2);
        oc_camera_ray(&left, pixel[0], pixel[1], u);
        oc_camera_ray(&right, pixel[2], pixel[3], v);
        const double parallax = acos(fmin(1.0, oc_vec3_dot(u, v)));
        if (parallax < 0.02) continue;
        perpendicular_midpoint(c1, u, c2, v, expected, &gap);
        oc_midpoint_t mid;
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_midpoint(&left, pixel[0], pixel[1], &right, pixel[2], pixel[3], &mid));
        const double far = 1.0 + oc_vec3_norm(expected);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9 * far, 0.0, oc_test_difference(expected, mid.p_in_world, 3), where);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9 * far, gap, mid.gap_m, where);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, parallax, mid.parallax_rad, where);
    }
}

static void exact_images_give_their_point_back_with_its_depths(void)
{
    oc_test_random_t r = oc_test_random_from(300);
    for (int draw = 0; draw < 200; draw++) {
        use_pair(draw % 5);
        double p[3], x, y, x2, y2;
        scene_point(&r, p);
        const double depth = oc_camera_project(&left, p, &x, &y), depth2 = oc_camera_project(&right, p, &x2, &y2);
        oc_midpoint_t mid;
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_midpoint(&left, x, y, &right, x2, y2, &mid));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0.0, oc_test_difference(p, mid.p_in_world, 3), oc_test_draw(&r, draw));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, depth, mid.depth_left_m);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, depth2, mid.depth_right_m);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, mid.gap_m);
    }
}

static void a_point_behind_a_camera_has_a_negative_depth(void)
{
    /* Rays that part ahead of two level cameras meet behind them. */
    const double R[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, c1[3] = {0, 0, 0}, c2[3] = {1, 0, 0};
    oc_pose_from_centre(R, c1, &left.pose);
    oc_pose_from_centre(R, c2, &right.pose);
    oc_midpoint_t mid;
    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_midpoint(&left, left.k.cx_px - 50, left.k.cy_px, &right, right.k.cx_px + 50,
                                                  right.k.cy_px, &mid));
    TEST_ASSERT_TRUE(mid.depth_left_m < -1.0 && mid.depth_right_m < -1.0);
    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_midpoint(&left, left.k.cx_px + 50, left.k.cy_px, &right, right.k.cx_px - 50,
                                                  right.k.cy_px, &mid));
    TEST_ASSERT_TRUE(mid.depth_left_m > 1.0 && mid.depth_right_m > 1.0);
}

static void parallel_rays_and_bad_pixels_are_refused(void)
{
    oc_midpoint_t mid = {{42, 0, 0}, 0, 0, 0, 0};
    const double c2[3] = {1, 0, 0};
    double cov[9] = {42}, p[3] = {42};
    right = left;
    oc_pose_from_centre(left.pose.R, c2, &right.pose);
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_epipolar_midpoint(&left, 100, 100, &right, 100, 100, &mid));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_epipolar_midpoint(&left, 100, 100, &right, 100.0001, 100, &mid));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_epipolar_midpoint(&left, (double)NAN, 100, &right, 100, 100, &mid));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_epipolar_midpoint(&left, 1, 100, &right, 100, (double)INFINITY, &mid));
    TEST_ASSERT_EQUAL_DOUBLE(42, mid.p_in_world[0]);
    const double sigmas[3] = {0, -1, (double)NAN};
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_epipolar_midpoint_covariance(&left, 1, 2, &right, 90, 4, sigmas[i], cov));
    }
    TEST_ASSERT_EQUAL_DOUBLE(42, cov[0]);
    const oc_camera_t both[2] = {left, right};
    const double same[2][2] = {{100, 100}, {100, 100}}, bad[2][2] = {{100, 100}, {(double)NAN, 100}};
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_epipolar_nearest_point(both, same, 2, p));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_epipolar_nearest_point(both, bad, 2, p));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_epipolar_nearest_point(both, same, 1, p));
    TEST_ASSERT_EQUAL_DOUBLE(42, p[0]);
}

static void the_covariance_is_what_noise_does(void)
{
    const double sigma = 0.5, p[3] = {0.1, -0.2, 0.3};
    const int n = 20000;
    double x, y, x2, y2, cov[9], sample[9] = {0};
    oc_test_random_t r = oc_test_random_from(9);
    oc_camera_project(&left, p, &x, &y);
    oc_camera_project(&right, p, &x2, &y2);
    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_midpoint_covariance(&left, x, y, &right, x2, y2, sigma, cov));
    for (int draw = 0; draw < n; draw++) {
        oc_midpoint_t mid;
        double d[3], dd[9];
        const double a = x + sigma * oc_test_normal(&r), b = y + sigma * oc_test_normal(&r);
        const double c = x2 + sigma * oc_test_normal(&r), e = y2 + sigma * oc_test_normal(&r);
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_midpoint(&left, a, b, &right, c, e, &mid));
        oc_vec3_sub(mid.p_in_world, p, d);
        oc_mat3_outer(d, d, dd);
        for (int i = 0; i < 9; i++) sample[i] += dd[i] / n;
    }
    /* A variance from 20 000 draws is good to 1 %; 5 of those. */
    const double scale = cov[0] + cov[4] + cov[8];
    for (int i = 0; i < 9; i++) TEST_ASSERT_DOUBLE_WITHIN(0.05 * scale, sample[i], cov[i]);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, cov[1], cov[3]);
}

static void the_nearest_point_of_two_rays_is_the_midpoint(void)
{
    oc_test_random_t r = oc_test_random_from(22);
    for (int draw = 0; draw < 100; draw++) {
        double p[3], q[3], pixels[2][2];
        scene_point(&r, p);
        oc_camera_project(&left, p, &pixels[0][0], &pixels[0][1]);
        oc_camera_project(&right, p, &pixels[1][0], &pixels[1][1]);
        for (int i = 0; i < 4; i++) pixels[i / 2][i % 2] += 3 * oc_test_normal(&r);
        const oc_camera_t both[2] = {left, right};
        oc_midpoint_t mid;
        TEST_ASSERT_EQUAL(
            OC_OK, oc_epipolar_midpoint(&left, pixels[0][0], pixels[0][1], &right, pixels[1][0], pixels[1][1], &mid));
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_nearest_point(both, (const double(*)[2])pixels, 2, q));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, oc_test_difference(mid.p_in_world, q, 3), oc_test_draw(&r, draw));
    }
}

static void the_nearest_point_of_many_rays_is_exact_without_noise_and_better_with_it(void)
{
    oc_test_random_t r = oc_test_random_from(8);
    oc_camera_t cameras[8];
    double sum2[2] = {0, 0};
    for (int i = 0; i < 8; i++) cameras[i] = oc_test_camera(&table_7_3, i);
    for (int draw = 0; draw < 300; draw++) {
        double p[3], q[3], pixels[8][2];
        scene_point(&r, p);
        for (int i = 0; i < 8; i++) oc_camera_project(&cameras[i], p, &pixels[i][0], &pixels[i][1]);
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_nearest_point(cameras, (const double(*)[2])pixels, 8, q));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, oc_test_difference(p, q, 3), oc_test_draw(&r, draw));
        for (int i = 0; i < 16; i++) pixels[i / 2][i % 2] += oc_test_normal(&r);
        for (int k = 0; k < 2; k++) {
            double d[3];
            TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_nearest_point(cameras, (const double(*)[2])pixels, k ? 8 : 2, q));
            oc_vec3_sub(p, q, d);
            sum2[k] += oc_vec3_dot(d, d);
        }
    }
    TEST_ASSERT_TRUE(sum2[1] < 0.5 * sum2[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(forms_of_the_fundamental_matrix_agree_on_every_pair);
    RUN_TEST(the_essential_form_agrees_on_every_pair);
    RUN_TEST(both_right_inverses_of_equation_2_34_give_the_same_f);
    RUN_TEST(images_of_a_point_lie_on_each_other_s_epipolar_lines);
    RUN_TEST(the_sampson_distance_is_the_distance_to_the_nearest_satisfying_pair);
    RUN_TEST(f_is_compatible_with_the_ground_homography);
    RUN_TEST(pairs_of_one_centre_and_pixels_at_the_epipole_are_refused);
    RUN_TEST(equation_2_77_is_the_middle_of_the_common_perpendicular);
    RUN_TEST(exact_images_give_their_point_back_with_its_depths);
    RUN_TEST(a_point_behind_a_camera_has_a_negative_depth);
    RUN_TEST(parallel_rays_and_bad_pixels_are_refused);
    RUN_TEST(the_covariance_is_what_noise_does);
    RUN_TEST(the_nearest_point_of_two_rays_is_the_midpoint);
    RUN_TEST(the_nearest_point_of_many_rays_is_exact_without_noise_and_better_with_it);
    return UNITY_END();
}
