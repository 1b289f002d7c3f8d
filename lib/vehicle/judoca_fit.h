/* SPDX-License-Identifier: BSD-3-Clause
 * Sub-pixel step of the junction detector: all branches and their common apex in one least-squares fit. */
#ifndef OUTCROP_VEHICLE_JUDOCA_FIT_H
#define OUTCROP_VEHICLE_JUDOCA_FIT_H

#include <stdbool.h>
#include <stdint.h>

#include "core/junction.h"
#include "vehicle/gradient.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Branches followed while fitting; the strongest OC_MAX_BRANCHES leave. */
#define OC_FIT_MAX_BRANCHES 8u

/* Where to look for one branch. */
typedef struct oc_fit_seed {
    float ux, uy; /* unit vector along the branch, away from the apex */
    float side;   /* +1: the gradient points to (-uy, ux), -1: the other way */
} oc_fit_seed_t;

/* What a branch and an apex must satisfy; the fields of oc_judoca_params_t. */
typedef struct oc_fit_rules {
    float sigma_px;
    float lambda_px, lambda_min_px;
    float s_j;
    float t_b; /* in force, grey levels per px */
    float cos_min_angle, cos_min_bend, min_bend_rad;
    float cos_first_bend; /* a line already at the first look */
    float max_rms_px, max_apex_sigma_px;
} oc_fit_rules_t;

/* Weighted sums over the ridge positions of one branch, in its own frame at
 * the apex: t along the branch, d across it, px. */
typedef struct oc_fit_sums {
    float w, wt, wtt, wd, wtd, wdd;
    float value, gain, gain2; /* of v = amplitude * gain: sums of v gain, gain, gain^2 */
    float bend, level;        /* of far samples: sum of 2 v - before - after, and of v */
} oc_fit_sums_t;

/* One branch as last fitted. */
typedef struct oc_fit_branch {
    float ux, uy, side;
    oc_fit_sums_t sums;
    float offset_px; /* of its own line from the apex, across */
    float turn_rad;  /* of its own line from (ux, uy) */
    float rms_px;    /* about its own line */
    float amplitude; /* of the ridge, OC_GRADIENT_ONE units */
    float share;     /* positions found / positions looked for */
    float length_px; /* from the apex to the last position */
    float n;         /* positions */
} oc_fit_branch_t;

/* A fit under way. */
typedef struct oc_fit {
    float x_px, y_px;           /* apex */
    float sigma_px;             /* larger standard deviation of the apex */
    float moved_px;             /* by the first look */
    float blur_px2;             /* variance of the ridges across the edge */
    float from_x_px, from_y_px; /* pixel where the junction was seen */
    uint32_t n;
    oc_fit_branch_t branch[OC_FIT_MAX_BRANCHES];
} oc_fit_t;

/* First look at a junction that was seen near pixel (x_px, y_px): lines over
 * the shortest length, intersected. False when fewer than two branches hold
 * or the apex is not near the pixel; that is most places, and cheap. */
bool oc_judoca_fit_begin(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, float x_px, float y_px,
                         const oc_fit_seed_t seed[], uint32_t n_seeds, oc_fit_t *fit);

/* The rest: each branch is followed to at least lambda_min_px and at most
 * lambda_px. Near the apex the branches' ridges run into each other: what the
 * others add by the model of blurred half lines is taken off first, so that
 * also the samples near the apex count. Apex and angles are solved together.
 *
 * junction   out, complete but for label and confidence
 *
 * Returns false, junction untouched, when fewer than two branches hold, the
 * two are a straight line, or the apex is uncertain or has run away. */
bool oc_judoca_fit_finish(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, oc_fit_t *fit,
                          oc_junction_t *junction);

/* Sort the branches by angle. */
void oc_judoca_sort_branches(oc_junction_t *junction);

/* Angle of a vector, [0, 2 pi), to 1e-7 rad; the same bits on every machine. */
float oc_judoca_angle(float x, float y);

/* Set `kind` from n_branches and angles: of three branches it is a T when two
 * are opposite within tolerance_rad. */
void oc_judoca_set_kind(oc_junction_t *junction, float tolerance_rad);

#ifdef __cplusplus
}
#endif
#endif
