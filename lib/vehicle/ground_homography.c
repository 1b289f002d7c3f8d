/* SPDX-License-Identifier: BSD-3-Clause
 * The refined ground homography of a pair: RANSAC for the matches, then both
 * poses moved inside their margins.
 *
 * A free homography fitted to matches in one corner of the image is wild in the
 * others. Here RANSAC only picks the matches; what is kept is the homography of
 * two cameras that stay where their margins allow, so that it extrapolates as well
 * as the poses do, and its covariance says where it is good. */
#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "core/mat3.h"
#include "core/plane.h"
#include "vehicle/ground_internal.h"

/* Sum of squared moves, in standard deviations, when all twelve parameters
 * are off by their whole margin: 12 * 3. */
#define MAX_PRIOR_CHI2 36.0

/* Rounds of relinearisation; the third changes nothing visible. */
#define FIT_ROUNDS 4

/* ---- fixed pseudo-random numbers ---- */

static uint32_t random_next(uint32_t *state)
{
    uint32_t s = *state;
    s ^= s << 13;
    s ^= s >> 17;
    s ^= s << 5;
    *state = s;
    return s;
}

static uint32_t random_seed(uint16_t a, uint16_t b)
{
    uint32_t s = ((uint32_t)a << 16 | b) * 2654435761u ^ 0x9e3779b9u;
    if (s == 0) s = 1;
    for (int i = 0; i < 4; i++) (void)random_next(&s);
    return s;
}

/* ---- four points ---- */

/* The eight unknowns of H (h33 = 1) by elimination with pivots. */
static bool solve_8(double a[8][9], double x[8])
{
    for (int c = 0; c < 8; c++) {
        int best = c;
        for (int r = c + 1; r < 8; r++) {
            if (fabs(a[r][c]) > fabs(a[best][c])) best = r;
        }
        if (!(fabs(a[best][c]) > 1e-9)) return false;
        for (int k = c; k < 9; k++) {
            const double swap = a[c][k];
            a[c][k] = a[best][k];
            a[best][k] = swap;
        }
        for (int r = 0; r < 8; r++) {
            if (r == c) continue;
            const double f = a[r][c] / a[c][c];
            for (int k = c; k < 9; k++) a[r][k] -= f * a[c][k];
        }
    }
    for (int r = 0; r < 8; r++) x[r] = a[r][8] / a[r][r];
    return true;
}

/* Positions of a match, left and right, about the middle of all and in units
 * of the image width: keeps the equations well conditioned. */
typedef struct scaled_match {
    double x, y, x2, y2;
} scaled_match_t;

static bool four_points(const scaled_match_t m[4], double H[9])
{
    double a[8][9];
    for (int i = 0; i < 4; i++) {
        const double top[9] = {m[i].x, m[i].y, 1, 0, 0, 0, -m[i].x2 * m[i].x, -m[i].x2 * m[i].y, m[i].x2};
        const double low[9] = {0, 0, 0, m[i].x, m[i].y, 1, -m[i].y2 * m[i].x, -m[i].y2 * m[i].y, m[i].y2};
        memcpy(a[2 * i], top, sizeof top);
        memcpy(a[2 * i + 1], low, sizeof low);
    }
    if (!solve_8(a, H)) return false;
    H[8] = 1.0;
    return true;
}

/* ---- counting ---- */

static double transfer_error(const double H[9], double x, double y, double x2, double y2)
{
    double u, v;
    if (oc_homography_apply(H, x, y, &u, &v) == 0.0) return (double)INFINITY;
    return hypot(u - x2, v - y2);
}

static const oc_junction_t *left_of(const oc_ground_view_t *view, const oc_ground_match_t *m)
{
    return &view->junctions[m->left];
}

/* Marks the matches whose transfer error is within t both ways. */
static uint32_t mark_inliers(oc_ground_ws_t *ws, const oc_ground_view_t *view, const oc_ground_view_t *ref,
                             const ground_pair_t *pair, double t_px, double *rms_px)
{
    uint32_t n = 0;
    double sum = 0.0;
    for (uint32_t i = 0; i < ws->n_matches; i++) {
        const oc_junction_t *a = left_of(view, &ws->matches[i]);
        const oc_junction_t *b = &ref->junctions[ws->matches[i].right];
        const double there =
            transfer_error(pair->H, (double)a->x_px, (double)a->y_px, (double)b->x_px, (double)b->y_px);
        const double back =
            transfer_error(pair->H_inv, (double)b->x_px, (double)b->y_px, (double)a->x_px, (double)a->y_px);
        ws->is_inlier[i] = there <= t_px && back <= t_px;
        if (!ws->is_inlier[i]) continue;
        n++;
        sum += there * there;
    }
    *rms_px = n == 0 ? 0.0 : sqrt(sum / n);
    return n;
}

