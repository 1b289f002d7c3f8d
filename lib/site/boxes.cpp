// SPDX-License-Identifier: BSD-3-Clause
// Bounding boxes of clusters, standing on the ground: axis-aligned and turned about the vertical.
#include "site/boxes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <stdexcept>
#include <tuple>

namespace outcrop {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;

double cross(const Vector2d &a, const Vector2d &b)
{
    return a.x() * b.y() - a.y() * b.x();
}

// Into (-pi/2, pi/2]; a box turned by half a turn is the same box.
double fold_yaw(double yaw)
{
    while (yaw > kPi / 2) yaw -= kPi;
    while (yaw <= -kPi / 2) yaw += kPi;
    return yaw;
}

Vector2d direction(double yaw)
{
    return {std::cos(yaw), std::sin(yaw)};
}

struct Extent {
    double low = 0, high = 0;
};

struct Value {
    double at = 0, sigma = 0;
};

// Outermost values without stragglers: from each end, at most trim_share of the values (at least one of ten) leave as
// long as each widens the extent of the rest by more than trim_gap. Then widened by the outermost value's sigma.
Extent robust_extent(std::vector<Value> values, const BoxOptions &options)
{
    std::sort(values.begin(), values.end(),
              [](const Value &a, const Value &b) { return std::tie(a.at, a.sigma) < std::tie(b.at, b.sigma); });
    std::size_t first = 0, last = values.size() - 1;
    const double share = options.trim_share * static_cast<double>(values.size());
    const std::size_t most = values.size() < 10 ? 0 : static_cast<std::size_t>(std::ceil(share));
    for (std::size_t n = 0; n < most; ++n) {
        const double rest = values[last].at - values[first + 1].at;
        if (!(values[first + 1].at - values[first].at > options.trim_gap * rest)) break;
        ++first;
    }
    for (std::size_t n = 0; n < most; ++n) {
        const double rest = values[last - 1].at - values[first].at;
        if (!(values[last].at - values[last - 1].at > options.trim_gap * rest)) break;
        --last;
    }
    // What a sample of a body shows stops short of its ends by about one mean gap.
    const double range = values[last].at - values[first].at;
    const double gap = last > first ? range / static_cast<double>(last - first) : 0;
    const double unseen = std::min(options.widen_gaps * gap, options.max_unseen_share * range);
    return {values[first].at - options.widen_sigmas * values[first].sigma - unseen,
            values[last].at + options.widen_sigmas * values[last].sigma + unseen};
}

Extent extent_along(const std::vector<SitePoint> &points, const std::vector<int> &members, const Vector3d &axis,
                    const BoxOptions &options, double min_size)
{
    std::vector<Value> values;
    for (const int i : members) {
        const SitePoint &p = points[static_cast<std::size_t>(i)];
        values.push_back({axis.dot(p.position), std::sqrt(std::max(0.0, axis.dot(p.covariance * axis)))});
    }
    Extent extent = robust_extent(std::move(values), options);
    const double missing = min_size - (extent.high - extent.low);
    if (missing > 0) extent.low -= missing / 2, extent.high += missing / 2;
    return extent;
}

// Distance of each member to its second nearest neighbour. O(n^2).
std::vector<double> second_distances(const std::vector<SitePoint> &points, const std::vector<int> &members)
{
    std::vector<double> distances;
    for (const int i : members) {
        double nearest = std::numeric_limits<double>::infinity(), second = nearest;
        for (const int j : members) {
            if (i == j) continue;
            const Vector3d &here = points[static_cast<std::size_t>(i)].position;
            const double d = (here - points[static_cast<std::size_t>(j)].position).norm();
            if (d < nearest) {
                second = nearest, nearest = d;
            } else {
                second = std::min(second, d);
            }
        }
        distances.push_back(second);
    }
    return distances;
}

// Without weak points that stand alone: what two views only agree on is wrong now and then.
std::vector<int> trusted(const std::vector<SitePoint> &points, const std::vector<int> &members,
                         const BoxOptions &options)
{
    if (!(options.isolation > 0) || static_cast<int>(members.size()) < options.min_isolation_points) return members;
    const std::vector<double> distances = second_distances(points, members);
    std::vector<double> sorted = distances;
    std::sort(sorted.begin(), sorted.end());
    const double limit = options.isolation * sorted[sorted.size() / 2];
    std::vector<int> kept;
    for (std::size_t i = 0; i < members.size(); ++i)
        if (points[static_cast<std::size_t>(members[i])].n_views > 2 || distances[i] <= limit)
            kept.push_back(members[i]);
    return kept.size() * 2 >= members.size() ? kept : members;
}

// Points that lie within the trimmed extents along X and Y.
std::vector<Vector2d> inner_points(const std::vector<SitePoint> &points, const std::vector<int> &members,
                                   const Extent &x, const Extent &y)
{
    std::vector<Vector2d> inner;
    for (const int i : members) {
        const Vector3d &p = points[static_cast<std::size_t>(i)].position;
        if (p.x() >= x.low && p.x() <= x.high && p.y() >= y.low && p.y() <= y.high) inner.emplace_back(p.x(), p.y());
    }
    return inner;
}

} // namespace

