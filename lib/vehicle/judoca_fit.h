/* SPDX-License-Identifier: BSD-3-Clause
 * Sub-pixel step of the junction detector: a line per branch, their common point. */
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
    float ux, uy;   /* unit vector along the branch, away from the apex */
    float side;     /* +1: the gradient points to (-uy, ux), -1: the other way */
    float strength; /* 0..1, orders the seeds when there are too many */
} oc_fit_seed_t;

/* What a branch and an apex must satisfy; the fields of oc_judoca_params_t. */
typedef struct oc_fit_rules {
    float lambda_px, lambda_min_px;
    float s_j;
    float t_b; /* in force, grey levels per px */
    float cos_min_angle;
    float min_bend_rad;
    float max_rms_px, max_apex_sigma_px;
} oc_fit_rules_t;

/* A line through sub-pixel edge positions. */
typedef struct oc_fit_line {
    float px, py;    /* mean of the positions */
    float ux, uy;    /* unit vector away from the apex */
    float rms_px;    /* of the positions, across the line */
    float contrast;  /* mean derivative across the edge, OC_GRADIENT_ONE units */
    float share;     /* positions found / positions looked for */
    float length_px; /* from the apex to the last position */
    float n;         /* positions */
    float spread;    /* sum of squared distances from the mean along the line */
} oc_fit_line_t;

/* A fit under way. */
typedef struct oc_fit {
    float x_px, y_px;           /* apex */
    float sigma_px;             /* larger standard deviation of the apex */
    float from_x_px, from_y_px; /* pixel where the junction was seen */
    uint32_t n;
    oc_fit_seed_t seed[OC_FIT_MAX_BRANCHES];
    oc_fit_line_t line[OC_FIT_MAX_BRANCHES];
} oc_fit_t;

/* First look at a junction that was seen near pixel (x_px, y_px): lines over
 * the shortest length, intersected. False when fewer than two branches hold
 * or the apex is not near the pixel; that is most places, and cheap. */
bool oc_judoca_fit_begin(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, float x_px, float y_px,
                         const oc_fit_seed_t seed[], uint32_t n_seeds, oc_fit_t *fit);

/* The rest: each branch is followed from an inner radius that clears its
 * neighbours to at least lambda_min_px and at most lambda_px, the lines are
 * intersected by weighted least squares, and both are done again from the new
 * apex.
 *
 * junction   out, complete but for label and confidence
 *
 * Returns false, junction untouched, when fewer than two branches hold, the
 * two are a straight line, or the apex is uncertain or has run away. */
bool oc_judoca_fit_finish(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, oc_fit_t *fit,
                          oc_junction_t *junction);

/* Sort the branches by angle. */
void oc_judoca_sort_branches(oc_junction_t *junction);

/* Set `kind` from n_branches and angles: of three branches it is a T when two
 * are opposite within tolerance_rad. */
void oc_judoca_set_kind(oc_junction_t *junction, float tolerance_rad);

#ifdef __cplusplus
}
#endif
#endif
