// SPDX-License-Identifier: BSD-3-Clause
// A whole site as one binary glTF 2.0 file: ground, boxes and carved surfaces.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "site/mesh.h"
#include "site/site_model.h"

namespace outcrop {

// The ground as a picture: an overhead map or a ground map made visible.
struct GltfGround {
    cv::Mat3b rgb;  // row 0 at y_max; empty: no ground
    cv::Mat1b seen; // 255 where the picture means something, else transparent; may be empty
    double metres_per_pixel = 0, x_min = 0, y_max = 0;
};

struct GltfSurface {
    int obstacle = 0; // index, for its name
    SurfaceMesh mesh;
};

struct GltfSite {
    GltfGround ground;
    std::vector<Obstacle> obstacles, suspected; // their oriented boxes
    std::vector<GltfSurface> surfaces;          // empty ones are left out
};

// The bytes of a .glb. glTF has Y up: world (x, y, z) becomes (x, z, -y). Colours are made linear, as COLOR_0 has to
// be; ground and surfaces are unlit where a reader knows KHR_materials_unlit, for their light is in their colours.
// Throws std::invalid_argument when a number is not finite or the ground's scale is not positive.
std::string glb_of(const GltfSite &site);

// Whole or not at all; throws std::runtime_error with one line that names the file.
void write_glb(const std::string &path, const GltfSite &site);

} // namespace outcrop
