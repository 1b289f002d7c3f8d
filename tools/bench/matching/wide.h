/* SPDX-License-Identifier: BSD-3-Clause
 * Our matches beside SIFT's, AKAZE's and affine SIFT's at pairs 40 to 60 degrees apart. */
#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "judge.h"
#include "rivals.h"
#include "site_case.h"

namespace outcrop::bench {

/* All pairs of a site whose rays are 40 to 60 degrees apart on average, whatever their worth to the model. */
PairOptions wide_pairs();

/* What the model's robust check leaves of the matches of those pairs, by name of the method. */
using WideCounts = std::map<std::string, MatchCount>;

struct WideOptions {
    std::vector<Feature> features = {Feature::kSift, Feature::kAkaze, Feature::kAffineSift};
    std::vector<double> ratios = {0.5, 0.6, 0.7, 0.8, 0.9}; /* 0.8, the usual one, must be among them */
    std::vector<double> affine_ratios = {0.8};              /* affine SIFT takes long */
};

/* Points of all views by one detector, made once for every case of the same pictures. */
class Descriptions {
public:
    const std::vector<Described> &of(const SiteCase &site, Feature feature);

private:
    std::map<std::pair<std::string, Feature>, std::vector<Described>> known_; /* by case name and feature */
};

/* Each method through build_site or build_from_matches: ties, sure matches, refined poses, all matches in the narrow
 * strips, tracks. "ours" is the product's; "two views only" leaves out the check in third views, which the rivals do
 * not have; "wedge" correlates the wedge between the branches; "every junction" takes all that the detector's limits
 * let through, which `all` holds. A rival's name ends in its ratio. */
struct WideCase {
    int n_pairs = 0;
    WideCounts counts;
    nlohmann::ordered_json json; /* {"site", "poses", "pairs", "methods": [{"method", "points", ...}], "losses"} */
};
WideCase measure_wide(const SiteCase &site, const SiteCase &all, const WideOptions &options,
                      Descriptions *descriptions);

/* Sums of cases, and how our right matches on obstacles compare: {"title", "cases", "pairs", "methods", "ratios":
 * [{"rival", "ratio_at", "ours_over_rival", "ours_over_rival_at_95"}]}. The last compares with the laxest ratio whose
 * precision is 95 % or more, null when none is. */
nlohmann::ordered_json sum_wide(const std::string &title, const std::vector<WideCase> &cases,
                                const WideOptions &options);

} // namespace outcrop::bench
