// SPDX-License-Identifier: BSD-3-Clause
// Points of obstacles grouped by single linkage: the roots of the thesis' irregular pyramid (thesis 6.2, Eq 6.4).
#include "site/cluster.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <stdexcept>

#include <nanoflann.hpp>

#include "site/components.h"

namespace outcrop {

namespace {

using Eigen::Vector3d;

struct Cloud {
    const std::vector<Vector3d> &points;
    std::size_t kdtree_get_point_count() const { return points.size(); }
    double kdtree_get_pt(std::size_t i, std::size_t axis) const { return points[i][static_cast<int>(axis)]; }
    template <typename Box>
    bool kdtree_get_bbox(Box &) const
    {
        return false;
    }
};
using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Cloud>, Cloud, 3, std::uint32_t>;

std::vector<int> labels_of(DisjointSets *sets, std::size_t n)
{
    std::vector<int> label(n);
    std::map<int, int> number;
    for (std::size_t i = 0; i < n; ++i) {
        const int root = sets->root(static_cast<int>(i));
        label[i] = number.emplace(root, static_cast<int>(number.size())).first->second;
    }
    return label;
}

// Two points are joined when is_near says so; looked for within `reach`.
template <typename IsNear>
std::vector<int> link(const std::vector<Vector3d> &points, double reach, const IsNear &is_near)
{
    DisjointSets sets(points.size());
    if (points.empty()) return {};
    const Cloud cloud{points};
    Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10));
    tree.buildIndex();
    // The search radius is squared and open; a little more finds those exactly at the limit, is_near decides.
    const double radius = reach * reach * (1 + 1e-9) + std::numeric_limits<double>::min();
    nanoflann::SearchParams unsorted;
    unsorted.sorted = false;
    std::vector<std::pair<std::uint32_t, double>> found;
    for (std::size_t i = 0; i < points.size(); ++i) {
        tree.radiusSearch(points[i].data(), radius, found, unsorted);
        for (const auto &[j, square] : found)
            if (j > i && is_near(i, j, std::sqrt(square))) sets.join(static_cast<int>(i), static_cast<int>(j));
    }
    return labels_of(&sets, points.size());
}

std::vector<Vector3d> flattened(const std::vector<SitePoint> &points, double z_weight)
{
    std::vector<Vector3d> flat;
    flat.reserve(points.size());
    for (const SitePoint &p : points) flat.emplace_back(p.position.x(), p.position.y(), p.position.z() * z_weight);
    return flat;
}

double spread(const SitePoint &p)
{
    return std::sqrt(std::max(p.covariance(0, 0), p.covariance(1, 1)));
}

} // namespace

void ClusterOptions::check() const
{
    if (!(t_m_m >= 0) || !(min_t_m_share > 0) || !(max_t_m_share >= min_t_m_share) || !(max_t_m_share <= 1))
        throw std::invalid_argument("cluster: t_M must be >= 0, its shares ascending in (0, 1]");
    if (!(z_weight > 0) || !(z_weight <= 1) || min_suspected < 1 || min_points < min_suspected)
        throw std::invalid_argument("cluster: z_weight in (0, 1], 1 <= min_suspected <= min_points");
    if (!(group_reach >= 0)) throw std::invalid_argument("cluster: group_reach must be >= 0");
    if (!(covariance_sigmas >= 0)) throw std::invalid_argument("cluster: covariance_sigmas must be >= 0");
}

std::vector<int> single_linkage(const std::vector<Vector3d> &points, double t_m)
{
    if (!(t_m >= 0)) throw std::invalid_argument("cluster: t_M must be >= 0");
    return link(points, t_m, [t_m](std::size_t, std::size_t, double d) { return d <= t_m; });
}

// Prim's algorithm on the full graph.
std::vector<double> spanning_edges(const std::vector<Vector3d> &points)
{
    std::vector<double> edges;
    if (points.size() < 2) return edges;
    std::vector<double> nearest(points.size(), std::numeric_limits<double>::infinity());
    std::vector<char> is_in(points.size(), 0);
    std::size_t last = 0;
    is_in[0] = 1;
    while (edges.size() + 1 < points.size()) {
        std::size_t next = 0;
        double least = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (is_in[i]) continue;
            nearest[i] = std::min(nearest[i], (points[i] - points[last]).norm());
            if (nearest[i] < least) least = nearest[i], next = i;
        }
        if (!std::isfinite(least)) break;
        is_in[next] = 1;
        edges.push_back(least);
        last = next;
    }
    std::sort(edges.begin(), edges.end());
    return edges;
}

