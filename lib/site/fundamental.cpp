// SPDX-License-Identifier: BSD-3-Clause
// Fundamental matrices by sampling.
#include "site/fundamental.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>
#include <stdexcept>

#include <opencv2/calib3d.hpp>

#include "core/epipolar.h"

namespace outcrop {
namespace {

constexpr int kSample = 7;

using Matrix3rm = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

bool is_finite(const std::vector<PixelPair> &matches)
{
    return std::all_of(matches.begin(), matches.end(),
                       [](const PixelPair &m) { return m.left_px.allFinite() && m.right_px.allFinite(); });
}

// A draw below n, the same on every standard library.
int draw(std::mt19937 *rng, int n)
{
    return static_cast<int>((static_cast<std::uint64_t>((*rng)()) * static_cast<std::uint64_t>(n)) >> 32);
}

std::array<int, kSample> draw_seven(std::mt19937 *rng, int n)
{
    std::array<int, kSample> out{};
    for (int i = 0; i < kSample; i++) {
        const auto end = out.begin() + i;
        do {
            out[static_cast<std::size_t>(i)] = draw(rng, n);
        } while (std::find(out.begin(), end, out[static_cast<std::size_t>(i)]) != end);
    }
    return out;
}

// Up to three matrices of seven matches.
std::vector<Eigen::Matrix3d> solve_seven(const std::vector<PixelPair> &matches, const std::array<int, kSample> &sample)
{
    std::vector<cv::Point2d> left, right;
    for (const int i : sample) {
        const PixelPair &m = matches[static_cast<std::size_t>(i)];
        left.emplace_back(m.left_px.x(), m.left_px.y());
        right.emplace_back(m.right_px.x(), m.right_px.y());
    }
    std::vector<Eigen::Matrix3d> out;
    const cv::Mat stacked = cv::findFundamentalMat(left, right, cv::FM_7POINT);
    for (int row = 0; row + 3 <= stacked.rows; row += 3) {
        const cv::Mat1d block = stacked.rowRange(row, row + 3);
        Eigen::Matrix3d F;
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 3; k++) F(i, k) = block(i, k);
        if (F.allFinite() && F.norm() > 0) out.emplace_back(F / F.norm());
    }
    return out;
}

Fundamental supported(const Eigen::Matrix3d &F, const std::vector<PixelPair> &matches, double t_f_px)
{
    Fundamental out;
    out.F = F;
    for (const PixelPair &m : matches) {
        const bool is_near = std::abs(epipolar_distance_px(F, m)) < t_f_px; // false for NaN
        out.is_inlier.push_back(is_near ? 1 : 0);
        out.n_inliers += is_near ? 1 : 0;
    }
    return out;
}

// Samples after which seven right matches have been drawn with this confidence.
double samples_needed(double inlier_share, double confidence)
{
    const double all_right = std::pow(inlier_share, kSample);
    if (all_right >= 1) return 1;
    if (!(all_right > 0)) return INFINITY;
    return std::log(1 - confidence) / std::log1p(-all_right);
}

} // namespace

void FundamentalOptions::check() const
{
    const bool is_good = t_f_px > 0 && std::isfinite(t_f_px) && confidence > 0 && confidence < 1 && max_samples >= 1;
    if (!is_good) throw std::invalid_argument("fundamental matrix: an option is out of range");
}

double epipolar_distance_px(const Eigen::Matrix3d &F, const PixelPair &match)
{
    const Matrix3rm rows = F;
    return oc_epipolar_distance_px(rows.data(), match.left_px.x(), match.left_px.y(), match.right_px.x(),
                                   match.right_px.y());
}

std::optional<Fundamental> fundamental_by_seven_points(const std::vector<PixelPair> &matches,
                                                       const FundamentalOptions &options)
{
    options.check();
    const int n = static_cast<int>(matches.size());
    if (n <= kSample || !is_finite(matches)) return std::nullopt;
    std::mt19937 rng(options.seed);
    std::optional<Fundamental> best;
    int drawn = 0;
    double needed = options.max_samples;
    for (; drawn < options.max_samples && drawn < needed; drawn++) {
        for (const Eigen::Matrix3d &F : solve_seven(matches, draw_seven(&rng, n))) {
            Fundamental fit = supported(F, matches, options.t_f_px);
            if (best && fit.n_inliers <= best->n_inliers) continue;
            needed = samples_needed(static_cast<double>(fit.n_inliers) / n, options.confidence);
            best = std::move(fit);
        }
    }
    if (best) best->n_samples = drawn;
    return best;
}

std::optional<Fundamental> fundamental_by_magsac(const std::vector<PixelPair> &matches,
                                                 const FundamentalOptions &options)
{
    options.check();
    if (matches.size() <= kSample || !is_finite(matches)) return std::nullopt;
    std::vector<cv::Point2d> left, right;
    for (const PixelPair &m : matches) {
        left.emplace_back(m.left_px.x(), m.left_px.y());
        right.emplace_back(m.right_px.x(), m.right_px.y());
    }
    cv::Mat1d found;
    try {
        found = cv::findFundamentalMat(left, right, cv::USAC_MAGSAC, options.t_f_px, options.confidence,
                                       options.max_samples);
    } catch (const cv::Exception &) { // what it throws for matches that span nothing
        return std::nullopt;
    }
    if (found.rows != 3 || found.cols != 3) return std::nullopt;
    Eigen::Matrix3d F;
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) F(i, k) = found(i, k);
    if (!F.allFinite() || !(F.norm() > 0)) return std::nullopt;
    return supported(F / F.norm(), matches, options.t_f_px);
}

} // namespace outcrop
