// SPDX-License-Identifier: BSD-3-Clause
// Robust linear estimate of a pair's pose errors from epipolar distances.
#include "site/pair_errors.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Cholesky>

#include "core/mat3.h"

namespace outcrop {
namespace {

constexpr int kIterations = 12;
constexpr double kShrink = 0.7;     // of the weight's width, per iteration
constexpr double kFinalWidth = 2.0; // in standard deviations of a right match

// m'^T A m and the two line normals that are its gradient.
struct Residual {
    double value;
    std::array<double, 4> gradient;
};

Residual residual_of(const double A[9], const PairErrors::PixelPair &m)
{
    const double right[3] = {m.x2_px, m.y2_px, 1};
    double line[3];
    double line_back[3];
    oc_mat3_mul_point(A, m.x_px, m.y_px, line);
    oc_mat3_mul_vec_t(A, right, line_back);
    return Residual{oc_vec3_dot(line, right), {line[0], line[1], line_back[0], line_back[1]}};
}

double dot(const std::array<double, 4> &a, const std::array<double, 4> &b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3];
}

double median_of(std::vector<double> values)
{
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
}

} // namespace

PairErrors::PairErrors(const oc_pair_t &pair) : pair_(pair) {}

double PairErrors::linearise(const PixelPair &m, Vector12 *slope) const
{
    const Residual r = residual_of(pair_.F, m);
    const double norm2 = dot(r.gradient, r.gradient);
    const double norm = std::sqrt(norm2);
    for (int k = 0; k < OC_PAIR_PARAMS; k++) {
        // Away from the line the change of the gradient's length counts as well.
        const Residual d = residual_of(pair_.dF[k], m);
        (*slope)[k] = (d.value - r.value * dot(r.gradient, d.gradient) / norm2) / norm;
    }
    return r.value / norm;
}

void PairErrors::fit(const std::vector<PixelPair> &matches)
{
    mean_.setZero();
    covariance_.setIdentity();
    if (matches.empty()) return;
    std::vector<Vector12> slopes(matches.size());
    std::vector<double> distances(matches.size());
    std::vector<double> sizes(matches.size());
    for (std::size_t i = 0; i < matches.size(); i++) {
        distances[i] = linearise(matches[i], &slopes[i]);
        sizes[i] = std::abs(distances[i]);
    }
    const double noise2 = pair_.sigma_px * pair_.sigma_px;
    const double final_width = kFinalWidth * pair_.sigma_px;
    double width = std::max(final_width, 2 * median_of(sizes));
    for (int iteration = 0; iteration < kIterations; iteration++) {
        Matrix12 information = Matrix12::Identity();
        Vector12 pull = Vector12::Zero();
        for (std::size_t i = 0; i < matches.size(); i++) {
            const double left = (distances[i] + slopes[i].dot(mean_)) / width;
            const double keep = 1 / (1 + left * left);
            const double weight = keep * keep / noise2; // Geman-McClure
            information += weight * slopes[i] * slopes[i].transpose();
            pull -= weight * distances[i] * slopes[i];
        }
        const Eigen::LDLT<Matrix12> solver(information);
        mean_ = solver.solve(pull);
        covariance_ = solver.solve(Matrix12::Identity());
        width = std::max(final_width, kShrink * width);
    }
}

double PairErrors::deviation(const PixelPair &m) const
{
    Vector12 slope;
    const double distance = linearise(m, &slope) + slope.dot(mean_);
    const double variance = pair_.sigma_px * pair_.sigma_px + slope.dot(covariance_ * slope);
    return std::abs(distance) / std::sqrt(variance);
}

} // namespace outcrop
