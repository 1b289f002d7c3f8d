// SPDX-License-Identifier: BSD-3-Clause
// What a virtual camera sees: the ground by the planar perspective matrix, obstacles as shaded boxes.
#pragma once

#include <vector>

#include <opencv2/core.hpp>

#include "core/camera.h"
#include "site/overhead.h"
#include "site/site_model.h"

namespace outcrop {

// Values of Frame::mask besides obstacle indices.
constexpr unsigned char kMaskGround = 0, kMaskSky = 255;

struct Frame {
    cv::Mat3b rgb;  // RGB order
    cv::Mat1b mask; // obstacle index, kMaskGround or kMaskSky, at the pixel's centre
};

struct RenderOptions {
    int supersample = 2;    // samples per pixel and axis on boxes, 1..4
    int max_anisotropy = 6; // ground samples along the longer axis of a pixel's footprint, 1..16
    double near_m = 0.02;   // nothing nearer is drawn
};

// The overhead map as a pyramid, made once for a sequence.
class GroundTexture {
public:
    explicit GroundTexture(const OverheadMap &map);

    // Mean colour (RGB, 0..255) and share of seen ground of the parallelogram
    // spanned by du and dv (metres) round a ground point.
    cv::Vec4f sample(double x, double y, cv::Vec2d du, cv::Vec2d dv, int max_anisotropy) const;

    // Colour of ground that no view saw: stripes fixed to the ground in two tones of its mean brightness. Their
    // period doubles with the pixel's footprint, so they neither alias nor melt into what looks like free ground.
    cv::Vec3f hatch(double x, double y, double footprint_m) const;

private:
    void add_bilinear(int level, double px, double py, float weight, float sum[4]) const;

    double metres_per_pixel_, x_min_, y_max_, hatch_period_m_;
    cv::Vec3f hatch_dark_, hatch_light_;
    std::vector<cv::Mat4f> levels_; // premultiplied RGB and coverage, a frame of zeros one pixel wide round each
};

// One frame. Ground pixels are those whose ray meets Z = 0 in front of the
// camera (thesis 4.4, the horizon as the third row of the inverse matrix).
// Ground that no view saw is hatched, never invented. Boxes are found by ray
// and box intersection, so near ones clip rightly; suspected obstacles are
// translucent amber and not in the mask. The camera must be valid and above
// the ground; throws std::invalid_argument otherwise.
Frame render_boxes(const SiteModel &model, const GroundTexture &ground, const oc_camera_t &camera,
                   const RenderOptions &options = {});

} // namespace outcrop
