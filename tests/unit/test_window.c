/* SPDX-License-Identifier: BSD-3-Clause
 * Covariance windows, strips and segments, and the thesis' own.
 */
#include "unity.h"

#include <stdbool.h>
#include <string.h>

#include "core/epipolar.h"
#include "core/plane.h"
#include "core/window.h"
#include "window_scenes.h"

void setUp(void)
{
    use_scene(&scenes[0]);
}

void tearDown(void) {}

/* ---- preparing a pair ---- */

static void a_prepared_pair_has_the_matrices_of_its_cameras(void)
{
    double F[9], H[9];
    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&left, &right, F));
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&left, &right, H));
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(F, pair.F, 9);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, oc_test_difference(H, pair.H, 9));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, oc_test_difference(H, thesis.H, 9));
    for (int z = 1; z < 4; z++) {
        const oc_plane_t level = {{0, 0, 1}, -0.1 * z};
        double expected[9];
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_homography(&left, &right, &level, expected, NULL));
        for (int i = 0; i < 9; i++) H[i] = pair.H_inf[i] - pair.B[i] / (pair.left_height_m - 0.1 * z);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, oc_test_difference(H, expected, 9));
    }
    TEST_ASSERT_TRUE(sizeof(oc_pair_t) < 4608);
}

static void margins_that_are_zero_leave_only_pixel_noise(void)
{
    const oc_margin_t none = {{0}};
    double J[4];
    oc_window_t w;
    oc_strip_t s;
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare(&pair, &left, &none, &right, &none, OC_ANGLE_ERROR_OPK, 2.0));
    TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, 320, 240, &w));
    TEST_ASSERT_EQUAL(OC_OK, oc_homography_jacobian(pair.H, 320, 240, J));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4 * (1 + J[0] * J[0] + J[1] * J[1]), w.cov_px2[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4 * (J[0] * J[2] + J[1] * J[3]), w.cov_px2[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 4 * (1 + J[2] * J[2] + J[3] * J[3]), w.cov_px2[2]);
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_prepare(&pair, 320, 240, &s));
    /* Of the strip too: 4 times the squared gradient of the distance. */
    double gradient2 = 1.0;
    for (int i = 0; i < 2; i++) {
        const double dx = i ? 0 : 1e-3, dy = i ? 1e-3 : 0;
        const double slope = (oc_epipolar_distance_px(pair.F, 320 + dx, 240 + dy, w.x_px, w.y_px) -
                              oc_epipolar_distance_px(pair.F, 320 - dx, 240 - dy, w.x_px, w.y_px)) /
                             2e-3;
        TEST_ASSERT_TRUE(slope * slope > 1e-3);
        gradient2 += slope * slope;
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-5, 4 * gradient2, oc_strip_variance_px2(&s, w.x_px, w.y_px));
}

static void bad_pairs_are_refused_and_write_nothing(void)
{
    oc_pair_t p;
    oc_pair_thesis_t t;
    memset(&p, 0x5A, sizeof p);
    const oc_pair_t untouched = p;
    const double sigmas[4] = {0, -1, 101, (double)NAN};
    for (int i = 0; i < 4; i++) {
        TEST_ASSERT_EQUAL(OC_E_ARG,
                          oc_pair_prepare(&p, &left, &margin, &right, &margin, OC_ANGLE_ERROR_OPK, sigmas[i]));
    }
    const double widths[4] = {-1e-9, (double)NAN, (double)INFINITY, 0.51};
    for (int i = 0; i < 4; i++) {
        oc_margin_t bad = margin;
        bad.v[4] = widths[i];
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_pair_prepare(&p, &left, &bad, &right, &margin, OC_ANGLE_ERROR_OPK, 1));
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_pair_prepare(&p, &left, &margin, &right, &bad, OC_ANGLE_ERROR_OPK, 1));
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_pair_prepare_thesis(&t, &left, &bad, &right, &margin));
    }
    oc_camera_t bad = left;
    bad.pose.R[0] = (double)NAN;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_pair_prepare(&p, &bad, &margin, &right, &margin, OC_ANGLE_ERROR_OPK, 1));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_pair_prepare(&p, &right, &margin, &bad, &margin, OC_ANGLE_ERROR_OPK, 1));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_pair_prepare(&p, &left, &margin, &right, &margin, (oc_angle_error_t)2, 1));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_pair_prepare(&p, &left, &margin, &left, &margin, OC_ANGLE_ERROR_OPK, 1));
    /* 5 mm above the ground, 10 mm of margin. */
    double low[3];
    oc_pose_centre(&left.pose, low);
    low[2] = 0.005;
    bad = left;
    oc_pose_from_centre(left.pose.R, low, &bad.pose);
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_pair_prepare(&p, &bad, &margin, &right, &margin, OC_ANGLE_ERROR_OPK, 1));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_pair_prepare(&p, &right, &margin, &bad, &margin, OC_ANGLE_ERROR_OPK, 1));
    TEST_ASSERT_EQUAL_MEMORY(&untouched, &p, sizeof p);
}

