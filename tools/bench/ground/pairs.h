/* SPDX-License-Identifier: BSD-3-Clause
 * Views as the ground filter takes them, made from a scene. */
#pragma once

#include <cstdint>
#include <vector>

#include "scene.h"

namespace outcrop::bench {

/* Grey picture and junctions of one frame; `view` looks into both. */
struct GroundView {
    std::vector<std::uint8_t> grey;
    std::vector<oc_junction_t> junctions;
    oc_ground_view_t view;
};

/* Junctions as the vehicle's defaults find them, the best n_junctions of each frame. */
std::vector<GroundView> ground_views(const Scene &scene, unsigned n_junctions);

} // namespace outcrop::bench
