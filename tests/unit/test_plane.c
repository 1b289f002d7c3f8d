/* SPDX-License-Identifier: BSD-3-Clause
 * The planar perspective matrix, the horizon, plane homographies and junction planes.
 */
#include "unity.h"

#include <stdbool.h>
#include <string.h>

#include "core/epipolar.h"
#include "core/plane.h"
#include "thesis_tables.h"

void setUp(void) {}

void tearDown(void) {}

/* ---- appendix B ---- */

/* Appendix B.2, omega form, A with x-focal fx and y-focal fy of either sign;
 * h33 with the sign of its middle term corrected. */
static void appendix_b_omega(const double a[4], const double t[3], const double angle[3], double H[9], double third[3])
{
    const double fx = a[0], fy = a[1], u = a[2], v = a[3], tx = t[0], ty = t[1], tz = t[2];
    const double cw = cos(angle[0]), sw = sin(angle[0]), cp = cos(angle[1]), sp = sin(angle[1]);
    const double ck = cos(angle[2]), sk = sin(angle[2]);
    H[0] = fx * ck * cp + u * sp;
    H[1] = fx * sk * cw + fx * ck * sp * sw - u * cp * sw;
    H[2] = -fx * cp * ck * tx - fx * sw * sp * ck * ty - fx * cw * sk * ty + fx * cw * sp * ck * tz -
           fx * sw * sk * tz - u * sp * tx + u * sw * cp * ty - u * cw * cp * tz;
    H[3] = -fy * sk * cp + v * sp;
    H[4] = fy * ck * cw - fy * sk * sp * sw - v * cp * sw;
    H[5] = fy * cp * sk * tx + fy * sw * sp * sk * ty - fy * cw * ck * ty - fy * cw * sp * sk * tz - fy * sw * ck * tz -
           v * sp * tx + v * sw * cp * ty - v * cw * cp * tz;
    H[6] = sp;
    H[7] = -cp * sw;
    H[8] = -sp * tx + sw * cp * ty - cw * cp * tz;
    third[0] = fx * sk * sw - fx * ck * sp * cw + u * cp * cw;
    third[1] = fy * ck * sw + fy * sk * sp * cw + v * cp * cw;
    third[2] = cp * cw;
}

/* Appendix B.3, pan, tilt, swing. */
static void appendix_b_pan(const double a[4], const double t[3], const double angle[3], double H[9], double third[3])
{
    const double fx = a[0], fy = a[1], u = a[2], v = a[3], tx = t[0], ty = t[1], tz = t[2];
    const double cp = cos(angle[0]), sp = sin(angle[0]), ct = cos(angle[1]), st = sin(angle[1]);
    const double cy = cos(angle[2]), sy = sin(angle[2]);
    H[0] = fx * cy * cp + fx * sy * ct * sp - u * st * sp;
    H[1] = -fx * cy * sp + fx * sy * ct * cp - u * st * cp;
    H[2] = -fx * cy * cp * tx - fx * sy * ct * sp * tx + fx * cy * sp * ty - fx * sy * ct * cp * ty -
           fx * sy * st * tz + u * st * sp * tx + u * st * cp * ty - u * ct * tz;
    H[3] = -fy * sy * cp + fy * cy * ct * sp - v * st * sp;
    H[4] = fy * sy * sp + fy * cy * ct * cp - v * st * cp;
    H[5] = fy * sy * cp * tx - fy * cy * ct * sp * tx - fy * sy * sp * ty - fy * cy * ct * cp * ty - fy * cy * st * tz +
           v * st * sp * tx + v * st * cp * ty - v * ct * tz;
    H[6] = -st * sp;
    H[7] = -st * cp;
    H[8] = st * sp * tx + st * cp * ty - ct * tz;
    third[0] = fx * sy * st + u * ct;
    third[1] = fy * cy * st + v * ct;
    third[2] = ct;
}

