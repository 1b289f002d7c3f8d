// SPDX-License-Identifier: BSD-3-Clause
// Which pixels the base must ask for before it can match.
#pragma once

#include <cstdint>
#include <vector>

#include <opencv2/core.hpp>

#include "site/pairs.h"
#include "site/strip.h"

namespace outcrop {

struct WantedBlocksOptions {
    StripOptions strip;
    int radius_px = 10;       // half side of the window round an apex; 13 for all that a warp may reach
    int max_per_view = 65535; // junctions with the most partners first when this binds
};

// Blocks of one view, raster index by * ceil(width / 8) + bx as in a patch request.
struct WantedBlocks {
    int view = 0;                      // View::id
    std::vector<std::uint16_t> blocks; // ascending
};

// For each view the 8x8 blocks round junctions that have a candidate in at
// least one of the pairs, less the blocks that are known and those asked for.
//
// pairs  indices into views
// asked  per view (same order) one byte per block, 0 = not asked; may be empty
//
// One entry per view that wants any, in the order of views. Pure: the same
// views give the same blocks. Throws std::invalid_argument for a radius or a
// table of the wrong size.
std::vector<WantedBlocks> wanted_blocks(const std::vector<PosedView> &views, const std::vector<ViewPair> &pairs,
                                        const Area &area, const std::vector<std::vector<std::uint8_t>> &asked,
                                        const WantedBlocksOptions &options = {});

} // namespace outcrop
