// SPDX-License-Identifier: BSD-3-Clause
// Carving against brute force, voxel by voxel; what is unknown stays unknown; bad input at the door.
#include "site/carve.h"

#include <cmath>
#include <random>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "carve_scene.h"
#include "site/carve_hull.h"
#include "site/carve_shape.h"

namespace outcrop {
namespace {

using bricks::Brick;
using Eigen::Vector3d;

constexpr unsigned kSeed = 6151;

CarveOptions plain(double voxel_m = 0.02)
{
    CarveOptions options;
    options.with_colour = false;
    options.close_cells = 0;
    options.min_part_share = 0;
    options.voxel_m = voxel_m;
    return options;
}

int label_by_projection(const CarveView &view, const Vector3d &p)
{
    double x, y;
    if (!(oc_camera_project(&view.camera, p.data(), &x, &y) > 1e-6)) return OC_LABEL_UNKNOWN;
    const double u = std::floor(x + 0.5), v = std::floor(y + 0.5);
    if (!(u >= 0 && v >= 0 && u < view.labels.cols && v < view.labels.rows)) return OC_LABEL_UNKNOWN;
    return view.labels(static_cast<int>(v), static_cast<int>(u));
}

VoxelState state_by_projection(const std::vector<CarveView> &views, const Vector3d &p, int misses, int min_views)
{
    int n_ground = 0, n_obstacle = 0;
    for (const CarveView &view : views) {
        const int label = label_by_projection(view, p);
        n_ground += label == OC_LABEL_GROUND;
        n_obstacle += label == OC_LABEL_OBSTACLE;
    }
    if (n_ground > misses) return VoxelState::kFree;
    return n_obstacle >= min_views ? VoxelState::kOccupied : VoxelState::kUnknown;
}

// Large patches of the three labels: whole blocks of one opinion and blocks of several.
CarveView random_view(int id, std::mt19937 *rng)
{
    std::uniform_real_distribution<double> uniform(-1, 1);
    // Some of these cameras stand inside the grid and look through it.
    const Vector3d eye(2 * uniform(*rng), 2 * uniform(*rng), 0.3 + 0.5 * std::abs(uniform(*rng)));
    CarveView view;
    view.id = id;
    view.camera = bricks::looking_at(eye, {0.3 * uniform(*rng), 0.3 * uniform(*rng), 0.1}, 200, 150, 120);
    view.labels = cv::Mat1b(150, 200, static_cast<uchar>((*rng)() % 3));
    for (int n = 0; n < 12; ++n) {
        const cv::Rect patch(static_cast<int>((*rng)() % 180), static_cast<int>((*rng)() % 130),
                             1 + static_cast<int>((*rng)() % 100), 1 + static_cast<int>((*rng)() % 80));
        view.labels(patch & cv::Rect(0, 0, 200, 150)) = static_cast<uchar>((*rng)() % 3);
    }
    return view;
}

TEST(CarveHull, BlocksAreWhatEachVoxelAloneWouldBe)
{
    for (unsigned seed = kSeed; seed < kSeed + 12; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 rng(seed);
        std::vector<CarveView> views;
        for (int id = 0; id < 5; ++id) views.push_back(random_view(id, &rng));
        const std::vector<LabelView> labels(views.begin(), views.end());
        VoxelGrid grid{{-0.6, -0.55, 0}, 0.031, 37, 35, 21};
        const int misses = static_cast<int>(seed % 3), min_views = 1 + static_cast<int>(seed % 2);
        const std::vector<VoxelState> states = carve_hull(grid, labels, misses, min_views);
        int n_wrong = 0;
        std::array<int, 3> n_of{};
        for (int k = 0; k < grid.nz; ++k)
            for (int j = 0; j < grid.ny; ++j)
                for (int i = 0; i < grid.nx; ++i) {
                    const VoxelState state = states[grid.at(i, j, k)];
                    ++n_of[static_cast<std::size_t>(state)];
                    n_wrong += state != state_by_projection(views, grid.centre(i, j, k), misses, min_views);
                }
        // Rounding may put a voxel on the border of two pixels to either side.
        EXPECT_LE(n_wrong, 2);
        EXPECT_GT(n_of[0] + n_of[1] + n_of[2], 0);
    }
}

TEST(Carve, HoldsTheBrickAndLittleElse)
{
    const Brick brick;
    const Carved carved = carve_obstacle(brick.box(), bricks::ring(12, brick), plain());
    const VoxelGrid &g = carved.voxels.grid;
    std::size_t common = 0, whole = 0, n_lost = 0;
    for (int k = 0; k < g.nz; ++k)
        for (int j = 0; j < g.ny; ++j)
            for (int i = 0; i < g.nx; ++i) {
                const double depth = brick.depth_of(g.centre(i, j, k));
                const bool is_occupied = carved.voxels.is_occupied(i, j, k);
                common += is_occupied && depth > 0;
                whole += is_occupied || depth > 0;
                n_lost += depth > 0.01 && !is_occupied; // a pixel is 8 mm here
            }
    EXPECT_EQ(n_lost, 0U);
    EXPECT_GT(static_cast<double>(common) / static_cast<double>(whole), 0.75);
    EXPECT_EQ(carved.n_occupied + carved.n_free + carved.n_unknown, g.size());
    EXPECT_EQ(carved.n_views, 12);
}

TEST(Carve, OrderOfViewsIsOfNoAccount)
{
    const Brick brick;
    std::vector<CarveView> views = bricks::ring(8, brick, true);
    CarveOptions options;
    options.voxel_m = 0.025;
    const Carved a = carve_obstacle(brick.box(), views, options);
    std::mt19937 rng(kSeed);
    std::shuffle(views.begin(), views.end(), rng);
    const Carved b = carve_obstacle(brick.box(), views, options);
    EXPECT_EQ(a.voxels.states, b.voxels.states);
    EXPECT_EQ(a.voxels.colours, b.voxels.colours);
    EXPECT_GT(a.n_occupied, 0U);
}

TEST(Carve, SaysUnknownWhereNobodyLooked)
{
    const Brick brick;
    std::vector<CarveView> views = bricks::ring(4, brick);
    for (CarveView &view : views) view.labels.setTo(OC_LABEL_UNKNOWN);
    Carved carved = carve_obstacle(brick.box(), views, plain());
    EXPECT_EQ(carved.n_unknown, carved.voxels.grid.size());
    EXPECT_FALSE(carved.is_usable());
    EXPECT_EQ(carved.n_views, 0);

    // Cameras that look away and call everything ground: what is behind them is no ground.
    views.clear();
    for (int i = 0; i < 4; ++i) {
        CarveView view = bricks::see(i, bricks::looking_at({3.0 + i, 0, 1}, {9, 0, 1}), brick, false);
        view.labels.setTo(OC_LABEL_GROUND);
        views.push_back(view);
    }
    carved = carve_obstacle(brick.box(), views, plain());
    EXPECT_EQ(carved.n_unknown, carved.voxels.grid.size());
    EXPECT_EQ(carve_obstacle(brick.box(), {}, plain()).n_free, 0U);
}

TEST(Carve, OneUnknownPixelRegionCarvesNothing)
{
    const Brick brick;
    std::vector<CarveView> views = bricks::ring(6, brick);
    const std::size_t before = carve_obstacle(brick.box(), views, plain()).n_occupied;
    for (CarveView &view : views) view.labels(cv::Rect(100, 60, 60, 60)).setTo(OC_LABEL_UNKNOWN);
    EXPECT_GE(carve_obstacle(brick.box(), views, plain()).n_occupied, before);
}

TEST(Carve, LeavesOutTheViewThatContradictsAllOthers)
{
    const Brick brick;
    std::vector<CarveView> views = bricks::ring(8, brick);
    const std::size_t whole = carve_obstacle(brick.box(), views, plain()).n_occupied;
    views[3].labels.setTo(OC_LABEL_GROUND);
    const Carved carved = carve_obstacle(brick.box(), views, plain());
    EXPECT_THAT(carved.views_left_out, testing::ElementsAre(3));
    EXPECT_GE(carved.n_occupied, whole);
    // Two that lie together are not found out; the result then says that it is of no use.
    views[4].labels.setTo(OC_LABEL_GROUND);
    EXPECT_FALSE(carve_obstacle(brick.box(), views, plain()).is_usable());
    CarveOptions tolerant = plain();
    tolerant.tolerated_misses = 2;
    EXPECT_GE(carve_obstacle(brick.box(), views, tolerant).n_occupied, whole);
}

TEST(Carve, ToleranceNeverTakesAway)
{
    const Brick brick;
    const std::vector<CarveView> views = bricks::ring(7, brick);
    std::size_t last = 0;
    for (int misses = 0; misses < 4; ++misses) {
        CarveOptions options = plain();
        options.tolerated_misses = misses;
        options.max_regrows = 0;
        const std::size_t n = carve_obstacle(brick.box(), views, options).n_occupied;
        EXPECT_GE(n, last) << misses;
        last = n;
    }
}

TEST(Carve, FollowsABodyThatGoesOnBeyondItsBox)
{
    const Brick brick;
    Brick half = brick;
    half.size = {0.5, 0.3, 0.3};
    half.centre.z() = 0.15;
    const Carved carved = carve_obstacle(half.box(), bricks::ring(12, brick), plain());
    const VoxelGrid &g = carved.voxels.grid;
    for (const Vector3d &corner : {brick.box().aabb_min, brick.box().aabb_max}) {
        EXPECT_TRUE((corner.array() >= g.low.array() - 1e-9).all());
        EXPECT_TRUE((corner.array() <= g.high().array() + 1e-9).all());
    }
}

// With labels that say obstacle everywhere only colours can carve.
TEST(Carve, ColoursTakeAwayAirButNotTheBody)
{
    const Brick brick;
    std::vector<CarveView> views = bricks::ring(12, brick, true);
    for (CarveView &view : views) view.labels.setTo(OC_LABEL_OBSTACLE);
    CarveOptions options = plain(0.015);
    options.max_regrows = 0;
    const Carved hull = carve_obstacle(brick.box(), views, options);
    options.with_colour = true;
    options.max_removed = 1;
    const Carved carved = carve_obstacle(brick.box(), views, options);
    const VoxelGrid &g = carved.voxels.grid;
    std::size_t n_body = 0, n_body_lost = 0, n_air = 0, n_air_lost = 0;
    for (int k = 0; k < g.nz; ++k)
        for (int j = 0; j < g.ny; ++j)
            for (int i = 0; i < g.nx; ++i) {
                const double depth = brick.depth_of(g.centre(i, j, k));
                const bool is_lost = !carved.voxels.is_occupied(i, j, k);
                if (depth > 0.02) ++n_body, n_body_lost += is_lost;
                if (depth < -0.02) ++n_air, n_air_lost += is_lost;
            }
    EXPECT_EQ(hull.n_occupied, g.size());
    EXPECT_EQ(carved.n_free, 0U); // colour alone never calls a voxel free
    EXPECT_LT(static_cast<double>(n_body_lost), 0.01 * static_cast<double>(n_body));
    // Most of a slab's voxels are seen by two or three views only: colour trims, it does not sculpt.
    EXPECT_GT(static_cast<double>(n_air_lost), 0.08 * static_cast<double>(n_air));
}

TEST(Carve, GainsOfViewsAreNoDisagreement)
{
    const Brick brick;
    std::vector<CarveView> views = bricks::ring(8, brick, true);
    CarveOptions options = plain();
    options.with_colour = true;
    const Carved even = carve_obstacle(brick.box(), views, options);
    for (std::size_t v = 0; v < views.size(); ++v) views[v].rgb.convertTo(views[v].rgb, -1, v % 2 ? 0.7 : 1.0);
    const Carved uneven = carve_obstacle(brick.box(), views, options);
    EXPECT_NEAR(static_cast<double>(uneven.n_occupied), static_cast<double>(even.n_occupied),
                0.03 * static_cast<double>(even.n_occupied));
}

TEST(Carve, SurfaceHasTheColourOfTheBody)
{
    const Brick brick;
    std::vector<CarveView> views = bricks::ring(10, brick, true);
    for (CarveView &view : views) view.rgb.setTo(cv::Vec3b(200, 60, 20), view.labels == OC_LABEL_OBSTACLE);
    const Carved carved = carve_obstacle(brick.box(), views, plain());
    std::size_t n_right = 0;
    const VoxelGrid &g = carved.voxels.grid;
    for (std::size_t at = 0; at < g.size(); ++at)
        if (carved.voxels.states[at] == VoxelState::kOccupied)
            n_right += cv::norm(cv::Vec3i(carved.voxels.colours[at]) - cv::Vec3i(200, 60, 20)) < 30;
    EXPECT_GT(static_cast<double>(n_right), 0.97 * static_cast<double>(carved.n_occupied));
    for (CarveView &view : views) view.rgb.release(), view.known.release();
    EXPECT_TRUE(carve_obstacle(brick.box(), views, plain()).voxels.colours.empty());
}

TEST(Carve, ThesisWayCountsAgreementWithoutVisibility)
{
    const Brick brick;
    std::vector<CarveView> views = bricks::ring(8, brick, true);
    CarveOptions options = plain();
    options.method = CarveMethod::kThesis;
    options.with_colour = true;
    for (CarveView &view : views) view.rgb.setTo(cv::Vec3b(90, 90, 90));
    const Carved same = carve_obstacle(brick.box(), views, options);
    EXPECT_EQ(same.n_colour_removed, 0U);
    for (std::size_t v = 0; v < views.size(); ++v) views[v].rgb.setTo(cv::Scalar::all(v % 2 ? 250 : 5));
    EXPECT_EQ(carve_obstacle(brick.box(), views, options).n_occupied, 0U); // three others agree, four are asked for
    options.thesis_agreeing = 3;
    EXPECT_EQ(carve_obstacle(brick.box(), views, options).n_occupied, same.n_occupied);
}

TEST(Carve, RefusesAGridThatWouldNotFitAndSaysItsSize)
{
    const Brick brick;
    CarveOptions options = plain(1e-5);
    try {
        carve_obstacle(brick.box(), bricks::ring(2, brick), options);
        FAIL() << "not refused";
    } catch (const std::length_error &e) {
        EXPECT_THAT(e.what(), testing::AllOf(testing::HasSubstr("voxels"), testing::HasSubstr("bytes")));
    }
    options.voxel_m = 0;
    for (const double at_most : {1e3, 5e4, 1e6}) {
        options.auto_voxels = at_most;
        EXPECT_LE(static_cast<double>(grid_for(brick.box(), bricks::ring(2, brick), options).size()), at_most);
    }
}

TEST(Carve, RefusesBadInput)
{
    const Brick brick;
    const std::vector<CarveView> good = bricks::ring(2, brick, true);
    const auto refused = [&](const Obstacle &box, const std::vector<CarveView> &views, const CarveOptions &options) {
        EXPECT_THROW(carve_obstacle(box, views, options), std::invalid_argument);
    };
    Obstacle flat = brick.box();
    flat.aabb_max.z() = flat.aabb_min.z();
    flat.obb_size.setZero();
    refused(flat, good, plain());
    Obstacle nowhere = brick.box();
    nowhere.aabb_max.x() = NAN;
    refused(nowhere, good, plain());
    std::vector<CarveView> views = good;
    views[1].id = views[0].id;
    refused(brick.box(), views, plain());
    views = good;
    views[0].labels = cv::Mat1b(10, 10);
    refused(brick.box(), views, plain());
    views = good;
    views[0].known.release();
    refused(brick.box(), views, plain());
    views = good;
    views[0].camera.pose.R[0] = NAN;
    refused(brick.box(), views, plain());
    for (const double cell : {-1.0, static_cast<double>(NAN), static_cast<double>(INFINITY)})
        refused(brick.box(), good, plain(cell));
    CarveOptions options = plain();
    options.tolerated_misses = -1;
    refused(brick.box(), good, options);
}

TEST(CarveShape, ClosingFillsUnknownGapsOnly)
{
    Voxels v{{Vector3d::Zero(), 1, 7, 5, 5}, std::vector<VoxelState>(175, VoxelState::kOccupied), {}};
    v.states[v.grid.at(3, 2, 2)] = VoxelState::kUnknown;
    v.states[v.grid.at(4, 2, 2)] = VoxelState::kFree;
    close_voxels(1, &v);
    EXPECT_EQ(v.states[v.grid.at(3, 2, 2)], VoxelState::kOccupied);
    EXPECT_EQ(v.states[v.grid.at(4, 2, 2)], VoxelState::kFree);
}

TEST(CarveShape, OpeningAndSmallPartsBecomeUnknown)
{
    Voxels v{{Vector3d::Zero(), 1, 20, 9, 9}, std::vector<VoxelState>(20 * 81, VoxelState::kFree), {}};
    const auto set = [&](int i0, int i1, int j0, int j1, int k0, int k1) {
        for (int k = k0; k < k1; ++k)
            for (int j = j0; j < j1; ++j)
                for (int i = i0; i < i1; ++i) v.states[v.grid.at(i, j, k)] = VoxelState::kOccupied;
    };
    set(0, 6, 0, 6, 0, 6);   // a block
    set(6, 12, 3, 4, 3, 4);  // a needle on it
    set(16, 17, 8, 9, 8, 9); // a crumb
    Voxels parts = v;
    drop_small_parts(0.02, &parts);
    EXPECT_EQ(parts.states[v.grid.at(16, 8, 8)], VoxelState::kUnknown);
    EXPECT_EQ(parts.states[v.grid.at(11, 3, 3)], VoxelState::kOccupied);
    open_voxels(1, &v);
    EXPECT_EQ(v.states[v.grid.at(11, 3, 3)], VoxelState::kUnknown);
    EXPECT_EQ(v.states[v.grid.at(0, 0, 0)], VoxelState::kOccupied);
    EXPECT_EQ(v.states[v.grid.at(5, 5, 5)], VoxelState::kOccupied);
}

} // namespace
} // namespace outcrop
