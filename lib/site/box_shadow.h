// SPDX-License-Identifier: BSD-3-Clause
// Boxes as things that stand in the way of a line of sight.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "site/site_model.h"

namespace outcrop {

// A yaw-oriented box on the ground, prepared for ray tests.
class Blocker {
public:
    // grow_m is added on every side but the ground's.
    Blocker(const Obstacle &obstacle, double grow_m);

    // Does the open segment from the camera centre to a point meet the box? A point inside the box is met.
    bool meets(const Eigen::Vector3d &from, const Eigen::Vector3d &to) const;

private:
    Eigen::Vector3d into_box(const Eigen::Vector3d &p) const;

    double cos_ = 1, sin_ = 0;
    Eigen::Vector3d centre_, half_;
};

// Blockers of all boxes of a model, suspected ones included. Each is grown by
// share of its footprint's diagonal.
std::vector<Blocker> blockers_of(const SiteModel &model, double grow_share);

bool is_hidden(const std::vector<Blocker> &blockers, const Eigen::Vector3d &from, const Eigen::Vector3d &to);

} // namespace outcrop