void BoxOptions::check() const
{
    if (!(trim_share >= 0) || !(trim_share < 0.5) || !(trim_gap > 0) || !(widen_sigmas >= 0))
        throw std::invalid_argument("boxes: trim_share in [0, 0.5), trim_gap > 0, widen_sigmas >= 0");
    if (!(widen_gaps >= 0) || !(max_unseen_share >= 0))
        throw std::invalid_argument("boxes: widen_gaps and max_unseen_share must be >= 0");
    if (!(isolation >= 0) || min_isolation_points < 3)
        throw std::invalid_argument("boxes: isolation must be >= 0, min_isolation_points >= 3");
    if (!(min_size_m >= 0) || !(min_size_share >= 0) || !(merge_overlap > 0))
        throw std::invalid_argument("boxes: sizes must be >= 0, merge_overlap > 0");
}

// Andrew's monotone chain.
std::vector<Vector2d> convex_hull(std::vector<Vector2d> points)
{
    const auto less = [](const Vector2d &a, const Vector2d &b) {
        return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
    };
    std::sort(points.begin(), points.end(), less);
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (points.size() < 3) return points;
    std::vector<Vector2d> hull;
    const auto push = [&hull](const Vector2d &p, std::size_t least) {
        while (hull.size() > least && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0) hull.pop_back();
        hull.push_back(p);
    };
    for (const Vector2d &p : points) push(p, 1);
    const std::size_t lower = hull.size();
    for (std::size_t i = points.size() - 1; i-- > 0;) push(points[i], lower);
    hull.pop_back();
    return hull;
}

Rectangle min_area_rectangle(const std::vector<Vector2d> &points)
{
    const std::vector<Vector2d> hull = convex_hull(points);
    Rectangle best;
    if (hull.empty()) return best;
    if (hull.size() == 1) {
        best.centre = hull[0];
        return best;
    }
    double best_area = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < hull.size(); ++i) {
        const Vector2d along = (hull[(i + 1) % hull.size()] - hull[i]).normalized(), across(-along.y(), along.x());
        Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
        for (const Vector2d &p : hull) {
            const Vector2d q(along.dot(p), across.dot(p));
            low = low.cwiseMin(q), high = high.cwiseMax(q);
        }
        const Vector2d size = high - low, middle = (low + high) / 2;
        if (!(size.x() * size.y() < best_area * (1 - 1e-12))) continue;
        best_area = size.x() * size.y();
        best.centre = middle.x() * along + middle.y() * across;
        const bool is_along = size.x() >= size.y();
        best.size = is_along ? size : Vector2d(size.y(), size.x());
        const Vector2d axis = is_along ? along : across;
        best.yaw_rad = fold_yaw(std::atan2(axis.y(), axis.x()));
    }
    return best;
}

