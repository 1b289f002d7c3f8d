/* SPDX-License-Identifier: BSD-3-Clause
 * One branch of a junction under fit: the samples along it and its line. */
#ifndef OUTCROP_VEHICLE_JUDOCA_BRANCH_H
#define OUTCROP_VEHICLE_JUDOCA_BRANCH_H

#include <stdbool.h>
#include <stdint.h>

#include "vehicle/gradient.h"

#ifdef __cplusplus
extern "C" {
#endif

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
    float cos_min_angle, cos_min_bend;
    float cos_first_bend;        /* a line already at the first look */
    const oc_ring_table_t *ring; /* [2] near the apex and further out */
    float max_rms_px, max_apex_sigma_px;
} oc_fit_rules_t;

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
    oc_fit_crowd_t crowd; /* the same side by side, as of the last pass */
} oc_fit_t;

/* A ridge's variance across the edge is larger than along it by what the central difference adds. */
#define OC_FIT_DIFFERENCE_PX2 0.25f

/* Where along a branch positions are looked for, px from the apex. */
typedef struct oc_fit_span {
    float inner_px;    /* first */
    float crowded_px;  /* nearer than this another ridge may hide them: a missing one does not count */
    float asked_px;    /* length without which there is no branch */
    float shortest_px; /* fitted over at least this, where there is so much */
    float longest_px;
    int32_t across_px; /* half width of the search across, 0..OC_FIT_MAX_REACH */
    bool has_model;    /* take off what the other branches add */
} oc_fit_span_t;

/* Follow the branches of a fit whose bit is set and fit each one's own line, in the frame of the fit's apex; the
 * longest piece that stays straight wins. Of the branches direction and side are read, the rest is written; the others
 * are read as the crowd shows them. Returns those that hold; of the others the rest is of no use. */
uint32_t oc_judoca_branches_follow(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, oc_fit_t *fit,
                                   const oc_fit_blur_t *blur, uint32_t which, const oc_fit_span_t span[]);

#ifdef __cplusplus
}
#endif
#endif
