// SPDX-License-Identifier: BSD-3-Clause
// Matches of whole views on a ray-cast scene: which, where, of what kind; and how pose errors are learnt.
#include "site/match.h"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "site/pair_errors.h"
#include "textured_scene.h"

namespace outcrop {
namespace {

struct Scene {
    std::vector<View> views;
    std::vector<std::vector<int>> corner_of; // of each view's junctions
};

// Views at these azimuths, with the junctions of all corners they see.
Scene scene_of(const std::vector<double> &azimuths_deg)
{
    Scene s;
    for (const double azimuth : azimuths_deg) {
        s.views.push_back(scene::render(static_cast<int>(s.views.size()), scene::on_ring(azimuth)));
        s.corner_of.push_back(scene::add_junctions(scene::corners(), &s.views.back()));
    }
    return s;
}

// Moves reported poses inside margins and reports those.
void perturb(Scene *s, double metres, double radians, unsigned seed)
{
    std::mt19937 rng(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (View &view : s->views) {
        double by[6];
        for (int i = 0; i < 6; i++) {
            view.margin.v[i] = i < 3 ? metres : radians;
            by[i] = view.margin.v[i] * uniform(rng);
        }
        view.camera = scene::moved(view.camera, by);
    }
}

PairResult match_views(const Scene &s, int left, int right, const MatchOptions &options = {})
{
    const PreparedView l(as_reported(s.views[left]), options.correlate);
    const PreparedView r(as_reported(s.views[right]), options.correlate);
    return match_pair(l, r, scene::area(), options);
}

// Of the first two views.
std::vector<Match> matches_of(const Scene &s, const MatchOptions &options = {})
{
    return match_views(s, 0, 1, options).pair.matches;
}

int common_corners(const Scene &s, int left, int right)
{
    int n = 0;
    for (const int a : s.corner_of[left]) {
        for (const int b : s.corner_of[right]) n += a == b ? 1 : 0;
    }
    return n;
}

bool is_true(const Scene &s, int left, int right, const Match &match)
{
    return s.corner_of[left][match.left_junction] == s.corner_of[right][match.right_junction];
}

TEST(MatchPair, FindsNearlyAllAndNothingElse)
{
    const Scene s = scene_of({25, 55});
    const PairResult result = match_views(s, 0, 1);
    const int possible = common_corners(s, 0, 1);
    ASSERT_GT(possible, 25);
    EXPECT_GE(static_cast<int>(result.pair.matches.size()), possible * 9 / 10);
    ASSERT_EQ(result.planes.size(), result.pair.matches.size());
    for (const Match &match : result.pair.matches) {
        EXPECT_TRUE(is_true(s, 0, 1, match));
        EXPECT_GT(match.score, 0.8);
        EXPECT_GE(match.margin, 0.05);
    }
}

TEST(MatchPair, PointsAndKindsAreTheScenes)
{
    const Scene s = scene_of({25, 55});
    int n_ground = 0;
    for (const Match &match : matches_of(s)) {
        const scene::Corner corner = scene::corners()[s.corner_of[0][match.left_junction]];
        EXPECT_LT((match.point - corner.point).norm(), 1e-4);
        EXPECT_EQ(match.kind == MatchKind::kGround, corner.face == 6) << match.point.transpose();
        n_ground += match.kind == MatchKind::kGround ? 1 : 0;
    }
    EXPECT_GT(n_ground, 3);
}

TEST(MatchPair, CovarianceIsThatOfNoisyPixels)
{
    Scene s = scene_of({25, 55});
    const Scene exact = s;
    std::mt19937 rng(7);
    std::normal_distribution<float> noise(0.0F, 0.5F);
    MatchOptions options;
    options.strip.sigma_px = 0.5;
    double sum = 0;
    int n = 0;
    for (int trial = 0; trial < 4; trial++) {
        s = exact;
        for (View &view : s.views) {
            for (oc_junction_t &j : view.junctions) {
                j.x_px += noise(rng);
                j.y_px += noise(rng);
            }
        }
        for (const Match &match : matches_of(s, options)) {
            if (!is_true(s, 0, 1, match)) continue;
            const Eigen::Vector3d off = match.point - scene::corners()[s.corner_of[0][match.left_junction]].point;
            sum += off.dot(match.covariance.ldlt().solve(off));
            n++;
        }
    }
    // Squared Mahalanobis distance with three degrees of freedom, less what the strip's gate cuts away.
    ASSERT_GT(n, 60);
    EXPECT_NEAR(sum / n, 3.0, 0.7) << "seed 7";
}

TEST(MatchPair, PoseErrorsInsideTheMarginsAreEndured)
{
    for (const unsigned seed : {1U, 2U, 3U}) {
        Scene s = scene_of({25, 55});
        perturb(&s, 0.01, 0.0175, seed);
        const PairResult result = match_views(s, 0, 1);
        int n_true = 0;
        for (const Match &match : result.pair.matches) n_true += is_true(s, 0, 1, match) ? 1 : 0;
        EXPECT_GE(n_true, common_corners(s, 0, 1) * 7 / 10) << "seed " << seed;
        EXPECT_GE(n_true, static_cast<int>(result.pair.matches.size()) * 95 / 100) << "seed " << seed;
    }
}

TEST(MatchPair, ATwinCornerMakesAMatchAmbiguous)
{
    Scene s = scene_of({25, 55});
    const PairResult before = match_views(s, 0, 1);
    ASSERT_FALSE(before.pair.matches.empty());
    const Match &match = before.pair.matches.front();
    // The same pixels once more, 24 px on along the epipolar line.
    View &right = s.views[1];
    const oc_junction_t own = right.junctions[match.right_junction];
    oc_pair_t pair;
    oc_strip_t strip;
    ASSERT_TRUE(prepare_pair(as_reported(s.views[0]), as_reported(right), StripOptions{}, &pair));
    const oc_junction_t &l = s.views[0].junctions[match.left_junction];
    ASSERT_EQ(oc_strip_prepare(&pair, l.x_px, l.y_px, &strip), OC_OK);
    const int dx = static_cast<int>(std::lround(-26 * strip.line[1]));
    const int dy = static_cast<int>(std::lround(26 * strip.line[0]));
    for (const int sign : {1, -1}) {
        const int x = static_cast<int>(own.x_px) - 13;
        const int y = static_cast<int>(own.y_px) - 13;
        const cv::Mat1b window = right.grey(cv::Rect(x, y, 27, 27)).clone();
        window.copyTo(right.grey(cv::Rect(x + sign * dx, y + sign * dy, 27, 27)));
        oc_junction_t twin = own;
        twin.x_px += static_cast<float>(sign * dx);
        twin.y_px += static_cast<float>(sign * dy);
        right.junctions.push_back(twin);
        s.corner_of[1].push_back(-1);
    }
    for (const Match &after : matches_of(s)) EXPECT_NE(after.left_junction, match.left_junction);
}

TEST(MatchPair, IsAFunctionOfItsInput)
{
    Scene s = scene_of({25, 55});
    perturb(&s, 0.01, 0.01, 5);
    const PairResult a = match_views(s, 0, 1);
    const PairResult b = match_views(s, 0, 1);
    ASSERT_EQ(a.pair.matches.size(), b.pair.matches.size());
    for (std::size_t i = 0; i < a.pair.matches.size(); i++) {
        EXPECT_EQ(a.pair.matches[i].left_junction, b.pair.matches[i].left_junction);
        EXPECT_EQ(a.pair.matches[i].score, b.pair.matches[i].score);
        EXPECT_EQ(a.pair.matches[i].point, b.pair.matches[i].point);
    }
}

TEST(MatchPair, ViewsFromOnePlaceHaveNoMatches)
{
    const Scene s = scene_of({25, 25});
    EXPECT_TRUE(match_views(s, 0, 1).pair.matches.empty());
}

TEST(MatchPair, TheThesisMethodMatchesTheSceneToo)
{
    Scene s = scene_of({25, 50});
    for (View &view : s.views) {
        for (int i = 0; i < 6; i++) view.margin.v[i] = 0.005; // its strip has no width without
    }
    const PairResult result = match_views(s, 0, 1, thesis_match_options());
    int n_true = 0;
    for (const Match &match : result.pair.matches) n_true += is_true(s, 0, 1, match) ? 1 : 0;
    EXPECT_GE(n_true, common_corners(s, 0, 1) / 2);
    EXPECT_GE(n_true, static_cast<int>(result.pair.matches.size()) * 8 / 10);
}

// ---- third views ----

TEST(ThirdViews, AWrongMatchIsDroppedAndTrueOnesStay)
{
    const Scene s = scene_of({25, 55, 40, 10});
    const MatchOptions options;
    std::vector<PreparedView> prepared;
    for (const View &view : s.views) prepared.emplace_back(as_reported(view), options.correlate);
    std::vector<const PreparedView *> all;
    for (const PreparedView &view : prepared) all.push_back(&view);
    PairResult result = match_pair(prepared[0], prepared[1], scene::area(), options);
    const std::size_t n = result.pair.matches.size();
    ASSERT_GT(n, 20u);

    // A corner of the top claimed to be 10 cm higher than it is.
    std::size_t wrong = 0;
    while (scene::corners()[s.corner_of[0][result.pair.matches[wrong].left_junction]].face != 5) wrong++;
    const int left_junction = result.pair.matches[wrong].left_junction;
    result.pair.matches[wrong].point.z() += 0.1;
    result.planes[wrong].d_m -= 0.1 * result.planes[wrong].n[2];
    EXPECT_GE(verify_with_third_views(prepared[0], prepared[1], all, options.correlate, {}, &result), 1);
    EXPECT_GE(result.pair.matches.size(), n * 9 / 10);
    EXPECT_EQ(result.planes.size(), result.pair.matches.size());
    for (const Match &match : result.pair.matches) EXPECT_NE(match.left_junction, left_junction);
}

TEST(ThirdViews, ThePairItselfHasNoSay)
{
    const Scene s = scene_of({25, 55});
    const MatchOptions options;
    const PreparedView left(as_reported(s.views[0]), options.correlate);
    const PreparedView right(as_reported(s.views[1]), options.correlate);
    PairResult result = match_pair(left, right, scene::area(), options);
    ASSERT_FALSE(result.pair.matches.empty());
    result.pair.matches[0].point.z() += 0.1;
    EXPECT_EQ(verify_with_third_views(left, right, {&left, &right}, options.correlate, {}, &result), 0);
}

// ---- pose errors of a pair ----

class PairErrorsTest : public testing::Test {
protected:
    // n true matches of points in the box's room and n_wrong random ones, seen by moved cameras.
    void make(int n, int n_wrong, unsigned seed)
    {
        std::mt19937 rng(seed);
        std::uniform_real_distribution<double> u(-1, 1);
        std::normal_distribution<double> noise(0, 0.5);
        const oc_camera_t exact[2] = {scene::on_ring(20), scene::on_ring(50)};
        View views[2];
        for (int k = 0; k < 2; k++) {
            double by[6];
            for (int i = 0; i < 6; i++) {
                views[k].margin.v[i] = i < 3 ? 0.01 : 0.0175;
                by[i] = views[k].margin.v[i] * u(rng);
            }
            views[k].camera = scene::moved(exact[k], by);
        }
        StripOptions options;
        options.sigma_px = 0.5;
        ASSERT_TRUE(prepare_pair(as_reported(views[0]), as_reported(views[1]), options, &pair_));
        for (int i = 0; i < n + n_wrong; i++) {
            const Eigen::Vector3d point(0.4 * u(rng), 0.4 * u(rng), 0.2 + 0.2 * u(rng));
            PairErrors::PixelPair m{};
            oc_camera_project(&exact[0], point.data(), &m.x_px, &m.y_px);
            oc_camera_project(&exact[1], point.data(), &m.x2_px, &m.y2_px);
            for (double *v : {&m.x_px, &m.y_px, &m.x2_px, &m.y2_px}) *v += noise(rng);
            if (i >= n) {
                m.x2_px += 40 * u(rng);
                m.y2_px += 40 * u(rng);
            }
            (i < n ? right_ : wrong_).push_back(m);
        }
    }

    oc_pair_t pair_{};
    std::vector<PairErrors::PixelPair> right_, wrong_;
};

TEST_F(PairErrorsTest, WithoutMatchesTheStripIsThatOfTheMargins)
{
    make(40, 0, 1);
    PairErrors errors(pair_);
    errors.fit({});
    for (const auto &m : right_) {
        oc_strip_t strip;
        ASSERT_EQ(oc_strip_prepare(&pair_, m.x_px, m.y_px, &strip), OC_OK);
        const double d = oc_strip_distance_px(&strip, m.x2_px, m.y2_px);
        const double deviation = std::abs(d) / std::sqrt(oc_strip_variance_px2(&strip, m.x2_px, m.y2_px));
        EXPECT_NEAR(errors.deviation(m), deviation, 0.03 + 0.05 * deviation);
    }
}

TEST_F(PairErrorsTest, MatchesShrinkTheStripRoundTheTruth)
{
    for (const unsigned seed : {1U, 2U, 3U, 4U}) {
        right_.clear();
        wrong_.clear();
        make(60, 15, seed);
        std::vector<PairErrors::PixelPair> seen(right_.begin(), right_.begin() + 30);
        seen.insert(seen.end(), wrong_.begin(), wrong_.end());
        PairErrors errors(pair_);
        PairErrors before(pair_);
        errors.fit(seen);
        int n_kept = 0;
        int n_let_in = 0;
        int n_let_in_before = 0;
        for (std::size_t i = 30; i < right_.size(); i++) n_kept += errors.deviation(right_[i]) < 2.58 ? 1 : 0;
        for (const auto &m : wrong_) {
            n_let_in += errors.deviation(m) < 2.58 ? 1 : 0;
            n_let_in_before += before.deviation(m) < 2.58 ? 1 : 0;
        }
        EXPECT_GE(n_kept, 27) << "seed " << seed;
        EXPECT_LT(n_let_in, n_let_in_before) << "seed " << seed;
        EXPECT_LE(n_let_in, 5) << "seed " << seed;
    }
}

} // namespace
} // namespace outcrop
