// SPDX-License-Identifier: BSD-3-Clause
// The files of a model: read back what was written, and nothing half-written when it cannot be.
#include "site/export.h"

#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "site/atomic_file.h"
#include "textured_scene.h"

namespace outcrop {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;

class Export : public testing::Test {
protected:
    void SetUp() override
    {
        dir_ = testing::TempDir() + "outcrop_export_" + std::to_string(getpid());
        fs::remove_all(dir_);
        for (const int id : {3, 8}) {
            View view;
            view.id = id;
            view.camera = scene::on_ring(20.0 * id);
            oc_junction_t junction{};
            junction.x_px = 400;
            junction.y_px = 300;
            view.junctions = {junction};
            views_[id] = view;
            RefinedView refined;
            refined.id = id;
            refined.camera = view.camera;
            model_.views.push_back(refined);
        }
        Match match;
        match.point = {0.1, 1.0 / 3, 0.2};
        match.score = 0.9;
        model_.pairs = {{3, 8, {match}}};
        Obstacle box;
        box.index = 1;
        box.aabb_min = {0, 0, 0};
        box.aabb_max = {1, 2, 3};
        box.obb_centre = {0.5, 1, 1.5};
        box.obb_size = {1.0 / 3, 2, 3};
        box.yaw_rad = M_PI / 6;
        box.n_points = 17;
        model_.obstacles = {box};
        SitePoint point;
        point.position = {0.25, -0.5, 0.75};
        point.colour = {1, 2, 3};
        point.obstacle = -2;
        model_.points = {point};
        model_.area = {-1, 1, -1, 1, 0.5};
        ground_.metres_per_pixel = 0.1;
        ground_.codes = cv::Mat1b(4, 6, static_cast<unsigned char>(2));
        overhead_.metres_per_pixel = 0.2;
        overhead_.x_min = -1;
        overhead_.y_max = 1;
        overhead_.rgb = cv::Mat3b(2, 3, cv::Vec3b(10, 20, 30));
        overhead_.seen = cv::Mat1b(2, 3, static_cast<unsigned char>(255));
        overhead_.seen(0, 1) = 0;
    }
    void TearDown() override { fs::remove_all(dir_); }

    void write() { write_model_dir(dir_, model_, views_, ground_, overhead_); }

    std::string fault()
    {
        try {
            write();
        } catch (const std::exception &e) {
            return e.what();
        }
        return "";
    }

    std::string text(const std::string &file) const
    {
        std::ifstream in(dir_ + "/" + file, std::ios::binary);
        std::stringstream out;
        out << in.rdbuf();
        return out.str();
    }

