// SPDX-License-Identifier: BSD-3-Clause
// Slab test in the box's own frame, where rays are linear in the pixel.
#include "site/render_box.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace outcrop {
namespace {

const cv::Vec3f kSuspected(240, 170, 30);

// Distinct on grey ground and in the sun.
const std::array<cv::Vec3f, 8> kPalette = {cv::Vec3f(214, 92, 66),   cv::Vec3f(58, 128, 196),  cv::Vec3f(232, 178, 58),
                                           cv::Vec3f(92, 160, 88),   cv::Vec3f(150, 102, 178), cv::Vec3f(72, 172, 172),
                                           cv::Vec3f(204, 120, 150), cv::Vec3f(150, 130, 90)};

// Light from the upper left of a north-up map.
const Eigen::Vector3d kLight = Eigen::Vector3d(-0.45, 0.35, 0.82).normalized();

cv::Vec3f colour_of(const Obstacle &obstacle, bool is_suspected)
{
    if (is_suspected) return kSuspected;
    const int i = std::max(obstacle.index, 1) - 1;
    return kPalette[static_cast<std::size_t>(i) % kPalette.size()];
}

} // namespace

BoxView::BoxView(const Obstacle &obstacle, bool is_suspected, const oc_camera_t &camera, double near_m)
    : index_(obstacle.index), is_suspected_(is_suspected), cos_(std::cos(obstacle.yaw_rad)),
      sin_(std::sin(obstacle.yaw_rad)), near_m_(near_m), pixel_per_depth_(1 / camera.k.fx_px),
      centre_(obstacle.obb_centre), half_(0.5 * obstacle.obb_size), colour_(colour_of(obstacle, is_suspected))
{
    double centre[3];
    oc_pose_centre(&camera.pose, centre);
    from_ = into_box(Eigen::Vector3d(centre[0], centre[1], centre[2]) - centre_);
    const oc_intrinsics_t &k = camera.k;
    const double *R = camera.pose.R;
    const Eigen::Vector3d right(R[0], R[1], R[2]), down(R[3], R[4], R[5]), forward(R[6], R[7], R[8]);
    along_[0] = into_box(right / k.fx_px);
    along_[1] = into_box(down / k.fy_px);
    along_[2] = into_box(forward - right * (k.cx_px / k.fx_px) - down * (k.cy_px / k.fy_px));
    reach_ = reach_in(camera);
}

Eigen::Vector3d BoxView::into_box(const Eigen::Vector3d &v) const
{
    return {cos_ * v.x() + sin_ * v.y(), -sin_ * v.x() + cos_ * v.y(), v.z()};
}

cv::Rect BoxView::reach_in(const oc_camera_t &camera) const
{
    const int width = static_cast<int>(camera.k.width_px), height = static_cast<int>(camera.k.height_px);
    double x0 = 1e9, y0 = 1e9, x1 = -1e9, y1 = -1e9;
    for (int corner = 0; corner < 8; corner++) {
        const double a = (corner & 1 ? 1 : -1) * half_.x(), b = (corner & 2 ? 1 : -1) * half_.y();
        const double p[3] = {centre_.x() + cos_ * a - sin_ * b, centre_.y() + sin_ * a + cos_ * b,
                             centre_.z() + (corner & 4 ? 1 : -1) * half_.z()};
        double u = 0, v = 0;
        if (!(oc_camera_project(&camera, p, &u, &v) > near_m_)) return {0, 0, width, height};
        x0 = std::min(x0, u);
        x1 = std::max(x1, u);
        y0 = std::min(y0, v);
        y1 = std::max(y1, v);
    }
    const auto clip = [](double v, int side) { return static_cast<int>(std::clamp(v, -1.0, side + 1.0)); };
    const cv::Point low(clip(std::floor(x0) - 1, width), clip(std::floor(y0) - 1, height));
    const cv::Point high(clip(std::ceil(x1) + 2, width), clip(std::ceil(y1) + 2, height));
    return cv::Rect(low, high) & cv::Rect(0, 0, width, height);
}

BoxHit BoxView::hit(double x_px, double y_px) const
{
    const Eigen::Vector3d along = x_px * along_[0] + y_px * along_[1] + along_[2];
    double enter = near_m_, leave = std::numeric_limits<double>::infinity();
    BoxHit out;
    for (int i = 0; i < 3; i++) {
        if (along[i] == 0) {
            if (std::abs(from_[i]) > half_[i]) return {};
            continue;
        }
        const double side = along[i] > 0 ? -1 : 1; // of the face that is entered
        const double inverse = 1 / along[i];
        const double t_in = (side * half_[i] - from_[i]) * inverse, t_out = (-side * half_[i] - from_[i]) * inverse;
        if (t_in > enter) {
            enter = t_in;
            out.axis = i;
            out.sign = side;
        }
        leave = std::min(leave, t_out);
    }
    if (enter > leave) return {};
    out.is_hit = true;
    out.depth_m = enter;
    out.at = from_ + enter * along;
    return out;
}

cv::Vec3f BoxView::shade(const BoxHit &hit) const
{
    if (hit.axis < 0) return 0.35f * colour_;
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    normal[hit.axis] = hit.sign;
    const Eigen::Vector3d in_world(cos_ * normal.x() - sin_ * normal.y(), sin_ * normal.x() + cos_ * normal.y(),
                                   normal.z());
    const double light = 0.55 + 0.45 * std::max(0.0, in_world.dot(kLight)) + 0.08 * in_world.y();
    double edge = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 3; i++) {
        if (i != hit.axis) edge = std::min(edge, half_[i] - std::abs(hit.at[i]));
    }
    const double line = 0.55 + 0.45 * std::clamp(edge / (hit.depth_m * pixel_per_depth_) - 0.8, 0.0, 1.0);
    return static_cast<float>(light * line) * colour_;
}

std::vector<BoxView> see_boxes(const SiteModel &model, const oc_camera_t &camera, double near_m)
{
    std::vector<BoxView> out;
    for (const Obstacle &obstacle : model.obstacles) out.emplace_back(obstacle, false, camera, near_m);
    for (const Obstacle &obstacle : model.suspected) out.emplace_back(obstacle, true, camera, near_m);
    return out;
}

} // namespace outcrop
