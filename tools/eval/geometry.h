/* SPDX-License-Identifier: BSD-3-Clause
 * Boxes and convex polygons: overlap in closed form. */
#ifndef OUTCROP_EVAL_GEOMETRY_H
#define OUTCROP_EVAL_GEOMETRY_H

#include <Eigen/Core>
#include <vector>

namespace outcrop::eval {

/* Axis-aligned, metres. */
struct Box {
    Eigen::Vector3d min_m = Eigen::Vector3d::Zero(), max_m = Eigen::Vector3d::Zero();

    double volume_m3() const { return (max_m - min_m).cwiseMax(0).prod(); }
    Eigen::Vector3d centre_m() const { return (min_m + max_m) / 2; }
};

/* Upright, turned about Z; size_m[0] lies along the yaw direction
 * (counter-clockwise from +X, in (-pi/2, pi/2]). */
struct YawBox {
    Eigen::Vector3d centre_m = Eigen::Vector3d::Zero(), size_m = Eigen::Vector3d::Zero();
    double yaw_rad = 0;
};

using Polygon = std::vector<Eigen::Vector2d>; /* counter-clockwise */

/* Share of `inner`'s volume that lies in `outer`; 0 for an empty `inner`. */
double contained_share(const Box &inner, const Box &outer);

/* Volume of the intersection over that of the union, 0..1; 0 when both are empty. */
double iou(const Box &a, const Box &b);
double iou(const YawBox &a, const YawBox &b);

double area(const Polygon &p);
Polygon footprint(const YawBox &box);
/* Sutherland-Hodgman; exact for two convex polygons. */
Polygon intersect_convex(const Polygon &a, const Polygon &b);
/* Without collinear points. */
Polygon convex_hull(std::vector<Eigen::Vector2d> points);

/* The upright box of least ground area round the points (one side of it lies
 * on a side of their hull). At least one point. */
YawBox min_area_box(const std::vector<Eigen::Vector3d> &points_m);

} // namespace outcrop::eval
#endif
