// SPDX-License-Identifier: BSD-3-Clause
// Bundle adjustment on the thesis' cameras: how good, how honest, how steady.
#include "site/refine.h"

#include <chrono>
#include <cmath>
#include <cstring>
#include <random>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "core/homography.h"
#include "site/tracks.h"
#include "synthetic_site.h"

namespace outcrop {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using namespace synthetic;

constexpr unsigned kSeed = 716;
constexpr double kNoisePx = 0.7;

const oc_margin_t kMargin = margin_of(0.010, 1.0 * kDegree);
const Area kArea{-0.65, 0.95, -0.65, 1.0, 0.3};

struct Solved {
    Scene scene;
    std::vector<Track> tracks;
    RefineResult result;
};

Solved run(unsigned seed, double wrong_share, const oc_margin_t &margin, const RefineOptions &options = {})
{
    std::mt19937 rng(seed);
    Solved r;
    r.scene = make_scene(random_corners(60, 60, &rng), margin, kNoisePx, &rng);
    const std::vector<PairMatches> matches = make_matches(r.scene, wrong_share, 60, &rng);
    std::vector<oc_camera_t> cameras;
    std::vector<Matrix6d> covariances;
    for (const View &view : r.scene.views) {
        cameras.push_back(view.camera);
        covariances.push_back(pose_covariance(view.camera, view.margin));
    }
    r.tracks = settle_tracks(r.scene.views, cameras, covariances, merge_tracks(r.scene.views, matches), kArea, {});
    r.result = refine_poses(r.scene.views, r.tracks, options);
    return r;
}

// RMSE of the obstacle corners triangulated from all views that show them.
double obstacle_rmse_m(const Scene &scene, const std::vector<oc_camera_t> &cameras)
{
    double sum = 0;
    int n = 0;
    for (std::size_t c = 0; c < scene.corners.size(); ++c) {
        if (scene.corners[c].is_ground) continue;
        std::vector<Sighting> sightings;
        for (std::size_t v = 0; v < scene.views.size(); ++v)
            for (std::size_t k = 0; k < scene.shown[v].size(); ++k)
                if (scene.shown[v][k] == static_cast<int>(c))
                    sightings.push_back(
                        {&cameras[v], scene.views[v].junctions[k].x_px, scene.views[v].junctions[k].y_px, nullptr});
        const auto point = triangulate(sightings);
        if (!point) continue;
        sum += (point->point - scene.corners[c].position).squaredNorm();
        ++n;
    }
    return std::sqrt(sum / n);
}

// RMS error of carrying true ground pixels from each view into the next.
double ground_transfer_px(const Scene &scene, const std::vector<oc_camera_t> &cameras)
{
    double sum = 0;
    int n = 0;
    for (std::size_t v = 0; v < cameras.size(); ++v) {
        const std::size_t w = (v + 1) % cameras.size();
        for (const Corner &corner : scene.corners) {
            if (!corner.is_ground) continue;
            double x, y, x2, y2, u, w2;
            if (!(oc_camera_project(&scene.truth[v], corner.position.data(), &x, &y) > 0)) continue;
            if (!(oc_camera_project(&scene.truth[w], corner.position.data(), &x2, &y2) > 0)) continue;
            Vector3d ray;
            oc_camera_ray(&cameras[v], x, y, ray.data());
            const Vector3d centre = camera_centre(cameras[v]), ground = centre - centre.z() / ray.z() * ray;
            if (!(oc_camera_project(&cameras[w], ground.data(), &u, &w2) > 0)) continue;
            sum += (u - x2) * (u - x2) + (w2 - y2) * (w2 - y2);
            ++n;
        }
    }
    return std::sqrt(sum / n);
}

std::vector<oc_camera_t> cameras_of(const RefineResult &result)
{
    std::vector<oc_camera_t> cameras;
    for (const RefinedView &view : result.views) cameras.push_back(view.camera);
    return cameras;
}

std::vector<oc_camera_t> sensor_cameras(const Scene &scene)
{
    std::vector<oc_camera_t> cameras;
    for (const View &view : scene.views) cameras.push_back(view.camera);
    return cameras;
}

class RefineAccuracy : public ::testing::TestWithParam<double> {};

// The errors of single sites differ mostly by what moves all cameras alike, so the limits hold on the mean of five.
TEST_P(RefineAccuracy, is_a_few_millimetres_and_half_a_pixel)
{
    double rmse = 0, rmse_before = 0, transfer = 0;
    constexpr int kSites = 5;
    for (int i = 0; i < kSites; ++i) {
        const Solved r = run(kSeed + static_cast<unsigned>(i), GetParam(), kMargin);
        const std::vector<oc_camera_t> cameras = cameras_of(r.result);
        rmse += obstacle_rmse_m(r.scene, cameras) / kSites;
        rmse_before += obstacle_rmse_m(r.scene, sensor_cameras(r.scene)) / kSites;
        transfer += ground_transfer_px(r.scene, cameras) / kSites;
        for (const RefinedView &view : r.result.views) EXPECT_TRUE(view.is_improved) << "view " << view.id;
        EXPECT_GT(r.result.rms_before_px, 3 * r.result.rms_after_px);
    }
    RecordProperty("rmse_um", static_cast<int>(rmse * 1e6));
    RecordProperty("transfer_millipx", static_cast<int>(transfer * 1e3));
    EXPECT_LE(rmse, 0.005) << "seeds from " << kSeed;
    EXPECT_GT(rmse_before, 2 * rmse);
    EXPECT_LT(transfer, 0.6) << "seeds from " << kSeed;
}

INSTANTIATE_TEST_SUITE_P(WrongShare, RefineAccuracy, ::testing::Values(0.0, 0.2));

TEST(Refine, says_how_uncertain_it_is)
{
    // Squared errors of all poses over their predicted variances: 1 on average, the margins' own share included.
    double sum = 0;
    int n = 0;
    for (unsigned seed = 0; seed < 6; ++seed) {
        const Solved r = run(seed, 0, kMargin);
        for (std::size_t v = 0; v < r.scene.views.size(); ++v) {
            oc_pose6_t truth, found;
            oc_pose_to_6(&r.scene.truth[v].pose, &truth);
            oc_pose_to_6(&r.result.views[v].camera.pose, &found);
            for (int k = 0; k < 6; ++k) {
                const double sigma = r.result.views[v].posterior.v[k];
                ASSERT_GT(sigma, 0);
                EXPECT_LT(sigma, kMargin.v[k] / std::sqrt(3.0));
                const double error = std::remainder(found.v[k] - truth.v[k], k < 3 ? 1e9 : 2 * M_PI);
                sum += error * error / (sigma * sigma);
                ++n;
            }
        }
    }
    const double ratio = std::sqrt(sum / n);
    EXPECT_GT(ratio, 0.6);
    EXPECT_LT(ratio, 1.4);
}

TEST(Refine, knows_views_better_against_each_other_than_in_the_world)
{
    const Solved r = run(kSeed, 0, kMargin);
    for (std::size_t v = 0; v < r.scene.views.size(); ++v) {
        EXPECT_LT(r.result.relative_covariances[v].trace(), r.result.pose_covariances[v].trace());
        for (int k = 0; k < 6; ++k) EXPECT_LT(r.result.matching_margins[v].v[k], 0.7 * kMargin.v[k]);
    }
}

TEST(Refine, leaves_exact_poses_alone)
{
    const Solved r = run(kSeed, 0, margin_of(0, 0));
    for (std::size_t v = 0; v < r.scene.views.size(); ++v) {
        EXPECT_EQ(std::memcmp(&r.result.views[v].camera, &r.scene.views[v].camera, sizeof(oc_camera_t)), 0);
        EXPECT_FALSE(r.result.views[v].is_improved);
        for (const double half_width : r.result.matching_margins[v].v) EXPECT_EQ(half_width, 0);
    }
}

TEST(Refine, holds_the_exact_view_among_others)
{
    std::mt19937 rng(kSeed);
    Scene scene = make_scene(random_corners(60, 60, &rng), kMargin, kNoisePx, &rng);
    scene.views[2].camera = scene.truth[2];
    scene.views[2].margin = margin_of(0, 0);
    const auto tracks = merge_tracks(scene.views, make_matches(scene, 0, 60, &rng));
    const RefineResult result = refine_poses(scene.views, tracks);
    EXPECT_EQ(std::memcmp(&result.views[2].camera, &scene.truth[2], sizeof(oc_camera_t)), 0);
    EXPECT_LT((camera_centre(result.views[3].camera) - camera_centre(scene.truth[3])).norm(), 0.006);
}

TEST(Refine, keeps_the_sensor_where_nothing_is_seen)
{
    std::mt19937 rng(kSeed);
    Scene scene = make_scene(random_corners(60, 60, &rng), kMargin, kNoisePx, &rng);
    scene.views[5].junctions.clear();
    scene.shown[5].clear();
    const auto tracks = merge_tracks(scene.views, make_matches(scene, 0, 60, &rng));
    const RefineResult result = refine_poses(scene.views, tracks);
    EXPECT_EQ(std::memcmp(&result.views[5].camera, &scene.views[5].camera, sizeof(oc_camera_t)), 0);
    EXPECT_FALSE(result.views[5].is_improved);
    EXPECT_NEAR(result.views[5].posterior.v[0], 0.010 / std::sqrt(3.0), 1e-9);
    EXPECT_TRUE(result.views[4].is_improved);
    const RefineResult nothing = refine_poses(scene.views, {});
    for (const RefinedView &view : nothing.views) EXPECT_FALSE(view.is_improved);
}

TEST(Refine, ties_of_the_ground_alone_settle_the_ground)
{
    std::mt19937 rng(kSeed);
    Scene scene = make_scene(random_corners(60, 0, &rng), kMargin, 0.3, &rng);
    // Each view is tied to the one before it; a shared position makes chains of them.
    for (std::size_t v = 1; v < scene.views.size(); ++v) {
        for (std::size_t k = 0; k < scene.shown[v].size(); ++k) {
            for (std::size_t m = 0; m < scene.shown[v - 1].size(); ++m) {
                if (scene.shown[v][k] != scene.shown[v - 1][m]) continue;
                const oc_junction_t &own = scene.views[v].junctions[k], &ref = scene.views[v - 1].junctions[m];
                scene.views[v].ties.push_back(
                    {static_cast<std::uint16_t>(scene.views[v - 1].id), own.x_px, own.y_px, ref.x_px + 0.2f, ref.y_px});
            }
        }
        scene.views[v].ties.push_back({9999, 1, 1, 2, 2}); // to a view that is not there
    }
    const RefineResult result = refine_poses(scene.views, {});
    EXPECT_GE(result.n_ground, 40);
    // Some chains break where a view in between does not show the point; pairwise they would be some 300.
    EXPECT_LE(result.n_ground, 70) << "a chain of ties is one point";
    EXPECT_LT(ground_transfer_px(scene, cameras_of(result)), 0.6);
    EXPECT_GT(ground_transfer_px(scene, sensor_cameras(scene)), 3);
}

TEST(Refine, gives_the_same_bits_twice)
{
    const Solved a = run(kSeed, 0.2, kMargin), b = run(kSeed, 0.2, kMargin);
    for (std::size_t v = 0; v < a.result.views.size(); ++v) {
        EXPECT_EQ(std::memcmp(&a.result.views[v].camera, &b.result.views[v].camera, sizeof(oc_camera_t)), 0);
        EXPECT_EQ(std::memcmp(&a.result.views[v].posterior, &b.result.views[v].posterior, sizeof(oc_margin_t)), 0);
    }
}

TEST(Refine, refuses_options_that_make_no_sense)
{
    RefineOptions options;
    options.sigma_px = std::nan("");
    EXPECT_THROW(refine_poses({}, {}, options), std::invalid_argument);
    EXPECT_TRUE(refine_poses({}, {}).views.empty());
}

// Tracks ------------------------------------------------------------------------------------------------------------

TEST(Tracks, do_not_depend_on_the_order_of_pairs_and_hold_one_junction_per_view)
{
    std::mt19937 rng(kSeed);
    const Scene scene = make_scene(random_corners(60, 60, &rng), kMargin, kNoisePx, &rng);
    std::vector<PairMatches> pairs = make_matches(scene, 0.2, 60, &rng);
    const std::vector<Track> tracks = merge_tracks(scene.views, pairs);
    std::reverse(pairs.begin(), pairs.end());
    for (PairMatches &pair : pairs) std::reverse(pair.matches.begin(), pair.matches.end());
    const std::vector<Track> again = merge_tracks(scene.views, pairs);
    ASSERT_EQ(tracks.size(), again.size());
    for (std::size_t i = 0; i < tracks.size(); ++i) {
        EXPECT_EQ(tracks[i].pixels, again[i].pixels);
        EXPECT_EQ(tracks[i].score, again[i].score);
        for (std::size_t k = 1; k < tracks[i].pixels.size(); ++k)
            EXPECT_LT(tracks[i].pixels[k - 1].view, tracks[i].pixels[k].view);
    }
}

TEST(Tracks, settled_with_the_true_poses_keep_the_corners_and_drop_wrong_sightings)
{
    std::mt19937 rng(kSeed);
    const Scene scene = make_scene(random_corners(60, 60, &rng), kMargin, 0.3, &rng);
    const std::vector<Track> merged = merge_tracks(scene.views, make_matches(scene, 0.2, 60, &rng));
    const std::vector<Track> tracks = settle_tracks(scene.views, scene.truth, {}, merged, kArea, {});
    std::vector<char> is_found(scene.corners.size(), 0);
    int n_mixed = 0;
    for (const Track &track : tracks) {
        const auto corner_of = [&](const TrackPixel &p) {
            return scene.shown[static_cast<std::size_t>(p.view)][static_cast<std::size_t>(p.junction)];
        };
        const int corner = corner_of(track.pixels[0]);
        bool is_mixed = false;
        for (const TrackPixel &p : track.pixels) is_mixed = is_mixed || corner_of(p) != corner;
        if (is_mixed) {
            ++n_mixed;
            continue;
        }
        is_found[static_cast<std::size_t>(corner)] = 1;
        EXPECT_LT((track.fit.point - scene.corners[static_cast<std::size_t>(corner)].position).norm(), 0.006);
        EXPECT_EQ(track.kind == MatchKind::kGround, scene.corners[static_cast<std::size_t>(corner)].is_ground);
    }
    EXPECT_LE(n_mixed, 4);
    EXPECT_GE(std::count(is_found.begin(), is_found.end(), 1), 110);
}

TEST(Tracks, of_two_views_are_in_doubt_when_they_meet_loosely_or_stand_alone)
{
    std::mt19937 rng(kSeed);
    const std::vector<Corner> corners = {{{0.10, 0.10, 0.10}, false, 0}, {{0.12, 0.10, 0.10}, false, 0}};
    Scene scene = make_scene(corners, margin_of(0, 0), 0, &rng);
    ASSERT_EQ(scene.shown[1].size(), 2u);
    ASSERT_EQ(scene.shown[3].size(), 2u);
    const auto track = [](int junction) {
        Track t;
        t.pixels = {{1, junction}, {3, junction}};
        return t;
    };
    const auto settle = [&](const std::vector<Track> &tracks) {
        return settle_tracks(scene.views, scene.truth, {}, tracks, kArea, {});
    };
    for (const Track &t : settle({track(0), track(1)})) EXPECT_FALSE(t.is_doubtful);
    const std::vector<Track> alone = settle({track(0)});
    ASSERT_EQ(alone.size(), 1u) << "kept as a sign all the same";
    EXPECT_TRUE(alone[0].is_doubtful);
    // Off the epipolar line, whichever way that runs, by more than two pixels of noise: still near enough to be kept.
    int n_doubted = 0;
    const oc_junction_t at_rest = scene.views[3].junctions[0];
    for (const double angle : {0.0, 45.0, 90.0, 135.0}) {
        scene.views[3].junctions[0].x_px = at_rest.x_px + static_cast<float>(2.5 * std::cos(angle * kDegree));
        scene.views[3].junctions[0].y_px = at_rest.y_px + static_cast<float>(2.5 * std::sin(angle * kDegree));
        for (const Track &t : settle({track(0), track(1)})) n_doubted += t.is_doubtful;
    }
    EXPECT_GE(n_doubted, 1);
    EXPECT_LE(n_doubted, 4) << "along the line nothing can be told";
}

} // namespace
} // namespace outcrop
