// SPDX-License-Identifier: BSD-3-Clause
// Which pairs of views are worth matching, from their poses alone.
#pragma once

#include <vector>

#include "core/camera.h"
#include "site/view.h"

namespace outcrop {

// A view and the pose that is believed now: the reported one, or a refined one.
// Margins are half-widths of uniform errors as in a packet; for a posterior of
// standard deviation s pass sqrt(3) s. The view must outlive this.
struct PosedView {
    const View *view = nullptr;
    oc_camera_t camera{};
    oc_margin_t margin{};
};

// The view with the pose and margins that its packet reported.
PosedView as_reported(const View &view);

struct PairOptions {
    double min_parallax_rad = 0.087; // 5 degrees: flatter rays say little about depth
    double max_parallax_rad = 1.05;  // 60 degrees: corners look too different
    double best_parallax_rad = 0.40; // pairs near this angle come first
    double min_overlap = 0.3;        // of the smaller of the two shares of the area that are seen
    double max_scale_ratio = 2.5;    // of the pixel sizes at the scene
    int best_per_view = 6;           // a pair stays if it is among the best of either view
    int exhaustive_views = 64;       // up to so many views every pair is rated; with more, those that look at the same
                                     // place from a usefully different side
};

// One pair; left and right are indices into the views given, left < right.
struct ViewPair {
    int left = 0, right = 0;
    double parallax_rad = 0; // mean angle between the rays to what both see
    double overlap = 0;
    double worth = 0; // larger is better
};

// Pairs that see the same part of the area (ground up to z_max) from usefully
// different directions, ascending (left, right); at most best_per_view * views
// of them. Occlusion is not known here. The same views in the same order give
// the same pairs. Throws std::invalid_argument for an empty area or options
// out of range. Up to exhaustive_views: O(views^2), some 100 flops each. Beyond: O(views log views), about 50 pairs a
// view are rated.
std::vector<ViewPair> select_pairs(const std::vector<PosedView> &views, const Area &area,
                                   const PairOptions &options = {});

} // namespace outcrop
