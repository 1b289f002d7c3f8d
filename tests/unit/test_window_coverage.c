/* SPDX-License-Identifier: BSD-3-Clause
 * How many true matches windows and strips hold when errors fill the margins.
 */
#include "unity.h"

#include <stdbool.h>

#include "core/plane.h"
#include "core/window.h"
#include "window_scenes.h"

void setUp(void)
{
    use_scene(&scenes[0]);
}

void tearDown(void) {}

static bool in_image(double x, double y)
{
    return x >= 0 && x < 640 && y >= 0 && y < 480;
}

typedef struct coverage {
    int n_ground, window, window_thesis;
    int n_points, strip, strip_thesis, segment;
    double area_px2, area_thesis_px2, width_px; /* sums */
} coverage_t;

static void count_ground(const oc_camera_t *l, const oc_camera_t *r, double p[3], oc_test_random_t *rnd, coverage_t *c)
{
    double x, y, x2, y2;
    p[2] = 0.0;
    if (!(oc_camera_project(l, p, &x, &y) > 0.0 && oc_camera_project(r, p, &x2, &y2) > 0.0)) return;
    if (!in_image(x, y) || !in_image(x2, y2)) return;
    oc_window_t w;
    oc_rect_t rect;
    x += SIGMA_PX * oc_test_normal(rnd);
    y += SIGMA_PX * oc_test_normal(rnd);
    x2 += SIGMA_PX * oc_test_normal(rnd);
    y2 += SIGMA_PX * oc_test_normal(rnd);
    TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, x, y, &w));
    TEST_ASSERT_EQUAL(OC_OK, oc_window_ground_thesis(&thesis, x, y, &rect));
    c->n_ground++;
    c->window += oc_window_contains(&w, x2, y2);
    c->area_px2 += oc_window_area_px2(&w);
    c->area_thesis_px2 += (rect.x_max_px - rect.x_min_px) * (rect.y_max_px - rect.y_min_px);
    c->window_thesis += x2 >= rect.x_min_px && x2 <= rect.x_max_px && y2 >= rect.y_min_px && y2 <= rect.y_max_px;
}

static void count_point(const oc_camera_t *l, const oc_camera_t *r, const double p[3], const oc_reach_t *reach,
                        oc_test_random_t *rnd, coverage_t *c)
{
    double x, y, x2, y2;
    if (!(oc_camera_project(l, p, &x, &y) > 0.0 && oc_camera_project(r, p, &x2, &y2) > 0.0)) return;
    if (!in_image(x, y) || !in_image(x2, y2)) return;
    oc_strip_t s;
    oc_strip_thesis_t t;
    oc_segment_t segment;
    x += SIGMA_PX * oc_test_normal(rnd);
    y += SIGMA_PX * oc_test_normal(rnd);
    x2 += SIGMA_PX * oc_test_normal(rnd);
    y2 += SIGMA_PX * oc_test_normal(rnd);
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_prepare(&pair, x, y, &s));
    TEST_ASSERT_EQUAL(OC_OK, oc_strip_segment(&pair, x, y, reach, &segment));
    c->n_points++;
    c->strip += oc_strip_contains(&s, x2, y2);
    c->width_px += 2 * OC_STRIP_MAX_SIGMA * sqrt(oc_strip_variance_px2(&s, x2, y2));
    c->segment += oc_segment_contains(&segment, x2, y2);
    if (oc_strip_prepare_thesis(&thesis, x, y, 640, &t) != OC_OK) return;
    c->strip_thesis += oc_strip_contains_thesis(&t, x2, y2);
}

/* Uniform errors on all twelve parameters of the true cameras. */
static coverage_t measure(const scene_t *scene, int n, oc_test_random_t *r)
{
    coverage_t c = {0};
    const oc_reach_t reach = {0.0, scene->height, 0.01, 100.0};
    use_scene(scene);
    while (c.n_ground < n) {
        double error[2][6], p[3];
        for (int i = 0; i < 12; i++) {
            error[i / 6][i % 6] = oc_test_uniform(r, -margin.v[i % 6], margin.v[i % 6]);
        }
        const oc_camera_t true_left = with_errors(&left, error[0]), true_right = with_errors(&right, error[1]);
        p[0] = scene->centre_x + oc_test_uniform(r, -scene->half, scene->half);
        p[1] = scene->centre_y + oc_test_uniform(r, -scene->half, scene->half);
        count_ground(&true_left, &true_right, p, r, &c);
        p[2] = oc_test_uniform(r, 0.0, scene->height);
        count_point(&true_left, &true_right, p, &reach, r, &c);
    }
    return c;
}

