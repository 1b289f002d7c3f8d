// SPDX-License-Identifier: BSD-3-Clause
// Shaded boxes by ray and box intersection, ready for one virtual camera.
#pragma once

#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "core/camera.h"
#include "site/site_model.h"

namespace outcrop {

struct BoxHit {
    bool is_hit = false;
    double depth_m = 0; // z-depth in the camera
    int axis = -1;      // of the face, in the box's frame; -1: the camera is inside or nearer than near_m
    double sign = 1;    // of the face's normal along that axis
    Eigen::Vector3d at = Eigen::Vector3d::Zero(); // in the box's frame
};

// One box as one camera sees it. Costs a dozen multiplications a ray.
class BoxView {
public:
    BoxView(const Obstacle &obstacle, bool is_suspected, const oc_camera_t &camera, double near_m);

    BoxHit hit(double x_px, double y_px) const;

    // RGB, 0..255; edges are darkened over about a pixel and a half.
    cv::Vec3f shade(const BoxHit &hit) const;

    int index() const { return index_; }
    bool is_suspected() const { return is_suspected_; }
    const cv::Rect &reach() const { return reach_; } // pixels that may show it

private:
    Eigen::Vector3d into_box(const Eigen::Vector3d &v) const;
    cv::Rect reach_in(const oc_camera_t &camera) const;

    int index_;
    bool is_suspected_;
    double cos_, sin_, near_m_, pixel_per_depth_;
    Eigen::Vector3d centre_, half_;
    Eigen::Vector3d from_, along_[3]; // box frame: a ray is from + t (x along[0] + y along[1] + along[2])
    cv::Vec3f colour_;
    cv::Rect reach_;
};

// Firm boxes first, then suspected ones.
std::vector<BoxView> see_boxes(const SiteModel &model, const oc_camera_t &camera, double near_m);

} // namespace outcrop
