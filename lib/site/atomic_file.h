// SPDX-License-Identifier: BSD-3-Clause
// Files that appear whole or not at all.
#pragma once

#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace outcrop {

// Write to a temporary name beside path, then rename. Throws std::runtime_error with one line that names path.
void write_whole(const std::string &path, const void *bytes, std::size_t n_bytes);
void write_whole(const std::string &path, const std::string &text);

// A PNG, the channels in OpenCV's order (grey, BGR or BGRA).
void write_png(const std::string &path, const cv::Mat &image);

} // namespace outcrop
