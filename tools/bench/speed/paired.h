// SPDX-License-Identifier: BSD-3-Clause
// Times in pairs: both sides in turn on the same picture, and the median of the ratios. What disturbs the machine
// disturbs both sides of a pair, so ratios hold where times do not.
#pragma once

#include <nlohmann/json.hpp>
#include <ostream>
#include <vector>

#include "images.h"

namespace outcrop::bench {

struct PairedRow {
    Picture picture;
    std::size_t n_pairs = 0;
    double canny_ms = 0, ours_ms = 0, fixed_ms = 0, literal_ms = 0; // medians
    double ours_per_canny = 0, fixed_per_canny = 0;                 // medians of ratios
    double literal_per_fixed = 0;                                   // 0 when not taken
    double gradient_ms = 0, places_ms = 0;                          // of `fixed`: up to the edge maps; up to the fits
    std::size_t n_ours = 0, n_fixed = 0, n_literal = 0;
};

struct PairedOptions {
    std::size_t n_pairs = 30;
    bool has_literal = true;
};

PairedRow take_pairs(const Picture &picture, const PairedOptions &options);

// Ratios that are asked for and hoped for; 0 for noise, of which nothing is asked.
struct Target {
    double ratio = 0, stretch = 0, literal_per_ours = 0;
};

Target target_of(const Picture &picture);

void print_table(std::ostream &out, const std::vector<PairedRow> &rows);
nlohmann::json to_json(const PairedRow &row);

} // namespace outcrop::bench
