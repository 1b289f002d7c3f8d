/* SPDX-License-Identifier: BSD-3-Clause
 * Ground filter of one pair of views: both passes and the votes. */
#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "core/mat3.h"
#include "core/plane.h"
#include "vehicle/ground_internal.h"

/* Pairs correlated in one pass; keeps the time of absurdly wide margins bounded. */
#define MAX_CANDIDATES 60000u

/* Times that the pair is fitted to what was found; the second reaches what the first brought into reach. */
#define REGISTER_ROUNDS 2

/* Ground that correlates less on average is not just resampled: blur, noise, a codec. */
#define CLEAN_NCC 0.97

/* What the smoothing leaves of white noise. */
#define SMOOTH_NOISE 0.375

#define NO_MATCH UINT16_MAX

/* ---- pairing junctions ---- */

/* Where the partners of a left junction may be. */
typedef struct pairing {
    const oc_ground_view_t *left, *right;
    const double *H, *H_inv;
    const oc_pair_t *prior;       /* windows of the margins, or NULL: */
    const ground_pair_t *refined; /* of what the fit has left of them */
    double sigma_px, chi2;
    float t_ncc;
} pairing_t;

static bool window_open(const pairing_t *how, const double at[2], oc_window_t *window)
{
    if (how->prior) return oc_window_ground(how->prior, at[0], at[1], window) == OC_OK;
    double J[4];
    double *cov = window->cov_px2;
    if (!(oc_homography_apply(how->H, at[0], at[1], &window->x_px, &window->y_px) > 0.0)) return false;
    if (oc_homography_jacobian(how->H, at[0], at[1], J) != OC_OK) return false;
    if (!oc_ground_transfer_covariance(how->refined, at[0], at[1], cov)) return false;
    const double noise2 = how->sigma_px * how->sigma_px;
    cov[0] += noise2 * (1.0 + J[0] * J[0] + J[1] * J[1]);
    cov[1] += noise2 * (J[0] * J[2] + J[1] * J[3]);
    cov[2] += noise2 * (1.0 + J[2] * J[2] + J[3] * J[3]);
    const double det = cov[0] * cov[2] - cov[1] * cov[1];
    if (!(det > 0.0)) return false;
    window->info[0] = cov[2] / det;
    window->info[1] = -cov[1] / det;
    window->info[2] = cov[0] / det;
    return true;
}

static void pair_score(oc_ground_ws_t *ws, uint32_t i, uint32_t j, float score)
{
    if (score > ws->ncc_right[i]) {
        ws->ncc_right[i] = score;
        ws->best_right[i] = (uint16_t)j;
    }
    if (score > ws->ncc_left[j]) {
        ws->ncc_left[j] = score;
        ws->best_left[j] = (uint16_t)i;
    }
}

/* Partners of left junction i: the score of a pair is the worse of the two directions. */
static uint32_t pair_one(oc_ground_ws_t *ws, const pairing_t *how, uint32_t n_px, uint32_t i)
{
    const oc_junction_t *a = &how->left->junctions[i];
    const double at[2] = {(double)a->x_px, (double)a->y_px};
    oc_window_t window;
    ground_patch_t patch, back_patch;
    if (!window_open(how, at, &window)) return 0;
    if (!oc_ground_patch_take(&how->left->grey, at, n_px, false, &patch)) return 0;

    uint32_t n_candidates = 0;
    for (uint32_t j = 0; j < how->right->n_junctions; j++) {
        const oc_junction_t *b = &how->right->junctions[j];
        const double to[2] = {(double)b->x_px, (double)b->y_px};
        if (!(oc_window_d2(&window, to[0], to[1]) < how->chi2)) continue;
        n_candidates++;
        const float there = oc_ground_correlate(&patch, at, &how->right->grey, how->H, to);
        if (there < how->t_ncc) continue;
        if (!oc_ground_patch_take(&how->right->grey, to, n_px, false, &back_patch)) continue;
        const float back = oc_ground_correlate(&back_patch, to, &how->left->grey, how->H_inv, at);
        if (back < how->t_ncc) continue;
        pair_score(ws, i, j, back < there ? back : there);
    }
    return n_candidates;
}

/* Matches that are best for both their junctions, best first. Returns the
 * number of pairs looked at. */
static uint32_t pair_up(oc_ground_ws_t *ws, const oc_ground_params_t *params, const pairing_t *how)
{
    for (uint32_t i = 0; i < OC_MAX_JUNCTIONS; i++) {
        ws->best_left[i] = ws->best_right[i] = NO_MATCH;
        ws->ncc_left[i] = ws->ncc_right[i] = 0.0f;
    }
    uint32_t n_candidates = 0;
    for (uint32_t i = 0; i < how->left->n_junctions && n_candidates < MAX_CANDIDATES; i++) {
        n_candidates += pair_one(ws, how, params->window_px, i);
    }
    ws->n_matches = 0;
    for (uint32_t i = 0; i < how->left->n_junctions; i++) {
        const uint16_t j = ws->best_right[i];
        if (j == NO_MATCH || ws->best_left[j] != i) continue;
        /* Insertion keeps them sorted; equal scores stay in order of i. */
        uint32_t k = ws->n_matches++;
        for (; k > 0 && ws->matches[k - 1].ncc < ws->ncc_right[i]; k--) ws->matches[k] = ws->matches[k - 1];
        ws->matches[k] = (oc_ground_match_t){.left = (uint16_t)i, .right = j, .ncc = ws->ncc_right[i]};
    }
    return n_candidates;
}

