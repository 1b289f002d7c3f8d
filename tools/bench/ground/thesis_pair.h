/* SPDX-License-Identifier: BSD-3-Clause
 * Ground matches of a pair as section 4.9 of the thesis finds them, before RANSAC. */
#pragma once

#include <vector>

#include "vehicle/ground.h"

namespace outcrop::bench {

/* Candidates of a left junction: right junctions in the smallest rectangle round
 * the transfers of all homographies with one parameter moved by its margin.
 * Kept: correlation both ways of t_g or more (Eq 4.40), |Z| of the midpoint below t_h (Eq 4.41, 4.42). Of these the
 * pairs that are best for both their junctions. */
std::vector<oc_ground_match_t> thesis_ground_matches(const oc_ground_view_t &left, const oc_ground_view_t &right,
                                                     unsigned window_px, float t_g, double t_h_m);

} // namespace outcrop::bench
