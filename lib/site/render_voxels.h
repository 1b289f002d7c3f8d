// SPDX-License-Identifier: BSD-3-Clause
// Carved obstacles as splats of their surface voxels.
#pragma once

#include <vector>

#include "site/export_shape.h"
#include "site/render.h"

namespace outcrop {

// Surface voxels of all shapes, ready to be drawn from anywhere.
class VoxelCloud {
public:
    explicit VoxelCloud(const std::vector<Shape> &shapes);

    // Draw over a frame: each voxel as a square of its footprint, the nearest at each pixel wins; what is nearer than
    // near_m is not drawn. Writes the obstacles' indices into the mask.
    void draw(const oc_camera_t &camera, double near_m, Frame *frame) const;

    bool has(int index) const; // a shape of this obstacle

private:
    struct Splat {
        Eigen::Vector3f at;
        cv::Vec3b colour;
    };
    struct Body {
        int index;
        float size_m;
        std::vector<Splat> splats;
    };
    std::vector<Body> bodies_;
};

// render_boxes with the voxels in place of the boxes of those obstacles that have any.
Frame render_voxels(const SiteModel &model, const VoxelCloud &voxels, const GroundTexture &ground,
                    const oc_camera_t &camera, const RenderOptions &options = {});

} // namespace outcrop
