/* SPDX-License-Identifier: BSD-3-Clause
 * Where in the other view a match may lie, when the poses are known within margins.
 *
 * A ground junction: an ellipse round its transfer. Any other: a band round its
 * epipolar line, cut to the heights that are possible. Both are first-order
 * covariances of all twelve pose parameters (uniform errors of half-width a
 * have variance a^2 / 3) and of pixel noise in both views. The thesis' own
 * window and strip (one parameter at a time, minimum and maximum; Eq 5.9-5.16)
 * are here as well, to be compared: they miss half of the matches when the
 * errors really fill the margins, because errors of several parameters add.
 *
 *   oc_pair_prepare     once for each pair of views, 24 perturbed cameras, 20 us
 *   oc_window_*, oc_strip_*   once for each left junction, 12 mat-vec, 0.2 to 1.5 us
 *   ..._contains        once for each candidate, 10 to 20 flops, 4 ns */
#ifndef OUTCROP_CORE_WINDOW_H
#define OUTCROP_CORE_WINDOW_H

#include <stdbool.h>

#include "core/camera.h"
#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* 99 % of a chi-square with two degrees of freedom, and of a normal. */
#define OC_WINDOW_MAX_D2 9.21
#define OC_STRIP_MAX_SIGMA 2.58

/* How the three angles of a margin act. */
typedef enum oc_angle_error {
    /* Added to omega, phi, kappa, as in the thesis. At phi = +-90 degrees (a
     * level camera looking along the X axis) omega and kappa turn about the same axis and
     * errors about the third one are not covered. */
    OC_ANGLE_ERROR_OPK = 0,
    /* Small turns about the camera's own x, y and z; the same in all attitudes. */
    OC_ANGLE_ERROR_LOCAL = 1
} oc_angle_error_t;

/* Columns 0..5 are the left camera's parameters, 6..11 the right one's. */
#define OC_PAIR_PARAMS 12

/* A prepared pair, 4 kB. Read only after oc_pair_prepare; threads may share it. */
typedef struct oc_pair {
    oc_camera_t left, right;
    double sigma_px;
    double F[9]; /* unit norm */
    double H[9]; /* of the ground */
    double H_inf[9];
    double B[9]; /* H of the plane Z = z is H_inf - B / (left height - z) */
    double left_height_m;
    /* d / d parameter, times the parameter's standard deviation a / sqrt 3 */
    double dF[OC_PAIR_PARAMS][9];
    double dH[OC_PAIR_PARAMS][9];
    double dH_inf[OC_PAIR_PARAMS][9];
    double dB[OC_PAIR_PARAMS][9];
    double d_left_height_m[OC_PAIR_PARAMS];
    double left_ray[9]; /* M^-1: pixel -> direction with depth 1 */
    double left_centre_m[3];
    double right_M[9]; /* M' = K' R' */
    double e_right[3]; /* M' (C - C') */
} oc_pair_t;

/* Prepare a pair: F, the ground homography and their derivatives by central
 * differences over each camera's six parameters, with the margin as the step
 * (a margin of 0 gives a derivative of 0).
 *
 * sigma_px  noise of a junction's position, each axis, both views; (0, 100]
 *
 * OC_E_ARG for invalid cameras, margins that are negative, not finite, or
 * over 0.5 rad; OC_E_DEGENERATE when the centres coincide or a camera, itself
 * or moved by its margin, stands in the ground plane. *pair is then not
 * written. Cost: 24 perturbed cameras, some 20 000 flops, of the order of
 * 20 us; stack about 5 kB. */
OC_CHECKED oc_status_t oc_pair_prepare(oc_pair_t *pair, const oc_camera_t *left, const oc_margin_t *left_margin,
                                       const oc_camera_t *right, const oc_margin_t *right_margin,
                                       oc_angle_error_t angles, double sigma_px);

/* ---- the ground window ---- */

/* An ellipse in the right view. */
typedef struct oc_window {
    double x_px, y_px; /* its centre, the transfer of the left pixel */
    double cov_px2[3]; /* xx, xy, yy */
    double info[3];    /* inverse of it, xx, xy, yy */
} oc_window_t;

/* Window of a left pixel if it is on the ground: Sigma = J diag(a^2/3) J^T +
 * sigma^2 (I + A A^T), A the homography's Jacobian. OC_E_DEGENERATE when the
 * pixel is not below the horizon or its ground point is not in front of the
 * right camera; OC_E_ARG when it is not finite. About 400 flops. */
OC_CHECKED oc_status_t oc_window_ground(const oc_pair_t *pair, double x_px, double y_px, oc_window_t *window);

/* The same for a point at height z_m above the ground. OC_E_DEGENERATE also
 * when z_m is the left camera's own height. */
OC_CHECKED oc_status_t oc_window_at_height(const oc_pair_t *pair, double x_px, double y_px, double z_m,
                                           oc_window_t *window);

/* Squared Mahalanobis distance of a right pixel from the window's centre. */
static inline double oc_window_d2(const oc_window_t *w, double x_px, double y_px)
{
    const double dx = x_px - w->x_px;
    const double dy = y_px - w->y_px;
    return w->info[0] * dx * dx + 2.0 * w->info[1] * dx * dy + w->info[2] * dy * dy;
}

/* d^2 < OC_WINDOW_MAX_D2. */
static inline bool oc_window_contains(const oc_window_t *w, double x_px, double y_px)
{
    return oc_window_d2(w, x_px, y_px) < OC_WINDOW_MAX_D2;
}

