// SPDX-License-Identifier: BSD-3-Clause
// Hulls, rectangles and boxes against brute force; the ground map against what was put there.
#include "site/boxes.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "site/ground_map.h"
#include "synthetic_site.h"

namespace outcrop {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr unsigned kSeed = 74;
constexpr double kPi = 3.14159265358979323846;

std::vector<Vector2d> random_plane(int n, std::mt19937 *rng)
{
    std::normal_distribution<double> normal;
    std::vector<Vector2d> points;
    for (int i = 0; i < n; ++i) points.emplace_back(2 * normal(*rng), normal(*rng));
    return points;
}

SitePoint at(const Vector3d &position, double sigma = 1e-4)
{
    SitePoint point;
    point.position = position;
    point.covariance = sigma * sigma * Eigen::Matrix3d::Identity();
    return point;
}

// Boxes that end at the outermost points.
BoxOptions tight()
{
    BoxOptions options;
    options.widen_gaps = 0;
    return options;
}

std::vector<int> all_of(const std::vector<SitePoint> &points)
{
    std::vector<int> members;
    for (std::size_t i = 0; i < points.size(); ++i) members.push_back(static_cast<int>(i));
    return members;
}

TEST(ConvexHull, holds_all_points_and_turns_left)
{
    std::mt19937 rng(kSeed);
    for (const int n : {3, 10, 200}) {
        const std::vector<Vector2d> points = random_plane(n, &rng), hull = convex_hull(points);
        ASSERT_GE(hull.size(), 3u);
        for (std::size_t i = 0; i < hull.size(); ++i) {
            const Vector2d from = hull[i], edge = hull[(i + 1) % hull.size()] - from;
            for (const Vector2d &p : points)
                EXPECT_GE(edge.x() * (p - from).y() - edge.y() * (p - from).x(), -1e-12) << "seed " << kSeed;
        }
    }
    EXPECT_EQ(convex_hull({{0, 0}, {1, 1}, {2, 2}, {1, 1}}).size(), 2u);
    EXPECT_EQ(convex_hull({{1, 1}}).size(), 1u);
    EXPECT_TRUE(convex_hull({}).empty());
}

TEST(MinAreaRectangle, is_no_larger_than_any_of_ten_thousand_turns)
{
    std::mt19937 rng(kSeed);
    for (int trial = 0; trial < 20; ++trial) {
        const std::vector<Vector2d> points = random_plane(4 + trial, &rng);
        const Rectangle best = min_area_rectangle(points);
        double least = 1e30;
        for (int k = 0; k < 10000; ++k) {
            const double yaw = kPi / 2 * k / 10000;
            const Vector2d along(std::cos(yaw), std::sin(yaw)), across(-along.y(), along.x());
            Vector2d low(1e30, 1e30), high(-1e30, -1e30);
            for (const Vector2d &p : points) {
                const Vector2d q(along.dot(p), across.dot(p));
                low = low.cwiseMin(q), high = high.cwiseMax(q);
            }
            least = std::min(least, (high - low).prod());
        }
        EXPECT_LE(best.size.prod(), least * (1 + 1e-9));
        EXPECT_GT(best.size.prod(), least * (1 - 2e-3));
        EXPECT_GE(best.size.x(), best.size.y());
        EXPECT_GT(best.yaw_rad, -kPi / 2);
        EXPECT_LE(best.yaw_rad, kPi / 2);
        const Vector2d along(std::cos(best.yaw_rad), std::sin(best.yaw_rad)), across(-along.y(), along.x());
        for (const Vector2d &p : points) {
            EXPECT_LE(std::abs(along.dot(p - best.centre)), best.size.x() / 2 + 1e-9);
            EXPECT_LE(std::abs(across.dot(p - best.centre)), best.size.y() / 2 + 1e-9);
        }
    }
}

// Points of an upright block: size along yaw, across, up.
std::vector<SitePoint> block(const Vector2d &centre, const Vector3d &size, double yaw)
{
    std::vector<SitePoint> points;
    const Vector2d along(std::cos(yaw), std::sin(yaw)), across(-along.y(), along.x());
    for (double u = -0.5; u <= 0.5; u += 0.25)
        for (double v = -0.5; v <= 0.5; v += 0.25)
            for (double w = 0.1; w <= 1.0; w += 0.3) {
                const Vector2d p = centre + u * size.x() * along + v * size.y() * across;
                points.push_back(at({p.x(), p.y(), w * size.z()}));
            }
    return points;
}

TEST(FitBox, finds_a_turned_block_standing_on_the_ground)
{
    for (const double degrees : {-80.0, -30.0, 0.0, 25.0, 90.0}) {
        const double yaw = degrees * kPi / 180;
        const std::vector<SitePoint> points = block({1, -2}, {1.2, 0.5, 0.8}, yaw);
        const Obstacle box = fit_box(points, all_of(points), 10, tight());
        EXPECT_LT((box.obb_centre.head<2>() - Vector2d(1, -2)).norm(), 1e-3);
        EXPECT_NEAR(box.obb_size.x(), 1.2, 2e-3);
        EXPECT_NEAR(box.obb_size.y(), 0.5, 2e-3);
        EXPECT_NEAR(std::remainder(box.yaw_rad - yaw, kPi), 0, 1e-3) << degrees;
        EXPECT_EQ(box.aabb_min.z(), 0);
        EXPECT_NEAR(box.aabb_max.z(), 0.8, 2e-3);
        const double half_x = (1.2 * std::abs(std::cos(yaw)) + 0.5 * std::abs(std::sin(yaw))) / 2;
        EXPECT_NEAR(box.aabb_max.x(), 1 + half_x, 2e-3);
        EXPECT_NEAR(box.aabb_min.x(), 1 - half_x, 2e-3);
    }
}

TEST(FitBox, is_not_doubled_by_one_wrong_point_but_keeps_a_real_top)
{
    std::vector<SitePoint> points = block({0, 0}, {1, 1, 1}, 0);
    const Obstacle clean = fit_box(points, all_of(points), 10, tight());
    points.push_back(at({2.0, 0.1, 0.4}));
    const Obstacle robust = fit_box(points, all_of(points), 10, tight());
    EXPECT_GT(aabb_iou(clean.aabb_min, clean.aabb_max, robust.aabb_min, robust.aabb_max), 0.95);
    EXPECT_GT(robust.obb_size.x() * robust.obb_size.y(), 0.99);
    EXPECT_LT(robust.obb_size.x() * robust.obb_size.y(), 1.1);
}

TEST(FitBox, widens_by_what_is_uncertain_and_gives_flat_groups_a_size)
{
    std::vector<SitePoint> points = block({0, 0}, {1, 1, 1}, 0);
    for (SitePoint &p : points) p.covariance = 0.02 * 0.02 * Eigen::Matrix3d::Identity();
    EXPECT_NEAR(fit_box(points, all_of(points), 10, tight()).aabb_max.x(), 0.52, 1e-6);
    const std::vector<SitePoint> one = {at({1, 1, 0.5})};
    const Obstacle dot = fit_box(one, {0}, 10);
    EXPECT_GE((dot.aabb_max - dot.aabb_min).minCoeff(), 0.04 - 1e-9);
    EXPECT_GT(dot.obb_size.minCoeff(), 0);
    EXPECT_THROW(fit_box(one, {}, 10), std::invalid_argument);
}

TEST(FitBox, goes_on_beyond_the_outermost_points_of_a_sample_as_far_as_the_body_does)
{
    // The ends of n uniform samples stop short by 1 / (n + 1) of the body on average; the mean gap makes up for it.
    std::mt19937 rng(kSeed);
    std::uniform_real_distribution<double> uniform(0, 1);
    constexpr int kTrials = 400, kPoints = 15;
    double with = 0, without = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
        std::vector<SitePoint> points;
        for (int i = 0; i < kPoints; ++i) points.push_back(at({uniform(rng), uniform(rng), uniform(rng)}));
        with += fit_box(points, all_of(points), 1).aabb_max.x() / kTrials;
        without += fit_box(points, all_of(points), 1, tight()).aabb_max.x() / kTrials;
    }
    EXPECT_NEAR(with, 1.0, 0.015) << "seed " << kSeed;
    EXPECT_NEAR(without, 1.0 - 1.0 / (kPoints + 1), 0.015) << "seed " << kSeed;
}

