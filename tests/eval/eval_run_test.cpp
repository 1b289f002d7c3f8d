// SPDX-License-Identifier: BSD-3-Clause
// Whole runs of outcrop-eval: a perfect run scores 1, every planted fault is seen, what is absent is null.
#include "site_maker.h"

#include "eval/image_quality.h"
#include "eval/json_file.h"
#include "eval/report.h"

#include <cmath>
#include <cstdlib>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <sys/wait.h>

namespace outcrop::eval {
namespace {

namespace fs = std::filesystem;
using nlohmann::ordered_json;
using testing::Contains;
using testing::HasSubstr;

class EvalRun : public testing::Test {
protected:
    void SetUp() override
    {
        const auto *test = testing::UnitTest::GetInstance()->current_test_info();
        root_ = fs::path(testing::TempDir()) / ("outcrop_eval_run_" + std::string(test->name()));
        fs::remove_all(root_);
        site_ = root_ / "site";
        dir_ = root_ / "dir";
        write_small_site(site_);
        Notes notes;
        write_perfect_run(read_truth(site_, notes), dir_);
        ASSERT_THAT(notes, testing::IsEmpty());
    }
    void TearDown() override { fs::remove_all(root_); }

    ordered_json judge()
    {
        notes_.clear();
        return to_json(evaluate(site_, dir_, notes_));
    }

    // Rewrites a JSON file of the run.
    template <typename Change>
    void edit(const std::string &name, Change change)
    {
        Json json = read_json(dir_ / name);
        change(json);
        write_text(dir_ / name, json.dump());
    }

    // Runs the program; its exit code, and what it wrote.
    int run_program(const std::string &arguments, std::string &out, std::string &err) const
    {
        const std::string command = std::string(OUTCROP_EVAL_PROGRAM) + " " + arguments + " >" +
                                    (root_ / "out").string() + " 2>" + (root_ / "err").string();
        const int status = std::system(command.c_str());
        out = read_text(root_ / "out");
        err = read_text(root_ / "err");
        return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
    }

