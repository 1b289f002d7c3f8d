// SPDX-License-Identifier: BSD-3-Clause
// A k-d tree, and pairs in an order that does not depend on it.
#include "site/neighbours.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <tuple>
#include <utility>

#include <nanoflann.hpp>

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

// Calls take(i, j, distance) for every ordered pair within reach.
template <typename Take>
void for_neighbours(const std::vector<Vector3d> &points, double reach, const Take &take)
{
    if (points.empty()) return;
    const Cloud cloud{points};
    Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10));
    tree.buildIndex();
    // The search radius is squared and open; a little more finds those exactly at the limit.
    const double radius = reach * reach * (1 + 1e-9) + std::numeric_limits<double>::min();
    nanoflann::SearchParams unsorted;
    unsorted.sorted = false;
    std::vector<std::pair<std::uint32_t, double>> found;
    for (std::size_t i = 0; i < points.size(); ++i) {
        tree.radiusSearch(points[i].data(), radius, found, unsorted);
        for (const auto &[j, square] : found)
            if (j != i && std::sqrt(square) <= reach) take(i, static_cast<std::size_t>(j), std::sqrt(square));
    }
}

} // namespace

std::vector<Neighbours> neighbours_within(const std::vector<Vector3d> &points, double reach)
{
    std::vector<Neighbours> pairs;
    for_neighbours(points, reach, [&](std::size_t i, std::size_t j, double distance) {
        if (i < j) pairs.push_back({static_cast<int>(i), static_cast<int>(j), distance});
    });
    std::sort(pairs.begin(), pairs.end(), [](const Neighbours &p, const Neighbours &q) {
        return std::tie(p.distance, p.a, p.b) < std::tie(q.distance, q.a, q.b);
    });
    return pairs;
}

std::vector<char> has_neighbour(const std::vector<Vector3d> &points, double reach)
{
    std::vector<char> has(points.size(), 0);
    for_neighbours(points, reach, [&](std::size_t i, std::size_t, double) { has[i] = 1; });
    return has;
}

std::vector<std::vector<int>> nearest_of(const std::vector<Vector3d> &points, const std::vector<Vector3d> &queries,
                                         std::size_t k)
{
    std::vector<std::vector<int>> all(queries.size());
    if (points.empty() || k == 0) return all;
    const Cloud cloud{points};
    Tree tree(3, cloud, nanoflann::KDTreeSingleIndexAdaptorParams(10));
    tree.buildIndex();
    std::vector<std::uint32_t> found(k);
    std::vector<double> squares(k);
    for (std::size_t q = 0; q < queries.size(); ++q) {
        const std::size_t n = tree.knnSearch(queries[q].data(), k, found.data(), squares.data());
        for (std::size_t i = 0; i < n; ++i) all[q].push_back(static_cast<int>(found[i]));
    }
    return all;
}

} // namespace outcrop
