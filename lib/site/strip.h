// SPDX-License-Identifier: BSD-3-Clause
// Candidates: junctions of the right view that a left junction may be, by geometry alone.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/epipolar.h"
#include "core/window.h"
#include "site/pairs.h"
#include "site/view.h"

namespace outcrop {

enum class StripMethod {
    kCovariance, // all errors together, 99 % (docs/design.md)
    kThesis      // one parameter at a time, Eq 5.9-5.16; neither height nor area limits
};

struct StripOptions {
    StripMethod method = StripMethod::kCovariance;
    oc_angle_error_t angles = OC_ANGLE_ERROR_OPK;
    double sigma_px = 0.7;        // of a junction's position, each axis
    double max_half_width_px = 0; // > 0: no strip is wider, for poses that are known better than margins can say
    double below_ground_m = 0.02; // a point may seem this far under Z = 0
    double area_slack_m = 0.1;    // and this far outside the area
    bool with_ground = false;     // also junctions that are labelled ground
    bool with_rivals = true;      // also what no obstacle can be, marked is_rival
};

// A left and a right junction (indices in View::junctions) that may be one corner.
struct Candidate {
    int left = 0, right = 0;
    double distance_px = 0;                          // from the epipolar line
    Eigen::Vector3d point = Eigen::Vector3d::Zero(); // midpoint of the two rays, metres
    bool is_rival = false; // no obstacle of this site, but may be what the left junction really is
};

// Candidates of all left junctions, ascending (left, right).
//
// A candidate lies in the strip that the margins allow, between the images of
// the lowest and highest possible point of the left ray, in front of both
// cameras, and its midpoint in the area. Branches are not looked at. Rivals lie
// beyond the area, above z_max, or have one junction labelled ground: they keep
// what stands behind the area, or on the ground, from being matched to an
// obstacle. Pairs of two ground labels are never candidates.
//
// pair is prepared from the same two views. O(left * (1 + candidates)) with a
// bucket index over the right view; 1 ms for 300 x 300 junctions.
std::vector<Candidate> find_candidates(const oc_pair_t &pair, const PosedView &left, const PosedView &right,
                                       const Area &area, const StripOptions &options);

// oc_pair_prepare with exceptions: std::invalid_argument for cameras or margins
// that are not valid. False when the pair has no geometry (centres coincide, or
// a camera within its margins stands in the ground plane).
bool prepare_pair(const PosedView &left, const PosedView &right, const StripOptions &options, oc_pair_t *pair);

} // namespace outcrop
