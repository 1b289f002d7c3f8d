// SPDX-License-Identifier: BSD-3-Clause
// Splats.
#include "site/render_voxels.h"

#include <array>
#include <limits>
#include <stdexcept>

#include "site/carve_surface.h"

namespace outcrop {

class VoxelDrawing {
public:
    VoxelDrawing(const oc_camera_t &camera, double near_m) : camera_(camera), near_m_(near_m)
    {
        const int width = static_cast<int>(camera.k.width_px), height = static_cast<int>(camera.k.height_px);
        image_.rgb = cv::Mat3b(height, width, cv::Vec3b(0, 0, 0));
        image_.depth = cv::Mat1f(height, width, std::numeric_limits<float>::infinity());
        image_.mask = cv::Mat1b(height, width, static_cast<uchar>(0));
        oc_pose_centre(&camera.pose, eye_);
    }

    VoxelImage draw(const VoxelCloud &cloud)
    {
        for (const VoxelCloud::Part &part : cloud.parts_) draw_part(cloud, part);
        return std::move(image_);
    }

private:
    void draw_part(const VoxelCloud &cloud, const VoxelCloud::Part &part)
    {
        const GridCamera camera(camera_, part.grid);
        const Eigen::Vector3d eye =
            (Eigen::Vector3d(eye_[0], eye_[1], eye_[2]) - part.grid.centre(0, 0, 0)) / part.grid.cell_m;
        for (std::size_t n = part.first; n < part.last; ++n) {
            const VoxelCloud::Splat &splat = cloud.splats_[n];
            if (!(splat.open & towards(splat.centre, eye.cast<float>()))) continue;
            const VoxelPixel at = camera.project(static_cast<int>(splat.centre.x()), static_cast<int>(splat.centre.y()),
                                                 static_cast<int>(splat.centre.z()));
            paint(splat_of(camera, at, near_m_), static_cast<float>(at.depth_m), splat.colour, part.index);
        }
    }

    // Faces of a cell that look towards the eye.
    static int towards(const Eigen::Vector3f &cell, const Eigen::Vector3f &eye)
    {
        int faces = 0;
        for (int axis = 0; axis < 3; ++axis) {
            if (eye[axis] < cell[axis] - 0.5F) faces |= 1 << (2 * axis);
            if (eye[axis] > cell[axis] + 0.5F) faces |= 2 << (2 * axis);
        }
        return faces;
    }

    void paint(const cv::Rect &splat, float depth, const cv::Vec3b &colour, int index)
    {
        for (int y = splat.y; y < splat.y + splat.height; ++y) {
            float *depths = image_.depth[y];
            for (int x = splat.x; x < splat.x + splat.width; ++x) {
                if (!(depth < depths[x])) continue;
                depths[x] = depth;
                image_.rgb(y, x) = colour;
                image_.mask(y, x) = static_cast<uchar>(index);
            }
        }
    }

    oc_camera_t camera_;
    double near_m_;
    double eye_[3];
    VoxelImage image_;
};

void VoxelCloud::add(int index, const Voxels &voxels)
{
    if (index < 1 || index > 254) throw std::invalid_argument("voxel cloud: index not in 1..254");
    Part part{index, voxels.grid, splats_.size(), 0};
    for (const SurfaceVoxel &v : surface_of(voxels)) {
        static constexpr int kSteps[6][3] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
        int open = 0;
        for (int face = 0; face < 6; ++face)
            if (!voxels.is_occupied(v.i + kSteps[face][0], v.j + kSteps[face][1], v.k + kSteps[face][2]))
                open |= 1 << face;
        splats_.push_back({Eigen::Vector3i(v.i, v.j, v.k).cast<float>(),
                           voxels.colours.empty() ? cv::Vec3b(200, 200, 200) : voxels.colours[v.at],
                           static_cast<std::uint8_t>(open)});
    }
    part.last = splats_.size();
    parts_.push_back(part);
}

VoxelImage render_voxels(const VoxelCloud &cloud, const oc_camera_t &camera, double near_m)
{
    if (!oc_intrinsics_is_valid(&camera.k) || !oc_pose_is_valid(&camera.pose))
        throw std::invalid_argument("render voxels: invalid camera");
    return VoxelDrawing(camera, near_m).draw(cloud);
}

} // namespace outcrop