/* Half sides of the upright rectangle round the ellipse d^2 = OC_WINDOW_MAX_D2,
 * for a look-up in a grid. */
void oc_window_half_sides(const oc_window_t *window, double *half_x_px, double *half_y_px);

/* Area of that ellipse, px^2. */
double oc_window_area_px2(const oc_window_t *window);

/* ---- the epipolar strip ---- */

/* A band round the epipolar line; its half-width is OC_STRIP_MAX_SIGMA * sigma
 * and changes along the line. */
typedef struct oc_strip {
    double line[3];  /* a^2 + b^2 = 1 */
    double q[6];     /* sigma^2 at m' = m'^T Q m'; Q = xx xy x1 yy y1 11 (poses and left pixel) */
    double sigma_px; /* of the right pixel, to be added */
} oc_strip_t;

/* OC_E_DEGENERATE when the pixel is the epipole (nearer than 1e-6 px),
 * OC_E_ARG when it is not finite. About 500 flops. */
OC_CHECKED oc_status_t oc_strip_prepare(const oc_pair_t *pair, double x_px, double y_px, oc_strip_t *strip);

static inline double oc_strip_distance_px(const oc_strip_t *s, double x_px, double y_px)
{
    return s->line[0] * x_px + s->line[1] * y_px + s->line[2];
}

/* Variance of that distance, px^2. */
static inline double oc_strip_variance_px2(const oc_strip_t *s, double x_px, double y_px)
{
    const double q =
        x_px * (s->q[0] * x_px + 2.0 * (s->q[1] * y_px + s->q[2])) + y_px * (s->q[3] * y_px + 2.0 * s->q[4]) + s->q[5];
    return q + s->sigma_px * s->sigma_px;
}

/* |distance| < OC_STRIP_MAX_SIGMA * sigma. */
static inline bool oc_strip_contains(const oc_strip_t *s, double x_px, double y_px)
{
    const double d = oc_strip_distance_px(s, x_px, y_px);
    return d * d < OC_STRIP_MAX_SIGMA * OC_STRIP_MAX_SIGMA * oc_strip_variance_px2(s, x_px, y_px);
}

/* ---- the part of the line that is possible ---- */

/* What heights and left depths are possible, metres. */
typedef struct oc_reach {
    double z_min_m, z_max_m;
    double depth_min_m, depth_max_m;
} oc_reach_t;

/* A piece of the epipolar line, from the lower end (Z nearer z_min) to the upper. */
typedef struct oc_segment {
    double low_px[2], high_px[2];
    double low_depth_m, high_depth_m; /* in the left view */
    double low_slack_px, high_slack_px;
} oc_segment_t;

/* Right images of the left ray's lowest and highest possible point, cut so that
 * both are depth_min or more in front of the right camera. The slack is OC_STRIP_MAX_SIGMA
 * standard deviations of that end along the line where a height sets the end,
 * 0 where a depth does.
 *
 * OC_E_ARG unless z_min < z_max, 0 < depth_min < depth_max, all finite;
 * OC_E_DEGENERATE when no part of the ray is possible or it is seen as a point. */
OC_CHECKED oc_status_t oc_strip_segment(const oc_pair_t *pair, double x_px, double y_px, const oc_reach_t *reach,
                                        oc_segment_t *segment);

/* Does the right pixel project into the segment, slack included? Combine with
 * oc_strip_contains. */
bool oc_segment_contains(const oc_segment_t *segment, double x_px, double y_px);

/* ---- the thesis' own, for comparison ---- */

/* Every parameter moved alone by +- its margin: 24 of each, 4 kB. */
typedef struct oc_pair_thesis {
    double F[9], H[9];
    double F_moved[2 * OC_PAIR_PARAMS][9];
    double H_moved[2 * OC_PAIR_PARAMS][9];
} oc_pair_thesis_t;

typedef struct oc_rect {
    double x_min_px, y_min_px, x_max_px, y_max_px;
} oc_rect_t;

/* Upper and lower edge of the thesis' strip, lines (a, b, c). */
typedef struct oc_strip_thesis {
    double upper[3], lower[3];
} oc_strip_thesis_t;

/* Errors as oc_pair_prepare. */
OC_CHECKED oc_status_t oc_pair_prepare_thesis(oc_pair_thesis_t *pair, const oc_camera_t *left,
                                              const oc_margin_t *left_margin, const oc_camera_t *right,
                                              const oc_margin_t *right_margin);

/* Thesis section 4.9: the smallest rectangle round the transfers by all moved
 * homographies (and the one that is not moved). OC_E_DEGENERATE when one of
 * them does not see the point. */
OC_CHECKED oc_status_t oc_window_ground_thesis(const oc_pair_thesis_t *pair, double x_px, double y_px,
                                               oc_rect_t *window);

/* Thesis Eq 5.9-5.14: lines through the smallest and largest crossings with the
 * image's left border x = 0 and right border x = width. OC_E_DEGENERATE when a
 * moved line is vertical, which Eq 5.13 divides by. */
OC_CHECKED oc_status_t oc_strip_prepare_thesis(const oc_pair_thesis_t *pair, double x_px, double y_px, double width_px,
                                               oc_strip_thesis_t *strip);

/* Thesis Eq 5.15, 5.16: between the edges, (l_u . m') (l_d . m') < 0. */
bool oc_strip_contains_thesis(const oc_strip_thesis_t *strip, double x_px, double y_px);

#ifdef __cplusplus
}
#endif
#endif
