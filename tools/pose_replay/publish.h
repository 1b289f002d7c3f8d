// SPDX-License-Identifier: BSD-3-Clause
// Body poses onto an LCM channel, paced.
#pragma once

#include <string>

#include "daemon/vehicle/pose_lcm.h"
#include "poses.h"

namespace outcrop {

struct PublishOptions {
    std::string url = "udpm://239.255.76.69:7669?ttl=0";
    std::string channel; // "" = the type's own
    oc_pose_type_t type = OC_POSE_OUTCROP;
    double rate_hz = 50;
    double speed = 1;
    bool is_now = false;
    bool is_looped = false; // only with is_now
    int hold_view = -1;     // >= 0: this view's pose for ever; other numbers come in on standard input
};

// Publish until the end, SIGTERM or SIGINT. Poses between two of the list are interpolated. Returns how many were sent.
// Throws std::runtime_error with one line.
long publish_poses(const PoseList &list, const PublishOptions &options);

} // namespace outcrop
