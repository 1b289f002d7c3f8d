/* SPDX-License-Identifier: BSD-3-Clause
 * A camera of cameras.json or path.json. Independent of lib/ on purpose: a
 * fault in the product's camera must not excuse itself here. */
#ifndef OUTCROP_EVAL_CAMERA_H
#define OUTCROP_EVAL_CAMERA_H

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace outcrop::eval {

/* A world point in an image: pixel (integers are pixel centres) and z-depth. */
struct Projection {
    Eigen::Vector2d pixel;
    double depth_m = 0;
};

struct Camera {
    std::string image; /* as the file lists it */
    int width = 0, height = 0;
    double fx = 0, fy = 0, cx = 0, cy = 0;
    std::array<double, 5> dist{}; /* k1 k2 p1 p2 k3, OpenCV */
    Eigen::Matrix3d rotation_cam_from_world = Eigen::Matrix3d::Identity();
    Eigen::Vector3d translation_m = Eigen::Vector3d::Zero();

    Eigen::Vector3d centre_m() const;
    /* Nothing when the point is not in front of the camera. May lie outside the image. */
    std::optional<Projection> project(const Eigen::Vector3d &p_in_world_m) const;
    /* World direction of a pixel, scaled so that its z-depth is 1. */
    Eigen::Vector3d ray(const Eigen::Vector2d &pixel) const;
    /* Where the pixel's ray meets Z = 0; nothing at or above the horizon. */
    std::optional<Eigen::Vector3d> on_ground(const Eigen::Vector2d &pixel) const;
    /* The pixel rounds to one inside the image. */
    bool inside(const Eigen::Vector2d &pixel) const;
};

/* The operator's area in metres. */
struct Area {
    Eigen::Vector2d min_m, max_m;
};

struct CameraFile {
    std::vector<Camera> cameras;
    std::optional<Area> area;
};

/* Reads the list `key` ("views" or "frames") of a cameras.json-like file and
 * converts to metres. EvalError when it is ill-formed: R not a rotation, focal
 * length or size not positive, anything missing. */
CameraFile read_cameras(const std::filesystem::path &file, const std::string &key);

} // namespace outcrop::eval
#endif
