// SPDX-License-Identifier: BSD-3-Clause
// Single linkage against the thesis' irregular pyramid written out, and the choice of its threshold.
#include "site/cluster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <random>
#include <set>

#include <gtest/gtest.h>

#include "site/neighbours.h"

namespace outcrop {
namespace {

using Eigen::Vector3d;

constexpr unsigned kSeed = 62;

// ---- the irregular pyramid, thesis 6.2 ----
// A level is a graph of cells. Two cells are neighbours when the nearest points below them are within t_M. Survivors
// are local maxima of a number per cell (no two neighbours survive, each cell that does not survive has a surviving
// neighbour), and each cell that does not survive joins its best surviving neighbour (rule 6.4). Roots: cells
// without neighbours.
class Pyramid {
public:
    Pyramid(const std::vector<Vector3d> &points, double t_m) : points_(points), t_m_(t_m)
    {
        for (std::size_t i = 0; i < points.size(); ++i) cells_.push_back({static_cast<int>(i)});
        while (climb()) {
        }
    }
    // Roots as sets of points.
    std::set<std::vector<int>> roots() const
    {
        std::set<std::vector<int>> roots;
        for (std::vector<int> cell : cells_) {
            std::sort(cell.begin(), cell.end());
            roots.insert(cell);
        }
        return roots;
    }

private:
    double distance(std::size_t a, std::size_t b) const
    {
        double least = std::numeric_limits<double>::infinity();
        for (const int i : cells_[a])
            for (const int j : cells_[b])
                least = std::min(least,
                                 (points_[static_cast<std::size_t>(i)] - points_[static_cast<std::size_t>(j)]).norm());
        return least;
    }
    // One level up; false when every cell is a root.
    bool climb()
    {
        const std::size_t n = cells_.size();
        std::vector<std::vector<std::size_t>> neighbours(n);
        bool has_edge = false;
        for (std::size_t a = 0; a < n; ++a)
            for (std::size_t b = 0; b < n; ++b)
                if (a != b && distance(a, b) <= t_m_) neighbours[a].push_back(b), has_edge = true;
        if (!has_edge) return false;
        // Survival by number of neighbours, then index, as the cell's own value; taken greedily, best first.
        std::vector<std::size_t> order(n);
        for (std::size_t i = 0; i < n; ++i) order[i] = i;
        std::stable_sort(order.begin(), order.end(),
                         [&](std::size_t a, std::size_t b) { return neighbours[a].size() > neighbours[b].size(); });
        std::vector<char> survives(n, 0), is_covered(n, 0);
        for (const std::size_t i : order) {
            if (is_covered[i]) continue;
            survives[i] = 1;
            for (const std::size_t j : neighbours[i]) is_covered[j] = 1;
        }
        std::vector<std::vector<int>> up;
        std::map<std::size_t, std::size_t> place;
        for (std::size_t i = 0; i < n; ++i)
            if (survives[i]) place[i] = up.size(), up.push_back(cells_[i]);
        for (std::size_t i = 0; i < n; ++i) {
            if (survives[i]) continue;
            std::size_t parent = n;
            double least = std::numeric_limits<double>::infinity();
            for (const std::size_t j : neighbours[i])
                if (survives[j] && distance(i, j) < least) least = distance(i, j), parent = j;
            up[place[parent]].insert(up[place[parent]].end(), cells_[i].begin(), cells_[i].end());
        }
        cells_ = std::move(up);
        return true;
    }

