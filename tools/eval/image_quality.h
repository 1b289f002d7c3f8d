/* SPDX-License-Identifier: BSD-3-Clause
 * PSNR and SSIM. */
#ifndef OUTCROP_EVAL_IMAGE_QUALITY_H
#define OUTCROP_EVAL_IMAGE_QUALITY_H

#include <cstdint>
#include <opencv2/core.hpp>
#include <optional>

namespace outcrop::eval {

/* Images that do not differ have no finite PSNR; this stands for it. */
constexpr double kIdenticalDb = 99.0;

/* Squared error over any number of images, for one PSNR over all of them. */
class SquaredError {
public:
    /* Adds two 8-bit images of the same size and channels; only where `mask`
     * (CV_8U) is not 0 unless it is empty. */
    void add(const cv::Mat &a, const cv::Mat &b, const cv::Mat &mask = cv::Mat());
    /* 10 log10(255^2 / mean squared error), at most kIdenticalDb; nothing without a sample. */
    std::optional<double> psnr_db() const;

private:
    double sum_ = 0;
    std::uint64_t n_ = 0;
};

/* Structural similarity of two 8-bit BGR images' luminance, mean over the pixels
 * whose whole window lies inside (Wang et al. 2004: Gaussian window 11x11,
 * sigma 1.5, K1 = 0.01, K2 = 0.03). Images of at least 11x11. */
double ssim(const cv::Mat &a, const cv::Mat &b);

} // namespace outcrop::eval
#endif
