// SPDX-License-Identifier: BSD-3-Clause
// Corners that nothing explains, laid on the ground.
#include "site/suspects.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <tuple>

#include "site/box_shadow.h"
#include "site/neighbours.h"
#include "site/triangulate.h"

namespace outcrop {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

struct Hit {
    int view = 0;
    Vector3d at = Vector3d::Zero();
};

bool is_inside(const Area &area, const Vector3d &p)
{
    return p.x() >= area.x_min && p.x() <= area.x_max && p.y() >= area.y_min && p.y() <= area.y_max;
}

std::vector<Hit> unexplained_hits(const std::vector<View> &views, const std::set<std::pair<int, int>> &matched,
                                  const SiteModel &model)
{
    const std::vector<Blocker> blockers = blockers_of(model, 0);
    std::vector<Hit> hits;
    for (int v = 0; v < static_cast<int>(views.size()); ++v) {
        const std::vector<oc_junction_t> &junctions = views[static_cast<std::size_t>(v)].junctions;
        const oc_camera_t &camera = model.views[static_cast<std::size_t>(v)].camera;
        const Vector3d centre = camera_centre(camera);
        for (int j = 0; j < static_cast<int>(junctions.size()); ++j) {
            const oc_junction_t &junction = junctions[static_cast<std::size_t>(j)];
            if (junction.label == OC_LABEL_GROUND || matched.count({v, j}) != 0) continue;
            Vector3d ray;
            oc_camera_ray(&camera, static_cast<double>(junction.x_px), static_cast<double>(junction.y_px), ray.data());
            const double reach = -centre.z() / ray.z();
            if (!(reach > 0) || !std::isfinite(reach)) continue;
            Vector3d at = centre + reach * ray;
            at.z() = 0;
            if (is_inside(model.area, at) && !is_hidden(blockers, centre, at)) hits.push_back({v, at});
        }
    }
    return hits;
}

} // namespace

void SuspectOptions::check() const
{
    if (!(reach_share >= 0) || !(reach_sigmas >= 0))
        throw std::invalid_argument("suspects: reach_share and reach_sigmas must be >= 0");
}

std::vector<Vector2d> find_suspects(const std::vector<View> &views, const std::set<std::pair<int, int>> &matched,
                                    const SiteModel &model, const SuspectOptions &options)
{
    options.check();
    if (views.size() != model.views.size())
        throw std::invalid_argument("suspects: the views and the model's must be the same");
    const std::vector<Hit> hits = unexplained_hits(views, matched, model);
    std::vector<Vector3d> points;
    for (const Hit &hit : hits) points.push_back(hit.at);
    double sigma = 0;
    for (const RefinedView &view : model.views)
        sigma = std::max(sigma, std::max(view.posterior.v[0], view.posterior.v[1]));
    const Area &area = model.area;
    const double diagonal = std::hypot(area.x_max - area.x_min, area.y_max - area.y_min);
    const double reach = options.reach_share * diagonal + options.reach_sigmas * sigma;
    std::vector<Vector2d> suspects;
    for (const Neighbours &n : neighbours_within(points, reach)) {
        const Hit &a = hits[static_cast<std::size_t>(n.a)], &b = hits[static_cast<std::size_t>(n.b)];
        if (a.view != b.view) suspects.push_back((a.at + b.at).head<2>() / 2);
    }
    std::sort(suspects.begin(), suspects.end(),
              [](const Vector2d &a, const Vector2d &b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
    return suspects;
}

} // namespace outcrop
