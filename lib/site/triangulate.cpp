// SPDX-License-Identifier: BSD-3-Clause
// A point in space from the pixels of two or more views, with its covariance.
#include "site/triangulate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include "core/epipolar.h"

namespace outcrop {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

Matrix3d cross_matrix(const Vector3d &v)
{
    Matrix3d m;
    m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
    return m;
}

Vector3d ray_of(const Sighting &s)
{
    Vector3d dir;
    oc_camera_ray(s.camera, s.x_px, s.y_px, dir.data());
    return dir;
}

std::optional<Vector3d> nearest_point(const std::vector<Sighting> &sightings)
{
    std::vector<oc_camera_t> cameras;
    std::vector<std::array<double, 2>> pixels;
    for (const Sighting &s : sightings) {
        cameras.push_back(*s.camera);
        pixels.push_back({s.x_px, s.y_px});
    }
    Vector3d point;
    const auto *px = reinterpret_cast<const double(*)[2]>(pixels.data());
    const std::uint32_t n = static_cast<std::uint32_t>(sightings.size());
    if (oc_epipolar_nearest_point(cameras.data(), px, n, point.data()) != OC_OK) return std::nullopt;
    return point;
}

double widest_angle(const std::vector<Vector3d> &rays)
{
    double least = 1;
    for (std::size_t i = 0; i < rays.size(); ++i)
        for (std::size_t j = i + 1; j < rays.size(); ++j) least = std::min(least, rays[i].dot(rays[j]));
    return std::acos(std::clamp(least, -1.0, 1.0));
}

struct Normal {
    Matrix3d information = Matrix3d::Zero();
    Vector3d gradient = Vector3d::Zero();
};

// Normal equations of the reprojection at `point`; false when it is not in front of every camera.
bool accumulate(const std::vector<Sighting> &sightings, double sigma_px, const Vector3d &point, Normal *normal)
{
    for (const Sighting &s : sightings) {
        Vector2d pixel;
        Eigen::Matrix<double, 2, 3> by_point;
        Matrix26d by_pose;
        if (!project_with_derivatives(*s.camera, point, &pixel, &by_point, &by_pose)) return false;
        Eigen::Matrix2d noise = sigma_px * sigma_px * Eigen::Matrix2d::Identity();
        if (s.pose_covariance) noise += by_pose * *s.pose_covariance * by_pose.transpose();
        const Eigen::Matrix2d weight = noise.inverse();
        normal->information += by_point.transpose() * weight * by_point;
        normal->gradient += by_point.transpose() * weight * (Vector2d(s.x_px, s.y_px) - pixel);
    }
    return true;
}

bool measure(const std::vector<Sighting> &sightings, Triangulated *result)
{
    double sum = 0;
    for (const Sighting &s : sightings) {
        Vector2d pixel;
        if (!project_with_derivatives(*s.camera, result->point, &pixel, nullptr, nullptr)) return false;
        const double square = (Vector2d(s.x_px, s.y_px) - pixel).squaredNorm();
        sum += square;
        result->worst_px = std::max(result->worst_px, std::sqrt(square));
    }
    result->rms_px = std::sqrt(sum / (2.0 * static_cast<double>(sightings.size())));
    return true;
}

} // namespace

void TriangulateOptions::check() const
{
    if (!(sigma_px > 0) || !(min_parallax_rad >= 0) || iterations < 0)
        throw std::invalid_argument("triangulate: sigma_px must be > 0, min_parallax_rad and iterations >= 0");
}

Vector3d camera_centre(const oc_camera_t &camera)
{
    Vector3d centre;
    oc_pose_centre(&camera.pose, centre.data());
    return centre;
}

Matrix3d camera_rotation(const oc_camera_t &camera)
{
    return Eigen::Map<const RowMatrix3d>(camera.pose.R);
}

