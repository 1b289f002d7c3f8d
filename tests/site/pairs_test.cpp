// SPDX-License-Identifier: BSD-3-Clause
// Pairs of views, candidates in strips and the blocks that matching needs.
#include "site/pairs.h"

#include <cmath>
#include <cstdio>
#include <random>
#include <set>
#include <stdexcept>

#include <gtest/gtest.h>

#include "core/packet.h"
#include "site/strip.h"
#include "site/wanted_blocks.h"
#include "textured_scene.h"

namespace outcrop {
namespace {

std::vector<View> ring(int n, double radius_m = 1.6)
{
    std::vector<View> views(n);
    for (int i = 0; i < n; i++) {
        views[i].id = i;
        views[i].camera = scene::on_ring(360.0 * i / n, radius_m);
        views[i].known = cv::Mat1b::zeros(scene::kHeight, scene::kWidth);
    }
    return views;
}

std::vector<PosedView> posed(const std::vector<View> &views)
{
    std::vector<PosedView> result;
    for (const View &view : views) result.push_back(as_reported(view));
    return result;
}

TEST(SelectPairs, NeighboursOnARingArePairedAndOppositesAreNot)
{
    const std::vector<View> views = ring(12);
    const std::vector<ViewPair> pairs = select_pairs(posed(views), scene::area());
    ASSERT_FALSE(pairs.empty());
    std::set<std::pair<int, int>> found;
    for (const ViewPair &pair : pairs) {
        const int apart = std::min(pair.right - pair.left, 12 - (pair.right - pair.left));
        EXPECT_LT(pair.left, pair.right);
        EXPECT_LE(apart, 2) << pair.left << " and " << pair.right;
        found.insert({pair.left, pair.right});
    }
    for (int i = 0; i < 12; i++) {
        EXPECT_EQ(found.count({std::min(i, (i + 1) % 12), std::max(i, (i + 1) % 12)}), 1u) << i;
    }
}

TEST(SelectPairs, ParallaxIsTheAngleBetweenTheRays)
{
    // A far ring: rays to all of a small area are nearly parallel, so the mean is the angle at its centre.
    std::vector<View> views(2);
    for (int i = 0; i < 2; i++) {
        const double a = i * 0.3;
        views[i].id = i;
        views[i].camera =
            scene::look_at(Eigen::Vector3d(50 * std::cos(a), 50 * std::sin(a), 30), Eigen::Vector3d::Zero());
    }
    const Eigen::Vector3d c0 = Eigen::Vector3d(50, 0, 30).normalized();
    const Eigen::Vector3d c1 = Eigen::Vector3d(50 * std::cos(0.3), 50 * std::sin(0.3), 30).normalized();
    const std::vector<ViewPair> pairs = select_pairs(posed(views), Area{-1, 1, -1, 1, 0.5});
    ASSERT_EQ(pairs.size(), 1u);
    EXPECT_NEAR(pairs[0].parallax_rad, std::acos(c0.dot(c1)), 1e-3);
    EXPECT_NEAR(pairs[0].overlap, 1.0, 1e-12);
}

TEST(SelectPairs, WorkGrowsLinearlyWithTheViews)
{
    PairOptions options;
    options.best_per_view = 4;
    for (const int n : {8, 24, 72}) {
        const std::vector<View> views = ring(n);
        EXPECT_LE(select_pairs(posed(views), scene::area(), options).size(), static_cast<std::size_t>(4 * n)) << n;
    }
}

double worth_of(const std::vector<ViewPair> &pairs)
{
    double sum = 0;
    for (const ViewPair &pair : pairs) sum += pair.worth;
    return sum;
}

// Many views: what the index proposes is worth nearly as much as the best of all pairs. A ring so dense that the nearest
// neighbours have no parallax, and a drive across a wide site.
TEST(SelectPairs, TheIndexFindsPairsAsGoodAsAllOfThem)
{
    const unsigned seed = 7;
    std::printf("seed %u\n", seed);
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    std::vector<View> wide(200);
    for (std::size_t i = 0; i < wide.size(); i++) {
        const Eigen::Vector3d at(12 * unit(random) - 6, 12 * unit(random) - 6, 0.3);
        const double a = 6.2832 * unit(random);
        wide[i].id = static_cast<int>(i);
        wide[i].camera = scene::look_at(at + Eigen::Vector3d(2 * std::cos(a), 2 * std::sin(a), 1), at);
    }
    for (const auto &[views, area] : {std::pair{ring(150), scene::area()}, std::pair{wide, Area{-6, 6, -6, 6, 1}}}) {
        PairOptions all, indexed;
        all.exhaustive_views = 1000;
        indexed.exhaustive_views = 10;
        const std::vector<ViewPair> best = select_pairs(posed(views), area, all);
        const std::vector<ViewPair> found = select_pairs(posed(views), area, indexed);
        EXPECT_GT(best.size(), views.size());
        EXPECT_GT(worth_of(found), 0.9 * worth_of(best)) << views.size();
        EXPECT_LE(found.size(), indexed.best_per_view * views.size());
    }
}

TEST(SelectPairs, ViewsThatLookAwayAreNotPaired)
{
    std::vector<View> views = ring(6);
    views[1].camera = scene::look_at(Eigen::Vector3d(1.6, 0.5, 0.9), Eigen::Vector3d(9, 0.5, 0.1));
    for (const ViewPair &pair : select_pairs(posed(views), scene::area())) {
        EXPECT_NE(pair.left, 1);
        EXPECT_NE(pair.right, 1);
    }
}

TEST(SelectPairs, RefusesAnEmptyAreaAndBadOptions)
{
    const std::vector<View> views = ring(3);
    EXPECT_THROW(select_pairs(posed(views), Area{}), std::invalid_argument);
    PairOptions options;
    options.best_per_view = 0;
    EXPECT_THROW(select_pairs(posed(views), scene::area(), options), std::invalid_argument);
    options = PairOptions{};
    options.max_parallax_rad = std::nan("");
    EXPECT_THROW(select_pairs(posed(views), scene::area(), options), std::invalid_argument);
}

// ---- candidates ----

struct TwoViews {
    View left, right;
    std::vector<int> left_corner, right_corner;
};

TwoViews two_views(double margin_m, double margin_rad)
{
    TwoViews two;
    two.left.camera = scene::on_ring(20);
    two.right.camera = scene::on_ring(48);
    two.right.id = 1;
    two.left_corner = scene::add_junctions(scene::corners(), &two.left);
    two.right_corner = scene::add_junctions(scene::corners(), &two.right);
    two.left.known = cv::Mat1b::zeros(scene::kHeight, scene::kWidth);
    two.right.known = two.left.known.clone();
    for (View *view : {&two.left, &two.right}) {
        for (int i = 0; i < 6; i++) view->margin.v[i] = i < 3 ? margin_m : margin_rad;
    }
    return two;
}

TEST(FindCandidates, TrueMatchesAreAmongThem)
{
    const TwoViews two = two_views(0, 0);
    const StripOptions options;
    oc_pair_t pair;
    ASSERT_TRUE(prepare_pair(as_reported(two.left), as_reported(two.right), options, &pair));
    std::set<std::pair<int, int>> found;
    const auto candidates =
        find_candidates(pair, as_reported(two.left), as_reported(two.right), scene::area(), options);
    for (const Candidate &c : candidates) {
        found.insert({c.left, c.right});
        if (two.left_corner[c.left] != two.right_corner[c.right]) continue;
        EXPECT_FALSE(c.is_rival);
        EXPECT_LT((c.point - scene::corners()[two.left_corner[c.left]].point).norm(), 1e-4);
        EXPECT_LT(std::abs(c.distance_px), 1e-2);
    }
    int n_true = 0;
    for (std::size_t i = 0; i < two.left_corner.size(); i++) {
        for (std::size_t j = 0; j < two.right_corner.size(); j++) {
            if (two.left_corner[i] != two.right_corner[j]) continue;
            n_true++;
            EXPECT_EQ(found.count({static_cast<int>(i), static_cast<int>(j)}), 1u);
        }
    }
    EXPECT_GT(n_true, 20);
    EXPECT_LT(candidates.size(), two.left_corner.size() * two.right_corner.size() / 3);
}

TEST(FindCandidates, TheBucketIndexFindsWhatBruteForceFinds)
{
    TwoViews two = two_views(0.01, 0.017);
    std::mt19937 rng(4);
    std::uniform_real_distribution<float> x(0, scene::kWidth - 1.0F);
    std::uniform_real_distribution<float> y(0, scene::kHeight - 1.0F);
    for (int i = 0; i < 200; i++) {
        oc_junction_t junction{};
        junction.x_px = x(rng);
        junction.y_px = y(rng);
        two.right.junctions.push_back(junction);
    }
    StripOptions options;
    options.with_rivals = false;
    options.area_slack_m = 1e3;
    oc_pair_t pair;
    ASSERT_TRUE(prepare_pair(as_reported(two.left), as_reported(two.right), options, &pair));
    std::set<std::pair<int, int>> found;
    for (const Candidate &c :
         find_candidates(pair, as_reported(two.left), as_reported(two.right), scene::area(), options)) {
        found.insert({c.left, c.right});
    }
    const oc_reach_t reach{-options.below_ground_m, scene::area().z_max, 1e-3, 1e6};
    std::size_t n_brute = 0;
    for (std::size_t i = 0; i < two.left.junctions.size(); i++) {
        const oc_junction_t &l = two.left.junctions[i];
        oc_strip_t strip;
        oc_segment_t segment;
        ASSERT_EQ(oc_strip_prepare(&pair, l.x_px, l.y_px, &strip), OC_OK);
        ASSERT_EQ(oc_strip_segment(&pair, l.x_px, l.y_px, &reach, &segment), OC_OK);
        for (std::size_t j = 0; j < two.right.junctions.size(); j++) {
            const oc_junction_t &r = two.right.junctions[j];
            if (!oc_strip_contains(&strip, r.x_px, r.y_px) || !oc_segment_contains(&segment, r.x_px, r.y_px)) continue;
            oc_midpoint_t m;
            if (oc_epipolar_midpoint(&two.left.camera, l.x_px, l.y_px, &two.right.camera, r.x_px, r.y_px, &m) != OC_OK)
                continue;
            if (!(m.depth_left_m > 0 && m.depth_right_m > 0)) continue;
            n_brute++;
            EXPECT_EQ(found.count({static_cast<int>(i), static_cast<int>(j)}), 1u) << i << " " << j;
        }
    }
    EXPECT_EQ(found.size(), n_brute);
    EXPECT_GT(n_brute, 100u);
}

TEST(FindCandidates, GroundLabelsAreRivalsOrLeftOutUnlessAskedFor)
{
    TwoViews two = two_views(0, 0);
    for (oc_junction_t &junction : two.left.junctions) junction.label = OC_LABEL_GROUND;
    two.right.junctions[0].label = OC_LABEL_GROUND;
    StripOptions options;
    oc_pair_t pair;
    ASSERT_TRUE(prepare_pair(as_reported(two.left), as_reported(two.right), options, &pair));
    const auto find = [&] {
        return find_candidates(pair, as_reported(two.left), as_reported(two.right), scene::area(), options);
    };
    EXPECT_FALSE(find().empty());
    for (const Candidate &c : find()) {
        EXPECT_TRUE(c.is_rival);
        EXPECT_NE(c.right, 0);
    }
    options.with_rivals = false;
    EXPECT_TRUE(find().empty());
    options.with_ground = true;
    EXPECT_FALSE(find().empty());
}

TEST(FindCandidates, WhatStandsOutsideTheAreaIsARival)
{
    const TwoViews two = two_views(0, 0);
    const Area small{-0.31, 0.0, -0.26, 0.26, 0.6};
    StripOptions options;
    options.area_slack_m = 0.01;
    oc_pair_t pair;
    ASSERT_TRUE(prepare_pair(as_reported(two.left), as_reported(two.right), options, &pair));
    int n_rivals = 0;
    for (const Candidate &c : find_candidates(pair, as_reported(two.left), as_reported(two.right), small, options)) {
        if (two.left_corner[c.left] != two.right_corner[c.right]) continue;
        EXPECT_EQ(c.is_rival, c.point.x() > 0.01) << c.point.transpose();
        n_rivals += c.is_rival ? 1 : 0;
    }
    EXPECT_GT(n_rivals, 5);
    options.with_rivals = false;
    for (const Candidate &c : find_candidates(pair, as_reported(two.left), as_reported(two.right), small, options)) {
        EXPECT_FALSE(c.is_rival);
        EXPECT_LE(c.point.x(), 0.01 + 1e-9);
    }
}

TEST(PreparePair, RefusesBadMarginsAndSaysWhenThereIsNoGeometry)
{
    TwoViews two = two_views(0, 0);
    oc_pair_t pair;
    EXPECT_FALSE(prepare_pair(as_reported(two.left), as_reported(two.left), StripOptions{}, &pair));
    two.left.margin.v[0] = -1;
    EXPECT_THROW(prepare_pair(as_reported(two.left), as_reported(two.right), StripOptions{}, &pair),
                 std::invalid_argument);
}

// ---- blocks ----

TEST(WantedBlocks, CoverTheWindowOfEveryJunctionWithACandidate)
{
    const TwoViews two = two_views(0.005, 0.01);
    const std::vector<PosedView> views = {as_reported(two.left), as_reported(two.right)};
    ViewPair pair;
    pair.right = 1;
    WantedBlocksOptions options;
    const auto wanted = wanted_blocks(views, {pair}, scene::area(), {}, options);
    ASSERT_EQ(wanted.size(), 2u);

    oc_pair_t prepared;
    ASSERT_TRUE(prepare_pair(views[0], views[1], options.strip, &prepared));
    std::set<int> expected;
    for (const Candidate &c : find_candidates(prepared, views[0], views[1], scene::area(), options.strip)) {
        const oc_junction_t &j = two.left.junctions[c.left];
        if (c.is_rival) continue;
        for (int dy = -options.radius_px; dy <= options.radius_px; dy++) {
            for (int dx = -options.radius_px; dx <= options.radius_px; dx++) {
                const int x = static_cast<int>(std::floor(j.x_px + static_cast<float>(dx)));
                const int y = static_cast<int>(std::floor(j.y_px + static_cast<float>(dy)));
                if (x < 0 || y < 0 || x >= 480 || y >= 360) continue;
                expected.insert((y / 8) * 60 + x / 8);
            }
        }
    }
    const std::set<int> got(wanted[0].blocks.begin(), wanted[0].blocks.end());
    EXPECT_EQ(got, expected);
    EXPECT_TRUE(std::is_sorted(wanted[0].blocks.begin(), wanted[0].blocks.end()));
    EXPECT_EQ(got.size(), wanted[0].blocks.size());
}

TEST(WantedBlocks, WhatIsKnownOrAskedForIsNotWantedAgain)
{
    TwoViews two = two_views(0, 0);
    ViewPair pair;
    pair.right = 1;
    const auto first = wanted_blocks({as_reported(two.left), as_reported(two.right)}, {pair}, scene::area(), {});
    ASSERT_EQ(first.size(), 2u);

    // One block of the left view arrives; one of the right was asked for; one pixel short is not known.
    const int arrived = first[0].blocks.front();
    const int short_of_one = first[0].blocks.back();
    for (const int b : {arrived, short_of_one}) two.left.known(cv::Rect(b % 60 * 8, b / 60 * 8, 8, 8)) = 255;
    two.left.known(short_of_one / 60 * 8 + 7, short_of_one % 60 * 8 + 7) = 0;
    std::vector<std::vector<std::uint8_t>> asked(2, std::vector<std::uint8_t>(60 * 45, 0));
    asked[1][first[1].blocks.front()] = 1;
    const auto second = wanted_blocks({as_reported(two.left), as_reported(two.right)}, {pair}, scene::area(), asked);
    ASSERT_EQ(second.size(), 2u);
    EXPECT_EQ(second[0].blocks, std::vector<std::uint16_t>(first[0].blocks.begin() + 1, first[0].blocks.end()));
    EXPECT_EQ(second[1].blocks, std::vector<std::uint16_t>(first[1].blocks.begin() + 1, first[1].blocks.end()));
}

TEST(WantedBlocks, RefusesTablesOfTheWrongSize)
{
    const TwoViews two = two_views(0, 0);
    const std::vector<PosedView> views = {as_reported(two.left), as_reported(two.right)};
    EXPECT_THROW(wanted_blocks(views, {}, scene::area(), {{}}), std::invalid_argument);
    EXPECT_THROW(wanted_blocks(views, {}, scene::area(), {{1}, {1}}), std::invalid_argument);
    WantedBlocksOptions options;
    options.radius_px = -1;
    EXPECT_THROW(wanted_blocks(views, {}, scene::area(), {}, options), std::invalid_argument);
}

} // namespace
} // namespace outcrop
