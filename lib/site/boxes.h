// SPDX-License-Identifier: BSD-3-Clause
// Bounding boxes of clusters, standing on the ground: axis-aligned and turned about the vertical.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "site/cluster.h"
#include "site/site_model.h"

namespace outcrop {

struct BoxOptions {
    // A point seen by two views only has no say in the box when its second nearest neighbour in the cluster is farther
    // than this many times the median of such distances; in clusters of at least min_isolation_points. 0: all have.
    double isolation = 2.7;
    int min_isolation_points = 8;
    double trim_share = 0.02;  // of the points may lie outside at each end ...
    double trim_gap = 0.4;     // ... but only while each widens the extent of the rest by more than this share
    double widen_sigmas = 1.0; // of the outermost points, on every side but the ground's
    double widen_gaps = 1.0;   // mean gaps between the points along a side that the body goes on beyond the outermost:
                               // the unbiased end of a uniform sample; 0: thesis
    double max_unseen_share = 0.12; // of the extent, at each end, for clusters of few points
    double min_size_m = 0;          // least side; 0: min_size_share of the diagonal
    double min_size_share = 0.004;
    double merge_overlap = 0.15; // of the smaller footprint: two boxes that share more are one
    bool down_to_ground = true;  // false: thesis, the points' own least Z
    void check() const;          // throws std::invalid_argument
};

// A rectangle in the plane: centre, size.x along yaw, yaw counter-clockwise from +X in (-pi/2, pi/2].
struct Rectangle {
    Eigen::Vector2d centre = Eigen::Vector2d::Zero(), size = Eigen::Vector2d::Zero();
    double yaw_rad = 0;
};

// Counter-clockwise, no three collinear; fewer than 3 points when the input is degenerate. O(n log n).
std::vector<Eigen::Vector2d> convex_hull(std::vector<Eigen::Vector2d> points);

// Least-area rectangle round the points: one side lies on an edge of the hull (rotating calipers). size.x >= size.y.
Rectangle min_area_rectangle(const std::vector<Eigen::Vector2d> &points);

// Box of the points of one cluster; throws std::invalid_argument when there are none.
Obstacle fit_box(const std::vector<SitePoint> &points, const std::vector<int> &members, double diagonal_m,
                 const BoxOptions &options = {});

// Clusters to boxes: groups whose footprints (oriented) overlap by more than merge_overlap of the smaller are merged
// first, small groups inside a larger one's box join it. Indices from 1, by descending number of points, then by
// centre. Writes SitePoint::obstacle (index in model.obstacles, -1 none, -2 suspected).
void make_boxes(const Clusters &clusters, double diagonal_m, const BoxOptions &options, std::vector<SitePoint> *points,
                std::vector<Obstacle> *obstacles, std::vector<Obstacle> *suspected);

double largest_side(const Obstacle &box); // height included

// Is a ground point inside the oriented footprint grown by `grow_m`?
bool footprint_contains(const Obstacle &box, double x, double y, double grow_m = 0);

// By how much the oriented footprint has to grow to hold a ground point; 0 inside.
double distance_outside(const Obstacle &box, double x, double y);

// Intersection over union of axis-aligned boxes.
double aabb_iou(const Eigen::Vector3d &min_a, const Eigen::Vector3d &max_a, const Eigen::Vector3d &min_b,
                const Eigen::Vector3d &max_b);

} // namespace outcrop