double automatic_threshold(const std::vector<double> &edges, double lowest, double highest)
{
    // A gap counts when the next edge is a third longer; below that, edges grow steadily and say nothing.
    constexpr double kClearGap = 1.33;
    double best_ratio = kClearGap, threshold = highest, below = lowest;
    for (const double edge : edges) {
        if (edge <= lowest) continue;
        const double above = std::min(edge, highest);
        if (above / below > best_ratio) best_ratio = above / below, threshold = std::sqrt(above * below);
        below = std::max(below, above);
        if (edge >= highest) break;
    }
    return threshold;
}

namespace {

// Least distance between two groups.
double distance_between(const std::vector<Vector3d> &points, const std::vector<int> &a, const std::vector<int> &b)
{
    double least = std::numeric_limits<double>::infinity();
    for (const int i : a) {
        for (const int j : b)
            least = std::min(least, (points[static_cast<std::size_t>(i)] - points[static_cast<std::size_t>(j)]).norm());
    }
    return least;
}

// Groups nearer than reach become one, the nearest pair first reached in order; members stay ascending.
void join_groups(const std::vector<Vector3d> &points, double reach, std::vector<std::vector<int>> *groups)
{
    for (std::size_t a = 0; a < groups->size(); ++a) {
        for (std::size_t b = a + 1; b < groups->size();) {
            if (distance_between(points, (*groups)[a], (*groups)[b]) > reach) {
                ++b;
                continue;
            }
            auto &joined = (*groups)[a];
            joined.insert(joined.end(), (*groups)[b].begin(), (*groups)[b].end());
            std::sort(joined.begin(), joined.end());
            groups->erase(groups->begin() + static_cast<std::ptrdiff_t>(b));
            b = a + 1; // the larger group may reach farther
        }
    }
}

} // namespace

Clusters cluster_points(const std::vector<SitePoint> &points, double diagonal_m, const ClusterOptions &options)
{
    options.check();
    Clusters clusters;
    const std::vector<Vector3d> flat = flattened(points, options.z_weight);
    clusters.t_m_m = options.t_m_m > 0 ? options.t_m_m
                                       : automatic_threshold(spanning_edges(flat), options.min_t_m_share * diagonal_m,
                                                             options.max_t_m_share * diagonal_m);
    const double t_m = clusters.t_m_m;
    const double reach = options.covariance_sigmas > 0 ? 2 * t_m : t_m;
    const std::vector<int> label = link(flat, reach, [&](std::size_t i, std::size_t j, double d) {
        const double shrink = options.covariance_sigmas * std::hypot(spread(points[i]), spread(points[j]));
        return std::max(d - shrink, 0.5 * d) <= t_m;
    });
    std::vector<std::vector<int>> members;
    for (std::size_t i = 0; i < label.size(); ++i) {
        if (label[i] >= static_cast<int>(members.size())) members.emplace_back();
        members[static_cast<std::size_t>(label[i])].push_back(static_cast<int>(i));
    }
    for (const std::vector<int> &group : members) {
        const int n = static_cast<int>(group.size());
        if (n >= options.min_suspected)
            (n >= options.min_points ? clusters.groups : clusters.suspected).push_back(group);
    }
    if (options.t_m_m == 0)
        join_groups(flat, std::min(options.group_reach * t_m, options.max_t_m_share * diagonal_m), &clusters.groups);
    clusters.label.assign(points.size(), -1);
    for (const std::vector<int> &group : clusters.suspected)
        for (const int i : group) clusters.label[static_cast<std::size_t>(i)] = -2;
    for (std::size_t g = 0; g < clusters.groups.size(); ++g)
        for (const int i : clusters.groups[g]) clusters.label[static_cast<std::size_t>(i)] = static_cast<int>(g);
    return clusters;
}

} // namespace outcrop
