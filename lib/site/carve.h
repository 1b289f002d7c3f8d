// SPDX-License-Identifier: BSD-3-Clause
// Carving: from silhouettes, and colour where it was bought, to the voxels of an obstacle.
#pragma once

#include <array>
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

enum class CarveMethod {
    kBest,
    kThesis // thesis 6.4.3: t_nS decides the silhouettes' say, t_I and t_nI the colours', without visibility
};

struct CarveOptions {
    CarveMethod method = CarveMethod::kBest;
    // The grid.
    double voxel_m = 0;       // 0: a pixel's footprint at the box, but no more than auto_voxels of them
    double auto_voxels = 1e6; // the most that the automatic choice makes
    double max_voxels = 16e6; // a grid of more is refused
    double grow_share = 0.12; // of each side of the points' box, beyond it on every side but the ground's
    double grow_m = 0;        // and so much more
    int max_regrows = 3;      // the volume meets a side of the grid: that side moves out by grow_share (twice, ...)
    // Silhouettes.
    int tolerated_misses = 0; // t_nS: so many views may call a voxel ground and be overruled
    int min_views = 1;        // that must call it obstacle for it to be occupied
    // A view alone against all others that would leave less than this share of what they agree on is left out.
    double min_kept_share = 0.05;
    int min_views_to_judge = 4; // views; with fewer nobody is left out
    // Colour: the voxel's colours in the views that see it must agree.
    bool with_colour = true;
    double max_difference = 25; // grey levels, beyond the spread of the four pixels round it
    int min_colour_views = 3;   // that must see a voxel before its colours can remove it
    double min_agreeing = 0.7;  // share of these views that must agree
    int max_sweeps = 24;        // each peels one layer
    double max_removed = 0.35;  // of the hull's volume; a sweep that would pass it is the last
    // Thesis.
    double thesis_difference = 60; // t_I, summed over the channels / 3
    int thesis_agreeing = 4;       // t_nI
    // Shape, kBest only.
    int close_cells = 1;          // gaps up to twice this are closed
    int open_cells = 0;           // spurs up to twice this are taken off (they become unknown)
    double min_part_share = 0.02; // of the largest part; smaller loose parts become unknown
    void check() const;           // throws std::invalid_argument
};

struct Carved {
    Voxels voxels;
    std::vector<int> views_left_out; // ids of views that contradict all others
    int n_views = 0;                 // that said anything
    int n_colour_views = 0;
    std::size_t n_occupied = 0, n_surface = 0, n_free = 0, n_unknown = 0;
    std::size_t n_colour_removed = 0;
    bool is_usable() const { return n_occupied > 0; }
};

// The first grid for a box: round its axis-aligned and its oriented form, grown, standing on the ground. Throws
// std::invalid_argument for a box without extent and std::length_error, with the number of voxels and bytes it would
// take, when it passes options.max_voxels.
VoxelGrid grid_for(const Obstacle &box, const std::vector<CarveView> &views, const CarveOptions &options);

// Bytes that a grid takes while it is carved.
double carving_bytes(double n_voxels);

// Carves the box's surroundings. The grid is that of grid_for, but follows a volume that goes on beyond it. A voxel is free when more than tolerated_misses views see ground at its centre's
// pixel, else occupied when min_views see an obstacle there, else unknown; pixels outside an image or behind a camera
// say nothing, nor do unknown ones. The same result for any order of the views. Throws std::invalid_argument for
// options out of range, invalid cameras, images of another size and ids that appear twice, and as grid_for does.
Carved carve_obstacle(const Obstacle &box, const std::vector<CarveView> &views, const CarveOptions &options = {});

} // namespace outcrop