static void planar_perspective_matrix_is_the_corrected_expansion_of_appendix_b(void)
{
    oc_test_random_t r = oc_test_random_from(2);
    for (int draw = 0; draw < 500; draw++) {
        const char *where = oc_test_draw(&r, draw);
        oc_camera_t c = oc_test_camera(&table_7_1, 0);
        double opk[3], pts[3], t[3], R[9], expected[9], third[3], H[9], P[12];
        for (int i = 0; i < 3; i++) opk[i] = oc_test_uniform(&r, OC_TEST_RAD(-80), OC_TEST_RAD(80));
        for (int i = 0; i < 3; i++) t[i] = oc_test_uniform(&r, -5, 5);
        c.k.fx_px = oc_test_uniform(&r, 100, 900);
        c.k.fy_px = oc_test_uniform(&r, 100, 900);
        c.k.cx_px = oc_test_uniform(&r, -900, 900);
        c.k.cy_px = oc_test_uniform(&r, -900, 900);
        oc_thesis_from_opk(opk[0], opk[1], opk[2], R);
        oc_pts_from_thesis(R, &pts[0], &pts[1], &pts[2]);
        oc_cv_from_thesis(R, R);
        oc_pose_from_centre(R, t, &c.pose);
        oc_plane_image_from_ground(&c, H);
        oc_camera_matrix(&c, P);

        /* The thesis' A = [-fx 0 u; 0 fy v; 0 0 1] gives -H_p and -P. */
        const double a[4] = {-c.k.fx_px, c.k.fy_px, c.k.cx_px, c.k.cy_px};
        const double minus_column[3] = {-P[2], -P[6], -P[10]};
        for (int form = 0; form < 2; form++) {
            if (form == 0)
                appendix_b_omega(a, t, opk, expected, third);
            else
                appendix_b_pan(a, t, pts, expected, third);
            for (int i = 0; i < 9; i++) expected[i] = -expected[i];
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, 0.0, oc_test_difference(expected, H, 9), where);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0.0, oc_test_difference(third, minus_column, 3), where);
        }
    }
}

/* h33 as printed has - sin omega cos phi ty. */
static void printed_h33_of_appendix_b_is_wrong(void)
{
    const oc_camera_t c = oc_test_camera(&table_5_1, 0);
    double H[9], centre[3], w, p, k, R[9];
    oc_plane_image_from_ground(&c, H);
    oc_pose_centre(&c.pose, centre);
    oc_cv_from_thesis(c.pose.R, R);
    oc_opk_from_thesis(R, &w, &p, &k);
    const double ends = -sin(p) * centre[0] - cos(w) * cos(p) * centre[2];
    const double middle = sin(w) * cos(p) * centre[1];
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, -(ends + middle), H[8]);
    TEST_ASSERT_TRUE(fabs(-(ends - middle) - H[8]) > 0.1);
}

/* ---- Eq 4.6, 4.26 ---- */

static void a_camera_looking_straight_down_gives_equation_4_6(void)
{
    oc_camera_t c = {{1, 1, 0, 0, 640, 480}, {{0}, {0}}};
    const double centre[3] = {0, 0, 7};
    double R[9], H[9];
    /* R_th = I; A = I in thesis axes is the y-up image, so K's y turns. */
    oc_thesis_from_opk(0, 0, 0, R);
    oc_cv_from_thesis(R, R);
    oc_pose_from_centre(R, centre, &c.pose);
    oc_plane_image_from_ground(&c, H);
    const double expected[9] = {1, 0, 0, 0, 1, 0, 0, 0, -7}, flip[3] = {1, -1, -1};
    for (int i = 0; i < 9; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-15, expected[i], flip[i / 3] * H[i]);
}

/* Section 4.6: C = (250, 250, 100), tilt 70, pan 90, swing 0, f = 200, frame 200x200. */
static oc_camera_t camera_of_section_4_6(void)
{
    oc_camera_t c = {{200, 200, 100, 100, 200, 200}, {{0}, {0}}};
    const double centre[3] = {250, 250, 100};
    double R[9];
    oc_thesis_from_pts(OC_TEST_RAD(90), OC_TEST_RAD(70), 0, R);
    oc_cv_from_thesis(R, R);
    oc_pose_from_centre(R, centre, &c.pose);
    return c;
}

