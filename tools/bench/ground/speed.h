/* SPDX-License-Identifier: BSD-3-Clause
 * The clock of the ground filter: milliseconds a pair. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace outcrop::bench {

struct SpeedOptions {
    std::string site;
    std::string poses = "1"; /* "exact", or as --perturb of outcrop-drive */
    unsigned n_junctions = 300;
    unsigned repeats = 5;
};

/* Every view against the one before it, the best n_junctions of each; of each pair the quickest of `repeats`. */
nlohmann::ordered_json measure_speed(const SpeedOptions &options);

} // namespace outcrop::bench
