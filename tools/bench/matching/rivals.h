/* SPDX-License-Identifier: BSD-3-Clause
 * SIFT, AKAZE and affine SIFT in our place: the same strips, poses, narrowing and robust check, their own points. */
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "site/model.h"

namespace outcrop::bench {

enum class Feature { kSift, kAkaze, kAffineSift };

const char *name_of(Feature feature);

/* Points of one picture with their descriptors; at most kMostPoints, spread over it. */
constexpr std::size_t kMostPoints = 5000;
struct Described {
    std::vector<cv::KeyPoint> points;
    cv::Mat descriptors; /* a row a point */
    std::size_t n_found = 0;
};
Described describe(Feature feature, const cv::Mat1b &grey);

/* The views with the points as junctions without branches or label; ties and pixels stay. */
std::vector<View> with_points(const std::vector<View> &views, const std::vector<Described> &described);

struct RivalOptions {
    double max_ratio = 0.8;           /* best over second best distance at another place, both ways; less is stricter */
    double max_ratio_to_refine = 0.6; /* of the matches that only serve to refine poses and to narrow strips */
    PairOptions pairs;
    StripOptions strip;
    bool narrows_strip = true;
};

/* What stands in for match_pair in build_from_matches: all candidates of the strips of the poses believed now, mutual
 * best, ratio, then twice the narrowing that ours has. The views must be those of with_points. described[i] belongs
 * to the i-th view in ascending order of id. */
Matcher rival_matcher(const std::vector<Described> &described, const RivalOptions &options);

} // namespace outcrop::bench
