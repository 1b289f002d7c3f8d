/* SPDX-License-Identifier: BSD-3-Clause
 * Cameras and poses: checks, conversions, projection, lens distortion.
 */
#include "core/camera.h"

#include <math.h>
#include <string.h>

#include "core/image.h"
#include "core/mat3.h"

/* ---- checks ---- */

/* Finite and at most max_abs away from 0; NaN fails. */
static bool values_within(const double v[], int n, double max_abs)
{
    for (int i = 0; i < n; i++) {
        if (!(fabs(v[i]) <= max_abs)) return false;
    }
    return true;
}

static bool principal_point_is_valid(double c_px, uint32_t side_px)
{
    const double side = (double)side_px;
    return c_px >= -3.0 * side && c_px <= 4.0 * side;
}

bool oc_intrinsics_is_valid(const oc_intrinsics_t *k)
{
    OC_ASSERT(k);

    if (k->width_px < OC_MIN_IMAGE_SIDE || k->width_px > OC_MAX_IMAGE_SIDE) return false;
    if (k->height_px < OC_MIN_IMAGE_SIDE || k->height_px > OC_MAX_IMAGE_SIDE) return false;
    if (!(k->fx_px > 0.0 && k->fy_px > 0.0)) return false;
    if (!isfinite(k->fx_px) || !isfinite(k->fy_px)) return false;
    return principal_point_is_valid(k->cx_px, k->width_px) && principal_point_is_valid(k->cy_px, k->height_px);
}

bool oc_pose_is_valid(const oc_pose_t *pose)
{
    OC_ASSERT(pose);

    /* A bound below DBL_MAX so that no sum of products can overflow. */
    if (!values_within(pose->t, 3, 1e100)) return false;
    if (!values_within(pose->R, 9, 2.0)) return false;

    double Rt[9], product[9], eye[9];
    oc_mat3_transpose(pose->R, Rt);
    oc_mat3_mul(pose->R, Rt, product);
    oc_mat3_identity(eye);
    for (int i = 0; i < 9; i++) {
        if (!(fabs(product[i] - eye[i]) <= 1e-6)) return false;
    }
    return oc_mat3_det(pose->R) > 0.0;
}

/* ---- intrinsics and poses ---- */

oc_intrinsics_t oc_intrinsics_from_format(double focal, double format_width, double format_height, uint32_t width_px,
                                          uint32_t height_px)
{
    const oc_intrinsics_t k = {
        .fx_px = focal * (double)width_px / format_width,
        .fy_px = focal * (double)height_px / format_height,
        /* Integer coordinates are pixel centres: the middle of 640 is 319.5. */
        .cx_px = ((double)width_px - 1.0) / 2.0,
        .cy_px = ((double)height_px - 1.0) / 2.0,
        .width_px = width_px,
        .height_px = height_px,
    };
    return k;
}

void oc_pose_from_centre(const double R_cv[9], const double centre[3], oc_pose_t *pose)
{
    OC_ASSERT(R_cv && centre && pose);

    double t[3];
    oc_mat3_mul_vec(R_cv, centre, t);
    memmove(pose->R, R_cv, sizeof pose->R);
    for (int i = 0; i < 3; i++) pose->t[i] = -t[i];
}

void oc_pose_centre(const oc_pose_t *pose, double centre[3])
{
    OC_ASSERT(pose && centre);

    oc_mat3_mul_vec_t(pose->R, pose->t, centre);
    for (int i = 0; i < 3; i++) centre[i] = -centre[i];
}

void oc_pose_to_6(const oc_pose_t *pose, oc_pose6_t *six)
{
    OC_ASSERT(pose && six);

    double R_th[9];
    oc_cv_from_thesis(pose->R, R_th);
    oc_pose_centre(pose, six->v);
    oc_opk_from_thesis(R_th, &six->v[3], &six->v[4], &six->v[5]);
}

void oc_pose_from_6(const oc_pose6_t *six, oc_pose_t *pose)
{
    OC_ASSERT(six && pose);

    double R[9];
    oc_thesis_from_opk(six->v[3], six->v[4], six->v[5], R);
    oc_cv_from_thesis(R, R);
    oc_pose_from_centre(R, six->v, pose);
}

void oc_pose_compose(const oc_pose_t *c_from_b, const oc_pose_t *b_from_a, oc_pose_t *c_from_a)
{
    OC_ASSERT(c_from_b && b_from_a && c_from_a);

    oc_pose_t out;
    oc_mat3_mul(c_from_b->R, b_from_a->R, out.R);
    oc_mat3_mul_vec(c_from_b->R, b_from_a->t, out.t);
    for (int i = 0; i < 3; i++) out.t[i] += c_from_b->t[i];
    *c_from_a = out;
}

