/* SPDX-License-Identifier: BSD-3-Clause
 * Labels of a whole run against the truth of its site. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "eval/metrics_match.h"

namespace outcrop::bench {

struct LabelOptions {
    std::string site;
    std::string images;                         /* folder name instead of the views' own, or "" */
    std::vector<std::string> modes = {"exact"}; /* "exact", or as --perturb of outcrop-drive: "1", "2:drift" */
    bool lists_errors = false;                  /* one line per wrong label */
    bool lists_all = false;                     /* one line per junction */
};

/* One run per mode, each a row of the printed table and an object of the answer:
 * the figures of outcrop-eval's "ground" for the same run of outcrop-drive. */
nlohmann::ordered_json measure_labels(const LabelOptions &options);

} // namespace outcrop::bench
