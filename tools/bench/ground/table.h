/* SPDX-License-Identifier: BSD-3-Clause
 * Table 4.1 of the thesis: ground matches of one pair by window and correlation threshold. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace outcrop::bench {

struct TableOptions {
    std::string site;
    std::string poses = "1";      /* "exact", or as --perturb of outcrop-drive */
    unsigned left = 4, right = 5; /* rows e and f of table 7.1 */
    unsigned n_junctions = 320;   /* the thesis had 322 and 301 */
    double t_h_m = 0.02;
};

/* Windows of 11 to 25 px by t_g of 0.50 to 0.70, three times: as printed, the
 * thesis' form on this site (min-max window, both correlations, height of the
 * triangulated point, best for each other), and the filter's final ground matches. A match is correct when
 * its left junction is true ground and the right one lies within 3 px of the true transfer. */
nlohmann::ordered_json measure_table(const TableOptions &options);

} // namespace outcrop::bench
