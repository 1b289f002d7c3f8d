// SPDX-License-Identifier: BSD-3-Clause
// The overhead map: the ground seen from above, in tiles that the vehicle warps and sends on request.
#pragma once

#include <map>
#include <vector>

#include <opencv2/core.hpp>

#include "core/packet.h"
#include "site/assemble.h"
#include "site/site_model.h"

namespace outcrop {

struct OverheadOptions {
    double metres_per_pixel = 0; // 0: root of the ground in sight / pixels_per_side
    int pixels_per_side = 300;
    int tile_px = 0; // 0: from the datagram: 64 px from 1000 bytes on, less for smaller ones
    unsigned datagram_bytes = 1380;
    int quality = 15;           // the vehicle starts from and lowers until a tile fits
    int max_views_per_tile = 4; // tiles are asked for again from further views while these show new ground
    double min_gain = 0.08;     // share of a tile that a further view must add
    void check() const;         // throws std::invalid_argument
};

// What to ask one view for.
struct TileRequest {
    int view = 0;
    std::array<double, 9> image_from_ground{}; // of the refined camera
    double metres_per_pixel = 0;
    int tile_px = 0;
    int quality = 0;
    std::vector<oc_tile_id_t> tiles;
};

// Which tiles to ask from which views so that the ground of the area is
// covered: a view shows a ground cell when the cell is in its image, below the
// horizon and not behind or under an obstacle's box (suspected ones included);
// worth = resolution and angle of incidence. Per tile the set of views that
// shows most, grown while a further view adds min_gain. Deterministic.
std::vector<TileRequest> plan_overhead(const SiteModel &model, const OverheadOptions &options = {});

struct OverheadMap {
    double metres_per_pixel = 0, x_min = 0, y_max = 0; // row 0 at y_max
    cv::Mat3b rgb;                                     // RGB order
    cv::Mat1b seen;                                    // 255 where ground was really seen, 0: unseen, never invented
};

// The map from the tiles that came. Pixels that a box hides or covers in the
// tile's own view are left out again here, views blended by worth with
// feathered seams and evened exposure. Tiles that do not decode are skipped and counted.
OverheadMap compose_overhead(const SiteModel &model, const std::map<TileKey, TileBlob> &tiles,
                             const OverheadOptions &options = {}, int *n_bad_tiles = nullptr);

} // namespace outcrop