/* ---- covariances against a direct numeric derivative ---- */

/* What the window's covariance must be, one whole transfer per moved camera. */
static void direct_window(double x, double y, double z, double cov[3])
{
    const oc_plane_t level = {{0, 0, 1}, -z};
    double H[9], J[4], none[6] = {0};
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_homography(&left, &right, &level, H, NULL));
    TEST_ASSERT_EQUAL(OC_OK, oc_homography_jacobian(H, x, y, J));
    const double s2 = SIGMA_PX * SIGMA_PX;
    cov[0] = s2 * (1 + J[0] * J[0] + J[1] * J[1]);
    cov[1] = s2 * (J[0] * J[2] + J[1] * J[3]);
    cov[2] = s2 * (1 + J[2] * J[2] + J[3] * J[3]);
    for (int i = 0; i < 12; i++) {
        double at[2][2], error[6] = {0};
        for (int side = 0; side < 2; side++) {
            /* A hundredth of the margin: the derivative itself, not a secant. */
            error[i % 6] = (side ? 0.01 : -0.01) * margin.v[i % 6];
            const oc_camera_t l = with_errors(&left, i < 6 ? error : none);
            const oc_camera_t r = with_errors(&right, i < 6 ? none : error);
            TEST_ASSERT_EQUAL(OC_OK, oc_plane_homography(&l, &r, &level, H, NULL));
            oc_homography_apply(H, x, y, &at[side][0], &at[side][1]);
        }
        const double dx = (at[1][0] - at[0][0]) / 0.02, dy = (at[1][1] - at[0][1]) / 0.02;
        cov[0] += dx * dx / 3;
        cov[1] += dx * dy / 3;
        cov[2] += dy * dy / 3;
    }
}

static void windows_are_the_first_order_covariance_of_the_transfer(void)
{
    for (int s = 0; s < 3; s++) {
        use_scene(&scenes[s]);
        for (int k = 0; k < 6; k++) {
            const double x = 200 + 50 * k, y = 150 + 40 * k, z = k < 3 ? 0.0 : 0.05 * (k - 2);
            double cov[3];
            oc_window_t w;
            direct_window(x, y, z, cov);
            TEST_ASSERT_EQUAL(OC_OK, oc_window_at_height(&pair, x, y, z, &w));
            /* The step of one margin bends the secant by about 1 %. */
            const double tolerance = 0.02 * (cov[0] + cov[2]);
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, oc_test_difference(cov, w.cov_px2, 3));
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, w.cov_px2[0] * w.info[0] + w.cov_px2[1] * w.info[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, w.cov_px2[0] * w.info[1] + w.cov_px2[1] * w.info[2]);
            if (k >= 3) continue;
            oc_window_t ground;
            TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, x, y, &ground));
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, w.x_px, ground.x_px);
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, oc_test_difference(cov, ground.cov_px2, 3));
        }
    }
}

