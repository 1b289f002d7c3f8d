// SPDX-License-Identifier: BSD-3-Clause
// A point in space from the pixels of two or more views, with its covariance.
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "core/camera.h"

namespace outcrop {

using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Matrix26d = Eigen::Matrix<double, 2, 6>;

// One pixel of one camera. Pointers are borrowed for the call.
struct Sighting {
    const oc_camera_t *camera = nullptr;
    double x_px = 0, y_px = 0;
    // Covariance of the camera's centre (world, metres) and of its local rotation
    // vector w (R -> exp([w]x) R, radians); nullptr: the pose is exact.
    const Matrix6d *pose_covariance = nullptr;
};

struct TriangulateOptions {
    double sigma_px = 0.7;          // of a pixel coordinate
    double min_parallax_rad = 0.03; // widest angle between two of the rays
    int iterations = 3;             // of the weighted least squares after the midpoint; 0: thesis
    void check() const;             // throws std::invalid_argument
};

struct Triangulated {
    Eigen::Vector3d point = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity(); // pixel and pose errors
    double rms_px = 0;                                        // of the reprojection, over all coordinates
    double worst_px = 0;                                      // of the sightings' distances
    double parallax_rad = 0;                                  // widest angle between two rays
};

// Midpoint of the common perpendicular of n >= 2 rays (thesis Eq 2.77, 5.28; for more rays the sums run over
// all), then weighted least squares of the reprojection. Empty when the rays are too near to parallel or the
// point lies behind a camera. O(n).
std::optional<Triangulated> triangulate(const std::vector<Sighting> &sightings, const TriangulateOptions &options = {});

// Pixel of a world point and its derivatives by the point and by the pose (centre, local rotation vector).
// False when the point is not in front of the camera; outputs may be nullptr.
bool project_with_derivatives(const oc_camera_t &camera, const Eigen::Vector3d &point, Eigen::Vector2d *pixel,
                              Eigen::Matrix<double, 2, 3> *by_point, Matrix26d *by_pose);

// Rotation vectors w per unit of omega, phi and kappa at a camera's attitude: d_w = J d_opk, with
// R(opk + d_opk) = exp([d_w]x) R(opk). Singular at phi = +-90 degrees.
Eigen::Matrix3d rotation_by_opk(const oc_camera_t &camera);

// Covariance of (centre, rotation vector) of uniform errors with these half-widths, plus floor^2 on the diagonal.
Matrix6d pose_covariance(const oc_camera_t &camera, const oc_margin_t &half_widths, double floor = 1e-9);

Eigen::Vector3d camera_centre(const oc_camera_t &camera);
Eigen::Matrix3d camera_rotation(const oc_camera_t &camera); // cam_from_world

} // namespace outcrop
