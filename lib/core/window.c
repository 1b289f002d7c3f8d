/* SPDX-License-Identifier: BSD-3-Clause
 * Covariance windows of ground junctions and covariance strips of all others.
 */
#include "core/window.h"

#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "core/mat3.h"

/* ---- windows ---- */

/* p = H m and its change with each parameter, with H's Jacobian. */
typedef struct transfer {
    double p[3];
    double dp[OC_PAIR_PARAMS][3];
    double J[4];
} transfer_t;

/* Covariance of p[0]/p[2], p[1]/p[2] by the quotient rule. */
static oc_status_t window_from_transfer(const transfer_t *t, double sigma_px, oc_window_t *window)
{
    const double x = t->p[0] / t->p[2];
    const double y = t->p[1] / t->p[2];
    const double *J = t->J;
    const double s2 = sigma_px * sigma_px;
    double xx = s2 * (1.0 + J[0] * J[0] + J[1] * J[1]);
    double xy = s2 * (J[0] * J[2] + J[1] * J[3]);
    double yy = s2 * (1.0 + J[2] * J[2] + J[3] * J[3]);
    for (int i = 0; i < OC_PAIR_PARAMS; i++) {
        const double dx = (t->dp[i][0] - x * t->dp[i][2]) / t->p[2];
        const double dy = (t->dp[i][1] - y * t->dp[i][2]) / t->p[2];
        xx += dx * dx;
        xy += dx * dy;
        yy += dy * dy;
    }
    const double det = xx * yy - xy * xy;
    if (!(det > 0.0) || !isfinite(det)) return OC_E_DEGENERATE;

    const oc_window_t out = {.x_px = x, .y_px = y, .cov_px2 = {xx, xy, yy}, .info = {yy / det, -xy / det, xx / det}};
    *window = out;
    return OC_OK;
}

oc_status_t oc_window_ground(const oc_pair_t *pair, double x_px, double y_px, oc_window_t *window)
{
    OC_ASSERT(pair && window);

    if (!isfinite(x_px) || !isfinite(y_px)) return OC_E_ARG;
    const double *down = pair->left_ray + 6;
    const double inverse_depth = -(down[0] * x_px + down[1] * y_px + down[2]) / pair->left_height_m;
    if (!(inverse_depth > 0.0)) return OC_E_DEGENERATE;

    transfer_t t;
    oc_mat3_mul_point(pair->H, x_px, y_px, t.p);
    if (!(t.p[2] > 0.0)) return OC_E_DEGENERATE;
    if (oc_homography_jacobian(pair->H, x_px, y_px, t.J) != OC_OK) return OC_E_DEGENERATE;
    for (int i = 0; i < OC_PAIR_PARAMS; i++) oc_mat3_mul_point(pair->dH[i], x_px, y_px, t.dp[i]);
    return window_from_transfer(&t, pair->sigma_px, window);
}

oc_status_t oc_window_at_height(const oc_pair_t *pair, double x_px, double y_px, double z_m, oc_window_t *window)
{
    OC_ASSERT(pair && window);

    if (!isfinite(x_px) || !isfinite(y_px) || !isfinite(z_m)) return OC_E_ARG;
    const double above = pair->left_height_m - z_m;
    if (!(fabs(above) > 1e-9 * (fabs(pair->left_height_m) + fabs(z_m)))) return OC_E_DEGENERATE;
    const double *down = pair->left_ray + 6;
    if (!(-(down[0] * x_px + down[1] * y_px + down[2]) / above > 0.0)) return OC_E_DEGENERATE;

    transfer_t t;
    double H[9], Bm[3];
    for (int i = 0; i < 9; i++) H[i] = pair->H_inf[i] - pair->B[i] / above;
    oc_mat3_mul_point(H, x_px, y_px, t.p);
    if (!(t.p[2] > 0.0)) return OC_E_DEGENERATE;
    if (oc_homography_jacobian(H, x_px, y_px, t.J) != OC_OK) return OC_E_DEGENERATE;

    oc_mat3_mul_point(pair->B, x_px, y_px, Bm);
    for (int i = 0; i < OC_PAIR_PARAMS; i++) {
        double d_inf[3], dB[3];
        oc_mat3_mul_point(pair->dH_inf[i], x_px, y_px, d_inf);
        oc_mat3_mul_point(pair->dB[i], x_px, y_px, dB);
        const double d_above = pair->d_left_height_m[i] / (above * above);
        for (int r = 0; r < 3; r++) t.dp[i][r] = d_inf[r] - dB[r] / above + Bm[r] * d_above;
    }
    return window_from_transfer(&t, pair->sigma_px, window);
}

