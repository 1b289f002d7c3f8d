// SPDX-License-Identifier: BSD-3-Clause
// Volumes and surfaces as files: PLY, and glTF 2.0 of a whole site.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

#include "site/ground_map.h"
#include "site/mesh.h"
#include "site/overhead.h"
#include "site/site_model.h"
#include "site/voxels.h"

namespace outcrop {

// An obstacle as it was carved.
struct Shape {
    int index = 0; // of the obstacle, from 1
    VoxelGrid grid;
    Mesh mesh;
};

// Centres of all occupied voxels with colour, binary PLY. voxel_size is a comment in the head.
void write_voxels_ply(const std::string &path, const VoxelGrid &grid);

// A surface with vertex colours, binary PLY.
void write_mesh_ply(const std::string &path, const Mesh &mesh);

// The site as one .glb: the overhead map on the ground, a box for every obstacle (suspected ones amber and
// translucent), and a surface for every shape. glTF is Y up: X east, Y up, Z south; metres. Throws std::runtime_error
// with one line that names the file.
void write_gltf(const std::string &path, const SiteModel &model, const std::vector<Shape> &shapes,
                const OverheadMap &overhead);

} // namespace outcrop