static void strips_have_the_variance_of_the_distance_to_the_line(void)
{
    for (int s = 0; s < 3; s++) {
        use_scene(&scenes[s]);
        const double x = 333, y = 222, none[6] = {0};
        oc_strip_t strip;
        oc_window_t near;
        TEST_ASSERT_EQUAL(OC_OK, oc_strip_prepare(&pair, x, y, &strip));
        TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, x, y, &near));
        for (int k = -1; k <= 1; k++) {
            /* On the line, and 10 px to either side of it. */
            const double qx = near.x_px + 10 * k * strip.line[0], qy = near.y_px + 10 * k * strip.line[1];
            const double d0 = oc_epipolar_distance_px(pair.F, x, y, qx, qy);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, d0, oc_strip_distance_px(&strip, qx, qy));
            double variance = SIGMA_PX * SIGMA_PX, F[9];
            for (int i = 0; i < 14; i++) {
                double at[2], error[6] = {0};
                for (int side = 0; side < 2; side++) {
                    const double step = side ? 0.01 : -0.01;
                    if (i < 12) error[i % 6] = step * margin.v[i % 6];
                    const oc_camera_t l = with_errors(&left, i < 6 ? error : none);
                    const oc_camera_t r = with_errors(&right, i >= 6 && i < 12 ? error : none);
                    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_fundamental(&l, &r, F));
                    at[side] = oc_epipolar_distance_px(F, i == 12 ? x + step : x, i == 13 ? y + step : y, qx, qy);
                }
                const double slope = (at[1] - at[0]) / 0.02;
                variance += i < 12 ? slope * slope / 3 : slope * slope * SIGMA_PX * SIGMA_PX;
            }
            TEST_ASSERT_DOUBLE_WITHIN(0.03 * variance, variance, oc_strip_variance_px2(&strip, qx, qy));
        }
    }
}

static void windows_and_strips_refuse_what_they_do_not_see(void)
{
    oc_window_t w = {42, 0, {0}, {0}};
    oc_strip_t s;
    oc_rect_t rect;
    /* Far above the horizon. */
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_window_ground(&pair, 320, -20000, &w));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_window_at_height(&pair, 320, -20000, 0.1, &w));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_window_at_height(&pair, 320, 240, pair.left_height_m, &w));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_window_at_height(&pair, 320, 240, 2 * pair.left_height_m, &w));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_window_ground(&pair, (double)NAN, 240, &w));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_window_at_height(&pair, 320, 240, (double)NAN, &w));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_strip_prepare(&pair, 320, (double)INFINITY, &s));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_window_ground_thesis(&thesis, (double)NAN, 240, &rect));
    TEST_ASSERT_EQUAL_DOUBLE(42, w.x_px);

    /* Both cameras level: above the horizon the ground is behind both, and w is positive. */
    const oc_camera_t aimed_right = right, aimed_left = left;
    double level[9], at[3];
    oc_thesis_from_pts(0, OC_TEST_RAD(90), 0, level);
    oc_cv_from_thesis(level, level);
    oc_pose_centre(&left.pose, at);
    oc_pose_from_centre(level, at, &left.pose);
    at[0] += 1.0;
    oc_pose_from_centre(level, at, &right.pose);
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare(&pair, &left, &margin, &right, &margin, OC_ANGLE_ERROR_OPK, 1));
    TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, 320, 300, &w));
    w.x_px = 42;
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_window_ground(&pair, 320, 180, &w));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_window_at_height(&pair, 320, 180, 0.1, &w));
    TEST_ASSERT_EQUAL_DOUBLE(42, w.x_px);
    left = aimed_left;
    right = aimed_right;

    /* Ground in front of the left camera but behind the right one. */
    double turned[9], centre[3];
    oc_pose_centre(&right.pose, centre);
    const double about_z[9] = {-1, 0, 0, 0, -1, 0, 0, 0, 1};
    oc_mat3_mul(right.pose.R, about_z, turned);
    oc_pose_from_centre(turned, centre, &right.pose);
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare(&pair, &left, &margin, &right, &margin, OC_ANGLE_ERROR_OPK, 1));
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare_thesis(&thesis, &left, &margin, &right, &margin));
    int n_behind = 0;
    for (int x = 0; x < 640; x += 40) {
        for (int y = 0; y < 480; y += 40) {
            double G[9], p[3] = {0, 0, 0}, x2, y2;
            TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_from_image(&left, G));
            TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_point(G, x, y, &p[0], &p[1]));
            if (oc_camera_project(&right, p, &x2, &y2) > 0.0) continue;
            TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_window_ground(&pair, x, y, &w));
            TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_window_ground_thesis(&thesis, x, y, &rect));
            n_behind++;
        }
    }
    TEST_ASSERT_TRUE(n_behind > 10);
}

