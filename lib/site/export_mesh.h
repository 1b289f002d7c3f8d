// SPDX-License-Identifier: BSD-3-Clause
// Carved obstacles as PLY files.
#pragma once

#include <string>

#include "site/mesh.h"
#include "site/voxels.h"

namespace outcrop {

// Binary PLY: centres of all occupied voxels, float x y z and uchar red green blue.
std::string voxels_ply(const Voxels &voxels);

// Binary PLY: vertices as above, triangles as lists of int.
std::string mesh_ply(const SurfaceMesh &mesh);

// dir/K.voxels.ply and dir/K.ply, whole or not at all. Throws std::runtime_error with one line that names the file.
void write_voxels(const std::string &dir, int index, const Voxels &voxels);
void write_mesh(const std::string &dir, int index, const SurfaceMesh &mesh);

} // namespace outcrop
