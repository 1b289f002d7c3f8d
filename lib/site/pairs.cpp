// SPDX-License-Identifier: BSD-3-Clause
// Pairs of views worth matching: overlap, parallax and resolution over sample points of the area.
#include "site/pairs.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <Eigen/Core>

namespace outcrop {
namespace {

constexpr int kSamplesPerSide = 8;
constexpr double kParallaxSpread = 0.6; // in ln(parallax): how fast the worth falls off

// What one view sees of the sample points.
struct Sight {
    std::vector<char> is_seen;
    std::vector<Eigen::Vector3d> ray;  // unit, from the point to the camera
    std::vector<double> metres_per_px; // at the point
    int n_seen = 0;
};

std::vector<Eigen::Vector3d> sample_area(const Area &area)
{
    std::vector<Eigen::Vector3d> points;
    for (const double z : {0.0, 0.5 * area.z_max}) {
        for (int j = 0; j < kSamplesPerSide; j++) {
            for (int i = 0; i < kSamplesPerSide; i++) {
                const double u = (i + 0.5) / kSamplesPerSide;
                const double v = (j + 0.5) / kSamplesPerSide;
                points.emplace_back(area.x_min + u * (area.x_max - area.x_min),
                                    area.y_min + v * (area.y_max - area.y_min), z);
            }
        }
    }
    return points;
}

Sight look(const PosedView &posed, const std::vector<Eigen::Vector3d> &points)
{
    Sight sight;
    Eigen::Vector3d centre;
    oc_pose_centre(&posed.camera.pose, centre.data());
    for (const Eigen::Vector3d &point : points) {
        double x = 0;
        double y = 0;
        const double depth = oc_camera_project(&posed.camera, point.data(), &x, &y);
        const oc_intrinsics_t &k = posed.camera.k;
        const bool seen = depth > 0 && x >= 0 && y >= 0 && x <= k.width_px - 1.0 && y <= k.height_px - 1.0;
        sight.is_seen.push_back(seen ? 1 : 0);
        sight.n_seen += seen ? 1 : 0;
        sight.ray.push_back((centre - point).normalized());
        sight.metres_per_px.push_back(seen ? depth / k.fx_px : 0);
    }
    return sight;
}

// Fills parallax, overlap and worth; false when the pair is not worth matching.
bool rate(const Sight &left, const Sight &right, const PairOptions &options, ViewPair *pair)
{
    int n = 0;
    double angle = 0;
    double log_scale = 0;
    for (std::size_t i = 0; i < left.is_seen.size(); i++) {
        if (left.is_seen[i] == 0 || right.is_seen[i] == 0) continue;
        n++;
        angle += std::acos(std::clamp(left.ray[i].dot(right.ray[i]), -1.0, 1.0));
        log_scale += std::log(left.metres_per_px[i] / right.metres_per_px[i]);
    }
    if (n == 0) return false;

    pair->parallax_rad = angle / n;
    pair->overlap = static_cast<double>(n) / std::min(left.n_seen, right.n_seen);
    const double scale = std::exp(std::abs(log_scale / n));
    if (pair->parallax_rad < options.min_parallax_rad || pair->parallax_rad > options.max_parallax_rad) return false;
    if (pair->overlap < options.min_overlap || scale > options.max_scale_ratio) return false;

    const double off = std::log(pair->parallax_rad / options.best_parallax_rad) / kParallaxSpread;
    pair->worth = pair->overlap * std::exp(-0.5 * off * off) / scale;
    return true;
}

void check(const Area &area, const PairOptions &options)
{
    const bool area_ok = area.x_max > area.x_min && area.y_max > area.y_min && area.z_max >= 0;
    if (!area_ok) throw std::invalid_argument("select_pairs: the area is empty");
    const bool options_ok = options.min_parallax_rad > 0 && options.max_parallax_rad > options.min_parallax_rad &&
                            options.best_parallax_rad > 0 && options.min_overlap >= 0 && options.min_overlap <= 1 &&
                            options.max_scale_ratio >= 1 && options.best_per_view >= 1;
    if (!options_ok) throw std::invalid_argument("select_pairs: an option is out of range");
}

// Best first; equal worth is settled by position, so the answer never depends on the sort.
bool is_better(const ViewPair &a, const ViewPair &b)
{
    if (a.worth != b.worth) return a.worth > b.worth;
    return a.left != b.left ? a.left < b.left : a.right < b.right;
}

} // namespace

PosedView as_reported(const View &view)
{
    return PosedView{&view, view.camera, view.margin};
}

std::vector<ViewPair> select_pairs(const std::vector<PosedView> &views, const Area &area, const PairOptions &options)
{
    check(area, options);
    const std::vector<Eigen::Vector3d> points = sample_area(area);
    std::vector<Sight> sights;
    for (const PosedView &posed : views) sights.push_back(look(posed, points));

    std::vector<ViewPair> rated;
    const int n = static_cast<int>(views.size());
    for (int i = 0; i < n; i++) {
        for (int j = i + 1; j < n; j++) {
            ViewPair pair;
            pair.left = i;
            pair.right = j;
            if (rate(sights[i], sights[j], options, &pair)) rated.push_back(pair);
        }
    }

    // A pair stays while one of its views still has room; best pairs are asked first.
    std::sort(rated.begin(), rated.end(), is_better);
    std::vector<int> rank(views.size(), 0);
    std::vector<ViewPair> chosen;
    for (const ViewPair &pair : rated) {
        const bool has_room = rank[pair.left] < options.best_per_view || rank[pair.right] < options.best_per_view;
        rank[pair.left]++;
        rank[pair.right]++;
        if (has_room) chosen.push_back(pair);
    }
    std::sort(chosen.begin(), chosen.end(), [](const ViewPair &a, const ViewPair &b) {
        return a.left != b.left ? a.left < b.left : a.right < b.right;
    });
    return chosen;
}

} // namespace outcrop
