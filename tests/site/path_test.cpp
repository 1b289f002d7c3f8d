// SPDX-License-Identifier: BSD-3-Clause
// Paths: geometry of the frames, the thesis' angles, and every fault of a path file named in one line.
#include "site/path.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace outcrop {
namespace {

constexpr double kDegree = M_PI / 180;

Eigen::Vector3d centre_of(const oc_camera_t &camera)
{
    double c[3];
    oc_pose_centre(&camera.pose, c);
    return {c[0], c[1], c[2]};
}

// Optical axis in the world: third row of cam_from_world.
Eigen::Vector3d axis_of(const oc_camera_t &camera)
{
    return {camera.pose.R[6], camera.pose.R[7], camera.pose.R[8]};
}

double azimuth_of(const oc_camera_t &camera)
{
    return std::atan2(axis_of(camera).x(), axis_of(camera).y());
}

class PathFile : public testing::Test {
protected:
    void SetUp() override { file_ = testing::TempDir() + "outcrop_path_" + std::to_string(getpid()) + ".json"; }
    void TearDown() override { std::filesystem::remove(file_); }

    Path read(const std::string &text)
    {
        std::ofstream(file_) << text;
        return read_path(file_);
    }

    // The one line a fault gives; empty when there is none.
    std::string fault_of(const std::string &text)
    {
        try {
            read(text);
        } catch (const std::runtime_error &fault) {
            return fault.what();
        }
        return "";
    }

