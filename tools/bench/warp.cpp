// SPDX-License-Identifier: BSD-3-Clause
#include "warp.h"

#include "picture.h"
#include "scenes.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

namespace outcrop::bench {

cv::Matx33d rotation_deg(double angle_deg)
{
    const double c = std::cos(angle_deg * kDegree), s = std::sin(angle_deg * kDegree);
    return {c, -s, 0, s, c, 0, 0, 0, 1};
}

cv::Matx33d scaling(double factor)
{
    return {factor, 0, 0, 0, factor, 0, 0, 0, 1};
}

cv::Matx33d tilt_deg(double angle_deg, double axis_deg)
{
    constexpr double kFocalPx = 800;
    const double c = std::cos(angle_deg * kDegree), s = std::sin(angle_deg * kDegree);
    const cv::Matx33d about_y(c, 0, 0, 0, 1, 0, s / kFocalPx, 0, 1);
    return rotation_deg(axis_deg) * about_y * rotation_deg(-axis_deg);
}

cv::Matx33d about_middle(const cv::Matx33d &matrix, double width_px, double height_px)
{
    const double x = (width_px - 1) / 2, y = (height_px - 1) / 2;
    return cv::Matx33d(1, 0, x, 0, 1, y, 0, 0, 1) * matrix * cv::Matx33d(1, 0, -x, 0, 1, -y, 0, 0, 1);
}

cv::Mat warped(const cv::Mat &image, const cv::Matx33d &to_from_image, const cv::Size &size)
{
    constexpr int kPlaces = 4; // per pixel and direction
    const cv::Matx33d image_from_to = to_from_image.inv();
    cv::Mat place(size * kPlaces, CV_32FC2);
    for (int y = 0; y < place.rows; y++) {
        for (int x = 0; x < place.cols; x++) {
            const cv::Point2d to((x + 0.5) / kPlaces - 0.5, (y + 0.5) / kPlaces - 0.5);
            place.at<cv::Point2f>(y, x) = cv::Point2f(transformed(to, image_from_to));
        }
    }
    cv::Mat exact, fine, mean, rounded;
    image.convertTo(exact, CV_32F);
    cv::remap(exact, fine, place, cv::noArray(), cv::INTER_LANCZOS4, cv::BORDER_REPLICATE);
    cv::resize(fine, mean, size, 0, 0, cv::INTER_AREA);
    mean.convertTo(rounded, CV_8U);
    return rounded;
}

} // namespace outcrop::bench
