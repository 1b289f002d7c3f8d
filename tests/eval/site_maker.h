/* SPDX-License-Identifier: BSD-3-Clause
 * Writes a small site with exact truth, and the run that gets all of it right. */
#ifndef OUTCROP_TESTS_EVAL_SITE_MAKER_H
#define OUTCROP_TESTS_EVAL_SITE_MAKER_H

#include "eval/truth.h"

#include <filesystem>

namespace outcrop::eval {

/* The run's boxes carry the truth's index plus this, so that a test sees
 * whether boxes are told apart by place, not by number. */
constexpr int kFoundOffset = 10;

/* Two boxes (one turned by 30 degrees) on textured ground, four views, three
 * path frames, ray-cast in closed form; units mm, one PLY ascii, one binary. */
void write_small_site(const std::filesystem::path &site);

/* A DIR that equals the truth in everything outcrop-eval looks at. */
void write_perfect_run(const Truth &truth, const std::filesystem::path &dir);

void write_text(const std::filesystem::path &file, const std::string &text);
std::string read_text(const std::filesystem::path &file);

/* One npz of depth (dtype "<f4" or "<f2") and mask ("|u1"); npy version 1 or 2. */
void write_npz(const std::filesystem::path &file, const cv::Mat &depth, const cv::Mat &mask,
               const std::string &depth_type = "<f4", int version = 1);

} // namespace outcrop::eval
#endif