void oc_window_half_sides(const oc_window_t *window, double *half_x_px, double *half_y_px)
{
    OC_ASSERT(window && half_x_px && half_y_px);

    *half_x_px = sqrt(OC_WINDOW_MAX_D2 * window->cov_px2[0]);
    *half_y_px = sqrt(OC_WINDOW_MAX_D2 * window->cov_px2[2]);
}

double oc_window_area_px2(const oc_window_t *window)
{
    OC_ASSERT(window);

    const double pi = 3.14159265358979323846;
    const double *c = window->cov_px2;
    return pi * OC_WINDOW_MAX_D2 * sqrt(c[0] * c[2] - c[1] * c[1]);
}

/* ---- strips ---- */

/* q += a a^T with a the change of l / |(l_x, l_y)| for a change dl of l. */
static void strip_accumulate(const double line[3], double normal, const double dl[3], double q[6])
{
    /* line is scaled already, so the change along the normal only shortens it. */
    const double shorten = (line[0] * dl[0] + line[1] * dl[1]) / normal;
    double a[3];
    for (int i = 0; i < 3; i++) a[i] = dl[i] / normal - line[i] * shorten;
    q[0] += a[0] * a[0];
    q[1] += a[0] * a[1];
    q[2] += a[0] * a[2];
    q[3] += a[1] * a[1];
    q[4] += a[1] * a[2];
    q[5] += a[2] * a[2];
}

oc_status_t oc_strip_prepare(const oc_pair_t *pair, double x_px, double y_px, oc_strip_t *strip)
{
    OC_ASSERT(pair && strip);

    if (!isfinite(x_px) || !isfinite(y_px)) return OC_E_ARG;
    double l[3];
    oc_mat3_mul_point(pair->F, x_px, y_px, l);
    const double normal = hypot(l[0], l[1]);
    /* A pixel of left position changes l by a column of F. */
    const double per_px = hypot(hypot(pair->F[0], pair->F[3]), hypot(pair->F[1], pair->F[4]));
    if (!(normal > 1e-6 * per_px)) return OC_E_DEGENERATE;

    oc_strip_t out = {.sigma_px = pair->sigma_px};
    for (int i = 0; i < 3; i++) out.line[i] = l[i] / normal;
    for (int i = 0; i < OC_PAIR_PARAMS; i++) {
        double dl[3];
        oc_mat3_mul_point(pair->dF[i], x_px, y_px, dl);
        strip_accumulate(out.line, normal, dl, out.q);
    }
    for (int c = 0; c < 2; c++) {
        const double s = pair->sigma_px;
        const double dl[3] = {s * pair->F[c], s * pair->F[3 + c], s * pair->F[6 + c]};
        strip_accumulate(out.line, normal, dl, out.q);
    }
    *strip = out;
    return OC_OK;
}

/* ---- segments ---- */

/* Depths of the left ray that are still possible. */
typedef struct interval {
    double near_m, far_m;
} interval_t;

/* Keep the depths where offset + slope * depth >= 0. */
static void interval_clip(interval_t *depth, double offset, double slope)
{
    if (slope > 0.0) depth->near_m = fmax(depth->near_m, -offset / slope);
    if (slope < 0.0) depth->far_m = fmin(depth->far_m, -offset / slope);
    if (!(fabs(slope) > 0.0) && offset < 0.0) depth->far_m = -1.0;
}

