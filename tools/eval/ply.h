/* SPDX-License-Identifier: BSD-3-Clause
 * Vertices and triangles of a PLY file. */
#ifndef OUTCROP_EVAL_PLY_H
#define OUTCROP_EVAL_PLY_H

#include "mesh.h"

#include <filesystem>

namespace outcrop::eval {

/* Reads vertex x, y, z and, if there are any, the faces (polygons are cut into
 * fans) of an ascii or binary little-endian PLY; other properties are skipped.
 * Coordinates are multiplied by `unit_m`. EvalError for a cut or ill-formed
 * file, a coordinate that is not finite, an index out of range. */
Mesh read_ply(const std::filesystem::path &file, double unit_m);

} // namespace outcrop::eval
#endif