static void covariance_windows_and_strips_cover_99_per_cent_where_the_thesis_covers_half(void)
{
    /* What the thesis' window and strip cover, per cent. */
    const double window_thesis[3] = {53.5, 23.5, 49.5}, strip_thesis[3] = {73.4, 86.5, 70.3};
    for (int i = 0; i < 3; i++) {
        oc_test_random_t r = oc_test_random_from(1900 + (uint64_t)i);
        const coverage_t c = measure(&scenes[i], 20000, &r);
        char text[200];
        const double n = c.n_ground / 100.0, m = c.n_points / 100.0;
        snprintf(text, sizeof text,
                 "%s: window %.1f %% (thesis %.1f), strip %.1f %% (thesis %.1f), segment %.1f %%; seed %d",
                 thesis_pairs[scenes[i].pair].name, c.window / n, c.window_thesis / n, c.strip / m, c.strip_thesis / m,
                 c.segment / m, 1900 + i);
        TEST_MESSAGE(text);
        /* The price: mean area and width, printed so that docs/equations.md can be checked. */
        char price[120];
        snprintf(price, sizeof price, "ellipse %.0f px2, thesis' rectangle %.0f px2, strip %.0f px wide",
                 c.area_px2 / c.n_ground, c.area_thesis_px2 / c.n_ground, c.width_px / c.n_points);
        TEST_MESSAGE(price);
        TEST_ASSERT_TRUE_MESSAGE(c.area_px2 < 20 * c.area_thesis_px2, price);
        TEST_ASSERT_TRUE_MESSAGE(c.width_px / c.n_points < 120, price);
        TEST_ASSERT_TRUE_MESSAGE(c.window / n >= 98.5, text);
        TEST_ASSERT_TRUE_MESSAGE(c.strip / m >= 98.5, text);
        TEST_ASSERT_TRUE_MESSAGE(c.segment / m >= 98.5, text);
        /* They depend a little on where in the scene the points are. */
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(6.0, window_thesis[i], c.window_thesis / n, text);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(6.0, strip_thesis[i], c.strip_thesis / m, text);
    }
}

/* A roll about the right camera's own axis does not move its principal point. */
static void local_angles_turn_about_the_camera_s_own_axes(void)
{
    const oc_margin_t none = {{0}}, roll = {{0, 0, 0, 0, 0, 0.02}};
    double G[9], ground[3] = {0, 0, 0}, x, y;
    oc_window_t w[2];
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_from_image(&right, G));
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_point(G, right.k.cx_px, right.k.cy_px, &ground[0], &ground[1]));
    TEST_ASSERT_TRUE(oc_camera_project(&left, ground, &x, &y) > 0.0);
    for (int i = 0; i < 2; i++) {
        const oc_margin_t *m = i ? &roll : &none;
        TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare(&pair, &left, &none, &right, m, OC_ANGLE_ERROR_LOCAL, 1));
        TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, x, y, &w[i]));
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, oc_test_difference(w[0].cov_px2, w[1].cov_px2, 3));
    TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, x + 100, y, &w[1]));
    TEST_ASSERT_TRUE(w[1].cov_px2[0] + w[1].cov_px2[2] > w[0].cov_px2[0] + w[0].cov_px2[2] + 0.1);
}

/* A level camera looking along +X (phi = -90): omega and kappa both roll it and
 * neither turns it to the side. */
static void local_angle_errors_are_covered_in_every_attitude(void)
{
    const double c1[3] = {0, 0, 0.5}, c2[3] = {0.2, -0.6, 0.5};
    double R[9];
    left = right = oc_test_camera(&table_7_3, 0);
    oc_thesis_from_pts(OC_TEST_RAD(90), OC_TEST_RAD(89.9), 0, R);
    oc_cv_from_thesis(R, R);
    oc_pose_from_centre(R, c1, &left.pose);
    oc_pose_from_centre(R, c2, &right.pose);
    for (int i = 0; i < 6; i++) margin.v[i] = i < 3 ? 0 : OC_TEST_RAD(1);
    int inside[2] = {0, 0}, n = 0;
    oc_test_random_t r = oc_test_random_from(90);
    oc_window_t w[2];
    for (int mode = 0; mode < 2; mode++) {
        const oc_angle_error_t angles = mode ? OC_ANGLE_ERROR_LOCAL : OC_ANGLE_ERROR_OPK;
        TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare(&pair, &left, &margin, &right, &margin, angles, SIGMA_PX));
        TEST_ASSERT_EQUAL(OC_OK, oc_window_ground(&pair, 320, 300, &w[mode]));
    }
    for (int draw = 0; draw < 2000; draw++) {
        oc_camera_t moved[2] = {left, right};
        for (int k = 0; k < 2; k++) {
            double small[9], centre[3], angle[3];
            for (int i = 0; i < 3; i++) angle[i] = oc_test_uniform(&r, -OC_TEST_RAD(1), OC_TEST_RAD(1));
            oc_thesis_from_opk(angle[0], angle[1], angle[2], small);
            oc_pose_centre(&moved[k].pose, centre);
            oc_mat3_mul(small, moved[k].pose.R, R);
            oc_pose_from_centre(R, centre, &moved[k].pose);
        }
        double H[9], x2, y2;
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&moved[0], &moved[1], H));
        if (!(oc_homography_apply(H, 320, 300, &x2, &y2) > 0.0)) continue;
        n++;
        for (int mode = 0; mode < 2; mode++) inside[mode] += oc_window_contains(&w[mode], x2, y2);
    }
    char text[80];
    snprintf(text, sizeof text, "OPK %d, local %d of %d", inside[0], inside[1], n);
    TEST_MESSAGE(text);
    TEST_ASSERT_TRUE(n > 1900);
    TEST_ASSERT_TRUE(inside[1] >= 0.985 * n);
    TEST_ASSERT_TRUE(inside[0] < 0.90 * n);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(covariance_windows_and_strips_cover_99_per_cent_where_the_thesis_covers_half);
    RUN_TEST(local_angles_turn_about_the_camera_s_own_axes);
    RUN_TEST(local_angle_errors_are_covered_in_every_attitude);
    return UNITY_END();
}
