// SPDX-License-Identifier: BSD-3-Clause
// Colour: which voxels the views that see them agree on, and the colour they have.
#pragma once

#include <vector>

#include "site/carve.h"

namespace outcrop {

// Peels surface voxels on whose colour the views that see them do not agree. They become unknown, not free: light can
// fool colours. Returns how many.
std::size_t carve_by_colour(const std::vector<const CarveView *> &views, const CarveOptions &options, Voxels *voxels);

// Eq 6.11 as printed: every occupied voxel, no visibility. Returns how many became unknown.
std::size_t carve_by_colour_thesis(const std::vector<const CarveView *> &views, const CarveOptions &options,
                                   Voxels *voxels);

// Colours of the surface: median of the views that see it; elsewhere that of the nearest coloured voxel. Leaves
// voxels->colours empty when no view has colour.
void colour_voxels(const std::vector<const CarveView *> &views, Voxels *voxels);

} // namespace outcrop
