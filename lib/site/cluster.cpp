// SPDX-License-Identifier: BSD-3-Clause
// Points of obstacles grouped by single linkage: the roots of the thesis' irregular pyramid (thesis 6.2, Eq 6.4).
#include "site/cluster.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <stdexcept>

#include "site/components.h"
#include "site/neighbours.h"

namespace outcrop {

namespace {

using Eigen::Vector3d;

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
    if (!(stray_reach >= 0) || min_company < 0)
        throw std::invalid_argument("cluster: stray_reach and min_company must be >= 0");
    if (!(covariance_sigmas >= 0)) throw std::invalid_argument("cluster: covariance_sigmas must be >= 0");
}

std::vector<int> single_linkage(const std::vector<Vector3d> &points, double t_m)
{
    if (!(t_m >= 0)) throw std::invalid_argument("cluster: t_M must be >= 0");
    DisjointSets sets(points.size());
    for (const Neighbours &n : neighbours_within(points, t_m)) sets.join(n.a, n.b);
    return labels_of(&sets, points.size());
}

// Kruskal's algorithm: the pairs within reach hold every edge of the full tree that is not longer.
std::vector<double> spanning_edges(const std::vector<Vector3d> &points, double reach)
{
    DisjointSets sets(points.size());
    std::vector<double> edges;
    for (const Neighbours &n : neighbours_within(points, reach)) {
        if (sets.root(n.a) == sets.root(n.b)) continue;
        sets.join(n.a, n.b);
        edges.push_back(n.distance);
    }
    if (points.size() > 1) edges.resize(points.size() - 1, std::numeric_limits<double>::infinity());
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

// Points of two views, or in doubt, that stand alone: they belong to what they are nearest to, but do not make one
// body of two. An accident of matching lies anywhere, also half way.
std::vector<char> find_strays(const std::vector<Vector3d> &flat, const std::vector<SitePoint> &points, double t_m,
                              const ClusterOptions &options)
{
    std::vector<int> company(points.size(), 0);
    for (const Neighbours &n : neighbours_within(flat, options.stray_reach * t_m)) {
        ++company[static_cast<std::size_t>(n.a)];
        ++company[static_cast<std::size_t>(n.b)];
    }
    std::vector<char> is_stray(points.size(), 0);
    for (std::size_t i = 0; i < points.size(); ++i)
        is_stray[i] = (points[i].n_views <= 2 || points[i].is_doubtful) && company[i] < options.min_company;
    return is_stray;
}

class Linker {
public:
    Linker(const std::vector<Vector3d> &flat, const std::vector<SitePoint> &points, double t_m,
           const ClusterOptions &options)
        : flat_(flat), points_(points), t_m_(t_m), options_(options), sets_(points.size()),
          is_stray_(find_strays(flat, points, t_m, options)), has_body_(points.size())
    {
        for (std::size_t i = 0; i < points.size(); ++i) has_body_[i] = !is_stray_[i];
    }

    std::vector<int> link()
    {
        // Shortest steps first: a stray goes to the nearer of two bodies.
        const double reach = options_.covariance_sigmas > 0 ? 2 * t_m_ : t_m_;
        for (const Neighbours &n : neighbours_within(flat_, reach))
            if (is_near(n)) join(n);
        return labels_of(&sets_, points_.size());
    }

private:
    bool is_near(const Neighbours &n) const
    {
        const double sum = std::hypot(spread(points_[at(n.a)]), spread(points_[at(n.b)]));
        return std::max(n.distance - options_.covariance_sigmas * sum, 0.5 * n.distance) <= t_m_;
    }

    void join(const Neighbours &n)
    {
        const std::size_t a = at(sets_.root(n.a)), b = at(sets_.root(n.b));
        const bool is_bridge = is_stray_[at(n.a)] || is_stray_[at(n.b)];
        if (a == b || (is_bridge && has_body_[a] && has_body_[b])) return;
        const char has_body = has_body_[a] || has_body_[b];
        has_body_[at(sets_.join(n.a, n.b))] = has_body;
    }

    static std::size_t at(int i) { return static_cast<std::size_t>(i); }

    const std::vector<Vector3d> &flat_;
    const std::vector<SitePoint> &points_;
    double t_m_;
    const ClusterOptions &options_;
    DisjointSets sets_;
    std::vector<char> is_stray_, has_body_;
};

// Groups with points not farther apart than reach become one; strays do not count. In the order of the first of each.
void join_groups(const std::vector<Vector3d> &flat, const std::vector<char> &is_stray, double reach,
                 std::vector<std::vector<int>> *groups)
{
    std::vector<int> group_of(flat.size(), -1);
    for (std::size_t g = 0; g < groups->size(); ++g)
        for (const int i : (*groups)[g])
            if (!is_stray[static_cast<std::size_t>(i)]) group_of[static_cast<std::size_t>(i)] = static_cast<int>(g);
    DisjointSets sets(groups->size());
    for (const Neighbours &n : neighbours_within(flat, reach)) {
        const int a = group_of[static_cast<std::size_t>(n.a)], b = group_of[static_cast<std::size_t>(n.b)];
        if (a >= 0 && b >= 0) sets.join(a, b);
    }
    std::map<int, std::vector<int>> joined; // roots are least members: the order stays
    for (std::size_t g = 0; g < groups->size(); ++g) {
        std::vector<int> &members = joined[sets.root(static_cast<int>(g))];
        members.insert(members.end(), (*groups)[g].begin(), (*groups)[g].end());
    }
    groups->clear();
    for (auto &[root, members] : joined) {
        std::sort(members.begin(), members.end());
        groups->push_back(std::move(members));
    }
}

} // namespace

Clusters cluster_points(const std::vector<SitePoint> &points, double diagonal_m, const ClusterOptions &options)
{
    options.check();
    Clusters clusters;
    const std::vector<Vector3d> flat = flattened(points, options.z_weight);
    const double highest = options.max_t_m_share * diagonal_m;
    clusters.t_m_m = options.t_m_m > 0 ? options.t_m_m
                                       : automatic_threshold(spanning_edges(flat, highest),
                                                             options.min_t_m_share * diagonal_m, highest);
    const double t_m = clusters.t_m_m;
    const std::vector<int> label = Linker(flat, points, t_m, options).link();
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
        join_groups(flat, find_strays(flat, points, t_m, options), std::min(options.group_reach * t_m, highest),
                    &clusters.groups);
    clusters.label.assign(points.size(), -1);
    for (const std::vector<int> &group : clusters.suspected)
        for (const int i : group) clusters.label[static_cast<std::size_t>(i)] = -2;
    for (std::size_t g = 0; g < clusters.groups.size(); ++g)
        for (const int i : clusters.groups[g]) clusters.label[static_cast<std::size_t>(i)] = static_cast<int>(g);
    return clusters;
}

} // namespace outcrop
