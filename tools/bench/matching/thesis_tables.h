/* SPDX-License-Identifier: BSD-3-Clause
 * Table 5.3 of the thesis and its comparisons of correlations, measured again on rendered sites. */
#pragma once

#include <nlohmann/json.hpp>

#include "one_pair.h"

namespace outcrop::bench {

/* Windows of 11 to 17 px by t_VNC of 0.50 to 0.75: as printed, in the thesis' form, and in ours with that window and least
 * score. */
nlohmann::ordered_json measure_table_5_3(const SiteCase &site, const PairOfViews &pair);

/* One row per method, summed over the pairs. `printed` names what the thesis says of its own pictures, or "". */
nlohmann::ordered_json measure_methods(const SiteCase &site, const std::vector<PairOfViews> &pairs,
                                       const std::string &title, const ThesisThresholds &thresholds,
                                       const std::string &printed);

/* Pairs of a site whose rays are so far apart, degrees. */
std::vector<PairOfViews> pairs_between(const SiteCase &site, double min_deg, double max_deg);

} // namespace outcrop::bench
