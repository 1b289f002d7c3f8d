/* SPDX-License-Identifier: BSD-3-Clause
 * Two-view geometry: the fundamental matrix, distances to it, and points from rays.
 *
 * m'^T F m = 0 with m in the left view, m' in the right, l' = F m (thesis
 * Eq 2.36, 5.8). */
#ifndef OUTCROP_CORE_EPIPOLAR_H
#define OUTCROP_CORE_EPIPOLAR_H

#include <stdint.h>

#include "core/camera.h"
#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the fundamental matrix ---- */

/* F = M'^-T [C - C']x M^-1, M = K R (one of the thesis' equal forms, Eq 2.32,
 * 2.35, 5.7), scaled to unit Frobenius norm. OC_E_DEGENERATE when the centres
 * are nearer to each other than 1e-9 of their distance from the origin. */
OC_CHECKED oc_status_t oc_epipolar_fundamental(const oc_camera_t *left, const oc_camera_t *right, double F[9]);

/* Epipoles e = P C', e' = P' C, homogeneous, not scaled (thesis Eq 2.29). The
 * third coordinate is the depth of the other camera. */
void oc_epipolar_epipoles(const oc_camera_t *left, const oc_camera_t *right, double e_left[3], double e_right[3]);

/* Epipolar line in the right view, scaled to a^2 + b^2 = 1. OC_E_DEGENERATE
 * when the pixel is the epipole. */
OC_CHECKED oc_status_t oc_epipolar_line(const double F[9], double x_px, double y_px, double line[3]);

/* Signed distance of the right pixel from the epipolar line of the left one;
 * NaN at the epipole. */
double oc_epipolar_distance_px(const double F[9], double x_px, double y_px, double x2_px, double y2_px);

/* Signed Sampson distance: m'^T F m / |gradient|, first-order distance to the
 * nearest pair that satisfies F. NaN where the gradient is 0. */
double oc_epipolar_sampson_px(const double F[9], double x_px, double y_px, double x2_px, double y2_px);

/* ---- points from rays ---- */

/* Rays closer to parallel than this have no midpoint. */
#define OC_MIN_PARALLAX_RAD 1e-6

typedef struct oc_midpoint {
    double p_in_world[3];
    double depth_left_m, depth_right_m; /* of the point, along the axes; <= 0: behind that camera */
    double parallax_rad;                /* angle between the rays, 0..pi */
    double gap_m;                       /* distance between the rays */
} oc_midpoint_t;

/* Midpoint of the common perpendicular of two rays (thesis Eq 2.77 = 4.41 =
 * 5.28 = 6.1, the last factor read as C'^T). The point is not refused for
 * being behind a camera: look at the depths. OC_E_ARG for a pixel that is not
 * finite, OC_E_DEGENERATE below OC_MIN_PARALLAX_RAD. */
OC_CHECKED oc_status_t oc_epipolar_midpoint(const oc_camera_t *left, double x_px, double y_px, const oc_camera_t *right,
                                            double x2_px, double y2_px, oc_midpoint_t *out);

/* First-order covariance (row-major 3x3, m^2) of the midpoint for independent
 * pixel errors of sigma_px in both views, exact poses. Central differences:
 * eight midpoints. Errors as oc_epipolar_midpoint; OC_E_ARG for sigma_px not in
 * (0, inf). */
OC_CHECKED oc_status_t oc_epipolar_midpoint_covariance(const oc_camera_t *left, double x_px, double y_px,
                                                       const oc_camera_t *right, double x2_px, double y2_px,
                                                       double sigma_px, double cov_m2[9]);

/* Point nearest to n rays: [sum (I - u u^T)]^-1 sum (I - u u^T) C. For n = 2 it
 * is the midpoint. pixels is [n][2]. OC_E_ARG for n < 2 or a pixel that is not
 * finite, OC_E_DEGENERATE when all rays are parallel (within
 * OC_MIN_PARALLAX_RAD). */
OC_CHECKED oc_status_t oc_epipolar_nearest_point(const oc_camera_t cameras[], const double pixels[][2], uint32_t n,
                                                 double p_in_world[3]);

#ifdef __cplusplus
}
#endif
#endif
