// SPDX-License-Identifier: BSD-3-Clause
// Carving: from silhouettes, and colour where it was bought, to the voxels of an obstacle (thesis 6.4, 6.5, 8.4).
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "core/camera.h"
#include "core/junction.h"
#include "site/site_model.h"
#include "site/voxels.h"

namespace outcrop {

// What one view says about an obstacle. Images have the camera's size or are empty.
struct CarveView {
    int id = 0;
    oc_camera_t camera{}; // refined
    cv::Mat1b labels;     // oc_label_t: OC_LABEL_UNKNOWN (also where nobody looked), OC_LABEL_OBSTACLE, OC_LABEL_GROUND
    cv::Mat3b rgb;        // textures that came; may be empty
    cv::Mat1b known;      // 255 where rgb is
};

struct CarveOptions {
    double voxel_m = 0; // 0: from the views' pixels and the box, within the next two
    int max_side = 160; // voxels along the longest side when voxel_m is 0
    int min_side = 24;
    std::size_t max_voxels = std::size_t{1} << 26; // refused above
    double grow_share = 0.15;                      // the volume that is looked at, beyond the box on each side
    int misses = 0;                // views that may call a voxel ground before it is free (t_nS - 1 of the thesis)
    double min_piece_share = 0.03; // of the largest: smaller pieces that touch nothing are taken away
    bool with_colour = true;       // where views have it
    int min_colour_views = 3;      // that must see a voxel before their colours count
    double colour_share = 0.7;     // of them that must agree
    int colour_tolerance = 10;     // grey levels, each channel, beyond what the pixels round the place span
    int colour_reach_px = 1;       // how far off the place a colour may lie: poses and edges are not exact
    int colour_sweeps = 40;        // at most; each takes one layer off
    bool is_thesis = false;        // colours counted in all views, seen or hidden: t_I = colour_tolerance, t_nI views
    int thesis_colours = 4;        // t_nI
    void check() const;            // throws std::invalid_argument
};

struct Carved {
    VoxelGrid grid;
    int n_views = 0;          // that said anything
    std::size_t n_hull = 0;   // occupied by silhouettes alone
    std::size_t n_colour = 0; // taken away by colour
    std::size_t n_hidden = 0; // occupied, seen by no view
    bool is_empty() const { return n_hull == 0; }
};

// Voxels of the box grown by grow_share, standing on the ground. A voxel is free when more than `misses` views that show
// its place call it ground, occupied when it is not free and a view calls it obstacle, else unknown; what is unknown
// below something occupied is occupied, because obstacles stand on the ground. Pixels outside an image or behind a
// camera say nothing. Throws std::runtime_error with the size it would take for a grid that is larger than max_voxels.
// Deterministic. 1 M voxels x 8 views: about 100 ms on one core.
Carved carve(const Obstacle &box, const std::vector<CarveView> &views, const CarveOptions &options = {});

// Box of the points and of the volume together. Points lie on the body but may miss its ends; the volume holds the body
// but is too large where views are few, most at its top. A side that the points' box has beyond the volume's is drawn
// in; one that the volume has far beyond the points' is drawn out, by what is more than a volume usually is too large.
struct FinalBoxOptions {
    double trim_share = 0.001;     // of the volume's surface that may lie outside at each end
    double inward_trust = 0.8;     // of the way to the volume's side
    double side_dead_share = 0.06; // of the box's side: beyond the points' side by less means nothing
    double top_dead_share = 0.2;
};
Obstacle final_box(const Obstacle &points_box, const Carved &carved, const FinalBoxOptions &options = {});

} // namespace outcrop