    const std::vector<Vector3d> &points_;
    double t_m_;
    std::vector<std::vector<int>> cells_;
};

std::set<std::vector<int>> as_sets(const std::vector<int> &label)
{
    std::map<int, std::vector<int>> by_label;
    for (std::size_t i = 0; i < label.size(); ++i) by_label[label[i]].push_back(static_cast<int>(i));
    std::set<std::vector<int>> sets;
    for (auto &[l, members] : by_label) sets.insert(members);
    return sets;
}

std::vector<Vector3d> random_points(int n, std::mt19937 *rng)
{
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<Vector3d> points;
    for (int i = 0; i < n; ++i) points.emplace_back(uniform(*rng), uniform(*rng), 0.3 * uniform(*rng));
    return points;
}

TEST(SingleLinkage, has_the_roots_of_the_irregular_pyramid)
{
    std::mt19937 rng(kSeed);
    for (const int n : {1, 2, 7, 40, 120})
        for (const double t_m : {0.0, 0.03, 0.08, 0.15, 0.4, 3.0}) {
            const std::vector<Vector3d> points = random_points(n, &rng);
            EXPECT_EQ(as_sets(single_linkage(points, t_m)), Pyramid(points, t_m).roots())
                << n << " points, t_M " << t_m << ", seed " << kSeed;
        }
}

TEST(SingleLinkage, joins_at_the_threshold_and_not_beyond)
{
    const std::vector<Vector3d> row = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3.0000001, 0, 0}};
    EXPECT_EQ(single_linkage(row, 1.0), (std::vector<int>{0, 0, 0, 1}));
    EXPECT_EQ(single_linkage(row, 0.5), (std::vector<int>{0, 1, 2, 3}));
    EXPECT_TRUE(single_linkage({}, 1.0).empty());
    EXPECT_EQ(single_linkage({{1, 2, 3}, {1, 2, 3}}, 0.0), (std::vector<int>{0, 0}));
    EXPECT_THROW(single_linkage(row, std::nan("")), std::invalid_argument);
}

TEST(SpanningEdges, cut_at_t_m_leave_as_many_trees_as_there_are_clusters)
{
    std::mt19937 rng(kSeed + 1);
    const std::vector<Vector3d> points = random_points(100, &rng);
    const std::vector<double> edges = spanning_edges(points, 10);
    ASSERT_EQ(edges.size(), 99u);
    EXPECT_TRUE(std::is_sorted(edges.begin(), edges.end()));
    for (const double t_m : {0.02, 0.05, 0.1, 0.2}) {
        const auto longer = std::count_if(edges.begin(), edges.end(), [&](double e) { return e > t_m; });
        EXPECT_EQ(as_sets(single_linkage(points, t_m)).size(), static_cast<std::size_t>(longer + 1)) << t_m;
    }
}

// Prim's algorithm on the full graph.
std::vector<double> full_spanning_edges(const std::vector<Vector3d> &points)
{
    std::vector<double> edges, nearest(points.size(), std::numeric_limits<double>::infinity());
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
        is_in[next] = 1;
        edges.push_back(least);
        last = next;
    }
    std::sort(edges.begin(), edges.end());
    return edges;
}

TEST(SpanningEdges, are_those_of_the_full_graph_up_to_the_reach)
{
    std::mt19937 rng(kSeed + 2);
    for (const int n : {2, 7, 60, 300}) {
        const std::vector<Vector3d> points = random_points(n, &rng);
        const std::vector<double> full = full_spanning_edges(points);
        for (const double reach : {0.01, 0.06, 0.2, 5.0}) {
            const std::vector<double> edges = spanning_edges(points, reach);
            ASSERT_EQ(edges.size(), full.size());
            for (std::size_t i = 0; i < full.size(); ++i) {
                if (full[i] <= reach) {
                    EXPECT_NEAR(edges[i], full[i], 1e-12) << n << " points, reach " << reach;
                } else {
                    EXPECT_TRUE(std::isinf(edges[i])) << n << " points, reach " << reach;
                }
            }
            EXPECT_EQ(automatic_threshold(edges, reach / 4, reach), automatic_threshold(full, reach / 4, reach));
        }
    }
    EXPECT_TRUE(spanning_edges({}, 1).empty());
    EXPECT_TRUE(spanning_edges({{1, 2, 3}}, 1).empty());
}