    std::string dir_;
    SiteModel model_;
    std::map<int, View> views_;
    GroundMap ground_;
    OverheadMap overhead_;
};

TEST_F(Export, NumbersReadBackAreTheNumbersWritten)
{
    write();
    const json obstacles = json::parse(text("model/obstacles.json"));
    EXPECT_EQ(obstacles["units"], "m");
    const json &box = obstacles["obstacles"][0];
    EXPECT_EQ(box["index"], 1);
    EXPECT_EQ(box["obb"]["size"][0].get<double>(), 1.0 / 3);
    EXPECT_NEAR(box["obb"]["yaw_deg"].get<double>(), 30, 1e-12);
    EXPECT_EQ(box["points"], 17);
    const json match = json::parse(text("matches.json"))["pairs"][0];
    EXPECT_EQ(match["left"], 3);
    EXPECT_EQ(match["right"], 8);
    EXPECT_EQ(match["matches"][0]["point"][1].get<double>(), 1.0 / 3);
    EXPECT_EQ(match["matches"][0]["left"], (json{400.0, 300.0}));
    const json cameras = json::parse(text("model/cameras.json"));
    ASSERT_EQ(cameras["views"].size(), 2u);
    for (int k = 0; k < 9; k++)
        EXPECT_EQ(
            cameras["views"][1]["R"][static_cast<std::size_t>(k / 3)][static_cast<std::size_t>(k % 3)].get<double>(),
            model_.views[1].camera.pose.R[k]);
    const json overhead = json::parse(text("overhead.json"));
    EXPECT_EQ(overhead["width"], 3);
    EXPECT_EQ(overhead["height"], 2);
    EXPECT_EQ(json::parse(text("model/ground.json"))["codes"].size(), 4u);
}

TEST_F(Export, WhatTheModelSaysOfItselfIsWritten)
{
    write();
    EXPECT_TRUE(json::parse(text("model/obstacles.json"))["quality"].empty());
    model_.quality = {
        {"one_view", "One \"view\" alone.", Severity::kFault}, {"b", "c", Severity::kWarning}, {"d", "e"}};
    write();
    const json quality = json::parse(text("model/obstacles.json"))["quality"];
    ASSERT_EQ(quality.size(), 3u);
    EXPECT_EQ(quality[0], (json{{"code", "one_view"}, {"text", "One \"view\" alone."}, {"severity", "fault"}}));
    EXPECT_EQ(quality[1]["severity"], "warning");
    EXPECT_EQ(quality[2]["severity"], "note");
}

TEST_F(Export, ImagesKeepColourAndWhatIsUnseen)
{
    write();
    const cv::Mat4b bgra = cv::imread(dir_ + "/overhead.png", cv::IMREAD_UNCHANGED);
    ASSERT_EQ(bgra.size(), cv::Size(3, 2));
    EXPECT_EQ(bgra(1, 1), cv::Vec4b(30, 20, 10, 255));
    EXPECT_EQ(bgra(0, 1)[3], 0);
    const cv::Mat codes = cv::imread(dir_ + "/model/ground.png", cv::IMREAD_UNCHANGED);
    EXPECT_EQ(cv::norm(codes, ground_.codes, cv::NORM_INF), 0);
}

TEST_F(Export, PointsAreBinaryPly)
{
    write();
    const std::string ply = text("model/points.ply");
    const std::size_t end = ply.find("end_header\n") + 11;
    ASSERT_EQ(ply.size() - end, 19u);
    float xyz[3];
    std::memcpy(xyz, ply.data() + end, 12);
    EXPECT_EQ(xyz[0], 0.25f);
    EXPECT_EQ(xyz[2], 0.75f);
    std::int32_t obstacle = 0;
    std::memcpy(&obstacle, ply.data() + end + 15, 4);
    EXPECT_EQ(obstacle, -2);
}

TEST_F(Export, PixelsOfMatchesGetTheirDistortionBack)
{
    View &view = views_[3];
    view.has_distortion = true;
    view.distortion = {{-0.2, 0.05, 0.001, -0.002, 0.0}};
    write();
    const json pixel = json::parse(text("matches.json"))["pairs"][0]["matches"][0]["left"];
    EXPECT_GT(std::abs(pixel[0].get<double>() - 400), 1);
    double x, y;
    ASSERT_EQ(oc_undistort(&view.camera.k, &view.distortion, pixel[0], pixel[1], &x, &y), OC_OK);
    EXPECT_NEAR(x, 400, 1e-4);
    EXPECT_NEAR(y, 300, 1e-4);
}

TEST_F(Export, EqualModelsGiveEqualBytes)
{
    write();
    const std::string first =
        text("matches.json") + text("model/cameras.json") + text("model/points.ply") + text("overhead.png");
    write();
    EXPECT_EQ(first,
              text("matches.json") + text("model/cameras.json") + text("model/points.ply") + text("overhead.png"));
}

TEST_F(Export, NothingIsWrittenWhenANumberIsNotFinite)
{
    const SiteModel good = model_;
    const auto refuses = [&](const std::string &file, auto change) {
        model_ = good;
        change(&model_);
        EXPECT_THAT(fault(), testing::HasSubstr(file));
        EXPECT_THAT(fault(), testing::Not(testing::HasSubstr("\n")));
        EXPECT_FALSE(fs::exists(dir_)) << file;
    };
    refuses("matches.json", [](SiteModel *m) { m->pairs[0].matches[0].point.x() = NAN; });
    refuses("obstacles.json", [](SiteModel *m) { m->obstacles[0].yaw_rad = INFINITY; });
    refuses("cameras.json", [](SiteModel *m) { m->views[0].camera.pose.t[1] = NAN; });
    refuses("points.ply", [](SiteModel *m) { m->points[0].position.z() = NAN; });
    refuses("matches.json", [](SiteModel *m) { m->pairs[0].left = 77; });
    refuses("matches.json", [](SiteModel *m) { m->pairs[0].matches[0].right_junction = 5; });
}

TEST_F(Export, AFolderThatCannotBeMadeIsOneLine)
{
    std::ofstream(dir_) << "a file where the folder should be";
    const std::string line = fault();
    EXPECT_THAT(line, testing::HasSubstr(dir_));
    EXPECT_THAT(line, testing::Not(testing::HasSubstr("\n")));
}

TEST_F(Export, AFileThatCannotBeReplacedLeavesNoPart)
{
    fs::create_directories(dir_ + "/matches.json/in_the_way");
    const std::string line = fault();
    EXPECT_THAT(line, testing::HasSubstr(dir_ + "/matches.json: cannot be written"));
    EXPECT_FALSE(fs::exists(dir_ + "/matches.json.part"));
    EXPECT_THROW(write_whole(dir_ + "/none/file", "x"), std::runtime_error);
    write_whole(dir_ + "/file", "old");
    write_whole(dir_ + "/file", "new");
    EXPECT_EQ(text("file"), "new");
    EXPECT_FALSE(fs::exists(dir_ + "/file.part"));
}

} // namespace
} // namespace outcrop
