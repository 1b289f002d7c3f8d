// SPDX-License-Identifier: BSD-3-Clause
// How far the refined poses are off.
#include "metrics_pose.h"

#include <cmath>
#include <regex>

namespace outcrop::eval {

int find_view(const Truth &truth, const std::string &image)
{
    const std::filesystem::path named(image);
    std::smatch number;
    if (!named.has_extension() && std::regex_match(image, number, std::regex("view_(\\d{1,5})"))) {
        const int i = std::stoi(number[1]);
        return static_cast<std::size_t>(i) < truth.views.size() ? i : -1;
    }
    // The folder and the extension differ between copies of a site and between
    // its image variants; the stem names the view.
    for (std::size_t i = 0; i < truth.views.size(); i++)
        if (std::filesystem::path(truth.views[i].image).stem() == named.stem()) return static_cast<int>(i);
    return -1;
}

std::optional<PoseMetrics> evaluate_poses(const Truth &truth, const Run &run, Notes &notes)
{
    if (!run.cameras) return std::nullopt;
    PoseMetrics m;
    double position2 = 0, angle2 = 0;
    for (const Camera &found : *run.cameras) {
        const int i = find_view(truth, found.image);
        if (i < 0) continue;
        const Camera &truly = truth.views[static_cast<std::size_t>(i)];
        position2 += (found.centre_m() - truly.centre_m()).squaredNorm();
        const Eigen::AngleAxisd turn(
            Eigen::Matrix3d(found.rotation_cam_from_world * truly.rotation_cam_from_world.transpose()));
        angle2 += turn.angle() * turn.angle();
        m.n++;
    }
    if (m.n == 0) {
        notes.push_back("poses is null: no view of model/cameras.json names an image of the site");
        return std::nullopt;
    }
    m.position_rmse_m = std::sqrt(position2 / m.n);
    m.angle_rmse_deg = std::sqrt(angle2 / m.n) * 180 / M_PI;
    return m;
}

} // namespace outcrop::eval