void oc_pose_invert(const oc_pose_t *b_from_a, oc_pose_t *a_from_b)
{
    OC_ASSERT(b_from_a && a_from_b);

    oc_pose_t out;
    oc_mat3_transpose(b_from_a->R, out.R);
    oc_pose_centre(b_from_a, out.t);
    *a_from_b = out;
}

/* ---- projection ---- */

void oc_camera_matrix(const oc_camera_t *camera, double P[12])
{
    OC_ASSERT(camera && P);

    const oc_intrinsics_t *k = &camera->k;
    for (int c = 0; c < 4; c++) {
        const double *t = camera->pose.t;
        const double *R = camera->pose.R;
        const double x = c < 3 ? R[c] : t[0];
        const double y = c < 3 ? R[3 + c] : t[1];
        const double z = c < 3 ? R[6 + c] : t[2];
        P[c] = k->fx_px * x + k->cx_px * z;
        P[4 + c] = k->fy_px * y + k->cy_px * z;
        P[8 + c] = z;
    }
}

double oc_camera_project(const oc_camera_t *camera, const double p_in_world[3], double *x_px, double *y_px)
{
    OC_ASSERT(camera && p_in_world && x_px && y_px);

    double p[3];
    oc_mat3_mul_vec(camera->pose.R, p_in_world, p);
    for (int i = 0; i < 3; i++) p[i] += camera->pose.t[i];
    if (!(p[2] > 0.0)) return p[2];
    *x_px = camera->k.fx_px * p[0] / p[2] + camera->k.cx_px;
    *y_px = camera->k.fy_px * p[1] / p[2] + camera->k.cy_px;
    return p[2];
}

void oc_camera_ray(const oc_camera_t *camera, double x_px, double y_px, double dir_in_world[3])
{
    OC_ASSERT(camera && dir_in_world);

    const oc_intrinsics_t *k = &camera->k;
    const double in_cam[3] = {(x_px - k->cx_px) / k->fx_px, (y_px - k->cy_px) / k->fy_px, 1.0};
    oc_mat3_mul_vec_t(camera->pose.R, in_cam, dir_in_world);
    oc_vec3_normalise(dir_in_world);
}

/* ---- lens distortion ---- */

/* Plumb-bob on normalised coordinates: radial factor and tangential shift. */
static void distortion_terms(const double k[5], double x, double y, double *radial, double *dx, double *dy)
{
    const double r2 = x * x + y * y;
    *radial = 1.0 + r2 * (k[0] + r2 * (k[1] + r2 * k[4]));
    *dx = 2.0 * k[2] * x * y + k[3] * (r2 + 2.0 * x * x);
    *dy = k[2] * (r2 + 2.0 * y * y) + 2.0 * k[3] * x * y;
}

void oc_distort(const oc_intrinsics_t *k, const oc_distortion_t *d, double x_px, double y_px, double *xd_px,
                double *yd_px)
{
    OC_ASSERT(k && d && xd_px && yd_px);

    const double x = (x_px - k->cx_px) / k->fx_px;
    const double y = (y_px - k->cy_px) / k->fy_px;
    double radial, dx, dy;
    distortion_terms(d->k, x, y, &radial, &dx, &dy);
    *xd_px = k->fx_px * (x * radial + dx) + k->cx_px;
    *yd_px = k->fy_px * (y * radial + dy) + k->cy_px;
}

oc_status_t oc_undistort(const oc_intrinsics_t *k, const oc_distortion_t *d, double xd_px, double yd_px, double *x_px,
                         double *y_px)
{
    OC_ASSERT(k && d && x_px && y_px);

    /* Normalised; 1e-10 is well under a thousandth of a pixel at any focal length. */
    const double settled = 1e-10;
    const double xd = (xd_px - k->cx_px) / k->fx_px;
    const double yd = (yd_px - k->cy_px) / k->fy_px;
    double x = xd, y = yd;
    for (int i = 0; i < 200; i++) {
        double radial, dx, dy;
        distortion_terms(d->k, x, y, &radial, &dx, &dy);
        if (!(radial > 0.0)) return OC_E_DEGENERATE;
        const double next_x = (xd - dx) / radial;
        const double next_y = (yd - dy) / radial;
        const double step = fabs(next_x - x) + fabs(next_y - y);
        x = next_x;
        y = next_y;
        if (step <= settled) {
            *x_px = k->fx_px * x + k->cx_px;
            *y_px = k->fy_px * y + k->cy_px;
            return OC_OK;
        }
    }
    return OC_E_DEGENERATE;
}
