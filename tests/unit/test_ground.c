/* SPDX-License-Identifier: BSD-3-Clause
 * The ground filter on rendered scenes of the thesis' own geometry: labels,
 * ties, the refined homography, the choice of references. */
#include "ground_rig.h"

/* ---- labels ---- */

typedef struct tally {
    int n_ground, n_ground_right; /* labelled ground; of these truly ground */
    int n_true_ground, n_found;   /* truly ground and seen twice; of these labelled so */
    int n_high, n_high_lost;      /* on a box above 20 mm; of these labelled ground */
    int n_high_obstacle;
    int n_foot, n_foot_lost; /* at the foot of a box, which touches the ground; of these labelled ground */
} tally_t;

/* Is the ground point at a pixel of one view seen, as ground, by a view it is compared with? */
static bool is_seen_twice(int view, double x_px, double y_px)
{
    for (int other = view - 1; other <= view + 1; other += 2) {
        double H[9], x, y, p[3];
        if (other < 0 || other >= N_VIEWS) continue;
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&cameras[view], &cameras[other], H));
        if (!(oc_homography_apply(H, x_px, y_px, &x, &y) > 0.0)) continue;
        if (!(x >= 1.0 && y >= 1.0 && x <= WIDTH - 2.0 && y <= HEIGHT - 2.0)) continue;
        if (oc_scene_hit(&scene, &cameras[other], x, y, p) == OC_SCENE_FACE_GROUND) return true;
    }
    return false;
}

static void tally_add(tally_t *t, int view)
{
    for (uint32_t i = 0; i < n_junctions[view]; i++) {
        uint8_t label, confidence;
        oc_ground_decide(&params, &votes[view][i], &label, &confidence);
        const oc_label_t truth = oc_scene_truth(&scene, &cameras[view], &junctions[view][i]);
        const bool is_twice = is_seen_twice(view, (double)junctions[view][i].x_px, (double)junctions[view][i].y_px);
        t->n_true_ground += truth == OC_LABEL_GROUND && is_twice;
        t->n_found += truth == OC_LABEL_GROUND && is_twice && label == OC_LABEL_GROUND;
        t->n_ground += label == OC_LABEL_GROUND;
        t->n_ground_right += label == OC_LABEL_GROUND && truth == OC_LABEL_GROUND;
        if (truth != OC_LABEL_OBSTACLE) continue;
        if (oc_scene_height_m(&scene, &cameras[view], &junctions[view][i]) < 0.02) {
            t->n_foot++;
            t->n_foot_lost += label == OC_LABEL_GROUND;
            continue;
        }
        t->n_high++;
        t->n_high_lost += label == OC_LABEL_GROUND;
        t->n_high_obstacle += label == OC_LABEL_OBSTACLE;
    }
}

static tally_t run_all_pairs(double margin_m, double margin_rad, bool is_perturbed)
{
    tally_t t = {0};
    oc_ground_view_t views[N_VIEWS];
    memset(votes, 0, sizeof votes);
    for (int i = 0; i < N_VIEWS; i++) {
        views[i] = view_of(i, margin_m, margin_rad);
        if (is_perturbed) perturb(&views[i]);
    }
    for (int i = 1; i < N_VIEWS; i++) {
        oc_ground_result_t result;
        TEST_ASSERT_EQUAL(
            OC_OK, oc_ground_match_views(&ws, &params, &views[i], &views[i - 1], votes[i], votes[i - 1], &result));
        TEST_ASSERT_TRUE(result.is_refined);
    }
    for (int i = 0; i < N_VIEWS; i++) tally_add(&t, i);
    return t;
}

