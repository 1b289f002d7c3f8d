/* SPDX-License-Identifier: BSD-3-Clause
 * One pair of views matched in every way that the thesis knows, and in ours. */
#pragma once

#include <string>
#include <vector>

#include "judge.h"
#include "site/match.h"
#include "site_case.h"

namespace outcrop::bench {

/* What the thesis' section 5.4 compares, and steps beyond it. */
struct PairMethod {
    std::string name;
    MatchOptions match;
    bool is_colour = false;     /* the mean over three channels, each on the plane that grey chose */
    bool is_invariants = false; /* Eq 5.36 in place of correlation */
    double t_f_px = 0;          /* > 0: then only what F of seven points holds (5.5) */
};

/* Thresholds as the thesis prints them for one of its experiments; SAD per pixel. */
struct ThesisThresholds {
    int window_px = 11;
    double t_vnc = 0.75;
    double t_sad = 22.7, t_plain_sad = 33.1;
};
std::vector<PairMethod> thesis_methods(const ThesisThresholds &thresholds);

/* Indices of two views of a site. Every match counts as one of an obstacle, as in the thesis. An invariants or colour
 * row needs pictures of three channels: std::runtime_error without. */
struct PairOfViews {
    int left = 0, right = 0;
};
MatchCount match_and_count(const SiteCase &site, const PairOfViews &pair, const PairMethod &method);

} // namespace outcrop::bench