Obstacle fit_box(const std::vector<SitePoint> &points, const std::vector<int> &group, double diagonal_m,
                 const BoxOptions &options)
{
    if (group.empty()) throw std::invalid_argument("boxes: a box needs points");
    const std::vector<int> members = trusted(points, group, options);
    const double min_size = options.min_size_m > 0 ? options.min_size_m : options.min_size_share * diagonal_m;
    const auto extent = [&](const Vector3d &axis) { return extent_along(points, members, axis, options, min_size); };
    const Extent x = extent(Vector3d::UnitX()), y = extent(Vector3d::UnitY()), z = extent(Vector3d::UnitZ());
    const double floor = options.down_to_ground ? 0 : z.low;
    const double top = std::max(z.high, floor + min_size);

    Obstacle box;
    box.n_points = static_cast<int>(group.size());
    box.aabb_min = Vector3d(x.low, y.low, floor);
    box.aabb_max = Vector3d(x.high, y.high, top);
    const Rectangle tight = min_area_rectangle(inner_points(points, members, x, y));
    box.yaw_rad = tight.yaw_rad;
    const Vector2d along = direction(tight.yaw_rad), across(-along.y(), along.x());
    const Extent u = extent({along.x(), along.y(), 0}), v = extent({across.x(), across.y(), 0});
    const Vector2d centre = (u.low + u.high) / 2 * along + (v.low + v.high) / 2 * across;
    box.obb_centre = Vector3d(centre.x(), centre.y(), (floor + top) / 2);
    box.obb_size = Vector3d(u.high - u.low, v.high - v.low, top - floor);
    return box;
}

double largest_side(const Obstacle &box)
{
    return std::max({box.obb_size.x(), box.obb_size.y(), box.aabb_max.z()});
}

bool footprint_contains(const Obstacle &box, double x, double y, double grow_m)
{
    const Vector2d along = direction(box.yaw_rad), across(-along.y(), along.x());
    const Vector2d off(x - box.obb_centre.x(), y - box.obb_centre.y());
    return std::abs(along.dot(off)) <= box.obb_size.x() / 2 + grow_m &&
           std::abs(across.dot(off)) <= box.obb_size.y() / 2 + grow_m;
}

double distance_outside(const Obstacle &box, double x, double y)
{
    const Vector2d along = direction(box.yaw_rad), across(-along.y(), along.x());
    const Vector2d off(x - box.obb_centre.x(), y - box.obb_centre.y());
    const double beyond_x = std::abs(along.dot(off)) - box.obb_size.x() / 2;
    const double beyond_y = std::abs(across.dot(off)) - box.obb_size.y() / 2;
    return std::max({0.0, beyond_x, beyond_y});
}

double aabb_iou(const Vector3d &min_a, const Vector3d &max_a, const Vector3d &min_b, const Vector3d &max_b)
{
    const Vector3d both = (max_a.cwiseMin(max_b) - min_a.cwiseMax(min_b)).cwiseMax(0.0);
    const double shared = both.prod();
    const double all = (max_a - min_a).prod() + (max_b - min_b).prod() - shared;
    return all > 0 ? shared / all : 0;
}

