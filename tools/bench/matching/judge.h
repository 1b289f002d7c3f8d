/* SPDX-License-Identifier: BSD-3-Clause
 * Matches counted against the truth, with the doubt that a count leaves. */
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "eval/metrics_match.h"
#include "site/site_model.h"
#include "site_case.h"

namespace outcrop::bench {

/* Of obstacle matches (what their finder calls obstacle): how many, how many right by the rule of outcrop-eval, and of
 * those how many lie on a true obstacle. Of ground matches the same, the last not counted. */
struct MatchCount {
    int n = 0, correct = 0, correct_on_obstacle = 0;
    int ground_n = 0, ground_correct = 0;

    void add(const MatchCount &other);
};

/* 95 % interval of a share, Wilson's. {0, 1} for n = 0. */
struct Interval {
    double low = 0, high = 1;
};
Interval wilson(int correct, int n);

/* Matches of one pair as pixels; kind as in Match. */
struct PixelMatch {
    int left_view = 0, right_view = 0; /* ids */
    Eigen::Vector2d left_px, right_px;
    MatchKind kind = MatchKind::kObstacle;
    double score = 0; /* larger is surer */
};

std::vector<PixelMatch> pixel_matches(const std::vector<View> &views, const std::vector<PairMatches> &pairs);

/* Is the match right, and is it on an obstacle? std::runtime_error for a view without true depth. */
bool is_right(const SiteCase &site, const PixelMatch &match);
bool is_on_obstacle(const SiteCase &site, const PixelMatch &match);

/* Matches of one place in both views count once, the surest: detectors with scales and views of views find a corner
 * many times. */
constexpr double kOnePlacePx = 3;
std::vector<PixelMatch> without_repeats(std::vector<PixelMatch> matches);

MatchCount count_matches(const SiteCase &site, const std::vector<PixelMatch> &matches);

/* {"n", "correct", "precision", "precision_low", "precision_high", "correct_on_obstacle", "ground_n",
 * "ground_correct"}; shares are null for n = 0. */
nlohmann::ordered_json to_json(const MatchCount &count);

} // namespace outcrop::bench
