// SPDX-License-Identifier: BSD-3-Clause
// Boxes and convex polygons: overlap in closed form.
#include "geometry.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace outcrop::eval {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double cross2(const Vector2d &a, const Vector2d &b)
{
    return a.x() * b.y() - a.y() * b.x();
}

double overlap_m3(const Box &a, const Box &b)
{
    return (a.max_m.cwiseMin(b.max_m) - a.min_m.cwiseMax(b.min_m)).cwiseMax(0).prod();
}

double ratio(double common, double a, double b)
{
    const double whole = a + b - common;
    return whole > 0 ? common / whole : 0;
}

// Into (-pi/2, pi/2]: a box looks the same after half a turn.
double fold_yaw(double yaw)
{
    yaw = std::remainder(yaw, M_PI);
    return yaw <= -M_PI / 2 ? yaw + M_PI : yaw;
}

// The rectangle with one side along `u` round the hull.
YawBox box_along(const Polygon &hull, const Vector2d &u)
{
    const Vector2d v(-u.y(), u.x());
    Vector2d low = Vector2d::Constant(std::numeric_limits<double>::infinity()), high = -low;
    for (const Vector2d &p : hull) {
        const Vector2d q(u.dot(p), v.dot(p));
        low = low.cwiseMin(q);
        high = high.cwiseMax(q);
    }
    const Vector2d mid = (low + high) / 2;
    YawBox box;
    box.centre_m.head<2>() = mid.x() * u + mid.y() * v;
    box.size_m.head<2>() = high - low;
    box.yaw_rad = fold_yaw(std::atan2(u.y(), u.x()));
    return box;
}

} // namespace

double contained_share(const Box &inner, const Box &outer)
{
    const double volume = inner.volume_m3();
    return volume > 0 ? overlap_m3(inner, outer) / volume : 0;
}

double iou(const Box &a, const Box &b)
{
    return ratio(overlap_m3(a, b), a.volume_m3(), b.volume_m3());
}

double iou(const YawBox &a, const YawBox &b)
{
    const auto low = [](const YawBox &x) { return x.centre_m.z() - x.size_m.z() / 2; };
    const auto high = [](const YawBox &x) { return x.centre_m.z() + x.size_m.z() / 2; };
    const double height = std::max(0.0, std::min(high(a), high(b)) - std::max(low(a), low(b)));
    const double common = height * area(intersect_convex(footprint(a), footprint(b)));
    return ratio(common, a.size_m.prod(), b.size_m.prod());
}

double area(const Polygon &p)
{
    double twice = 0;
    for (std::size_t i = 0; i < p.size(); i++) twice += cross2(p[i], p[(i + 1) % p.size()]);
    return twice / 2;
}

Polygon footprint(const YawBox &box)
{
    const Vector2d u(std::cos(box.yaw_rad), std::sin(box.yaw_rad)), v(-u.y(), u.x());
    const Vector2d c = box.centre_m.head<2>();
    const Vector2d a = u * (box.size_m.x() / 2), b = v * (box.size_m.y() / 2);
    return {c - a - b, c + a - b, c + a + b, c - a + b};
}

Polygon intersect_convex(const Polygon &a, const Polygon &b)
{
    Polygon out = a;
    for (std::size_t e = 0; e < b.size() && !out.empty(); e++) {
        const Vector2d from = b[e], edge = b[(e + 1) % b.size()] - from;
        Polygon kept;
        for (std::size_t i = 0; i < out.size(); i++) {
            const Vector2d p = out[i], q = out[(i + 1) % out.size()];
            const double dp = cross2(edge, p - from), dq = cross2(edge, q - from);
            if (dp >= 0) kept.push_back(p);
            if ((dp >= 0) != (dq >= 0)) kept.push_back(p + (q - p) * (dp / (dp - dq)));
        }
        out = std::move(kept);
    }
    return out;
}

Polygon convex_hull(std::vector<Vector2d> points)
{
    std::sort(points.begin(), points.end(),
              [](const Vector2d &a, const Vector2d &b) { return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y(); });
    points.erase(std::unique(points.begin(), points.end()), points.end());
    if (points.size() < 3) return points;
    Polygon hull;
    // Andrew's monotone chain: the lower side, then the upper side backwards.
    for (int side = 0; side < 2; side++) {
        const std::size_t start = hull.size();
        for (const Vector2d &p : points) {
            while (hull.size() >= start + 2 && cross2(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
                hull.pop_back();
            hull.push_back(p);
        }
        hull.pop_back();
        std::reverse(points.begin(), points.end());
    }
    return hull;
}

YawBox min_area_box(const std::vector<Vector3d> &points_m)
{
    std::vector<Vector2d> flat;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vector3d &p : points_m) {
        flat.push_back(p.head<2>());
        low = std::min(low, p.z());
        high = std::max(high, p.z());
    }
    const Polygon hull = convex_hull(std::move(flat));
    YawBox best = box_along(hull, Vector2d::UnitX());
    for (std::size_t i = 0; i < hull.size(); i++) {
        const Vector2d edge = hull[(i + 1) % hull.size()] - hull[i];
        if (!(edge.norm() > 0)) continue;
        const YawBox box = box_along(hull, edge.normalized());
        if (box.size_m.head<2>().prod() < best.size_m.head<2>().prod()) best = box;
    }
    best.centre_m.z() = (low + high) / 2;
    best.size_m.z() = high - low;
    return best;
}

} // namespace outcrop::eval