namespace {

std::vector<Vector2d> corners(const Obstacle &box)
{
    const Vector2d along = direction(box.yaw_rad), across(-along.y(), along.x());
    const Vector2d centre = box.obb_centre.head<2>();
    const Vector2d a = box.obb_size.x() / 2 * along, b = box.obb_size.y() / 2 * across;
    return {centre - a - b, centre + a - b, centre + a + b, centre - a + b};
}

double polygon_area(const std::vector<Vector2d> &p)
{
    double twice = 0;
    for (std::size_t i = 0; i < p.size(); ++i) twice += cross(p[i], p[(i + 1) % p.size()]);
    return twice / 2;
}

// Sutherland-Hodgman, both counter-clockwise.
double shared_footprint(const Obstacle &a, const Obstacle &b)
{
    std::vector<Vector2d> polygon = corners(a);
    const std::vector<Vector2d> clip = corners(b);
    for (std::size_t e = 0; e < clip.size() && !polygon.empty(); ++e) {
        const Vector2d from = clip[e], edge = clip[(e + 1) % clip.size()] - from;
        std::vector<Vector2d> kept;
        for (std::size_t i = 0; i < polygon.size(); ++i) {
            const Vector2d &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
            const double side_p = cross(edge, p - from), side_q = cross(edge, q - from);
            if (side_p >= 0) kept.push_back(p);
            if ((side_p >= 0) != (side_q >= 0)) kept.push_back(p + side_p / (side_p - side_q) * (q - p));
        }
        polygon = std::move(kept);
    }
    return polygon.size() < 3 ? 0 : polygon_area(polygon);
}

double footprint_area(const Obstacle &box)
{
    return box.obb_size.x() * box.obb_size.y();
}

struct Boxed {
    std::vector<int> members;
    Obstacle box;
};

// Joins the first two that overlap, until none do.
void merge_overlapping(const std::vector<SitePoint> &points, double diagonal_m, const BoxOptions &options,
                       std::vector<Boxed> *boxes)
{
    for (std::size_t i = 0; i < boxes->size(); ++i) {
        for (std::size_t j = i + 1; j < boxes->size(); ++j) {
            Boxed &a = (*boxes)[i], &b = (*boxes)[j];
            const double smaller = std::min(footprint_area(a.box), footprint_area(b.box));
            if (!(shared_footprint(a.box, b.box) > options.merge_overlap * smaller)) continue;
            a.members.insert(a.members.end(), b.members.begin(), b.members.end());
            std::sort(a.members.begin(), a.members.end());
            a.box = fit_box(points, a.members, diagonal_m, options);
            boxes->erase(boxes->begin() + static_cast<std::ptrdiff_t>(j));
            i = static_cast<std::size_t>(-1); // from the start: the grown box may reach others
            break;
        }
    }
}

std::vector<Boxed> boxed(const std::vector<std::vector<int>> &groups, const std::vector<SitePoint> &points,
                         double diagonal_m, const BoxOptions &options)
{
    std::vector<Boxed> boxes;
    for (const std::vector<int> &members : groups)
        boxes.push_back({members, fit_box(points, members, diagonal_m, options)});
    return boxes;
}

// Groups whose centre stands in a box already belong to it; the box does not grow for them.
void absorb(const std::vector<Boxed> &boxes, std::vector<Boxed> *small, std::vector<SitePoint> *points)
{
    std::vector<Boxed> left;
    for (Boxed &s : *small) {
        int home = -1;
        for (std::size_t i = 0; i < boxes.size() && home < 0; ++i)
            if (footprint_contains(boxes[i].box, s.box.obb_centre.x(), s.box.obb_centre.y()))
                home = static_cast<int>(i);
        for (const int i : s.members) (*points)[static_cast<std::size_t>(i)].obstacle = home >= 0 ? home : -2;
        if (home < 0) left.push_back(std::move(s));
    }
    *small = std::move(left);
}

void number(bool is_suspected, std::vector<Boxed> *boxes, std::vector<Obstacle> *out)
{
    std::sort(boxes->begin(), boxes->end(), [](const Boxed &a, const Boxed &b) {
        return std::tuple(-a.box.n_points, a.box.obb_centre.x(), a.box.obb_centre.y(), a.members) <
               std::tuple(-b.box.n_points, b.box.obb_centre.x(), b.box.obb_centre.y(), b.members);
    });
    out->clear();
    for (Boxed &b : *boxes) {
        b.box.is_suspected = is_suspected;
        b.box.index = static_cast<int>(out->size()) + 1;
        out->push_back(b.box);
    }
}

} // namespace

void make_boxes(const Clusters &clusters, double diagonal_m, const BoxOptions &options, std::vector<SitePoint> *points,
                std::vector<Obstacle> *obstacles, std::vector<Obstacle> *suspected)
{
    options.check();
    std::vector<Boxed> whole = boxed(clusters.groups, *points, diagonal_m, options);
    merge_overlapping(*points, diagonal_m, options, &whole);
    number(false, &whole, obstacles);
    for (SitePoint &p : *points) p.obstacle = -1;
    for (std::size_t i = 0; i < whole.size(); ++i)
        for (const int member : whole[i].members)
            (*points)[static_cast<std::size_t>(member)].obstacle = static_cast<int>(i);
    std::vector<Boxed> small = boxed(clusters.suspected, *points, diagonal_m, options);
    absorb(whole, &small, points);
    number(true, &small, suspected);
}

} // namespace outcrop
