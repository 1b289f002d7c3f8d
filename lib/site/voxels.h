// SPDX-License-Identifier: BSD-3-Clause
// A regular grid of cubes standing on the ground, and what is known of each of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace outcrop {

// kUnknown: no view says anything, or what views say does not hold together. Never to be taken for free.
enum class VoxelState : std::uint8_t { kUnknown = 0, kFree = 1, kOccupied = 2 };

// Cell (i, j, k) has its centre at low + (i + 1/2, j + 1/2, k + 1/2) cell_m and the number i + nx (j + ny k).
struct VoxelGrid {
    Eigen::Vector3d low = Eigen::Vector3d::Zero(); // outer corner of cell (0, 0, 0), metres
    double cell_m = 0;
    int nx = 0, ny = 0, nz = 0;

    std::size_t size() const
    {
        return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
    }
    std::size_t at(int i, int j, int k) const
    {
        return static_cast<std::size_t>(i) +
               static_cast<std::size_t>(nx) *
                   (static_cast<std::size_t>(j) + static_cast<std::size_t>(ny) * static_cast<std::size_t>(k));
    }
    bool has(int i, int j, int k) const { return i >= 0 && j >= 0 && k >= 0 && i < nx && j < ny && k < nz; }
    Eigen::Vector3d centre(int i, int j, int k) const
    {
        return low + cell_m * Eigen::Vector3d(i + 0.5, j + 0.5, k + 0.5);
    }
    Eigen::Vector3d high() const { return low + cell_m * Eigen::Vector3d(nx, ny, nz); }
};

// A carved obstacle: grid, a state and a colour for each cell.
struct Voxels {
    VoxelGrid grid;
    std::vector<VoxelState> states; // grid.size()
    std::vector<cv::Vec3b> colours; // RGB, of occupied cells; empty: no colour is known

    bool is_occupied(int i, int j, int k) const
    {
        return grid.has(i, j, k) && states[grid.at(i, j, k)] == VoxelState::kOccupied;
    }
    // A neighbour across one of its six faces is not occupied; the ground hides the lowest faces.
    bool is_surface(int i, int j, int k) const
    {
        return is_occupied(i, j, k) &&
               !(is_occupied(i - 1, j, k) && is_occupied(i + 1, j, k) && is_occupied(i, j - 1, k) &&
                 is_occupied(i, j + 1, k) && (k == 0 || is_occupied(i, j, k - 1)) && is_occupied(i, j, k + 1));
    }
};

} // namespace outcrop
