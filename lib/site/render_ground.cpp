// SPDX-License-Identifier: BSD-3-Clause
// The ground as a texture: a pyramid sampled along each pixel's footprint.
#include <algorithm>
#include <cmath>

#include "site/render.h"

namespace outcrop {
namespace {

constexpr int kMinLevelSide = 4;
constexpr double kHatchesPerSide = 48;

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
    const auto at = [&](int y, int x) { return in(std::min(y, in.rows - 1), std::min(x, in.cols - 1)); };
    for (int y = 0; y < out.rows; y++) {
        for (int x = 0; x < out.cols; x++) {
            out(y, x) = 0.25f * (at(2 * y, 2 * x) + at(2 * y, 2 * x + 1) + at(2 * y + 1, 2 * x) +
                                 at(2 * y + 1, 2 * x + 1));
        }
    }
    return out;
}

}  // namespace

GroundTexture::GroundTexture(const OverheadMap &map)
    : metres_per_pixel_(map.metres_per_pixel), x_min_(map.x_min), y_max_(map.y_max),
      hatch_period_m_(map.metres_per_pixel * std::max(map.rgb.rows, map.rgb.cols) / kHatchesPerSide)
{
    levels_.push_back(premultiplied(map));
    while (std::min(levels_.back().rows, levels_.back().cols) > kMinLevelSide) levels_.push_back(halved(levels_.back()));
}

cv::Vec4f GroundTexture::bilinear(int level, double px, double py) const
{
    const cv::Mat4f &image = levels_[static_cast<std::size_t>(level)];
    const double shrink = std::ldexp(1.0, -level);
    const double x = (px + 0.5) * shrink - 0.5, y = (py + 0.5) * shrink - 0.5;
    if (!(x > -1 && y > -1 && x < image.cols && y < image.rows)) return {0, 0, 0, 0};
    const int x0 = static_cast<int>(std::floor(x)), y0 = static_cast<int>(std::floor(y));
    const auto wx = static_cast<float>(x - x0), wy = static_cast<float>(y - y0);
    const auto at = [&](int yy, int xx) {
        const bool is_inside = xx >= 0 && yy >= 0 && xx < image.cols && yy < image.rows;
        return is_inside ? image(yy, xx) : cv::Vec4f(0, 0, 0, 0);
    };
    return (1 - wy) * ((1 - wx) * at(y0, x0) + wx * at(y0, x0 + 1)) +
           wy * ((1 - wx) * at(y0 + 1, x0) + wx * at(y0 + 1, x0 + 1));
}

cv::Vec4f GroundTexture::sample(double x, double y, cv::Vec2d du, cv::Vec2d dv, int max_anisotropy) const
{
    const double px = (x - x_min_) / metres_per_pixel_ - 0.5, py = (y_max_ - y) / metres_per_pixel_ - 0.5;
    double longer = cv::norm(du) / metres_per_pixel_, shorter = cv::norm(dv) / metres_per_pixel_;
    cv::Vec2d axis = du;
    if (shorter > longer) {
        std::swap(longer, shorter);
        axis = dv;
    }
    if (!(longer < 1e6)) return {0, 0, 0, 0};
    const int n = std::clamp(static_cast<int>(std::ceil(longer / std::max(shorter, 1.0))), 1, max_anisotropy);
    const double lod = std::log2(std::max(longer / n, 1.0));
    const int top = static_cast<int>(levels_.size()) - 1;
    const int level = std::min(static_cast<int>(lod), top), next = std::min(level + 1, top);
    const auto blend = static_cast<float>(std::clamp(lod - level, 0.0, 1.0));
    cv::Vec4f sum(0, 0, 0, 0);
    for (int i = 0; i < n; i++) {
        const double t = ((i + 0.5) / n - 0.5) / metres_per_pixel_;
        const double sx = px + t * axis[0], sy = py - t * axis[1];
        sum += (1 - blend) * bilinear(level, sx, sy);
        if (blend > 0) sum += blend * bilinear(next, sx, sy);
    }
    sum *= 1.f / static_cast<float>(n);
    if (sum[3] <= 1e-4f) return {0, 0, 0, 0};
    return {sum[0] / sum[3], sum[1] / sum[3], sum[2] / sum[3], std::min(sum[3], 1.f)};
}

}  // namespace outcrop
