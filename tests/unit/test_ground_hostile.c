/* SPDX-License-Identifier: BSD-3-Clause
 * The ground filter on rendered scenes of the thesis' own geometry: what it
 * must refuse, survive, or not believe. */
#include "ground_rig.h"

/* ---- what must not pass ---- */

/* A table top: textured like a floor, but higher than the margins can explain. */
static void raised_plane_is_not_called_ground(void)
{
    static uint8_t px[2][WIDTH * HEIGHT];
    static oc_junction_t found[2][OC_MAX_JUNCTIONS];
    const oc_scene_t table = {.ground_z_m = 0.1, .cell_m = 0.04};
    oc_ground_view_t views[2];
    for (int i = 0; i < 2; i++) {
        views[i] = view_of(1 + i, 0.005, OC_TEST_RAD(0.3));
        views[i].grey = oc_scene_render(&table, &cameras[1 + i], px[i]);
        detect(px[i], found[i], &views[i].n_junctions);
        views[i].junctions = found[i];
    }
    oc_ground_result_t result;
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &views[1], &views[0], votes[1], votes[0], &result));
    int n_ground = 0;
    for (uint32_t i = 0; i < views[1].n_junctions; i++) {
        uint8_t label, confidence;
        oc_ground_decide(&params, &votes[1][i], &label, &confidence);
        n_ground += label == OC_LABEL_GROUND;
    }
    TEST_ASSERT_EQUAL(0, n_ground);
    TEST_ASSERT_FALSE(result.is_refined);
}

static void views_that_share_nothing_are_left_alone(void)
{
    const oc_ground_view_t left = view_of(0, 0.01, OC_TEST_RAD(1.0));
    oc_ground_view_t right = view_of(1, 0.01, OC_TEST_RAD(1.0));
    double centre[3];
    oc_pose_centre(&right.camera.pose, centre);
    centre[0] += 50.0;
    oc_pose_from_centre(right.camera.pose.R, centre, &right.camera.pose);
    oc_ground_result_t result;
    static const oc_ground_votes_t none[OC_MAX_JUNCTIONS];
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[0], votes[1], &result));
    TEST_ASSERT_FALSE(result.is_refined);
    TEST_ASSERT_EQUAL(0, ws.n_matches);
    TEST_ASSERT_EQUAL_MEMORY(none, votes[0], sizeof none);
    TEST_ASSERT_TRUE(oc_ground_overlap(&left.camera, &right.camera, worth) == 0.0);
}

/* Without parallax nothing can be told from the ground. */
static void view_from_nearly_the_same_place_does_not_judge(void)
{
    const oc_ground_view_t left = view_of(0, 0.01, OC_TEST_RAD(1.0));
    oc_ground_view_t right = left;
    double centre[3];
    oc_pose_centre(&right.camera.pose, centre);
    centre[0] += 0.002;
    oc_pose_from_centre(right.camera.pose.R, centre, &right.camera.pose);
    right.view = 9;
    oc_ground_result_t result;
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[0], votes[1], &result));
    for (uint32_t i = 0; i < left.n_junctions; i++) TEST_ASSERT_TRUE(oc_ground_evidence(&votes[0][i]) < 1.0);
    TEST_ASSERT_TRUE(oc_ground_overlap(&left.camera, &right.camera, worth) < 0.01);
}

static int count_ground(const oc_ground_votes_t v[], uint32_t n)
{
    int count = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint8_t label, confidence;
        oc_ground_decide(&params, &v[i], &label, &confidence);
        count += label == OC_LABEL_GROUND;
    }
    return count;
}

/* The same picture from the same place agrees everywhere, and proves nothing. */
static void identical_views_prove_nothing(void)
{
    const oc_ground_view_t left = view_of(1, 0.01, OC_TEST_RAD(1.0));
    oc_ground_view_t right = left;
    oc_ground_result_t result;
    right.view = 7;
    const oc_status_t status = oc_ground_match_views(&ws, &params, &left, &right, votes[1], votes[0], &result);
    TEST_ASSERT_TRUE(status == OC_OK || status == OC_E_DEGENERATE);
    TEST_ASSERT_EQUAL(0, count_ground(votes[1], left.n_junctions));
    TEST_ASSERT_EQUAL(0, count_ground(votes[0], left.n_junctions));
}

