// SPDX-License-Identifier: BSD-3-Clause
// Obstacles as they were carved: volumes, surfaces and final boxes.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "site/carve.h"
#include "site/carve_box.h"
#include "site/mesh.h"
#include "site/overhead.h"
#include "site/site_model.h"

namespace outcrop {

struct Shape {
    int index = 0; // of the obstacle, from 1
    Voxels voxels;
    SurfaceMesh mesh;
};

// Carves every obstacle of which views say something: views[i] belongs to model->obstacles[i], whose box becomes the
// final one of points and volume, with voxel_m. An obstacle whose grid would be too large stays a box, and `tell` gets
// one line about it. asked_grow_share: as in ShapeOptions. Adds to the model's counts.
std::vector<Shape> carve_shapes(const std::vector<std::vector<CarveView>> &views, double asked_grow_share,
                                const CarveOptions &options, const std::function<void(const std::string &)> &tell,
                                SiteModel *model);

// dir/K.voxels.ply and dir/K.ply of every shape, and dir/site.glb: ground, boxes and surfaces. Shapes of an earlier run
// in that folder are removed first. Throws std::runtime_error with one line that names the file.
void write_shapes(const std::string &dir, const SiteModel &model, const std::vector<Shape> &shapes,
                  const OverheadMap &overhead);

} // namespace outcrop