static void equation_4_26_prints_the_inverse_within_two_per_cent(void)
{
    const double printed[9] = {0, -212.83, -16837, 106.42, -249.02, -3839.5, 0, -1, 27.67};
    const double recomputed[9] = {0, -213.603, -16838.2, 106.418, -250, -3840.29, 0, -1, 27.206};
    const oc_camera_t c = camera_of_section_4_6();
    double G[9];
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_from_image(&c, G));
    const double scale = -1.0 / G[7];
    for (int i = 0; i < 9; i++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 + 1e-5 * fabs(recomputed[i]), recomputed[i], scale * G[i]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9 + 0.017 * fabs(printed[i]), printed[i], scale * G[i]);
    }
}

static void horizon_is_the_third_row_of_the_inverse_and_not_of_the_matrix(void)
{
    const oc_camera_t c = camera_of_section_4_6();
    double G[9], H[9], line[3];
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_from_image(&c, G));
    oc_plane_horizon(G, line);
    const double expected = 100 - 200 / tan(OC_TEST_RAD(70));
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.0, line[0] / line[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, expected, -line[2] / line[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 27.206, -line[2] / line[1]);
    oc_plane_image_from_ground(&c, H);
    /* Row 3 of H_p is the line under the camera on the ground: x = 250 - 100 tan... */
    TEST_ASSERT_TRUE(fabs(H[6]) > 1e3 * fabs(H[7]));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 213.603, -H[8] / H[6]);
}

static void pixels_above_the_horizon_are_not_ground(void)
{
    const oc_camera_t c = camera_of_section_4_6();
    double G[9], line[3], x = -1, y = -1;
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_from_image(&c, G));
    oc_plane_horizon(G, line);
    double negative[9];
    for (int i = 0; i < 9; i++) negative[i] = -3.0 * G[i];
    const double *scaled[2] = {G, negative};
    for (int s = 0; s < 2; s++) {
        TEST_ASSERT_TRUE(oc_plane_is_ground(scaled[s], 10, 28, 100, 199));
        TEST_ASSERT_FALSE(oc_plane_is_ground(scaled[s], 10, 27, 100, 199));
        TEST_ASSERT_FALSE(oc_plane_is_ground(scaled[s], (double)NAN, 100, 100, 199));
    }
    TEST_ASSERT_TRUE(line[0] * 10 + line[1] * 28 + line[2] > 0.0);
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_ground_point(G, 10, 27, &x, &y));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_ground_point(G, (double)NAN, 100, &x, &y));
    TEST_ASSERT_EQUAL_DOUBLE(-1, x);
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_point(G, 10, 28, &x, &y));
    /* It looks along +X. */
    TEST_ASSERT_TRUE(x > 250);
}

static void ground_from_image_undoes_image_from_ground_with_depth_as_scale(void)
{
    oc_test_random_t r = oc_test_random_from(422);
    for (int row = 0; row < 8; row++) {
        const oc_camera_t c = oc_test_camera(&table_7_3, row);
        double H[9], G[9], eye[9], product[9];
        oc_plane_image_from_ground(&c, H);
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_from_image(&c, G));
        oc_mat3_mul(H, G, product);
        oc_mat3_identity(eye);
        TEST_ASSERT_DOUBLE_WITHIN(1e-11, 0.0, oc_test_difference(product, eye, 9));
        for (int draw = 0; draw < 50; draw++) {
            const double p[3] = {oc_test_uniform(&r, -2, 2), oc_test_uniform(&r, -2, 2), 0};
            double x, y, gx, gy;
            const double depth = oc_camera_project(&c, p, &x, &y);
            if (!(depth > 0.0)) continue;
            TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_point(G, x, y, &gx, &gy));
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, p[0], gx, oc_test_draw(&r, draw));
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, p[1], gy, oc_test_draw(&r, draw));
            TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0 / depth, G[6] * x + G[7] * y + G[8]);
        }
    }
}

