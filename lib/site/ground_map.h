// SPDX-License-Identifier: BSD-3-Clause
// What is known of the ground: free, obstacle, suspected or unseen, cell by cell. Never silently free.
#pragma once

#include <cstdint>

#include <opencv2/core.hpp>

#include "site/site_model.h"
#include "site/view.h"

namespace outcrop {

// Grey levels that a person can tell apart when the map is opened as a picture.
enum class GroundCode : std::uint8_t { kUnseen = 96, kFree = 255, kObstacle = 0, kSuspected = 176 };

struct GroundMapOptions {
    double cell_m = 0;            // 0: the area's longer side / 400
    int min_views = 2;            // that must see a cell for it to be free
    double ring_share = 0.12;     // of a box's footprint diagonal: the ring round it that stays suspected
    double pose_sigmas = 2.58;    // and so many sigmas of the least certain camera's place more
    double point_sigmas = 2.58;   // round points that belong to no box
    double min_point_cells = 1.5; // the same, at least so many cells
    int border_px = 2;            // of an image that do not count as seen
    int max_cells_per_side = 4096;
    void check() const; // throws std::invalid_argument
};

struct GroundMap {
    double metres_per_pixel = 0, x_min = 0, y_max = 0;
    cv::Mat1b codes; // GroundCode; row 0 at y_max
};

// obstacle: inside a box's footprint. suspected: inside a suspected one's, in the ring round any, or near an
// obstacle point that no box holds. free: else, and seen by min_views views whose line of sight meets no box.
// Everything else is unseen. Cost: cells * views * boxes.
GroundMap map_ground(const SiteModel &model, const GroundMapOptions &options = {});

} // namespace outcrop
