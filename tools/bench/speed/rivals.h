// SPDX-License-Identifier: BSD-3-Clause
// What is timed, each as a function that works on one picture and says how much it found.
#pragma once

#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "core/junction.h"
#include "vehicle/judoca.h"

namespace outcrop::bench {

// Our detector for one size of picture, workspace and all.
class Judoca {
public:
    Judoca(cv::Size size, const oc_judoca_params_t &params);
    std::size_t detect(const cv::Mat &grey);
    const oc_judoca_stats_t &stats() const { return ws_.stats; }

private:
    std::vector<unsigned char> block_;
    std::vector<oc_junction_t> found_;
    oc_judoca_ws_t ws_;
};

// The threshold t_B of the ratios, in grey levels per pixel of the unit-gain derivative.
constexpr double kThreshold = 6;

// The same for cv::Canny, whose 3x3 Sobel answers 8 to a ramp of one grey level per pixel. Low and high are equal
// because B+ has no hysteresis: both then keep the local maxima of magnitude over the same threshold, and Canny is
// spared the work of following weak edges.
constexpr double kCannyThreshold = 8 * kThreshold;

constexpr double kSigmaPx = 1.2;

oc_judoca_params_t fixed_params();   // lambda 10 throughout, sigma 1.2, t_B 6, s_J 0.6
oc_judoca_params_t literal_params(); // the same by the thesis' letter

// GaussianBlur and Canny(L2) with buffers that stay; the number found is not counted.
class BlurCanny {
public:
    explicit BlurCanny(double low = kCannyThreshold) : low_(low) {}
    std::size_t detect(const cv::Mat &grey);

private:
    double low_;
    cv::Mat blurred_, edges_;
};

using Work = std::function<std::size_t(const cv::Mat &)>;

struct Rival {
    std::string name;
    std::function<Work(cv::Size)> make;
};

const std::vector<Rival> &rivals();

} // namespace outcrop::bench