static void a_camera_in_the_ground_has_no_ground_homography(void)
{
    oc_camera_t c = oc_test_camera(&table_7_1, 0);
    const oc_camera_t good = c;
    double H[9] = {42}, R[9];
    const double centre[3] = {1, 1, 0};
    memcpy(R, c.pose.R, sizeof R);
    oc_pose_from_centre(R, centre, &c.pose);
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_ground_from_image(&c, H));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_ground_homography(&c, &good, H));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_ground_homography(&good, &c, H));
    TEST_ASSERT_EQUAL_DOUBLE(42, H[0]);
}

/* ---- homographies of planes ---- */

/* Eq 2.68 in the first camera's frame: K'(R_rel - t n_c^T / d_c) K^-1. */
static void camera_frame_homography(const oc_camera_t *left, const oc_camera_t *right, const oc_plane_t *plane,
                                    double H[9])
{
    oc_pose_t left_inverse, relative;
    double n[3], centre[3], tn[9], K[9], K_inv[9] = {0};
    oc_pose_invert(&left->pose, &left_inverse);
    oc_pose_compose(&right->pose, &left_inverse, &relative);
    oc_mat3_mul_vec(left->pose.R, plane->n, n);
    oc_pose_centre(&left->pose, centre);
    const double d = plane->d_m + oc_vec3_dot(plane->n, centre);
    oc_mat3_outer(relative.t, n, tn);
    for (int i = 0; i < 9; i++) tn[i] = relative.R[i] - tn[i] / d;
    const double k1[9] = {left->k.fx_px, 0, left->k.cx_px, 0, left->k.fy_px, left->k.cy_px, 0, 0, 1};
    const double k2[9] = {right->k.fx_px, 0, right->k.cx_px, 0, right->k.fy_px, right->k.cy_px, 0, 0, 1};
    memcpy(K, k2, sizeof K);
    TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(k1, K_inv));
    oc_mat3_mul(K, tn, H);
    oc_mat3_mul(H, K_inv, H);
}

/* Eq 4.36-4.38: A'^-1 P' T^-1 with the transform made of a camera's R, T; as
 * the 3x4 matrix [m | v]. */
static void moved_matrix(const oc_camera_t *right, const oc_camera_t *transform, double m[9], double v[3])
{
    double back[9], centre[3];
    oc_mat3_transpose(transform->pose.R, back);
    oc_pose_centre(&transform->pose, centre);
    oc_mat3_mul(right->pose.R, back, m);
    oc_mat3_mul_vec(right->pose.R, centre, v);
    for (int i = 0; i < 3; i++) v[i] += right->pose.t[i];
}

static void ground_homography_forms_agree_on_every_pair(void)
{
    const oc_plane_t ground = {{0, 0, 1}, 0};
    for (int i = 0; i < 5; i++) {
        const char *name = thesis_pairs[i].name;
        const oc_camera_t left = oc_test_camera(thesis_pairs[i].table, thesis_pairs[i].left);
        const oc_camera_t right = oc_test_camera(thesis_pairs[i].table, thesis_pairs[i].right);
        double H[9], world[9], frame[9], H2[9], H1[9], product[9] = {0};
        bool same_side = false;
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&left, &right, H));
        /* Eq 4.32 by a general inverse. */
        oc_plane_image_from_ground(&left, H1);
        oc_plane_image_from_ground(&right, H2);
        TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(H1, product));
        oc_mat3_mul(H2, product, product);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0.0, oc_test_scaled_difference(product, H), name);
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_homography(&left, &right, &ground, world, &same_side));
        TEST_ASSERT_TRUE(same_side);
        /* Not only up to scale: both have depth'/depth as their scale. */
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, 0.0, oc_test_difference(world, H, 9), name);
        camera_frame_homography(&left, &right, &ground, frame);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0.0, oc_test_scaled_difference(frame, H), name);
    }
}

