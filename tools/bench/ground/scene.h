/* SPDX-License-Identifier: BSD-3-Clause
 * A site as the vehicle meets it: the frames of a run, with poses as its sensors would report them. */
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "drive/reported_site.h"
#include "vehicle/vehicle.h"

namespace outcrop::bench {

/* One captured frame that owns its pixels. */
struct Frame {
    oc_frame_t frame; /* frame.image looks into px */
    std::vector<std::uint8_t> px;
};

struct Scene {
    std::vector<Frame> frames;
    std::uint32_t max_width_px = 0, max_height_px = 0;
    oc_area_t area;
};

/* The frames that outcrop-drive would have outcropd take of this site. Throws std::runtime_error. */
Scene load_scene(const ReportedSiteOptions &options);

/* A vehicle with its block. */
class Vehicle {
public:
    explicit Vehicle(const oc_vehicle_config_t &config);
    oc_vehicle_t *get() const { return vehicle_; }

private:
    std::vector<std::uint8_t> block_;
    oc_vehicle_t *vehicle_ = nullptr;
};

/* What outcrop-drive configures: defaults, every view kept. */
oc_vehicle_config_t drive_config(const Scene &scene);

} // namespace outcrop::bench
