// SPDX-License-Identifier: BSD-3-Clause
// Bad input has to be told, and no box be claimed from it.
#include "site/quality.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "site/ground_map.h"
#include "site/model.h"
#include "synthetic_site.h"

namespace outcrop {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using namespace synthetic;

constexpr unsigned kSeed = 211;
const Area kArea{-0.65, 0.95, -0.65, 1.0, 0.3};
const oc_margin_t kMargin = margin_of(0.010, 1.0 * kDegree);

bool says(const SiteModel &model, const std::string &code)
{
    return std::any_of(model.quality.begin(), model.quality.end(), [&](const Statement &s) { return s.code == code; });
}

std::string all_said(const SiteModel &model)
{
    std::string all;
    for (const Statement &s : model.quality) all += s.code + ": " + s.text + "\n";
    return all;
}

// A block on the ground, in a scene with as many ground points as asked for.
std::vector<Corner> block_on_ground(int n_ground, std::mt19937 *rng)
{
    std::vector<Corner> corners = random_corners(n_ground, 0, rng);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (int i = 0; i < 60; ++i)
        corners.push_back(
            {{0.05 + 0.2 * uniform(*rng), 0.05 + 0.2 * uniform(*rng), 0.02 + 0.15 * uniform(*rng)}, false, 0});
    return corners;
}

struct Site {
    Scene scene;
    std::vector<PairMatches> matches;
};

Site make_site(const oc_margin_t &margin, int n_ground = 80, unsigned seed = kSeed)
{
    std::mt19937 rng(seed);
    Site site;
    site.scene = make_scene(block_on_ground(n_ground, &rng), margin, 0.3, &rng);
    site.matches = make_matches(site.scene, 0, 40, &rng);
    return site;
}

SiteModel build(const Site &site)
{
    return build_from_matches(site.scene.views, kArea, [&](const MatchPass &) { return site.matches; });
}

void expect_nothing_claimed(const SiteModel &model)
{
    EXPECT_TRUE(has_fault(model)) << all_said(model);
    EXPECT_TRUE(model.obstacles.empty());
    for (const Obstacle &box : model.suspected) EXPECT_TRUE(box.is_suspected);
    for (const SitePoint &p : model.points) EXPECT_LT(p.obstacle, 0);
    const GroundMap map = map_ground(model);
    EXPECT_EQ(cv::countNonZero(map.codes == static_cast<int>(GroundCode::kFree)), 0);
}

TEST(Quality, has_no_reservations_about_a_good_site)
{
    for (unsigned seed = kSeed; seed < kSeed + 4; ++seed) {
        for (const oc_margin_t &margin : {kMargin, margin_of(0, 0)}) {
            const SiteModel model = build(make_site(margin, 80, seed));
            EXPECT_TRUE(model.quality.empty()) << "seed " << seed << "\n" << all_said(model);
            EXPECT_EQ(model.obstacles.size(), 1u) << "seed " << seed;
        }
    }
}

TEST(Quality, says_that_one_view_is_not_enough)
{
    Site site = make_site(kMargin);
    site.scene.views.resize(1);
    site.matches.clear();
    const SiteModel model = build(site);
    EXPECT_TRUE(says(model, "one_view"));
    expect_nothing_claimed(model);
    EXPECT_TRUE(says(build_from_matches({}, std::nullopt, [](const MatchPass &) { return std::vector<PairMatches>(); }),
                     "one_view"));
}

TEST(Quality, says_that_all_views_are_alike)
{
    Site site = make_site(kMargin);
    for (View &view : site.scene.views) view.camera = site.scene.views[0].camera;
    site.matches.clear();
    const SiteModel model = build(site);
    EXPECT_TRUE(says(model, "views_all_alike")) << all_said(model);
    expect_nothing_claimed(model);
}

TEST(Quality, says_that_no_pair_has_parallax)
{
    Site site = make_site(kMargin);
    site.matches.clear();
    const SiteModel model = build(site);
    EXPECT_TRUE(says(model, "no_parallax")) << all_said(model);
    expect_nothing_claimed(model);
}

TEST(Quality, says_that_nobody_looks_at_the_ground)
{
    Site site = make_site(kMargin);
    for (View &view : site.scene.views) { // turned over: they look at the sky
        oc_pose6_t six;
        oc_pose_to_6(&view.camera.pose, &six);
        six.v[3] += 180 * kDegree;
        oc_pose_from_6(&six, &view.camera.pose);
    }
    const SiteModel model = build(site);
    EXPECT_TRUE(says(model, "no_ground_in_sight")) << all_said(model);
    expect_nothing_claimed(model);
}

TEST(Quality, warns_when_no_ground_point_was_found)
{
    const SiteModel model = build(make_site(kMargin, 0));
    EXPECT_TRUE(says(model, "no_ground_seen")) << all_said(model);
}

TEST(Quality, says_that_the_ground_is_not_flat)
{
    std::mt19937 rng(kSeed);
    std::uniform_real_distribution<double> height(-0.12, 0.12);
    std::vector<Corner> corners = block_on_ground(120, &rng);
    for (Corner &corner : corners)
        if (corner.is_ground) corner.position.z() = height(rng);
    Site site;
    const oc_margin_t narrow = margin_of(0.002, 0.1 * kDegree);
    site.scene = make_scene(corners, narrow, 0.3, &rng);
    site.matches = make_matches(site.scene, 0, 40, &rng);
    // The vehicle's own ground pairs, which the base cannot tell apart from good ones.
    for (const PairMatches &pair : site.matches) {
        View &later = site.scene.views[static_cast<std::size_t>((pair.right - 10) / 3)];
        const View &earlier = site.scene.views[static_cast<std::size_t>((pair.left - 10) / 3)];
        for (const Match &m : pair.matches) {
            if (m.kind != MatchKind::kGround) continue;
            oc_tie_t tie{};
            tie.ref_view = static_cast<decltype(tie.ref_view)>(earlier.id);
            tie.x_px = later.junctions[static_cast<std::size_t>(m.right_junction)].x_px;
            tie.y_px = later.junctions[static_cast<std::size_t>(m.right_junction)].y_px;
            tie.ref_x_px = earlier.junctions[static_cast<std::size_t>(m.left_junction)].x_px;
            tie.ref_y_px = earlier.junctions[static_cast<std::size_t>(m.left_junction)].y_px;
            later.ties.push_back(tie);
        }
    }
    const SiteModel model = build(site);
    EXPECT_TRUE(says(model, "ground_not_flat")) << all_said(model);
    expect_nothing_claimed(model);
}

TEST(Quality, says_that_poses_are_outside_their_margins)
{
    Site site = make_site(margin_of(0.08, 3 * kDegree));
    for (View &view : site.scene.views) view.margin = margin_of(0.004, 0.2 * kDegree);
    const SiteModel model = build(site);
    EXPECT_TRUE(says(model, "poses_outside_margins") || says(model, "poses_too_poor") || says(model, "ground_not_flat"))
        << all_said(model);
    expect_nothing_claimed(model);
}

TEST(Quality, says_that_the_camera_is_mirrored)
{
    Site site = make_site(kMargin, 120);
    std::mt19937 rng(kSeed);
    for (std::size_t v = 1; v < site.scene.views.size(); ++v) {
        for (const Corner &corner : site.scene.corners) {
            double x[2], y[2];
            bool is_seen = corner.is_ground;
            for (const std::size_t k : {std::size_t{0}, std::size_t{1}})
                is_seen = is_seen &&
                          oc_camera_project(&site.scene.truth[v - k], corner.position.data(), &x[k], &y[k]) > 0 &&
                          x[k] > 0 && y[k] > 0 && x[k] < 639 && y[k] < 479;
            if (!is_seen) continue;
            oc_tie_t tie{};
            tie.ref_view = static_cast<decltype(tie.ref_view)>(site.scene.views[v - 1].id);
            tie.x_px = static_cast<float>(639 - x[0]), tie.y_px = static_cast<float>(y[0]);
            tie.ref_x_px = static_cast<float>(639 - x[1]), tie.ref_y_px = static_cast<float>(y[1]);
            site.scene.views[v].ties.push_back(tie);
        }
    }
    site.matches.clear();
    const SiteModel model = build(site);
    EXPECT_TRUE(says(model, "mirrored_camera")) << all_said(model);
    expect_nothing_claimed(model);
}

TEST(Quality, says_that_patches_do_not_fit)
{
    Site site = make_site(kMargin);
    for (PairMatches &pair : site.matches) pair.matches.clear(); // pairs there are, matches there are none
    for (View &view : site.scene.views)
        for (oc_junction_t &j : view.junctions) j.label = OC_LABEL_OBSTACLE;
    const SiteModel model = build(site);
    EXPECT_TRUE(says(model, "patches_do_not_fit")) << all_said(model);
    expect_nothing_claimed(model);
}

// ---- boxes one by one ----

Obstacle box_at(double x, double y, double size)
{
    Obstacle box;
    box.aabb_min = Vector3d(x - size / 2, y - size / 2, 0), box.aabb_max = Vector3d(x + size / 2, y + size / 2, size);
    box.obb_centre = Vector3d(x, y, size / 2);
    box.obb_size = Vector3d::Constant(size);
    box.n_points = 10;
    return box;
}

SiteModel model_of(const Site &site, double sigma_m)
{
    SiteModel model;
    model.area = kArea;
    for (const View &view : site.scene.views) {
        RefinedView refined;
        refined.id = view.id;
        refined.camera = view.camera;
        refined.is_improved = true;
        refined.posterior = margin_of(sigma_m, 0.001);
        model.views.push_back(refined);
    }
    model.counts = {{"pairs", 5}, {"matches", 500}, {"tracks_merged", 100}, {"obstacles", 0}, {"suspected", 0}};
    return model;
}

TEST(Quality, only_suspects_boxes_round_or_behind_cameras)
{
    const Site site = make_site(kMargin);
    SiteModel model = model_of(site, 0);
    const Vector3d centre = camera_centre(site.scene.views[0].camera);
    model.obstacles = {box_at(0.1, 0.1, 0.1), box_at(centre.x(), centre.y(), 2.0), box_at(0.3, 0.3, 0.1)};
    for (int i = 0; i < 3; ++i) {
        SitePoint point;
        point.obstacle = i;
        model.points.push_back(point);
    }
    QualityFacts facts;
    facts.views = &site.scene.views;
    facts.n_ground_sightings = 100;
    judge(facts, {}, &model);
    EXPECT_TRUE(says(model, "box_behind_camera")) << all_said(model);
    EXPECT_FALSE(has_fault(model));
    ASSERT_EQ(model.obstacles.size(), 2u);
    ASSERT_EQ(model.suspected.size(), 1u);
    EXPECT_EQ(model.obstacles[1].index, 2);
    EXPECT_EQ(model.points[0].obstacle, 0);
    EXPECT_EQ(model.points[1].obstacle, -2);
    EXPECT_EQ(model.points[2].obstacle, 1);
}

TEST(Quality, claims_no_box_whose_place_is_not_known_to_half_its_width)
{
    const Site site = make_site(kMargin);
    QualityFacts facts;
    facts.views = &site.scene.views;
    facts.n_ground_sightings = 100;
    for (const double sigma : {0.001, 0.018, 0.021, 0.1}) {
        SiteModel model = model_of(site, sigma);
        model.obstacles = {box_at(0.1, 0.1, 0.1)};
        judge(facts, {}, &model);
        const bool is_known = 2.58 * sigma <= 0.05;
        EXPECT_EQ(model.obstacles.size(), is_known ? 1u : 0u) << sigma;
        EXPECT_EQ(says(model, "poses_too_poor"), !is_known) << sigma;
        EXPECT_EQ(model.suspected.size(), is_known ? 0u : 1u) << sigma;
    }
}

TEST(Quality, wonders_at_a_thousand_obstacles)
{
    const Site site = make_site(kMargin);
    SiteModel model = model_of(site, 0);
    for (int i = 0; i < 1000; ++i) model.obstacles.push_back(box_at(0.01 * (i % 40), 0.01 * (i / 40), 0.008));
    QualityFacts facts;
    facts.views = &site.scene.views;
    facts.n_ground_sightings = 100;
    judge(facts, {}, &model);
    EXPECT_TRUE(says(model, "too_many_obstacles"));
    facts.views = nullptr;
    EXPECT_THROW(judge(facts, {}, &model), std::invalid_argument);
}

// ---- suspects ----

TEST(Suspects, are_where_unmatched_corners_of_two_views_meet_the_ground)
{
    Site site = make_site(margin_of(0, 0), 0);
    SiteModel model = model_of(site, 0);
    for (View &view : site.scene.views) view.junctions.clear();
    const auto show = [&](const Vector3d &p, std::size_t v, oc_label_t label) {
        double x, y;
        ASSERT_GT(oc_camera_project(&site.scene.views[v].camera, p.data(), &x, &y), 0);
        oc_junction_t j{};
        j.x_px = static_cast<float>(x), j.y_px = static_cast<float>(y);
        j.label = static_cast<decltype(j.label)>(label);
        site.scene.views[v].junctions.push_back(j);
    };
    show({0.1, 0.1, 0.002}, 0, OC_LABEL_OBSTACLE);
    EXPECT_TRUE(find_suspects(site.scene.views, {}, model).empty()) << "one view alone";
    show({0.1, 0.1, 0.002}, 2, OC_LABEL_UNKNOWN);
    show({0.3, 0.3, 0.0}, 0, OC_LABEL_GROUND);
    show({0.3, 0.3, 0.0}, 2, OC_LABEL_GROUND);
    const std::vector<Vector2d> found = find_suspects(site.scene.views, {}, model);
    ASSERT_EQ(found.size(), 1u);
    EXPECT_LT((found[0] - Vector2d(0.1, 0.1)).norm(), 0.01);
    EXPECT_TRUE(find_suspects(site.scene.views, {{2, 0}}, model).empty()) << "a matched corner is explained";
    model.obstacles = {box_at(0.1, 0.1, 0.1)};
    EXPECT_TRUE(find_suspects(site.scene.views, {}, model).empty()) << "and so is one on a box";

    model.obstacles.clear();
    model.suspects = found;
    const GroundMap with = map_ground(model);
    model.suspects.clear();
    const GroundMap without = map_ground(model);
    const int row = static_cast<int>((with.y_max - 0.1) / with.metres_per_pixel);
    const int col = static_cast<int>((0.1 - with.x_min) / with.metres_per_pixel);
    EXPECT_EQ(with.codes(row, col), static_cast<int>(GroundCode::kSuspected));
    EXPECT_EQ(without.codes(row, col), static_cast<int>(GroundCode::kFree));
}

} // namespace
} // namespace outcrop
