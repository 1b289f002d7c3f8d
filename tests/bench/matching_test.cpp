// SPDX-License-Identifier: BSD-3-Clause
// The bench of matches: its counts, its rivals' bookkeeping, and its program at the door.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include <gtest/gtest.h>

#include "bench/matching/boxes_of_points.h"
#include "bench/matching/judge.h"
#include "bench/matching/losses.h"
#include "bench/matching/poses.h"
#include "bench/matching/rivals.h"
#include "bench/matching/steps.h"
#include "bench/matching/wide.h"

namespace outcrop::bench {
namespace {

namespace fs = std::filesystem;

std::string site(const char *name)
{
    return std::string(OUTCROP_TEST_DATA) + "/sites/" + name;
}

double binomial_tail(int n, int at_least, double p)
{
    double sum = 0;
    for (int k = at_least; k <= n; k++)
        sum += std::exp(std::lgamma(n + 1.0) - std::lgamma(k + 1.0) - std::lgamma(n - k + 1.0) + k * std::log(p) +
                        (n - k) * std::log1p(-p));
    return sum;
}

TEST(Wilson, HoldsTheTrueShareAboutAsOftenAsItSays)
{
    // By the binomial's own sums: the share of outcomes whose interval holds p.
    for (const int n : {20, 100, 500}) {
        for (const double p : {0.3, 0.8, 0.95}) {
            double held = 0;
            for (int k = 0; k <= n; k++) {
                const Interval i = wilson(k, n);
                EXPECT_LE(i.low, static_cast<double>(k) / n + 1e-12);
                EXPECT_GE(i.high, static_cast<double>(k) / n - 1e-12);
                if (i.low <= p && p <= i.high) held += binomial_tail(n, k, p) - binomial_tail(n, k + 1, p);
            }
            EXPECT_GT(held, 0.90) << n << " " << p;
            EXPECT_LT(held, 0.99) << n << " " << p;
        }
    }
    EXPECT_EQ(wilson(0, 0).low, 0);
    EXPECT_EQ(wilson(0, 0).high, 1);
}

TEST(Quantile, IsTheOneOfTheSortedValues)
{
    EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 0.5), 3);
    EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 1), 5);
    EXPECT_EQ(quantile({5, 1, 4, 2, 3}, 0), 1);
    EXPECT_TRUE(std::isnan(quantile({}, 0.5)));
}

TEST(WithoutRepeats, KeepsTheSurestOfOnePlaceInBothViews)
{
    const PixelMatch a = {0, 1, {10, 10}, {50, 50}, MatchKind::kObstacle, 0.8};
    PixelMatch again = a, elsewhere = a, other_pair = a;
    again.left_px += Eigen::Vector2d(1, 1);
    again.score = 0.9;
    elsewhere.right_px += Eigen::Vector2d(9, 0);
    other_pair.right_view = 2;
    const auto kept = without_repeats({a, again, elsewhere, other_pair});
    ASSERT_EQ(kept.size(), 3U);
    EXPECT_EQ(kept[0].score, 0.9);
}

TEST(Describe, SharesItsPlacesOutOverThePicture)
{
    // The left half so rich that it alone could fill every place.
    cv::Mat1b grey(480, 640, 128);
    cv::RNG rng(1);
    cv::Mat left = grey(cv::Rect(0, 0, 320, 480)), right = grey(cv::Rect(320, 0, 320, 480));
    rng.fill(left, cv::RNG::UNIFORM, 0, 256);
    rng.fill(right, cv::RNG::UNIFORM, 64, 192);
    const Described d = describe(Feature::kSift, grey);
    EXPECT_LE(d.points.size(), kMostPoints);
    EXPECT_EQ(d.descriptors.rows, static_cast<int>(d.points.size()));
    int n_right = 0;
    for (const cv::KeyPoint &p : d.points) n_right += p.pt.x > 320;
    EXPECT_GT(n_right, 0);
}

