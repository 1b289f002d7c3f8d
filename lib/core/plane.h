/* SPDX-License-Identifier: BSD-3-Clause
 * Planes of the world and the homographies they induce: the ground, and the
 * plane of two branches of a junction seen twice.
 *
 * All functions are pure; a few hundred flops each. */
#ifndef OUTCROP_CORE_PLANE_H
#define OUTCROP_CORE_PLANE_H

#include <stdbool.h>

#include "core/camera.h"
#include "core/homography.h"
#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* n . X + d = 0 in the world; |n| = 1, d in metres. */
typedef struct oc_plane {
    double n[3];
    double d_m;
} oc_plane_t;

/* ---- the ground, Z = 0 ---- */

/* The planar perspective matrix H_p, columns 1, 2 and 4 of P (thesis Eq
 * 4.1-4.6): depth (x, y, 1) = H_p (X, Y, 1). */
void oc_plane_image_from_ground(const oc_camera_t *camera, double image_from_ground[9]);

/* H_p^-1 in closed form. Its scale is that of H_p^-1 itself, so the third
 * coordinate of its product with a pixel is 1 / depth: positive exactly when
 * the ray through the pixel meets the ground in front of the camera.
 * OC_E_DEGENERATE when the camera stands in the ground plane. */
OC_CHECKED oc_status_t oc_plane_ground_from_image(const oc_camera_t *camera, double ground_from_image[9]);

/* The horizon in the image: a x + b y + c = 0 with line = (a, b, c), the third
 * row of H_p^-1. (Thesis section 4.4 takes the third row of H_p, which is the
 * line under the camera in the overhead image.) Pixels of ground have
 * line . (x, y, 1) > 0 when ground_from_image comes from the function above. */
void oc_plane_horizon(const double ground_from_image[9], double line[3]);

/* Is (x, y) on the same side of the horizon as a pixel known to be ground? For
 * an H_p^-1 of unknown sign. False on the horizon. */
bool oc_plane_is_ground(const double ground_from_image[9], double x_px, double y_px, double ground_x_px,
                        double ground_y_px);

/* Where a pixel's ray meets the ground, metres. OC_E_DEGENERATE when it does
 * not meet it in front of the camera. */
OC_CHECKED oc_status_t oc_plane_ground_point(const double ground_from_image[9], double x_px, double y_px, double *x_m,
                                             double *y_m);

/* H_g = H_2 H_1^-1 (thesis Eq 4.32): right pixel of a left pixel of ground.
 * OC_E_DEGENERATE when either camera stands in the ground plane. */
OC_CHECKED oc_status_t oc_plane_ground_homography(const oc_camera_t *left, const oc_camera_t *right, double H[9]);

/* ---- any plane ---- */

/* Right pixel of a left pixel of the plane, world form:
 * H = M' (I - (C - C') n^T / (n . C + d)) M^-1, M = K R.
 * (Thesis Eq 5.30-5.33 with the transform of the FIRST camera; with the second
 * one's, as printed in 4.36, 4.37, 5.31 and 5.32, the matrix is [I|0].)
 *
 * same_side  out, may be NULL: both cameras see the same face of the plane
 *
 * OC_E_DEGENERATE when either camera is in the plane (nearer than 1e-9 of its
 * distances), OC_E_ARG when the plane is not finite. */
OC_CHECKED oc_status_t oc_plane_homography(const oc_camera_t *left, const oc_camera_t *right, const oc_plane_t *plane,
                                           double H[9], bool *same_side);

/* ---- the plane of a junction ---- */

/* One branch in one view: apex and direction (atan2(dy, dx), y down). */
typedef struct oc_edge2 {
    double x_px, y_px, angle_rad;
} oc_edge2_t;

/* A branch carried into the world, made once for each branch and view. */
typedef struct oc_edge3 {
    double n[3];     /* unit normal of the plane through the camera and the edge */
    double along[3]; /* unit, in that plane, across the apex ray, the way the branch goes */
} oc_edge3_t;

/* Two views of one branch. */
typedef struct oc_edge_dir {
    double d[3]; /* unit, in the world, the way the branch goes in the left view */
    double sine; /* of the angle between the two planes; small: direction badly known */
    bool agrees; /* it goes the way of the branch in the right view too */
} oc_edge_direction_t;

/* Two planes count as one below this sine: the branch lies along the epipolar
 * line and has no direction in space. */
#define OC_EDGE_MIN_SINE 1e-6

/* Line of a branch, (sin a, -cos a, y cos a - x sin a); thesis Eq 5.19 in a
 * form that also holds for a vertical branch. Unit normal. */
void oc_edge_line(const oc_edge2_t *edge, double line[3]);

/* Thesis Eq 5.17, 5.18: the plane P^T l. */
void oc_edge_prepare(const oc_camera_t *camera, const oc_edge2_t *edge, oc_edge3_t *out);

/* Direction of the edge in space, n x n' (thesis Eq 5.26, the factors).
 * OC_E_DEGENERATE below OC_EDGE_MIN_SINE. About 40 flops. */
OC_CHECKED oc_status_t oc_edge_direction(const oc_edge3_t *left, const oc_edge3_t *right, oc_edge_direction_t *out);

/* Plane through a point along two directions: n = d1 x d2 / |.|, d = -n . M
 * (thesis Eq 5.26-5.29). OC_E_DEGENERATE when the directions are parallel
 * (sine below OC_EDGE_MIN_SINE). */
OC_CHECKED oc_status_t oc_plane_from_directions(const double d1[3], const double d2[3], const double point_m[3],
                                                oc_plane_t *plane);

/* All of it: the plane of branches left[0], left[1] that match right[0],
 * right[1], at the midpoint of the apices' rays. OC_E_DEGENERATE when the rays
 * or any two planes are parallel. point_m may be NULL. */
OC_CHECKED oc_status_t oc_plane_from_junction(const oc_camera_t *left_camera, const oc_edge2_t left[2],
                                              const oc_camera_t *right_camera, const oc_edge2_t right[2],
                                              oc_plane_t *plane, double point_m[3]);

#ifdef __cplusplus
}
#endif
#endif
