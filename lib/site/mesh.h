// SPDX-License-Identifier: BSD-3-Clause
// A closed surface round the occupied voxels: marching cubes (Lorensen and Cline, SIGGRAPH 1987).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "site/voxels.h"

namespace outcrop {

// Triangles counter-clockwise seen from outside; vertices shared.
struct Mesh {
    std::vector<Eigen::Vector3f> vertices; // metres
    std::vector<cv::Vec3b> colours;        // RGB, one per vertex
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

// The surface where the occupancy, smoothed over 3 x 3 x 3 voxels `smoothing` times, is a half. The grid is continued by
// free voxels all round, so the surface is closed, and faces of cubes that are ambiguous are always cut so that occupied
// corners stay apart: every edge belongs to exactly two triangles that run along it in opposite directions.
// Deterministic, O(voxels).
Mesh mesh_of(const VoxelGrid &grid, int smoothing = 1);

// Six times the sum of signed tetrahedra over six: the volume inside, cubic metres.
double volume_of(const Mesh &mesh);

} // namespace outcrop
