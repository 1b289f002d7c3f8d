// SPDX-License-Identifier: BSD-3-Clause
// Fundamental matrices by sampling against a scene whose geometry is known.
#include "site/fundamental.h"

#include <cmath>
#include <limits>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "core/epipolar.h"
#include "synthetic_site.h"

namespace outcrop {
namespace {

using Rng = std::mt19937;

Eigen::Vector2d seen(const oc_camera_t &camera, const Eigen::Vector3d &point)
{
    Eigen::Vector2d px;
    EXPECT_GT(oc_camera_project(&camera, point.data(), &px.x(), &px.y()), 0);
    return px;
}

// Points of a volume 0.3 m wide and high, seen by two of the thesis' cameras.
std::vector<PixelPair> volume(int n, Rng *rng, double noise_px = 0, double height_m = 0.3)
{
    const oc_camera_t left = synthetic::thesis_camera(5), right = synthetic::thesis_camera(6);
    std::uniform_real_distribution<double> uniform(0, 1);
    std::normal_distribution<double> noise(0, 1);
    std::vector<PixelPair> out;
    for (int i = 0; i < n; i++) {
        const Eigen::Vector3d point(0.3 * uniform(*rng), 0.3 * uniform(*rng), height_m * uniform(*rng));
        PixelPair m = {seen(left, point), seen(right, point)};
        for (Eigen::Vector2d *px : {&m.left_px, &m.right_px})
            *px += noise_px * Eigen::Vector2d(noise(*rng), noise(*rng));
        out.push_back(m);
    }
    return out;
}

// Matches of nothing: pixels anywhere.
void spoil(std::vector<PixelPair> *matches, int n, Rng *rng)
{
    std::uniform_real_distribution<double> x(0, 640), y(0, 480);
    for (int i = 0; i < n; i++) (*matches)[static_cast<std::size_t>(i)].right_px = {x(*rng), y(*rng)};
}

double worst_px(const Eigen::Matrix3d &F, const std::vector<PixelPair> &points)
{
    double worst = 0;
    for (const PixelPair &p : points) worst = std::max(worst, std::abs(epipolar_distance_px(F, p)));
    return worst;
}

TEST(FundamentalBySevenPoints, IsExactWithoutNoiseOnPointsItHasNotSeen)
{
    for (unsigned seed = 1; seed <= 20; seed++) {
        SCOPED_TRACE(seed);
        Rng rng(seed);
        const auto fit = fundamental_by_seven_points(volume(30, &rng));
        ASSERT_TRUE(fit);
        EXPECT_EQ(fit->n_inliers, 30);
        EXPECT_LT(worst_px(fit->F, volume(200, &rng)), 1e-2); // some seven points lie badly
        EXPECT_NEAR(fit->F.norm(), 1, 1e-12);
        EXPECT_NEAR(fit->F.determinant(), 0, 1e-12);
    }
}

TEST(FundamentalBySevenPoints, LeavesOutWhatIsNoMatch)
{
    for (unsigned seed = 1; seed <= 20; seed++) {
        SCOPED_TRACE(seed);
        Rng rng(seed);
        std::vector<PixelPair> matches = volume(60, &rng);
        spoil(&matches, 24, &rng);
        const auto fit = fundamental_by_seven_points(matches);
        ASSERT_TRUE(fit);
        for (std::size_t i = 24; i < matches.size(); i++) EXPECT_TRUE(fit->is_inlier[i]) << i;
        EXPECT_LT(fit->n_inliers, 36 + 8); // a wrong one may lie near its line by chance
        EXPECT_LT(worst_px(fit->F, volume(200, &rng)), FundamentalOptions().t_f_px);
    }
}

TEST(FundamentalBySevenPoints, SupportIsCountedByTheDistanceFromTheLine)
{
    Rng rng(7);
    FundamentalOptions options;
    options.t_f_px = 1.5;
    const std::vector<PixelPair> matches = volume(40, &rng, 1.0);
    const auto fit = fundamental_by_seven_points(matches, options);
    ASSERT_TRUE(fit);
    int n = 0;
    for (std::size_t i = 0; i < matches.size(); i++) {
        const Eigen::Vector3d l = fit->F * matches[i].left_px.homogeneous();
        const double distance = std::abs(l.dot(matches[i].right_px.homogeneous())) / l.head<2>().norm();
        EXPECT_EQ(fit->is_inlier[i] != 0, distance < options.t_f_px) << i;
        n += fit->is_inlier[i];
    }
    EXPECT_EQ(n, fit->n_inliers);
}

TEST(FundamentalBySevenPoints, TheSameSeedGivesTheSameMatrix)
{
    Rng rng(3);
    std::vector<PixelPair> matches = volume(50, &rng, 0.7);
    spoil(&matches, 20, &rng);
    const auto one = fundamental_by_seven_points(matches), two = fundamental_by_seven_points(matches);
    ASSERT_TRUE(one && two);
    EXPECT_EQ(one->F, two->F);
    EXPECT_EQ(one->n_samples, two->n_samples);
}

// Why it is a baseline only: points near one plane do not determine it, however right they are.
TEST(FundamentalBySevenPoints, PointsNearOnePlaneDoNotDetermineIt)
{
    double sum_flat = 0, sum_deep = 0;
    for (unsigned seed = 1; seed <= 10; seed++) {
        Rng rng(seed);
        const auto flat = fundamental_by_seven_points(volume(40, &rng, 0.7, 0.005));
        const auto deep = fundamental_by_seven_points(volume(40, &rng, 0.7));
        ASSERT_TRUE(flat && deep);
        const std::vector<PixelPair> points = volume(200, &rng);
        sum_flat += worst_px(flat->F, points);
        sum_deep += worst_px(deep->F, points);
    }
    EXPECT_GT(sum_flat, 3 * sum_deep);
}

TEST(FundamentalByMagsac, IsRightWithWrongMatchesAmongThem)
{
    for (unsigned seed = 1; seed <= 10; seed++) {
        SCOPED_TRACE(seed);
        Rng rng(seed);
        std::vector<PixelPair> matches = volume(80, &rng, 0.3);
        spoil(&matches, 24, &rng);
        const auto fit = fundamental_by_magsac(matches);
        ASSERT_TRUE(fit);
        EXPECT_GE(fit->n_inliers, 54);
        EXPECT_LT(worst_px(fit->F, volume(200, &rng)), 5);
    }
}

TEST(Fundamental, TooFewOrSenselessMatchesGiveNone)
{
    Rng rng(5);
    for (int n = 0; n <= 7; n++) {
        EXPECT_FALSE(fundamental_by_seven_points(volume(n, &rng))) << n;
        EXPECT_FALSE(fundamental_by_magsac(volume(n, &rng))) << n;
    }
    std::vector<PixelPair> matches = volume(20, &rng);
    matches[3].right_px.x() = std::numeric_limits<double>::quiet_NaN();
    EXPECT_FALSE(fundamental_by_seven_points(matches));
    EXPECT_FALSE(fundamental_by_magsac(matches));
}

TEST(Fundamental, OnePlaceManyTimesIsEndured)
{
    const std::vector<PixelPair> same(30, PixelPair{{100, 100}, {200, 120}});
    for (const auto &fit : {fundamental_by_seven_points(same), fundamental_by_magsac(same)})
        EXPECT_TRUE(!fit || fit->F.allFinite());
}

TEST(Fundamental, OptionsOutOfRangeAreRefused)
{
    Rng rng(1);
    const auto matches = volume(20, &rng);
    FundamentalOptions bad;
    bad.t_f_px = 0;
    EXPECT_THROW(fundamental_by_seven_points(matches, bad), std::invalid_argument);
    bad = {};
    bad.confidence = 1;
    EXPECT_THROW(fundamental_by_magsac(matches, bad), std::invalid_argument);
    bad = {};
    bad.max_samples = 0;
    EXPECT_THROW(fundamental_by_seven_points(matches, bad), std::invalid_argument);
}

} // namespace
} // namespace outcrop
