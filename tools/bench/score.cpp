// SPDX-License-Identifier: BSD-3-Clause
#include "score.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace outcrop::bench {
namespace {

std::vector<Pairing> pair_up(std::size_t n_truth, std::size_t n_found, double reach,
                             const std::function<double(std::size_t, std::size_t)> &distance)
{
    std::vector<Pairing> possible;
    for (std::size_t t = 0; t < n_truth; t++) {
        for (std::size_t f = 0; f < n_found; f++) {
            const double d = distance(t, f);
            if (d <= reach) possible.push_back({static_cast<int>(t), static_cast<int>(f), d});
        }
    }
    std::stable_sort(possible.begin(), possible.end(),
                     [](const Pairing &a, const Pairing &b) { return a.distance < b.distance; });
    std::vector<bool> is_truth_used(n_truth), is_found_used(n_found);
    std::vector<Pairing> pairs;
    for (const Pairing &pair : possible) {
        const auto t = static_cast<std::size_t>(pair.truth), f = static_cast<std::size_t>(pair.found);
        if (is_truth_used[t] || is_found_used[f]) continue;
        is_truth_used[t] = is_found_used[f] = true;
        pairs.push_back(pair);
    }
    return pairs;
}

double inner_angle(const std::vector<double> &two)
{
    return turn_between(two[0], two[1]);
}

// Neither near the border nor near a junction that does not count.
bool is_judged(const Scene &scene, const cv::Point2d &at)
{
    const double m = scene.margin_px;
    if (!(at.x >= m && at.y >= m && at.x <= scene.picture.width_px - 1 - m && at.y <= scene.picture.height_px - 1 - m))
        return false;
    return std::none_of(scene.junctions.begin(), scene.junctions.end(), [&](const TrueJunction &junction) {
        return !junction.counts && cv::norm(junction.at_px - at) <= kIgnorePx;
    });
}

} // namespace

std::vector<Pairing> pair_points(const std::vector<cv::Point2d> &truth, const std::vector<cv::Point2d> &found,
                                 double reach_px)
{
    return pair_up(truth.size(), found.size(), reach_px,
                   [&](std::size_t t, std::size_t f) { return cv::norm(truth[t] - found[f]); });
}

std::vector<Pairing> pair_angles(const std::vector<double> &truth, const std::vector<double> &found, double reach_rad)
{
    return pair_up(truth.size(), found.size(), reach_rad,
                   [&](std::size_t t, std::size_t f) { return turn_between(truth[t], found[f]); });
}

void Tally::add(const Scene &scene, const std::vector<Found> &found)
{
    std::vector<const TrueJunction *> truth;
    std::vector<const Found *> judged;
    std::vector<cv::Point2d> true_points, found_points;
    for (const TrueJunction &junction : scene.junctions) {
        if (!junction.counts) continue;
        truth.push_back(&junction);
        true_points.push_back(junction.at_px);
    }
    for (const Found &junction : found) {
        if (!is_judged(scene, junction.at_px)) continue;
        judged.push_back(&junction);
        found_points.push_back(junction.at_px);
    }
    n_truth_ += static_cast<int>(truth.size());
    n_found_ += static_cast<int>(judged.size());
    for (const Pairing &pair : pair_points(true_points, found_points, kMatchPx))
        add_match(*truth[static_cast<std::size_t>(pair.truth)], *judged[static_cast<std::size_t>(pair.found)],
                  pair.distance);
}

void Tally::add_match(const TrueJunction &truth, const Found &found, double distance_px)
{
    distance_px_.push_back(distance_px);
    if (found.angle_rad.empty()) return;
    n_kinds_++;
    if (kind_of(truth) != found.kind) n_confused_++;
    n_true_branches_ += static_cast<int>(truth.angle_rad.size());
    n_found_branches_ += static_cast<int>(found.angle_rad.size());
    const std::vector<Pairing> pairs = pair_angles(truth.angle_rad, found.angle_rad, kMatchAngle);
    for (const Pairing &pair : pairs) angle_error_rad_.push_back(pair.distance);
    if (truth.angle_rad.size() == 2 && found.angle_rad.size() == 2 && pairs.size() == 2)
        l_bias_rad_.push_back(inner_angle(found.angle_rad) - inner_angle(truth.angle_rad));
}

std::map<std::string, double> Tally::figures() const
{
    std::map<std::string, double> figures;
    const double n_matched = static_cast<double>(distance_px_.size());
    figures["n_truth"] = n_truth_;
    figures["n_found"] = n_found_;
    if (n_truth_ > 0) figures["recall"] = n_matched / n_truth_;
    if (n_found_ > 0) figures["precision"] = n_matched / n_found_;
    if (!distance_px_.empty()) {
        figures["rmse_px"] = rms_of(distance_px_);
        figures["median_px"] = median_of(distance_px_);
    }
    if (n_kinds_ > 0) {
        figures["kind_confusion"] = static_cast<double>(n_confused_) / n_kinds_;
        figures["branch_recall"] = static_cast<double>(angle_error_rad_.size()) / n_true_branches_;
        figures["branch_precision"] = static_cast<double>(angle_error_rad_.size()) / n_found_branches_;
    }
    if (!angle_error_rad_.empty()) figures["angle_rmse_deg"] = rms_of(angle_error_rad_) / kDegree;
    if (!l_bias_rad_.empty()) figures["l_bias_deg"] = mean_of(l_bias_rad_) / kDegree;
    return figures;
}

bool sum_of_angles(const Scene &scene, const std::vector<Found> &found, double *sum_deg)
{
    std::vector<cv::Point2d> truth, at;
    for (const TrueJunction &junction : scene.junctions) truth.push_back(junction.at_px);
    for (const Found &junction : found) at.push_back(junction.at_px);
    const std::vector<Pairing> pairs = pair_points(truth, at, 2 * kMatchPx);
    *sum_deg = 0;
    for (const Pairing &pair : pairs) {
        const std::vector<double> &angle = found[static_cast<std::size_t>(pair.found)].angle_rad;
        if (angle.size() != 2) return false;
        *sum_deg += turn_between(angle[0], angle[1]) / kDegree;
    }
    return pairs.size() == truth.size();
}

double mean_of(const std::vector<double> &values)
{
    double sum = 0;
    for (const double value : values) sum += value;
    return sum / static_cast<double>(values.size());
}

double rms_of(const std::vector<double> &values)
{
    double sum = 0;
    for (const double value : values) sum += value * value;
    return std::sqrt(sum / static_cast<double>(values.size()));
}

double deviation_of(const std::vector<double> &values)
{
    if (values.size() < 2) return 0;
    const double mean = mean_of(values);
    double sum = 0;
    for (const double value : values) sum += (value - mean) * (value - mean);
    return std::sqrt(sum / static_cast<double>(values.size() - 1));
}

double median_of(std::vector<double> values)
{
    const std::size_t half = values.size() / 2;
    std::sort(values.begin(), values.end());
    return values.size() % 2 == 1 ? values[half] : (values[half - 1] + values[half]) / 2;
}

} // namespace outcrop::bench
