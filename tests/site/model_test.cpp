// SPDX-License-Identifier: BSD-3-Clause
// From views to boxes without pixels: matches are made up, everything after them is the real thing.
#include "site/model.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <random>

#include <gtest/gtest.h>

#include "site/ground_map.h"
#include "synthetic_site.h"

namespace outcrop {
namespace {

using Eigen::Vector3d;
using namespace synthetic;

constexpr unsigned kSeed = 79;
const Area kArea{-0.65, 0.95, -0.65, 1.0, 0.3};
const oc_margin_t kMargin = margin_of(0.010, 1.0 * kDegree);

struct Block {
    Vector3d low, high;
};
// As far apart as the thesis' two obstacles.
const std::vector<Block> kBlocks = {{{-0.02, -0.19, 0}, {0.17, -0.05, 0.19}}, {{0.2, 0.25, 0}, {0.36, 0.39, 0.11}}};

std::vector<Corner> blocks_on_ground(std::mt19937 *rng)
{
    std::vector<Corner> corners = random_corners(60, 0, rng);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (std::size_t b = 0; b < kBlocks.size(); ++b) {
        const auto add = [&](double u, double v, double w) {
            const Vector3d size = kBlocks[b].high - kBlocks[b].low;
            corners.push_back({kBlocks[b].low + Vector3d(u, v, w).cwiseProduct(size), false, static_cast<int>(b)});
        };
        for (const double u : {0.0, 1.0})
            for (const double v : {0.0, 1.0})
                for (const double w : {0.3, 0.65, 1.0}) add(u, v, w);
        for (int i = 0; i < 25; ++i) add(uniform(*rng), uniform(*rng), 0.2 + 0.8 * uniform(*rng));
    }
    return corners;
}

struct Site {
    Scene scene;
    std::vector<PairMatches> matches;
};

Site make_site(unsigned seed, const oc_margin_t &margin, double wrong_share)
{
    std::mt19937 rng(seed);
    Site site;
    site.scene = make_scene(blocks_on_ground(&rng), margin, 0.4, &rng);
    site.matches = make_matches(site.scene, wrong_share, 40, &rng);
    return site;
}

SiteModel build(const Site &site, const BuildOptions &options = {})
{
    return build_from_matches(
        site.scene.views, kArea, [&](const MatchPass &) { return site.matches; }, options);
}

void expect_blocks(const SiteModel &model, double least_iou)
{
    ASSERT_EQ(model.obstacles.size(), kBlocks.size());
    for (const Block &block : kBlocks) {
        double best = 0;
        for (const Obstacle &box : model.obstacles)
            best = std::max(best, aabb_iou(block.low, block.high, box.aabb_min, box.aabb_max));
        EXPECT_GT(best, least_iou);
    }
}

bool same_bits(const SiteModel &a, const SiteModel &b)
{
    if (a.views.size() != b.views.size() || a.points.size() != b.points.size() ||
        a.obstacles.size() != b.obstacles.size() || a.pairs.size() != b.pairs.size() || a.counts != b.counts)
        return false;
    for (std::size_t i = 0; i < a.views.size(); ++i)
        if (a.views[i].id != b.views[i].id ||
            std::memcmp(&a.views[i].camera, &b.views[i].camera, sizeof(oc_camera_t)) != 0)
            return false;
    for (std::size_t i = 0; i < a.points.size(); ++i)
        if (a.points[i].position != b.points[i].position || a.points[i].covariance != b.points[i].covariance ||
            a.points[i].obstacle != b.points[i].obstacle)
            return false;
    for (std::size_t i = 0; i < a.obstacles.size(); ++i)
        if (a.obstacles[i].aabb_min != b.obstacles[i].aabb_min || a.obstacles[i].yaw_rad != b.obstacles[i].yaw_rad)
            return false;
    return true;
}

TEST(BuildSite, boxes_both_blocks_with_exact_poses)
{
    const SiteModel model = build(make_site(kSeed, margin_of(0, 0), 0));
    expect_blocks(model, 0.8);
    EXPECT_TRUE(model.suspected.empty());
    EXPECT_GT(model.counts.at("ground_points"), 40);
    for (const SitePoint &p : model.points) EXPECT_GE(p.position.z(), 0.004);
}

TEST(BuildSite, boxes_both_blocks_with_poses_that_fill_their_margins)
{
    for (unsigned seed = kSeed; seed < kSeed + 3; ++seed) {
        const SiteModel model = build(make_site(seed, kMargin, 0.1));
        expect_blocks(model, 0.6);
        for (const RefinedView &view : model.views) EXPECT_TRUE(view.is_improved) << "seed " << seed;
    }
}

TEST(BuildSite, does_not_depend_on_the_order_of_views_and_matches)
{
    const Site site = make_site(kSeed, kMargin, 0.1);
    const SiteModel model = build(site);
    EXPECT_TRUE(same_bits(model, build(site)));
    Site turned = site;
    std::reverse(turned.scene.views.begin(), turned.scene.views.end());
    std::rotate(turned.matches.begin(), turned.matches.begin() + 5, turned.matches.end());
    EXPECT_TRUE(same_bits(model, build(turned)));
    EXPECT_FALSE(same_bits(model, build(make_site(kSeed + 1, kMargin, 0.1))));
}

TEST(BuildSite, gives_the_second_pass_better_poses_and_narrower_margins)
{
    const Site site = make_site(kSeed, kMargin, 0);
    std::vector<MatchPass> passes;
    build_from_matches(site.scene.views, kArea, [&](const MatchPass &pass) {
        passes.push_back(pass);
        return site.matches;
    });
    ASSERT_EQ(passes.size(), 2u);
    EXPECT_FALSE(passes[0].is_last);
    EXPECT_TRUE(passes[1].is_last);
    EXPECT_EQ(passes[1].angles, OC_ANGLE_ERROR_LOCAL);
    for (std::size_t v = 0; v < 8; ++v) {
        EXPECT_EQ(std::memcmp(&passes[0].views[v].camera, &site.scene.views[v].camera, sizeof(oc_camera_t)), 0);
        for (int k = 0; k < 6; ++k) EXPECT_LT(passes[1].views[v].margin.v[k], kMargin.v[k]);
    }
    std::size_t n_passes = 0;
    build_from_matches(make_site(kSeed, margin_of(0, 0), 0).scene.views, kArea, [&](const MatchPass &pass) {
        ++n_passes;
        EXPECT_TRUE(pass.is_last);
        return std::vector<PairMatches>();
    });
    EXPECT_EQ(n_passes, 1u) << "exact poses need no second pass";
}

TEST(BuildSite, keeps_only_matches_that_tracks_hold)
{
    const Site site = make_site(kSeed, margin_of(0, 0), 0.2);
    const SiteModel model = build(site);
    std::size_t n = 0, n_wrong = 0;
    for (const PairMatches &pair : model.pairs) {
        const std::size_t left = static_cast<std::size_t>(pair.left - 10) / 3;
        const std::size_t right = static_cast<std::size_t>(pair.right - 10) / 3;
        for (const Match &match : pair.matches) {
            ++n;
            n_wrong += site.scene.shown[left][static_cast<std::size_t>(match.left_junction)] !=
                       site.scene.shown[right][static_cast<std::size_t>(match.right_junction)];
        }
    }
    EXPECT_GT(n, 500u);
    EXPECT_LT(static_cast<double>(n_wrong), 0.03 * static_cast<double>(n));
}

TEST(BuildSite, answers_nothing_to_nothing_and_refuses_nonsense)
{
    const Matcher none = [](const MatchPass &) { return std::vector<PairMatches>(); };
    EXPECT_TRUE(build_from_matches({}, std::nullopt, none).views.empty());
    Site site = make_site(kSeed, kMargin, 0);
    const SiteModel one = build_from_matches({site.scene.views[0]}, kArea, none);
    EXPECT_EQ(one.views.size(), 1u);
    EXPECT_TRUE(one.points.empty());
    const SiteModel unmatched = build_from_matches(site.scene.views, kArea, none);
    EXPECT_TRUE(unmatched.obstacles.empty());
    EXPECT_EQ(std::memcmp(&unmatched.views[3].camera, &site.scene.views[3].camera, sizeof(oc_camera_t)), 0);
    std::vector<View> twice = site.scene.views;
    twice.push_back(twice[0]);
    EXPECT_THROW(build_from_matches(twice, kArea, none), std::invalid_argument);
    std::vector<View> bad = site.scene.views;
    bad[1].margin.v[2] = std::nan("");
    EXPECT_THROW(build_from_matches(bad, kArea, none), std::invalid_argument);
    EXPECT_THROW(build_from_matches(site.scene.views, Area{1, 0, 0, 1, 1}, none), std::invalid_argument);
}

TEST(DeriveArea, covers_what_two_views_share_and_no_more_than_a_sane_reach)
{
    const Scene scene = make_site(kSeed, margin_of(0, 0), 0).scene;
    const Area area = derive_area(scene.views);
    for (const Block &block : kBlocks) {
        EXPECT_LT(area.x_min, block.low.x());
        EXPECT_GT(area.x_max, block.high.x());
        EXPECT_LT(area.y_min, block.low.y());
        EXPECT_GT(area.y_max, block.high.y());
        EXPECT_GT(area.z_max, block.high.z());
    }
    EXPECT_LT(area.x_max - area.x_min, 4);
    // Looking past each other: a square round the cameras.
    const Area apart = derive_area({scene.views[0]});
    EXPECT_NEAR(apart.x_max - apart.x_min, 2 * 0.761427, 1e-6);
}

} // namespace
} // namespace outcrop
