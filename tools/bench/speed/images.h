// SPDX-License-Identifier: BSD-3-Clause
// The pictures on which times are taken: drawn here, or cut out of the sites' photographs.
#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace outcrop::bench {

enum class Kind { kStructured, kNatural, kNoise };

const char *name_of(Kind kind);

struct Picture {
    std::string name;
    Kind kind = Kind::kStructured;
    cv::Mat grey; // 8 bits, one channel, rows without gaps
};

// All pictures at one size, structured first. Photographs are looked for as SITE/images/NAME.{png,jpg} in each of the
// site directories; those that none has are added to `missing`.
std::vector<Picture> make_pictures(cv::Size size, const std::vector<std::string> &sites,
                                   std::vector<std::string> &missing);

} // namespace outcrop::bench
