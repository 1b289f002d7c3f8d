/* SPDX-License-Identifier: BSD-3-Clause
 * Our detector and its rivals behind one face. */
#ifndef OUTCROP_BENCH_DETECTOR_H
#define OUTCROP_BENCH_DETECTOR_H

#include "vehicle/judoca.h"

#include <opencv2/core.hpp>
#include <vector>

namespace outcrop::bench {

/* A junction, or a corner without branches; best first where a detector ranks. */
struct Found {
    cv::Point2d at_px;
    double score;
    std::vector<double> angle_rad; /* of its branches, as the detector gives them */
    int kind;                      /* oc_junction_kind_t; OC_KIND_OTHER for corners */
};

/* JUDOCA for images of one size; sized anew when the size changes. */
class Judoca {
public:
    explicit Judoca(const oc_judoca_params_t &params) : params_(params) {}

    /* std::runtime_error when the detector refuses. */
    std::vector<Found> find(const cv::Mat &grey);

    const oc_judoca_stats_t &stats() const { return ws_.stats; }

private:
    void size_for(const cv::Mat &grey);

    oc_judoca_params_t params_;
    oc_judoca_ws_t ws_{};
    std::vector<std::uint8_t> memory_;
    cv::Size size_;
};

/* Shi-Tomasi corners, the best `count` at least 5 px apart and margin_px inside: with windows of 3 px as found, or
 * with windows of 5 px, better under noise, and refined by cornerSubPix. */
std::vector<Found> find_gftt(const cv::Mat &grey, int count, double margin_px, bool is_refined);

/* Corners strongest first, without branches. */
std::vector<Found> find_harris(const cv::Mat &grey); /* block 2, k 0.04, the largest within 3 px */
std::vector<Found> find_fast(const cv::Mat &grey);   /* 9 of 16, threshold 10 */
std::vector<Found> find_orb(const cv::Mat &grey);    /* up to 2000 over 8 levels */
std::vector<Found> find_sift(const cv::Mat &grey);   /* one per place, whatever its orientations */

} // namespace outcrop::bench
#endif
