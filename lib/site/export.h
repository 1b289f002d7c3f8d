// SPDX-License-Identifier: BSD-3-Clause
// The model as files that other programs read; forms in docs/operating.md.
#pragma once

#include <map>
#include <string>

#include "site/ground_map.h"
#include "site/overhead.h"
#include "site/site_model.h"
#include "site/view.h"

namespace outcrop {

// Writes into dir: matches.json, model/obstacles.json, model/points.ply,
// model/cameras.json, model/ground.png and ground.json, overhead.png (alpha 0
// = unseen) and overhead.json. Every file appears whole or not at all. Throws
// std::runtime_error with one line that names the file.
//
// Pixels in matches.json are the raw images' own (views that were rectified
// get their distortion back); lengths are metres. Numbers have all their
// digits, so equal models give equal bytes.
void write_model_dir(const std::string &dir, const SiteModel &model, const std::map<int, View> &views,
                     const GroundMap &ground, const OverheadMap &overhead);

} // namespace outcrop
