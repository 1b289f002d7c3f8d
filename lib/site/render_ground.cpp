// SPDX-License-Identifier: BSD-3-Clause
// The ground as a texture: a pyramid sampled along each pixel's footprint.
#include <algorithm>
#include <cmath>

#include "site/render.h"

namespace outcrop {
namespace {

constexpr int kMinLevelSide = 4;
constexpr double kHatchesPerSide = 48;
constexpr double kLeastPeriodPx = 10; // of the stripes, in pixels of the frame
constexpr double kFarContrast = 0.3;  // of far stripes, against 1 of near ones

cv::Mat4f premultiplied(const OverheadMap &map)
{
    cv::Mat4f out(map.rgb.size());
    for (int y = 0; y < out.rows; y++) {
        for (int x = 0; x < out.cols; x++) {
            const float a = map.seen(y, x) ? 1.f : 0.f;
            const cv::Vec3b &c = map.rgb(y, x);
            out(y, x) = cv::Vec4f(a * c[0], a * c[1], a * c[2], a);
        }
    }
    return out;
}

cv::Mat4f halved(const cv::Mat4f &in)
{
    cv::Mat4f out((in.rows + 1) / 2, (in.cols + 1) / 2);
    const auto at = [&](int y, int x) { return y < in.rows && x < in.cols ? in(y, x) : cv::Vec4f(0, 0, 0, 0); };
    for (int y = 0; y < out.rows; y++) {
        for (int x = 0; x < out.cols; x++) {
            out(y, x) =
                0.25f * (at(2 * y, 2 * x) + at(2 * y, 2 * x + 1) + at(2 * y + 1, 2 * x) + at(2 * y + 1, 2 * x + 1));
        }
    }
    return out;
}

cv::Mat4f framed(const cv::Mat4f &in)
{
    cv::Mat4f out(in.rows + 2, in.cols + 2, cv::Vec4f(0, 0, 0, 0));
    in.copyTo(out(cv::Rect(1, 1, in.cols, in.rows)));
    return out;
}

// 1 on a stripe, -1 between stripes, its edge as wide as a pixel.
double stripe(double x, double y, double period_m, double footprint_m)
{
    const double phase = (x + y) / (period_m * std::sqrt(2.0));
    const double wave = 4 * std::abs(phase - std::floor(phase) - 0.5) - 1;
    return std::clamp(wave * period_m / (4 * std::max(footprint_m, 1e-12)), -1.0, 1.0);
}

} // namespace

GroundTexture::GroundTexture(const OverheadMap &map)
    : metres_per_pixel_(map.metres_per_pixel), x_min_(map.x_min), y_max_(map.y_max),
      hatch_period_m_(map.metres_per_pixel * std::max(map.rgb.rows, map.rgb.cols) / kHatchesPerSide)
{
    cv::Mat4f level = premultiplied(map);
    const cv::Scalar sum = cv::sum(level);
    const double brightness = sum[3] > 0 ? (sum[0] + sum[1] + sum[2]) / (3 * sum[3]) : 128;
    const auto tone = static_cast<float>(std::clamp(brightness, 80.0, 200.0));
    hatch_dark_ = cv::Vec3f(0.86f * tone, 0.86f * tone, 0.89f * tone);
    hatch_light_ = cv::Vec3f(1.07f * tone, 1.07f * tone, 1.10f * tone);
    levels_.push_back(framed(level));
    while (std::min(level.rows, level.cols) > kMinLevelSide) {
        level = halved(level);
        levels_.push_back(framed(level));
    }
}

void GroundTexture::add_bilinear(int level, double px, double py, float weight, float sum[4]) const
{
    const cv::Mat4f &image = levels_[static_cast<std::size_t>(level)];
    const double shrink = 1.0 / (1 << level);
    const double x = (px + 0.5) * shrink + 0.5, y = (py + 0.5) * shrink + 0.5; // in the framed image
    if (!(x >= 0 && y >= 0 && x < image.cols - 1 && y < image.rows - 1)) return;
    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
    const auto ax = static_cast<float>(x - x0), ay = static_cast<float>(y - y0);
    const float *top = image.ptr<float>(y0) + 4 * x0, *low = image.ptr<float>(y0 + 1) + 4 * x0;
    const float w00 = weight * (1 - ay) * (1 - ax), w01 = weight * (1 - ay) * ax;
    const float w10 = weight * ay * (1 - ax), w11 = weight * ay * ax;
    for (int c = 0; c < 4; c++) sum[c] += w00 * top[c] + w01 * top[4 + c] + w10 * low[c] + w11 * low[4 + c];
}

cv::Vec4f GroundTexture::sample(double x, double y, cv::Vec2d du, cv::Vec2d dv, int max_anisotropy) const
{
    const double scale = 1 / metres_per_pixel_;
    const double px = (x - x_min_) * scale - 0.5, py = (y_max_ - y) * scale - 0.5;
    double longer = std::sqrt(du.dot(du)) * scale, shorter = std::sqrt(dv.dot(dv)) * scale;
    cv::Vec2d axis = du;
    if (shorter > longer) {
        std::swap(longer, shorter);
        axis = dv;
    }
    const cv::Mat4f &whole = levels_.front();
    const double reach = 2 * longer + 2; // a coarse texel outside the map may still hold some of it
    if (!(longer < 1e6) || px < -reach || py < -reach || px > whole.cols + reach || py > whole.rows + reach)
        return {0, 0, 0, 0};
    const int n = std::clamp(static_cast<int>(std::ceil(longer / std::max(shorter, 1.0))), 1, max_anisotropy);
    const double spread = longer / n;
    const int top = static_cast<int>(levels_.size()) - 1;
    const double lod = spread > 1 ? std::log2(spread) : 0;
    const int level = std::min(static_cast<int>(lod), top), next = std::min(level + 1, top);
    const auto blend = static_cast<float>(std::min(lod - level, 1.0));
    float sum[4] = {0, 0, 0, 0};
    for (int i = 0; i < n; i++) {
        const double t = ((i + 0.5) / n - 0.5) * scale;
        const double sx = px + t * axis[0], sy = py - t * axis[1];
        add_bilinear(level, sx, sy, 1 - blend, sum);
        if (blend > 0) add_bilinear(next, sx, sy, blend, sum);
    }
    if (!(sum[3] > 1e-4f * static_cast<float>(n))) return {0, 0, 0, 0};
    const float inverse = 1 / sum[3], cover = sum[3] / static_cast<float>(n);
    return {sum[0] * inverse, sum[1] * inverse, sum[2] * inverse, cover > 0.9999f ? 1.f : cover};
}

cv::Vec3f GroundTexture::hatch(double x, double y, double footprint_m) const
{
    const double octave = std::clamp(std::log2(kLeastPeriodPx * footprint_m / hatch_period_m_), 0.0, 40.0);
    const double period = hatch_period_m_ * std::ldexp(1.0, static_cast<int>(octave));
    const double blend = std::clamp(4 * (octave - std::floor(octave)) - 3, 0.0, 1.0);
    double mix = stripe(x, y, period, footprint_m);
    if (blend > 0) mix = (1 - blend) * mix + blend * stripe(x, y, 2 * period, footprint_m);
    const double contrast = std::max(kFarContrast, 1 - 0.25 * octave);
    const auto light = static_cast<float>(0.5 + 0.5 * contrast * mix);
    return (1 - light) * hatch_dark_ + light * hatch_light_;
}

} // namespace outcrop