static void check_tally(const tally_t *t, const char *what)
{
    char text[200];
    snprintf(text, sizeof text,
             "%s: ground %d right of %d, found %d of %d, box %d lost, %d found of %d, foot %d lost of %d", what,
             t->n_ground_right, t->n_ground, t->n_found, t->n_true_ground, t->n_high_lost, t->n_high_obstacle,
             t->n_high, t->n_foot_lost, t->n_foot);
    TEST_ASSERT_MESSAGE(t->n_true_ground > 200 && t->n_high > 100, text);
    TEST_ASSERT_MESSAGE(t->n_ground_right >= 0.98 * t->n_ground, text);
    TEST_ASSERT_MESSAGE(t->n_found >= 0.9 * t->n_true_ground, text);
    TEST_ASSERT_MESSAGE(t->n_high_lost <= 0.02 * t->n_high, text);
    TEST_ASSERT_MESSAGE(t->n_foot > 20 && t->n_foot_lost <= 0.1 * t->n_foot, text);
    TEST_ASSERT_MESSAGE(t->n_high_lost + t->n_foot_lost <= 0.02 * (t->n_high + t->n_foot), text);
    TEST_ASSERT_MESSAGE(t->n_high_obstacle >= 0.5 * t->n_high, text);
}

static void ground_is_told_from_boxes_with_exact_poses(void)
{
    const tally_t t = run_all_pairs(0.01, OC_TEST_RAD(1.0), false);
    check_tally(&t, "exact");
}

static void ground_is_told_from_boxes_without_margins(void)
{
    const tally_t t = run_all_pairs(0.0, 0.0, false);
    check_tally(&t, "no margins");
}

static void ground_is_told_from_boxes_with_wrong_poses(void)
{
    for (int draw = 0; draw < 4; draw++) {
        const tally_t t = run_all_pairs(0.01, OC_TEST_RAD(1.0), true);
        check_tally(&t, oc_test_draw(&random_, draw));
    }
}

static uint8_t label_of(const double l[], int n, uint8_t *confidence)
{
    oc_ground_votes_t v = {0};
    uint8_t label;
    for (int i = 0; i < n; i++) oc_ground_vote(&v, l[i]);
    oc_ground_decide(&params, &v, &label, confidence);
    return label;
}

static void votes_weigh_by_their_evidence(void)
{
    const struct {
        double l[6];
        int n;
        oc_label_t label;
    } cases[] = {
        {{0}, 0, OC_LABEL_UNKNOWN},
        {{6.0}, 1, OC_LABEL_GROUND},
        {{2.0}, 1, OC_LABEL_UNKNOWN},                          /* one doubtful view */
        {{2.0, 1.8, 1.6}, 3, OC_LABEL_GROUND},                 /* three of them */
        {{1.0, 1.0, 1.0, 1.0, 1.0, 1.0}, 6, OC_LABEL_UNKNOWN}, /* the foot of an obstacle looks so from everywhere */
        {{-1.5}, 1, OC_LABEL_OBSTACLE},
        {{-0.5}, 1, OC_LABEL_UNKNOWN},
        {{6.0, -1.5, -1.5, -1.5}, 4, OC_LABEL_GROUND}, /* hidden from three views by the same thing */
        {{3.0, -1.5, -1.5}, 3, OC_LABEL_UNKNOWN},
        {{1.0, -1.5, -1.5, -1.5}, 4, OC_LABEL_OBSTACLE},
        {{(double)NAN}, 1, OC_LABEL_UNKNOWN},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t confidence;
        char what[32];
        snprintf(what, sizeof what, "case %zu", i);
        TEST_ASSERT_EQUAL_MESSAGE(cases[i].label, label_of(cases[i].l, cases[i].n, &confidence), what);
        TEST_ASSERT_EQUAL_MESSAGE(cases[i].label == OC_LABEL_UNKNOWN, confidence == 0, what);
    }
}

static void confidence_is_the_probability_of_the_evidence(void)
{
    for (double l = -3.4; l <= 7.0; l += 0.3) {
        uint8_t confidence;
        if (label_of(&l, 1, &confidence) == OC_LABEL_UNKNOWN) continue;
        oc_ground_votes_t v = {0};
        oc_ground_vote(&v, l);
        const double p = 1.0 / (1.0 + exp(-fabs(oc_ground_evidence(&v))));
        TEST_ASSERT_TRUE(fabs(confidence / 255.0 - p) <= 0.5 / 255.0 + 1e-9);
        TEST_ASSERT_GREATER_OR_EQUAL(186, confidence); /* 73 %: what t_obstacle is worth */
    }
}

