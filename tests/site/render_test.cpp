// SPDX-License-Identifier: BSD-3-Clause
// What a virtual camera sees, against projection and rays done by hand.
#include "site/render.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "core/plane.h"
#include "textured_scene.h"

namespace outcrop {
namespace {

constexpr double kScale = 0.01;
constexpr int kSide = 400;

oc_camera_t look(const Eigen::Vector3d &from, const Eigen::Vector3d &to)
{
    return scene::look_at(from, to);
}

// Known everywhere; checkerboard of 0.25 m squares, black where both or neither of x, y is in an odd square.
OverheadMap checkerboard()
{
    OverheadMap map;
    map.metres_per_pixel = kScale;
    map.x_min = -2;
    map.y_max = 2;
    map.rgb = cv::Mat3b(kSide, kSide);
    map.seen = cv::Mat1b(kSide, kSide, 255);
    for (int y = 0; y < kSide; y++) {
        for (int x = 0; x < kSide; x++) {
            const bool is_white = (x / 25 + y / 25) % 2 == 1;
            map.rgb(y, x) = is_white ? cv::Vec3b(255, 255, 255) : cv::Vec3b(0, 0, 0);
        }
    }
    return map;
}

OverheadMap plain(const cv::Vec3b &colour, unsigned char seen = 255)
{
    OverheadMap map = checkerboard();
    map.rgb.setTo(colour);
    map.seen.setTo(seen);
    return map;
}

Obstacle box(int index, const Eigen::Vector3d &centre, const Eigen::Vector3d &size, double yaw = 0)
{
    Obstacle o;
    o.index = index;
    o.obb_centre = centre;
    o.obb_size = size;
    o.yaw_rad = yaw;
    o.aabb_min = centre - 0.5 * size;
    o.aabb_max = centre + 0.5 * size;
    return o;
}

// Depth at which a pixel's ray enters a box by marching over its six faces; negative when it misses.
double ray_box(const Obstacle &o, const oc_camera_t &camera, double x, double y)
{
    double d[3], c[3];
    oc_camera_ray(&camera, x, y, d);
    oc_pose_centre(&camera.pose, c);
    const Eigen::AngleAxisd turn(-o.yaw_rad, Eigen::Vector3d::UnitZ());
    const Eigen::Vector3d from = turn * (Eigen::Vector3d(c[0], c[1], c[2]) - o.obb_centre);
    const Eigen::Vector3d along = turn * Eigen::Vector3d(d[0], d[1], d[2]);
    double best = -1;
    for (int face = 0; face < 6; face++) {
        const int axis = face / 2;
        const double t = ((face % 2 ? 0.5 : -0.5) * o.obb_size[axis] - from[axis]) / along[axis];
        if (!(t > 0)) continue;
        const Eigen::Vector3d at = from + t * along;
        bool is_on = true;
        for (int i = 0; i < 3; i++) is_on = is_on && (i == axis || std::abs(at[i]) <= 0.5 * o.obb_size[i]);
        if (is_on && (best < 0 || t < best)) best = t;
    }
    return best;
}

TEST(Render, CheckerboardCornersAreWhereTheCameraProjectsThem)
{
    const GroundTexture ground(checkerboard());
    const oc_camera_t camera = look({1.2, -1.0, 1.1}, {0, 0, 0});
    const Frame frame = render_boxes({}, ground, camera);
    int n = 0;
    // On the line between two squares the brightness crosses the middle: search across an X edge and a Y edge.
    for (int i = -3; i <= 3; i++) {
        for (int j = -3; j <= 3; j++) {
            for (const bool across_x : {true, false}) {
                const double edge[3] = {0.25 * i + (across_x ? 0 : 0.125), 0.25 * j + (across_x ? 0.125 : 0), 0};
                const double step[3] = {edge[0] + (across_x ? 0.06 : 0), edge[1] + (across_x ? 0 : 0.06), 0};
                double u, v, su, sv;
                ASSERT_GT(oc_camera_project(&camera, edge, &u, &v), 0);
                ASSERT_GT(oc_camera_project(&camera, step, &su, &sv), 0);
                if (!(u > 20 && v > 20 && u < 460 && v < 340)) continue;
                const cv::Point2d across = cv::Point2d(su - u, sv - v) / std::hypot(su - u, sv - v);
                const auto grey = [&](double s) {
                    const double x = u + s * across.x, y = v + s * across.y;
                    const int x0 = static_cast<int>(x), y0 = static_cast<int>(y);
                    const double ax = x - x0, ay = y - y0;
                    return (1 - ay) * ((1 - ax) * frame.rgb(y0, x0)[0] + ax * frame.rgb(y0, x0 + 1)[0]) +
                           ay * ((1 - ax) * frame.rgb(y0 + 1, x0)[0] + ax * frame.rgb(y0 + 1, x0 + 1)[0]);
                };
                double crossing = 99;
                for (double s = -5; s < 5; s += 0.02) {
                    if ((grey(s) - 127.5) * (grey(s + 0.02) - 127.5) <= 0 && std::abs(s) < std::abs(crossing))
                        crossing = s;
                }
                EXPECT_LT(std::abs(crossing), 0.5) << edge[0] << ' ' << edge[1];
                n++;
            }
        }
    }
    EXPECT_GT(n, 40);
}

TEST(Render, MaskIsTheNearestBoxOfABruteForceRayCast)
{
    std::mt19937 random(5);
    const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
    const GroundTexture ground(plain({90, 90, 90}));
    for (int round = 0; round < 6; round++) {
        SiteModel model;
        for (int i = 1; i <= 5; i++) {
            const Eigen::Vector3d size(uniform(0.1, 0.6), uniform(0.1, 0.6), uniform(0.1, 0.8));
            model.obstacles.push_back(box(i, {uniform(-1, 1), uniform(-1, 1), size.z() / 2}, size, uniform(-1.5, 1.5)));
        }
        const oc_camera_t camera = look({uniform(-1.6, 1.6), -1.6, uniform(0.2, 1.5)}, {0, 0, uniform(-0.2, 0.5)});
        const Frame frame = render_boxes(model, ground, camera);
        double G[9], line[3];
        ASSERT_EQ(oc_plane_ground_from_image(&camera, G), OC_OK);
        oc_plane_horizon(G, line);
        int n_wrong = 0, n_boxes = 0;
        for (int y = 0; y < frame.mask.rows; y++) {
            for (int x = 0; x < frame.mask.cols; x++) {
                int want = line[0] * x + line[1] * y + line[2] > 0 ? kMaskGround : kMaskSky;
                double nearest = 1e9;
                for (const Obstacle &o : model.obstacles) {
                    const double t = ray_box(o, camera, x, y);
                    if (t < 0 || t >= nearest) continue;
                    nearest = t;
                    want = o.index;
                }
                n_boxes += want > 0 && want < 255;
                n_wrong += frame.mask(y, x) != want;
            }
        }
        EXPECT_EQ(n_wrong, 0) << "round " << round << " of seed 5";
        EXPECT_GT(n_boxes, 1000);
    }
}

TEST(Render, HorizonIsTheThirdRowOfTheInverseToThePixel)
{
    const GroundTexture ground(plain({90, 90, 90}));
    for (const double z : {0.2, 0.5, 0.62}) {
        const oc_camera_t camera = look({0, -1.5, 0.5}, {0.3, 0, z});
        double G[9], line[3];
        ASSERT_EQ(oc_plane_ground_from_image(&camera, G), OC_OK);
        oc_plane_horizon(G, line);
        const Frame frame = render_boxes({}, ground, camera);
        for (int x = 0; x < frame.mask.cols; x += 7) {
            const double row = -(line[0] * x + line[2]) / line[1];
            for (int y = 0; y < frame.mask.rows; y++)
                ASSERT_EQ(frame.mask(y, x), y > row ? kMaskGround : kMaskSky) << x << ' ' << y << ' ' << row;
        }
    }
}

TEST(Render, StraightDownIsAllGroundAndUpIsAllSky)
{
    const GroundTexture ground(plain({90, 91, 92}));
    oc_camera_t camera = look({0, 0, 1}, {0, 1, 1});
    const double down[9] = {1, 0, 0, 0, -1, 0, 0, 0, -1}, up[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const double centre[3] = {0.1, 0.2, 1};
    oc_pose_from_centre(down, centre, &camera.pose);
    const Frame below = render_boxes({}, ground, camera);
    EXPECT_EQ(cv::countNonZero(below.mask), 0);
    EXPECT_EQ(below.rgb(180, 240), cv::Vec3b(90, 91, 92));
    oc_pose_from_centre(up, centre, &camera.pose);
    EXPECT_EQ(cv::countNonZero(render_boxes({}, ground, camera).mask != kMaskSky), 0);
}

TEST(Render, CameraInsideABoxSeesOnlyItAndBehindOneNothingOfIt)
{
    const GroundTexture ground(plain({90, 90, 90}));
    SiteModel model;
    model.obstacles = {box(3, {0, 0, 0.5}, {0.6, 0.6, 1})};
    EXPECT_EQ(cv::countNonZero(render_boxes(model, ground, look({0, 0, 0.5}, {1, 0, 0.2})).mask != 3), 0);
    EXPECT_EQ(cv::countNonZero(render_boxes(model, ground, look({0.5, 0, 0.5}, {2, 0, 0})).mask == 3), 0);
    // A hand's breadth before a face that fills the image and reaches behind the camera's plane.
    model.obstacles = {box(3, {0, 0, 0.5}, {0.6, 6, 1})};
    const oc_camera_t near = look({0.4, 0, 0.5}, {-0.2, 0.6, 0.45});
    const Frame frame = render_boxes(model, ground, near);
    int n_wrong = 0;
    for (int y = 0; y < frame.mask.rows; y++) {
        for (int x = 0; x < frame.mask.cols; x++)
            n_wrong += (frame.mask(y, x) == 3) != (ray_box(model.obstacles[0], near, x, y) > 0);
    }
    EXPECT_EQ(n_wrong, 0);
}

TEST(Render, SuspectedBoxesTintWhatIsBehindAndAreNotInTheMask)
{
    const GroundTexture ground(plain({90, 90, 90}));
    const oc_camera_t camera = look({0, -1.5, 0.8}, {0, 0, 0.2});
    SiteModel empty, model;
    model.suspected = {box(7, {0, 0, 0.2}, {0.4, 0.4, 0.4})};
    const Frame before = render_boxes(empty, ground, camera), after = render_boxes(model, ground, camera);
    EXPECT_EQ(cv::countNonZero(before.mask != after.mask), 0);
    const cv::Vec3b was = before.rgb(180, 240), is = after.rgb(180, 240);
    EXPECT_GT(is[0] - is[2], was[0] - was[2] + 40); // amber
    // Behind a firm box it leaves no trace.
    model.obstacles = {box(1, {0, -0.6, 0.4}, {1.5, 0.1, 0.8})};
    empty.obstacles = model.obstacles;
    EXPECT_EQ(cv::norm(render_boxes(model, ground, camera).rgb, render_boxes(empty, ground, camera).rgb, cv::NORM_INF),
              0);
}

TEST(Render, UnseenGroundIsHatchedNearAndFarAndNeverPlain)
{
    OverheadMap map = plain({90, 140, 60});
    map.seen(cv::Rect(0, 0, kSide / 2, kSide)).setTo(0);
    map.rgb(cv::Rect(0, 0, kSide / 2, kSide)).setTo(cv::Vec3b(255, 0, 0)); // must not shine through
    const GroundTexture ground(map);
    const oc_camera_t camera = look({0, -1.5, 1.0}, {0, 0, 0});
    const Frame frame = render_boxes({}, ground, camera);
    double G[9];
    ASSERT_EQ(oc_plane_ground_from_image(&camera, G), OC_OK);
    double lightest = 0, darkest = 255;
    int n_seen = 0, n_unseen = 0;
    for (int y = 0; y < frame.rgb.rows; y++) {
        for (int x = 0; x < frame.rgb.cols; x++) {
            double gx, gy;
            if (oc_plane_ground_point(G, x, y, &gx, &gy) != OC_OK || std::abs(gx) < 0.05 || std::abs(gy) > 1.8)
                continue;
            const cv::Vec3b c = frame.rgb(y, x);
            if (gx > 0.05 && gx < 1.9) {
                ASSERT_LE(cv::norm(c, cv::Vec3b(90, 140, 60), cv::NORM_INF), 1) << x << ' ' << y;
                n_seen++;
            } else if (gx < -0.05) {
                ASSERT_LE(std::abs(c[0] - c[1]), 1) << "unseen ground is grey: " << x << ' ' << y;
                lightest = std::max<double>(lightest, c[0]);
                darkest = std::min<double>(darkest, c[0]);
                n_unseen++;
            }
        }
    }
    EXPECT_GT(n_seen, 10000);
    EXPECT_GT(n_unseen, 10000);
    EXPECT_GT(lightest - darkest, 12);
    // The stripes of far ground keep some contrast and are wider than a few pixels.
    for (const double footprint : {0.001, 0.01, 0.1, 1.0, 10.0}) {
        double low = 255, high = 0, steepest = 0;
        for (int i = 0; i < 2000; i++) {
            const double x = 37 + i * footprint;
            const double here = ground.hatch(x, 5, footprint)[0], next = ground.hatch(x + footprint, 5, footprint)[0];
            low = std::min(low, here);
            high = std::max(high, here);
            steepest = std::max(steepest, std::abs(here - next));
        }
        EXPECT_GT(high - low, 4) << footprint;
        EXPECT_LT(steepest, 0.85 * (high - low)) << footprint;
    }
}

TEST(Render, MinifiedCheckerboardIsItsMean)
{
    const GroundTexture ground(checkerboard());
    // A pixel of four squares: grey, no aliasing.
    for (int i = 0; i < 50; i++) {
        const cv::Vec4f c = ground.sample(-0.5 + 0.013 * i, 0.3 - 0.007 * i, {1.0, 0}, {0, -1.0}, 6);
        EXPECT_NEAR(c[0], 127.5, 12);
        EXPECT_FLOAT_EQ(c[3], 1);
    }
    EXPECT_EQ(ground.sample(50, 0, {0.01, 0}, {0, 0.01}, 6)[3], 0);
    EXPECT_EQ(ground.sample(0, 0, {1e9, 0}, {0, 1e9}, 6)[3], 0);
}

TEST(Render, SameInputsGiveTheSameFrameAndBadOnesAreRefused)
{
    const GroundTexture ground(checkerboard());
    SiteModel model;
    model.obstacles = {box(1, {0, 0, 0.2}, {0.4, 0.3, 0.4}, 0.4)};
    oc_camera_t camera = look({1, -1, 1}, {0, 0, 0});
    const Frame a = render_boxes(model, ground, camera), b = render_boxes(model, ground, camera);
    EXPECT_EQ(cv::norm(a.rgb, b.rgb, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(a.mask, b.mask, cv::NORM_INF), 0);
    RenderOptions options;
    options.supersample = 0;
    EXPECT_THROW(render_boxes(model, ground, camera, options), std::invalid_argument);
    EXPECT_THROW(render_boxes(model, ground, look({1, -1, -1}, {0, 0, 0.1})), std::invalid_argument);
    camera.k.fx_px = NAN;
    EXPECT_THROW(render_boxes(model, ground, camera), std::invalid_argument);
}

} // namespace
} // namespace outcrop
