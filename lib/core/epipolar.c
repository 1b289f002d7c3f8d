/* SPDX-License-Identifier: BSD-3-Clause
 * The fundamental matrix, distances to it, and points from rays.
 */
#include "core/epipolar.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/camera_matrix.h"
#include "core/mat3.h"

/* ---- the fundamental matrix ---- */

oc_status_t oc_epipolar_fundamental(const oc_camera_t *left, const oc_camera_t *right, double F[9])
{
    OC_ASSERT(left && right && F);

    double left_centre[3], right_centre[3], base[3];
    oc_pose_centre(&left->pose, left_centre);
    oc_pose_centre(&right->pose, right_centre);
    oc_vec3_sub(left_centre, right_centre, base);
    const double far = oc_vec3_norm(left_centre) + oc_vec3_norm(right_centre);
    if (!(oc_vec3_normalise(base) > 1e-9 * far)) return OC_E_DEGENERATE;

    double left_ray[9], right_ray[9], product[9];
    oc_camera_M_inverse(left, left_ray);
    oc_camera_M_inverse(right, right_ray);
    oc_mat3_transpose(right_ray, right_ray);
    oc_mat3_skew(base, product);
    oc_mat3_mul(product, left_ray, product);
    oc_mat3_mul(right_ray, product, product);
    const double norm = oc_mat3_norm(product);
    if (!(norm > 0.0) || !isfinite(norm)) return OC_E_DEGENERATE;
    for (int i = 0; i < 9; i++) F[i] = product[i] / norm;
    return OC_OK;
}

/* P (X, 1). */
static void homogeneous_image(const oc_camera_t *camera, const double p_in_world[3], double out[3])
{
    double P[12];
    oc_camera_matrix(camera, P);
    for (int r = 0; r < 3; r++) out[r] = oc_vec3_dot(P + 4 * r, p_in_world) + P[4 * r + 3];
}

void oc_epipolar_epipoles(const oc_camera_t *left, const oc_camera_t *right, double e_left[3], double e_right[3])
{
    OC_ASSERT(left && right && e_left && e_right);

    double left_centre[3], right_centre[3];
    oc_pose_centre(&left->pose, left_centre);
    oc_pose_centre(&right->pose, right_centre);
    homogeneous_image(left, right_centre, e_left);
    homogeneous_image(right, left_centre, e_right);
}

oc_status_t oc_epipolar_line(const double F[9], double x_px, double y_px, double line[3])
{
    OC_ASSERT(F && line);

    double l[3];
    oc_mat3_mul_point(F, x_px, y_px, l);
    const double normal = hypot(l[0], l[1]);
    const double terms = oc_mat3_norm(F) * (fabs(x_px) + fabs(y_px) + 1.0);
    if (!(normal > 1e-15 * terms) || !isfinite(l[2] / normal)) return OC_E_DEGENERATE;
    for (int i = 0; i < 3; i++) line[i] = l[i] / normal;
    return OC_OK;
}

double oc_epipolar_distance_px(const double F[9], double x_px, double y_px, double x2_px, double y2_px)
{
    OC_ASSERT(F);

    double l[3];
    if (oc_epipolar_line(F, x_px, y_px, l) != OC_OK) return (double)NAN;
    return l[0] * x2_px + l[1] * y2_px + l[2];
}

double oc_epipolar_sampson_px(const double F[9], double x_px, double y_px, double x2_px, double y2_px)
{
    OC_ASSERT(F);

    const double right_pixel[3] = {x2_px, y2_px, 1.0};
    double l[3], l_left[3];
    oc_mat3_mul_point(F, x_px, y_px, l);
    oc_mat3_mul_vec_t(F, right_pixel, l_left);
    const double gradient = sqrt(l[0] * l[0] + l[1] * l[1] + l_left[0] * l_left[0] + l_left[1] * l_left[1]);
    if (!(gradient > 0.0)) return (double)NAN;
    return oc_vec3_dot(right_pixel, l) / gradient;
}

/* ---- points from rays ---- */

/* A += I - u u^T, b += (I - u u^T) C. */
static void ray_accumulate(const double centre[3], const double u[3], double A[9], double b[3])
{
    const double along = oc_vec3_dot(centre, u);
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) A[3 * r + c] += (r == c ? 1.0 : 0.0) - u[r] * u[c];
        b[r] += centre[r] - along * u[r];
    }
}

