// SPDX-License-Identifier: BSD-3-Clause
// What the matches of a pair say about the errors of its poses.
#pragma once

#include <vector>

#include <Eigen/Core>

#include "core/window.h"

namespace outcrop {

// The twelve pose errors of a pair, in standard deviations of their margins.
//
// Starts as the sensor leaves it: mean 0, covariance 1. fit() conditions it on
// matches, robustly, so that a strip as wide as the margins shrinks to what the
// matches leave open, however few they are: with none nothing changes. It is
// far better than a free fundamental matrix, which a few dozen matches on few
// planes do not determine (docs/design.md).
class PairErrors {
public:
    struct PixelPair {
        double x_px, y_px, x2_px, y2_px;
    };

    // pair must outlive this.
    explicit PairErrors(const oc_pair_t &pair);

    // Condition on matches of which up to a third may be wrong: iterated
    // reweighted least squares on the Sampson distance with a redescending
    // weight whose width shrinks to the pixel noise. O(iterations * n * 144).
    void fit(const std::vector<PixelPair> &matches);

    // Sampson distance left after the mean error, over its standard deviation.
    double deviation(const PixelPair &m) const;

private:
    using Vector12 = Eigen::Matrix<double, OC_PAIR_PARAMS, 1>;
    using Matrix12 = Eigen::Matrix<double, OC_PAIR_PARAMS, OC_PAIR_PARAMS>;

    // Sampson distance and its derivative by the errors.
    double linearise(const PixelPair &m, Vector12 *slope) const;

    const oc_pair_t &pair_;
    Vector12 mean_ = Vector12::Zero();
    Matrix12 covariance_ = Matrix12::Identity();
};

} // namespace outcrop
