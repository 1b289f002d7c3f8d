// SPDX-License-Identifier: BSD-3-Clause
// Which points in space lie near each other.
#pragma once

#include <vector>

#include <Eigen/Core>

namespace outcrop {

struct Neighbours {
    int a = 0, b = 0; // a < b
    double distance = 0;
};

// All pairs not farther apart than reach, ascending (distance, a, b). O(n log n + pairs).
std::vector<Neighbours> neighbours_within(const std::vector<Eigen::Vector3d> &points, double reach);

// Per point: is another one within reach?
std::vector<char> has_neighbour(const std::vector<Eigen::Vector3d> &points, double reach);

// For each of the queries the k nearest points (fewer when there are fewer), nearest first. O((n + queries) log n).
std::vector<std::vector<int>> nearest_of(const std::vector<Eigen::Vector3d> &points,
                                         const std::vector<Eigen::Vector3d> &queries, std::size_t k);

} // namespace outcrop
