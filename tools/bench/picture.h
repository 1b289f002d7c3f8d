/* SPDX-License-Identifier: BSD-3-Clause
 * Exact pictures of polygons: area-true coverage, optical blur, pixel box. Nothing is sampled at points. */
#ifndef OUTCROP_BENCH_PICTURE_H
#define OUTCROP_BENCH_PICTURE_H

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

namespace outcrop::bench {

/* Optical blur of every picture, standard deviation. */
constexpr double kBlurPx = 0.7;

/* Vertices in order (either way round), integers are pixel centres. */
struct Polygon {
    std::vector<cv::Point2d> vertex_px;
    double level; /* grey, 0..255 */
};

/* Polygons that do not overlap on a ground of one grey. They may reach beyond the image. */
struct Picture {
    int width_px, height_px;
    double background;
    std::vector<Polygon> polygons;
};

/* Each pixel is the true picture convolved with the blur and with the pixel's own square, CV_32F.
 *
 * Coverage of cells of a quarter pixel is exact, the blur is summed over these cells: an edge is where it is
 * said to be within 0.002 px (tests/bench holds it to the closed form). */
cv::Mat render(const Picture &picture);

/* The picture with every vertex moved by a homography; lines stay lines, so nothing is lost. */
Picture transformed(const Picture &picture, const cv::Matx33d &homography, int width_px, int height_px);

cv::Point2d transformed(const cv::Point2d &point_px, const cv::Matx33d &homography);

/* Gaussian noise of that variance, then rounded and clamped to 8 bit. */
cv::Mat with_noise(const cv::Mat &clean, double variance, std::uint64_t seed);

} // namespace outcrop::bench
#endif
