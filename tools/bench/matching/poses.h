/* SPDX-License-Identifier: BSD-3-Clause
 * Poses: the sensors', fundamental matrices by sampling, and ours, against true points. */
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "site_case.h"

namespace outcrop::bench {

/* Distances of all true points of all pairs, pixels. */
struct PoseErrors {
    std::vector<double> epipolar_px, ground_transfer_px;
    int n_pairs = 0; /* that gave a matrix */
    double ms = 0;
};

/* Of one perturbed case: what every source of geometry is off by. */
struct PoseCase {
    std::map<std::string, PoseErrors> by_source;          /* "sensor", "F, MAGSAC with ties", "ours" ... */
    std::vector<double> sensor_m, ours_m;                 /* of the camera centres, one per view */
    std::vector<double> sensor_aligned_m, ours_aligned_m; /* after one common move over the plane and turn */
    std::vector<double> sensor_rad, ours_rad;             /* of the attitudes */
};

/* The pairs are the model's own. Both F get the matches that ours has with the sensors' poses, without and with
 * the vehicle's ground ties between the two views, t_F = 3 px; ours is the whole site refined. True points: every 12th pixel of the left view that
 * the right view sees; the ground's of them for the transfer. */
PoseCase measure_poses(const SiteCase &site);

/* Medians and 90th percentiles of all cases of one site together, seeds by name, and the shares by which ours cuts. */
nlohmann::ordered_json summary_of(const std::string &site, const std::vector<std::string> &poses,
                                  const std::vector<PoseCase> &cases);

/* Of values in any order; NaN when there are none. */
double quantile(std::vector<double> values, double share);

} // namespace outcrop::bench