TEST(AabbIou, is_what_the_volumes_say)
{
    const Vector3d zero(0, 0, 0), one(1, 1, 1), half(0.5, 0, 0), far(5, 5, 5);
    EXPECT_NEAR(aabb_iou(zero, one, zero, one), 1, 1e-12);
    EXPECT_NEAR(aabb_iou(zero, one, half, Vector3d(1.5, 1, 1)), 1.0 / 3, 1e-12);
    EXPECT_EQ(aabb_iou(zero, one, far, far + one), 0);
}

TEST(MakeBoxes, merges_what_overlaps_and_lets_small_groups_join)
{
    std::vector<SitePoint> points = block({0, 0}, {1, 1, 1}, 0);
    const std::vector<SitePoint> second = block({0.4, 0.1}, {0.8, 0.6, 1.2}, 0.4), third = block({3, 0}, {1, 1, 1}, 0);
    Clusters clusters;
    clusters.groups.resize(3);
    for (const auto *part : {&second, &third}) points.insert(points.end(), part->begin(), part->end());
    const int n = static_cast<int>(second.size());
    for (int i = 0; i < static_cast<int>(points.size()); ++i)
        clusters.groups[static_cast<std::size_t>(i / n)].push_back(i);
    points.push_back(at({0.1, 0.1, 2}));
    points.push_back(at({0.12, 0.1, 2}));
    points.push_back(at({-3, 0.1, 2}));
    points.push_back(at({-3.1, 0.1, 2}));
    clusters.suspected = {{3 * n, 3 * n + 1}, {3 * n + 2, 3 * n + 3}};
    std::vector<Obstacle> obstacles, suspected;
    make_boxes(clusters, 10, {}, &points, &obstacles, &suspected);
    ASSERT_EQ(obstacles.size(), 2u);
    ASSERT_EQ(suspected.size(), 1u);
    EXPECT_EQ(obstacles[0].index, 1);
    EXPECT_EQ(obstacles[0].n_points, 2 * n);
    EXPECT_EQ(points[static_cast<std::size_t>(3 * n)].obstacle, 0);
    EXPECT_EQ(points[static_cast<std::size_t>(3 * n + 2)].obstacle, -2);
    EXPECT_TRUE(suspected[0].is_suspected);
}