/* ---- moving the poses inside their margins ---- */

/* Turn by a small vector in the camera's own axes. */
static void turn(const double w[3], const double R[9], double out[9])
{
    const double angle = oc_vec3_norm(w);
    double K[9], K2[9], E[9];
    oc_mat3_skew(w, K);
    oc_mat3_mul(K, K, K2);
    const double a = angle < 1e-8 ? 1.0 : sin(angle) / angle;
    const double b = angle < 1e-8 ? 0.5 : (1.0 - cos(angle)) / (angle * angle);
    oc_mat3_identity(E);
    for (int i = 0; i < 9; i++) E[i] += a * K[i] + b * K2[i];
    oc_mat3_mul(E, R, out);
}

static void camera_move(const oc_camera_t *camera, const oc_margin_t *margin, const double u[6], oc_camera_t *out)
{
    const double per_sd = 1.0 / sqrt(3.0); /* sd of a uniform error of half-width 1 */
    double centre[3], w[3], R[9];
    oc_pose_centre(&camera->pose, centre);
    for (int i = 0; i < 3; i++) {
        centre[i] += per_sd * margin->v[i] * u[i];
        w[i] = per_sd * margin->v[3 + i] * u[3 + i];
    }
    turn(w, camera->pose.R, R);
    *out = *camera;
    oc_pose_from_centre(R, centre, &out->pose);
}

/* Homography of the cameras of the two views moved by u. */
static bool moved_homography(const oc_ground_view_t *view, const oc_ground_view_t *ref, const double u[GROUND_PARAMS],
                             double H[9])
{
    oc_camera_t left, right;
    camera_move(&view->camera, &view->margin, u, &left);
    camera_move(&ref->camera, &ref->margin, u + 6, &right);
    return oc_plane_ground_homography(&left, &right, H) == OC_OK;
}

static bool pair_linearise(ground_pair_t *pair, const oc_ground_view_t *view, const oc_ground_view_t *ref)
{
    const double step = 0.5;
    camera_move(&view->camera, &view->margin, pair->u, &pair->left);
    camera_move(&ref->camera, &ref->margin, pair->u + 6, &pair->right);
    if (oc_plane_ground_homography(&pair->left, &pair->right, pair->H) != OC_OK) return false;
    if (oc_plane_ground_homography(&pair->right, &pair->left, pair->H_inv) != OC_OK) return false;
    for (int k = 0; k < GROUND_PARAMS; k++) {
        double u[GROUND_PARAMS], ahead[9], behind[9];
        memcpy(u, pair->u, sizeof u);
        u[k] = pair->u[k] + step;
        if (!moved_homography(view, ref, u, ahead)) return false;
        u[k] = pair->u[k] - step;
        if (!moved_homography(view, ref, u, behind)) return false;
        for (int i = 0; i < 9; i++) pair->dH[k][i] = (ahead[i] - behind[i]) / (2.0 * step);
    }
    return true;
}

/* Transfer of (x, y) and its derivatives by u: J[k] = d (x2, y2) / d u_k. */
static bool transfer_jacobian(const ground_pair_t *pair, double x, double y, double to[2], double J[GROUND_PARAMS][2])
{
    const double w = oc_homography_apply(pair->H, x, y, &to[0], &to[1]);
    if (w == 0.0) return false;
    for (int k = 0; k < GROUND_PARAMS; k++) {
        double d[3];
        oc_mat3_mul_point(pair->dH[k], x, y, d);
        J[k][0] = (d[0] - to[0] * d[2]) / w;
        J[k][1] = (d[1] - to[1] * d[2]) / w;
    }
    return true;
}

