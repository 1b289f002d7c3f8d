/* SPDX-License-Identifier: BSD-3-Clause
 * How far the refined poses are off. */
#ifndef OUTCROP_EVAL_METRICS_POSE_H
#define OUTCROP_EVAL_METRICS_POSE_H

#include "run.h"
#include "truth.h"

#include <optional>

namespace outcrop::eval {

struct PoseMetrics {
    int n = 0;
    double position_rmse_m = 0, angle_rmse_deg = 0;
};

/* DIR/model/cameras.json against the site's, views paired by image name. No
 * alignment first: the ground and the margins fix the frame, so a common shift
 * is an error like any other. */
std::optional<PoseMetrics> evaluate_poses(const Truth &truth, const Run &run, Notes &notes);

/* The site's view of this image name (by file name without folder and
 * extension), or -1. A base that was never told the file names writes "view_3"
 * for the view of that number, without extension; that is an index. */
int find_view(const Truth &truth, const std::string &image);

} // namespace outcrop::eval
#endif
