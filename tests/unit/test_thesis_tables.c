/* SPDX-License-Identifier: BSD-3-Clause
 * The thesis' tables: its cameras aim where they should, its votes, its voxel
 * counts, and the arithmetic of its percentages.
 */
#include "unity.h"

#include <stdbool.h>
#include <string.h>

#include "core/grid.h"
#include "core/silhouette.h"
#include "thesis_tables.h"

void setUp(void) {}

void tearDown(void) {}

static const oc_test_table_t *const tables[4] = {&table_5_1, &table_5_2, &table_7_1, &table_7_3};

/* ---- cameras ---- */

static void every_camera_is_a_valid_pose_that_looks_down_at_the_ground(void)
{
    int n = 0;
    for (int t = 0; t < 4; t++) {
        for (int row = 0; row < tables[t]->n; row++, n++) {
            const oc_camera_t c = oc_test_camera(tables[t], row);
            TEST_ASSERT_TRUE(oc_pose_is_valid(&c.pose));
            TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1.0, oc_mat3_det(c.pose.R));
            double centre[3];
            oc_pose_centre(&c.pose, centre);
            for (int i = 0; i < 3; i++) TEST_ASSERT_DOUBLE_WITHIN(1e-12, tables[t]->row[row][i] / 1000, centre[i]);
            /* The optical axis is the thesis' -z; its +z points to the sky. */
            TEST_ASSERT_TRUE(c.pose.R[8] < 0.0);
        }
    }
    TEST_ASSERT_EQUAL_INT(20, n);
}

static void tables_5_2_and_7_1_have_the_same_two_cameras(void)
{
    for (int i = 0; i < 2; i++) {
        double a[9], b[9], relative[9];
        oc_test_thesis_rotation(&table_5_2, i, a);
        oc_test_thesis_rotation(&table_7_1, 4 + i, b);
        oc_mat3_transpose(b, b);
        oc_mat3_mul(a, b, relative);
        /* The sine of the turn, from the skew part: acos is blind at such angles. */
        const double s[3] = {relative[7] - relative[5], relative[2] - relative[6], relative[3] - relative[1]};
        TEST_ASSERT_TRUE(OC_TEST_DEG(asin(oc_vec3_norm(s) / 2)) < 2e-4);
        TEST_ASSERT_EQUAL_DOUBLE_ARRAY(table_7_1.row[4 + i], table_5_2.row[i], 3);
        double pan, tilt, swing;
        oc_pts_from_thesis(a, &pan, &tilt, &swing);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, table_7_1.row[4 + i][3], OC_TEST_DEG(tilt));
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, table_7_1.row[4 + i][4], OC_TEST_DEG(pan));
        TEST_ASSERT_DOUBLE_WITHIN(1e-4, table_7_1.row[4 + i][5], OC_TEST_DEG(swing));
    }
}

static bool is_seen(const oc_camera_t *c, const double p_mm[3])
{
    double p[3], x, y;
    for (int i = 0; i < 3; i++) p[i] = p_mm[i] / 1000;
    return oc_camera_project(c, p, &x, &y) > 0.0 && x >= -0.5 && x < 639.5 && y >= -0.5 && y < 479.5;
}

static void centres_of_the_boxes_of_table_7_4_are_seen_by_the_cameras_used(void)
{
    for (int b = 0; b < 2; b++) {
        double centre[3], x, y;
        for (int i = 0; i < 3; i++) centre[i] = (table_7_4_min_mm[b][i] + table_7_4_max_mm[b][i]) / 2;
        for (int row = 0; row < 8; row++) {
            const oc_camera_t c = oc_test_camera(&table_7_3, row);
            const double p[3] = {centre[0] / 1000, centre[1] / 1000, centre[2] / 1000};
            TEST_ASSERT_TRUE(oc_camera_project(&c, p, &x, &y) > 0.0);
            /* Pairs f-g and h-a. */
            if (strchr("fgha", 'a' + row) != NULL) TEST_ASSERT_TRUE(is_seen(&c, centre));
        }
    }
}

