// SPDX-License-Identifier: BSD-3-Clause
// Does the ground map ever show an obstacle's ground as free?
#include "metrics_footprint.h"

#include "metrics_pose.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace outcrop::eval {

namespace {

constexpr double kLargeAreaM = 3, kLargeCellM = 0.020, kSmallCellM = 0.003;

// The site's area, or without one what the obstacles cover and as much again round it.
Area area_of(const Truth &truth)
{
    if (truth.area) return *truth.area;
    Box all = truth.obstacles->front().aabb;
    for (const TrueObstacle &o : *truth.obstacles) {
        all.min_m = all.min_m.cwiseMin(o.aabb.min_m);
        all.max_m = all.max_m.cwiseMax(o.aabb.max_m);
    }
    const Eigen::Vector2d size = (all.max_m - all.min_m).head<2>();
    return {all.min_m.head<2>() - size / 2, all.max_m.head<2>() + size / 2};
}

Lattice ground_lattice(const Area &area)
{
    const Eigen::Vector2d size = area.max_m - area.min_m;
    Lattice g;
    g.cell_m = size.maxCoeff() > kLargeAreaM ? kLargeCellM : kSmallCellM;
    g.first_centre_m << area.min_m + Eigen::Vector2d::Constant(g.cell_m / 2), 0;
    g.nx = std::max(1, static_cast<int>(std::floor(size.x() / g.cell_m + 1e-6)));
    g.ny = std::max(1, static_cast<int>(std::floor(size.y() / g.cell_m + 1e-6)));
    g.nz = 1;
    return g;
}

// 255 where the true meshes cover the cell; rows are y, upwards.
cv::Mat true_footprint(const Truth &truth, const Lattice &g)
{
    cv::Mat out(g.ny, g.nx, CV_8U, cv::Scalar(0));
    for (const TrueObstacle &o : *truth.obstacles) {
        const auto covered = coverage(o.mesh, g);
        for (int j = 0; j < g.ny; j++)
            for (int i = 0; i < g.nx; i++)
                if (covered[g.index(i, j, 0)]) out.at<std::uint8_t>(j, i) = 255;
    }
    return out;
}

int shown_code(const GroundMap &map, const Eigen::Vector3d &p)
{
    const double col = std::floor((p.x() - map.x_min_m) / map.metres_per_pixel);
    const double row = std::floor((map.y_max_m - p.y()) / map.metres_per_pixel);
    if (!(col >= 0 && row >= 0 && col < map.codes.cols && row < map.codes.rows)) return map.unseen;
    return map.codes.at<std::uint8_t>(static_cast<int>(row), static_cast<int>(col));
}

std::vector<std::size_t> views_used(const Truth &truth, const Run &run)
{
    std::vector<std::size_t> views;
    for (std::size_t i = 0; i < truth.views.size(); i++) {
        if (!truth.depth[i]) continue;
        const auto is_same = [&](const Camera &c) { return find_view(truth, c.image) == static_cast<int>(i); };
        if (!run.cameras || std::any_of(run.cameras->begin(), run.cameras->end(), is_same)) views.push_back(i);
    }
    return views;
}

bool sees_ground(const Truth &truth, std::size_t view, const Eigen::Vector3d &p)
{
    const auto at = truth.views[view].project(p);
    return at && truth.views[view].inside(at->pixel) && is_visible(*truth.depth[view], *at);
}

} // namespace

std::optional<FootprintMetrics> evaluate_footprint(const Truth &truth, const Run &run, Notes &notes)
{
    if (!truth.obstacles || truth.obstacles->empty() || !run.ground) return std::nullopt;
    const Lattice g = ground_lattice(area_of(truth));
    const cv::Mat covered = true_footprint(truth, g);
    cv::Mat wide, narrow;
    cv::dilate(covered, wide, cv::Mat::ones(3, 3, CV_8U));
    cv::erode(covered, narrow, cv::Mat::ones(3, 3, CV_8U));
    const auto views = views_used(truth, run);
    long footprint = 0, shown_free = 0, free_seen = 0, free_shown = 0;
    for (int j = 0; j < g.ny; j++) {
        for (int i = 0; i < g.nx; i++) {
            const bool is_inner = narrow.at<std::uint8_t>(j, i) != 0;
            const bool is_outer = wide.at<std::uint8_t>(j, i) == 0;
            const Eigen::Vector3d p = g.centre_m(i, j, 0);
            const bool is_shown_free = shown_code(*run.ground, p) == run.ground->free;
            footprint += is_inner;
            shown_free += is_inner && is_shown_free;
            if (!is_outer) continue;
            const auto seen =
                std::count_if(views.begin(), views.end(), [&](std::size_t v) { return sees_ground(truth, v, p); });
            free_seen += seen >= 2;
            free_shown += seen >= 2 && is_shown_free;
        }
    }
    FootprintMetrics m;
    m.cell_m = g.cell_m;
    m.false_free_m2 = static_cast<double>(shown_free) * g.cell_m * g.cell_m;
    if (footprint > 0) m.covered = 1 - static_cast<double>(shown_free) / static_cast<double>(footprint);
    if (free_seen > 0)
        m.free_recall = static_cast<double>(free_shown) / static_cast<double>(free_seen);
    else
        notes.push_back("footprint.free_recall is null: no free ground that two views of known depth see");
    return m;
}

} // namespace outcrop::eval
