/* SPDX-License-Identifier: BSD-3-Clause
 * Holds what a detector found against what is there. */
#ifndef OUTCROP_BENCH_SCORE_H
#define OUTCROP_BENCH_SCORE_H

#include "detector.h"
#include "scenes.h"

#include <map>
#include <string>
#include <vector>

namespace outcrop::bench {

constexpr double kMatchPx = 2;
constexpr double kMatchAngle = 15 * kDegree;
constexpr double kIgnorePx = 6; /* round a junction that does not count */

/* Indices of what belongs together, nearest first, each used once, no farther than that. */
struct Pairing {
    int truth, found;
    double distance;
};
std::vector<Pairing> pair_points(const std::vector<cv::Point2d> &truth, const std::vector<cv::Point2d> &found,
                                 double reach_px);
std::vector<Pairing> pair_angles(const std::vector<double> &truth, const std::vector<double> &found, double reach_rad);

/* Sums over many scenes. */
class Tally {
public:
    void add(const Scene &scene, const std::vector<Found> &found);

    /* recall, precision, rmse_px, median_px, and where branches were found: angle_rmse_deg, branch_recall,
     * branch_precision, kind_confusion, l_bias_deg (found less true inner angle of L junctions, mean). What cannot
     * be told is left out. */
    std::map<std::string, double> figures() const;

private:
    void add_match(const TrueJunction &truth, const Found &found, double distance_px);

    int n_truth_ = 0, n_found_ = 0, n_confused_ = 0, n_kinds_ = 0;
    int n_true_branches_ = 0, n_found_branches_ = 0;
    std::vector<double> distance_px_, angle_error_rad_, l_bias_rad_;
};

/* Of a triangle's corners as found, each the nearest within 2 kMatchPx; false when one is missing or has not two
 * branches. */
bool sum_of_angles(const Scene &scene, const std::vector<Found> &found, double *sum_deg);

double mean_of(const std::vector<double> &values);
double rms_of(const std::vector<double> &values);
double deviation_of(const std::vector<double> &values); /* n - 1 below */
double median_of(std::vector<double> values);

} // namespace outcrop::bench
#endif