/* ---- votes ---- */

/* Add what the other view says about each junction; looks that were made before
 * are weighed again, not made again. looks may be NULL. is_ground: it says ground, and clearly. */
static void judge_all(const sight_t *s, const oc_ground_params_t *params, const oc_ground_look_t looks[],
                      oc_ground_votes_t votes[], uint8_t is_ground[])
{
    for (uint32_t i = 0; i < s->from->n_junctions; i++) {
        const double at[2] = {(double)s->from->junctions[i].x_px, (double)s->from->junctions[i].y_px};
        oc_ground_look_t look = {.is_done = false};
        oc_ground_pin_t pin;
        double l;
        is_ground[i] = 0;
        if (looks) look = looks[i];
        if (!look.is_done && !oc_ground_look_at(s, params, at, &look)) continue;
        if (!oc_ground_weigh(s, params, at, &look, &l, &pin)) continue;
        oc_ground_vote(&votes[i], l);
        is_ground[i] = l >= (double)params->t_ground;
    }
}

/* ---- pins ---- */

/* The matches as pins: two junctions, each sigma_px off. */
static void pins_from_matches(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                              const oc_ground_view_t *reference, const double H[9])
{
    ws->n_pins = 0;
    for (uint32_t i = 0; i < ws->n_matches; i++) {
        const oc_junction_t *a = &view->junctions[ws->matches[i].left];
        const oc_junction_t *b = &reference->junctions[ws->matches[i].right];
        double J[4] = {1.0, 0.0, 0.0, 1.0};
        /* The left junction's error arrives magnified; its area stands for both axes. Where the Jacobian does not
         * exist the pin is no inlier either. */
        const oc_status_t status = oc_homography_jacobian(H, (double)a->x_px, (double)a->y_px, J);
        const double area = status == OC_OK ? fabs(J[0] * J[3] - J[1] * J[2]) : 1.0;
        ws->pins[ws->n_pins++] =
            (oc_ground_pin_t){.x_px = a->x_px,
                              .y_px = a->y_px,
                              .x2_px = b->x_px,
                              .y2_px = b->y_px,
                              .variance_px2 = (float)(params->sigma_px * params->sigma_px * (1.0 + area))};
    }
}

/* What was found on the ground as pins: pictures laid over each other, ten times
 * better known than junctions. Junctions that come into reach are looked at.
 * Returns the mean correlation of what was found. */
static double pins_from_looks(oc_ground_ws_t *ws, const oc_ground_params_t *params, const sight_t *s)
{
    double sum = 0.0;
    ws->n_pins = 0;
    for (uint32_t i = 0; i < s->from->n_junctions; i++) {
        const double at[2] = {(double)s->from->junctions[i].x_px, (double)s->from->junctions[i].y_px};
        oc_ground_look_t *look = &ws->looks[i];
        double l;
        if (!look->is_done && !oc_ground_look_at(s, params, at, look)) continue;
        if (!oc_ground_weigh(s, params, at, look, &l, &ws->pins[ws->n_pins])) continue;
        if (!(l >= (double)params->t_ground)) continue;
        sum += (double)look->ncc;
        ws->n_pins++;
    }
    return ws->n_pins > 0 ? sum / ws->n_pins : 1.0;
}

static void looks_forget(oc_ground_ws_t *ws, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) ws->looks[i].is_done = false;
}

/* Lay the pictures over each other, fit the pair to that, and again with what
 * has come into reach. Decides on smoothing. */
static void register_pictures(oc_ground_ws_t *ws, const oc_ground_params_t *params, sight_t *s, ground_pair_t *pair,
                              oc_ground_result_t *found)
{
    looks_forget(ws, s->from->n_junctions);
    for (int round = 0; round < REGISTER_ROUNDS; round++) {
        const double agreement = pins_from_looks(ws, params, s);
        if (round == 0 && agreement < CLEAN_NCC) {
            s->photo = (ground_photo_t){.noise_sd = SMOOTH_NOISE * s->photo.noise_sd, .is_smooth = true};
            looks_forget(ws, s->from->n_junctions);
            (void)pins_from_looks(ws, params, s);
        }
        if (!oc_ground_refit(ws, params, s->from, s->to, pair, found)) break;
    }
}

/* ---- the pair ---- */

