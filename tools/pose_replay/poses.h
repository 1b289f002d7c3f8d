// SPDX-License-Identifier: BSD-3-Clause
// Body poses out of a site folder or a CSV table.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "daemon/vehicle/pose_track.h"

namespace outcrop {

// In the order of time. Of a site folder also by view number.
struct PoseList {
    std::vector<oc_body_pose_t> poses;
    std::map<int, oc_body_pose_t> by_view;
};

// A site folder or its cameras file: the body carries the camera at body_from_optical. The file's margins, when it has
// any, become a covariance. Views without utime are one second apart from 2004 on. Throws std::runtime_error with one line.
PoseList read_site_poses(const std::string &path, const oc_pose_t &body_from_optical);

// Lines utime_us,x,y,z,qw,qx,qy,qz and, optionally, 36 numbers of covariance; blank lines and lines that begin with #
// are skipped, and so is a first line that begins with a letter. Throws std::runtime_error "FILE:LINE: ...".
PoseList read_csv_poses(const std::string &path);

} // namespace outcrop
