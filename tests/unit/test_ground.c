/* SPDX-License-Identifier: BSD-3-Clause
 * The ground filter on rendered scenes of the thesis' own geometry: labels,
 * ties, the refined homography, and what it must refuse. */
#include "unity.h"

#include <stdlib.h>
#include <string.h>

#include "core/homography.h"
#include "core/plane.h"
#include "ground_scene.h"
#include "thesis_tables.h"
#include "vehicle/ground.h"
#include "vehicle/judoca.h"

#define N_VIEWS 4
#define WIDTH 640u
#define HEIGHT 480u

/* The two obstacles of table 7.4 seen from rows d, e, f, g of table 7.3. */
static oc_scene_t scene;
static oc_camera_t cameras[N_VIEWS];
static uint8_t pixels[N_VIEWS][WIDTH * HEIGHT];
static oc_junction_t junctions[N_VIEWS][OC_MAX_JUNCTIONS];
static uint32_t n_junctions[N_VIEWS];

static oc_ground_ws_t ws;
static oc_ground_params_t params;
static oc_ground_votes_t votes[N_VIEWS][OC_MAX_JUNCTIONS];
static oc_test_random_t random_;
static float worth[OC_GROUND_CELLS];

static oc_judoca_ws_t judoca;
static void *judoca_block;

static void detect(const uint8_t *px, oc_junction_t out[], uint32_t *n)
{
    const oc_image_t image = {px, WIDTH, HEIGHT, WIDTH, 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_detect(&judoca, &image, out, OC_MAX_JUNCTIONS, n));
}

static void scene_make(void)
{
    scene = (oc_scene_t){.ground_z_m = 0.0, .cell_m = 0.04, .n_boxes = 2};
    for (int b = 0; b < 2; b++) {
        for (int k = 0; k < 3; k++) {
            scene.box_min_m[b][k] = table_7_4_min_mm[b][k] / 1000.0;
            scene.box_max_m[b][k] = table_7_4_max_mm[b][k] / 1000.0;
        }
        scene.box_min_m[b][2] = 0.0;
    }
    oc_judoca_params_t detection = oc_judoca_defaults();
    const size_t n_bytes = oc_judoca_size_bytes(WIDTH, HEIGHT, &detection) + OC_ARENA_ALIGN;
    judoca_block = malloc(n_bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, judoca_block, n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_judoca_init(&judoca, &arena, WIDTH, HEIGHT, &detection));
    for (int i = 0; i < N_VIEWS; i++) {
        cameras[i] = oc_test_camera(&table_7_3, 3 + i);
        (void)oc_scene_render(&scene, &cameras[i], pixels[i]);
        detect(pixels[i], junctions[i], &n_junctions[i]);
    }
}

void setUp(void)
{
    params = oc_ground_defaults();
    random_ = oc_test_random_from(20041);
    memset(votes, 0, sizeof votes);
}

void tearDown(void) {}

static oc_ground_view_t view_of(int i, double margin_m, double margin_rad)
{
    oc_ground_view_t view = {.view = (uint16_t)i,
                             .grey = {pixels[i], WIDTH, HEIGHT, WIDTH, 1},
                             .camera = cameras[i],
                             .junctions = junctions[i],
                             .n_junctions = n_junctions[i]};
    for (int k = 0; k < 3; k++) {
        view.margin.v[k] = margin_m;
        view.margin.v[3 + k] = margin_rad;
    }
    return view;
}

/* The pose as a sensor with that margin would report it. */
static void perturb(oc_ground_view_t *view)
{
    oc_pose6_t six;
    oc_pose_to_6(&view->camera.pose, &six);
    for (int k = 0; k < 6; k++) six.v[k] += oc_test_uniform(&random_, -1.0, 1.0) * view->margin.v[k];
    oc_pose_from_6(&six, &view->camera.pose);
}

/* ---- labels ---- */

typedef struct tally {
    int n_ground, n_ground_right; /* labelled ground; of these truly ground */
    int n_true_ground, n_found;    /* truly ground and seen twice; of these labelled so */
    int n_high, n_high_lost; /* on a box above 20 mm; of these labelled ground */
    int n_high_obstacle;
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
        if (truth != OC_LABEL_OBSTACLE || oc_scene_height_m(&scene, &cameras[view], &junctions[view][i]) < 0.02)
            continue;
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
    char text[160];
    snprintf(text, sizeof text, "%s: ground %d right of %d, found %d of %d, box %d lost, %d found of %d", what,
             t->n_ground_right, t->n_ground, t->n_found, t->n_true_ground, t->n_high_lost, t->n_high_obstacle, t->n_high);
    TEST_ASSERT_MESSAGE(t->n_true_ground > 200 && t->n_high > 100, text);
    TEST_ASSERT_MESSAGE(t->n_ground_right >= 0.98 * t->n_ground, text);
    TEST_ASSERT_MESSAGE(t->n_found >= 0.9 * t->n_true_ground, text);
    TEST_ASSERT_MESSAGE(t->n_high_lost <= 0.02 * t->n_high, text);
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
        {{2.0}, 1, OC_LABEL_UNKNOWN},                         /* one doubtful view */
        {{2.0, 1.8, 1.6}, 3, OC_LABEL_GROUND},                /* three of them */
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
    RUN_TEST(votes_weigh_by_their_evidence);
    RUN_TEST(confidence_is_the_probability_of_the_evidence);
    RUN_TEST(votes_are_a_sum_without_order);
    RUN_TEST(refined_homography_is_right_to_half_a_pixel);
    RUN_TEST(same_pair_gives_the_same_answer);
    RUN_TEST(ties_are_true_spread_and_limited);
    RUN_TEST(raised_plane_is_not_called_ground);
    RUN_TEST(views_that_share_nothing_are_left_alone);
    RUN_TEST(view_from_nearly_the_same_place_does_not_judge);
    RUN_TEST(bad_views_are_refused_and_touch_nothing);
    RUN_TEST(absurd_margins_and_no_junctions_are_survived);
    RUN_TEST(parameters_outside_their_ranges_are_refused);
    RUN_TEST(overlap_prefers_a_moderate_angle);
    free(judoca_block);
    return UNITY_END();
}
