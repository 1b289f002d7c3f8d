/* SPDX-License-Identifier: BSD-3-Clause
 * How many of the strongest points of one view are found again in another. */
#ifndef OUTCROP_BENCH_REPEATABILITY_H
#define OUTCROP_BENCH_REPEATABILITY_H

#include "detector.h"
#include "target.h"

#include <filesystem>
#include <string>
#include <vector>

namespace outcrop::bench {

struct RepeatabilityOptions {
    std::filesystem::path natural;            /* list of crops; empty: structured scenes only */
    std::vector<std::filesystem::path> sites; /* folders of sites, searched in this order */
    bool is_quick = false;
};

struct RepeatabilityRow {
    std::string set, warp, detector;
    int variance;
    std::map<std::string, double> figures; /* repeatability, n (mean a pair), n_pairs, lead_over_harris of ours */
    std::vector<Verdict> verdicts;
};

struct Repeatability {
    std::vector<RepeatabilityRow> rows;
    std::vector<std::string> skipped; /* crops whose picture is not there */
};

/* Structured: polygons and chessboards drawn exactly again under each homography, at most 300 points. Natural: crops
 * of site pictures, warped, at most 100. A pair's count is what our detector finds in both views, within the part
 * both see; the others give as many. Points within 2 px in the second view are the same, each once. */
Repeatability measure_repeatability(const RepeatabilityOptions &options);

/* Of n points each, the strongest inside the part that both views see, the share found within kMatchPx; n is cut to
 * what there is and given back. */
struct Views {
    cv::Size first_px, second_px;
    cv::Matx33d second_from_first;
};
double share_repeated(const Views &views, const std::vector<Found> &first, const std::vector<Found> &second, int *n);

std::string to_table(const Repeatability &result);
nlohmann::json to_json(const Repeatability &result);

} // namespace outcrop::bench
#endif
