// SPDX-License-Identifier: BSD-3-Clause
// The surface of carved voxels, and splats of it.
#include "site/carve_surface.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace outcrop {
namespace {

constexpr double kNear_m = 1e-6;

} // namespace

std::vector<SurfaceVoxel> surface_of(const Voxels &voxels, bool with_bottom)
{
    const VoxelGrid &grid = voxels.grid;
    std::vector<SurfaceVoxel> surface;
    for (int k = 0; k < grid.nz; ++k)
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx; ++i)
                if (voxels.is_surface(i, j, k) || (with_bottom && k == 0 && voxels.is_occupied(i, j, k)))
                    surface.push_back({i, j, k, grid.at(i, j, k)});
    return surface;
}

GridCamera::GridCamera(const oc_camera_t &camera, const VoxelGrid &grid)
    : image_(0, 0, static_cast<int>(camera.k.width_px), static_cast<int>(camera.k.height_px))
{
    double p[12];
    oc_camera_matrix(&camera, p);
    const Eigen::Vector3d first = grid.centre(0, 0, 0);
    for (int row = 0; row < 3; ++row) {
        double *m = m_ + 4 * row;
        const double *q = p + 4 * row;
        for (int column = 0; column < 3; ++column) m[column] = q[column] * grid.cell_m;
        m[3] = q[0] * first.x() + q[1] * first.y() + q[2] * first.z() + q[3];
    }
    // A layer of cells turned by 45 degrees in the image leaves holes between splats that are not sqrt(2) cells wide.
    half_px_m_ = 0.5 * std::sqrt(2.0) * grid.cell_m * std::max(camera.k.fx_px, camera.k.fy_px);
}

VoxelPixel GridCamera::project(int i, int j, int k) const
{
    const double x = m_[0] * i + m_[1] * j + m_[2] * k + m_[3];
    const double y = m_[4] * i + m_[5] * j + m_[6] * k + m_[7];
    const double w = m_[8] * i + m_[9] * j + m_[10] * k + m_[11];
    if (!(w > kNear_m)) return {0, 0, 0};
    return {x / w, y / w, w};
}

cv::Rect splat_of(const GridCamera &camera, const VoxelPixel &at, double near_m)
{
    if (!(at.depth_m > near_m)) return {};
    const double half = std::max(0.5, camera.half_px(at.depth_m));
    const cv::Rect image = camera.image();
    const double x0 = std::ceil(at.x_px - half), x1 = std::floor(at.x_px + half);
    const double y0 = std::ceil(at.y_px - half), y1 = std::floor(at.y_px + half);
    if (!(x1 >= 0 && y1 >= 0 && x0 < image.width && y0 < image.height)) return {};
    const int left = static_cast<int>(std::max(x0, 0.0)), top = static_cast<int>(std::max(y0, 0.0));
    const int right = static_cast<int>(std::min(x1, image.width - 1.0));
    const int bottom = static_cast<int>(std::min(y1, image.height - 1.0));
    return {left, top, right - left + 1, bottom - top + 1};
}

cv::Mat1f depth_of_surface(const std::vector<SurfaceVoxel> &surface, const GridCamera &camera)
{
    cv::Mat1f depth(camera.image().height, camera.image().width, std::numeric_limits<float>::infinity());
    for (const SurfaceVoxel &voxel : surface) {
        const VoxelPixel at = camera.project(voxel.i, voxel.j, voxel.k);
        const cv::Rect splat = splat_of(camera, at, kNear_m);
        const float z = static_cast<float>(at.depth_m);
        for (int y = splat.y; y < splat.y + splat.height; ++y) {
            float *row = depth[y];
            for (int x = splat.x; x < splat.x + splat.width; ++x) row[x] = std::min(row[x], z);
        }
    }
    return depth;
}

} // namespace outcrop