bool project_with_derivatives(const oc_camera_t &camera, const Vector3d &point, Vector2d *pixel,
                              Eigen::Matrix<double, 2, 3> *by_point, Matrix26d *by_pose)
{
    const Matrix3d rotation = camera_rotation(camera);
    const Vector3d in_cam = rotation * point + Eigen::Map<const Vector3d>(camera.pose.t);
    if (!(in_cam.z() > 0)) return false;
    const double depth = 1.0 / in_cam.z();
    const double u = in_cam.x() * depth, v = in_cam.y() * depth;
    if (pixel) *pixel << camera.k.fx_px * u + camera.k.cx_px, camera.k.fy_px * v + camera.k.cy_px;
    Eigen::Matrix<double, 2, 3> by_cam;
    by_cam << camera.k.fx_px * depth, 0, -camera.k.fx_px * depth * u, 0, camera.k.fy_px * depth,
        -camera.k.fy_px * depth * v;
    if (by_point) *by_point = by_cam * rotation;
    if (by_pose) {
        by_pose->leftCols<3>() = -by_cam * rotation;
        by_pose->rightCols<3>() = -by_cam * cross_matrix(in_cam);
    }
    return true;
}

Matrix3d rotation_by_opk(const oc_camera_t &camera)
{
    double thesis[9], omega, phi, kappa;
    oc_cv_from_thesis(camera.pose.R, thesis);
    oc_opk_from_thesis(thesis, &omega, &phi, &kappa);
    // R_th = R_kappa R_phi R_omega turns passively, so each angle turns by minus itself about its axis as the later
    // rotations have left it; diag(1,-1,-1) then changes to OpenCV's axes.
    const Matrix3d swing = Eigen::AngleAxisd(-kappa, Vector3d::UnitZ()).toRotationMatrix();
    const Matrix3d tip = Eigen::AngleAxisd(-phi, Vector3d::UnitY()).toRotationMatrix();
    Matrix3d axes;
    axes << swing * tip * Vector3d::UnitX(), swing * Vector3d::UnitY(), Vector3d::UnitZ();
    return -(Vector3d(1, -1, -1).asDiagonal() * axes);
}

Matrix6d pose_covariance(const oc_camera_t &camera, const oc_margin_t &half_widths, double floor)
{
    Eigen::Matrix<double, 6, 1> variance;
    for (int i = 0; i < 6; ++i) variance[i] = half_widths.v[i] * half_widths.v[i] / 3.0;
    const Matrix3d turn = rotation_by_opk(camera);
    Matrix6d covariance = Matrix6d::Zero();
    covariance.topLeftCorner<3, 3>() = variance.head<3>().asDiagonal();
    covariance.bottomRightCorner<3, 3>() = turn * variance.tail<3>().asDiagonal() * turn.transpose();
    covariance.diagonal().array() += floor * floor;
    return covariance;
}

std::optional<Triangulated> triangulate(const std::vector<Sighting> &sightings, const TriangulateOptions &options)
{
    if (sightings.size() < 2) return std::nullopt;
    std::vector<Vector3d> rays;
    rays.reserve(sightings.size());
    for (const Sighting &s : sightings) rays.push_back(ray_of(s));
    Triangulated result;
    result.parallax_rad = widest_angle(rays);
    if (!(result.parallax_rad >= options.min_parallax_rad)) return std::nullopt;
    const std::optional<Vector3d> start = nearest_point(sightings);
    if (!start) return std::nullopt;
    result.point = *start;

    for (int i = 0; i <= options.iterations; ++i) {
        Normal normal;
        if (!accumulate(sightings, options.sigma_px, result.point, &normal)) return std::nullopt;
        const Eigen::LDLT<Matrix3d> solver(normal.information);
        if (solver.info() != Eigen::Success || !solver.isPositive()) return std::nullopt;
        result.covariance = solver.solve(Matrix3d::Identity());
        if (i < options.iterations) result.point += solver.solve(normal.gradient);
    }
    if (!result.point.allFinite() || !result.covariance.allFinite()) return std::nullopt;
    if (!measure(sightings, &result)) return std::nullopt;
    return result;
}

} // namespace outcrop