TEST(Neighbours, are_those_that_a_search_of_all_pairs_finds)
{
    std::mt19937 rng(kSeed + 3);
    const std::vector<Vector3d> points = random_points(150, &rng);
    for (const double reach : {0.0, 0.03, 0.1, 0.4}) {
        std::size_t n = 0;
        std::vector<char> has(points.size(), 0);
        for (std::size_t i = 0; i < points.size(); ++i)
            for (std::size_t j = i + 1; j < points.size(); ++j)
                if ((points[i] - points[j]).norm() <= reach) ++n, has[i] = has[j] = 1;
        const std::vector<Neighbours> found = neighbours_within(points, reach);
        EXPECT_EQ(found.size(), n) << reach;
        EXPECT_EQ(has_neighbour(points, reach), has) << reach;
        for (std::size_t k = 0; k < found.size(); ++k) {
            EXPECT_LT(found[k].a, found[k].b);
            if (k > 0) {
                EXPECT_LE(found[k - 1].distance, found[k].distance);
            }
        }
    }
}

TEST(AutomaticThreshold, falls_into_the_widest_gap_within_its_bounds)
{
    EXPECT_NEAR(automatic_threshold({0.1, 0.11, 0.12, 0.5, 0.6}, 0.05, 1.0), std::sqrt(0.12 * 0.5), 1e-12);
    // No gap to speak of: the upper bound.
    EXPECT_EQ(automatic_threshold({0.1, 0.12, 0.14, 0.16, 0.18}, 0.09, 0.2), 0.2);
    // The gap lies beyond the upper bound.
    EXPECT_LE(automatic_threshold({0.1, 0.12, 5.0}, 0.05, 0.3), 0.3);
    EXPECT_GE(automatic_threshold({0.001, 0.002}, 0.05, 0.3), 0.05);
    EXPECT_EQ(automatic_threshold({}, 0.05, 0.3), 0.3);
}

SitePoint at(double x, double y, double z)
{
    SitePoint point;
    point.position = Vector3d(x, y, z);
    point.covariance = 1e-6 * Eigen::Matrix3d::Identity();
    return point;
}

// Corners every step along the edges of a box.
void add_box(double x, double y, double w, double h, double step, std::vector<SitePoint> *points)
{
    for (double z = 0.05; z <= h; z += step)
        for (double t = 0; t <= w + 1e-9; t += step)
            for (const auto &[u, v] : {std::pair(t, 0.0), std::pair(t, w), std::pair(0.0, t), std::pair(w, t)})
                points->push_back(at(x + u, y + v, z));
}

TEST(ClusterPoints, tells_objects_apart_and_sets_stragglers_aside)
{
    std::vector<SitePoint> points;
    add_box(-2, -2, 1.0, 0.8, 0.2, &points);
    add_box(1, 1, 0.6, 0.9, 0.15, &points);
    add_box(-0.2, 0.1, 0.4, 0.7, 0.1, &points);
    const std::size_t n_boxes = points.size();
    points.push_back(at(3, -3, 0.2));
    points.push_back(at(2.5, -1, 0.2));
    points.push_back(at(2.55, -1, 0.2));
    const Clusters clusters = cluster_points(points, std::hypot(7, 7));
    EXPECT_EQ(clusters.groups.size(), 3u) << "t_M " << clusters.t_m_m;
    ASSERT_EQ(clusters.suspected.size(), 1u);
    EXPECT_EQ(clusters.suspected[0].size(), 2u);
    EXPECT_EQ(clusters.label[n_boxes], -1);
    EXPECT_EQ(clusters.label[n_boxes + 1], -2);
    EXPECT_EQ(clusters.label[0], 0);
}

