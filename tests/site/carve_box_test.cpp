// SPDX-License-Identifier: BSD-3-Clause
// Boxes of volumes against brute force; the final box between points and silhouettes.
#include "site/carve_box.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "carve_scene.h"
#include "site/boxes.h"

namespace outcrop {
namespace {

using bricks::Brick;
using Eigen::Vector3d;

constexpr unsigned kSeed = 95;

Voxels filled(const Brick &brick, double cell_m)
{
    Voxels v;
    const Obstacle box = brick.box();
    const Vector3d n = ((box.aabb_max - box.aabb_min) / cell_m).array().ceil() + 6;
    v.grid = {box.aabb_min - Vector3d(3, 3, 0) * cell_m, cell_m, static_cast<int>(n.x()), static_cast<int>(n.y()),
              static_cast<int>(n.z())};
    v.grid.low.z() = 0;
    v.states.resize(v.grid.size());
    for (int k = 0; k < v.grid.nz; ++k)
        for (int j = 0; j < v.grid.ny; ++j)
            for (int i = 0; i < v.grid.nx; ++i)
                v.states[v.grid.at(i, j, k)] =
                    brick.depth_of(v.grid.centre(i, j, k)) > 0 ? VoxelState::kOccupied : VoxelState::kFree;
    return v;
}

double share_inside(const Voxels &v, const Obstacle &box, bool is_oriented)
{
    Brick turned;
    turned.centre = box.obb_centre, turned.size = box.obb_size, turned.yaw_rad = box.yaw_rad;
    double n = 0, n_inside = 0;
    for (int k = 0; k < v.grid.nz; ++k)
        for (int j = 0; j < v.grid.ny; ++j)
            for (int i = 0; i < v.grid.nx; ++i) {
                if (!v.is_occupied(i, j, k)) continue;
                const Vector3d p = v.grid.centre(i, j, k);
                ++n;
                n_inside += is_oriented ? turned.depth_of(p) >= 0
                                        : (p - box.aabb_min).minCoeff() >= 0 && (box.aabb_max - p).minCoeff() >= 0;
            }
    return n_inside / n;
}

TEST(BoxOfVoxels, HoldsTheShareAskedForAndFindsTheYaw)
{
    for (const double yaw : {-1.4, -0.7, 0.0, 0.3, 0.5, 1.2}) {
        SCOPED_TRACE(yaw);
        Brick brick;
        brick.yaw_rad = yaw;
        const Voxels v = filled(brick, 0.015);
        for (const double share : {0.9, 0.95, 1.0}) {
            const Obstacle box = box_of_voxels(v, share);
            EXPECT_GE(share_inside(v, box, false), share);
            EXPECT_GE(share_inside(v, box, true), share);
            EXPECT_EQ(box.aabb_min.z(), 0);
        }
        const Obstacle whole = box_of_voxels(v, 1);
        EXPECT_NEAR(std::remainder(whole.yaw_rad - yaw, bricks::kPi), 0, 2 * bricks::kPi / 180);
        EXPECT_NEAR(whole.obb_size.x(), 0.8, 0.04);
        EXPECT_GT(aabb_iou(whole.aabb_min, whole.aabb_max, brick.box().aabb_min, brick.box().aabb_max), 0.9);
    }
    Voxels nothing = filled(Brick(), 0.05);
    std::fill(nothing.states.begin(), nothing.states.end(), VoxelState::kUnknown);
    EXPECT_THROW(box_of_voxels(nothing), std::invalid_argument);
    EXPECT_THROW(box_of_voxels(filled(Brick(), 0.05), 0), std::invalid_argument);
}

class FinalBoxTest : public testing::Test {
protected:
    double iou(const Obstacle &box) const
    {
        return aabb_iou(box.aabb_min, box.aabb_max, brick_.box().aabb_min, brick_.box().aabb_max);
    }
    // Points on the brick's inner part, and their box.
    std::vector<SitePoint> points_within(double share)
    {
        std::mt19937 rng(kSeed);
        std::uniform_real_distribution<double> uniform(-0.5 * share, 0.5 * share);
        std::vector<SitePoint> points(40);
        for (SitePoint &p : points) {
            const Vector3d d(uniform(rng) * brick_.size.x(), uniform(rng) * brick_.size.y(),
                             uniform(rng) * brick_.size.z());
            const double c = std::cos(brick_.yaw_rad), s = std::sin(brick_.yaw_rad);
            p.position = brick_.centre + Vector3d(c * d.x() - s * d.y(), s * d.x() + c * d.y(), d.z());
        }
        return points;
    }
    Obstacle scaled(double share) const
    {
        Brick other = brick_;
        other.size *= share;
        other.size.z() = brick_.size.z() * (1 + share) / 2;
        other.centre.z() = other.size.z() / 2;
        return other.box();
    }