    fs::path root_, site_, dir_;
    Notes notes_;
};

void expect_perfect(const ordered_json &r)
{
    SCOPED_TRACE(r.dump(1));
    EXPECT_GT(r["matches"]["n"], 20);
    EXPECT_EQ(r["matches"]["precision"], 1.0);
    EXPECT_GT(r["ground"]["n"], 100);
    EXPECT_EQ(r["ground"]["precision"], 1.0);
    EXPECT_EQ(r["ground"]["recall"], 1.0);
    for (const auto &box : r["boxes"]) {
        EXPECT_NEAR(box["iou"], 1, 1e-9);
        EXPECT_NEAR(box["obb_iou"], 1, 1e-9);
        EXPECT_LT(box["yaw_error_deg"].is_null() ? 0.0 : box["yaw_error_deg"].get<double>(), 1e-6);
        EXPECT_NEAR(box["centre_error_m"], 0, 1e-9);
        EXPECT_EQ(box["found"], box["truth"].get<int>() + kFoundOffset);
    }
    EXPECT_EQ(r["missed"], 0);
    EXPECT_EQ(r["false"], 0);
    EXPECT_EQ(r["voxels"].size(), r["boxes"].size());
    for (const auto &v : r["voxels"]) {
        EXPECT_EQ(v["iou"], 1.0);
        EXPECT_NEAR(v["chamfer_m"], 0, 1e-6);
    }
    EXPECT_NEAR(r["poses"]["position_rmse_m"], 0, 1e-9);
    EXPECT_NEAR(r["poses"]["angle_rmse_deg"], 0, 1e-5);
    const auto &s = r["sequence"]["boxes"];
    EXPECT_EQ(s["psnr_db"], kIdenticalDb);
    EXPECT_NEAR(s["ssim"], 1, 1e-9);
    EXPECT_EQ(s["psnr_obstacle_db"], kIdenticalDb);
    EXPECT_EQ(s["psnr_ground_db"], s["psnr_ground_limit_db"]);
    EXPECT_EQ(s["mask_iou"], 1.0);
    EXPECT_EQ(s["mask_iou_obstacle"], 1.0);
    EXPECT_EQ(s["flicker"], s["flicker_truth"]);
    EXPECT_EQ(r["footprint"]["covered"], 1.0);
    EXPECT_EQ(r["footprint"]["false_free_m2"], 0.0);
    EXPECT_EQ(r["footprint"]["free_recall"], 1.0);
    EXPECT_EQ(r["bytes"]["total"], 300);
}

TEST_F(EvalRun, PerfectScoresOneEverywhere)
{
    const ordered_json r = judge();
    expect_perfect(r);
    EXPECT_EQ(r["boxes"].size(), 2u);
    EXPECT_THAT(notes_, testing::IsEmpty());
    // The overhead is the ground's own texture, so the true frames nearly reach it.
    EXPECT_GT(r["sequence"]["boxes"]["psnr_ground_limit_db"], 40);
    EXPECT_LT(r["sequence"]["boxes"]["flicker_truth"], 2);
}

TEST_F(EvalRun, HullOfTrueMasksHoldsTheObstacle)
{
    for (const auto &h : judge()["hull"]) {
        EXPECT_GT(h["iou"], 0.3);
        EXPECT_LE(h["iou"], 1);
    }
}

TEST_F(EvalRun, AWrongMatchIsCountedWrong)
{
    const ordered_json before = judge();
    edit("matches.json", [](Json &json) {
        int moved = 0;
        for (Json &match : json["pairs"][0]["matches"]) {
            if (match["kind"] != "obstacle" || moved == 2) continue;
            // 2.9 px is still right, 3.1 px is not.
            match["right"][0] = match["right"][0].get<double>() + (moved == 0 ? 2.9 : 9.0);
            moved++;
        }
        ASSERT_EQ(moved, 2);
    });
    const ordered_json after = judge();
    EXPECT_EQ(after["matches"]["n"], before["matches"]["n"]);
    EXPECT_EQ(after["matches"]["correct"], before["matches"]["correct"].get<int>() - 1);
}

TEST_F(EvalRun, AMatchOntoAHiddenPointIsWrong)
{
    // Ground points that one view sees, put where they would be in another:
    // wrong where a block fills that place and 6 px round it, right where the
    // ground is.
    Notes notes;
    const Truth truth = read_truth(site_, notes);
    const cv::Mat &mask = truth.depth[3]->mask;
    int hidden = 0, seen = 0;
    for (int i = -55; i <= 55; i++) {
        for (int j = -55; j <= 55; j++) {
            const Eigen::Vector3d p(0.01 * i, 0.01 * j, 0);
            const auto left = truth.views[0].project(p), right = truth.views[3].project(p);
            if (!truth.views[0].inside(left->pixel) || !truth.views[3].inside(right->pixel)) continue;
            if (!is_visible(*truth.depth[0], *left) || !is_true_ground(*truth.depth[0], left->pixel)) continue;
            const cv::Point at(cvRound(right->pixel.x()), cvRound(right->pixel.y()));
            const cv::Mat round = mask(cv::Rect(at - cv::Point(6, 6), cv::Size(13, 13)) & cv::Rect({}, mask.size()));
            const bool is_hidden = cv::countNonZero(round) == static_cast<int>(round.total());
            if (!is_hidden && cv::countNonZero(round) > 0) continue; // near an outline
            const auto verdict = is_correct({0, 3, left->pixel, right->pixel, Label::kGround}, truth);
            EXPECT_EQ(*verdict, !is_hidden) << p.transpose();
            (is_hidden ? hidden : seen)++;
        }
    }
    EXPECT_GT(hidden, 20);
    EXPECT_GT(seen, 20);
}

TEST_F(EvalRun, GroundLabelsAreHeldAgainstTheMask)
{
    const ordered_json before = judge();
    edit("vehicle/junctions.json", [](Json &json) {
        int obstacle = 0, ground = 0;
        for (Json &j : json["views"][1]["junctions"]) {
            if (j["label"] == "obstacle" && obstacle++ < 3)
                j["label"] = "ground";
            else if (j["label"] == "ground" && ground++ < 10)
                j["label"] = "unknown";
        }
    });
    const ordered_json after = judge();
    const int n = before["ground"]["n"];
    EXPECT_EQ(after["ground"]["n"], n + 3 - 10);
    EXPECT_EQ(after["ground"]["correct"], n - 10);
    EXPECT_EQ(before["ground"]["obstacle_as_ground"], 0.0);
    EXPECT_GT(after["ground"]["obstacle_as_ground"], 0.0);
    EXPECT_LT(after["ground"]["recall"], 1.0);
    EXPECT_GT(after["ground"]["recall"], 1.0 - 11.0 / n * 4);
}

TEST_F(EvalRun, GroundFallsBackToMatchesWithoutRecall)
{
    fs::remove(dir_ / "vehicle/junctions.json");
    const ordered_json r = judge();
    EXPECT_GT(r["ground"]["n"], 20);
    EXPECT_EQ(r["ground"]["precision"], 1.0);
    EXPECT_TRUE(r["ground"]["recall"].is_null());
    EXPECT_THAT(notes_, Contains(HasSubstr("junctions.json is not there")));
}

TEST_F(EvalRun, BoxesAreMissedFalseAndDuplicate)
{
    edit("model/obstacles.json", [](Json &json) {
        Json away = json["obstacles"][0], fragment = json["obstacles"][1];
        away["index"] = 77;
        away["aabb_min"] = {0.4, 0.4, 0.0};
        away["aabb_max"] = {0.5, 0.5, 0.1};
        fragment["index"] = 78;
        for (int i = 0; i < 2; i++) // an eightieth of the box, well inside
            fragment["aabb_max"][i] = fragment["aabb_min"][i].get<double>() + 0.02;
        json["obstacles"][0] = away; // the straight block has none any more
        json["obstacles"].push_back(fragment);
    });
    const ordered_json r = judge();
    EXPECT_EQ(r["missed"], 1);
    EXPECT_EQ(r["missed_truths"], ordered_json({1}));
    EXPECT_EQ(r["false"], 1);
    EXPECT_EQ(r["false_boxes"], ordered_json({77}));
    EXPECT_EQ(r["duplicates"], ordered_json({78}));
    EXPECT_EQ(r["boxes"][0]["iou"], 0.0);
    EXPECT_TRUE(r["boxes"][0]["found"].is_null());
    EXPECT_TRUE(r["boxes"][0]["centre_error_m"].is_null());
    EXPECT_NEAR(r["boxes"][1]["iou"], 1, 1e-9);
    // The lost block is not drawn under its number: half of the obstacles score nothing.
    EXPECT_NEAR(r["sequence"]["boxes"]["mask_iou_obstacle"], 0.5, 1e-9);
}

TEST_F(EvalRun, PoseErrorsAreThePlantedOnes)
{
    edit("model/cameras.json", [](Json &json) {
        // Every camera 30 mm up and turned about its own optical axis by 2 degrees.
        const double a = 2 * M_PI / 180;
        for (Json &view : json["views"]) {
            Eigen::Matrix3d r;
            for (int i = 0; i < 3; i++)
                for (int k = 0; k < 3; k++) r(i, k) = view["R"][i][k];
            Eigen::Vector3d t(view["t"][0], view["t"][1], view["t"][2]);
            const Eigen::Vector3d centre = -r.transpose() * t + Eigen::Vector3d(0, 0, 30);
            r = Eigen::AngleAxisd(a, Eigen::Vector3d::UnitZ()).toRotationMatrix() * r;
            t = -r * centre;
            for (int i = 0; i < 3; i++) {
                view["t"][i] = t[i];
                for (int k = 0; k < 3; k++) view["R"][i][k] = r(i, k);
            }
        }
    });
    const ordered_json r = judge();
    EXPECT_NEAR(r["poses"]["position_rmse_m"], 0.030, 1e-9);
    EXPECT_NEAR(r["poses"]["angle_rmse_deg"], 2, 1e-6);
    EXPECT_EQ(r["poses"]["n"], 4);
}

TEST_F(EvalRun, PosesOfNumberedViewsArePairedByIndex)
{
    edit("model/cameras.json", [](Json &json) {
        json["views"].erase(0);
        for (int i = 0; i < 3; i++) json["views"][i]["image"] = "view_" + std::to_string(i + 1);
    });
    ordered_json r = judge();
    EXPECT_EQ(r["poses"]["n"], 3);
    EXPECT_NEAR(r["poses"]["position_rmse_m"], 0, 1e-9);
    edit("model/cameras.json", [](Json &json) {
        for (Json &view : json["views"]) view["image"] = "view_9";
    });
    r = judge();
    EXPECT_TRUE(r["poses"].is_null());
    EXPECT_THAT(notes_, Contains(HasSubstr("poses is null: no view")));
}

TEST_F(EvalRun, AllFreeGroundUncoversTheFootprint)
{
    const cv::Mat codes = cv::imread((dir_ / "model/ground.png").string(), cv::IMREAD_UNCHANGED);
    cv::imwrite((dir_ / "model/ground.png").string(), cv::Mat(codes.size(), CV_8U, cv::Scalar(1)));
    ordered_json r = judge();
    EXPECT_EQ(r["footprint"]["covered"], 0.0);
    // Both blocks without a rim of one to two cells of 3 mm.
    const double full = 0.20 * 0.30 + 0.30 * 0.16, rim = 2 * (0.20 + 0.30 + 0.30 + 0.16) * 0.003;
    EXPECT_LT(r["footprint"]["false_free_m2"], full - 0.5 * rim);
    EXPECT_GT(r["footprint"]["false_free_m2"], full - 2.5 * rim);
    EXPECT_EQ(r["footprint"]["free_recall"], 1.0);
    cv::imwrite((dir_ / "model/ground.png").string(), cv::Mat(codes.size(), CV_8U, cv::Scalar(0)));
    r = judge();
    EXPECT_EQ(r["footprint"]["covered"], 1.0);
    EXPECT_EQ(r["footprint"]["free_recall"], 0.0);
}

TEST_F(EvalRun, WorseFramesScoreWhatTheFormulaSays)
{
    for (int i = 0; i < 3; i++) {
        const std::string number = "0" + std::to_string(i) + ".png", folder = (dir_ / "sequence/boxes").string();
        const cv::Mat frame = cv::imread(folder + "/frame_" + number) / 2;
        cv::imwrite(folder + "/frame_" + number, frame + 40);
        cv::Mat mask = cv::imread(folder + "/mask_" + number, cv::IMREAD_UNCHANGED);
        mask.setTo(0, mask == 1 + kFoundOffset);
        cv::imwrite(folder + "/mask_" + number, mask);
    }
    const ordered_json s = judge()["sequence"]["boxes"];
    EXPECT_LT(s["psnr_db"], 30);
    EXPECT_LT(s["ssim"], 0.99);
    EXPECT_LT(s["mask_iou"], 0.8);
    EXPECT_EQ(s["mask_iou_obstacle"], 0.5);
    EXPECT_LT(s["psnr_ground_db"], s["psnr_ground_limit_db"].get<double>() - 5);
    EXPECT_NEAR(s["flicker"], s["flicker_truth"].get<double>() / 2, 0.5);
}

TEST_F(EvalRun, FramesOfAnotherPathAreNull)
{
    fs::remove(dir_ / "sequence/boxes/frame_02.png");
    const ordered_json r = judge();
    EXPECT_TRUE(r["sequence"]["boxes"].is_null());
    EXPECT_THAT(notes_, Contains(HasSubstr("sequence.boxes is null")));
}

TEST_F(EvalRun, FramesOfAnotherSizeAreNull)
{
    cv::imwrite((dir_ / "sequence/boxes/frame_01.png").string(), cv::Mat(50, 50, CV_8UC3, cv::Scalar(0)));
    EXPECT_TRUE(judge()["sequence"]["boxes"].is_null());
    EXPECT_THAT(notes_, Contains(HasSubstr("not of the path's size")));
}

TEST_F(EvalRun, EveryAbsentFileIsNullAndNoted)
{
    const std::pair<const char *, const char *> cases[] = {
        {"matches.json", "matches"},        {"model/obstacles.json", "boxes"}, {"model/obstacles.json", "missed"},
        {"model/obstacles.json", "false"},  {"model/cameras.json", "poses"},   {"model/ground.png", "footprint"},
        {"model/ground.json", "footprint"}, {"report.json", "bytes"},          {"sequence", "sequence"}};
    for (const auto &[file, key] : cases) {
        fs::rename(dir_ / file, root_ / "aside");
        const ordered_json r = judge();
        EXPECT_TRUE(r.contains(key) && r[key].is_null()) << key;
        EXPECT_THAT(notes_, Contains(HasSubstr((dir_ / file).string()))) << file;
        fs::rename(root_ / "aside", dir_ / file);
    }
}

TEST_F(EvalRun, ASiteWithoutTruthLeavesAllButPosesAndBytesNull)
{
    for (const char *name : {"depth", "obstacles", "obstacles.json", "path", "path.json", "overhead.json"})
        fs::remove_all(site_ / name);
    const ordered_json r = judge();
    for (const char *key : {"matches", "ground", "boxes", "missed", "false", "voxels", "hull", "sequence", "footprint"})
        EXPECT_TRUE(r.contains(key) && r[key].is_null()) << key;
    EXPECT_FALSE(r["poses"].is_null());
    EXPECT_FALSE(r["bytes"].is_null());
    EXPECT_GE(notes_.size(), 3u);
}

TEST_F(EvalRun, JpegCopiesOfASiteStillGiveTheirFrames)
{
    for (int i = 0; i < 3; i++) {
        const fs::path frame = site_ / ("path/frame_0" + std::to_string(i) + ".png");
        cv::imwrite(fs::path(frame).replace_extension(".jpg").string(), cv::imread(frame.string()));
        fs::remove(frame);
    }
    const ordered_json s = judge()["sequence"]["boxes"];
    EXPECT_GT(s["psnr_db"], 25);
    EXPECT_LT(s["psnr_db"], kIdenticalDb);
    EXPECT_EQ(s["mask_iou"], 1.0);
}

TEST_F(EvalRun, ProgramPrintsJsonAndATable)
{
    std::string out, err;
    const std::string folders = site_.string() + " " + dir_.string();
    EXPECT_EQ(run_program(folders + " --json", out, err), 0);
    EXPECT_EQ(err, "");
    expect_perfect(ordered_json::parse(out));
    EXPECT_EQ(run_program(folders, out, err), 0);
    EXPECT_THAT(out, HasSubstr("missed 0, false 0"));
    EXPECT_EQ(run_program("--help", out, err), 0);
    EXPECT_THAT(out, HasSubstr("IoU > 0.3"));
}

TEST_F(EvalRun, ProgramSaysNullWithANoteAndExitsZero)
{
    std::string out, err;
    fs::remove(dir_ / "model/cameras.json");
    EXPECT_EQ(run_program(site_.string() + " " + dir_.string() + " --json", out, err), 0);
    EXPECT_TRUE(ordered_json::parse(out)["poses"].is_null());
    EXPECT_THAT(err, HasSubstr("model/cameras.json is not there: poses is null"));
    EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1);
}

TEST_F(EvalRun, ProgramTellsBadFilesFromBadUsage)
{
    std::string out, err;
    const std::string folders = site_.string() + " " + dir_.string();
    EXPECT_EQ(run_program("", out, err), 2);
    EXPECT_EQ(run_program(folders + " --xml", out, err), 2);
    EXPECT_EQ(run_program(site_.string() + " " + (root_ / "nowhere").string(), out, err), 1);
    EXPECT_THAT(err, HasSubstr("nowhere: not a run's folder"));

    const std::pair<const char *, const char *> cases[] = {
        {"matches.json", "{\"pairs\":[{]"},
        {"matches.json", R"({"pairs":[{"left":0,"right":9,"matches":[]}]})"},
        {"matches.json", R"({"pairs":[{"left":0,"right":1,"matches":[{"left":[1],"right":[1,2],"kind":"ground"}]}]})"},
        {"matches.json", R"([])"},
        {"model/obstacles.json", R"({"units":"m","obstacles":[{"index":1,"aabb_min":[0,0,0]}]})"},
        {"model/obstacles.json", ""},
        {"model/ground.json", R"({"metres_per_pixel":0})"},
        {"model/ground.png", "no image"},
        {"sequence/boxes/frame_01.png", "no image"},
        {"report.json", R"({"bytes":3})"},
        {"model/11.voxels.ply", "ply\nformat ascii 1.0\nelement vertex 9\nproperty float x\nend_header\n1\n"},
        {"vehicle/junctions.json", R"({"views":[{"view":0,"junctions":[{"x":1,"y":1,"label":"sky"}]}]})"},
        {"model/cameras.json", R"({"views":[]})"}};
    for (const auto &[file, text] : cases) {
        const std::string kept = read_text(dir_ / file);
        write_text(dir_ / file, text);
        EXPECT_EQ(run_program(folders + " --json", out, err), 1) << file << text;
        EXPECT_EQ(out, "");
        EXPECT_THAT(err, HasSubstr((dir_ / file).string() + ": ")) << text;
        EXPECT_EQ(std::count(err.begin(), err.end(), '\n'), 1) << err;
        write_text(dir_ / file, kept);
    }
}

// The copies of the real sites: a perfect run scores 1 on them too.
class EvalSite : public testing::TestWithParam<const char *> {};

TEST_P(EvalSite, PerfectScoresOneEverywhere)
{
    const fs::path site = fs::path(OUTCROP_TEST_DATA) / "sites" / GetParam();
    const fs::path dir = fs::path(testing::TempDir()) / ("outcrop_eval_site_" + std::string(GetParam()));
    fs::remove_all(dir);
    Notes notes;
    write_perfect_run(read_truth(site, notes), dir);
    EXPECT_THAT(notes, testing::IsEmpty());
    expect_perfect(to_json(evaluate(site, dir, notes)));
    EXPECT_THAT(notes, testing::IsEmpty());
    fs::remove_all(dir);
}

INSTANTIATE_TEST_SUITE_P(Copies, EvalSite, testing::Values("depot", "two_obstacles"));

} // namespace
} // namespace outcrop::eval