/* Slack along the unit vector `along` of an end at height z. */
static double end_slack_px(const oc_pair_t *pair, double x_px, double y_px, double z_m, const double along[2])
{
    oc_window_t w;
    if (oc_window_at_height(pair, x_px, y_px, z_m, &w) != OC_OK) return 0.0;
    const double *c = w.cov_px2;
    const double variance = along[0] * (along[0] * c[0] + 2.0 * along[1] * c[1]) + along[1] * along[1] * c[2];
    return OC_STRIP_MAX_SIGMA * sqrt(variance);
}

static bool reach_is_valid(const oc_reach_t *reach)
{
    if (!isfinite(reach->z_min_m) || !isfinite(reach->z_max_m) || !isfinite(reach->depth_max_m)) return false;
    return reach->z_min_m < reach->z_max_m && reach->depth_min_m > 0.0 && reach->depth_min_m < reach->depth_max_m;
}

/* Where depth along the left ray is seen in the right view. */
static void ray_image(const oc_pair_t *pair, const double per_depth[3], double depth_m, double px[2])
{
    const double w = pair->e_right[2] + depth_m * per_depth[2];
    for (int i = 0; i < 2; i++) px[i] = (pair->e_right[i] + depth_m * per_depth[i]) / w;
}

oc_status_t oc_strip_segment(const oc_pair_t *pair, double x_px, double y_px, const oc_reach_t *reach,
                             oc_segment_t *segment)
{
    OC_ASSERT(pair && reach && segment);

    if (!isfinite(x_px) || !isfinite(y_px) || !reach_is_valid(reach)) return OC_E_ARG;
    double ray[3], per_depth[3];
    oc_mat3_mul_point(pair->left_ray, x_px, y_px, ray);
    oc_mat3_mul_point(pair->H_inf, x_px, y_px, per_depth);

    const double height = pair->left_height_m;
    interval_t depth = {reach->depth_min_m, reach->depth_max_m};
    interval_clip(&depth, pair->e_right[2] - reach->depth_min_m, per_depth[2]);
    const interval_t without_height = depth;
    interval_clip(&depth, height - reach->z_min_m, ray[2]);
    interval_clip(&depth, reach->z_max_m - height, -ray[2]);
    if (!(depth.near_m < depth.far_m)) return OC_E_DEGENERATE;

    const bool near_by_height = depth.near_m > without_height.near_m;
    const bool far_by_height = depth.far_m < without_height.far_m;
    const bool far_is_low = ray[2] <= 0.0;
    oc_segment_t out;
    memset(&out, 0, sizeof out);
    out.low_depth_m = far_is_low ? depth.far_m : depth.near_m;
    out.high_depth_m = far_is_low ? depth.near_m : depth.far_m;
    ray_image(pair, per_depth, out.low_depth_m, out.low_px);
    ray_image(pair, per_depth, out.high_depth_m, out.high_px);

    double along[2] = {out.high_px[0] - out.low_px[0], out.high_px[1] - out.low_px[1]};
    const double length = hypot(along[0], along[1]);
    if (!(length > 1e-9) || !isfinite(length)) return OC_E_DEGENERATE;
    for (int i = 0; i < 2; i++) along[i] /= length;
    if (far_is_low ? far_by_height : near_by_height) {
        out.low_slack_px = end_slack_px(pair, x_px, y_px, reach->z_min_m, along);
    }
    if (far_is_low ? near_by_height : far_by_height) {
        out.high_slack_px = end_slack_px(pair, x_px, y_px, reach->z_max_m, along);
    }
    *segment = out;
    return OC_OK;
}

bool oc_segment_contains(const oc_segment_t *segment, double x_px, double y_px)
{
    OC_ASSERT(segment);

    const double *low = segment->low_px;
    const double ax = segment->high_px[0] - low[0];
    const double ay = segment->high_px[1] - low[1];
    const double length = hypot(ax, ay);
    const double s = ((x_px - low[0]) * ax + (y_px - low[1]) * ay) / length;
    return s >= -segment->low_slack_px && s <= length + segment->high_slack_px;
}