TEST(ClusterPoints, joins_the_halves_of_a_torn_body_but_lets_no_stray_point_in)
{
    // Two halves 0.44 apart and a stray point as far off again; dense boxes elsewhere put t_M at sqrt(0.3 * 0.44).
    std::vector<SitePoint> points;
    for (const double x : {0.0, 0.1, 0.2, 0.3, 0.6}) points.push_back(at(x, 0, 0.2));
    for (const double x : {1.04, 1.14, 1.24, 1.34, 1.44}) points.push_back(at(x, 0, 0.2));
    for (SitePoint &p : points) p.n_views = 3;
    points.push_back(at(1.92, 0, 0.2));
    const Clusters joined = cluster_points(points, 14);
    EXPECT_NEAR(joined.t_m_m, std::sqrt(0.3 * 0.44), 1e-9);
    ASSERT_EQ(joined.groups.size(), 1u);
    EXPECT_EQ(joined.groups[0].size(), 10u);
    EXPECT_TRUE(std::is_sorted(joined.groups[0].begin(), joined.groups[0].end()));
    EXPECT_EQ(joined.label, (std::vector<int>{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, -1}));

    ClusterOptions apart;
    apart.group_reach = 1;
    EXPECT_EQ(cluster_points(points, 14, apart).groups.size(), 2u);
    apart = ClusterOptions{};
    apart.t_m_m = joined.t_m_m; // a given t_M is taken by the letter
    EXPECT_EQ(cluster_points(points, 14, apart).groups.size(), 2u);
}

TEST(ClusterPoints, lets_height_count_less_unless_told_otherwise)
{
    std::vector<SitePoint> points;
    for (int i = 0; i < 6; ++i) points.push_back(at(0.01 * i, 0, 0.1)), points.push_back(at(0.01 * i, 0, 0.9));
    ClusterOptions options;
    options.t_m_m = 0.3;
    EXPECT_EQ(cluster_points(points, 10, options).groups.size(), 1u);
    options.z_weight = 1;
    EXPECT_EQ(cluster_points(points, 10, options).groups.size(), 2u);
}

TEST(ClusterPoints, reaches_farther_between_uncertain_points_when_asked)
{
    std::vector<SitePoint> points;
    for (int i = 0; i < 5; ++i) points.push_back(at(0.01 * i, 0, 0.1));
    for (int i = 0; i < 5; ++i) points.push_back(at(0.40 + 0.01 * i, 0, 0.1));
    for (SitePoint &p : points) p.covariance = 0.05 * 0.05 * Eigen::Matrix3d::Identity();
    ClusterOptions options;
    options.t_m_m = 0.3;
    EXPECT_EQ(cluster_points(points, 10, options).groups.size(), 2u);
    options.covariance_sigmas = 1;
    EXPECT_EQ(cluster_points(points, 10, options).groups.size(), 1u);
}

TEST(ClusterPoints, lets_no_stray_make_one_body_of_two)
{
    // Two bodies 0.5 apart, t_M 0.3, and one point half way that only two views agree on.
    std::vector<SitePoint> points;
    for (int i = 0; i < 6; ++i) points.push_back(at(0.01 * i, 0, 0.1)), points.push_back(at(0.55 + 0.01 * i, 0, 0.1));
    for (SitePoint &p : points) p.n_views = 3;
    points.push_back(at(0.29, 0, 0.1));
    ClusterOptions options;
    options.t_m_m = 0.3;
    const Clusters apart = cluster_points(points, 10, options);
    ASSERT_EQ(apart.groups.size(), 2u);
    EXPECT_EQ(apart.label.back(), apart.label[0]) << "it belongs to the nearer";
    points.back().n_views = 3;
    EXPECT_EQ(cluster_points(points, 10, options).groups.size(), 1u) << "three views are no accident";
    points.back().is_doubtful = true;
    EXPECT_EQ(cluster_points(points, 10, options).groups.size(), 2u);
    options.min_company = 0;
    EXPECT_EQ(cluster_points(points, 10, options).groups.size(), 1u);
    // A body of strays only is a body all the same.
    std::vector<SitePoint> thin;
    for (int i = 0; i < 6; ++i) thin.push_back(at(0.25 * i, 0, 0.1));
    EXPECT_EQ(cluster_points(thin, 10, ClusterOptions{}).groups.size(), 1u);
}

TEST(ClusterPoints, takes_no_points_and_refuses_bad_options)
{
    EXPECT_TRUE(cluster_points({}, 10).groups.empty());
    ClusterOptions options;
    options.min_points = 0;
    EXPECT_THROW(cluster_points({}, 10, options), std::invalid_argument);
}

} // namespace
} // namespace outcrop
