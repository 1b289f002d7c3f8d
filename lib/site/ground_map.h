// SPDX-License-Identifier: BSD-3-Clause
// What is known of the ground: free, obstacle, suspected or unseen, cell by cell. Never silently free.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "site/site_model.h"
#include "site/view.h"

namespace outcrop {

// Grey levels that a person can tell apart when the map is opened as a picture.
enum class GroundCode : std::uint8_t { kUnseen = 96, kFree = 255, kObstacle = 0, kSuspected = 176 };

struct GroundMapOptions {
    double cell_m = 0; // 0: the area's longer side / 400
    int min_views = 2; // that must see a cell for it to be free
    // The ring round a box that stays suspected, in shares of its footprint's diagonal: ring_sampling over the root of
    // its number of points, within these bounds.
    double ring_sampling = 1.0, ring_share = 0.06, max_ring_share = 0.25;
    double pose_sigmas = 2.58;    // and so many sigmas of the least certain camera's place more
    double point_sigmas = 2.58;   // round points that belong to no box
    double min_point_cells = 1.5; // the same, at least so many cells
    double suspect_cells = 2;     // round a place where something low may stand
    double ring_reach = 0.25;     // shares of a box's diagonal within which the ring takes in such places
    int border_px = 2;            // of an image that do not count as seen
    int max_cells_per_side = 4096;
    void check() const; // throws std::invalid_argument
};

struct GroundMap {
    double metres_per_pixel = 0, x_min = 0, y_max = 0;
    cv::Mat1b codes; // GroundCode; row 0 at y_max
};

// obstacle: inside a box's footprint. suspected: inside a suspected one's, in the ring round any, or near an
// obstacle point that no box holds, or at a suspect place; the ring reaches out to suspect places beside the box. A
// model with a fault has no free ground: it is suspected instead. free: else, and seen by min_views views whose line of sight meets no box.
// Everything else is unseen. Cost: cells * views * boxes.
// doubtful: footprints that are suspected besides, but stand in nobody's way and have no ring: the points' box of an
// obstacle whose volume was carved.
GroundMap map_ground(const SiteModel &model, const GroundMapOptions &options = {},
                     const std::vector<Obstacle> &doubtful = {});

} // namespace outcrop
