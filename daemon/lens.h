/* SPDX-License-Identifier: BSD-3-Clause
 * A lens: the raw camera as calibrated, and the pinhole camera that rectification makes of it. */
#ifndef OUTCROP_DAEMON_LENS_H
#define OUTCROP_DAEMON_LENS_H

#include <stdbool.h>

#include "core/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum oc_lens_model {
    OC_LENS_PINHOLE,   /* no distortion */
    OC_LENS_PLUMB_BOB, /* k1 k2 p1 p2 k3, Brown 1966, OpenCV's and ROS' order */
    OC_LENS_FISHEYE    /* k1 k2 k3 k4, Kannala and Brandt 2006; ROS calls it equidistant */
} oc_lens_model_t;

typedef struct oc_lens {
    oc_lens_model_t model;
    double k[5];               /* fisheye: the first four */
    oc_intrinsics_t raw;       /* of the picture as it comes */
    oc_intrinsics_t rectified; /* of the picture as it is used; any size */
} oc_lens_t;

/* A lens without distortion: raw = rectified = k. */
oc_lens_t oc_lens_pinhole(const oc_intrinsics_t *k);

/* Plumb-bob, raw = rectified = k. */
oc_lens_t oc_lens_plumb_bob(const oc_intrinsics_t *k, const oc_distortion_t *distortion);

/* A known model, both intrinsics valid, coefficients finite. */
bool oc_lens_is_valid(const oc_lens_t *lens);

/* Raw and rectified pictures are the same, pixel for pixel. */
bool oc_lens_is_identity(const oc_lens_t *lens);

/* The same, field by field; padding does not matter. */
bool oc_lens_is_equal(const oc_lens_t *a, const oc_lens_t *b);

/* The raw pixel that a rectified pixel comes from, by the model's formula
 * wherever that leads: finite or not, and folded back beyond the reach below. */
void oc_lens_distort(const oc_lens_t *lens, double x_px, double y_px, double *raw_x_px, double *raw_y_px);

/* How far from the axis the model can be trusted to be one to one, as a radius
 * on the plane at distance 1 (the tangent of the angle). Polynomials fitted to
 * what the calibration saw turn back further out, and raw pixels would appear
 * there a second time.
 *
 * Fisheye: the first angle where the radius no longer grows; infinite when
 * there is none below 90 degrees. Plumb-bob: the largest disc in which the
 * symmetric Jacobian is positive definite by the bound of its tangential part,
 * -6 r hypot(p1, p2); exact where p1 = p2 = 0, and at most OC_MAX_LENS_REACH.
 * Pinhole: infinite. 0 for coefficients that are not finite or overflow. */
#define OC_MAX_LENS_REACH 1e4
double oc_lens_reach(const oc_lens_t *lens);

/* The raw pixel that shows a rectified pixel, to within 1/512 of a pixel of
 * the raw picture's outermost pixel centres; false when the raw picture does
 * not, or it is beyond `reach` (from oc_lens_reach). Then nothing is written. */
bool oc_lens_find(const oc_lens_t *lens, double reach, double x_px, double y_px, double *raw_x_px, double *raw_y_px);

#ifdef __cplusplus
}
#endif
#endif
