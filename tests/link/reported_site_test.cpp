// SPDX-License-Identifier: BSD-3-Clause
// What the vehicle's sensors are made to report: chosen views with their own numbers, poses moved inside the margins.
#include "reported_site.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "core/camera.h"

namespace outcrop {
namespace {

using json = nlohmann::json;

constexpr double kPi = 3.14159265358979323846;
const std::string kSite = OUTCROP_TEST_DATA "/sites/two_obstacles";

json read_json(const std::string &file)
{
    std::ifstream in(file);
    return json::parse(in);
}

oc_pose_t pose_of(const json &view)
{
    oc_pose_t pose;
    for (std::size_t i = 0; i < 9; i++) pose.R[i] = view["R"][i / 3][i % 3].get<double>();
    for (std::size_t i = 0; i < 3; i++) pose.t[i] = view["t"][i].get<double>() * 1e-3;
    return pose;
}

class ReportedSiteTest : public testing::Test {
protected:
    ReportedSiteTest()
    {
        char name[] = "/tmp/outcrop_reported_XXXXXX";
        dir_ = mkdtemp(name);
        options_.site = kSite;
    }
    ~ReportedSiteTest() override { std::filesystem::remove_all(dir_); }

    json reported()
    {
        site_ = write_reported_site(options_, dir_ + "/cameras.json");
        return read_json(dir_ + "/cameras.json");
    }

    std::string dir_;
    ReportedSiteOptions options_;
    ReportedSite site_;
};

TEST_F(ReportedSiteTest, keeps_everything_when_nothing_is_asked_for)
{
    const json truth = read_json(kSite + "/cameras.json"), out = reported();
    ASSERT_EQ(out["views"].size(), truth["views"].size());
    for (std::size_t i = 0; i < out["views"].size(); i++) {
        const json &a = truth["views"][i], &b = out["views"][i];
        EXPECT_EQ(a["R"], b["R"]);
        EXPECT_EQ(a["t"], b["t"]);
        EXPECT_EQ(b["index"], i);
        EXPECT_TRUE(std::filesystem::exists(b["image"].get<std::string>()));
    }
    EXPECT_EQ(out["area"], truth["area"]);
    EXPECT_EQ(site_.path_file, std::filesystem::absolute(kSite + "/path.json").string());
}

TEST_F(ReportedSiteTest, chosen_views_keep_their_numbers)
{
    options_.views = {5, 0, 2, 2};
    const json out = reported();
    ASSERT_EQ(out["views"].size(), 3u);
    EXPECT_EQ(out["views"][0]["index"], 0);
    EXPECT_EQ(out["views"][1]["index"], 2);
    EXPECT_EQ(out["views"][2]["index"], 5);
    options_.views = {0, 8};
    EXPECT_THROW(reported(), std::runtime_error);
    options_.views = {-1};
    EXPECT_THROW(reported(), std::runtime_error);
}

// Every kind, many seeds: each of the six parameters stays inside its margin, and moves.
TEST_F(ReportedSiteTest, moves_poses_inside_the_margins)
{
    const json truth = read_json(kSite + "/cameras.json");
    const double limit[2] = {0.010, kPi / 180};
    for (const char *kind : {"independent", "drift", "mount", "height"}) {
        double greatest[2] = {0, 0};
        for (unsigned seed = 1; seed <= 20; seed++) {
            SCOPED_TRACE(std::string(kind) + ", seed " + std::to_string(seed));
            options_.perturbation = parse_perturbation(std::to_string(seed) + ":" + kind);
            const json out = reported();
            for (std::size_t v = 0; v < out["views"].size(); v++) {
                const oc_pose_t was = pose_of(truth["views"][v]), is = pose_of(out["views"][v]);
                ASSERT_TRUE(oc_pose_is_valid(&is));
                oc_pose6_t a, b;
                oc_pose_to_6(&was, &a);
                oc_pose_to_6(&is, &b);
                for (int i = 0; i < 6; i++) {
                    double moved = std::abs(a.v[i] - b.v[i]);
                    if (i >= 3) moved = std::min(moved, 2 * kPi - moved);
                    EXPECT_LE(moved, limit[i / 3] * (1 + 1e-9)) << "view " << v << ", parameter " << i;
                    greatest[i / 3] = std::max(greatest[i / 3], moved);
                }
            }
        }
        EXPECT_GT(greatest[0], 0.5 * limit[0]) << kind;
        if (std::string(kind) == "height") {
            EXPECT_LT(greatest[1], 1e-9);
        } else {
            EXPECT_GT(greatest[1], 0.3 * limit[1]) << kind;
        }
    }
}

TEST_F(ReportedSiteTest, the_same_seed_moves_alike_and_another_does_not)
{
    options_.perturbation = parse_perturbation("7");
    const json first = reported(), second = reported();
    EXPECT_EQ(first, second);
    options_.perturbation = parse_perturbation("8");
    EXPECT_NE(first, reported());
}

TEST(ParsePerturbation, takes_a_seed_and_a_kind)
{
    EXPECT_EQ(parse_perturbation("12").seed, 12u);
    EXPECT_EQ(parse_perturbation("12").kind, "independent");
    EXPECT_EQ(parse_perturbation("3:drift").kind, "drift");
    for (const char *text : {"", "x", "-1", "1:", "1:up", ":drift", "1.5", "9999999999", "1:drift:2"})
        EXPECT_THROW(parse_perturbation(text), std::runtime_error) << text;
}

TEST_F(ReportedSiteTest, names_file_and_fault_of_a_bad_site)
{
    const auto fault_of = [&](const std::string &text) -> std::string {
        std::ofstream(dir_ + "/bad.json") << text;
        options_.site = dir_ + "/bad.json";
        try {
            reported();
        } catch (const std::runtime_error &fault) {
            return fault.what();
        }
        return "none";
    };
    for (const char *text : {"", "{", "[]", "{}", "{\"units\": \"m\"}", "{\"units\": \"m\", \"views\": [{}]}",
                             "{\"units\": \"m\", \"views\": []}", "{\"units\": 3, \"views\": [{}, {}]}"}) {
        const std::string fault = fault_of(text);
        EXPECT_EQ(fault.rfind(dir_ + "/bad.json", 0), 0u) << text << " gives: " << fault;
        EXPECT_EQ(fault.find('\n'), std::string::npos) << fault;
    }
}

} // namespace
} // namespace outcrop