/* With the optical axis at +z no corner would be seen at all. */
static void corners_of_the_boxes_are_seen_with_the_axis_at_minus_z_only(void)
{
    int n_seen = 0, n_other = 0;
    for (int row = 0; row < 8; row++) {
        const oc_camera_t c = oc_test_camera(&table_7_3, row);
        oc_camera_t other = c;
        double centre[3], R[9];
        oc_pose_centre(&c.pose, centre);
        oc_test_thesis_rotation(&table_7_3, row, R);
        oc_pose_from_centre(R, centre, &other.pose);
        for (int corner = 0; corner < 16; corner++) {
            double p[3];
            for (int i = 0; i < 3; i++) {
                p[i] = (corner >> i & 1) ? table_7_4_max_mm[corner / 8][i] : table_7_4_min_mm[corner / 8][i];
            }
            n_seen += is_seen(&c, p);
            n_other += is_seen(&other, p);
        }
    }
    TEST_ASSERT_EQUAL_INT(116, n_seen);
    TEST_ASSERT_EQUAL_INT(0, n_other);
}

/* ---- Table 6.1 ---- */

/* The six cases in the thesis' own words, 1 and 4 given to the ground. */
static oc_label_t table_6_1(const oc_votes_t *v)
{
    const uint32_t all = v->n_out + v->n_obstacle + v->n_ground;
    if (v->n_out == all) return OC_LABEL_GROUND;
    if (v->n_obstacle == all) return OC_LABEL_OBSTACLE;
    if (v->n_obstacle > v->n_ground) return OC_LABEL_OBSTACLE;
    if (v->n_obstacle == v->n_ground) return OC_LABEL_GROUND;
    return OC_LABEL_GROUND;
}

static void table_6_1_is_obstacle_exactly_when_more_views_say_so(void)
{
    int n_unknown = 0;
    for (uint32_t i = 1; i < 512; i++) {
        const oc_votes_t v = {i & 7, (i >> 3) & 7, (i >> 6) & 7};
        TEST_ASSERT_EQUAL(table_6_1(&v), oc_silhouette_vote_thesis(&v));
        const oc_label_t label = oc_silhouette_vote(&v);
        if (label == OC_LABEL_UNKNOWN) {
            /* Cases 1 and 4. */
            TEST_ASSERT_EQUAL_UINT32(v.n_obstacle, v.n_ground);
            n_unknown++;
        } else {
            TEST_ASSERT_EQUAL(table_6_1(&v), label);
        }
    }
    TEST_ASSERT_EQUAL_INT(63, n_unknown);
}

/* ---- voxels ---- */

static void voxel_counts_of_table_7_4_are_the_printed_ones(void)
{
    const uint32_t sides[2][3] = {{102, 71, 95}, {82, 67, 54}};
    const uint64_t printed[2] = {687990, 296676};
    for (int b = 0; b < 2; b++) {
        uint32_t n[3];
        uint64_t total;
        TEST_ASSERT_EQUAL(OC_OK, oc_grid_count(table_7_4_min_mm[b], table_7_4_max_mm[b], 2.0, n, &total));
        TEST_ASSERT_EQUAL_UINT32_ARRAY(sides[b], n, 3);
        TEST_ASSERT_EQUAL_UINT64(printed[b], total);
    }
    /* The digit that is illegible in box 2 (366.2b) does not matter. */
    const double low[2] = {364.56, 366.559};
    for (int i = 0; i < 2; i++) {
        const double min[3] = {206.97, low[i], 6.52};
        uint64_t total;
        uint32_t n[3];
        TEST_ASSERT_EQUAL(OC_OK, oc_grid_count(min, table_7_4_max_mm[1], 2.0, n, &total));
        TEST_ASSERT_EQUAL_UINT64(printed[1], total);
    }
}