static double point_depth(const oc_camera_t *camera, const double p_in_world[3])
{
    return oc_vec3_dot(camera->pose.R + 6, p_in_world) + camera->pose.t[2];
}

oc_status_t oc_epipolar_midpoint(const oc_camera_t *left, double x_px, double y_px, const oc_camera_t *right,
                                 double x2_px, double y2_px, oc_midpoint_t *out)
{
    OC_ASSERT(left && right && out);

    if (!isfinite(x_px) || !isfinite(y_px) || !isfinite(x2_px) || !isfinite(y2_px)) return OC_E_ARG;

    double C[3], C2[3], u[3], u2[3], n[3], base[3];
    oc_pose_centre(&left->pose, C);
    oc_pose_centre(&right->pose, C2);
    oc_camera_ray(left, x_px, y_px, u);
    oc_camera_ray(right, x2_px, y2_px, u2);
    oc_vec3_cross(u, u2, n);
    const double parallax = atan2(oc_vec3_norm(n), oc_vec3_dot(u, u2));
    const double sine = oc_vec3_normalise(n);
    if (!(sine >= OC_MIN_PARALLAX_RAD)) return OC_E_DEGENERATE;

    double A[9] = {0}, b[3] = {0}, p[3];
    ray_accumulate(C, u, A, b);
    ray_accumulate(C2, u2, A, b);
    if (oc_mat3_solve(A, b, p) != OC_OK) return OC_E_DEGENERATE;

    oc_vec3_sub(C2, C, base);
    memcpy(out->p_in_world, p, sizeof p);
    out->depth_left_m = point_depth(left, p);
    out->depth_right_m = point_depth(right, p);
    out->parallax_rad = parallax;
    out->gap_m = fabs(oc_vec3_dot(base, n));
    return OC_OK;
}

oc_status_t oc_epipolar_midpoint_covariance(const oc_camera_t *left, double x_px, double y_px, const oc_camera_t *right,
                                            double x2_px, double y2_px, double sigma_px, double cov_m2[9])
{
    OC_ASSERT(left && right && cov_m2);

    /* Small enough to be linear, large enough to keep ten digits. */
    const double step_px = 1e-3;
    if (!(sigma_px > 0.0) || !isfinite(sigma_px)) return OC_E_ARG;

    double cov[9] = {0};
    for (int i = 0; i < 4; i++) {
        oc_midpoint_t moved[2];
        for (int side = 0; side < 2; side++) {
            double v[4] = {x_px, y_px, x2_px, y2_px};
            v[i] += side == 0 ? -step_px : step_px;
            const oc_status_t status = oc_epipolar_midpoint(left, v[0], v[1], right, v[2], v[3], &moved[side]);
            if (status != OC_OK) return status;
        }
        double j[3], jj[9];
        oc_vec3_sub(moved[1].p_in_world, moved[0].p_in_world, j);
        for (int r = 0; r < 3; r++) j[r] *= sigma_px / (2.0 * step_px);
        oc_mat3_outer(j, j, jj);
        for (int k = 0; k < 9; k++) cov[k] += jj[k];
    }
    memcpy(cov_m2, cov, sizeof cov);
    return OC_OK;
}

oc_status_t oc_epipolar_nearest_point(const oc_camera_t cameras[], const double pixels[][2], uint32_t n,
                                      double p_in_world[3])
{
    OC_ASSERT(cameras && pixels && p_in_world);

    if (n < 2) return OC_E_ARG;
    double A[9] = {0}, b[3] = {0}, first[3];
    double widest = 0.0;
    for (uint32_t i = 0; i < n; i++) {
        if (!isfinite(pixels[i][0]) || !isfinite(pixels[i][1])) return OC_E_ARG;
        double centre[3], u[3], across[3];
        oc_pose_centre(&cameras[i].pose, centre);
        oc_camera_ray(&cameras[i], pixels[i][0], pixels[i][1], u);
        ray_accumulate(centre, u, A, b);
        if (i == 0) memcpy(first, u, sizeof first);
        oc_vec3_cross(first, u, across);
        widest = fmax(widest, oc_vec3_norm(across));
    }
    if (!(widest >= OC_MIN_PARALLAX_RAD)) return OC_E_DEGENERATE;
    return oc_mat3_solve(A, b, p_in_world);
}
