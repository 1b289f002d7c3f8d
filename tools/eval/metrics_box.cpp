// SPDX-License-Identifier: BSD-3-Clause
// Has every obstacle its box, and only the obstacles?
#include "metrics_box.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace outcrop::eval {

namespace {

struct Candidate {
    double iou;
    std::size_t truth, found;
};

// Best first; equal ones in the files' order, so the answer never depends on chance.
std::vector<Candidate> candidates(const std::vector<TrueObstacle> &truth, const std::vector<FoundObstacle> &found)
{
    std::vector<Candidate> out;
    for (std::size_t t = 0; t < truth.size(); t++)
        for (std::size_t f = 0; f < found.size(); f++)
            if (const double overlap = iou(truth[t].aabb, found[f].aabb); overlap > 0) out.push_back({overlap, t, f});
    std::sort(out.begin(), out.end(), [](const Candidate &a, const Candidate &b) {
        return std::tuple(-a.iou, a.truth, a.found) < std::tuple(-b.iou, b.truth, b.found);
    });
    return out;
}

bool is_part_of_truth(const FoundObstacle &box, const std::vector<TrueObstacle> &truth)
{
    return std::any_of(truth.begin(), truth.end(), [&](const TrueObstacle &t) {
        return iou(box.aabb, t.aabb) > kFalseIou || contained_share(box.aabb, t.aabb) >= 0.5;
    });
}

// A rectangle turned by a quarter is the same one.
double yaw_error_deg(const YawBox &a, const YawBox &b)
{
    return std::abs(std::remainder(a.yaw_rad - b.yaw_rad, M_PI / 2)) * 180 / M_PI;
}

} // namespace

bool has_yaw(const TrueObstacle &truth)
{
    std::vector<Eigen::Vector2d> outline;
    for (const Eigen::Vector3d &v : truth.mesh.vertices) outline.emplace_back(v.x(), v.y());
    if (outline.empty()) return false;
    return area(convex_hull(outline)) >= (1 - kSquareSlack) * truth.obb.size_m.x() * truth.obb.size_m.y();
}

std::optional<BoxMetrics> evaluate_boxes(const Truth &truth, const Run &run)
{
    if (!truth.obstacles || !run.obstacles) return std::nullopt;
    BoxMetrics out;
    for (const TrueObstacle &t : *truth.obstacles) {
        BoxMetric b;
        b.truth = t.index;
        b.name = t.name;
        out.boxes.push_back(b);
    }
    std::vector<bool> is_good(run.obstacles->size(), false), is_given = is_good;
    for (const Candidate &c : candidates(*truth.obstacles, *run.obstacles)) {
        BoxMetric &b = out.boxes[c.truth];
        if (b.found || is_given[c.found]) continue;
        const TrueObstacle &t = (*truth.obstacles)[c.truth];
        const FoundObstacle &f = (*run.obstacles)[c.found];
        b.found = f.index;
        b.iou = c.iou;
        b.obb_iou = iou(t.obb, f.obb);
        if (has_yaw(t)) b.yaw_error_deg = yaw_error_deg(t.obb, f.obb);
        b.centre_error_m = (t.aabb.centre_m() - f.aabb.centre_m()).norm();
        is_given[c.found] = true;
        is_good[c.found] = c.iou > kFalseIou;
    }
    for (const BoxMetric &b : out.boxes)
        if (!(b.iou > kFoundIou)) out.missed.push_back(b.truth);
    for (std::size_t f = 0; f < run.obstacles->size(); f++) {
        if (is_good[f]) continue;
        const FoundObstacle &box = (*run.obstacles)[f];
        if (!is_part_of_truth(box, *truth.obstacles))
            out.false_boxes.push_back(box.index);
        else if (!is_given[f])
            out.duplicates.push_back(box.index);
    }
    return out;
}

const TrueObstacle *truth_of(int found_index, const BoxMetrics &boxes, const Truth &truth)
{
    for (std::size_t i = 0; i < boxes.boxes.size(); i++)
        if (boxes.boxes[i].found == found_index) return &(*truth.obstacles)[i];
    return nullptr;
}

} // namespace outcrop::eval
