/* SPDX-License-Identifier: BSD-3-Clause
 * How well a junction can be placed at all under noise. */
#ifndef OUTCROP_BENCH_BOUND_H
#define OUTCROP_BENCH_BOUND_H

#include "scenes.h"

#include <map>
#include <string>
#include <vector>

namespace outcrop::bench {

/* Cramer-Rao bound over cells under noise of variance 1, for each radius: no unbiased estimate from the pixels that
 * near to the apex, even one that is told how many branches there are, does better in the mean of squares. It grows
 * with the root of the variance. rmse_px and angle_rmse_deg; grey levels are unknowns too. */
std::vector<std::map<std::string, double>> information_bounds(const std::vector<Scene> &cells,
                                                              const std::vector<int> &radii_px);

} // namespace outcrop::bench
#endif
