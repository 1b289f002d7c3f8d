// SPDX-License-Identifier: BSD-3-Clause
// Fundamental matrices by sampling: the thesis' own (5.5) and MAGSAC, as baselines beside the refined poses.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace outcrop {

// One match, left and right pixel.
struct PixelPair {
    Eigen::Vector2d left_px, right_px;
};

struct FundamentalOptions {
    double t_f_px = 3.0;       // thesis t_F: distance of the right pixel from the epipolar line, Eq 5.38
    double confidence = 0.999; // of having drawn seven right matches; ends the sampling
    int max_samples = 10000;
    std::uint32_t seed = 1;
    void check() const; // throws std::invalid_argument
};

struct Fundamental {
    Eigen::Matrix3d F = Eigen::Matrix3d::Zero(); // m'^T F m = 0, unit norm
    std::vector<char> is_inlier;                 // per match
    int n_inliers = 0;
    int n_samples = 0; // drawn
};

// Thesis section 5.5: seven matches at random, F of them (up to three), the largest set of matches within t_f; F is that of
// the sample, not fitted again. The same matches, options and seed give the same F. Empty for fewer than eight
// matches, which cannot vote, or when no sample gives a matrix. O(samples * n).
std::optional<Fundamental> fundamental_by_seven_points(const std::vector<PixelPair> &matches,
                                                       const FundamentalOptions &options = {});

// OpenCV's USAC_MAGSAC with t_f as the threshold; max_samples and confidence are passed on. Empty when it finds none.
std::optional<Fundamental> fundamental_by_magsac(const std::vector<PixelPair> &matches,
                                                 const FundamentalOptions &options = {});

// Distance of the right pixel from the epipolar line of the left one; NaN at the epipole.
double epipolar_distance_px(const Eigen::Matrix3d &F, const PixelPair &match);

} // namespace outcrop