/* Order of the views must not matter, no view may work against what it says, and nothing may wrap. */
static void votes_are_a_sum_without_order(void)
{
    for (int draw = 0; draw < 200; draw++) {
        double l[40];
        oc_ground_votes_t there = {0}, back = {0};
        for (int i = 0; i < 40; i++) {
            l[i] = oc_test_uniform(&random_, -5.0, 9.0);
            const double before = oc_ground_evidence(&there);
            oc_ground_vote(&there, l[i]);
            const double after = oc_ground_evidence(&there);
            TEST_ASSERT_TRUE_MESSAGE(l[i] >= 0.0 ? after >= before : after <= before, oc_test_draw(&random_, draw));
        }
        for (int i = 39; i >= 0; i--) oc_ground_vote(&back, l[i]);
        TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&there, &back, sizeof there, oc_test_draw(&random_, draw));
    }
    oc_ground_votes_t many = {0};
    double before = 0.0;
    for (int i = 0; i < 5000; i++) {
        oc_ground_vote(&many, 7.0);
        TEST_ASSERT_TRUE(oc_ground_evidence(&many) >= before);
        before = oc_ground_evidence(&many);
    }
    for (int i = 0; i < 5000; i++) oc_ground_vote(&many, -(double)INFINITY);
    TEST_ASSERT_TRUE(oc_ground_evidence(&many) < before);
}

static double border_distance_px(double x, double y)
{
    return fmin(fmin(x, WIDTH - 1.0 - x), fmin(y, HEIGHT - 1.0 - y));
}

/* Places of the ground that one picture shows so near its border that a window round them does not fit in: the window
 * is moved. `is_own`: near the border of the view itself, not of the reference. */
static void check_border(bool is_own)
{
    static oc_junction_t places[OC_MAX_JUNCTIONS];
    oc_ground_view_t left = view_of(2, 0.01, OC_TEST_RAD(1.0));
    const oc_ground_view_t right = view_of(1, 0.01, OC_TEST_RAD(1.0));
    double H[9], p[3];
    uint32_t n = n_junctions[2] < 400 ? n_junctions[2] : 400; /* what the pair is fitted to */
    const uint32_t first = n;
    memcpy(places, junctions[2], sizeof places);
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&cameras[2], &cameras[1], H));
    for (double y = 3; y < HEIGHT - 3; y += 5) {
        for (double x = 3; x < WIDTH - 3; x += 5) {
            double u, v;
            if (n == OC_MAX_JUNCTIONS || !(oc_homography_apply(H, x, y, &u, &v) > 0.0)) continue;
            const double own = border_distance_px(x, y), other = border_distance_px(u, v);
            /* In the reference the search needs 3 px more. */
            const double near = is_own ? own : other - 4.0, far = is_own ? other : own;
            if (!(near > 3.0 && near < 8.0 && far > 25.0)) continue;
            if (oc_scene_hit(&scene, &cameras[2], x, y, p) != OC_SCENE_FACE_GROUND) continue;
            if (oc_scene_hit(&scene, &cameras[1], u, v, p) != OC_SCENE_FACE_GROUND) continue;
            places[n].x_px = (float)x;
            places[n++].y_px = (float)y;
        }
    }
    left.junctions = places;
    left.n_junctions = n;
    oc_ground_result_t result;
    memset(votes, 0, sizeof votes);
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[2], votes[1], &result));
    int n_found = 0;
    for (uint32_t i = first; i < n; i++) {
        uint8_t label, confidence;
        oc_ground_decide(&params, &votes[2][i], &label, &confidence);
        n_found += label == OC_LABEL_GROUND;
    }
    char text[80];
    snprintf(text, sizeof text, "%s border: %d of %u", is_own ? "own" : "other", n_found, n - first);
    TEST_ASSERT_MESSAGE(n - first > 30, text);
    TEST_ASSERT_MESSAGE(n_found >= 0.7 * (n - first), text);
}

static void ground_near_a_border_is_found(void)
{
    check_border(true);
    check_border(false);
}

/* ---- the homography ---- */

