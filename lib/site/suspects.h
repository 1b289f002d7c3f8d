// SPDX-License-Identifier: BSD-3-Clause
// Ground that may hold something low which was never matched.
#pragma once

#include <set>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "site/site_model.h"
#include "site/view.h"

namespace outcrop {

struct SuspectOptions {
    double reach_share = 0.006; // of the area's diagonal: two lines of sight that meet the ground so near are one place
    double reach_sigmas = 2.58; // and so many sigmas of the least certain camera's place more
    void check() const;         // throws std::invalid_argument
};

// Where the lines of sight of two views' corners meet the ground at one place, though neither corner was matched nor
// labelled ground and no box stands in either line. What is low and plain ends up here. matched: (index of the view,
// junction). views: as the model's, ascending id. Ascending (x, y). O(n log n) in the corners that are left over.
std::vector<Eigen::Vector2d> find_suspects(const std::vector<View> &views, const std::set<std::pair<int, int>> &matched,
                                           const SiteModel &model, const SuspectOptions &options = {});

} // namespace outcrop