/* Eq 4.36, 4.37, 5.31 and 5.32 as printed take R', T' of the second camera. */
static void the_printed_transform_with_the_second_camera_is_the_identity(void)
{
    double eye[9];
    oc_mat3_identity(eye);
    for (int i = 0; i < 5; i++) {
        const oc_camera_t left = oc_test_camera(thesis_pairs[i].table, thesis_pairs[i].left);
        const oc_camera_t right = oc_test_camera(thesis_pairs[i].table, thesis_pairs[i].right);
        double m[9], v[3];
        moved_matrix(&right, &right, m, v);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, oc_test_difference(m, eye, 9), thesis_pairs[i].name);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, oc_vec3_norm(v), thesis_pairs[i].name);
        moved_matrix(&right, &left, m, v);
        TEST_ASSERT_TRUE_MESSAGE(oc_test_difference(m, eye, 9) > 0.01, thesis_pairs[i].name);
    }
}

static void a_plane_homography_moves_the_plane_s_points_and_reports_the_side(void)
{
    oc_test_random_t r = oc_test_random_from(268);
    const oc_camera_t left = oc_test_camera(&table_5_1, 0), right = oc_test_camera(&table_5_1, 1);
    int n_same = 0, n_opposite = 0;
    for (int draw = 0; draw < 300; draw++) {
        const char *where = oc_test_draw(&r, draw);
        oc_plane_t plane;
        double on_plane[3], H[9], frame[9];
        for (int i = 0; i < 3; i++) plane.n[i] = oc_test_normal(&r);
        for (int i = 0; i < 3; i++) on_plane[i] = oc_test_uniform(&r, -0.2, 0.2);
        oc_vec3_normalise(plane.n);
        plane.d_m = -oc_vec3_dot(plane.n, on_plane);
        bool same_side;
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_homography(&left, &right, &plane, H, &same_side));
        double c1[3], c2[3];
        oc_pose_centre(&left.pose, c1);
        oc_pose_centre(&right.pose, c2);
        const double s1 = oc_vec3_dot(plane.n, c1) + plane.d_m, s2 = oc_vec3_dot(plane.n, c2) + plane.d_m;
        TEST_ASSERT_EQUAL_MESSAGE(s1 * s2 > 0.0, same_side, where);
        *(same_side ? &n_same : &n_opposite) += 1;

        camera_frame_homography(&left, &right, &plane, frame);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-8, 0.0, oc_test_scaled_difference(frame, H), where);
        double x, y, x2, y2, hx, hy;
        const double depth = oc_camera_project(&left, on_plane, &x, &y);
        const double depth2 = oc_camera_project(&right, on_plane, &x2, &y2);
        const double w = oc_homography_apply(H, x, y, &hx, &hy);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5, x2, hx, where);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5, y2, hy, where);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-7, depth2 / depth, w, where);
    }
    TEST_ASSERT_TRUE(n_same > 50 && n_opposite > 10);
}

static void planes_through_a_camera_or_not_finite_are_refused(void)
{
    const oc_camera_t left = oc_test_camera(&table_5_1, 0), right = oc_test_camera(&table_5_1, 1);
    const oc_camera_t *cameras[2] = {&left, &right};
    double H[9] = {42};
    for (int i = 0; i < 2; i++) {
        double centre[3];
        oc_pose_centre(&cameras[i]->pose, centre);
        const oc_plane_t through = {{0, 0.6, 0.8}, -(0.6 * centre[1] + 0.8 * centre[2])};
        TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_homography(&left, &right, &through, H, NULL));
    }
    const oc_plane_t bad[4] = {{{0, 0, 2}, 0}, {{0, 0, 0}, 1}, {{(double)NAN, 0, 1}, 0}, {{0, 0, 1}, (double)INFINITY}};
    for (int i = 0; i < 4; i++) TEST_ASSERT_EQUAL(OC_E_ARG, oc_plane_homography(&left, &right, &bad[i], H, NULL));
    TEST_ASSERT_EQUAL_DOUBLE(42, H[0]);
}

/* ---- the junction plane ---- */

