// SPDX-License-Identifier: BSD-3-Clause
// The visual hull in blocks: integral images of the labels decide whole blocks where a view has one opinion of them.
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "site/carve.h"

namespace outcrop {

// Where the votes of a view about points are looked up.
class LabelView {
public:
    explicit LabelView(const CarveView &view); // keeps references to the view's labels

    int id() const { return id_; }
    bool says_anything() const { return says_anything_; }
    // Label at the projection of a world point; unknown behind the camera and outside the image.
    int label_at(const Eigen::Vector3d &p) const;
    // The label that every point of the box low..high projects to, or -1 when there may be several.
    int label_of_box(const Eigen::Vector3d &low, const Eigen::Vector3d &high) const;
    // Labels of n points p, p + (step, 0, 0), ...
    void labels_of_row(const Eigen::Vector3d &p, double step, int n, std::uint8_t *labels) const;

private:
    int count(const cv::Mat1i &sums, int x0, int y0, int x1, int y1) const;

    int id_;
    cv::Mat1b labels_;
    cv::Mat1i ground_, obstacle_; // integral images
    double projection_[12];
    bool says_anything_;
};

// Silhouettes only.
std::vector<VoxelState> carve_hull(const VoxelGrid &grid, const std::vector<LabelView> &views, int tolerated_misses,
                                   int min_views);

// Indices of views that contradict all others: alone they would carve away nearly all that the rest agrees on.
std::vector<int> contradicting_views(const VoxelGrid &grid, const std::vector<LabelView> &views,
                                     const CarveOptions &options);

} // namespace outcrop
