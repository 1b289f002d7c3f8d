// SPDX-License-Identifier: BSD-3-Clause
// A site's truth as the carving sees it.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "eval/truth.h"
#include "site/carve.h"

namespace outcrop::bench {

// Views with the true mask as labels: the obstacle, ground (also nothing at all), and unknown where another obstacle is.
std::vector<CarveView> views_of(const eval::Truth &truth, int obstacle, bool with_colour,
                                const std::string &images = "images");

// What a run knows of an obstacle: its box from points and the points themselves.
struct PointBox {
    Obstacle box;
    std::vector<SitePoint> points;
};

// The boxes of a run's model/, in its order.
std::vector<PointBox> read_boxes(const std::filesystem::path &run);

// The true obstacle's box, as if points had found it exactly.
Obstacle true_box(const eval::TrueObstacle &truth);

// Share of common cells among all that either holds.
double voxel_iou(const Voxels &voxels, const eval::TrueObstacle &truth);

} // namespace outcrop::bench
