// SPDX-License-Identifier: BSD-3-Clause
// The way a virtual camera takes through the site.
#pragma once

#include <string>
#include <vector>

#include "core/camera.h"
#include "site/site_model.h"

namespace outcrop {

struct Path {
    std::vector<oc_camera_t> frames;
};

// What the operator draws: where, and how the camera looks.
struct Waypoint {
    double x_m = 0, y_m = 0;
    bool has_pan = false;
    double pan_rad = 0; // azimuth of the view, clockwise from +Y
};

struct PathOptions {
    int steps = 200;        // frames in all, 1..100000
    double height_m = 0.3;  // of the camera over the ground
    double tilt_rad = 1.05; // from nadir
    double swing_rad = 0;
    double hfov_rad = 1.05;
    unsigned width_px = 640, height_px = 480;
};

// Frames at equal steps of way from the first to the last waypoint (thesis
// 7.3); with one waypoint the camera stands. Angles run along the shorter arc
// (7.12); a waypoint without a pan looks along the motion, azimuth
// atan2(dx, dy) (7.10 as printed is the mathematical angle). Throws
// std::invalid_argument for no waypoint, values that are not finite or out of range.
Path plan_path(const std::vector<Waypoint> &waypoints, const PathOptions &options);

// A path file in either form: {"frames": [virtual cameras]} or {"waypoints": [...], ...}. Throws
// std::runtime_error with one line that names the file and the fault.
Path read_path(const std::string &file);

// A loop round the obstacles (the area's centre when there are none) that
// looks inwards, for a site without a path.
Path loop_path(const SiteModel &model, int steps = 60);

} // namespace outcrop