/* Mean error of the refined transfer over the ground that both views see. */
static double transfer_error_px(const oc_ground_result_t *result, int left, int right)
{
    double H[9], sum = 0.0;
    int n = 0;
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&cameras[left], &cameras[right], H));
    for (double y = 20; y < HEIGHT; y += 40) {
        for (double x = 20; x < WIDTH; x += 40) {
            double u, v, u2, v2;
            if (!(oc_homography_apply(H, x, y, &u, &v) > 0.0)) continue;
            if (!(u >= 0 && v >= 0 && u < WIDTH && v < HEIGHT)) continue;
            TEST_ASSERT_TRUE(oc_homography_apply(result->ref_from_view, x, y, &u2, &v2) != 0.0);
            sum += hypot(u - u2, v - v2);
            n++;
        }
    }
    TEST_ASSERT_GREATER_THAN(20, n);
    return sum / n;
}

static void refined_homography_is_right_to_half_a_pixel(void)
{
    for (int draw = 0; draw < 4; draw++) {
        oc_ground_view_t left = view_of(2, 0.01, OC_TEST_RAD(1.0)), right = view_of(1, 0.01, OC_TEST_RAD(1.0));
        perturb(&left);
        perturb(&right);
        oc_ground_result_t result;
        TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[2], votes[1], &result));
        TEST_ASSERT_TRUE_MESSAGE(result.is_refined, oc_test_draw(&random_, draw));
        double H[9], x, y, x2, y2;
        TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&left.camera, &right.camera, H));
        TEST_ASSERT_TRUE(oc_homography_apply(H, 320, 240, &x, &y) > 0.0);
        TEST_ASSERT_TRUE(oc_homography_apply(result.ref_from_view, 320, 240, &x2, &y2) != 0.0);
        const double error_px = transfer_error_px(&result, 2, 1);
        TEST_ASSERT_TRUE_MESSAGE(error_px < 0.5, oc_test_draw(&random_, draw));
        /* The poses as reported were off by far more, or this proves nothing. */
        TEST_ASSERT_TRUE_MESSAGE(hypot(x - x2, y - y2) > 1.0, oc_test_draw(&random_, draw));
    }
}

static void same_pair_gives_the_same_answer(void)
{
    const oc_ground_view_t left = view_of(1, 0.01, OC_TEST_RAD(1.0)), right = view_of(0, 0.01, OC_TEST_RAD(1.0));
    oc_ground_result_t first, second;
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[0], votes[1], &first));
    memset(&ws, 0x5a, sizeof ws);
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[2], votes[3], &second));
    TEST_ASSERT_EQUAL(first.n_inliers, second.n_inliers);
    TEST_ASSERT_EQUAL_MEMORY(first.ref_from_view, second.ref_from_view, sizeof first.ref_from_view);
    TEST_ASSERT_EQUAL_MEMORY(votes[0], votes[2], sizeof votes[0]);
    TEST_ASSERT_EQUAL_MEMORY(votes[1], votes[3], sizeof votes[1]);
}

/* ---- ties ---- */

static void ties_are_true_spread_and_limited(void)
{
    const oc_ground_view_t left = view_of(2, 0.01, OC_TEST_RAD(1.0)), right = view_of(1, 0.01, OC_TEST_RAD(1.0));
    oc_ground_result_t result;
    oc_tie_t ties[OC_MAX_TIES];
    double H[9];
    TEST_ASSERT_EQUAL(OC_OK, oc_ground_match_views(&ws, &params, &left, &right, votes[2], votes[1], &result));
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&cameras[2], &cameras[1], H));
    const uint32_t n = oc_ground_pick_ties(&ws, &params, &left, &right, ties, OC_MAX_TIES);
    TEST_ASSERT_EQUAL(24, n);
    bool is_used[4][4] = {{false}};
    int n_cells = 0;
    for (uint32_t i = 0; i < n; i++) {
        double x, y;
        TEST_ASSERT_EQUAL(1, ties[i].ref_view);
        TEST_ASSERT_TRUE(oc_homography_apply(H, (double)ties[i].x_px, (double)ties[i].y_px, &x, &y) > 0.0);
        TEST_ASSERT_TRUE(hypot(x - (double)ties[i].ref_x_px, y - (double)ties[i].ref_y_px) < 2.0);
        bool *cell = &is_used[(int)ties[i].y_px * 4 / (int)HEIGHT][(int)ties[i].x_px * 4 / (int)WIDTH];
        n_cells += !*cell;
        *cell = true;
        for (uint32_t j = 0; j < i; j++) {
            TEST_ASSERT_TRUE(ties[i].x_px != ties[j].x_px || ties[i].y_px != ties[j].y_px);
        }
    }
    TEST_ASSERT_GREATER_OR_EQUAL(7, n_cells);
    TEST_ASSERT_EQUAL(5, oc_ground_pick_ties(&ws, &params, &left, &right, ties, 5));
    params.max_ties = 0;
    TEST_ASSERT_EQUAL(0, oc_ground_pick_ties(&ws, &params, &left, &right, ties, OC_MAX_TIES));
}

