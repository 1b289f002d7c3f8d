// SPDX-License-Identifier: BSD-3-Clause
// Homographic correlation on a ray-cast scene whose planes are known.
#include "site/correlate.h"

#include <cmath>
#include <limits>
#include <stdexcept>

#include <gtest/gtest.h>

#include "site/strip.h"
#include "textured_scene.h"

namespace outcrop {
namespace {

// Two views 36 degrees apart and the corners that both see, same index in both.
class CorrelateTest : public testing::Test {
protected:
    CorrelateTest()
    {
        left_ = scene::render(0, scene::on_ring(25));
        right_ = scene::render(1, scene::on_ring(61));
        Eigen::Vector3d c[2];
        oc_pose_centre(&left_.camera.pose, c[0].data());
        oc_pose_centre(&right_.camera.pose, c[1].data());
        for (const scene::Corner &corner : scene::corners()) {
            if (!scene::sees(left_, corner.point) || !scene::sees(right_, corner.point)) continue;
            // Branches along the epipolar lines have no direction in space.
            const Eigen::Vector3d epipolar = (c[0] - corner.point).cross(c[1] - corner.point).normalized();
            if (std::abs(epipolar.dot(corner.along_a)) < 0.2 || std::abs(epipolar.dot(corner.along_b)) < 0.2) continue;
            corners_.push_back(corner);
            left_.junctions.push_back(scene::junction_of(left_, corner));
            right_.junctions.push_back(scene::junction_of(right_, corner));
        }
    }

    // Score of left corner i with right corner k; 0 when there is none.
    double score(int i, int k, const CorrelateOptions &options)
    {
        const PreparedView left(as_reported(left_), options);
        const PreparedView right(as_reported(right_), options);
        oc_pair_t pair;
        EXPECT_TRUE(prepare_pair(left.posed(), right.posed(), StripOptions{}, &pair));
        const Correlator correlator(left, right, pair, options);
        const auto result = correlator.correlate(i, k, corners_[i].point);
        plane_ = result ? result->plane : oc_plane_t{};
        return result ? result->score : 0;
    }

    double mean_score(const CorrelateOptions &options)
    {
        double sum = 0;
        for (int i = 0; i < static_cast<int>(corners_.size()); i++) sum += score(i, i, options);
        return sum / static_cast<double>(corners_.size());
    }

