// SPDX-License-Identifier: BSD-3-Clause
// The closed surface of occupied voxels.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "site/voxels.h"

namespace outcrop {

// Triangles counter-clockwise seen from outside; metres.
struct SurfaceMesh {
    std::vector<Eigen::Vector3f> vertices;
    std::vector<cv::Vec3b> colours; // RGB, one per vertex
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

// Marching cubes over the voxels' centres: every occupied centre lies inside, every other one outside. Closed: each
// edge belongs to two triangles that run along it in opposite directions; on the ground it ends at Z = 0. The level is
// that of the occupancy averaged over three by three by three voxels, which takes the steps off slanted faces.
// Without colours in the voxels it is grey. Empty when nothing is occupied.
SurfaceMesh mesh_of(const Voxels &voxels);

} // namespace outcrop
