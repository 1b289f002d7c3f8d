// SPDX-License-Identifier: BSD-3-Clause
// Drawn voxels against rays through the brick that they fill.
#include "site/render_voxels.h"

#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

#include "carve_scene.h"

namespace outcrop {
namespace {

using bricks::Brick;
using Eigen::Vector3d;

Voxels filled(const Brick &brick, double cell_m)
{
    Voxels v;
    const Obstacle box = brick.box();
    const Vector3d n = ((box.aabb_max - box.aabb_min) / cell_m).array().ceil() + 2;
    v.grid = {box.aabb_min - Vector3d(cell_m, cell_m, 0), cell_m, static_cast<int>(n.x()), static_cast<int>(n.y()),
              static_cast<int>(n.z())};
    v.states.assign(v.grid.size(), VoxelState::kFree);
    v.colours.assign(v.grid.size(), {9, 120, 240});
    for (int k = 0; k < v.grid.nz; ++k)
        for (int j = 0; j < v.grid.ny; ++j)
            for (int i = 0; i < v.grid.nx; ++i)
                if (brick.depth_of(v.grid.centre(i, j, k)) > 0) v.states[v.grid.at(i, j, k)] = VoxelState::kOccupied;
    return v;
}

TEST(RenderVoxels, CoversTheBrickWithoutHolesAtItsDepth)
{
    const Brick brick;
    VoxelCloud cloud;
    const double cell_m = 0.01;
    cloud.add(7, filled(brick, cell_m));
    for (const double azimuth : {0.1, 0.8, 2.0, 3.3, 5.1})
        for (const double radius : {1.2, 2.2, 5.0}) {
            SCOPED_TRACE(azimuth);
            SCOPED_TRACE(radius);
            const CarveView truth = bricks::see(0, bricks::on_ring(azimuth, radius), brick, false);
            const VoxelImage image = render_voxels(cloud, truth.camera);
            const cv::Mat1b body = truth.labels == OC_LABEL_OBSTACLE, drawn = image.mask == 7;
            const int edge = 2 * static_cast<int>(std::ceil(1.5 * cell_m * 260 / (radius - 0.5))) + 1;
            cv::Mat1b inner, outer;
            cv::erode(body, inner, cv::Mat::ones(edge, edge, CV_8U));
            cv::dilate(body, outer, cv::Mat::ones(edge, edge, CV_8U));
            EXPECT_EQ(cv::countNonZero(inner & ~drawn), 0);
            EXPECT_EQ(cv::countNonZero(drawn & ~outer), 0);
            double eye[3];
            oc_pose_centre(&truth.camera.pose, eye);
            const Vector3d from(eye[0], eye[1], eye[2]);
            for (int y = 0; y < image.mask.rows; y += 3)
                for (int x = 0; x < image.mask.cols; x += 3) {
                    if (!inner(y, x)) {
                        EXPECT_EQ(std::isfinite(image.depth(y, x)), image.mask(y, x) == 7);
                        continue;
                    }
                    Vector3d d;
                    oc_camera_ray(&truth.camera, x, y, d.data());
                    const oc_pose_t &pose = truth.camera.pose;
                    const double z = brick.hit(from, d) * (pose.R[6] * d.x() + pose.R[7] * d.y() + pose.R[8] * d.z());
                    // A splat stands at its voxel's centre and reaches over its neighbours'.
                    ASSERT_NEAR(image.depth(y, x), z, 4 * cell_m) << x << ' ' << y;
                    EXPECT_EQ(image.rgb(y, x), cv::Vec3b(9, 120, 240));
                }
        }
}

TEST(RenderVoxels, NearerOnesHideFartherOnesInAnyOrder)
{
    Brick front, back;
    front.centre = {1, 0, 0.25}, back.centre = {-1, 0, 0.25};
    const oc_camera_t camera = bricks::looking_at({3, 0, 0.3}, {0, 0, 0.25});
    const auto draw = [&](bool is_front_first) {
        VoxelCloud cloud;
        cloud.add(is_front_first ? 1 : 2, filled(is_front_first ? front : back, 0.02));
        cloud.add(is_front_first ? 2 : 1, filled(is_front_first ? back : front, 0.02));
        return render_voxels(cloud, camera).mask;
    };
    const cv::Mat1b a = draw(true), b = draw(false);
    EXPECT_EQ(cv::countNonZero(a != b), 0);
    EXPECT_EQ(a(120, 160), 1);
}

TEST(RenderVoxels, ClipsWhatIsBehindOrTooNear)
{
    const Brick brick;
    VoxelCloud cloud;
    cloud.add(1, filled(brick, 0.02));
    EXPECT_EQ(cv::countNonZero(render_voxels(cloud, bricks::looking_at({3, 0, 1}, {9, 0, 1})).mask), 0);
    // From inside nothing is nearer than near_m; faces that look outwards are not seen at all.
    const VoxelImage inside = render_voxels(cloud, bricks::looking_at(brick.centre, {5, 0, 0.2}), 0.3);
    for (const float z : inside.depth) EXPECT_GT(z, 0.3F);
    EXPECT_EQ(cv::countNonZero(render_voxels(VoxelCloud(), bricks::on_ring(0)).mask), 0);
}

TEST(RenderVoxels, RefusesBadInput)
{
    VoxelCloud cloud;
    EXPECT_THROW(cloud.add(0, Voxels()), std::invalid_argument);
    EXPECT_THROW(cloud.add(255, Voxels()), std::invalid_argument);
    oc_camera_t camera = bricks::on_ring(0);
    camera.k.fx_px = NAN;
    EXPECT_THROW(render_voxels(cloud, camera), std::invalid_argument);
}

} // namespace
} // namespace outcrop
