/* SPDX-License-Identifier: BSD-3-Clause
 * The refined ground homography of a pair: both poses moved inside their margins.
 *
 * A free homography fitted to matches in one corner of the image is wild in the
 * others. RANSAC only picks the matches; what is kept is the homography of
 * two cameras that stay where their margins allow, so that it extrapolates as well
 * as the poses do, and its covariance says where it is good. */
#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "core/mat3.h"
#include "core/plane.h"
#include "vehicle/ground_internal.h"

/* Sum of squared moves, in standard deviations. Twelve uniform errors exceed it
 * once in 50 000 pairs, and the fit shrinks what they were. */
#define MAX_PRIOR_CHI2 25.0

/* Rounds of relinearisation; the third changes nothing visible. */
#define FIT_ROUNDS 4

/* ---- counting ---- */

static double transfer_error(const double H[9], double x, double y, double x2, double y2)
{
    double u, v;
    if (oc_homography_apply(H, x, y, &u, &v) == 0.0) return (double)INFINITY;
    return hypot(u - x2, v - y2);
}

/* Marks the pins whose transfer error is within t both ways. */
static uint32_t mark_inliers(oc_ground_ws_t *ws, const ground_pair_t *pair, double t_px, double *rms_px)
{
    uint32_t n = 0;
    double sum = 0.0;
    for (uint32_t i = 0; i < ws->n_pins; i++) {
        const oc_ground_pin_t *p = &ws->pins[i];
        const double x = (double)p->x_px, y = (double)p->y_px, x2 = (double)p->x2_px, y2 = (double)p->y2_px;
        const double there = transfer_error(pair->H, x, y, x2, y2), back = transfer_error(pair->H_inv, x2, y2, x, y);
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
static void fit_accumulate(const oc_ground_ws_t *ws, const ground_pair_t *pair, double A[GROUND_PARAMS][GROUND_PARAMS],
                           double b[GROUND_PARAMS])
{
    memset(A, 0, sizeof(double[GROUND_PARAMS][GROUND_PARAMS]));
    for (int k = 0; k < GROUND_PARAMS; k++) {
        A[k][k] = 1.0;
        b[k] = -pair->u[k];
    }
    for (uint32_t i = 0; i < ws->n_pins; i++) {
        if (!ws->is_inlier[i]) continue;
        const oc_ground_pin_t *pin = &ws->pins[i];
        double to[2], J[GROUND_PARAMS][2];
        if (!transfer_jacobian(pair, (double)pin->x_px, (double)pin->y_px, to, J)) continue;
        const double variance = (double)pin->variance_px2;
        const double ex = (double)pin->x2_px - to[0], ey = (double)pin->y2_px - to[1];
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
static bool pair_fit(ground_pair_t *pair, const oc_ground_ws_t *ws, const oc_ground_view_t *view,
                     const oc_ground_view_t *ref)
{
    for (int round = 0; round < FIT_ROUNDS; round++) {
        double A[GROUND_PARAMS][GROUND_PARAMS], b[GROUND_PARAMS];
        if (!pair_linearise(pair, view, ref)) return false;
        fit_accumulate(ws, pair, A, b);
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

/* ---- all of it ---- */

/* Fit to the marked pins, mark anew, fit again, and hold the result against
 * the margins. */
static bool settle(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                   const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *result)
{
    uint32_t n = 0;
    double rms_px = 0.0;
    for (int pass = 0; pass < 2; pass++) {
        if (!pair_fit(pair, ws, view, reference)) return false;
        n = mark_inliers(ws, pair, (double)params->t_transfer_px, &rms_px);
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

bool oc_ground_fit(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                   const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *result)
{
    if (oc_ground_ransac(ws, params, view, reference) < params->min_inliers) return false;
    memset(pair, 0, sizeof *pair);
    return settle(ws, params, view, reference, pair, result);
}

bool oc_ground_refit(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                     const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *result)
{
    double rms_px;
    if (mark_inliers(ws, pair, (double)params->t_transfer_px, &rms_px) < params->min_inliers) return false;
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