static void bad_grids_are_refused_and_write_nothing(void)
{
    const double min[3] = {0, 0, 0}, max[3] = {1, 1, 1}, flat[3] = {1, 0, 1};
    const double infinite[3] = {1, (double)INFINITY, 1}, nan[3] = {(double)NAN, 1, 1};
    uint32_t n[3] = {42, 42, 42};
    uint64_t total = 42;
    const double bad_sides[4] = {0, -1, (double)NAN, (double)INFINITY};
    for (int i = 0; i < 4; i++) TEST_ASSERT_EQUAL(OC_E_ARG, oc_grid_count(min, max, bad_sides[i], n, &total));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_grid_count(min, flat, 0.1, n, &total));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_grid_count(min, infinite, 0.1, n, &total));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_grid_count(nan, max, 0.1, n, &total));
    TEST_ASSERT_EQUAL(OC_E_LIMIT, oc_grid_count(min, max, 1.0 / 4096.5, n, &total));
    TEST_ASSERT_EQUAL_UINT32(42, n[0]);
    TEST_ASSERT_EQUAL_UINT64(42, total);
    TEST_ASSERT_EQUAL(OC_OK, oc_grid_count(min, max, 1.0 / 4096, n, NULL));
    TEST_ASSERT_EQUAL_UINT32(4096, n[2]);
}

static void voxel_percentages_follow_from_the_counts(void)
{
    const double counts[6][3] = {{375479, 687990, 54.6}, {7291, 296676, 2.5},    {220656, 687990, 32.1},
                                 {260484, 296676, 87.8}, {484788, 947376, 51.2}, {295250, 947376, 31.2}};
    for (int i = 0; i < 6; i++) TEST_ASSERT_DOUBLE_WITHIN(0.05, counts[i][2], 100 * counts[i][0] / counts[i][1]);
}

/* ---- Tables 4.1 and 5.3 ---- */

static bool is_consistent(const oc_test_share_t *share)
{
    return fabs(100.0 * share->correct / share->n - share->printed_percent) <= 0.06;
}

/* Four rows of Table 4.1 and one of Table 5.3 print a percentage that is not
 * their own correct / all. */
static void only_the_known_rows_of_tables_4_1_and_5_3_disagree_with_their_counts(void)
{
    const bool known_4_1[8][5] = {[1] = {[2] = true}, [3] = {[1] = true}, [7] = {[0] = true, [1] = true}};
    const bool known_5_3[4][6] = {[1] = {[4] = true}};
    for (int w = 0; w < 8; w++) {
        for (int t = 0; t < 5; t++) TEST_ASSERT_EQUAL(!known_4_1[w][t], is_consistent(&table_4_1[w][t]));
    }
    for (int w = 0; w < 4; w++) {
        for (int t = 0; t < 6; t++) TEST_ASSERT_EQUAL(!known_5_3[w][t], is_consistent(&table_5_3[w][t]));
    }
    /* 25x25 at 0.55: 47 of 53 would be the printed 88.7. */
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 88.7, 100.0 * 47 / 53);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(every_camera_is_a_valid_pose_that_looks_down_at_the_ground);
    RUN_TEST(tables_5_2_and_7_1_have_the_same_two_cameras);
    RUN_TEST(centres_of_the_boxes_of_table_7_4_are_seen_by_the_cameras_used);
    RUN_TEST(corners_of_the_boxes_are_seen_with_the_axis_at_minus_z_only);
    RUN_TEST(table_6_1_is_obstacle_exactly_when_more_views_say_so);
    RUN_TEST(voxel_counts_of_table_7_4_are_the_printed_ones);
    RUN_TEST(bad_grids_are_refused_and_write_nothing);
    RUN_TEST(voxel_percentages_follow_from_the_counts);
    RUN_TEST(only_the_known_rows_of_tables_4_1_and_5_3_disagree_with_their_counts);
    return UNITY_END();
}
