/* SPDX-License-Identifier: BSD-3-Clause
 * Are the matches, and the labels `ground`, true? */
#ifndef OUTCROP_EVAL_METRICS_MATCH_H
#define OUTCROP_EVAL_METRICS_MATCH_H

#include "run.h"
#include "truth.h"

#include <optional>

namespace outcrop::eval {

/* Nothing where a share has no base (n = 0) or is not defined. */
struct ShareMetric {
    int n = 0, correct = 0;
    std::optional<double> precision, recall;
    std::optional<double> obstacle_as_ground; /* ground only: share of the true obstacle junctions labelled ground */
};

/* Some true depth in the 3x3 pixels round the left apex puts it within 3 px of
 * the right apex and visible there (true right depth within 1 % in 3x3).
 * Nothing when either view has no true depth. */
std::optional<bool> is_correct(const FoundMatch &match, const Truth &truth);

/* The pixel and all mask pixels within 2 px of it are ground or litter and the
 * pixel itself is one of the two. */
bool is_true_ground(const DepthMap &map, const Eigen::Vector2d &pixel);

/* Some obstacle pixel of the mask lies within 2 px of the pixel. */
bool is_true_obstacle(const DepthMap &map, const Eigen::Vector2d &pixel);

/* Obstacle matches. */
std::optional<ShareMetric> evaluate_matches(const Truth &truth, const Run &run, Notes &notes);

/* Does a junction of its reference view, or of a view before views[order], lie within 2 px of where j of
 * views[order], being ground, is truly seen? */
bool is_covisible(const Truth &truth, const std::vector<ViewJunctions> &views, std::size_t order,
                  const FoundJunction &j);

/* Of labelled junctions, views in the order they were stored: n are the junctions labelled ground, correct
 * those that are true ground, recall the share of true ground junctions
 * that are co-visible which are labelled ground. obstacle_as_ground is the share of the true obstacle junctions that are
 * labelled ground. */
ShareMetric judge_ground(const Truth &truth, const std::vector<ViewJunctions> &views, Notes &notes);

/* Of vehicle/junctions.json. Without that file from the ground matches:
 * correct when the left apex is true ground and the match itself correct; no
 * recall. */
std::optional<ShareMetric> evaluate_ground(const Truth &truth, const Run &run, Notes &notes);

} // namespace outcrop::eval
#endif
