/* SPDX-License-Identifier: BSD-3-Clause
 * One array out of a NumPy .npz file. */
#ifndef OUTCROP_EVAL_NPZ_H
#define OUTCROP_EVAL_NPZ_H

#include <filesystem>
#include <opencv2/core.hpp>
#include <string>

namespace outcrop::eval {

/* The two-dimensional array `name` (without ".npy") of an .npz file: npy
 * versions 1 and 2, C order, little-endian. float16 and float32 give CV_32F,
 * uint8 gives CV_8U. EvalError for anything else, and for a cut file. */
cv::Mat read_npz(const std::filesystem::path &file, const std::string &name);

} // namespace outcrop::eval
#endif
