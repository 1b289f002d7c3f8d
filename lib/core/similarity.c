/* SPDX-License-Identifier: BSD-3-Clause
 * The map: metres to pixels of the overhead view, and angles along a path.
 */
#include "core/similarity.h"

#include <math.h>
#include <string.h>

#include "core/mat3.h"

static const double full_turn = 6.283185307179586476925;

/* ---- the similarity ---- */

oc_status_t oc_similarity_from_points(double x0_px, double y0_px, double x1_px, double y1_px, double d_m,
                                      oc_similarity_t *map_from_world)
{
    OC_ASSERT(map_from_world);

    const double length = hypot(x1_px - x0_px, y1_px - y0_px);
    if (!isfinite(length) || !isfinite(d_m) || !(d_m > 0.0)) return OC_E_ARG;
    if (!(length > 0.0)) return OC_E_DEGENERATE;
    const oc_similarity_t out = {
        .scale_px_per_m = length / d_m, .theta_rad = atan2(y1_px - y0_px, x1_px - x0_px), .t_px = {x0_px, y0_px}};
    *map_from_world = out;
    return OC_OK;
}

void oc_similarity_matrix(const oc_similarity_t *map_from_world, double S[9])
{
    OC_ASSERT(map_from_world && S);

    const double c = map_from_world->scale_px_per_m * cos(map_from_world->theta_rad);
    const double s = map_from_world->scale_px_per_m * sin(map_from_world->theta_rad);
    const double m[9] = {c, -s, map_from_world->t_px[0], s, c, map_from_world->t_px[1], 0, 0, 1};
    memcpy(S, m, sizeof m);
}

void oc_similarity_apply(const oc_similarity_t *map_from_world, const double p_in_world[3], double p_in_map[3])
{
    OC_ASSERT(map_from_world && p_in_world && p_in_map);

    double S[9];
    oc_similarity_matrix(map_from_world, S);
    const double x = S[0] * p_in_world[0] + S[1] * p_in_world[1] + S[2];
    const double y = S[3] * p_in_world[0] + S[4] * p_in_world[1] + S[5];
    const double z = map_from_world->scale_px_per_m * p_in_world[2];
    p_in_map[0] = x;
    p_in_map[1] = y;
    p_in_map[2] = z;
}

void oc_similarity_invert(const oc_similarity_t *map_from_world, const double p_in_map[3], double p_in_world[3])
{
    OC_ASSERT(map_from_world && p_in_map && p_in_world);

    const double s = map_from_world->scale_px_per_m;
    const double c = cos(map_from_world->theta_rad), n = sin(map_from_world->theta_rad);
    const double x = (p_in_map[0] - map_from_world->t_px[0]) / s;
    const double y = (p_in_map[1] - map_from_world->t_px[1]) / s;
    const double z = p_in_map[2] / s;
    p_in_world[0] = c * x + n * y;
    p_in_world[1] = c * y - n * x;
    p_in_world[2] = z;
}

/* X' = s Q X + t turns the world by Q = R_z(theta), so the camera's rotation
 * becomes R Q^T. */
void oc_similarity_camera(const oc_similarity_t *map_from_world, const oc_camera_t *camera, oc_camera_t *in_map)
{
    OC_ASSERT(map_from_world && camera && in_map);

    const double c = cos(map_from_world->theta_rad), s = sin(map_from_world->theta_rad);
    const double Qt[9] = {c, s, 0, -s, c, 0, 0, 0, 1};
    double centre[3], R[9];
    oc_pose_centre(&camera->pose, centre);
    oc_similarity_apply(map_from_world, centre, centre);
    oc_mat3_mul(camera->pose.R, Qt, R);
    in_map->k = camera->k;
    oc_pose_from_centre(R, centre, &in_map->pose);
}

/* ---- angles ---- */

double oc_angle_wrap(double angle_rad)
{
    const double a = fmod(angle_rad, full_turn);
    if (a >= 0.0) return a;
    /* A tiny negative angle rounds up to the full turn, which is 0. */
    return a + full_turn >= full_turn ? 0.0 : a + full_turn;
}

double oc_angle_distance(double a_rad, double b_rad)
{
    const double d = oc_angle_wrap(a_rad - b_rad);
    return fmin(d, full_turn - d);
}

double oc_angle_interpolate(double a_rad, double b_rad, double t)
{
    const double up = oc_angle_wrap(b_rad - a_rad);
    const double shorter = up > full_turn / 2.0 ? up - full_turn : up;
    return oc_angle_wrap(a_rad + t * shorter);
}

double oc_pan_in_map(double pan_rad, double theta_rad)
{
    return oc_angle_wrap(pan_rad - theta_rad);
}

double oc_pan_from_motion(double dx, double dy)
{
    return oc_angle_wrap(atan2(dx, dy));
}

uint32_t oc_pan_nearest(double pan_rad, const double pans_rad[], uint32_t n)
{
    OC_ASSERT(pans_rad && n >= 1);

    uint32_t best = 0;
    for (uint32_t i = 1; i < n; i++) {
        if (oc_angle_distance(pan_rad, pans_rad[i]) < oc_angle_distance(pan_rad, pans_rad[best])) best = i;
    }
    return best;
}

void oc_swing_removal(const oc_intrinsics_t *k, double swing_rad, double H[9])
{
    OC_ASSERT(k && H);

    /* F R_swing^T F in normalised coordinates, between K and K^-1. */
    const double c = cos(swing_rad), s = sin(swing_rad);
    const double turn[9] = {c, s, 0, -s, c, 0, 0, 0, 1};
    const double K[9] = {k->fx_px, 0, k->cx_px, 0, k->fy_px, k->cy_px, 0, 0, 1};
    const double K_inv[9] = {1 / k->fx_px, 0, -k->cx_px / k->fx_px, 0, 1 / k->fy_px, -k->cy_px / k->fy_px, 0, 0, 1};
    double m[9];
    oc_mat3_mul(turn, K_inv, m);
    oc_mat3_mul(K, m, H);
}