/* Inverse of a positive definite matrix through its Cholesky factor. */
static bool invert_spd(double a[GROUND_PARAMS][GROUND_PARAMS], double inv[GROUND_PARAMS][GROUND_PARAMS])
{
    for (int j = 0; j < GROUND_PARAMS; j++) {
        for (int i = j; i < GROUND_PARAMS; i++) {
            double s = a[i][j];
            for (int k = 0; k < j; k++) s -= a[i][k] * a[j][k];
            if (i == j) {
                if (!(s > 0.0)) return false;
                a[j][j] = sqrt(s);
            } else {
                a[i][j] = s / a[j][j];
            }
        }
    }
    for (int c = 0; c < GROUND_PARAMS; c++) {
        double y[GROUND_PARAMS];
        for (int i = 0; i < GROUND_PARAMS; i++) {
            double s = i == c ? 1.0 : 0.0;
            for (int k = 0; k < i; k++) s -= a[i][k] * y[k];
            y[i] = s / a[i][i];
        }
        for (int i = GROUND_PARAMS - 1; i >= 0; i--) {
            double s = y[i];
            for (int k = i + 1; k < GROUND_PARAMS; k++) s -= a[k][i] * inv[k][c];
            inv[i][c] = s / a[i][i];
        }
    }
    return true;
}

/* Normal equations of the inliers' transfer errors (Cauchy weights) and of the
 * prior u ~ N(0, 1). */
static void fit_accumulate(const oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                           const oc_ground_view_t *ref, const ground_pair_t *pair,
                           double A[GROUND_PARAMS][GROUND_PARAMS], double b[GROUND_PARAMS])
{
    memset(A, 0, sizeof(double[GROUND_PARAMS][GROUND_PARAMS]));
    for (int k = 0; k < GROUND_PARAMS; k++) {
        A[k][k] = 1.0;
        b[k] = -pair->u[k];
    }
    for (uint32_t i = 0; i < ws->n_matches; i++) {
        if (!ws->is_inlier[i]) continue;
        const oc_junction_t *l = left_of(view, &ws->matches[i]);
        const oc_junction_t *r = &ref->junctions[ws->matches[i].right];
        double to[2], J[GROUND_PARAMS][2], D[4];
        if (!transfer_jacobian(pair, (double)l->x_px, (double)l->y_px, to, J)) continue;
        if (oc_homography_jacobian(pair->H, (double)l->x_px, (double)l->y_px, D) != OC_OK) continue;
        /* The left junction's error arrives magnified by D; its area stands for both axes. */
        const double variance = params->sigma_px * params->sigma_px * (1.0 + fabs(D[0] * D[3] - D[1] * D[2]));
        const double ex = (double)r->x_px - to[0], ey = (double)r->y_px - to[1];
        const double weight = 1.0 / (variance * (1.0 + (ex * ex + ey * ey) / (4.0 * variance)));
        for (int p = 0; p < GROUND_PARAMS; p++) {
            b[p] += weight * (J[p][0] * ex + J[p][1] * ey);
            for (int q = 0; q <= p; q++) A[p][q] += weight * (J[p][0] * J[q][0] + J[p][1] * J[q][1]);
        }
    }
    for (int p = 0; p < GROUND_PARAMS; p++) {
        for (int q = 0; q < p; q++) A[q][p] = A[p][q];
    }
}

/* Refit the pair to the marked inliers, from the poses as given. */
static bool pair_fit(ground_pair_t *pair, const oc_ground_ws_t *ws, const oc_ground_params_t *params,
                     const oc_ground_view_t *view, const oc_ground_view_t *ref)
{
    for (int round = 0; round < FIT_ROUNDS; round++) {
        double A[GROUND_PARAMS][GROUND_PARAMS], b[GROUND_PARAMS];
        if (!pair_linearise(pair, view, ref)) return false;
        fit_accumulate(ws, params, view, ref, pair, A, b);
        if (!invert_spd(A, pair->cov)) return false;
        for (int p = 0; p < GROUND_PARAMS; p++) {
            double step = 0.0;
            for (int q = 0; q < GROUND_PARAMS; q++) step += pair->cov[p][q] * b[q];
            if (!(fabs(step) < 1e3)) return false;
            pair->u[p] += step;
        }
    }
    return pair_linearise(pair, view, ref);
}

static double prior_chi2(const ground_pair_t *pair)
{
    double sum = 0.0;
    for (int k = 0; k < GROUND_PARAMS; k++) sum += pair->u[k] * pair->u[k];
    return sum;
}

/* ---- sampling ---- */

