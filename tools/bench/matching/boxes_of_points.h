/* SPDX-License-Identifier: BSD-3-Clause
 * Points of another program into obstacles by our clusters and boxes, held against the truth. */
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace outcrop::bench {

/* Points of a text file, a line each: x y z in metres and, if there, the number of views that saw it. Those inside
 * the site's area and higher than t_h (as settle_tracks has it) are clustered and boxed with the product's defaults.
 * Throws std::runtime_error for a line that is no point. */
nlohmann::ordered_json judge_points(const std::string &site, const std::string &points_file);

} // namespace outcrop::bench