static void the_epipole_has_no_strip(void)
{
    double e1[3], e2[3];
    oc_strip_t s;
    oc_epipolar_epipoles(&left, &right, e1, e2);
    const double x = e1[0] / e1[2], y = e1[1] / e1[2];
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_strip_prepare(&pair, x, y, &s));
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_prepare(&pair, x + 1, y, &s));
}

static void the_upright_rectangle_and_the_area_are_those_of_the_ellipse(void)
{
    oc_window_t w;
    double hx, hy, widest_x = 0, widest_y = 0, area = 0;
    TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, 320, 240, &w));
    oc_window_half_sides(&w, &hx, &hy);
    for (int i = 0; i < 3600; i++) {
        const double c = cos(OC_TEST_RAD(0.1 * i)), s = sin(OC_TEST_RAD(0.1 * i));
        const double r2 = OC_WINDOW_MAX_D2 / oc_window_d2(&w, w.x_px + c, w.y_px + s);
        widest_x = fmax(widest_x, sqrt(r2) * c);
        widest_y = fmax(widest_y, sqrt(r2) * s);
        area += r2 * OC_TEST_RAD(0.1) / 2;
        TEST_ASSERT_TRUE(oc_window_contains(&w, w.x_px + 0.999 * sqrt(r2) * c, w.y_px + 0.999 * sqrt(r2) * s));
        TEST_ASSERT_FALSE(oc_window_contains(&w, w.x_px + 1.001 * sqrt(r2) * c, w.y_px + 1.001 * sqrt(r2) * s));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * hx, widest_x, hx);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * hy, widest_y, hy);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * area, area, oc_window_area_px2(&w));
    TEST_ASSERT_FALSE(oc_window_contains(&w, (double)NAN, w.y_px));
}

/* ---- segments ---- */

static void segments_end_at_the_heights_allowed(void)
{
    for (int s = 0; s < 3; s++) {
        use_scene(&scenes[s]);
        const oc_reach_t reach = {0.0, scenes[s].height, 0.01, 100.0};
        double centre[3], ray[3], ends[2][3], x, y;
        oc_segment_t segment;
        TEST_ASSERT_EQUAL(OC_OK, oc_strip_segment(&pair, 310, 250, &reach, &segment));
        oc_pose_centre(&left.pose, centre);
        oc_camera_ray(&left, 310, 250, ray);
        for (int e = 0; e < 2; e++) {
            const double along = ((e ? reach.z_max_m : reach.z_min_m) - centre[2]) / ray[2];
            for (int i = 0; i < 3; i++) ends[e][i] = centre[i] + along * ray[i];
            TEST_ASSERT_TRUE(oc_camera_project(&right, ends[e], &x, &y) > 0.0);
            const double *px = e ? segment.high_px : segment.low_px;
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, x, px[0]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, y, px[1]);
            TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, oc_epipolar_distance_px(pair.F, 310, 250, px[0], px[1]));
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, oc_camera_project(&left, ends[e], &x, &y),
                                      e ? segment.high_depth_m : segment.low_depth_m);
        }
        TEST_ASSERT_TRUE(segment.low_slack_px > 1.0 && segment.high_slack_px > 1.0);
        /* Slack beyond either end, and no more. */
        const double dx = segment.high_px[0] - segment.low_px[0], dy = segment.high_px[1] - segment.low_px[1];
        const double length = hypot(dx, dy);
        for (int e = 0; e < 2; e++) {
            const double slack = e ? segment.high_slack_px : segment.low_slack_px, sign = e ? 1 : -1;
            const double *px = e ? segment.high_px : segment.low_px;
            for (int k = 0; k < 2; k++) {
                const double out = sign * slack * (k ? 1.01 : 0.99) / length;
                TEST_ASSERT_EQUAL(k == 0, oc_segment_contains(&segment, px[0] + out * dx, px[1] + out * dy));
            }
        }
    }
}