typedef struct ransac_frame {
    double middle[4]; /* x, y, x2, y2 */
    double scale;
} ransac_frame_t;

static void ransac_scale(oc_ground_ws_t *ws, const oc_ground_view_t *view, const oc_ground_view_t *ref,
                         ransac_frame_t *frame)
{
    const double n = ws->n_matches;
    memset(frame->middle, 0, sizeof frame->middle);
    for (uint32_t i = 0; i < ws->n_matches; i++) {
        const oc_junction_t *l = left_of(view, &ws->matches[i]);
        const oc_junction_t *r = &ref->junctions[ws->matches[i].right];
        const double v[4] = {(double)l->x_px, (double)l->y_px, (double)r->x_px, (double)r->y_px};
        for (int k = 0; k < 4; k++) frame->middle[k] += v[k] / n;
    }
    frame->scale = 1.0 / view->grey.width_px;
    for (uint32_t i = 0; i < ws->n_matches; i++) {
        const oc_junction_t *l = left_of(view, &ws->matches[i]);
        const oc_junction_t *r = &ref->junctions[ws->matches[i].right];
        const double v[4] = {(double)l->x_px, (double)l->y_px, (double)r->x_px, (double)r->y_px};
        for (int k = 0; k < 4; k++)
            ws->design[4u * i + (uint32_t)k] = (float)((v[k] - frame->middle[k]) * frame->scale);
    }
}

/* Four different matches, no three of the left points near a line. */
static bool ransac_sample(const oc_ground_ws_t *ws, uint32_t *state, scaled_match_t sample[4])
{
    uint32_t index[4];
    for (uint32_t k = 0; k < 4; k++) {
        index[k] = random_next(state) % ws->n_matches;
        for (uint32_t j = 0; j < k; j++) {
            if (index[j] == index[k]) return false;
        }
        const float *d = &ws->design[4 * index[k]];
        sample[k] = (scaled_match_t){(double)d[0], (double)d[1], (double)d[2], (double)d[3]};
    }
    for (int skip = 0; skip < 4; skip++) {
        const scaled_match_t *a = &sample[(skip + 1) % 4], *b = &sample[(skip + 2) % 4], *c = &sample[(skip + 3) % 4];
        const double area = (b->x - a->x) * (c->y - a->y) - (c->x - a->x) * (b->y - a->y);
        if (fabs(area) < 1e-3) return false;
    }
    return true;
}

/* Matches that a homography in scaled coordinates explains both ways. */
static uint32_t ransac_count(const oc_ground_ws_t *ws, const double H[9], double t)
{
    double inverse[9];
    if (oc_mat3_inverse(H, inverse) != OC_OK) return 0;
    uint32_t n = 0;
    for (uint32_t i = 0; i < ws->n_matches; i++) {
        const float *d = &ws->design[4 * i];
        n += transfer_error(H, (double)d[0], (double)d[1], (double)d[2], (double)d[3]) <= t &&
             transfer_error(inverse, (double)d[2], (double)d[3], (double)d[0], (double)d[1]) <= t;
    }
    return n;
}

/* Rounds after which a better sample is unlikely (1 %) to have been missed. */
static uint32_t ransac_enough(uint32_t n_inliers, uint32_t n, uint32_t limit)
{
    const double share = (double)n_inliers / n;
    const double good = share * share * share * share;
    if (good > 0.999) return 1;
    if (good < 1e-6) return limit;
    const double rounds = ceil(log(0.01) / log(1.0 - good));
    return rounds < (double)limit ? (uint32_t)rounds : limit;
}

/* Best homography from four matches, scaled coordinates. Returns its inliers. */
static uint32_t ransac_run(const oc_ground_ws_t *ws, const oc_ground_params_t *params, uint32_t seed, double t,
                           double best_H[9])
{
    uint32_t state = seed, best = 0, limit = params->ransac_rounds;
    for (uint32_t round = 0; round < limit; round++) {
        scaled_match_t sample[4];
        double H[9];
        if (!ransac_sample(ws, &state, sample) || !four_points(sample, H)) continue;
        const uint32_t n = ransac_count(ws, H, t);
        if (n <= best) continue;
        best = n;
        memcpy(best_H, H, 9 * sizeof *H);
        limit = ransac_enough(n, ws->n_matches, params->ransac_rounds);
        if (limit < round + 1) limit = round + 1;
    }
    return best;
}