// ---- ground map ----

SiteModel model_with_box()
{
    SiteModel model;
    model.area = {-0.3, 0.6, -0.3, 0.6, 0.3};
    for (int i = 0; i < 8; ++i) {
        RefinedView view;
        view.id = i;
        view.camera = synthetic::thesis_camera(i);
        model.views.push_back(view);
    }
    const std::vector<SitePoint> points = block({0.1, 0.1}, {0.2, 0.1, 0.2}, 0.5);
    model.obstacles.push_back(fit_box(points, all_of(points), 1, tight()));
    return model;
}

GroundCode code_at(const GroundMap &map, double x, double y)
{
    const int col = static_cast<int>((x - map.x_min) / map.metres_per_pixel);
    const int row = static_cast<int>((map.y_max - y) / map.metres_per_pixel);
    return static_cast<GroundCode>(map.codes(row, col));
}

// Marches along the line of sight in small steps.
bool is_hidden_brute(const SiteModel &model, const Vector3d &eye, const Vector3d &ground)
{
    for (int i = 0; i <= 4000; ++i) {
        const Vector3d p = ground + (eye - ground) * (i / 4000.0);
        for (const Obstacle &box : model.obstacles)
            if (p.z() <= box.aabb_max.z() && footprint_contains(box, p.x(), p.y())) return true;
    }
    return false;
}

