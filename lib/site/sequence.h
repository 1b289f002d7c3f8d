// SPDX-License-Identifier: BSD-3-Clause
// The sequence along a path: frames, masks and a video.
#pragma once

#include <functional>
#include <string>

#include "site/overhead.h"
#include "site/path.h"
#include "site/render.h"
#include "site/shapes.h"
#include "site/site_model.h"

namespace outcrop {

struct SequenceOptions {
    RenderOptions render;
    int frames_per_s = 10;
};

struct SequenceReport {
    bool has_video = false;
    std::string note; // why there is no video
};

// Writes dir/<as>/frame_XX.png and mask_XX.png, one per frame of the path and
// of its size (two digits, more when there are over a hundred), and
// dir/<as>.mp4. Frames of an earlier run in that folder are removed first. as:
// "boxes" or "voxels" (of `shapes`; obstacles without one stay boxes). progress(done, all) after each frame. Throws std::runtime_error or
// std::invalid_argument.
SequenceReport write_sequence(const std::string &dir, const std::string &as, const SiteModel &model,
                              const std::vector<Shape> &shapes, const OverheadMap &overhead, const Path &path,
                              const SequenceOptions &options, const std::function<void(int, int)> &progress);

} // namespace outcrop