static void a_branch_s_line_passes_its_apex_at_every_angle(void)
{
    for (int degrees = 0; degrees < 360; degrees += 15) {
        const oc_edge2_t edge = {123.5, 77.25, OC_TEST_RAD(degrees)};
        double l[3];
        oc_edge_line(&edge, l);
        TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, hypot(l[0], l[1]));
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, l[0] * edge.x_px + l[1] * edge.y_px + l[2]);
        const double x = edge.x_px + 9 * cos(edge.angle_rad), y = edge.y_px + 9 * sin(edge.angle_rad);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, l[0] * x + l[1] * y + l[2]);
        if (degrees % 180 == 90) continue;
        /* Eq 5.19, which a vertical branch breaks, is the same line. */
        const double m = tan(edge.angle_rad), printed[3] = {m, -1, edge.y_px - m * edge.x_px};
        for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-9, printed[i] * -l[1], l[i]);
    }
}

/* Branch from the image of p towards the image of p + dir. */
static oc_edge2_t branch_of(const oc_camera_t *c, const double p[3], const double dir[3])
{
    double q[3], x0, y0, x1, y1;
    for (int i = 0; i < 3; i++) q[i] = p[i] + 1e-6 * dir[i];
    TEST_ASSERT_TRUE(oc_camera_project(c, p, &x0, &y0) > 0.0);
    TEST_ASSERT_TRUE(oc_camera_project(c, q, &x1, &y1) > 0.0);
    const oc_edge2_t edge = {x0, y0, atan2(y1 - y0, x1 - x0)};
    return edge;
}

static void junction_planes_of_the_thesis_pairs(int index)
{
    const char *name = thesis_pairs[index].name;
    const oc_camera_t left = oc_test_camera(thesis_pairs[index].table, thesis_pairs[index].left);
    const oc_camera_t right = oc_test_camera(thesis_pairs[index].table, thesis_pairs[index].right);
    oc_test_random_t r = oc_test_random_from(517 + (uint64_t)index);
    for (int draw = 0; draw < 20; draw++) {
        double p[3], d[2][3], truth[3], found[3], H[9];
        for (int i = 0; i < 3; i++) p[i] = oc_test_uniform(&r, i < 2 ? -0.04 : 0.005, i < 2 ? 0.04 : 0.08);
        oc_edge2_t in_left[2], in_right[2];
        for (int k = 0; k < 2; k++) {
            for (int i = 0; i < 3; i++) d[k][i] = oc_test_normal(&r);
            oc_vec3_normalise(d[k]);
            in_left[k] = branch_of(&left, p, d[k]);
            in_right[k] = branch_of(&right, p, d[k]);
            oc_edge3_t a, b;
            oc_edge_direction_t direction;
            oc_edge_prepare(&left, &in_left[k], &a);
            oc_edge_prepare(&right, &in_right[k], &b);
            TEST_ASSERT_EQUAL(OC_OK, oc_edge_direction(&a, &b, &direction));
            /* 1e-6 m of branch in double pixels: directions to about 1e-5 over the sine. */
            if (direction.sine < 0.02) continue;
            TEST_ASSERT_TRUE_MESSAGE(direction.agrees, name);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5, 1.0, oc_vec3_dot(direction.d, d[k]), name);
            /* The same branch pointing back does not agree. */
            oc_edge2_t back = in_right[k];
            back.angle_rad += OC_TEST_PI;
            oc_edge_prepare(&right, &back, &b);
            TEST_ASSERT_EQUAL(OC_OK, oc_edge_direction(&a, &b, &direction));
            TEST_ASSERT_FALSE_MESSAGE(direction.agrees, name);
        }
        oc_plane_t plane;
        oc_vec3_cross(d[0], d[1], truth);
        if (oc_vec3_normalise(truth) < 0.1) continue;
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_from_junction(&left, in_left, &right, in_right, &plane, found));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-9, 0.0, oc_test_difference(p, found, 3), name);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-4, 1.0, fabs(oc_vec3_dot(plane.n, truth)), name);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-12, 0.0, oc_vec3_dot(plane.n, found) + plane.d_m, name);

        if (oc_plane_homography(&left, &right, &plane, H, NULL) != OC_OK) continue;
        for (int i = 0; i < 5; i++) {
            const double s = oc_test_uniform(&r, -0.01, 0.01), t = oc_test_uniform(&r, -0.01, 0.01);
            double q[3], x, y, x2, y2, hx, hy;
            for (int k = 0; k < 3; k++) q[k] = p[k] + s * d[0][k] + t * d[1][k];
            oc_camera_project(&left, q, &x, &y);
            oc_camera_project(&right, q, &x2, &y2);
            oc_homography_apply(H, x, y, &hx, &hy);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.2, 0.0, hypot(hx - x2, hy - y2), name);
        }
    }
}