static void segments_are_cut_by_depth_and_by_the_right_camera(void)
{
    oc_segment_t cut, whole;
    oc_reach_t reach = {0.0, 0.5, 0.01, 100.0};
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_segment(&pair, 320, 240, &reach, &whole));
    reach.depth_max_m = 0.5 * (whole.low_depth_m + whole.high_depth_m);
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_segment(&pair, 320, 240, &reach, &cut));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, reach.depth_max_m, cut.low_depth_m);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, cut.low_slack_px);
    TEST_ASSERT_EQUAL_DOUBLE(whole.high_px[0], cut.high_px[0]);
    TEST_ASSERT_EQUAL_DOUBLE(whole.high_slack_px, cut.high_slack_px);

    /* The right camera ahead of the left one, both level: near points are behind it. */
    const double c1[3] = {0, 0, 1}, c2[3] = {0, 2, 1};
    double R[9];
    oc_thesis_from_pts(0, OC_TEST_RAD(90), 0, R);
    oc_cv_from_thesis(R, R);
    oc_pose_from_centre(R, c1, &left.pose);
    oc_pose_from_centre(R, c2, &right.pose);
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare(&pair, &left, &margin, &right, &margin, OC_ANGLE_ERROR_OPK, 1));
    const oc_reach_t wide = {0.0, 3.0, 0.1, 50.0};
    const double cx = left.k.cx_px, cy = left.k.cy_px;
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_segment(&pair, cx + 100, cy + 100, &wide, &cut));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.1, cut.high_depth_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, left.k.fy_px / 100, cut.low_depth_m);
    /* Above the horizon the far end is the high one. */
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_segment(&pair, cx + 100, cy - 100, &wide, &cut));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2.1, cut.low_depth_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 2 * left.k.fy_px / 100, cut.high_depth_m);
    TEST_ASSERT_TRUE(cut.high_slack_px > 0.0);
    /* On the horizon only depths limit it. */
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_segment(&pair, cx + 100, cy, &wide, &cut));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 52.1, cut.low_depth_m + cut.high_depth_m);
    /* A ray that meets the ground before it is in front of the right camera. */
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_strip_segment(&pair, cx + 100, cy + 400, &wide, &cut));
}

static void bad_reaches_are_refused(void)
{
    const oc_reach_t good = {0.0, 0.5, 0.01, 100.0};
    oc_reach_t bad[7];
    for (int i = 0; i < 7; i++) bad[i] = good;
    bad[0].z_max_m = 0.0;
    bad[1].depth_min_m = 0.0;
    bad[2].depth_max_m = 0.01;
    bad[3].z_min_m = (double)NAN;
    bad[4].z_max_m = (double)INFINITY;
    bad[5].depth_max_m = (double)INFINITY;
    bad[6].depth_min_m = (double)NAN;
    oc_segment_t segment;
    memset(&segment, 0x5A, sizeof segment);
    const oc_segment_t untouched = segment;
    for (int i = 0; i < 7; i++) TEST_ASSERT_EQUAL(OC_E_ARG, oc_strip_segment(&pair, 320, 240, &bad[i], &segment));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_strip_segment(&pair, (double)NAN, 240, &good, &segment));
    /* Heights that the ray is never at. */
    const oc_reach_t sky = {3.0, 4.0, 0.01, 100.0};
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_strip_segment(&pair, 320, 240, &sky, &segment));
    TEST_ASSERT_EQUAL_MEMORY(&untouched, &segment, sizeof segment);
}

/* ---- the thesis' strip ---- */

