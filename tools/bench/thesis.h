/* SPDX-License-Identifier: BSD-3-Clause
 * The thesis' own experiments with its detector (3.4), done with it as printed and with ours side by side. */
#ifndef OUTCROP_BENCH_THESIS_H
#define OUTCROP_BENCH_THESIS_H

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace outcrop::bench {

/* Each result has "text", the table to print, beside its figures. */

/* Figures 3.2 and 3.3: squares of several contrasts under noise. Variance 400, sigma 1.0 and 1.5: false junctions.
 * Variance 1000, sigma 1.5, t_b 10 and 8: corners found of the square of low contrast. Means over 20 seeds. */
nlohmann::json thesis_noise();

/* Figure 3.5: one triangle in 28 views, the sum of its angles over lambda 8..24. */
nlohmann::json thesis_triangle();

/* Figure 3.6: a chessboard, pairs of branch directions in bins of 5 degrees; the thesis' peak is at (-5, 90). */
nlohmann::json thesis_chess();

/* Figure 3.10: images of the site `cubes`: how straight are two branches of one line. std::runtime_error when an
 * image cannot be read; "skipped" in the result when the site is not there. */
nlohmann::json thesis_lines(const std::vector<std::filesystem::path> &sites);

/* Photographed chessboards: `folder` has cameras.json with lens and corners, and images/. "skipped" as above. */
nlohmann::json chess_stereo(const std::filesystem::path &folder);

} // namespace outcrop::bench
#endif
