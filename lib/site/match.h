// SPDX-License-Identifier: BSD-3-Clause
// Matches of a pair of views: candidates, correlation, mutual best, points; and their check in third views.
#pragma once

#include <vector>

#include "core/plane.h"
#include "site/correlate.h"
#include "site/site_model.h"
#include "site/strip.h"

namespace outcrop {

// The wedge: what lies beside a corner is another plane in the other view.
inline CorrelateOptions wedge_correlation()
{
    CorrelateOptions options;
    options.support = Support::kWedge;
    return options;
}

struct MatchOptions {
    StripOptions strip;
    CorrelateOptions correlate = wedge_correlation();
    double min_score = 0.80;
    double min_margin = 0.05;          // to the runner-up at another place, seen from either view
    double same_place_px = 3;          // nearer junctions are one place
    double ground_height_m = 0.005;    // a corner this near Z = 0 may be drawn on the ground ...
    double ground_score_slack = 0.02;  // ... if the ground's own homography is at most this much worse
    bool narrows_strip = true;         // learn the pair's pose errors from its matches and choose again
    double min_score_to_narrow = 0.9;  // of the matches that they are learnt from
    bool with_pose_covariance = false; // of the point: poses' margins too, not the pixels' noise only
};

// As the thesis has it: its strip, VNC over .75 in the square, no margin, no extra planes.
// Anchored; set correlate.warp to kUnanchored for the letter of Eq 5.34.
MatchOptions thesis_match_options();

// Matches with what third views need to check them.
struct PairResult {
    PairMatches pair;
    std::vector<oc_plane_t> planes; // of each match, through its point
    int n_candidates = 0;           // pairs of junctions that the geometry allows
};

// Match two views, ascending (left_junction). Both prepared with options.correlate.
//
// Mutual best pairs over min_score, unique by min_margin on both sides. Point
// by the midpoint of the rays, covariance of first order. A match is kGround
// when its height is 0 within 99 % of its error and the ground's homography
// explains it about as well. A pair without geometry (equal centres) has no
// matches. Throws std::invalid_argument for cameras or margins out of range.
PairResult match_pair(const PreparedView &left, const PreparedView &right, const Area &area,
                      const MatchOptions &options = {});

struct ThirdViewOptions {
    double search_px = 1;       // how far from the projection the corner may be; a few times the poses' error
    double min_confirmed = 0.8; // a third view that is this much alike confirms
    double max_denied = 0.6;    // one that is less alike than this denies
    int min_denials = 1;        // denials without any confirmation that make a match wrong
};

// Drop matches that third views contradict. A view has a say where it sees the
// point and knows the pixels there; one that sees it hidden looks like one that
// denies it, so a single confirmation outweighs all denials. Views equal to the
// pair's own are skipped. Returns how many matches were dropped.
int verify_with_third_views(const PreparedView &left, const PreparedView &right,
                            const std::vector<const PreparedView *> &others, const CorrelateOptions &correlate,
                            const ThirdViewOptions &options, PairResult *result);

} // namespace outcrop
