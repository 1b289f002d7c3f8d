// SPDX-License-Identifier: BSD-3-Clause
// Masks as a real vehicle might send them.
#include "harm.h"

#include <random>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace outcrop::bench {
namespace {

constexpr int kEdge_px = 2, kShift_px = 15, kPatch_px = 16;
constexpr double kUnknownShare = 0.05;

void move_edge(bool is_grown, cv::Mat1b *labels)
{
    const int side = 2 * kEdge_px + 1;
    const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {side, side});
    cv::Mat1b body = *labels == OC_LABEL_OBSTACLE, moved;
    cv::morphologyEx(body, moved, is_grown ? cv::MORPH_DILATE : cv::MORPH_ERODE, disc);
    labels->setTo(OC_LABEL_GROUND, body & ~moved);
    labels->setTo(OC_LABEL_OBSTACLE, moved);
}

void forget(unsigned seed, cv::Mat1b *labels)
{
    std::mt19937 random(seed);
    const double n = kUnknownShare * static_cast<double>(labels->total()) / (kPatch_px * kPatch_px);
    for (int i = 0; i < static_cast<int>(n); ++i) {
        const int x = static_cast<int>(random() % static_cast<unsigned>(labels->cols - kPatch_px));
        const int y = static_cast<int>(random() % static_cast<unsigned>(labels->rows - kPatch_px));
        (*labels)(cv::Rect(x, y, kPatch_px, kPatch_px)) = OC_LABEL_UNKNOWN;
    }
}

void shift(cv::Mat1b *labels)
{
    cv::Mat1b moved;
    const cv::Mat1d matrix = (cv::Mat1d(2, 3) << 1, 0, kShift_px, 0, 1, 0);
    cv::warpAffine(*labels, moved, matrix, labels->size(), cv::INTER_NEAREST, cv::BORDER_REPLICATE);
    *labels = moved;
}

} // namespace

const std::vector<std::string> &harms()
{
    static const std::vector<std::string> names{"none", "erode", "dilate", "unknown", "wrong", "shifted"};
    return names;
}

void harm(const std::string &kind, std::vector<CarveView> *views)
{
    if (kind == "none" || views->empty()) return;
    for (CarveView &view : *views) {
        if (kind == "erode" || kind == "dilate") move_edge(kind == "dilate", &view.labels);
        if (kind == "unknown") forget(static_cast<unsigned>(view.id) + 1, &view.labels);
    }
    CarveView &one = (*views)[views->size() / 2];
    if (kind == "wrong") one.labels = cv::Mat1b(one.labels.size(), static_cast<uchar>(OC_LABEL_GROUND));
    if (kind == "shifted") shift(&one.labels);
}

} // namespace outcrop::bench