TEST(GroundMap, is_free_only_where_two_views_see_past_the_boxes)
{
    const SiteModel model = model_with_box();
    GroundMapOptions options;
    options.cell_m = 0.02;
    const GroundMap map = map_ground(model, options);
    ASSERT_EQ(map.codes.rows, 45);
    int n_free = 0, n_not = 0, n_differ = 0;
    for (int row = 0; row < map.codes.rows; ++row) {
        for (int col = 0; col < map.codes.cols; ++col) {
            const Vector3d ground(map.x_min + (col + 0.5) * 0.02, map.y_max - (row + 0.5) * 0.02, 0);
            if (footprint_contains(model.obstacles[0], ground.x(), ground.y(), 0.05)) continue;
            int n_seen = 0;
            for (const RefinedView &view : model.views) {
                double x, y;
                if (!(oc_camera_project(&view.camera, ground.data(), &x, &y) > 0)) continue;
                if (x < 2 || y < 2 || x > 637 || y > 477) continue;
                n_seen += !is_hidden_brute(model, camera_centre(view.camera), ground);
            }
            const bool is_free = map.codes(row, col) == static_cast<int>(GroundCode::kFree);
            ++(is_free ? n_free : n_not);
            if (is_free != (n_seen >= 2)) ++n_differ;
        }
    }
    EXPECT_GT(n_free, 500);
    EXPECT_GT(n_not, 50);
    EXPECT_LE(n_differ, 3) << "steps of the brute force may miss a grazed edge";
}

TEST(GroundMap, holds_boxes_rings_suspects_and_stray_points)
{
    SiteModel model = model_with_box();
    const std::vector<SitePoint> small = {at({0.3, 0.3, 0.05}), at({0.32, 0.3, 0.05})};
    model.suspected.push_back(fit_box(small, {0, 1}, 1));
    model.points = {at({0.4, 0.1, 0.1}, 0.01), at({0.1, 0.1, 0.1}, 0.01), at({0.4, -0.1, 0.1}, 0.01)};
    model.points[1].obstacle = 0;
    model.points[2].obstacle = 0; // of the box's cluster, but left out of the box
    const GroundMap map = map_ground(model);
    EXPECT_EQ(code_at(map, 0.4, -0.1), GroundCode::kSuspected);
    EXPECT_EQ(code_at(map, 0.1, 0.1), GroundCode::kObstacle);
    EXPECT_EQ(code_at(map, 0.31, 0.3), GroundCode::kSuspected);
    EXPECT_EQ(code_at(map, 0.4, 0.1), GroundCode::kSuspected);
    EXPECT_EQ(code_at(map, 0.42, 0.1), GroundCode::kSuspected);
    EXPECT_EQ(code_at(map, 0.3, 0.1), GroundCode::kFree);
    // Not one cell that the footprint touches is free.
    for (double u = -0.5; u <= 0.5; u += 0.01)
        for (double v = -0.5; v <= 0.5; v += 0.01) {
            const Obstacle &box = model.obstacles[0];
            const Vector2d along(std::cos(box.yaw_rad), std::sin(box.yaw_rad)), across(-along.y(), along.x());
            const Vector2d p = box.obb_centre.head<2>() + u * box.obb_size.x() * along + v * box.obb_size.y() * across;
            EXPECT_EQ(code_at(map, p.x(), p.y()), GroundCode::kObstacle);
        }
}

TEST(GroundMap, without_views_knows_nothing_and_refuses_an_endless_map)
{
    SiteModel model;
    model.area = {0, 1, 0, 1, 1};
    EXPECT_EQ(cv::countNonZero(map_ground(model).codes != static_cast<int>(GroundCode::kUnseen)), 0);
    GroundMapOptions options;
    options.cell_m = 1e-6;
    EXPECT_THROW(map_ground(model, options), std::invalid_argument);
}

} // namespace
} // namespace outcrop