static void parameters_outside_their_ranges_are_refused(void)
{
    TEST_ASSERT_TRUE(oc_ground_params_are_valid(&params));
    oc_ground_params_t p;
    p = params, p.t_g = NAN;
    TEST_ASSERT_FALSE(oc_ground_params_are_valid(&p));
    p = params, p.window_px = OC_MAX_GROUND_WINDOW_PX + 2;
    TEST_ASSERT_FALSE(oc_ground_params_are_valid(&p));
    p = params, p.t_ground = NAN;
    TEST_ASSERT_FALSE(oc_ground_params_are_valid(&p));
    p = params, p.t_obstacle = 0.0f;
    TEST_ASSERT_FALSE(oc_ground_params_are_valid(&p));
    p = params, p.t_h_m = 0.0;
    TEST_ASSERT_FALSE(oc_ground_params_are_valid(&p));
    p = params, p.max_references = OC_MAX_GROUND_REFERENCES + 1;
    TEST_ASSERT_FALSE(oc_ground_params_are_valid(&p));
    p = params, p.min_inliers = 3;
    TEST_ASSERT_FALSE(oc_ground_params_are_valid(&p));
}

/* ---- choice of references ---- */

static void overlap_prefers_a_moderate_angle(void)
{
    const double next = oc_ground_overlap(&cameras[1], &cameras[0], worth);
    TEST_ASSERT_TRUE(next > 0.3 && next <= 1.0);
    TEST_ASSERT_TRUE(oc_ground_overlap(&cameras[1], &cameras[1], worth) == 0.0);
    oc_camera_t up = cameras[0];
    for (int i = 3; i < 9; i++) up.pose.R[i] = -up.pose.R[i]; /* looks at the sky */
    double centre[3];
    oc_pose_centre(&cameras[0].pose, centre);
    oc_pose_from_centre(up.pose.R, centre, &up.pose);
    TEST_ASSERT_TRUE(oc_ground_overlap(&up, &cameras[1], worth) == 0.0);
    TEST_ASSERT_TRUE(oc_ground_overlap(&cameras[1], &up, worth) == 0.0);
}

int main(void)
{
    UNITY_BEGIN();
    scene_make();
    RUN_TEST(ground_is_told_from_boxes_with_exact_poses);
    RUN_TEST(ground_is_told_from_boxes_without_margins);
    RUN_TEST(ground_is_told_from_boxes_with_wrong_poses);
    RUN_TEST(ground_near_a_border_is_found);
    RUN_TEST(votes_weigh_by_their_evidence);
    RUN_TEST(confidence_is_the_probability_of_the_evidence);
    RUN_TEST(votes_are_a_sum_without_order);
    RUN_TEST(refined_homography_is_right_to_half_a_pixel);
    RUN_TEST(same_pair_gives_the_same_answer);
    RUN_TEST(ties_are_true_spread_and_limited);
    RUN_TEST(parameters_outside_their_ranges_are_refused);
    RUN_TEST(overlap_prefers_a_moderate_angle);
    free(judoca_block);
    return UNITY_END();
}
