// SPDX-License-Identifier: BSD-3-Clause
// A ray-cast scene for matching tests: a textured box on textured ground, with exact junctions.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "core/camera.h"
#include "site/view.h"

namespace outcrop {
namespace scene {

constexpr std::uint32_t kWidth = 480;
constexpr std::uint32_t kHeight = 360;
const Eigen::Vector3d kBoxMin(-0.3, -0.25, 0.0);
const Eigen::Vector3d kBoxMax(0.3, 0.25, 0.35);

inline Area area()
{
    return Area{-1.0, 1.0, -1.0, 1.0, 0.6};
}

// Camera at `centre` that looks at `target`, upright.
inline oc_camera_t look_at(const Eigen::Vector3d &centre, const Eigen::Vector3d &target)
{
    const Eigen::Vector3d z = (target - centre).normalized();
    const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
    const Eigen::Vector3d y = z.cross(x);
    oc_camera_t camera{};
    camera.k = oc_intrinsics_t{500, 500, 239.5, 179.5, kWidth, kHeight};
    const double R[9] = {x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]};
    oc_pose_from_centre(R, centre.data(), &camera.pose);
    return camera;
}

// A camera on a circle of 1.6 m round the box, 0.9 m high.
inline oc_camera_t on_ring(double azimuth_deg, double radius_m = 1.6)
{
    const double a = azimuth_deg * M_PI / 180;
    return look_at(Eigen::Vector3d(radius_m * std::cos(a), radius_m * std::sin(a), 0.9), Eigen::Vector3d(0, 0, 0.15));
}

inline double lattice(int ix, int iy, int seed)
{
    const auto u = [](int i) { return static_cast<std::uint32_t>(i); };
    std::uint32_t h = u(ix) * 374761393U + u(iy) * 668265263U + u(seed) * 974634233U;
    h = (h ^ (h >> 13)) * 1274126177U;
    return static_cast<double>((h ^ (h >> 16)) & 0xffffU) / 65535.0;
}

// Smooth noise in 0..1 with cells of 25 mm, some 8 px.
inline double noise(double u, double v, int seed)
{
    const double x = u / 0.025;
    const double y = v / 0.025;
    const int ix = static_cast<int>(std::floor(x));
    const int iy = static_cast<int>(std::floor(y));
    const double fx = x - ix;
    const double fy = y - iy;
    const double sx = fx * fx * (3 - 2 * fx);
    const double sy = fy * fy * (3 - 2 * fy);
    const double top = lattice(ix, iy, seed) * (1 - sx) + lattice(ix + 1, iy, seed) * sx;
    const double bottom = lattice(ix, iy + 1, seed) * (1 - sx) + lattice(ix + 1, iy + 1, seed) * sx;
    return top * (1 - sy) + bottom * sy;
}

struct Hit {
    double distance = std::numeric_limits<double>::infinity();
    int face = -1; // 0..5: x min, x max, y min, ..., z max; 6: ground
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
};

inline Hit cast(const Eigen::Vector3d &from, const Eigen::Vector3d &direction)
{
    Hit hit;
    const auto offer = [&](double t, int face) {
        if (!(t > 1e-9 && t < hit.distance)) return;
        hit.distance = t;
        hit.face = face;
        hit.point = from + t * direction;
    };
    offer(-from.z() / direction.z(), 6);
    for (int axis = 0; axis < 3; axis++) {
        for (int side = 0; side < 2; side++) {
            const double plane = side == 0 ? kBoxMin[axis] : kBoxMax[axis];
            const double t = (plane - from[axis]) / direction[axis];
            const Eigen::Vector3d p = from + t * direction;
            const int b = (axis + 1) % 3;
            const int c = (axis + 2) % 3;
            const bool inside = p[b] >= kBoxMin[b] && p[b] <= kBoxMax[b] && p[c] >= kBoxMin[c] && p[c] <= kBoxMax[c];
            if (inside) offer(t, 2 * axis + side);
        }
    }
    return hit;
}

inline View render(int id, const oc_camera_t &camera)
{
    View view;
    view.id = id;
    view.camera = camera;
    view.grey.create(kHeight, kWidth);
    view.known = cv::Mat1b(kHeight, kWidth, std::uint8_t{255});
    Eigen::Vector3d centre;
    oc_pose_centre(&camera.pose, centre.data());
    for (int y = 0; y < view.grey.rows; y++) {
        for (int x = 0; x < view.grey.cols; x++) {
            Eigen::Vector3d ray;
            oc_camera_ray(&camera, x, y, ray.data());
            const Hit hit = cast(centre, ray);
            const int axis = hit.face == 6 ? 2 : hit.face / 2;
            const double shade =
                hit.face < 0 ? 0.5 : noise(hit.point[(axis + 1) % 3], hit.point[(axis + 2) % 3], hit.face + 1);
            view.grey(y, x) = static_cast<std::uint8_t>(std::lround(20 + 215 * shade));
        }
    }
    return view;
}

// Whether a view sees the point, not hidden and at least 16 px inside the image.
inline bool sees(const View &view, const Eigen::Vector3d &point)
{
    double x = 0;
    double y = 0;
    if (!(oc_camera_project(&view.camera, point.data(), &x, &y) > 0)) return false;
    if (x < 16 || y < 16 || x > kWidth - 17.0 || y > kHeight - 17.0) return false;
    Eigen::Vector3d centre;
    oc_pose_centre(&view.camera.pose, centre.data());
    const Eigen::Vector3d ray = (point - centre).normalized();
    return std::abs(cast(centre, ray).distance - (point - centre).norm()) < 1e-6;
}

// A spot on a plane of the scene with two directions in that plane.
struct Corner {
    Eigen::Vector3d point, along_a, along_b;
    int face = 6;
};

inline double angle_of(const View &view, const Eigen::Vector3d &point, const Eigen::Vector3d &along)
{
    double x[2];
    double y[2];
    const Eigen::Vector3d there = point + 1e-4 * along;
    oc_camera_project(&view.camera, point.data(), &x[0], &y[0]);
    oc_camera_project(&view.camera, there.data(), &x[1], &y[1]);
    const double angle = std::atan2(y[1] - y[0], x[1] - x[0]);
    return angle < 0 ? angle + 2 * M_PI : angle;
}

// The exact junction of a corner in a view.
inline oc_junction_t junction_of(const View &view, const Corner &corner)
{
    double x = 0;
    double y = 0;
    oc_camera_project(&view.camera, corner.point.data(), &x, &y);
    oc_junction_t junction{};
    junction.x_px = static_cast<float>(x);
    junction.y_px = static_cast<float>(y);
    junction.n_branches = 2;
    junction.kind = OC_KIND_L;
    double a = angle_of(view, corner.point, corner.along_a);
    double b = angle_of(view, corner.point, corner.along_b);
    if (a > b) std::swap(a, b);
    junction.branch[0].angle_rad = static_cast<float>(a);
    junction.branch[1].angle_rad = static_cast<float>(b);
    return junction;
}

// Corners spread over the box's top and +x, +y faces and over the ground, each clear of the edges.
inline std::vector<Corner> corners()
{
    std::vector<Corner> all;
    const Eigen::Vector3d X = Eigen::Vector3d::UnitX();
    const Eigen::Vector3d Y = Eigen::Vector3d::UnitY();
    const Eigen::Vector3d Z = Eigen::Vector3d::UnitZ();
    for (int i = 0; i < 4; i++) {
        for (int j = 0; j < 3; j++) {
            const double turn = 0.4 * (i + 3 * j);
            const auto add = [&](const Eigen::Vector3d &at, const Eigen::Vector3d &a, const Eigen::Vector3d &b,
                                 int face) {
                const Eigen::Vector3d u = std::cos(turn) * a + std::sin(turn) * b;
                const Eigen::Vector3d v = std::cos(turn + 1.3) * a + std::sin(turn + 1.3) * b;
                all.push_back(Corner{at, u, v, face});
            };
            const double u = (i + 0.6) / 4.2;
            const double v = (j + 0.6) / 3.2;
            add({-0.22 + 0.44 * u, -0.18 + 0.36 * v, 0.35}, X, Y, 5);
            add({0.3, -0.18 + 0.36 * u, 0.08 + 0.2 * v}, Y, Z, 1);
            add({-0.22 + 0.44 * u, 0.25, 0.08 + 0.2 * v}, X, Z, 3);
            add({0.45 + 0.25 * v, -0.4 + 0.8 * u, 0}, X, Y, 6);
        }
    }
    return all;
}

// Puts the junctions of the corners that the view sees into it; corner_of[k] is the corner of junction k.
inline std::vector<int> add_junctions(const std::vector<Corner> &corners, View *view)
{
    std::vector<int> corner_of;
    for (std::size_t i = 0; i < corners.size(); i++) {
        if (!sees(*view, corners[i].point)) continue;
        view->junctions.push_back(junction_of(*view, corners[i]));
        corner_of.push_back(static_cast<int>(i));
    }
    return corner_of;
}

// Pose moved by six errors (metres, radians).
inline oc_camera_t moved(const oc_camera_t &camera, const double by[6])
{
    oc_camera_t result = camera;
    oc_pose6_t six;
    oc_pose_to_6(&camera.pose, &six);
    for (int i = 0; i < 6; i++) six.v[i] += by[i];
    oc_pose_from_6(&six, &result.pose);
    return result;
}

} // namespace scene
} // namespace outcrop