static void mirrored_view_shows_no_ground(void)
{
    static uint8_t px[WIDTH * HEIGHT];
    static oc_junction_t found[OC_MAX_JUNCTIONS];
    const oc_ground_view_t left = view_of(2, 0.01, OC_TEST_RAD(1.0));
    oc_ground_view_t right = view_of(1, 0.01, OC_TEST_RAD(1.0));
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) px[i] = pixels[1][i - i % WIDTH + WIDTH - 1u - i % WIDTH];
    detect(px, found, &right.n_junctions);
    right.grey.px = px;
    right.junctions = found;
    oc_ground_result_t result;
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[2], votes[1], &result));
    TEST_ASSERT_EQUAL(0, count_ground(votes[2], left.n_junctions));
    TEST_ASSERT_EQUAL(0, count_ground(votes[1], right.n_junctions));
}

/* As many junctions as there may be, most of them anywhere, some not even in the image. */
static void full_lists_of_junk_are_survived(void)
{
    static oc_junction_t junk[2][OC_MAX_JUNCTIONS];
    oc_ground_view_t views[2];
    for (int i = 0; i < 2; i++) {
        views[i] = view_of(1 + i, 0.01, OC_TEST_RAD(1.0));
        memcpy(junk[i], junctions[1 + i], sizeof junk[i]);
        for (uint32_t k = n_junctions[1 + i]; k < OC_MAX_JUNCTIONS; k++) {
            junk[i][k].x_px = (float)oc_test_uniform(&random_, -20.0, WIDTH + 20.0);
            junk[i][k].y_px = (float)oc_test_uniform(&random_, -20.0, HEIGHT + 20.0);
        }
        junk[i][OC_MAX_JUNCTIONS - 1].x_px = NAN;
        junk[i][OC_MAX_JUNCTIONS - 2].y_px = INFINITY;
        views[i].junctions = junk[i];
        views[i].n_junctions = OC_MAX_JUNCTIONS;
    }
    for (uint32_t window_px = 7; window_px <= OC_MAX_GROUND_WINDOW_PX; window_px += 12) {
        oc_ground_result_t result;
        params.window_px = window_px;
        memset(votes, 0, sizeof votes);
        TEST_ASSERT_EQUAL(OC_OK,
                          oc_ground_match_views(&ws, &params, &views[1], &views[0], votes[2], votes[1], &result));
        TEST_ASSERT_TRUE(result.is_refined);
        TEST_ASSERT_GREATER_THAN(100, count_ground(votes[2], n_junctions[2]));
        for (uint32_t k = 1; k <= 2; k++) {
            TEST_ASSERT_EQUAL(0, votes[2][OC_MAX_JUNCTIONS - k].sum);
            TEST_ASSERT_EQUAL(0, votes[2][OC_MAX_JUNCTIONS - k].against);
        }
    }
}

/* Exposure, a soft lens and noise in one of the two views. */
static void changed_light_blur_and_noise_cost_little(void)
{
    static uint8_t px[WIDTH * HEIGHT];
    const oc_ground_view_t left = view_of(2, 0.01, OC_TEST_RAD(1.0));
    oc_ground_view_t right = view_of(1, 0.01, OC_TEST_RAD(1.0));
    oc_ground_result_t result;
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[2], votes[1], &result));
    const int before = count_ground(votes[2], left.n_junctions);
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        const uint8_t *p = pixels[1];
        const uint32_t before_x = i > 0 ? i - 1u : i, after_x = i + 1u < WIDTH * HEIGHT ? i + 1u : i;
        const double soft = 0.25 * (p[before_x] + p[after_x]) + 0.5 * p[i];
        const double value = 0.7 * soft + 12.0 + oc_test_uniform(&random_, -6.0, 6.0);
        px[i] = (uint8_t)(value < 0.0 ? 0.0 : value);
    }
    right.grey.px = px;
    for (int pass = 0; pass < 2; pass++) {
        if (pass == 1) params.window_px = OC_MAX_GROUND_WINDOW_PX;
        memset(votes, 0, sizeof votes);
        TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[2], votes[1], &result));
        TEST_ASSERT_GREATER_THAN(before * (pass == 0 ? 4 : 3) / 5, count_ground(votes[2], left.n_junctions));
    }
}

/* Slabs: their tops are textured and flat like the ground, only not on it. At 6 mm
 * the place of the window tells, 2 px from where the ground would be; at 25 mm it is not there at all. */