    View left_, right_;
    std::vector<scene::Corner> corners_;
    oc_plane_t plane_{};
};

CorrelateOptions branches_only()
{
    CorrelateOptions options;
    options.with_extra_planes = false;
    return options;
}

TEST_F(CorrelateTest, TrueMatchesOfAllFacesAreAlike)
{
    ASSERT_GT(corners_.size(), 25u);
    for (int i = 0; i < static_cast<int>(corners_.size()); i++) {
        EXPECT_GT(score(i, i, branches_only()), 0.85) << "corner " << i << " of face " << corners_[i].face;
    }
}

TEST_F(CorrelateTest, ThePlaneIsThatOfTheFace)
{
    for (int i = 0; i < static_cast<int>(corners_.size()); i++) {
        ASSERT_GT(score(i, i, branches_only()), 0.85);
        const Eigen::Vector3d normal = corners_[i].along_a.cross(corners_[i].along_b).normalized();
        EXPECT_GT(std::abs(normal.dot(Eigen::Vector3d::Map(plane_.n))), 0.999) << i;
        EXPECT_NEAR(Eigen::Vector3d::Map(plane_.n).dot(corners_[i].point) + plane_.d_m, 0, 1e-9);
    }
}

TEST_F(CorrelateTest, OtherCornersAreNotAlike)
{
    int n_alike = 0;
    const int n = static_cast<int>(corners_.size());
    for (int i = 0; i < n; i++) n_alike += score(i, (i + n / 2) % n, CorrelateOptions{}) > 0.8 ? 1 : 0;
    EXPECT_EQ(n_alike, 0);
}

TEST_F(CorrelateTest, UprightSquaresAreLessAlikeThanWarpedOnes)
{
    CorrelateOptions upright;
    upright.warp = Warp::kNone;
    EXPECT_LT(mean_score(upright), mean_score(branches_only()) - 0.2);
}

// Its two branches have one direction in space; what they seem to bend by, 9 degrees here, is their error.
TEST_F(CorrelateTest, ABarOfATSpansNoPlane)
{
    for (View *view : {&left_, &right_}) {
        for (oc_junction_t &junction : view->junctions) {
            const double opposite = static_cast<double>(junction.branch[0].angle_rad) + CV_PI + 0.16;
            junction.branch[1].angle_rad = static_cast<float>(std::fmod(opposite, 2 * CV_PI));
        }
    }
    CorrelateOptions options = branches_only();
    options.min_bend_sine = 0.01; // which alone would let them pass
    for (int i = 0; i < static_cast<int>(corners_.size()); i++) EXPECT_EQ(score(i, i, options), 0);
}

TEST_F(CorrelateTest, AnchoringMattersWhenPosesAreWrong)
{
    const double error[6] = {0.01, -0.01, 0.01, 0.014, -0.014, 0.014};
    right_.camera = scene::moved(right_.camera, error);
    CorrelateOptions unanchored = branches_only();
    unanchored.warp = Warp::kUnanchored;
    const double anchored_score = mean_score(branches_only());
    EXPECT_GT(anchored_score, 0.85);
    EXPECT_LT(mean_score(unanchored), anchored_score - 0.3);
}

TEST_F(CorrelateTest, ExtraPlanesHelpWhereBranchesAreWrong)
{
    for (oc_junction_t &junction : right_.junctions) {
        for (oc_branch_t &branch : junction.branch) branch.angle_rad += 0.9F;
    }
    EXPECT_GT(mean_score(CorrelateOptions{}), mean_score(branches_only()) + 0.1);
}

TEST_F(CorrelateTest, GainAndOffsetOfTheLightDoNotMatterToVnc)
{
    const double before = score(0, 0, branches_only());
    right_.grey.convertTo(right_.grey, CV_8U, 0.6, 40);
    EXPECT_NEAR(score(0, 0, branches_only()), before, 0.01);
}

TEST_F(CorrelateTest, SadPrefersTheTrueMatch)
{
    CorrelateOptions options = branches_only();
    options.measure = Measure::kSad;
    const int n = static_cast<int>(corners_.size());
    for (int i = 0; i < n; i++) {
        const double own = score(i, i, options);
        EXPECT_GT(own, 0.7) << i;
        EXPECT_GT(own, score(i, (i + n / 2) % n, options)) << i;
    }
}

TEST_F(CorrelateTest, TheWedgeIgnoresWhatLiesOutsideIt)
{
    // Strange pixels opposite to the wedge of corner 0, in the right view only.
    const oc_junction_t &j = right_.junctions[0];
    const double a = j.branch[0].angle_rad;
    const double b = j.branch[1].angle_rad;
    const Eigen::Vector2d away =
        -(Eigen::Vector2d(std::cos(a), std::sin(a)) + Eigen::Vector2d(std::cos(b), std::sin(b)));
    for (int y = 0; y < right_.grey.rows; y++) {
        for (int x = 0; x < right_.grey.cols; x++) {
            const Eigen::Vector2d offset(x - j.x_px, y - j.y_px);
            if (offset.norm() < 25 && offset.dot(away.normalized()) > 2.5) {
                right_.grey(y, x) = (x / 3 + y / 3) % 2 == 0 ? 0 : 255;
            }
        }
    }
    CorrelateOptions window = branches_only();
    window.gauss_sigma_px = 0;
    CorrelateOptions wedge = window;
    wedge.support = Support::kWedge;
    EXPECT_GT(score(0, 0, wedge), 0.9);
    EXPECT_LT(score(0, 0, window), 0.8);
}

TEST_F(CorrelateTest, UnknownPixelsAreNotCompared)
{
    const double before = score(3, 3, branches_only());
    ASSERT_GT(before, 0.9);
    // A strip of garbage that is marked unknown, then most of the window.
    const oc_junction_t &j = left_.junctions[3];
    const int x = static_cast<int>(j.x_px);
    const int y = static_cast<int>(j.y_px);
    left_.grey(cv::Rect(x - 12, y - 14, 25, 7)) = 255;
    left_.known(cv::Rect(x - 12, y - 14, 25, 7)) = 0;
    EXPECT_NEAR(score(3, 3, branches_only()), before, 0.05);
    left_.known(cv::Rect(x - 12, y - 14, 25, 20)) = 0;
    EXPECT_EQ(score(3, 3, branches_only()), 0);
}

TEST_F(CorrelateTest, AFlatWindowIsLikeNothing)
{
    const oc_junction_t &j = left_.junctions[2];
    left_.grey(cv::Rect(static_cast<int>(j.x_px) - 15, static_cast<int>(j.y_px) - 15, 31, 31)) = 90;
    EXPECT_EQ(score(2, 2, CorrelateOptions{}), 0);
}

TEST_F(CorrelateTest, TheGroundsPlaneExplainsGroundAndNotFaces)
{
    const CorrelateOptions options;
    const PreparedView left(as_reported(left_), options);
    const PreparedView right(as_reported(right_), options);
    oc_pair_t pair;
    ASSERT_TRUE(prepare_pair(left.posed(), right.posed(), StripOptions{}, &pair));
    const Correlator correlator(left, right, pair, options);
    int n_ground = 0;
    for (int i = 0; i < static_cast<int>(corners_.size()); i++) {
        const oc_plane_t level{{0, 0, 1}, -corners_[i].point.z()};
        const double level_score = correlator.score_on_plane(i, i, level).value_or(0);
        if (corners_[i].face >= 5) {
            EXPECT_GT(level_score, 0.9) << i;
        } else {
            EXPECT_LT(level_score, 0.8) << i;
        }
        n_ground += corners_[i].face == 6 ? 1 : 0;
    }
    EXPECT_GT(n_ground, 3);
}

TEST_F(CorrelateTest, RefusesBadOptionsAndPixelsOfAnotherSize)
{
    CorrelateOptions even;
    even.window_px = 20;
    EXPECT_THROW(PreparedView(as_reported(left_), even), std::invalid_argument);
    CorrelateOptions nan;
    nan.min_known = std::numeric_limits<double>::quiet_NaN();
    EXPECT_THROW(PreparedView(as_reported(left_), nan), std::invalid_argument);
    View small = left_;
    small.grey = cv::Mat1b(10, 10);
    EXPECT_THROW(PreparedView(as_reported(small), CorrelateOptions{}), std::invalid_argument);
    EXPECT_THROW(PreparedView(PosedView{}, CorrelateOptions{}), std::invalid_argument);
}

} // namespace
} // namespace outcrop
