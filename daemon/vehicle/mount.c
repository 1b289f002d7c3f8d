/* SPDX-License-Identifier: BSD-3-Clause
 * From the body's pose to a camera's: mounts, and covariances as margins. */
#include <math.h>
#include <string.h>

#include "pose_track.h"

#define MAX_ANGLE_MARGIN 0.78539816339744831 /* 45 degrees, what the link carries */

static void multiply(const double *a, const double *b, double *out)
{
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += a[3 * i + k] * b[3 * k + j];
            out[3 * i + j] = sum;
        }
    }
}

oc_pose_t oc_mount_from_xyzrpy(const double xyz_m[3], const double rpy_rad[3])
{
    const double cr = cos(rpy_rad[0]), sr = sin(rpy_rad[0]), cp = cos(rpy_rad[1]), sp = sin(rpy_rad[1]);
    const double cy = cos(rpy_rad[2]), sy = sin(rpy_rad[2]);
    /* Rz(yaw) Ry(pitch) Rx(roll) */
    const double body_from_housing[9] = {cy * cp,
                                         cy * sp * sr - sy * cr,
                                         cy * sp * cr + sy * sr,
                                         sy * cp,
                                         sy * sp * sr + cy * cr,
                                         sy * sp * cr - cy * sr,
                                         -sp,
                                         cp * sr,
                                         cp * cr};
    /* Optical x is the housing's right, y its down, z its forward. */
    static const double housing_from_optical[9] = {0, 0, 1, -1, 0, 0, 0, -1, 0};
    oc_pose_t mount;
    multiply(body_from_housing, housing_from_optical, mount.R);
    memcpy(mount.t, xyz_m, sizeof mount.t);
    return mount;
}

/* The quaternion has been checked when the pose came in; interpolation keeps its length. */
static oc_pose_t world_from_body(const oc_body_pose_t *body)
{
    const double w = body->q_wxyz[0], x = body->q_wxyz[1], y = body->q_wxyz[2], z = body->q_wxyz[3];
    const double n = 2 / (w * w + x * x + y * y + z * z);
    oc_pose_t out = {.R = {1 - n * (y * y + z * z), n * (x * y - w * z), n * (x * z + w * y), n * (x * y + w * z),
                           1 - n * (x * x + z * z), n * (y * z - w * x), n * (x * z - w * y), n * (y * z + w * x),
                           1 - n * (x * x + y * y)}};
    memcpy(out.t, body->position_m, sizeof out.t);
    return out;
}

oc_pose_t oc_pose_of_camera(const oc_body_pose_t *body, const oc_pose_t *body_from_optical)
{
    const oc_pose_t world_body = world_from_body(body);
    oc_pose_t world_from_cam, cam_from_world;
    oc_pose_compose(&world_body, body_from_optical, &world_from_cam);
    oc_pose_invert(&world_from_cam, &cam_from_world);
    return cam_from_world;
}

/* sigma of row . (position, rotation) */
static double sigma_of(const double row[6], const double covariance[36])
{
    double sum = 0;
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++) sum += row[i] * covariance[6 * i + j] * row[j];
    }
    return sqrt(fmax(0, sum));
}

/* How small rotations d about the world's axes move omega, phi, kappa.
 *
 * With R_th = R_kappa R_phi R_omega and the turned camera R_th exp(-[d]x):
 * d = e1 d_omega + R_omega^T e2 d_phi + R_th^T e3 d_kappa. The matrix of these
 * columns has the determinant cos phi; `rows` is its inverse. */
static void angle_rows(const oc_pose_t *cam_from_world, double rows[9])
{
    double R_th[9], omega, phi, kappa;
    oc_cv_from_thesis(cam_from_world->R, R_th);
    oc_opk_from_thesis(R_th, &omega, &phi, &kappa);
    const double so = sin(omega), co = cos(omega), t = tan(phi), c = fmax(cos(phi), 1e-6);
    /* Columns: (1, 0, 0), (0, co, so), (sin phi, -so cos phi, co cos phi). */
    const double kappa_row[3] = {0, -so / c, co / c};
    const double limited_t = fabs(t) < 1e6 ? t : copysign(1e6, t);
    const double inverse[9] = {1, so * limited_t, -co * limited_t, 0, co, so, kappa_row[0], kappa_row[1], kappa_row[2]};
    memcpy(rows, inverse, sizeof inverse);
}

/* Next to 90 degrees phi shrinks whichever way the view strays, also across its own direction: by b^2 / (2 cos phi)
 * while b is small, by all of b in the end. b cos^-1 phi is what turns kappa. */
static double sigma_of_phi(double along, double sigma_of_kappa, double cos_phi)
{
    const double across = sigma_of_kappa * cos_phi;
    return hypot(along, across * fmin(1, sigma_of_kappa));
}

oc_margin_t oc_margin_of_camera(const oc_body_pose_t *body, const oc_pose_t *body_from_optical,
                                const oc_margin_t *least)
{
    oc_margin_t margin = *least;
    if (!body->has_covariance) return margin;
    const oc_pose_t world_body = world_from_body(body), camera = oc_pose_of_camera(body, body_from_optical);
    double lever[3] = {0, 0, 0}, angles[9];
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) lever[i] += world_body.R[3 * i + j] * body_from_optical->t[j];
    }
    angle_rows(&camera, angles);
    /* The centre moves by the body's move and by d x lever. */
    const double rows[6][6] = {{1, 0, 0, 0, lever[2], -lever[1]},          {0, 1, 0, -lever[2], 0, lever[0]},
                               {0, 0, 1, lever[1], -lever[0], 0},          {0, 0, 0, angles[0], angles[1], angles[2]},
                               {0, 0, 0, angles[3], angles[4], angles[5]}, {0, 0, 0, angles[6], angles[7], angles[8]}};
    double sigma[6];
    for (int i = 0; i < 6; i++) sigma[i] = sigma_of(rows[i], body->covariance);
    sigma[4] = sigma_of_phi(sigma[4], sigma[5], 1 / hypot(angles[7], angles[8]));
    for (int i = 0; i < 6; i++) {
        double half = sqrt(3.0) * sigma[i];
        if (i >= 3) half = fmin(half, MAX_ANGLE_MARGIN);
        margin.v[i] = fmax(margin.v[i], half);
    }
    return margin;
}