static void check_slabs(double height_m)
{
    static uint8_t px[2][WIDTH * HEIGHT];
    static oc_junction_t found[2][OC_MAX_JUNCTIONS];
    oc_scene_t slabs = scene;
    for (int b = 0; b < 2; b++) slabs.box_max_m[b][2] = height_m;
    oc_ground_view_t views[2];
    for (int i = 0; i < 2; i++) {
        views[i] = view_of(1 + i, 0.01, OC_TEST_RAD(1.0));
        views[i].grey = oc_scene_render(&slabs, &cameras[1 + i], px[i]);
        detect(px[i], found[i], &views[i].n_junctions);
        views[i].junctions = found[i];
        perturb(&views[i]);
    }
    oc_ground_result_t result;
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &views[1], &views[0], votes[2], votes[1], &result));
    TEST_ASSERT_TRUE(result.is_refined);
    int n_top = 0, n_lost = 0, n_ground = 0;
    for (uint32_t k = 0; k < views[1].n_junctions; k++) {
        uint8_t label, confidence;
        oc_ground_decide(&params, &votes[2][k], &label, &confidence);
        n_ground += label == OC_LABEL_GROUND;
        if (oc_scene_height_m(&slabs, &cameras[2], &found[1][k]) < 0.96 * height_m) continue;
        n_top++;
        n_lost += label == OC_LABEL_GROUND;
    }
    char text[96];
    snprintf(text, sizeof text, "%.0f mm: %d of %d on the slabs lost, %d ground", 1e3 * height_m, n_lost, n_top,
             n_ground);
    TEST_ASSERT_MESSAGE(n_top > 25 && n_ground > 100, text);
    TEST_ASSERT_MESSAGE(n_lost <= n_top / 10, text);
}

static void low_slabs_are_told_from_the_ground(void)
{
    check_slabs(0.025);
    memset(votes, 0, sizeof votes);
    check_slabs(0.006);
}

static void bad_views_are_refused_and_touch_nothing(void)
{
    const oc_ground_view_t good = view_of(0, 0.01, 0.01), other = view_of(1, 0.01, 0.01);
    const oc_ground_result_t before = {.n_inliers = 12345};
    static const oc_ground_votes_t none[OC_MAX_JUNCTIONS];
    for (int fault = 0; fault < 7; fault++) {
        oc_ground_view_t bad = good;
        oc_ground_params_t p = params;
        oc_ground_result_t result = before;
        oc_status_t expected = OC_E_ARG;
        if (fault == 0) bad.margin.v[4] = (double)NAN;
        if (fault == 1) bad.margin.v[0] = -1.0;
        if (fault == 2) bad.grey.channels = 3;
        if (fault == 3) bad.camera.k.width_px = 320;
        if (fault == 4) bad.camera.pose.t[1] = (double)INFINITY;
        if (fault == 5) p.window_px = 16;
        if (fault == 6) {
            bad.n_junctions = OC_MAX_JUNCTIONS + 1;
            expected = OC_E_LIMIT;
        }
        TEST_ASSERT_EQUAL(expected, oc_ground_match_views(&ws, &p, &bad, &other, votes[0], votes[1], &result));
        TEST_ASSERT_EQUAL(
            expected, oc_ground_match_views(&ws, &p, fault == 5 ? &good : &other, &bad, votes[1], votes[0], &result));
        TEST_ASSERT_EQUAL(before.n_inliers, result.n_inliers);
        TEST_ASSERT_EQUAL_MEMORY(none, votes[0], sizeof none);
    }
}

static void absurd_margins_and_no_junctions_are_survived(void)
{
    oc_ground_view_t left = view_of(0, 100.0, 0.4), right = view_of(1, 100.0, 0.4);
    oc_ground_result_t result;
    left.n_junctions = right.n_junctions = 150; /* their windows hold everything; keep it short */
    const oc_status_t status = oc_ground_match_views(&ws, &params, &left, &right, votes[0], votes[1], &result);
    TEST_ASSERT_TRUE(status == OC_OK || status == OC_E_DEGENERATE);
    left = view_of(0, 0.01, 0.01);
    right = view_of(1, 0.01, 0.01);
    left.n_junctions = 0;
    left.junctions = NULL;
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[0], votes[1], &result));
    TEST_ASSERT_FALSE(result.is_refined);
}

int main(void)
{
    UNITY_BEGIN();
    scene_make();
    RUN_TEST(raised_plane_is_not_called_ground);
    RUN_TEST(views_that_share_nothing_are_left_alone);
    RUN_TEST(view_from_nearly_the_same_place_does_not_judge);
    RUN_TEST(identical_views_prove_nothing);
    RUN_TEST(mirrored_view_shows_no_ground);
    RUN_TEST(full_lists_of_junk_are_survived);
    RUN_TEST(changed_light_blur_and_noise_cost_little);
    RUN_TEST(low_slabs_are_told_from_the_ground);
    RUN_TEST(bad_views_are_refused_and_touch_nothing);
    RUN_TEST(absurd_margins_and_no_junctions_are_survived);
    free(judoca_block);
    return UNITY_END();
}