    std::string file_;
};

TEST(Path, FramesAreEqualStepsOfWayAndStartAndEndAtTheWaypoints)
{
    PathOptions options;
    options.steps = 23;
    const Path path = plan_path({{0, 0}, {3, 4}, {3, 4.5}, {-1, 4.5}}, options);
    ASSERT_EQ(path.frames.size(), 23u);
    EXPECT_LT((centre_of(path.frames.front()) - Eigen::Vector3d(0, 0, 0.3)).norm(), 1e-12);
    EXPECT_LT((centre_of(path.frames.back()) - Eigen::Vector3d(-1, 4.5, 0.3)).norm(), 1e-12);
    const double step = (5 + 0.5 + 4) / 22;
    // Way along the corners, found again from the place alone.
    for (std::size_t i = 0; i < path.frames.size(); i++) {
        const Eigen::Vector3d c = centre_of(path.frames[i]);
        double way = std::hypot(c.x(), c.y());
        if (way > 5 + 1e-9 || c.y() > 4 + 1e-9) way = c.x() > 3 - 1e-9 ? 5 + c.y() - 4 : 5.5 + 3 - c.x();
        EXPECT_NEAR(way, step * static_cast<double>(i), 1e-9) << i;
    }
}

TEST(Path, CameraLooksAlongTheMotionWithoutAPan)
{
    for (int deg = 0; deg < 360; deg += 15) {
        const double a = deg * kDegree; // azimuth, clockwise from +Y
        PathOptions options;
        options.steps = 3;
        for (const oc_camera_t &frame : plan_path({{1, 2}, {1 + std::sin(a), 2 + std::cos(a)}}, options).frames)
            EXPECT_NEAR(std::remainder(azimuth_of(frame) - a, 2 * M_PI), 0, 1e-9) << deg;
    }
}

TEST(Path, TiltIsFromNadirAndSwingTurnsTheImageOnly)
{
    Waypoint w;
    w.has_pan = true;
    w.pan_rad = 40 * kDegree;
    PathOptions options;
    options.steps = 1;
    for (const double tilt : {0.0, 30.0, 90.0, 120.0}) {
        options.tilt_rad = tilt * kDegree;
        options.swing_rad = 0;
        const oc_camera_t level = plan_path({w}, options).frames.front();
        EXPECT_NEAR(axis_of(level).z(), -std::cos(tilt * kDegree), 1e-12);
        options.swing_rad = 25 * kDegree;
        const oc_camera_t swung = plan_path({w}, options).frames.front();
        EXPECT_LT((axis_of(level) - axis_of(swung)).norm(), 1e-12);
        EXPECT_LT((centre_of(level) - centre_of(swung)).norm(), 1e-12);
        EXPECT_GT(std::abs(level.pose.R[0] - swung.pose.R[0]) + std::abs(level.pose.R[1] - swung.pose.R[1]), 1e-3);
    }
    // An upright camera: image right is level, image down points down.
    options.tilt_rad = 60 * kDegree;
    options.swing_rad = 0;
    const oc_camera_t upright = plan_path({w}, options).frames.front();
    EXPECT_NEAR(upright.pose.R[2], 0, 1e-12);
    EXPECT_LT(upright.pose.R[5], 0);
}

TEST(Path, AnglesRunAlongTheShorterArc)
{
    Waypoint a, b;
    a.has_pan = b.has_pan = true;
    a.pan_rad = 350 * kDegree;
    b.pan_rad = 20 * kDegree;
    b.x_m = 1;
    PathOptions options;
    options.steps = 31;
    const Path path = plan_path({a, b}, options);
    for (int i = 0; i < 31; i++)
        EXPECT_NEAR(
            std::remainder(azimuth_of(path.frames[static_cast<std::size_t>(i)]) - (350 + i) * kDegree, 2 * M_PI), 0,
            1e-9);
}

TEST(Path, RepeatedAndSingleWaypointsAreNoTrouble)
{
    PathOptions options;
    options.steps = 5;
    for (const auto &waypoints : {std::vector<Waypoint>{{1, 1}}, std::vector<Waypoint>{{1, 1}, {1, 1}, {1, 1}}}) {
        for (const oc_camera_t &frame : plan_path(waypoints, options).frames) {
            EXPECT_TRUE(oc_pose_is_valid(&frame.pose));
            EXPECT_LT((centre_of(frame) - Eigen::Vector3d(1, 1, 0.3)).norm(), 1e-12);
        }
    }
    const Path path = plan_path({{0, 0}, {1, 0}, {1, 0}, {1, 1}}, options);
    EXPECT_LT((centre_of(path.frames[2]) - Eigen::Vector3d(1, 0, 0.3)).norm(), 1e-9);
    EXPECT_LT((centre_of(path.frames[4]) - Eigen::Vector3d(1, 1, 0.3)).norm(), 1e-9);
}

TEST(Path, OptionsOutOfRangeAreRefused)
{
    const std::vector<Waypoint> there = {{0, 0}, {1, 0}};
    const auto refuses = [&](auto change) {
        PathOptions options;
        change(&options);
        EXPECT_THROW(plan_path(there, options), std::invalid_argument);
    };
    refuses([](PathOptions *o) { o->steps = 0; });
    refuses([](PathOptions *o) { o->steps = 100001; });
    refuses([](PathOptions *o) { o->height_m = 0; });
    refuses([](PathOptions *o) { o->height_m = NAN; });
    refuses([](PathOptions *o) { o->tilt_rad = NAN; });
    refuses([](PathOptions *o) { o->tilt_rad = -0.1; });
    refuses([](PathOptions *o) { o->swing_rad = INFINITY; });
    refuses([](PathOptions *o) { o->hfov_rad = 3.2; });
    refuses([](PathOptions *o) { o->width_px = 5000; });
    EXPECT_THROW(plan_path({}, {}), std::invalid_argument);
    EXPECT_THROW(plan_path({{NAN, 0}}, {}), std::invalid_argument);
}

TEST_F(PathFile, OperatorsFormGivesTheSameAsPlanPath)
{
    const Path got = read(R"({"waypoints":[{"x":0,"y":0,"pan_deg":10},{"x":2,"y":1}],"steps":7,"height_m":0.5,
        "tilt_deg":70,"swing_deg":3,"hfov_deg":50,"width":320,"height":240})");
    std::vector<Waypoint> waypoints = {{0, 0, true, 10 * kDegree}, {2, 1}};
    PathOptions options;
    options.steps = 7;
    options.height_m = 0.5;
    options.tilt_rad = 70 * kDegree;
    options.swing_rad = 3 * kDegree;
    options.hfov_rad = 50 * kDegree;
    options.width_px = 320;
    options.height_px = 240;
    const Path want = plan_path(waypoints, options);
    ASSERT_EQ(got.frames.size(), want.frames.size());
    for (std::size_t i = 0; i < want.frames.size(); i++) {
        EXPECT_EQ(got.frames[i].k.width_px, 320u);
        for (int k = 0; k < 9; k++) EXPECT_DOUBLE_EQ(got.frames[i].pose.R[k], want.frames[i].pose.R[k]);
        for (int k = 0; k < 3; k++) EXPECT_DOUBLE_EQ(got.frames[i].pose.t[k], want.frames[i].pose.t[k]);
    }
}

TEST_F(PathFile, FramesInMillimetresAreReadAsMetres)
{
    const std::string camera = R"("width":640,"height":480,"fx":500,"fy":501,"cx":320,"cy":240,
        "R":[[1,0,0],[0,-1,0],[0,0,-1]],"t":[-1000,2000,3000])";
    const Path path = read("{\"units\":\"mm\",\"frames\":[{" + camera + "}]}");
    ASSERT_EQ(path.frames.size(), 1u);
    EXPECT_LT((centre_of(path.frames[0]) - Eigen::Vector3d(1, 2, 3)).norm(), 1e-12);
    EXPECT_EQ(path.frames[0].k.fy_px, 501);
}

