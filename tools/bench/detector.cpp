// SPDX-License-Identifier: BSD-3-Clause
#include "detector.h"

#include <algorithm>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

namespace outcrop::bench {
namespace {

void demand(oc_status_t status, const char *what)
{
    if (status != OC_OK) throw std::runtime_error(std::string(what) + ": " + oc_status_text(status));
}

std::vector<Found> strongest_first(std::vector<Found> found)
{
    std::stable_sort(found.begin(), found.end(), [](const Found &a, const Found &b) { return a.score > b.score; });
    return found;
}

std::vector<Found> from_keypoints(const std::vector<cv::KeyPoint> &keypoints)
{
    std::vector<Found> found;
    for (const cv::KeyPoint &point : keypoints) {
        const cv::Point2d at(point.pt);
        if (!found.empty() && found.back().at_px == at) continue;
        found.push_back({at, static_cast<double>(point.response), {}, OC_KIND_OTHER});
    }
    return strongest_first(std::move(found));
}

} // namespace

void Judoca::size_for(const cv::Mat &grey)
{
    const auto width = static_cast<std::uint32_t>(grey.cols), height = static_cast<std::uint32_t>(grey.rows);
    memory_.resize(oc_judoca_size_bytes(width, height, &params_));
    oc_arena_t arena;
    demand(oc_arena_init(&arena, memory_.data(), memory_.size()), "junction detector's memory");
    demand(oc_judoca_init(&ws_, &arena, width, height, &params_), "junction detector's parameters");
    size_ = grey.size();
}

std::vector<Found> Judoca::find(const cv::Mat &grey)
{
    if (grey.size() != size_) size_for(grey);
    const oc_image_t image = {grey.data, static_cast<std::uint32_t>(grey.cols), static_cast<std::uint32_t>(grey.rows),
                              static_cast<std::uint32_t>(grey.step), 1};
    std::vector<oc_junction_t> junctions(OC_MAX_JUNCTIONS);
    std::uint32_t count = 0;
    demand(oc_judoca_detect(&ws_, &image, junctions.data(), OC_MAX_JUNCTIONS, &count), "junction detector");
    std::vector<Found> found;
    for (std::uint32_t i = 0; i < count; i++) {
        const oc_junction_t &junction = junctions[i];
        found.push_back({{static_cast<double>(junction.x_px), static_cast<double>(junction.y_px)},
                         static_cast<double>(junction.score),
                         {},
                         junction.kind});
        for (std::uint32_t b = 0; b < junction.n_branches; b++)
            found.back().angle_rad.push_back(static_cast<double>(junction.branch[b].angle_rad));
    }
    return found;
}

std::vector<Found> find_gftt(const cv::Mat &grey, int count, double margin_px, bool is_refined)
{
    const int margin = static_cast<int>(margin_px);
    cv::Mat mask(grey.size(), CV_8U, cv::Scalar(0));
    mask(cv::Rect(margin, margin, grey.cols - 2 * margin, grey.rows - 2 * margin)) = 255;
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(grey, corners, count, 0.001, 5, mask, is_refined ? 5 : 3);
    if (is_refined && !corners.empty()) {
        const cv::TermCriteria until(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 40, 0.001);
        cv::cornerSubPix(grey, corners, cv::Size(5, 5), cv::Size(-1, -1), until);
    }
    std::vector<Found> found;
    for (const cv::Point2f &corner : corners)
        found.push_back({cv::Point2d(corner), -static_cast<double>(found.size()), {}, OC_KIND_OTHER});
    return found;
}

std::vector<Found> find_harris(const cv::Mat &grey)
{
    cv::Mat response, largest;
    cv::cornerHarris(grey, response, 2, 3, 0.04);
    cv::dilate(response, largest, cv::Mat::ones(7, 7, CV_8U));
    std::vector<Found> found;
    for (int y = 3; y < grey.rows - 3; y++) {
        for (int x = 3; x < grey.cols - 3; x++) {
            const float here = response.at<float>(y, x);
            if (here > 0 && here == largest.at<float>(y, x))
                found.push_back({cv::Point2d(x, y), static_cast<double>(here), {}, OC_KIND_OTHER});
        }
    }
    return strongest_first(std::move(found));
}

std::vector<Found> find_fast(const cv::Mat &grey)
{
    std::vector<cv::KeyPoint> keypoints;
    cv::FAST(grey, keypoints, 10, true);
    return from_keypoints(keypoints);
}

std::vector<Found> find_orb(const cv::Mat &grey)
{
    std::vector<cv::KeyPoint> keypoints;
    cv::ORB::create(2000)->detect(grey, keypoints);
    return from_keypoints(keypoints);
}

std::vector<Found> find_sift(const cv::Mat &grey)
{
    std::vector<cv::KeyPoint> keypoints;
    cv::SIFT::create()->detect(grey, keypoints);
    return from_keypoints(keypoints);
}

} // namespace outcrop::bench
