// SPDX-License-Identifier: BSD-3-Clause
// PSNR and SSIM.
#include "image_quality.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace outcrop::eval {

namespace {

constexpr int kWindow = 11;

cv::Mat luminance(const cv::Mat &image)
{
    cv::Mat grey, out;
    if (image.channels() == 3)
        cv::cvtColor(image, grey, cv::COLOR_BGR2GRAY);
    else
        grey = image;
    grey.convertTo(out, CV_64F);
    return out;
}

cv::Mat window_mean(const cv::Mat &image)
{
    cv::Mat out;
    cv::GaussianBlur(image, out, {kWindow, kWindow}, 1.5);
    return out;
}

} // namespace

void SquaredError::add(const cv::Mat &a, const cv::Mat &b, const cv::Mat &mask)
{
    CV_Assert(a.size() == b.size() && a.type() == b.type() && a.depth() == CV_8U);
    CV_Assert(mask.empty() || (mask.size() == a.size() && mask.type() == CV_8U));
    const double distance = mask.empty() ? cv::norm(a, b, cv::NORM_L2SQR) : cv::norm(a, b, cv::NORM_L2SQR, mask);
    const auto pixels =
        mask.empty() ? static_cast<std::uint64_t>(a.total()) : static_cast<std::uint64_t>(cv::countNonZero(mask));
    sum_ += distance;
    n_ += pixels * static_cast<std::uint64_t>(a.channels());
}

std::optional<double> SquaredError::psnr_db() const
{
    if (n_ == 0) return std::nullopt;
    if (!(sum_ > 0)) return kIdenticalDb;
    const double mean = sum_ / static_cast<double>(n_);
    return std::min(kIdenticalDb, 10 * std::log10(255.0 * 255.0 / mean));
}

double ssim(const cv::Mat &a, const cv::Mat &b)
{
    CV_Assert(a.size() == b.size() && a.rows >= kWindow && a.cols >= kWindow);
    const double c1 = std::pow(0.01 * 255, 2), c2 = std::pow(0.03 * 255, 2);
    const cv::Mat x = luminance(a), y = luminance(b);
    const cv::Mat mx = window_mean(x), my = window_mean(y);
    const cv::Mat mxx = mx.mul(mx), myy = my.mul(my), mxy = mx.mul(my);
    const cv::Mat vx = window_mean(x.mul(x)) - mxx, vy = window_mean(y.mul(y)) - myy;
    const cv::Mat vxy = window_mean(x.mul(y)) - mxy;
    const cv::Mat top = (2 * mxy + c1).mul(2 * vxy + c2);
    const cv::Mat bottom = cv::Mat(mxx + myy + c1).mul(cv::Mat(vx + vy + c2));
    cv::Mat map;
    cv::divide(top, bottom, map);
    const int half = kWindow / 2;
    return cv::mean(map(cv::Range(half, map.rows - half), cv::Range(half, map.cols - half)))[0];
}

} // namespace outcrop::eval
