/* SPDX-License-Identifier: BSD-3-Clause
 * What one does with a homography of pixels: apply, differentiate, anchor, chain.
 *
 * Every homography that core makes from cameras is scaled so that the third
 * coordinate of its result is (depth in the second view) / (depth in the
 * first): positive means in front of the second camera, for a point that is in
 * front of the first. Homographies estimated from matches have no such sign. */
#ifndef OUTCROP_CORE_HOMOGRAPHY_H
#define OUTCROP_CORE_HOMOGRAPHY_H

#include <stdint.h>

#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Point that H sends (x, y) to. Returns the third coordinate w; a value of 0
 * means that the result is at infinity (|w| below 1e-12 of the terms it is the
 * sum of) or not a number, and x2, y2 are not written. */
double oc_homography_apply(const double H[9], double x, double y, double *x2, double *y2);

/* Local affine part: J = d(x2, y2) / d(x, y), row-major. OC_E_DEGENERATE as
 * oc_homography_apply; J is not written then. */
OC_CHECKED oc_status_t oc_homography_jacobian(const double H[9], double x, double y, double J[4]);

/* Image of a direction at (x, y): the angle of J (cos a, sin a), in [0, 2 pi).
 * OC_E_DEGENERATE when J sends it to 0. */
OC_CHECKED oc_status_t oc_homography_angle(const double H[9], double x, double y, double angle_rad, double *angle2_rad);

/* H' = T(m2 - H m) H: H moved so that it sends (x, y) to (x2, y2) exactly.
 *
 * Poses with errors give an H that misses the match by many pixels, and the
 * patches of thesis Eq 5.34 and 5.35 are then read beside the corner; (4.40)
 * has this shift as t_lr. OC_E_DEGENERATE as oc_homography_apply. In and out
 * may be the same. */
OC_CHECKED oc_status_t oc_homography_anchor(const double H[9], double x, double y, double x2, double y2,
                                            double anchored[9]);

/* Thesis Eq 6.7 with its order corrected: the map from view j to view k is
 * H[n-1] ... H[1] H[0], H[i] sending view j + i to view j + i + 1. steps is
 * [n][9]; n = 0 gives the identity. */
void oc_homography_chain(const double steps[][9], uint32_t n, double H[9]);

#ifdef __cplusplus
}
#endif
#endif
