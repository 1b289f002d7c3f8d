// SPDX-License-Identifier: BSD-3-Clause
// A volume of voxels: what is occupied, free and unknown, with colour.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace outcrop {

enum class VoxelState : std::uint8_t { kFree, kOccupied, kUnknown };

// Voxel (i, j, k) is the cube round min_m + (i + 0.5, j + 0.5, k + 0.5) size_m; axes are the world's.
struct VoxelGrid {
    Eigen::Vector3d min_m = Eigen::Vector3d::Zero();
    double size_m = 0;
    int nx = 0, ny = 0, nz = 0;
    std::vector<VoxelState> state; // x fastest, then y, then z
    std::vector<cv::Vec3b> colour; // RGB; empty when there is none

    std::size_t size() const { return state.size(); }
    std::size_t index(int i, int j, int k) const
    {
        return (static_cast<std::size_t>(k) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j)) *
                   static_cast<std::size_t>(nx) +
               static_cast<std::size_t>(i);
    }
    Eigen::Vector3d centre(int i, int j, int k) const
    {
        return min_m + size_m * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5);
    }
    // Outside the grid: free.
    bool is_occupied(int i, int j, int k) const
    {
        return i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz &&
               state[index(i, j, k)] == VoxelState::kOccupied;
    }
    // Occupied, with a neighbour across a face that is not; the ground counts as occupied.
    bool is_surface(int i, int j, int k) const
    {
        return is_occupied(i, j, k) &&
               !(is_occupied(i - 1, j, k) && is_occupied(i + 1, j, k) && is_occupied(i, j - 1, k) &&
                 is_occupied(i, j + 1, k) && (k == 0 || is_occupied(i, j, k - 1)) && is_occupied(i, j, k + 1));
    }
};

} // namespace outcrop