// The whole way on a site of the tests: a rival in the same strips, counted by the same rule.
TEST(MeasureWide, CountsOursAndARivalOnTheSameSite)
{
    const SiteCase known = load_site_case({site("two_obstacles"), "", "1"});
    ASSERT_EQ(known.views.size(), known.pictures.size());
    WideOptions options;
    options.features = {Feature::kSift};
    options.ratios = {0.6, 0.8};
    Descriptions descriptions;
    const WideCase one = measure_wide(known, known, options, &descriptions);
    EXPECT_GT(one.n_pairs, 0);
    const MatchCount &ours = one.counts.at("ours");
    EXPECT_GT(ours.correct, 0);
    EXPECT_EQ(ours.correct, one.counts.at("ours, every junction").correct); // the same case was given for both
    const MatchCount &strict = one.counts.at("SIFT + ratio 0.60"), &usual = one.counts.at("SIFT + ratio 0.80");
    EXPECT_GT(strict.n, 0);
    EXPECT_GT(usual.n, strict.n);
    for (const auto &[name, count] : one.counts) {
        EXPECT_LE(count.correct, count.n) << name;
        EXPECT_LE(count.correct_on_obstacle, count.correct) << name;
    }
    const auto &losses = one.json["losses"];
    EXPECT_GE(losses["visible"], losses["detected"]);
    EXPECT_GE(losses["detected"], losses["candidate"]);
    EXPECT_GE(losses["correlated"], losses["alike"]);
    EXPECT_GE(losses["alike"], losses["best"]);

    const auto sums = sum_wide("twice", {one, one}, options);
    EXPECT_EQ(sums["pairs"], 2 * one.n_pairs);
    EXPECT_DOUBLE_EQ(sums["ratios"][0]["ours_over_rival"],
                     static_cast<double>(ours.correct_on_obstacle) / usual.correct_on_obstacle);
}

TEST(MeasurePoses, OursIsNearerToTheTruthThanTheSensor)
{
    const SiteCase known = load_site_case({site("two_obstacles"), "", "2"});
    PoseCase poses = measure_poses(known);
    const double sensor = quantile(poses.by_source["sensor"].epipolar_px, 0.5);
    EXPECT_GT(sensor, 1);
    EXPECT_LT(quantile(poses.by_source["ours"].epipolar_px, 0.5), sensor / 3);
    EXPECT_LT(quantile(poses.by_source["ours"].ground_transfer_px, 0.5), 1);
    EXPECT_LE(quantile(poses.ours_aligned_m, 0.5), quantile(poses.sensor_aligned_m, 0.5));
}

TEST(Steps, TheFirstIsTheProductAndOthersChangeTheModel)
{
    const SiteCase known = load_site_case({site("two_obstacles"), "", "1"});
    const auto all = steps(0.15);
    const SiteModel ours = build_step(known, all.front());
    const SiteModel product = build_site(known.views, known.area);
    EXPECT_EQ(ours.counts, product.counts);
    for (std::size_t i = 1; i < all.size(); i++) {
        const SiteModel other = build_step(known, all[i]);
        bool is_same = other.points.size() == ours.points.size() && other.obstacles.size() == ours.obstacles.size() &&
                       other.counts.at("t_m_m") == ours.counts.at("t_m_m");
        for (std::size_t k = 0; is_same && k < ours.obstacles.size(); k++)
            is_same = other.obstacles[k].aabb_max == ours.obstacles[k].aabb_max;
        // Strips that are narrow already and two obstacles far apart may come to the same either way.
        if (all[i].name == "strip" || all[i].name == "clusters") continue;
        EXPECT_FALSE(is_same) << all[i].name;
    }
}

TEST(JudgePoints, PointsOfTheTrueSurfacesGiveTheTrueBoxes)
{
    eval::Notes notes;
    const eval::Truth truth = eval::read_truth(site("two_obstacles"), notes);
    const fs::path file = fs::temp_directory_path() / ("outcrop_points_" + std::to_string(getpid()) + ".txt");
    std::ofstream out(file);
    for (const eval::TrueObstacle &o : *truth.obstacles)
        for (const Eigen::Vector3d &v : o.mesh.vertices) out << v.transpose() << " 3\n";
    out.close();
    const auto judged = judge_points(site("two_obstacles"), file.string());
    EXPECT_EQ(judged["missed"], 0);
    EXPECT_EQ(judged["false"], 0);
    std::ofstream(file, std::ios::app) << "one two three\n";
    EXPECT_THROW(judge_points(site("two_obstacles"), file.string()), std::runtime_error);
    fs::remove(file);
    EXPECT_THROW(judge_points(site("two_obstacles"), file.string()), std::runtime_error);
}

TEST(Program, SaysWhatIsMissing)
{
    const std::string program = OUTCROP_MATCHING_PROGRAM;
    EXPECT_NE(std::system((program + " >/dev/null 2>&1").c_str()), 0);
    EXPECT_NE(std::system((program + " --sites /nowhere --parts nothing >/dev/null 2>&1").c_str()), 0);
    EXPECT_NE(std::system((program + " points /nowhere /nowhere >/dev/null 2>&1").c_str()), 0);
    EXPECT_EQ(std::system((program + " --sites /nowhere --json /dev/null >/dev/null 2>&1").c_str()), 0);
}

} // namespace
} // namespace outcrop::bench
