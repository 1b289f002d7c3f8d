// SPDX-License-Identifier: BSD-3-Clause
// Points from rays: exact without noise, covariance against numeric derivatives and against scatter.
#include "site/triangulate.h"

#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "core/epipolar.h"
#include "synthetic_site.h"

namespace outcrop {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using synthetic::thesis_camera;

constexpr unsigned kSeed = 20040617;

Vector2d pixel_of(const oc_camera_t &camera, const Vector3d &point)
{
    double x = 0, y = 0;
    EXPECT_GT(oc_camera_project(&camera, point.data(), &x, &y), 0);
    return {x, y};
}

// The camera moved by a centre offset and a local rotation vector.
oc_camera_t moved(const oc_camera_t &camera, const Eigen::Matrix<double, 6, 1> &by)
{
    const Vector3d turn = by.tail<3>();
    Eigen::Matrix3d rotation = camera_rotation(camera);
    if (turn.norm() > 0) rotation = Eigen::AngleAxisd(turn.norm(), turn.normalized()).toRotationMatrix() * rotation;
    const Vector3d centre = camera_centre(camera) + by.head<3>();
    const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows = rotation;
    oc_camera_t result = camera;
    oc_pose_from_centre(rows.data(), centre.data(), &result.pose);
    return result;
}

TEST(Triangulate, finds_the_point_of_two_and_of_eight_exact_rays)
{
    std::vector<oc_camera_t> cameras;
    for (int i = 0; i < 8; ++i) cameras.push_back(thesis_camera(i));
    const Vector3d point(0.11, 0.07, 0.09);
    for (const std::size_t n : {2u, 3u, 8u}) {
        std::vector<Sighting> sightings;
        for (std::size_t i = 0; i < n; ++i) {
            const Vector2d p = pixel_of(cameras[i], point);
            sightings.push_back({&cameras[i], p.x(), p.y(), nullptr});
        }
        const auto result = triangulate(sightings);
        ASSERT_TRUE(result.has_value());
        EXPECT_LT((result->point - point).norm(), 1e-9);
        EXPECT_LT(result->worst_px, 1e-6);
    }
}

TEST(Triangulate, without_iterations_is_the_midpoint_of_the_thesis)
{
    const oc_camera_t a = thesis_camera(5), b = thesis_camera(6);
    const Vector2d p = pixel_of(a, {0.1, 0.1, 0.05}) + Vector2d(0.8, -0.5), q = pixel_of(b, {0.1, 0.1, 0.05});
    oc_midpoint_t expected;
    ASSERT_EQ(oc_epipolar_midpoint(&a, p.x(), p.y(), &b, q.x(), q.y(), &expected), OC_OK);
    TriangulateOptions options;
    options.iterations = 0;
    const auto result = triangulate({{&a, p.x(), p.y(), nullptr}, {&b, q.x(), q.y(), nullptr}}, options);
    ASSERT_TRUE(result.has_value());
    EXPECT_LT((result->point - Vector3d(expected.p_in_world)).norm(), 1e-9);
    EXPECT_NEAR(result->parallax_rad, expected.parallax_rad, 1e-9);
}

TEST(Triangulate, derivatives_agree_with_differences)
{
    const oc_camera_t camera = thesis_camera(3);
    const Vector3d point(0.2, 0.15, 0.1);
    Vector2d pixel;
    Eigen::Matrix<double, 2, 3> by_point;
    Matrix26d by_pose;
    ASSERT_TRUE(project_with_derivatives(camera, point, &pixel, &by_point, &by_pose));
    EXPECT_LT((pixel - pixel_of(camera, point)).norm(), 1e-9);
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
        Eigen::Matrix<double, 6, 1> by = Eigen::Matrix<double, 6, 1>::Zero();
        by[k] = kStep;
        const Vector2d numeric =
            (pixel_of(moved(camera, by), point) - pixel_of(moved(camera, -by), point)) / (2 * kStep);
        EXPECT_LT((numeric - by_pose.col(k)).norm(), 1e-3) << "parameter " << k;
    }
    for (int k = 0; k < 3; ++k) {
        const Vector3d by = kStep * Vector3d::Unit(k);
        const Vector2d numeric = (pixel_of(camera, point + by) - pixel_of(camera, point - by)) / (2 * kStep);
        EXPECT_LT((numeric - by_point.col(k)).norm(), 1e-3) << "axis " << k;
    }
}

