// SPDX-License-Identifier: BSD-3-Clause
// The time of a million voxels.
#pragma once

#include <vector>

#include "site/carve.h"

namespace outcrop::bench {

// Google Benchmark rows: one silhouette in each view, then carving by silhouettes alone, with colour, mesh, drawing; at a million voxels from at most eight views.
void run_speed(const Obstacle &box, std::vector<CarveView> views);

} // namespace outcrop::bench