TEST_F(PathFile, EveryFaultIsOneLineWithFileAndKey)
{
    const std::string good =
        R"({"width":640,"height":480,"fx":500,"fy":500,"cx":320,"cy":240,"R":[[1,0,0],[0,-1,0],[0,0,-1]],"t":[0,0,3]})";
    const auto frame_with = [&](const std::string &from, const std::string &to) {
        std::string text = good;
        text.replace(text.find(from), from.size(), to);
        return "{\"frames\":[" + good + "," + text + "]}";
    };
    ASSERT_EQ(fault_of("{\"frames\":[" + good + "]}"), "");
    const std::vector<std::pair<std::string, std::string>> cases = {
        {"", "JSON"},
        {"[1,2]", "JSON"},
        {"{\"frames\":[", "JSON"},
        {"{}", "\"waypoints\""},
        {R"({"frames":[]})", "\"frames\""},
        {R"({"frames":{"a":1}})", "\"frames\""},
        {R"({"frames":[1]})", "frame 0"},
        {R"({"units":"feet","frames":[]})", "\"units\""},
        {R"({"units":7,"frames":[]})", "\"units\""},
        {frame_with("\"width\":640", "\"width\":-640"), "frame 1: \"width\""},
        {frame_with("\"width\":640", "\"width\":640.5"), "frame 1: \"width\""},
        {frame_with("\"width\":640", "\"width\":1e300"), "frame 1: \"width\""},
        {frame_with("\"width\":640", "\"width\":8"), "\"width\""},
        {frame_with("\"fx\":500", "\"fx\":null"), "frame 1: \"fx\""},
        {frame_with("\"fy\":500", "\"fy\":-1"), "\"fy\""},
        {frame_with("\"cx\":320,", ""), "frame 1: \"cx\""},
        {frame_with("[1,0,0]", "[2,0,0]"), "\"R\""},
        {frame_with("[1,0,0]", "[1,0]"), "\"R\""},
        {frame_with("[1,0,0]", "[1,0,\"a\"]"), "\"R\""},
        {frame_with("[0,0,3]", "[0,0]"), "\"t\""},
        {frame_with("[0,0,3]", "[0,0,0]"), "ground"},
        {frame_with("[0,0,3]", "[0,0,-3]"), "ground"},
        {R"({"waypoints":[]})", "waypoint"},
        {R"({"waypoints":5})", "\"waypoints\""},
        {R"({"waypoints":[{"x":1}]})", "waypoint 0: \"y\""},
        {R"({"waypoints":[{"x":1,"y":2},{"x":"1","y":2}]})", "waypoint 1: \"x\""},
        {R"({"waypoints":[{"x":1,"y":2,"pan_deg":"n"}]})", "\"pan_deg\""},
        {R"({"waypoints":[{"x":1,"y":2}],"steps":0})", "\"steps\""},
        {R"({"waypoints":[{"x":1,"y":2}],"steps":1.5})", "\"steps\""},
        {R"({"waypoints":[{"x":1,"y":2}],"steps":"9"})", "\"steps\""},
        {R"({"waypoints":[{"x":1,"y":2}],"height_m":0})", "\"height_m\""},
        {R"({"waypoints":[{"x":1,"y":2}],"tilt_deg":180})", "\"tilt_deg\""},
        {R"({"waypoints":[{"x":1,"y":2}],"swing_deg":[]})", "\"swing_deg\""},
        {R"({"waypoints":[{"x":1,"y":2}],"hfov_deg":179})", "\"hfov_deg\""},
        {R"({"waypoints":[{"x":1,"y":2}],"width":-3})", "\"width\""},
        {R"({"waypoints":[{"x":1,"y":2}],"height":5000})", "\"height\""}};
    for (const auto &[text, word] : cases) {
        const std::string fault = fault_of(text);
        EXPECT_THAT(fault, testing::StartsWith(file_ + ": ")) << text;
        EXPECT_THAT(fault, testing::HasSubstr(word)) << text;
        EXPECT_THAT(fault, testing::Not(testing::HasSubstr("\n"))) << text;
    }
    std::filesystem::remove(file_);
    EXPECT_THROW(read_path(file_), std::runtime_error);
}

TEST(Path, LoopStandsOutsideEveryBoxAndLooksInwards)
{
    SiteModel model;
    model.area = {-2, 2, -2, 2, 1};
    Obstacle o;
    o.index = 1;
    o.aabb_min = {0.5, 0.5, 0};
    o.aabb_max = {1.5, 1, 0.7};
    o.obb_centre = 0.5 * (o.aabb_min + o.aabb_max);
    o.obb_size = o.aabb_max - o.aabb_min;
    for (const bool has_obstacle : {false, true}) {
        model.obstacles.clear();
        if (has_obstacle) model.obstacles.push_back(o);
        const Path path = loop_path(model, 24);
        ASSERT_EQ(path.frames.size(), 24u);
        const Eigen::Vector3d middle = has_obstacle ? Eigen::Vector3d(1, 0.75, 0.2) : Eigen::Vector3d(0, 0, 0.2);
        for (const oc_camera_t &frame : path.frames) {
            double u, v;
            ASSERT_GT(oc_camera_project(&frame, middle.data(), &u, &v), 0);
            EXPECT_NEAR(u, frame.k.cx_px, 1);
            EXPECT_TRUE(v > 0 && v < 480);
            const Eigen::Vector3d c = centre_of(frame);
            EXPECT_FALSE(has_obstacle && c.x() > 0.5 && c.x() < 1.5 && c.y() > 0.5 && c.y() < 1);
        }
    }
}

} // namespace
} // namespace outcrop
