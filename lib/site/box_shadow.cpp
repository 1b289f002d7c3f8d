// SPDX-License-Identifier: BSD-3-Clause
// Slab test in the box's own frame.
#include "site/box_shadow.h"

#include <algorithm>
#include <cmath>

namespace outcrop {

Blocker::Blocker(const Obstacle &obstacle, double grow_m)
    : cos_(std::cos(obstacle.yaw_rad)), sin_(std::sin(obstacle.yaw_rad)), centre_(obstacle.obb_centre),
      half_(0.5 * obstacle.obb_size + Eigen::Vector3d::Constant(grow_m))
{
    // Grown upwards only: the box keeps standing on the ground.
    half_.z() = 0.5 * (obstacle.obb_size.z() + grow_m);
    centre_.z() += 0.5 * grow_m;
}

Eigen::Vector3d Blocker::into_box(const Eigen::Vector3d &p) const
{
    const Eigen::Vector3d d = p - centre_;
    return {cos_ * d.x() + sin_ * d.y(), -sin_ * d.x() + cos_ * d.y(), d.z()};
}

bool Blocker::meets(const Eigen::Vector3d &from, const Eigen::Vector3d &to) const
{
    const Eigen::Vector3d a = into_box(from), d = into_box(to) - a;
    double near = 0, far = 1;
    for (int i = 0; i < 3; i++) {
        if (d[i] == 0) {
            if (std::abs(a[i]) > half_[i]) return false;
            continue;
        }
        const double t1 = (-half_[i] - a[i]) / d[i], t2 = (half_[i] - a[i]) / d[i];
        near = std::max(near, std::min(t1, t2));
        far = std::min(far, std::max(t1, t2));
    }
    return near <= far;
}

std::vector<Blocker> blockers_of(const SiteModel &model, double grow_share)
{
    std::vector<Blocker> out;
    for (const auto *list : {&model.obstacles, &model.suspected}) {
        for (const Obstacle &obstacle : *list)
            out.emplace_back(obstacle, grow_share * obstacle.obb_size.head<2>().norm());
    }
    return out;
}

bool is_hidden(const std::vector<Blocker> &blockers, const Eigen::Vector3d &from, const Eigen::Vector3d &to)
{
    return std::any_of(blockers.begin(), blockers.end(),
                       [&](const Blocker &blocker) { return blocker.meets(from, to); });
}

} // namespace outcrop
