// SPDX-License-Identifier: BSD-3-Clause
// Every rival on every picture as a row of Google Benchmark.
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "images.h"

namespace outcrop::bench {

// Runs what --benchmark_filter leaves, prints as Google Benchmark does, and returns the rows.
nlohmann::json run_rows(const std::vector<Picture> &pictures);

} // namespace outcrop::bench
