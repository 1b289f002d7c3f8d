// SPDX-License-Identifier: BSD-3-Clause
// Junctions matched by a vector of eight colour invariants, the thesis' own baseline (Eq 5.36).
#pragma once

#include <array>
#include <vector>

#include <opencv2/core.hpp>

#include "core/junction.h"
#include "site/strip.h"

namespace outcrop {

struct InvariantOptions {
    double sigma_px = 1.0; // of the Gaussian before the gradients
    int min_votes = 3;
    double max_level = 20;           // two levels nearer than this, grey levels, are one: a vote
    double max_gradient_share = 0.3; // two gradient terms that differ by less than this of the larger
    double least_gradient2 = 25;     // or by less than this, (grey levels / px)^2
    void check() const;              // throws std::invalid_argument
};

// R, |grad R|^2, G, |grad G|^2, B, |grad B|^2, grad R . grad G, grad R . grad B at a point: a turn of the picture
// changes none of them.
using Invariants = std::array<double, 8>;

// At the junctions' nearest pixels. picture: red, green, blue.
std::vector<Invariants> colour_invariants(const cv::Mat3b &picture, const std::vector<oc_junction_t> &junctions,
                                          const InvariantOptions &options = {});

// How many of the eight agree. The thesis gives no thresholds; those of the options are ours.
int invariant_votes(const Invariants &a, const Invariants &b, const InvariantOptions &options = {});

struct InvariantMatch {
    int left = 0, right = 0, votes = 0;
};

// Candidates of most votes for both their junctions, at least min_votes; among equals the nearest in units of the
// thresholds, then the first. Ascending left; candidates marked as rivals compete but are not given.
std::vector<InvariantMatch> match_by_invariants(const std::vector<Invariants> &left,
                                                const std::vector<Invariants> &right,
                                                const std::vector<Candidate> &candidates,
                                                const InvariantOptions &options = {});

} // namespace outcrop
