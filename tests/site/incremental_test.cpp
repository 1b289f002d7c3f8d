// SPDX-License-Identifier: BSD-3-Clause
// A model that grows view by view: near the settled one, undone without a trace, and as quick for the last as for the first.
#include "site/incremental.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "site/boxes.h"
#include "site/triangulate.h"
#include "synthetic_site.h"

namespace outcrop {
namespace {

using Eigen::Vector3d;
using namespace synthetic;

const Area kArea{-0.65, 0.95, -0.65, 1.0, 0.3};
const oc_margin_t kMargin = margin_of(0.010, 1.0 * kDegree);

struct Block {
    Vector3d low, high;
};
const std::vector<Block> kBlocks = {{{-0.02, -0.19, 0}, {0.17, -0.05, 0.19}}, {{0.2, 0.25, 0}, {0.36, 0.39, 0.11}}};

std::vector<Corner> corners_of(std::mt19937 *rng)
{
    std::vector<Corner> corners = random_corners(60, 0, rng);
    std::uniform_real_distribution<double> uniform(0, 1);
    for (std::size_t b = 0; b < kBlocks.size(); ++b) {
        const Vector3d size = kBlocks[b].high - kBlocks[b].low;
        for (int i = 0; i < 45; ++i) {
            const Vector3d at(i % 2 ? 1.0 : uniform(*rng), i % 3 ? uniform(*rng) : 1.0, 0.2 + 0.8 * uniform(*rng));
            corners.push_back({kBlocks[b].low + at.cwiseProduct(size), false, static_cast<int>(b)});
        }
    }
    return corners;
}

// The made-up matches of a pair, whatever the poses.
PairMatcher matcher_of(const std::vector<PairMatches> &all)
{
    return [&all](const PosedView &left, const PosedView &right, const Area &, oc_angle_error_t) {
        PairMatches none;
        none.left = left.view->id, none.right = right.view->id;
        for (const PairMatches &pair : all)
            if (pair.left == none.left && pair.right == none.right) return pair;
        return none;
    };
}

struct Site {
    Scene scene;
    std::vector<PairMatches> matches;
};

Site make_site(unsigned seed)
{
    std::mt19937 rng(seed);
    Site site;
    site.scene = make_scene(corners_of(&rng), kMargin, 0.4, &rng);
    site.matches = make_matches(site.scene, 0.05, 40, &rng);
    return site;
}

double best_iou(const SiteModel &model, const Block &block)
{
    double best = 0;
    for (const Obstacle &box : model.obstacles)
        best = std::max(best, aabb_iou(box.aabb_min, box.aabb_max, block.low, block.high));
    return best;
}

TEST(Incremental, FindsTheBoxesViewByView)
{
    const Site site = make_site(5);
    IncrementalSite growing(kArea, {}, matcher_of(site.matches));
    for (const View &view : site.scene.views) {
        growing.add_view(view);
        EXPECT_LE(growing.pairs_matched(), 2 * IncrementalOptions().max_neighbours);
    }
    const SiteModel model = growing.model();
    EXPECT_EQ(model.views.size(), site.scene.views.size());
    for (const Block &block : kBlocks) EXPECT_GT(best_iou(model, block), 0.5);
    EXPECT_LE(model.obstacles.size(), 3u);
    for (const SitePoint &point : model.points) {
        EXPECT_TRUE(point.position.allFinite());
        EXPECT_GE(point.n_views, 2);
        EXPECT_LT(point.obstacle, static_cast<int>(model.obstacles.size()));
    }
}

TEST(Incremental, AViewThatIsTakenAwayLeavesNothingBehind)
{
    const Site site = make_site(6);
    IncrementalSite growing(kArea, {}, matcher_of(site.matches));
    for (const View &view : site.scene.views) growing.add_view(view);
    std::vector<int> ids;
    for (const View &view : site.scene.views) ids.push_back(view.id);
    for (const int id : ids) {
        EXPECT_TRUE(growing.remove_view(id));
        EXPECT_FALSE(growing.remove_view(id));
        for (const SitePoint &point : growing.model().points)
            EXPECT_LE(point.n_views, static_cast<int>(growing.n_views()));
    }
    const SiteModel empty = growing.model();
    EXPECT_TRUE(empty.points.empty() && empty.obstacles.empty() && empty.suspected.empty() && empty.views.empty());
    growing.add_view(site.scene.views[0]);
    EXPECT_EQ(growing.n_views(), 1u);
}

TEST(Incremental, ANewPoseIsAsIfTheViewCameNow)
{
    const Site site = make_site(7);
    IncrementalSite growing(kArea, {}, matcher_of(site.matches));
    for (const View &view : site.scene.views) growing.add_view(view);
    oc_camera_t off = site.scene.views[3].camera;
    Vector3d centre = camera_centre(off);
    centre.x() += 0.3;
    oc_pose_from_centre(off.pose.R, centre.data(), &off.pose);
    EXPECT_TRUE(growing.repose_view(site.scene.views[3].id, off, kMargin));
    EXPECT_TRUE(growing.repose_view(site.scene.views[3].id, site.scene.views[3].camera, kMargin));
    EXPECT_FALSE(growing.repose_view(999, off, kMargin));
    for (const Block &block : kBlocks) EXPECT_GT(best_iou(growing.model(), block), 0.5);
}

TEST(Incremental, RefusesDoublesAndBadCameras)
{
    const Site site = make_site(8);
    IncrementalSite growing(kArea, {}, matcher_of(site.matches));
    growing.add_view(site.scene.views[0]);
    EXPECT_THROW(growing.add_view(site.scene.views[0]), std::invalid_argument);
    View bad = site.scene.views[1];
    bad.margin.v[2] = std::nan("");
    EXPECT_THROW(growing.add_view(bad), std::invalid_argument);
    EXPECT_THROW(IncrementalSite(Area{}), std::invalid_argument);
}

// A drive past block after block: what a view costs is what its neighbours hold. Counted, not timed.
TEST(Incremental, TheLastOfManyViewsTouchesNoMoreThanTheFirst)
{
    std::mt19937 rng(9);
    std::uniform_real_distribution<double> uniform(0, 1);
    constexpr int kStations = 40, kPerStation = 5;
    std::vector<Vector3d> corners;
    for (int s = 0; s < kStations; ++s)
        for (int i = 0; i < 30; ++i)
            corners.emplace_back(6.0 * s + 0.5 * uniform(rng), 0.5 * uniform(rng), 0.1 + 0.4 * uniform(rng));
    std::vector<View> views;
    std::vector<std::map<int, int>> junction_of; // per view: corner -> junction
    for (int v = 0; v < kStations * kPerStation; ++v) {
        const int s = v / kPerStation;
        const double a = 0.4 * (v % kPerStation) - 0.8;
        View view;
        view.id = v;
        view.margin = margin_of(0.01, 0.2 * kDegree);
        const Vector3d to(6.0 * s + 0.25, 0.25, 0.2), from = to + Vector3d(3 * std::sin(a), -3 * std::cos(a), 1.2);
        view.camera = thesis_camera(0);
        const Vector3d z = (to - from).normalized(), x = z.cross(Vector3d::UnitZ()).normalized(), y = z.cross(x);
        Eigen::Matrix<double, 3, 3, Eigen::RowMajor> rows;
        rows.row(0) = x, rows.row(1) = y, rows.row(2) = z;
        oc_pose_from_centre(rows.data(), from.data(), &view.camera.pose);
        junction_of.emplace_back();
        for (std::size_t c = 0; c < corners.size(); ++c) {
            double px, py;
            if (!(oc_camera_project(&view.camera, corners[c].data(), &px, &py) > 0)) continue;
            if (px < 0 || py < 0 || px >= view.camera.k.width_px || py >= view.camera.k.height_px) continue;
            oc_junction_t j{};
            j.x_px = static_cast<float>(px), j.y_px = static_cast<float>(py), j.label = OC_LABEL_OBSTACLE;
            junction_of.back()[static_cast<int>(c)] = static_cast<int>(view.junctions.size());
            view.junctions.push_back(j);
        }
        views.push_back(view);
    }
    const PairMatcher matcher = [&](const PosedView &left, const PosedView &right, const Area &, oc_angle_error_t) {
        PairMatches pair;
        pair.left = left.view->id, pair.right = right.view->id;
        for (const auto &[corner, junction] : junction_of[static_cast<std::size_t>(pair.left)]) {
            const auto other = junction_of[static_cast<std::size_t>(pair.right)].find(corner);
            if (other == junction_of[static_cast<std::size_t>(pair.right)].end()) continue;
            Match match;
            match.left_junction = junction, match.right_junction = other->second, match.score = 0.95;
            pair.matches.push_back(match);
        }
        return pair;
    };
    IncrementalOptions options;
    options.build.cluster.t_m_m = 0.4; // a share of so long an area would join its stations
    IncrementalSite growing(Area{-2, 6.0 * kStations, -2, 3, 1}, options, matcher);
    int most_early = 0, most_late = 0;
    for (const View &view : views) {
        growing.add_view(view);
        int &most = view.id < 50 ? most_early : most_late;
        most = std::max(most, growing.pairs_matched() + growing.points_renewed());
    }
    EXPECT_GT(most_early, 30);
    EXPECT_LE(most_late, most_early + most_early / 4);
    EXPECT_GE(growing.model().obstacles.size(), static_cast<std::size_t>(kStations) / 2);
}

} // namespace
} // namespace outcrop