    Brick brick_;
    std::vector<CarveView> views_ = bricks::ring(10, Brick());
    CarveOptions options_;
};

TEST_F(FinalBoxTest, GrowsToWhatTheSilhouettesShow)
{
    for (const double share : {0.5, 0.6, 0.8, 0.95}) {
        SCOPED_TRACE(share);
        const Obstacle small = scaled(share);
        const Carved carved = carve_obstacle(small, views_, options_);
        const FinalBox result = final_box(small, points_within(share), carved, views_);
        EXPECT_TRUE(result.has_volume);
        EXPECT_GT(iou(result.box), 0.85);
        EXPECT_GE(iou(result.box), iou(small));
        EXPECT_NEAR(result.box.yaw_rad, brick_.yaw_rad, 1e-6);
        EXPECT_EQ(result.box.index, small.index);
    }
}

TEST_F(FinalBoxTest, ComesInToTheVolumeButNotPastAPoint)
{
    const Obstacle large = scaled(1.4);
    const Carved carved = carve_obstacle(large, views_, options_);
    const FinalBox result = final_box(large, points_within(0.9), carved, views_);
    EXPECT_GT(iou(result.box), 0.8);
    std::vector<SitePoint> points = points_within(0.9);
    points[7].position = {large.aabb_max.x() - 0.01, brick_.centre.y(), 0.2};
    const FinalBox held = final_box(large, points, carved, views_);
    EXPECT_GE(held.box.aabb_max.x(), points[7].position.x());
}

TEST_F(FinalBoxTest, LeavesThePointsBoxAloneWithoutAVolumeThatFits)
{
    const Obstacle box = scaled(0.8);
    const auto is_untouched = [&](const FinalBox &result) {
        return !result.has_volume && result.box.aabb_min == box.aabb_min && result.box.aabb_max == box.aabb_max &&
               result.box.obb_size == box.obb_size;
    };
    EXPECT_TRUE(is_untouched(final_box(box, points_within(0.8), Carved(), views_)));
    // The silhouettes show something else, a metre aside.
    Brick other = brick_;
    other.centre.x() -= 0.9;
    const std::vector<CarveView> elsewhere = bricks::ring(10, other);
    CarveOptions wide = options_;
    wide.grow_share = 2;
    const Carved carved = carve_obstacle(box, elsewhere, wide);
    EXPECT_TRUE(carved.is_usable());
    EXPECT_TRUE(is_untouched(final_box(box, points_within(0.8), carved, elsewhere)));
}

TEST_F(FinalBoxTest, OneViewAsideCostsOneToleratedMiss)
{
    const Obstacle box = scaled(0.8);
    EXPECT_EQ(carve_with_box(box, points_within(0.9), views_, options_).tolerated_misses, 0);
    cv::Mat1b &labels = views_[4].labels;
    const cv::Mat1b whole = labels.clone();
    labels.setTo(OC_LABEL_GROUND);
    whole(cv::Rect(0, 0, whole.cols - 60, whole.rows)).copyTo(labels(cv::Rect(60, 0, whole.cols - 60, whole.rows)));
    EXPECT_FALSE(carve_with_box(box, points_within(0.9), views_, options_, {}, 0).final.has_volume);
    const CarvedBox result = carve_with_box(box, points_within(0.9), views_, options_);
    EXPECT_EQ(result.tolerated_misses, 1);
    EXPECT_TRUE(result.final.has_volume);
    EXPECT_GE(iou(result.final.box), iou(box));
}

TEST_F(FinalBoxTest, RefusesOptionsOutOfRange)
{
    FinalBoxOptions bad;
    bad.step_share = 0;
    EXPECT_THROW(final_box(scaled(1), {}, Carved(), views_, bad), std::invalid_argument);
    bad = {};
    bad.max_uncovered = NAN;
    EXPECT_THROW(final_box(scaled(1), {}, Carved(), views_, bad), std::invalid_argument);
}

} // namespace
} // namespace outcrop
