// SPDX-License-Identifier: BSD-3-Clause
// Carved obstacles as a virtual camera sees them: splats of their surface voxels.
#pragma once

#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "core/camera.h"
#include "site/voxels.h"

namespace outcrop {

// The surface of carved obstacles in the form that is drawn; made once for a sequence.
class VoxelCloud {
public:
    // index: what the mask shows, 1..254. Throws std::invalid_argument for others.
    void add(int index, const Voxels &voxels);
    std::size_t size() const { return splats_.size(); }

private:
    friend class VoxelDrawing;
    struct Splat {
        Eigen::Vector3f centre; // relative to the obstacle's first cell, cells
        cv::Vec3b colour;
        std::uint8_t open; // faces without a neighbour: low x, high x, low y, high y, low z, high z
    };
    struct Part {
        int index;
        VoxelGrid grid;
        std::size_t first, last; // in splats_
    };
    std::vector<Part> parts_;
    std::vector<Splat> splats_;
};

struct VoxelImage {
    cv::Mat3b rgb;   // RGB; black where there is no voxel
    cv::Mat1f depth; // z-depth, metres; infinity where there is no voxel
    cv::Mat1b mask;  // obstacle index, 0 where there is no voxel
};

// Z-buffered squares as large as the voxels' images. Voxels of which the camera sees no open face are skipped, as are
// those nearer than near_m. Throws std::invalid_argument for an invalid camera.
VoxelImage render_voxels(const VoxelCloud &cloud, const oc_camera_t &camera, double near_m = 0.02);

} // namespace outcrop
