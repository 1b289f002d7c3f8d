/* SPDX-License-Identifier: BSD-3-Clause
 * Plane views of a plane: homographies that keep the middle of an image in place, and pictures seen through them. */
#ifndef OUTCROP_BENCH_WARP_H
#define OUTCROP_BENCH_WARP_H

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace outcrop::bench {

struct NamedWarp {
    std::string name;
    cv::Matx33d matrix; /* for an image whose middle is the origin */
};

cv::Matx33d rotation_deg(double angle_deg);
cv::Matx33d scaling(double factor);

/* The plane leant back by that angle round an axis in the image, seen with 800 px of focal length at a scale of 1. */
cv::Matx33d tilt_deg(double angle_deg, double axis_deg);

/* The matrix for pixel coordinates of an image of that size. */
cv::Matx33d about_middle(const cv::Matx33d &matrix, double width_px, double height_px);

/* The image seen through `to_from_image`: each pixel is the mean of 16 places of the Lanczos-interpolated image, so
 * that what becomes smaller does not alias. Grey of the nearest border pixel outside. */
cv::Mat warped(const cv::Mat &image, const cv::Matx33d &to_from_image, const cv::Size &size);

} // namespace outcrop::bench
#endif