static void two_branches_seen_twice_give_their_plane_on_every_pair(void)
{
    for (int i = 0; i < 5; i++) junction_planes_of_the_thesis_pairs(i);
}

static void branches_without_a_plane_are_refused(void)
{
    const oc_camera_t left = oc_test_camera(&table_7_3, 5), right = oc_test_camera(&table_7_3, 6);
    const double p[3] = {0.1, 0.1, 0.05}, d[3] = {0.3, -0.5, 0.2};
    double left_centre[3], base[3], e1[3], e2[3];
    oc_plane_t plane = {{42, 0, 0}, 0};
    /* The same branch twice. */
    const oc_edge2_t l = branch_of(&left, p, d), r = branch_of(&right, p, d);
    const oc_edge2_t both_left[2] = {l, l}, both_right[2] = {r, r};
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_from_junction(&left, both_left, &right, both_right, &plane, NULL));
    /* A branch along the epipolar line. */
    oc_epipolar_epipoles(&left, &right, e1, e2);
    const oc_edge2_t to_epipole_left = {l.x_px, l.y_px, atan2(e1[1] / e1[2] - l.y_px, e1[0] / e1[2] - l.x_px)};
    const oc_edge2_t to_epipole_right = {r.x_px, r.y_px, atan2(e2[1] / e2[2] - r.y_px, e2[0] / e2[2] - r.x_px)};
    oc_edge3_t a, b;
    oc_edge_direction_t direction = {{42, 0, 0}, 0, false};
    oc_edge_prepare(&left, &to_epipole_left, &a);
    oc_edge_prepare(&right, &to_epipole_right, &b);
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_edge_direction(&a, &b, &direction));
    TEST_ASSERT_EQUAL_DOUBLE(42, direction.d[0]);
    /* Both views the same. */
    const oc_edge2_t two[2] = {l, {l.x_px, l.y_px, l.angle_rad + 1}};
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_from_junction(&left, two, &left, two, &plane, NULL));
    oc_pose_centre(&left.pose, left_centre);
    oc_vec3_sub(left_centre, p, base);
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_plane_from_directions(base, base, p, &plane));
    TEST_ASSERT_EQUAL_DOUBLE(42, plane.n[0]);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(planar_perspective_matrix_is_the_corrected_expansion_of_appendix_b);
    RUN_TEST(printed_h33_of_appendix_b_is_wrong);
    RUN_TEST(a_camera_looking_straight_down_gives_equation_4_6);
    RUN_TEST(equation_4_26_prints_the_inverse_within_two_per_cent);
    RUN_TEST(horizon_is_the_third_row_of_the_inverse_and_not_of_the_matrix);
    RUN_TEST(pixels_above_the_horizon_are_not_ground);
    RUN_TEST(ground_from_image_undoes_image_from_ground_with_depth_as_scale);
    RUN_TEST(a_camera_in_the_ground_has_no_ground_homography);
    RUN_TEST(ground_homography_forms_agree_on_every_pair);
    RUN_TEST(the_printed_transform_with_the_second_camera_is_the_identity);
    RUN_TEST(a_plane_homography_moves_the_plane_s_points_and_reports_the_side);
    RUN_TEST(planes_through_a_camera_or_not_finite_are_refused);
    RUN_TEST(a_branch_s_line_passes_its_apex_at_every_angle);
    RUN_TEST(two_branches_seen_twice_give_their_plane_on_every_pair);
    RUN_TEST(branches_without_a_plane_are_refused);
    return UNITY_END();
}
