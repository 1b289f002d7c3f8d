/* SPDX-License-Identifier: BSD-3-Clause
 * Has every obstacle its box, and only the obstacles? */
#ifndef OUTCROP_EVAL_METRICS_BOX_H
#define OUTCROP_EVAL_METRICS_BOX_H

#include "run.h"
#include "truth.h"

#include <optional>
#include <string>
#include <vector>

namespace outcrop::eval {

constexpr double kFoundIou = 0.3; /* an obstacle is found above this */
constexpr double kFalseIou = 0.1; /* a box is false when it reaches no obstacle above this */

struct BoxMetric {
    int truth = 0; /* the true obstacle's index */
    std::string name;
    std::optional<int> found;             /* index of the box given to it; nothing: none touches it */
    double iou = 0;                       /* axis-aligned */
    double obb_iou = 0;                   /* yaw-oriented, against the least-area box of the mesh */
    std::optional<double> yaw_error_deg;  /* 0..45; only where the true obstacle has straight, square sides */
    std::optional<double> centre_error_m; /* of the axis-aligned boxes' centres */
};

struct BoxMetrics {
    std::vector<BoxMetric> boxes; /* one per true obstacle, in the file's order */
    std::vector<int> missed;      /* true obstacles whose IoU is not above kFoundIou */
    std::vector<int> false_boxes; /* see evaluate_boxes */
    std::vector<int> duplicates;  /* boxes given to no obstacle that are not false */
};

/* Gives boxes to obstacles one to one, the best axis-aligned IoU first. A box
 * given to none is a duplicate when its IoU with some obstacle is above
 * kFalseIou or half of its volume lies inside an obstacle's box (a fragment),
 * else false; one given to an obstacle at an IoU of at most kFalseIou is
 * judged the same way. */
std::optional<BoxMetrics> evaluate_boxes(const Truth &truth, const Run &run);

/* Is the obstacle's outline its least-area rectangle, but for kSquareSlack of the area? Only then has it a yaw. */
constexpr double kSquareSlack = 0.1;
bool has_yaw(const TrueObstacle &truth);

/* Truth's obstacle that the found one of this index was given to. */
const TrueObstacle *truth_of(int found_index, const BoxMetrics &boxes, const Truth &truth);

} // namespace outcrop::eval
#endif