static oc_status_t check_view(const oc_ground_view_t *v)
{
    if (v->n_junctions > OC_MAX_JUNCTIONS) return OC_E_LIMIT;
    if (!oc_image_is_valid(&v->grey) || v->grey.channels != 1) return OC_E_ARG;
    if (!oc_intrinsics_is_valid(&v->camera.k) || !oc_pose_is_valid(&v->camera.pose)) return OC_E_ARG;
    if (v->camera.k.width_px != v->grey.width_px || v->camera.k.height_px != v->grey.height_px) return OC_E_ARG;
    for (int i = 0; i < 6; i++) {
        if (!(v->margin.v[i] >= 0.0 && v->margin.v[i] <= 1e6)) return OC_E_ARG;
    }
    return OC_OK;
}

/* First pass: junction pairs inside the windows that the margins allow. */
static oc_status_t first_pass(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                              const oc_ground_view_t *reference, double H[9], oc_ground_result_t *result)
{
    oc_pair_t prepared;
    const oc_status_t status = oc_pair_prepare(&prepared, &view->camera, &view->margin, &reference->camera,
                                               &reference->margin, OC_ANGLE_ERROR_LOCAL, params->sigma_px);
    if (status != OC_OK) return status;
    double H_inv[9];
    if (oc_plane_ground_homography(&reference->camera, &view->camera, H_inv) != OC_OK) return OC_E_DEGENERATE;
    const pairing_t how = {.left = view,
                           .right = reference,
                           .H = prepared.H,
                           .H_inv = H_inv,
                           .prior = &prepared,
                           .chi2 = params->window_chi2,
                           .t_ncc = params->t_g};
    result->n_candidates = pair_up(ws, params, &how);
    result->n_matches = ws->n_matches;
    memcpy(H, prepared.H, sizeof prepared.H);
    return OC_OK;
}

/* Keep the final matches both of whose junctions were judged to be ground. */
static void keep_ground_matches(oc_ground_ws_t *ws, const uint8_t view_ground[], const uint8_t ref_ground[])
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < ws->n_matches; i++) {
        const oc_ground_match_t m = ws->matches[i];
        if (!view_ground[m.left] || !ref_ground[m.right]) continue;
        ws->matches[n++] = m;
    }
    ws->n_matches = n;
}

/* Second pass: junction pairs in the windows that the fit has left. */
static void second_pass(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                        const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *found)
{
    const pairing_t narrow = {.left = view,
                              .right = reference,
                              .H = pair->H,
                              .H_inv = pair->H_inv,
                              .refined = pair,
                              .sigma_px = params->sigma_px,
                              .chi2 = params->window_chi2,
                              .t_ncc = params->t_g_second};
    (void)pair_up(ws, params, &narrow);
    pins_from_matches(ws, params, view, reference, pair->H);
    (void)oc_ground_refit(ws, params, view, reference, pair, found);
}

/* Looks of both views into each other: the pair's last fit, votes, and the matches that stay. */
static void judge_both(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                       const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_votes_t votes[],
                       oc_ground_votes_t ref_votes[], oc_ground_result_t *found)
{
    sight_t there = {
        .from = view,
        .to = reference,
        .pair = pair,
        .forward = pair,
        .H = pair->H,
        .H_inv = pair->H_inv,
        .photo = {.noise_sd = hypot(oc_ground_noise_sd(&view->grey), oc_ground_noise_sd(&reference->grey))}};
    register_pictures(ws, params, &there, pair, found);
    ground_pair_t reverse = *pair;
    reverse.left = pair->right;
    reverse.right = pair->left;
    memcpy(reverse.H, pair->H_inv, sizeof reverse.H);
    memcpy(reverse.H_inv, pair->H, sizeof reverse.H_inv);
    const sight_t back = {.from = reference,
                          .to = view,
                          .pair = &reverse,
                          .forward = pair,
                          .H = pair->H_inv,
                          .H_inv = pair->H,
                          .is_reverse = true,
                          .photo = there.photo};
    judge_all(&there, params, ws->looks, votes, ws->view_ground);
    judge_all(&back, params, NULL, ref_votes, ws->ref_ground);
    keep_ground_matches(ws, ws->view_ground, ws->ref_ground);
}

oc_status_t oc_ground_match_views(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                                  const oc_ground_view_t *reference, oc_ground_votes_t votes[],
                                  oc_ground_votes_t ref_votes[], oc_ground_result_t *result)
{
    OC_ASSERT(ws && params && view && reference && votes && ref_votes && result);

    if (!oc_ground_params_are_valid(params)) return OC_E_ARG;
    oc_status_t status = check_view(view);
    if (status == OC_OK) status = check_view(reference);
    if (status != OC_OK) return status;

    oc_ground_result_t found = {.is_refined = false};
    ws->n_matches = 0;
    double prior_H[9];
    status = first_pass(ws, params, view, reference, prior_H, &found);
    if (status != OC_OK) return status;
    ground_pair_t pair;
    pins_from_matches(ws, params, view, reference, prior_H);
    found.is_refined = oc_ground_fit(ws, params, view, reference, &pair, &found);
    if (!found.is_refined) {
        ws->n_matches = 0;
        *result = found;
        return OC_OK;
    }

    second_pass(ws, params, view, reference, &pair, &found);
    judge_both(ws, params, view, reference, &pair, votes, ref_votes, &found);
    *result = found;
    return OC_OK;
}
