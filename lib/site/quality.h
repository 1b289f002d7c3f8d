// SPDX-License-Identifier: BSD-3-Clause
// What the model says of its own worth, and what it then no longer claims.
#pragma once

#include <vector>

#include "site/site_model.h"
#include "site/view.h"

namespace outcrop {

struct QualityOptions {
    double min_baseline_share = 0.01;     // of the mean camera height: views nearer than this are all alike
    double max_place_share = 0.5;         // a box whose place is less certain (99 %) than this share of its lesser side
                                          // is only suspected
    double margin_slack = 1.5;            // a pose moved by more margins than this is outside of them ...
    double margin_sigmas = 3;             // ... and by more of its posterior's sigmas beyond
    double max_outside_share = 0.2;       // of the views that may be outside
    double max_ground_misfit_share = 0.3; // of the ground sightings that a flat ground does not explain
    int min_ground_sightings = 20;        // fewer say nothing of the ground's shape
    double min_match_share = 0.03;        // of the obstacle junctions of all views that must be matched ...
    int min_obstacle_junctions = 60;      // ... when there are so many
    double max_dropped_share = 0.5;       // of the merged tracks that may turn out inconsistent or too uncertain
    int max_obstacles = 200;
    void check() const; // throws std::invalid_argument
};

// What the model itself does not hold.
struct QualityFacts {
    const std::vector<View> *views = nullptr; // ascending id, as the model's
    bool is_exact = false;                    // every pose is
    bool sees_common_ground = true;           // two views see the same ground
    int n_ground_sightings = 0, n_ground_misfits = 0;
};

// Statements in a fixed order; an empty list is a model without reservations. Where one of them is a fault, no box is
// claimed: all become suspected. So does a single box that holds a camera, stands in front of fewer than two, or whose
// place is too uncertain. Sets SiteModel::quality, moves boxes to SiteModel::suspected, renumbers both.
void judge(const QualityFacts &facts, const QualityOptions &options, SiteModel *model);

// Is one of the statements a fault?
bool has_fault(const SiteModel &model);

} // namespace outcrop
