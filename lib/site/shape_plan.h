// SPDX-License-Identifier: BSD-3-Clause
// What to ask a vehicle for the shapes of obstacles: silhouettes first, then textures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include <opencv2/core.hpp>

#include "core/packet.h"
#include "site/assemble.h"
#include "site/carve.h"
#include "site/site_model.h"
#include "site/view.h"

namespace outcrop {

struct ShapeOptions {
    int step_px = 2;          // cells of silhouettes: 1, 2 or 4 px
    double grow_share = 0.15; // by which a body may be larger than its points' box on each side, of its largest one
    bool is_thesis = false;   // silhouettes by the votes of Table 6.1
    std::size_t datagram_bytes = 1380;
    bool with_textures = true;
    int texture_step_px = 2; // pixels of the view to one of a texture
    int texture_tile_px = 64;
    int texture_quality = 40;
    int texture_views = 5; // for each obstacle
    void check() const;    // throws std::invalid_argument
};

// A silhouette request, the key its answers carry, and which obstacle each of its boxes is (-1: only in the way).
struct SilhouettePlan {
    oc_silhouette_request_t request{};
    std::uint16_t key = 0;
    std::vector<int> obstacle; // index in SiteModel::obstacles
};

// Requests for every obstacle in every view that shows it: 32 boxes and 64 views each at most, as many as fit a
// datagram. When views have to be divided, each request's other views are those that look from all round. A function of
// the model alone.
std::vector<SilhouettePlan> plan_silhouettes(const SiteModel &model, const std::map<int, View> &views,
                                             const ShapeOptions &options);

// What the views say about one obstacle, out of the silhouettes that answer these plans: labels of whole views, unknown
// where nobody looked.
std::vector<CarveView> gather_silhouettes(const SiteModel &model, const std::map<int, View> &views,
                                          const std::vector<SilhouettePlan> &plans,
                                          const std::map<SilhouetteKey, std::vector<std::uint8_t>> &silhouettes,
                                          int obstacle);

// Texture tiles of a view that show an obstacle, with an estimate of their bytes on the link.
struct TexturePlan {
    oc_texture_request_t request{};
    double estimate_bytes = 0;
};

// For each obstacle the views that show most of it, from different sides. carve[i] belongs to model.obstacles[i].
std::vector<TexturePlan> plan_textures(const SiteModel &model, const std::vector<std::vector<CarveView>> &carve,
                                       const ShapeOptions &options);

// Decodes the planned tiles into CarveView::rgb and known of the views, at full size; tiles that only an older plan
// asked for do not count. Returns how many could not be decoded.
int gather_textures(const std::map<TextureKey, TileBlob> &textures, const std::vector<TexturePlan> &plans,
                    const ShapeOptions &options, std::vector<CarveView> *views);

} // namespace outcrop
