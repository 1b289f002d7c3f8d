// SPDX-License-Identifier: BSD-3-Clause
// A brick on the ground as cameras on a ring see it: labels and colours by ray casting.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "site/carve.h"

namespace outcrop::bricks {

constexpr double kPi = 3.14159265358979323846;

struct Brick {
    Eigen::Vector3d centre{0.1, -0.2, 0.25}, size{0.8, 0.5, 0.5};
    double yaw_rad = 0.5;

    Eigen::Vector3d in_frame(const Eigen::Vector3d &d) const
    {
        const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
        return {c * d.x() + s * d.y(), -s * d.x() + c * d.y(), d.z()};
    }
    // Greater than zero inside: distance to the nearest face.
    double depth_of(const Eigen::Vector3d &p) const { return (size / 2 - in_frame(p - centre).cwiseAbs()).minCoeff(); }
    // Where a ray enters, as a multiple of its direction; infinity when it misses.
    double hit(const Eigen::Vector3d &from, const Eigen::Vector3d &direction) const
    {
        const Eigen::Vector3d o = in_frame(from - centre), d = in_frame(direction);
        double near = -std::numeric_limits<double>::infinity(), far = std::numeric_limits<double>::infinity();
        for (int axis = 0; axis < 3; ++axis) {
            const double a = (-size[axis] / 2 - o[axis]) / d[axis], b = (size[axis] / 2 - o[axis]) / d[axis];
            near = std::max(near, std::min(a, b)), far = std::min(far, std::max(a, b));
        }
        return near <= far && near > 0 ? near : std::numeric_limits<double>::infinity();
    }
    Obstacle box() const
    {
        const double c = std::abs(std::cos(yaw_rad)), s = std::abs(std::sin(yaw_rad));
        const Eigen::Vector3d half(c * size.x() / 2 + s * size.y() / 2, s * size.x() / 2 + c * size.y() / 2,
                                   size.z() / 2);
        Obstacle box;
        box.index = 1;
        box.aabb_min = centre - half, box.aabb_max = centre + half;
        box.obb_centre = centre, box.obb_size = size, box.yaw_rad = yaw_rad;
        return box;
    }
};

inline oc_camera_t looking_at(const Eigen::Vector3d &eye, const Eigen::Vector3d &target, unsigned width = 320,
                              unsigned height = 240, double focal_px = 260)
{
    const Eigen::Vector3d z = (target - eye).normalized();
    const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized(), y = z.cross(x);
    oc_camera_t camera{};
    camera.k = {focal_px, focal_px, width / 2.0 - 0.5, height / 2.0 - 0.5, width, height};
    double R[9];
    for (int i = 0; i < 3; ++i) R[i] = x[i], R[3 + i] = y[i], R[6 + i] = z[i];
    oc_pose_from_centre(R, eye.data(), &camera.pose);
    return camera;
}

inline oc_camera_t on_ring(double azimuth_rad, double radius_m = 2.2, double height_m = 1.4)
{
    return looking_at({radius_m * std::cos(azimuth_rad), radius_m * std::sin(azimuth_rad), height_m}, {0.1, -0.2, 0.2});
}

// A colour fixed to the surface: patches of 8 cm, each of its own tone.
inline cv::Vec3b paint_at(const Eigen::Vector3d &p)
{
    const auto cell = [](double v) {
        return static_cast<unsigned>(static_cast<int>(std::floor(v / 0.08 + 0.013)) + 4096);
    };
    unsigned h = cell(p.x()) * 73856093U ^ cell(p.y()) * 19349663U ^ cell(p.z()) * 83492791U;
    h = (h ^ h >> 13) * 1274126177U;
    h ^= h >> 16;
    return {static_cast<uchar>(20 + h % 216), static_cast<uchar>(20 + (h >> 8) % 216),
            static_cast<uchar>(20 + (h >> 16) % 216)};
}

inline CarveView see(int id, const oc_camera_t &camera, const Brick &brick, bool with_colour)
{
    const int width = static_cast<int>(camera.k.width_px), height = static_cast<int>(camera.k.height_px);
    CarveView view;
    view.id = id;
    view.camera = camera;
    view.labels = cv::Mat1b(height, width, static_cast<uchar>(OC_LABEL_GROUND));
    if (with_colour)
        view.rgb = cv::Mat3b(height, width, cv::Vec3b(0, 0, 0)), view.known = cv::Mat1b(height, width, 255);
    double eye[3];
    oc_pose_centre(&camera.pose, eye);
    const Eigen::Vector3d from(eye[0], eye[1], eye[2]);
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            Eigen::Vector3d d;
            oc_camera_ray(&camera, x, y, d.data());
            double t = brick.hit(from, d);
            if (std::isfinite(t))
                view.labels(y, x) = OC_LABEL_OBSTACLE;
            else
                t = d.z() < 0 ? -from.z() / d.z() : std::numeric_limits<double>::infinity();
            if (with_colour && std::isfinite(t)) view.rgb(y, x) = paint_at(from + t * d);
        }
    return view;
}

inline std::vector<CarveView> ring(int n, const Brick &brick, bool with_colour = false)
{
    std::vector<CarveView> views;
    for (int i = 0; i < n; ++i) views.push_back(see(i, on_ring(2 * kPi * i / n), brick, with_colour));
    return views;
}

} // namespace outcrop::bricks
