// SPDX-License-Identifier: BSD-3-Clause
// Pairs of views worth matching: overlap, parallax and resolution over sample points of the area.
#include "site/pairs.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>

#include <Eigen/Core>

#include "site/neighbours.h"

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

// Where a view looks, and from which side.
struct Gaze {
    Eigen::Vector2d at = Eigen::Vector2d::Zero(); // mean of the sample points it sees
    int side = 0;                                 // which of kSides it stands on, seen from there
};

constexpr int kSides = 12, kSidesApart = 2; // two sides apart is up to 90 degrees
constexpr std::size_t kNearestPerSide = 10;

Gaze gaze_of(const Sight &sight, const std::vector<Eigen::Vector3d> &points, const PosedView &posed)
{
    Gaze gaze;
    for (std::size_t i = 0; i < points.size(); i++)
        if (sight.is_seen[i]) gaze.at += points[i].head<2>() / sight.n_seen;
    Eigen::Vector3d centre;
    oc_pose_centre(&posed.camera.pose, centre.data());
    const Eigen::Vector2d from = centre.head<2>() - gaze.at;
    const double turn = std::atan2(from.y(), from.x()) / (2 * 3.14159265358979323846);
    gaze.side = static_cast<int>(std::floor((turn - std::floor(turn)) * kSides)) % kSides;
    return gaze;
}

// Pairs worth rating when there are too many views for all of them: for each view, those that look at the nearest
// places from its own side and the two on either hand. Ascending, each once.
std::vector<std::pair<int, int>> likely_pairs(const std::vector<Sight> &sights,
                                              const std::vector<Eigen::Vector3d> &points,
                                              const std::vector<PosedView> &views)
{
    std::vector<Gaze> gazes;
    std::vector<std::vector<int>> of_side(kSides);
    std::vector<std::vector<Eigen::Vector3d>> places(kSides);
    for (std::size_t i = 0; i < views.size(); i++) {
        gazes.push_back(gaze_of(sights[i], points, views[i]));
        if (sights[i].n_seen == 0) continue;
        const auto side = static_cast<std::size_t>(gazes[i].side);
        of_side[side].push_back(static_cast<int>(i));
        places[side].emplace_back(gazes[i].at.x(), gazes[i].at.y(), 0);
    }
    std::set<std::pair<int, int>> pairs;
    for (int side = 0; side < kSides; side++) {
        const auto there = static_cast<std::size_t>(side);
        std::vector<int> askers;
        std::vector<Eigen::Vector3d> queries;
        for (std::size_t i = 0; i < views.size(); i++) {
            const int apart = std::abs(gazes[i].side - side);
            if (sights[i].n_seen == 0 || std::min(apart, kSides - apart) > kSidesApart) continue;
            askers.push_back(static_cast<int>(i));
            queries.emplace_back(gazes[i].at.x(), gazes[i].at.y(), 0);
        }
        const auto nearest = nearest_of(places[there], queries, kNearestPerSide + 1);
        for (std::size_t q = 0; q < askers.size(); q++) {
            for (const int k : nearest[q]) {
                const int i = askers[q], j = of_side[there][static_cast<std::size_t>(k)];
                if (j != i) pairs.insert({std::min(i, j), std::max(i, j)});
            }
        }
    }
    return {pairs.begin(), pairs.end()};
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
    const auto add = [&](int i, int j) {
        ViewPair pair;
        pair.left = i;
        pair.right = j;
        if (rate(sights[i], sights[j], options, &pair)) rated.push_back(pair);
    };
    if (n <= options.exhaustive_views) {
        for (int i = 0; i < n; i++)
            for (int j = i + 1; j < n; j++) add(i, j);
    } else {
        for (const auto &[i, j] : likely_pairs(sights, points, views)) add(i, j);
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
