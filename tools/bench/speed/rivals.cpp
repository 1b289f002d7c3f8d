// SPDX-License-Identifier: BSD-3-Clause
#include "rivals.h"

#include <memory>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace outcrop::bench {

Judoca::Judoca(cv::Size size, const oc_judoca_params_t &params) : found_(OC_MAX_JUNCTIONS)
{
    const auto width = static_cast<uint32_t>(size.width), height = static_cast<uint32_t>(size.height);
    block_.resize(oc_judoca_size_bytes(width, height, &params));
    oc_arena_t arena;
    if (oc_arena_init(&arena, block_.data(), block_.size()) != OC_OK ||
        oc_judoca_init(&ws_, &arena, width, height, &params) != OC_OK)
        throw std::runtime_error("the detector refuses its parameters");
}

std::size_t Judoca::detect(const cv::Mat &grey)
{
    const oc_image_t image = {grey.data, static_cast<uint32_t>(grey.cols), static_cast<uint32_t>(grey.rows),
                              static_cast<uint32_t>(grey.step), 1};
    uint32_t count = 0;
    if (oc_judoca_detect(&ws_, &image, found_.data(), static_cast<uint32_t>(found_.size()), &count) != OC_OK)
        throw std::runtime_error("the detector refuses a picture");
    return count;
}

oc_judoca_params_t fixed_params()
{
    oc_judoca_params_t params = oc_judoca_defaults();
    params.lambda_px = params.lambda_min_px = 10;
    params.sigma_px = static_cast<float>(kSigmaPx);
    params.t_b = static_cast<float>(kThreshold);
    params.s_j = 0.6f;
    return params;
}

oc_judoca_params_t literal_params()
{
    oc_judoca_params_t params = fixed_params();
    params.method = OC_JUDOCA_THESIS;
    return params;
}

std::size_t BlurCanny::detect(const cv::Mat &grey)
{
    cv::GaussianBlur(grey, blurred_, {}, kSigmaPx);
    cv::Canny(blurred_, edges_, low_, kCannyThreshold, 3, true);
    return 0;
}

namespace {

template <class T>
Work work_of(std::shared_ptr<T> detector)
{
    return [detector](const cv::Mat &grey) { return detector->detect(grey); };
}

// Corners by Shi and Tomasi, each refined as in OpenCV's own examples.
std::size_t find_good_features(const cv::Mat &grey)
{
    std::vector<cv::Point2f> corners;
    cv::goodFeaturesToTrack(grey, corners, 500, 0.01, 3);
    if (!corners.empty()) {
        const cv::TermCriteria until(cv::TermCriteria::EPS + cv::TermCriteria::COUNT, 20, 0.01);
        cv::cornerSubPix(grey, corners, {5, 5}, {-1, -1}, until);
    }
    return corners.size();
}

std::size_t find_fast(const cv::Mat &grey)
{
    std::vector<cv::KeyPoint> found;
    cv::FAST(grey, found, 20);
    return found.size();
}

// With descriptors, as they are used.
Work features_of(const cv::Ptr<cv::Feature2D> &features)
{
    return [features](const cv::Mat &grey) {
        std::vector<cv::KeyPoint> found;
        cv::Mat descriptors;
        features->detectAndCompute(grey, cv::noArray(), found, descriptors);
        return found.size();
    };
}

Work segments()
{
    return [detector = cv::createLineSegmentDetector()](const cv::Mat &grey) {
        std::vector<cv::Vec4f> found;
        detector->detect(grey, found);
        return found.size();
    };
}

Work judoca(cv::Size size, const oc_judoca_params_t &params)
{
    return work_of(std::make_shared<Judoca>(size, params));
}

} // namespace

const std::vector<Rival> &rivals()
{
    static const std::vector<Rival> all = {
        {"blur+Canny", [](cv::Size) { return work_of(std::make_shared<BlurCanny>()); }},
        {"blur+Canny(24,48)", [](cv::Size) { return work_of(std::make_shared<BlurCanny>(kCannyThreshold / 2)); }},
        {"GFTT500+cornerSubPix", [](cv::Size) { return Work(find_good_features); }},
        {"FAST", [](cv::Size) { return Work(find_fast); }},
        {"ORB500", [](cv::Size) { return features_of(cv::ORB::create(500)); }},
        {"SIFT", [](cv::Size) { return features_of(cv::SIFT::create()); }},
        {"LSD", [](cv::Size) { return segments(); }},
        {"ours", [](cv::Size size) { return judoca(size, oc_judoca_defaults()); }},
        {"ours_fixed10", [](cv::Size size) { return judoca(size, fixed_params()); }},
        {"ours_literal", [](cv::Size size) { return judoca(size, literal_params()); }},
    };
    return all;
}

} // namespace outcrop::bench
