// SPDX-License-Identifier: BSD-3-Clause
// Masks as a real vehicle might send them: shrunk, grown, with holes, one of them wrong.
#pragma once

#include <string>
#include <vector>

#include "site/carve.h"

namespace outcrop::bench {

// "none", "erode", "dilate" (2 px), "unknown" (5 % of the pixels, in patches), "wrong" (one view calls all ground),
// "shifted" (one view is 15 px aside).
const std::vector<std::string> &harms();

void harm(const std::string &kind, std::vector<CarveView> *views);

} // namespace outcrop::bench
