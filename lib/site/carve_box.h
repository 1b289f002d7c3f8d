// SPDX-License-Identifier: BSD-3-Clause
// Boxes of carved volumes, and the final box of an obstacle from its points and its volume.
#pragma once

#include <vector>

#include "site/carve.h"

namespace outcrop {

// Axis-aligned and yaw-oriented box that hold at least `share` of the occupied volume: each of the five sides that are
// not the ground's gives up a fifth of the rest. Throws
// std::invalid_argument when nothing is occupied or share is not in (0, 1].
Obstacle box_of_voxels(const Voxels &voxels, double share = 0.95);

struct FinalBoxOptions {
    double max_uncovered = 0.005; // of a view's silhouette may lie outside the box's image
    double min_support = 0.1;     // of the points' box must be occupied, else the volume has no say
    double min_points_in = 0.7;   // of its points must lie in the volume or within slack_cells of it, else the same
    int slack_cells = 3;
    double step_share = 0.01; // of a side's length by which sides are moved
    int rays_per_view = 1500;
    int rim_px = 0;     // of a silhouette's edge that need no explanation
    void check() const; // throws std::invalid_argument
};

struct FinalBox {
    Obstacle box;                      // index, n_points and is_suspected are the points' box's
    Obstacle from_points, from_voxels; // from_voxels: like from_points when nothing is occupied
    bool has_volume = false;           // the volume had a say
};

// The volume holds the whole obstacle and more; the points' box may be short of it where no corner was matched, or a
// little beyond. So each side first comes in to the volume's end, but never past a point; then sides go out as little
// as it takes for the box to explain every silhouette: of each ray through an obstacle pixel, some of its way through
// the volume must lie in the box. views: those the volume was carved from.
FinalBox final_box(const Obstacle &from_points, const std::vector<SitePoint> &points, const Carved &carved,
                   const std::vector<CarveView> &views, const FinalBoxOptions &options = {});

struct CarvedBox {
    Carved carved;
    FinalBox final;
    int tolerated_misses = 0; // that the volume was carved with
};

// Both at once. A volume that does not fit the points may have lost them to one view that is aside: then it is carved
// again with one more tolerated miss, and again, up to max_more. When none fits, the last volume and the points' box.
CarvedBox carve_with_box(const Obstacle &from_points, const std::vector<SitePoint> &points,
                         const std::vector<CarveView> &views, CarveOptions carve = {},
                         const FinalBoxOptions &options = {}, int max_more = 1);

} // namespace outcrop
