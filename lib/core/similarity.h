/* SPDX-License-Identifier: BSD-3-Clause
 * The map: metres to pixels of the overhead view, and angles along a path.
 *
 * The overhead view here is the thesis': y UP, origin at its lower left corner
 * (row r of a picture of height h is y = h - 1 - r). */
#ifndef OUTCROP_CORE_SIMILARITY_H
#define OUTCROP_CORE_SIMILARITY_H

#include <stdint.h>

#include "core/camera.h"
#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* x' = s R(theta) x + t. */
typedef struct oc_similarity {
    double scale_px_per_m;
    double theta_rad; /* of the world's X axis in the map, counter-clockwise */
    double t_px[2];   /* the world's origin in the map */
} oc_similarity_t;

/* Thesis Eq 7.1-7.3: the origin and a point d_m along the world's X axis, as
 * clicked on the map. OC_E_ARG unless all are finite and d_m > 0,
 * OC_E_DEGENERATE when both points are the same. */
OC_CHECKED oc_status_t oc_similarity_from_points(double x0_px, double y0_px, double x1_px, double y1_px, double d_m,
                                                 oc_similarity_t *map_from_world);

/* Thesis Eq 7.5: [s R t; 0 1]. */
void oc_similarity_matrix(const oc_similarity_t *map_from_world, double S[9]);

/* Thesis Eq 7.4, 7.6, 7.7; heights scale too. In and out may be the same. */
void oc_similarity_apply(const oc_similarity_t *map_from_world, const double p_in_world[3], double p_in_map[3]);
void oc_similarity_invert(const oc_similarity_t *map_from_world, const double p_in_map[3], double p_in_world[3]);

/* The camera that sees in map units what this one sees in metres: C' = (S C, s
 * C_z), tilt and swing unchanged, pan less theta. */
void oc_similarity_camera(const oc_similarity_t *map_from_world, const oc_camera_t *camera, oc_camera_t *in_map);

/* ---- angles, radians ---- */

/* In [0, 2 pi). */
double oc_angle_wrap(double angle_rad);

/* Thesis Eq 7.14, round the circle: min(d, 2 pi - d), 0..pi. */
double oc_angle_distance(double a_rad, double b_rad);

/* Thesis Eq 7.12 along the shorter arc: a at t = 0, b at t = 1; in [0, 2 pi). */
double oc_angle_interpolate(double a_rad, double b_rad, double t);

/* Thesis Eq 7.15: pan in the map, in [0, 2 pi). */
double oc_pan_in_map(double pan_rad, double theta_rad);

/* Pan that looks along a motion: atan2(dx, dy), for pan is the azimuth clockwise from
 * +Y. (Thesis Eq 7.10 is the mathematical angle, which Eq 7.11 needs.) */
double oc_pan_from_motion(double dx, double dy);

/* Thesis Eq 7.14, Table 7.2: index of the pan nearest to pan_rad, the first of
 * equals. n >= 1. */
uint32_t oc_pan_nearest(double pan_rad, const double pans_rad[], uint32_t n);

/* Pixels of the same camera with its swing taken away: H = K F R_swing^T F
 * K^-1, F = diag(1,-1,-1). Exact, where the plain pixel rotation of thesis Eq
 * 7.16 is off by several pixels because pixels are not square. */
void oc_swing_removal(const oc_intrinsics_t *k, double swing_rad, double H[9]);

#ifdef __cplusplus
}
#endif
#endif
