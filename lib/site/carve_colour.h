// SPDX-License-Identifier: BSD-3-Clause
// Colour in carving: voxels that different views see in different colours are not there.
#pragma once

#include <cstddef>
#include <vector>

#include "site/carve.h"

namespace outcrop {

// Takes away surface voxels whose colours do not agree in the views that see them, sweep by sweep (space carving with a
// tolerance for the place; thesis 6.5 when options.is_thesis). Returns how many went.
std::size_t carve_by_colour(const std::vector<CarveView> &views, const CarveOptions &options, VoxelGrid *grid);

// Gives every surface voxel the median colour of the views that see it, inner ones that of the nearest surface below or
// beside; grey when there is none. Returns how many occupied voxels no view sees.
std::size_t colour_voxels(const std::vector<CarveView> &views, VoxelGrid *grid);

} // namespace outcrop
