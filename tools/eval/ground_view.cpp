// SPDX-License-Identifier: BSD-3-Clause
// The true ground as a virtual camera sees it, and as it moves between frames.
#include "ground_view.h"

#include <opencv2/imgproc.hpp>

namespace outcrop::eval {

namespace {

constexpr float kNowhere = -1e4f;

// Overhead pixel of each ray at (col, row) + offset, kNowhere off the map.
cv::Mat overhead_map(const TrueOverhead &overhead, const Camera &camera, const Eigen::Vector2d &offset)
{
    cv::Mat map(camera.height, camera.width, CV_32FC2);
    for (int row = 0; row < camera.height; row++) {
        for (int col = 0; col < camera.width; col++) {
            cv::Vec2f &at = map.at<cv::Vec2f>(row, col);
            at = {kNowhere, kNowhere};
            const auto p = camera.on_ground(Eigen::Vector2d(col, row) + offset);
            if (!p) continue;
            const double x = (p->x() - overhead.x_min_m) / overhead.metres_per_pixel - 0.5;
            const double y = (overhead.y_max_m - p->y()) / overhead.metres_per_pixel - 0.5;
            if (!(x >= 0 && y >= 0 && x <= overhead.image.cols - 1 && y <= overhead.image.rows - 1)) continue;
            at = {static_cast<float>(x), static_cast<float>(y)};
        }
    }
    return map;
}

} // namespace

GroundView warp_overhead(const TrueOverhead &overhead, const Camera &camera)
{
    cv::Mat sum(camera.height, camera.width, CV_32FC3, cv::Scalar::all(0));
    GroundView out;
    out.known = cv::Mat(camera.height, camera.width, CV_8U, cv::Scalar(255));
    for (const int dy : {-1, 0, 1}) {
        for (const int dx : {-1, 0, 1}) {
            const cv::Mat map = overhead_map(overhead, camera, Eigen::Vector2d(dx, dy) / 3);
            cv::Mat seen, x;
            cv::remap(overhead.image, seen, map, cv::noArray(), cv::INTER_LINEAR);
            cv::accumulate(seen, sum);
            cv::extractChannel(map, x, 0);
            out.known.setTo(0, x < 0);
        }
    }
    sum.convertTo(out.image, CV_8UC3, 1.0 / 9);
    return out;
}

cv::Mat ground_flow(const Camera &to, const Camera &from)
{
    cv::Mat map(to.height, to.width, CV_32FC2, cv::Scalar(kNowhere, kNowhere));
    for (int row = 0; row < to.height; row++) {
        for (int col = 0; col < to.width; col++) {
            const auto p = to.on_ground(Eigen::Vector2d(col, row));
            const auto at = p ? from.project(*p) : std::nullopt;
            if (!at || !from.inside(at->pixel)) continue;
            map.at<cv::Vec2f>(row, col) = {static_cast<float>(at->pixel.x()), static_cast<float>(at->pixel.y())};
        }
    }
    return map;
}

cv::Mat ground_pixels(const cv::Mat &mask, const Camera &camera)
{
    cv::Mat out(mask.size(), CV_8U, cv::Scalar(0));
    for (int row = 0; row < mask.rows; row++)
        for (int col = 0; col < mask.cols; col++)
            if (is_ground_code(mask.at<std::uint8_t>(row, col)) && camera.on_ground(Eigen::Vector2d(col, row)))
                out.at<std::uint8_t>(row, col) = 255;
    return out;
}

} // namespace outcrop::eval
