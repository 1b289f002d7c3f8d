/* SPDX-License-Identifier: BSD-3-Clause
 * The map's similarity, angles along a path, and swing removal.
 */
#include "unity.h"

#include <string.h>

#include "core/homography.h"
#include "core/similarity.h"
#include "thesis_tables.h"

static oc_similarity_t map;

void setUp(void)
{
    TEST_ASSERT_EQUAL(OC_OK, oc_similarity_from_points(120, 340, 220, 245, 0.150, &map));
}

void tearDown(void) {}

/* ---- Eq 7.1-7.7 ---- */

static void the_similarity_sends_both_clicked_points_where_they_were_clicked(void)
{
    double S[9];
    oc_similarity_matrix(&map, S);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, hypot(100, -95) / 0.150, map.scale_px_per_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, atan2(-95, 100), map.theta_rad);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 120, S[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 340, S[5]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 220, S[0] * 0.150 + S[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 245, S[3] * 0.150 + S[5]);
    const double bottom[3] = {0, 0, 1};
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(bottom, S + 6, 3);
}

static void applying_and_inverting_are_each_other_s_inverse_and_scale_heights(void)
{
    oc_test_random_t r = oc_test_random_from(77);
    double S[9];
    oc_similarity_matrix(&map, S);
    for (int draw = 0; draw < 100; draw++) {
        double p[3], q[3];
        for (int i = 0; i < 3; i++) p[i] = oc_test_uniform(&r, -3, 3);
        oc_similarity_apply(&map, p, q);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, S[0] * p[0] + S[1] * p[1] + S[2], q[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, S[3] * p[0] + S[4] * p[1] + S[5], q[1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, map.scale_px_per_m * p[2], q[2]);
        oc_similarity_invert(&map, q, q);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, oc_test_difference(p, q, 3), oc_test_draw(&r, draw));
    }
}

static void clicks_that_define_no_similarity_are_refused(void)
{
    oc_similarity_t out = {42, 0, {0, 0}};
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_similarity_from_points(5, 6, 5, 6, 1, &out));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_similarity_from_points(5, 6, 7, 6, 0, &out));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_similarity_from_points(5, 6, 7, 6, (double)NAN, &out));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_similarity_from_points(5, (double)NAN, 7, 6, 1, &out));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_similarity_from_points(5, 6, (double)INFINITY, 6, 1, &out));
    TEST_ASSERT_EQUAL_DOUBLE(42, out.scale_px_per_m);
}

/* ---- Eq 7.15 ---- */

static void a_camera_in_map_units_sees_the_same_pixels(void)
{
    oc_test_random_t r = oc_test_random_from(715);
    for (int row = 0; row < 8; row++) {
        const oc_camera_t c = oc_test_camera(&table_7_1, row);
        oc_camera_t in_map;
        oc_similarity_camera(&map, &c, &in_map);
        double R[9], pan, tilt, swing, pan2, tilt2, swing2;
        oc_cv_from_thesis(c.pose.R, R);
        oc_pts_from_thesis(R, &pan, &tilt, &swing);
        oc_cv_from_thesis(in_map.pose.R, R);
        oc_pts_from_thesis(R, &pan2, &tilt2, &swing2);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, tilt, tilt2);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, swing, swing2);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, oc_angle_distance(oc_pan_in_map(pan, map.theta_rad), pan2));
        for (int draw = 0; draw < 20; draw++) {
            double p[3], q[3], x, y, x2, y2;
            for (int i = 0; i < 3; i++) p[i] = oc_test_uniform(&r, -0.05, 0.1);
            oc_similarity_apply(&map, p, q);
            const double depth = oc_camera_project(&c, p, &x, &y);
            const double depth2 = oc_camera_project(&in_map, q, &x2, &y2);
            TEST_ASSERT_DOUBLE_WITHIN(1e-9 * depth2, map.scale_px_per_m * depth, depth2);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, x, x2, oc_test_draw(&r, draw));
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, y, y2, oc_test_draw(&r, draw));
        }
    }
}

/* ---- Table 7.2 ---- */

static void pans_in_the_map_are_those_of_table_7_2(void)
{
    for (int i = 0; i < 8; i++) {
        const double pan = OC_TEST_RAD(table_7_1.row[i][4]);
        const double in_map = oc_pan_in_map(pan, OC_TEST_RAD(OC_TEST_THETA_7_2_DEG));
        TEST_ASSERT_DOUBLE_WITHIN(1.5e-4, table_7_2_pan_deg[i], OC_TEST_DEG(in_map));
    }
}

static void nearest_views_are_those_the_thesis_chose(void)
{
    double pans[8];
    for (int i = 0; i < 8; i++) pans[i] = OC_TEST_RAD(table_7_2_pan_deg[i]);
    for (int f = 0; f < 12; f++) {
        const uint32_t chosen = oc_pan_nearest(OC_TEST_RAD(table_7_2_frame_deg[f]), pans, 8);
        TEST_ASSERT_EQUAL_INT(table_7_2_chosen[f], 'a' + (int)chosen);
    }
    /* Round the circle: 359 is nearer to 1 than 10 is. */
    const double two[2] = {OC_TEST_RAD(10), OC_TEST_RAD(359)};
    TEST_ASSERT_EQUAL_UINT32(1, oc_pan_nearest(OC_TEST_RAD(1), two, 2));
    const double same[3] = {1, 1, 1};
    TEST_ASSERT_EQUAL_UINT32(0, oc_pan_nearest(1, same, 3));
}

/* ---- angles ---- */

