/* SPDX-License-Identifier: BSD-3-Clause
 * Applying, differentiating, anchoring and chaining homographies.
 */
#include "unity.h"

#include "core/homography.h"
#include "core/plane.h"
#include "thesis_tables.h"

void setUp(void) {}

void tearDown(void) {}

static void the_jacobian_is_the_numeric_derivative(void)
{
    const oc_camera_t left = oc_test_camera(&table_7_3, 5), right = oc_test_camera(&table_7_3, 6);
    double H[9], J[4];
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&left, &right, H));
    for (int x = 0; x < 640; x += 100) {
        for (int y = 0; y < 480; y += 100) {
            TEST_ASSERT_EQUAL(OC_OK, oc_homography_jacobian(H, x, y, J));
            for (int c = 0; c < 2; c++) {
                const double hx = c == 0 ? 1e-3 : 0, hy = c == 0 ? 0 : 1e-3;
                double xp, yp, xm, ym;
                TEST_ASSERT_TRUE(oc_homography_apply(H, x + hx, y + hy, &xp, &yp) > 0.0);
                TEST_ASSERT_TRUE(oc_homography_apply(H, x - hx, y - hy, &xm, &ym) > 0.0);
                TEST_ASSERT_DOUBLE_WITHIN(1e-7, (xp - xm) / 2e-3, J[c]);
                TEST_ASSERT_DOUBLE_WITHIN(1e-7, (yp - ym) / 2e-3, J[2 + c]);
            }
        }
    }
}

static void directions_transfer_as_the_points_along_them_do(void)
{
    oc_test_random_t r = oc_test_random_from(31);
    const oc_camera_t left = oc_test_camera(&table_5_1, 0), right = oc_test_camera(&table_5_1, 1);
    double H[9];
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&left, &right, H));
    for (int draw = 0; draw < 500; draw++) {
        const double x = oc_test_uniform(&r, 0, 640), y = oc_test_uniform(&r, 100, 480);
        const double a = oc_test_uniform(&r, -7, 7);
        double a2 = -1, x0, y0, x1, y1;
        TEST_ASSERT_EQUAL(OC_OK, oc_homography_angle(H, x, y, a, &a2));
        oc_homography_apply(H, x, y, &x0, &y0);
        oc_homography_apply(H, x + 1e-4 * cos(a), y + 1e-4 * sin(a), &x1, &y1);
        TEST_ASSERT_TRUE(a2 >= 0.0 && a2 < 2.0 * OC_TEST_PI);
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-5, 0.0, remainder(a2 - atan2(y1 - y0, x1 - x0), 2 * OC_TEST_PI),
                                          oc_test_draw(&r, draw));
    }
}

static void points_and_directions_without_image_are_refused(void)
{
    const double at_infinity[9] = {1, 0, 0, 0, 1, 0, 1, 0, -5}, flat[9] = {1, 0, 0, 0, 0, 0, 0, 0, 1};
    double x = 7, y = 7, J[4] = {7}, a = 7, H[9] = {7};
    TEST_ASSERT_TRUE(oc_homography_apply(at_infinity, 5, 3, &x, &y) == 0.0);
    TEST_ASSERT_TRUE(oc_homography_apply(at_infinity, (double)NAN, 3, &x, &y) == 0.0);
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_homography_jacobian(at_infinity, 5, 3, J));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_homography_angle(at_infinity, 5, 3, 0, &a));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_homography_angle(flat, 5, 3, OC_TEST_PI / 2, &a));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_homography_anchor(at_infinity, 5, 3, 1, 1, H));
    TEST_ASSERT_EQUAL(OC_E_DEGENERATE, oc_homography_anchor(flat, 5, 3, (double)NAN, 1, H));
    TEST_ASSERT_EQUAL_DOUBLE(7, x);
    TEST_ASSERT_EQUAL_DOUBLE(7, J[0]);
    TEST_ASSERT_EQUAL_DOUBLE(7, a);
    TEST_ASSERT_EQUAL_DOUBLE(7, H[0]);
}

/* H' = T(m' - H m) H: exact at the apex, a plain shift everywhere else. */
static void an_anchored_homography_hits_the_match_and_shifts_the_rest_alike(void)
{
    const oc_camera_t left = oc_test_camera(&table_5_1, 0), right = oc_test_camera(&table_5_1, 1);
    double H[9], A[9], x0, y0, x1, y1, ax, ay;
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&left, &right, H));
    oc_homography_apply(H, 300, 250, &x0, &y0);
    TEST_ASSERT_EQUAL(OC_OK, oc_homography_anchor(H, 300, 250, x0 + 8.5, y0 - 3.25, A));
    const double w = oc_homography_apply(A, 300, 250, &ax, &ay);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, x0 + 8.5, ax);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, y0 - 3.25, ay);
    TEST_ASSERT_TRUE(w > 0.0);
    oc_homography_apply(H, 310, 262, &x1, &y1);
    oc_homography_apply(A, 310, 262, &ax, &ay);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, x1 + 8.5, ax);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, y1 - 3.25, ay);
    TEST_ASSERT_EQUAL(OC_OK, oc_homography_anchor(H, 300, 250, x0 + 8.5, y0 - 3.25, H));
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(A, H, 9);
}

/* Eq 6.7: as printed, the product of H_{h+1} H_h, it repeats factors. */
static void a_chain_of_homographies_is_their_product_from_the_right(void)
{
    double steps[7][9], H[9], expected[9], printed[9], pair[9], eye[9];
    double direct[9];
    for (int i = 0; i < 7; i++) {
        const oc_camera_t a = oc_test_camera(&table_7_1, i), b = oc_test_camera(&table_7_1, i + 1);
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&a, &b, steps[i]));
    }
    oc_homography_chain((const double(*)[9])steps, 4, H);
    oc_mat3_mul(steps[1], steps[0], expected);
    oc_mat3_mul(steps[2], expected, expected);
    oc_mat3_mul(steps[3], expected, expected);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, oc_test_scaled_difference(expected, H));
    /* The chain of ground homographies is the ground homography of its ends. */
    const oc_camera_t first = oc_test_camera(&table_7_1, 0), last = oc_test_camera(&table_7_1, 7);
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&first, &last, direct));
    oc_homography_chain((const double(*)[9])steps, 7, H);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 0.0, oc_test_scaled_difference(direct, H));

    oc_mat3_identity(printed);
    for (int h = 0; h < 3; h++) {
        oc_mat3_mul(steps[h + 1], steps[h], pair);
        oc_mat3_mul(pair, printed, printed);
    }
    TEST_ASSERT_TRUE(oc_test_scaled_difference(expected, printed) > 1e-3);
    oc_homography_chain(NULL, 0, H);
    oc_mat3_identity(eye);
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(eye, H, 9);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_jacobian_is_the_numeric_derivative);
    RUN_TEST(directions_transfer_as_the_points_along_them_do);
    RUN_TEST(points_and_directions_without_image_are_refused);
    RUN_TEST(an_anchored_homography_hits_the_match_and_shifts_the_rest_alike);
    RUN_TEST(a_chain_of_homographies_is_their_product_from_the_right);
    return UNITY_END();
}
