/* SPDX-License-Identifier: BSD-3-Clause
 * Finding and reading the images of a site or a run. */
#ifndef OUTCROP_EVAL_IMAGE_FILE_H
#define OUTCROP_EVAL_IMAGE_FILE_H

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>

namespace outcrop::eval {

/* "path/frame_" and 7 give "path/frame_07.png"; at least two digits. */
std::string numbered(const std::string &stem, std::size_t index);

/* The file as named, or the same name with .png, .jpg or .jpeg. */
std::optional<std::filesystem::path> find_image(const std::filesystem::path &named);

/* EvalError when it cannot be decoded. `flags` as of cv::imread. */
cv::Mat read_image(const std::filesystem::path &file, int flags);

/* A single-channel 8-bit image as it stands, for codes; EvalError otherwise. */
cv::Mat read_codes(const std::filesystem::path &file);

} // namespace outcrop::eval
#endif