static void angles_wrap_into_one_turn(void)
{
    const double turn = 2 * OC_TEST_PI;
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, oc_angle_wrap(1.0 + 3 * turn));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, turn - 1.0, oc_angle_wrap(-1.0 - 3 * turn));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, oc_angle_wrap(-1e-20));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, oc_angle_wrap(0.0));
    TEST_ASSERT_TRUE(isnan(oc_angle_wrap((double)NAN)));
}

static void distances_go_the_short_way_round(void)
{
    oc_test_random_t r = oc_test_random_from(714);
    for (int draw = 0; draw < 500; draw++) {
        const double a = oc_test_uniform(&r, -10, 10), b = oc_test_uniform(&r, -10, 10);
        const double expected = acos(fmax(-1.0, fmin(1.0, cos(a - b))));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-7, expected, oc_angle_distance(a, b), oc_test_draw(&r, draw));
    }
}

static void interpolation_takes_the_shorter_arc(void)
{
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, OC_TEST_RAD(5), oc_angle_interpolate(OC_TEST_RAD(350), OC_TEST_RAD(20), 0.5));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, OC_TEST_RAD(5), oc_angle_interpolate(OC_TEST_RAD(20), OC_TEST_RAD(-10), 0.5));
    oc_test_random_t r = oc_test_random_from(712);
    for (int draw = 0; draw < 200; draw++) {
        const double a = oc_test_uniform(&r, -10, 10), b = oc_test_uniform(&r, -10, 10);
        const double t = oc_test_uniform(&r, 0, 1), arc = oc_angle_distance(a, b);
        const double at = oc_angle_interpolate(a, b, t);
        TEST_ASSERT_TRUE(at >= 0.0 && at < 2 * OC_TEST_PI);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, t * arc, oc_angle_distance(a, at), oc_test_draw(&r, draw));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, (1 - t) * arc, oc_angle_distance(at, b), oc_test_draw(&r, draw));
    }
}

/* Eq 7.10 is the mathematical angle; H_p needs the azimuth, 90 degrees less it. */
static void the_pan_of_a_motion_looks_along_it(void)
{
    oc_test_random_t r = oc_test_random_from(710);
    for (int draw = 0; draw < 100; draw++) {
        const double dx = oc_test_uniform(&r, -1, 1), dy = oc_test_uniform(&r, -1, 1);
        const double pan = oc_pan_from_motion(dx, dy);
        double R[9];
        oc_thesis_from_pts(pan, OC_TEST_RAD(60), 0, R);
        /* Optical axis -r3. */
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, -R[6] * dy + R[7] * dx, oc_test_draw(&r, draw));
        TEST_ASSERT_TRUE(-R[6] * dx - R[7] * dy > 0.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, oc_angle_distance(pan, OC_TEST_PI / 2 - atan2(dy, dx)));
    }
}

/* ---- swing removal ---- */

/* Section 7.5 on camera (f): exact, where the pixel rotation of Eq 7.16 is some 3 px off. */
static void swing_removal_is_exact_where_equation_7_16_is_not(void)
{
    const oc_camera_t c = oc_test_camera(&table_7_1, 5);
    double R[9], pan, tilt, swing, centre[3], H[9], worst = 0.0;
    oc_cv_from_thesis(c.pose.R, R);
    oc_pts_from_thesis(R, &pan, &tilt, &swing);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 26.7937, OC_TEST_DEG(swing));
    oc_camera_t level = c;
    oc_thesis_from_pts(pan, tilt, 0, R);
    oc_cv_from_thesis(R, R);
    oc_pose_centre(&c.pose, centre);
    oc_pose_from_centre(R, centre, &level.pose);
    oc_swing_removal(&c.k, swing, H);
    oc_test_random_t r = oc_test_random_from(716);
    for (int draw = 0; draw < 30; draw++) {
        double p[3], x, y, x0, y0, hx, hy;
        for (int i = 0; i < 3; i++) p[i] = oc_test_uniform(&r, i < 2 ? -0.06 : 0.0, i < 2 ? 0.06 : 0.08);
        oc_camera_project(&c, p, &x, &y);
        oc_camera_project(&level, p, &x0, &y0);
        TEST_ASSERT_TRUE(oc_homography_apply(H, x, y, &hx, &hy) > 0.0);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, x0, hx, oc_test_draw(&r, draw));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, y0, hy, oc_test_draw(&r, draw));
        const double dx = x - c.k.cx_px, dy = y - c.k.cy_px;
        const double rx = c.k.cx_px + cos(swing) * dx + sin(swing) * dy;
        const double ry = c.k.cy_px - sin(swing) * dx + cos(swing) * dy;
        worst = fmax(worst, hypot(rx - x0, ry - y0));
    }
    TEST_ASSERT_TRUE(worst > 1.0 && worst < 10.0);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_similarity_sends_both_clicked_points_where_they_were_clicked);
    RUN_TEST(applying_and_inverting_are_each_other_s_inverse_and_scale_heights);
    RUN_TEST(clicks_that_define_no_similarity_are_refused);
    RUN_TEST(a_camera_in_map_units_sees_the_same_pixels);
    RUN_TEST(pans_in_the_map_are_those_of_table_7_2);
    RUN_TEST(nearest_views_are_those_the_thesis_chose);
    RUN_TEST(angles_wrap_into_one_turn);
    RUN_TEST(distances_go_the_short_way_round);
    RUN_TEST(interpolation_takes_the_shorter_arc);
    RUN_TEST(the_pan_of_a_motion_looks_along_it);
    RUN_TEST(swing_removal_is_exact_where_equation_7_16_is_not);
    return UNITY_END();
}
