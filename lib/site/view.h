// SPDX-License-Identifier: BSD-3-Clause
// A view as the base knows it: what the packets said, nothing derived.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include <opencv2/core.hpp>

#include "core/camera.h"
#include "core/junction.h"
#include "core/packet.h"

namespace outcrop {

// Pixels stay sparse: only the 8x8 blocks that crossed the link are known.
struct View {
    int id = 0; // the vehicle's view id
    int camera_index = 0;
    std::int64_t utime_us = 0;
    oc_camera_t camera{}; // as reported, rectified pixels
    oc_margin_t margin{};
    bool has_distortion = false;
    oc_distortion_t distortion{};
    std::vector<oc_junction_t> junctions; // transmit order; labels updated by relabels
    std::vector<oc_tie_t> ties;
    cv::Mat1b grey;  // width x height; meaningful where known != 0
    cv::Mat1b known; // 255 where pixels have arrived
};

// The working area in metres; what stands outside is no obstacle of this site.
struct Area {
    double x_min = 0, x_max = 0, y_min = 0, y_max = 0, z_max = 0;
};

} // namespace outcrop