/* Eq 5.11-5.16 on the cubes pair. */
static void the_thesis_strip_lies_between_the_extreme_border_crossings(void)
{
    use_scene(&scenes[1]);
    const double x = 300, y = 200, w = 640;
    oc_strip_thesis_t strip;
    double l[3], least[2], most[2];
    TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_line(thesis.F, x, y, l));
    /* m_l = (0, -c/b), m_r = (w, -(c + a w)/b) are l' x (1,0,0) and l' x (1,0,-w). */
    const double border_left[3] = {1, 0, 0}, border_right[3] = {1, 0, -w};
    double m_l[3], m_r[3];
    oc_vec3_cross(l, border_left, m_l);
    oc_vec3_cross(l, border_right, m_r);
    least[0] = most[0] = -l[2] / l[1];
    least[1] = most[1] = -(l[2] + l[0] * w) / l[1];
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, least[0], m_l[1] / m_l[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, w, m_r[0] / m_r[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, least[1], m_r[1] / m_r[2]);
    for (int i = 0; i < 24; i++) {
        TEST_ASSERT_EQUAL(OC_OK, oc_epipolar_line(thesis.F_moved[i], x, y, l));
        const double a = -l[2] / l[1], b = -(l[2] + l[0] * w) / l[1];
        least[0] = fmin(least[0], a);
        most[0] = fmax(most[0], a);
        least[1] = fmin(least[1], b);
        most[1] = fmax(most[1], b);
    }
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_prepare_thesis(&thesis, x, y, w, &strip));
    const double at[5] = {0, 160, 320, 480, 640};
    for (int i = 0; i < 5; i++) {
        const double top = least[0] + (least[1] - least[0]) * at[i] / w;
        const double bottom = most[0] + (most[1] - most[0]) * at[i] / w;
        TEST_ASSERT_TRUE(bottom - top > 20.0);
        TEST_ASSERT_TRUE(oc_strip_contains_thesis(&strip, at[i], top + 1e-6));
        TEST_ASSERT_TRUE(oc_strip_contains_thesis(&strip, at[i], bottom - 1e-6));
        TEST_ASSERT_FALSE(oc_strip_contains_thesis(&strip, at[i], top - 1e-6));
        TEST_ASSERT_FALSE(oc_strip_contains_thesis(&strip, at[i], bottom + 1e-6));
    }
}

/* Eq 5.13 divides by the line's b; the covariance strip does not care. */
static void a_vertical_epipolar_line_breaks_the_thesis_strip_only(void)
{
    const double c1[3] = {0, 0, 1}, c2[3] = {0, 0, 1.5};
    double R[9];
    oc_thesis_from_pts(0, OC_TEST_RAD(90), 0, R);
    oc_cv_from_thesis(R, R);
    oc_pose_from_centre(R, c1, &left.pose);
    oc_pose_from_centre(R, c2, &right.pose);
    oc_strip_thesis_t t;
    oc_strip_t s;
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare(&pair, &left, &margin, &right, &margin, OC_ANGLE_ERROR_OPK, 1));
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare_thesis(&thesis, &left, &margin, &right, &margin));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_strip_prepare_thesis(&thesis, 300, 300, 640, &t));
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_prepare(&pair, 300, 300, &s));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0, fabs(s.line[0]));
    TEST_ASSERT_TRUE(oc_strip_contains(&s, 303, 100));
    TEST_ASSERT_FALSE(oc_strip_contains(&s, 400, 100));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_strip_prepare_thesis(&thesis, 300, 300, 0, &t));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_prepared_pair_has_the_matrices_of_its_cameras);
    RUN_TEST(margins_that_are_zero_leave_only_pixel_noise);
    RUN_TEST(bad_pairs_are_refused_and_write_nothing);
    RUN_TEST(windows_are_the_first_order_covariance_of_the_transfer);
    RUN_TEST(strips_have_the_variance_of_the_distance_to_the_line);
    RUN_TEST(windows_and_strips_refuse_what_they_do_not_see);
    RUN_TEST(the_epipole_has_no_strip);
    RUN_TEST(the_upright_rectangle_and_the_area_are_those_of_the_ellipse);
    RUN_TEST(segments_end_at_the_heights_allowed);
    RUN_TEST(segments_are_cut_by_depth_and_by_the_right_camera);
    RUN_TEST(bad_reaches_are_refused);
    RUN_TEST(the_thesis_strip_lies_between_the_extreme_border_crossings);
    RUN_TEST(a_vertical_epipolar_line_breaks_the_thesis_strip_only);
    return UNITY_END();
}
