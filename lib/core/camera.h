/* SPDX-License-Identifier: BSD-3-Clause
 * Cameras and poses: OpenCV axes inside, the thesis' conventions at the edge.
 *
 * World: metres, right-handed, Z up, ground Z = 0. Camera: x right, y down,
 * z forward; integer pixel = pixel centre. x ~ K (R X + t), R and t being
 * cam_from_world. Matrices are row-major 3x3 doubles.
 *
 * The thesis (photogrammetric): x right, y up, optical axis -z,
 * x_cam = R_th (X - C), so R = diag(1,-1,-1) R_th (docs/equations.md). */
#ifndef OUTCROP_CORE_CAMERA_H
#define OUTCROP_CORE_CAMERA_H

#include <stdbool.h>
#include <stdint.h>

#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Pinhole intrinsics, pixels. */
typedef struct oc_intrinsics {
    double fx_px, fy_px, cx_px, cy_px;
    uint32_t width_px, height_px;
} oc_intrinsics_t;

/* Plumb-bob coefficients k1 k2 p1 p2 k3 (OpenCV order); all 0 = none. */
typedef struct oc_distortion {
    double k[5];
} oc_distortion_t;

/* cam_from_world: X_cam = R X_world + t, metres. */
typedef struct oc_pose {
    double R[9];
    double t[3];
} oc_pose_t;

/* A pose as six error parameters, in the order the margins have: camera
 * centre X, Y, Z in metres and the thesis' omega, phi, kappa in radians. */
typedef struct oc_pose6 {
    double v[6];
} oc_pose6_t;

/* Half-widths of uniform errors of the six parameters. */
typedef struct oc_margin {
    double v[6];
} oc_margin_t;

typedef struct oc_camera {
    oc_intrinsics_t k;
    oc_pose_t pose;
} oc_camera_t;

/* ---- checks ---- */

/* Finite, focal lengths > 0, sides within the image limits, principal point
 * within three image sizes of the image. */
bool oc_intrinsics_is_valid(const oc_intrinsics_t *k);

/* Finite, R R^T = I within 1e-6, det R > 0. */
bool oc_pose_is_valid(const oc_pose_t *pose);

/* ---- the thesis' rotations, radians (Eq 4.9-4.19) ----
 * R_th = R_kappa R_phi R_omega = R_swing R_tilt R_pan, passive. Pan is the
 * azimuth of the optical axis clockwise from +Y, tilt its angle from nadir. */
void oc_thesis_from_opk(double omega, double phi, double kappa, double R_th[9]);
void oc_thesis_from_pts(double pan, double tilt, double swing, double R_th[9]);
void oc_opk_from_thesis(const double R_th[9], double *omega, double *phi, double *kappa);
void oc_pts_from_thesis(const double R_th[9], double *pan, double *tilt, double *swing);
void oc_opk_from_pts(double pan, double tilt, double swing, double *omega, double *phi, double *kappa);
void oc_pts_from_opk(double omega, double phi, double kappa, double *pan, double *tilt, double *swing);

/* R_cv = diag(1,-1,-1) R_th, its own inverse. In and out may be the same. */
void oc_cv_from_thesis(const double R_th[9], double R_cv[9]);

/* Eq 2.12: focal length and film format in the same unit -> pixels; principal
 * point at the image centre. */
oc_intrinsics_t oc_intrinsics_from_format(double focal, double format_width, double format_height, uint32_t width_px,
                                          uint32_t height_px);

/* ---- poses ---- */
void oc_pose_from_centre(const double R_cv[9], const double centre[3], oc_pose_t *pose);
void oc_pose_centre(const oc_pose_t *pose, double centre[3]);
void oc_pose_to_6(const oc_pose_t *pose, oc_pose6_t *six);
void oc_pose_from_6(const oc_pose6_t *six, oc_pose_t *pose);

/* Camera pose = mount after body pose: cam_from_world = cam_from_body * body_from_world. */
void oc_pose_compose(const oc_pose_t *c_from_b, const oc_pose_t *b_from_a, oc_pose_t *c_from_a);
void oc_pose_invert(const oc_pose_t *b_from_a, oc_pose_t *a_from_b);

/* Quaternion w, x, y, z of R; w >= 0. And back (normalises; OC_E_ARG when its
 * norm is not within 1e-3 of 1 or not a number). */
void oc_quat_from_rotation(const double R[9], double q_wxyz[4]);
OC_CHECKED oc_status_t oc_rotation_from_quat(const double q_wxyz[4], double R[9]);

/* ---- projection ---- */

/* P = K [R | t], 3x4 row-major. The thesis' A R [I | -C] equals -P. */
void oc_camera_matrix(const oc_camera_t *camera, double P[12]);

/* Pixel of a world point. Returns its depth in metres (<= 0: behind, and x, y
 * are not written). */
double oc_camera_project(const oc_camera_t *camera, const double p_in_world[3], double *x_px, double *y_px);

/* Unit direction in the world of the ray through a pixel. */
void oc_camera_ray(const oc_camera_t *camera, double x_px, double y_px, double dir_in_world[3]);

/* Distorted pixel of an undistorted one, same intrinsics (plumb-bob), and the
 * inverse by fixed-point iteration (OC_E_DEGENERATE when it does not settle). */
void oc_distort(const oc_intrinsics_t *k, const oc_distortion_t *d, double x_px, double y_px, double *xd_px,
                double *yd_px);
OC_CHECKED oc_status_t oc_undistort(const oc_intrinsics_t *k, const oc_distortion_t *d, double xd_px, double yd_px,
                                    double *x_px, double *y_px);

#ifdef __cplusplus
}
#endif
#endif
