// SPDX-License-Identifier: BSD-3-Clause
// The surface of carved voxels, and how far it is from a camera pixel by pixel.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "core/camera.h"
#include "site/voxels.h"

namespace outcrop {

struct SurfaceVoxel {
    int i = 0, j = 0, k = 0;
    std::size_t at = 0; // in the grid
};

// Occupied voxels with a free or unknown neighbour, in the grid's order. with_bottom: also those on the ground.
std::vector<SurfaceVoxel> surface_of(const Voxels &voxels, bool with_bottom = false);

struct VoxelPixel {
    double x_px = 0, y_px = 0, depth_m = 0; // depth <= 0: behind
};

// A camera as it looks at cells of a grid.
class GridCamera {
public:
    GridCamera(const oc_camera_t &camera, const VoxelGrid &grid);

    VoxelPixel project(int i, int j, int k) const;
    // Half a cell at that depth, pixels, so that neighbouring cells leave no gap.
    double half_px(double depth_m) const { return half_px_m_ / depth_m; }
    cv::Rect image() const { return image_; }

private:
    double m_[12]; // pixel from cell
    double half_px_m_;
    cv::Rect image_;
};

// Pixels that a splat of a voxel covers, clipped; empty when it is nearer than near_m or outside.
cv::Rect splat_of(const GridCamera &camera, const VoxelPixel &at, double near_m);

// Depth of the nearest voxel per pixel, metres; infinity where there is none.
cv::Mat1f depth_of_surface(const std::vector<SurfaceVoxel> &surface, const GridCamera &camera);

} // namespace outcrop
