/* SPDX-License-Identifier: BSD-3-Clause
 * Sub-pixel step of the junction detector: all branches and their common apex in one least-squares fit. */
#ifndef OUTCROP_VEHICLE_JUDOCA_FIT_H
#define OUTCROP_VEHICLE_JUDOCA_FIT_H

#include <stdbool.h>
#include <stdint.h>

#include "core/junction.h"
#include "vehicle/gradient.h"
#include "vehicle/judoca_branch.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Table of a look round the apex, from first_px outwards, in images of one width. */
void oc_judoca_ring_build(oc_ring_table_t *table, int32_t first_px, uint32_t width_px);

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

#ifdef __cplusplus
}
#endif
#endif
