// SPDX-License-Identifier: BSD-3-Clause
// A camera of cameras.json or path.json.
#include "camera.h"

#include "json_file.h"

#include <Eigen/LU>
#include <cmath>

namespace outcrop::eval {

namespace {

// Rotations come from text files with as few as six digits.
constexpr double kRotationTolerance = 1e-4;
// Fixed-point steps that undo the lens; the contraction is far below 0.1 a step
// for the lenses of a rectifiable camera.
constexpr int kUndistortSteps = 20;

Eigen::Vector2d distort(const Eigen::Vector2d &n, const std::array<double, 5> &d)
{
    const double x = n.x(), y = n.y(), r2 = n.squaredNorm();
    const double radial = 1 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    return {x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x * x),
            y * radial + d[2] * (r2 + 2 * y * y) + 2 * d[3] * x * y};
}

Eigen::Vector2d undistort(const Eigen::Vector2d &seen, const std::array<double, 5> &d)
{
    if (d == std::array<double, 5>{}) return seen;
    Eigen::Vector2d n = seen;
    for (int i = 0; i < kUndistortSteps; i++) n += seen - distort(n, d);
    return n;
}

Camera parse_camera(const Node &node, double unit_m)
{
    Camera c;
    if (node.has("image")) c.image = node.at("image").text();
    c.width = node.at("width").integer();
    c.height = node.at("height").integer();
    if (c.width <= 0 || c.height <= 0 || c.width > 65536 || c.height > 65536) node.fail("image size out of range");
    c.fx = node.at("fx").number();
    c.fy = node.at("fy").number();
    if (!(c.fx > 0) || !(c.fy > 0)) node.fail("focal length not positive");
    c.cx = node.at("cx").number();
    c.cy = node.at("cy").number();
    if (node.has("dist")) {
        const auto d = node.at("dist").items();
        if (d.size() > 5) node.at("dist").fail("more than 5 numbers");
        for (std::size_t i = 0; i < d.size(); i++) c.dist[i] = d[i].number();
    }
    c.rotation_cam_from_world = node.at("R").matrix3();
    const Eigen::Matrix3d &r = c.rotation_cam_from_world;
    const double off = (r * r.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
    if (!(off < kRotationTolerance) || !(r.determinant() > 0)) node.at("R").fail("not a rotation");
    c.translation_m = node.at("t").vector3() * unit_m;
    return c;
}

} // namespace

Eigen::Vector3d Camera::centre_m() const
{
    return -rotation_cam_from_world.transpose() * translation_m;
}

std::optional<Projection> Camera::project(const Eigen::Vector3d &p_in_world_m) const
{
    const Eigen::Vector3d p = rotation_cam_from_world * p_in_world_m + translation_m;
    if (!(p.z() > 1e-9)) return std::nullopt;
    const Eigen::Vector2d n = distort(p.head<2>() / p.z(), dist);
    return Projection{{fx * n.x() + cx, fy * n.y() + cy}, p.z()};
}

Eigen::Vector3d Camera::ray(const Eigen::Vector2d &pixel) const
{
    const Eigen::Vector2d n = undistort({(pixel.x() - cx) / fx, (pixel.y() - cy) / fy}, dist);
    return rotation_cam_from_world.transpose() * n.homogeneous();
}

std::optional<Eigen::Vector3d> Camera::on_ground(const Eigen::Vector2d &pixel) const
{
    const Eigen::Vector3d direction = ray(pixel), c = centre_m();
    const double depth = -c.z() / direction.z();
    if (!(depth > 0) || !std::isfinite(depth)) return std::nullopt;
    return c + depth * direction;
}

bool Camera::inside(const Eigen::Vector2d &pixel) const
{
    return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width - 0.5 && pixel.y() < height - 0.5;
}

CameraFile read_cameras(const std::filesystem::path &file, const std::string &key)
{
    const Json json = read_json(file);
    const Node root(file, json);
    const double unit_m = metres_per_unit(root);
    CameraFile out;
    for (const Node &node : root.at(key).items()) out.cameras.push_back(parse_camera(node, unit_m));
    if (out.cameras.empty()) root.at(key).fail("empty");
    if (root.has("area")) {
        const Eigen::Vector2d x = root.at("area").at("x").vector2() * unit_m;
        const Eigen::Vector2d y = root.at("area").at("y").vector2() * unit_m;
        if (!(x[0] < x[1]) || !(y[0] < y[1])) root.at("area").fail("empty");
        out.area = Area{{x[0], y[0]}, {x[1], y[1]}};
    }
    return out;
}

} // namespace outcrop::eval