static void ransac_mark(oc_ground_ws_t *ws, const double H[9], double t)
{
    double inverse[9];
    const bool has_inverse = oc_mat3_inverse(H, inverse) == OC_OK;
    for (uint32_t i = 0; i < ws->n_matches; i++) {
        const float *d = &ws->design[4 * i];
        ws->is_inlier[i] = has_inverse &&
                           transfer_error(H, (double)d[0], (double)d[1], (double)d[2], (double)d[3]) <= t &&
                           transfer_error(inverse, (double)d[2], (double)d[3], (double)d[0], (double)d[1]) <= t;
    }
}

/* ---- all of it ---- */

/* Fit to the marked matches, mark anew, fit again, and hold the result against
 * the margins. */
static bool settle(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                   const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *result)
{
    uint32_t n = 0;
    double rms_px = 0.0;
    for (int pass = 0; pass < 2; pass++) {
        if (!pair_fit(pair, ws, params, view, reference)) return false;
        n = mark_inliers(ws, view, reference, pair, (double)params->t_transfer_px, &rms_px);
        if (n < params->min_inliers) return false;
    }
    /* The poses' own margins are the check on what RANSAC has found: a plane
     * that is not the ground pulls them out. */
    if (!(prior_chi2(pair) <= MAX_PRIOR_CHI2)) return false;

    result->n_inliers = n;
    result->rms_px = rms_px;
    const double scale = fabs(pair->H[8]) > 1e-12 ? 1.0 / pair->H[8] : 1.0;
    for (int i = 0; i < 9; i++) result->ref_from_view[i] = pair->H[i] * scale;
    return true;
}

void oc_ground_refine(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                      const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *result)
{
    if (ws->n_matches < params->min_inliers || ws->n_matches < 4) return;

    ransac_frame_t frame;
    ransac_scale(ws, view, reference, &frame);
    double H[9];
    /* Four noisy points miss others by more than a fit does: half as much again. */
    const double t = 1.5 * (double)params->t_transfer_px * frame.scale;
    const uint32_t found = ransac_run(ws, params, random_seed(view->view, reference->view), t, H);
    if (found < params->min_inliers) return;
    ransac_mark(ws, H, t);

    memset(pair, 0, sizeof *pair);
    result->is_refined = settle(ws, params, view, reference, pair, result);
}

bool oc_ground_refit(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                     const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *result)
{
    double rms_px;
    if (mark_inliers(ws, view, reference, pair, (double)params->t_transfer_px, &rms_px) < params->min_inliers) {
        return false;
    }
    ground_pair_t again = *pair;
    if (!settle(ws, params, view, reference, &again, result)) return false;
    *pair = again;
    return true;
}

bool oc_ground_transfer_covariance(const ground_pair_t *pair, double x_px, double y_px, double cov_px2[3])
{
    double to[2], J[GROUND_PARAMS][2];
    if (!transfer_jacobian(pair, x_px, y_px, to, J)) return false;
    cov_px2[0] = cov_px2[1] = cov_px2[2] = 0.0;
    for (int p = 0; p < GROUND_PARAMS; p++) {
        double sx = 0.0, sy = 0.0;
        for (int q = 0; q < GROUND_PARAMS; q++) {
            sx += pair->cov[p][q] * J[q][0];
            sy += pair->cov[p][q] * J[q][1];
        }
        cov_px2[0] += J[p][0] * sx;
        cov_px2[1] += J[p][0] * sy;
        cov_px2[2] += J[p][1] * sy;
    }
    return true;
}

oc_status_t oc_ground_rise(const ground_pair_t *pair, double x_px, double y_px, double z_m, double rise_px[2])
{
    const oc_plane_t lifted = {.n = {0.0, 0.0, 1.0}, .d_m = -z_m};
    double H[9], x0, y0, x1, y1;
    if (oc_plane_homography(&pair->left, &pair->right, &lifted, H, NULL) != OC_OK) return OC_E_DEGENERATE;
    if (!(oc_homography_apply(pair->H, x_px, y_px, &x0, &y0) > 0.0)) return OC_E_DEGENERATE;
    if (!(oc_homography_apply(H, x_px, y_px, &x1, &y1) > 0.0)) return OC_E_DEGENERATE;
    rise_px[0] = x1 - x0;
    rise_px[1] = y1 - y0;
    return OC_OK;
}