TEST(Triangulate, angles_of_the_thesis_turn_as_their_rotation_vectors_say)
{
    for (int i = 0; i < 8; ++i) {
        const oc_camera_t camera = thesis_camera(i);
        const Eigen::Matrix3d turn = rotation_by_opk(camera);
        constexpr double kStep = 1e-6;
        for (int k = 0; k < 3; ++k) {
            oc_pose6_t six;
            oc_pose_to_6(&camera.pose, &six);
            six.v[3 + k] += kStep;
            oc_camera_t other = camera;
            oc_pose_from_6(&six, &other.pose);
            const Eigen::Matrix3d by = camera_rotation(other) * camera_rotation(camera).transpose();
            const Vector3d numeric = Vector3d(by(2, 1), by(0, 2), by(1, 0)) / kStep;
            EXPECT_LT((numeric - turn.col(k)).norm(), 1e-4) << "camera " << i << " angle " << k;
        }
    }
}

TEST(Triangulate, covariance_is_what_noise_of_pixels_and_poses_scatters)
{
    std::mt19937 rng(kSeed);
    std::normal_distribution<double> normal;
    const Vector3d point(0.12, 0.2, 0.06);
    const oc_margin_t margin = synthetic::margin_of(0.003, 0.2 * synthetic::kDegree);
    std::vector<oc_camera_t> truth;
    std::vector<Matrix6d> covariance;
    for (const int i : {4, 5, 6}) truth.push_back(thesis_camera(i));
    for (const oc_camera_t &camera : truth) covariance.push_back(pose_covariance(camera, margin));
    Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero(), predicted = Eigen::Matrix3d::Zero();
    constexpr int kTrials = 3000;
    for (int trial = 0; trial < kTrials; ++trial) {
        std::vector<oc_camera_t> cameras;
        for (const oc_camera_t &camera : truth) cameras.push_back(synthetic::disturbed(camera, margin, &rng));
        std::vector<Sighting> sightings;
        for (std::size_t i = 0; i < truth.size(); ++i) {
            const Vector2d p = pixel_of(truth[i], point);
            sightings.push_back({&cameras[i], p.x() + 0.7 * normal(rng), p.y() + 0.7 * normal(rng), &covariance[i]});
        }
        const auto result = triangulate(sightings);
        ASSERT_TRUE(result.has_value()) << "seed " << kSeed;
        scatter += (result->point - point) * (result->point - point).transpose() / kTrials;
        predicted += result->covariance / kTrials;
    }
    for (int k = 0; k < 3; ++k)
        EXPECT_NEAR(std::sqrt(scatter(k, k) / predicted(k, k)), 1, 0.06) << "axis " << k << " seed " << kSeed;
}

TEST(Triangulate, gives_nothing_for_parallel_rays_one_ray_or_a_point_behind)
{
    const oc_camera_t a = thesis_camera(0), b = thesis_camera(4);
    EXPECT_FALSE(triangulate({}).has_value());
    EXPECT_FALSE(triangulate({{&a, 320, 240, nullptr}}).has_value());
    EXPECT_FALSE(triangulate({{&a, 320, 240, nullptr}, {&a, 320, 240, nullptr}}).has_value());
    // Both cameras turned round look away from each other; the rays still meet behind them.
    oc_camera_t back_a = a, back_b = b;
    for (oc_camera_t *camera : {&back_a, &back_b}) {
        Eigen::Matrix<double, 6, 1> turn = Eigen::Matrix<double, 6, 1>::Zero();
        turn[4] = 180 * synthetic::kDegree;
        *camera = moved(*camera, turn);
    }
    const Vector2d p = pixel_of(a, {0.1, 0.1, 0}), q = pixel_of(b, {0.1, 0.1, 0});
    EXPECT_TRUE(triangulate({{&a, p.x(), p.y(), nullptr}, {&b, q.x(), q.y(), nullptr}}).has_value());
    EXPECT_FALSE(
        triangulate({{&back_a, 640 - p.x(), p.y(), nullptr}, {&back_b, 640 - q.x(), q.y(), nullptr}}).has_value());
}

} // namespace
} // namespace outcrop
