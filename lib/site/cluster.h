// SPDX-License-Identifier: BSD-3-Clause
// Points of obstacles grouped by single linkage: the roots of the thesis' irregular pyramid (thesis 6.2, Eq 6.4).
#pragma once

#include <vector>

#include <Eigen/Core>

#include "site/site_model.h"

namespace outcrop {

struct ClusterOptions {
    double t_m_m = 0;            // thesis t_M, metres; 0: from the gap in the edges of the minimum spanning tree
    double min_t_m_share = 0.02; // bounds of the automatic t_M, shares of the area's diagonal
    double max_t_m_share = 0.06;
    double z_weight = 0.35;   // obstacles stand on the ground: a step up counts less than one sideways; 1: thesis
    double group_reach = 1.5; // whole groups nearer than this many automatic t_M are one (a sparse body may be torn
                              // where a stray point must not be let in); still under max_t_m_share
    int min_points = 5;       // fewer: suspected
    int min_suspected = 2;    // fewer: noise
    // A point that two views only agree on, or one in doubt, is a stray when fewer than min_company others are within
    // stray_reach of t_M. Strays join the nearest body but never two bodies. min_company 0: thesis, all points alike.
    double stray_reach = 0.5;
    int min_company = 2;
    double covariance_sigmas = 0; // distances shrink by so many sigmas of the two points, but not below half; 0: thesis
    void check() const;           // throws std::invalid_argument
};

struct Clusters {
    std::vector<int> label;                  // per point: 0.. of groups, -1 noise, -2 suspected
    std::vector<std::vector<int>> groups;    // indices of points, ascending; groups by their least index
    std::vector<std::vector<int>> suspected; // alike, smaller than min_points
    double t_m_m = 0;                        // the threshold in force
};

// Single linkage at t_m: two points are together when a chain of steps <= t_m joins them. Labels 0.. in the order
// of first appearance. Union-find over radius search, O(n log n) for bounded density.
std::vector<int> single_linkage(const std::vector<Eigen::Vector3d> &points, double t_m);

// Lengths of the edges of the Euclidean minimum spanning tree, ascending; those above reach are told as infinite.
// O(n log n + pairs within reach).
std::vector<double> spanning_edges(const std::vector<Eigen::Vector3d> &points, double reach);

// t_M: the middle of the widest relative gap between ascending edge lengths inside [lowest, highest], or highest
// when there is no clear one.
double automatic_threshold(const std::vector<double> &edges, double lowest, double highest);

// diagonal_m: of the working area. Points in world metres.
Clusters cluster_points(const std::vector<SitePoint> &points, double diagonal_m, const ClusterOptions &options = {});

} // namespace outcrop
