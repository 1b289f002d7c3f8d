// SPDX-License-Identifier: BSD-3-Clause
// The bench's own parts: pictures against closed forms, counts against cases worked by hand.
#include "bench/picture.h"
#include "bench/random.h"
#include "bench/repeatability.h"
#include "bench/scenes.h"
#include "bench/score.h"
#include "bench/target.h"
#include "bench/warp.h"

#include <cmath>
#include <gmock/gmock.h>

namespace {

using namespace outcrop::bench;
using testing::DoubleNear;
using testing::SizeIs;

// ---- pictures

// Second antiderivative of the unit Gaussian's distribution function, times s^2.
double ramp2(double t, double s)
{
    const double u = t / s;
    const double density = std::exp(-u * u / 2) / std::sqrt(2 * kPi);
    const double share = std::erfc(-u / std::sqrt(2.0)) / 2;
    return s * s * ((u * u + 1) * share + u * density) / 2;
}

// Blurred half-plane seen by a square pixel: signed distance of the pixel's centre to the edge, inside positive. The
// square's shadow on the normal is two boxes of the widths |cos| and |sin| convolved.
double half_plane(double distance, double angle)
{
    const double a = std::abs(std::cos(angle)) / 2, b = std::abs(std::sin(angle)) / 2;
    return (ramp2(distance + a + b, kBlurPx) - ramp2(distance + a - b, kBlurPx) - ramp2(distance - a + b, kBlurPx) +
            ramp2(distance - a - b, kBlurPx)) /
           (4 * a * b);
}

TEST(picture, edges_are_where_they_are_said_to_be)
{
    for (int i = 0; i < 40; i++) {
        const double angle = 0.05 + i * (2 * kPi / 40); // never along an axis, where the closed form divides by 0
        const cv::Point2d normal(std::cos(angle), std::sin(angle)), along(-normal.y, normal.x);
        const cv::Point2d on_edge(19.5 + 0.37 * std::sin(3.0 * i), 19.5 + 0.41 * std::cos(5.0 * i));
        const Polygon half{{on_edge + 300 * along, on_edge - 300 * along, on_edge - 300 * along + 300 * normal,
                            on_edge + 300 * along + 300 * normal},
                           150};
        const cv::Mat image = render({40, 40, 50, {half}});
        for (int y = 0; y < image.rows; y++) {
            for (int x = 0; x < image.cols; x++) {
                const double distance = (cv::Point2d(x, y) - on_edge).dot(normal);
                // 52 grey levels per px where the edge is steepest: 0.002 px.
                ASSERT_THAT(static_cast<double>(image.at<float>(y, x)),
                            DoubleNear(50 + 100 * half_plane(distance, angle), 0.1))
                    << "at " << x << ' ' << y << ", angle " << angle;
            }
        }
    }
}

TEST(picture, either_way_round_and_from_outside_the_image_it_is_the_same)
{
    const std::vector<cv::Point2d> there = {{-50, -20}, {90, 5}, {20, 70}};
    const std::vector<cv::Point2d> back(there.rbegin(), there.rend());
    EXPECT_LT(cv::norm(render({40, 40, 50, {{there, 150}}}), render({40, 40, 50, {{back, 150}}}), cv::NORM_INF), 1e-3);
}

TEST(picture, keeps_the_area_of_what_is_wholly_inside)
{
    const cv::Mat image = render({60, 50, 0, {{{{10.3, 9.1}, {44.7, 12.2}, {28.4, 38.6}}, 1}}});
    const double area = ((44.7 - 10.3) * (38.6 - 9.1) - (28.4 - 10.3) * (12.2 - 9.1)) / 2;
    EXPECT_THAT(cv::sum(image)[0], DoubleNear(area, 0.01));
}

TEST(picture, sectors_of_a_cell_leave_no_seam)
{
    for (Scene scene : make_cells(12)) {
        for (Polygon &sector : scene.picture.polygons) sector.level = 77;
        const cv::Mat image = render(scene.picture);
        EXPECT_LT(cv::norm(image, cv::Mat(image.size(), CV_32F, cv::Scalar(77)), cv::NORM_INF), 0.01);
    }
}

TEST(picture, moves_under_a_homography_as_its_points_do)
{
    const cv::Matx33d shift(1, 0, 4, 0, 1, -3, 0, 0, 1);
    const Picture still{40, 40, 50, {{{{10.3, 9.1}, {30.7, 12.2}, {20.4, 28.6}}, 150}}};
    const cv::Mat moved = render(transformed(still, shift, 40, 40));
    const cv::Mat before = render(still)(cv::Rect(6, 8, 24, 24)), after = moved(cv::Rect(10, 5, 24, 24));
    EXPECT_LT(cv::norm(before, after, cv::NORM_INF), 1e-3);
}

TEST(noise, has_the_variance_asked_for)
{
    const cv::Mat flat(400, 400, CV_32F, cv::Scalar(128));
    for (const double variance : {0.0, 100.0, 400.0, 1000.0}) {
        cv::Scalar mean, deviation;
        cv::meanStdDev(with_noise(flat, variance, kSeed), mean, deviation);
        EXPECT_THAT(mean[0], DoubleNear(128, 0.3));
        const double rounding = variance > 0 ? 1.0 / 12 : 0;
        EXPECT_THAT(deviation[0] * deviation[0], DoubleNear(variance + rounding, 0.015 * variance));
    }
}

// ---- warps

cv::Mat ramp(int width, int height)
{
    cv::Mat image(height, width, CV_8U);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(20 + x + 2 * y);
    }
    return image;
}

TEST(warp, puts_grey_where_the_homography_says)
{
    const cv::Mat image = ramp(70, 60);
    const cv::Matx33d views[] = {rotation_deg(15), rotation_deg(45), scaling(0.75), scaling(0.5), tilt_deg(40, 127)};
    for (const cv::Matx33d &view : views) {
        const cv::Matx33d matrix = about_middle(view, image.cols, image.rows);
        const cv::Mat seen = warped(image, matrix, image.size());
        for (int y = 12; y < 48; y++) {
            for (int x = 20; x < 50; x++) {
                const cv::Point2d from = transformed(cv::Point2d(x, y), matrix.inv());
                if (from.x < 6 || from.y < 6 || from.x > 63 || from.y > 53) continue;
                // Rounding to whole grey levels, twice; half a pixel would be 0.5 and 1 more.
                EXPECT_NEAR(seen.at<std::uint8_t>(y, x), 20 + from.x + 2 * from.y, 0.8);
            }
        }
    }
}

TEST(warp, tilts_as_a_pinhole_camera_does)
{
    // The point 100 px right of the middle on a plane leant back by 60 degrees, seen from 800 px away.
    const cv::Point2d seen = transformed(cv::Point2d(100, 0), tilt_deg(60, 0));
    EXPECT_THAT(seen.x, DoubleNear(800 * 50 / (800 + 100 * std::sqrt(0.75)), 1e-9));
    EXPECT_THAT(transformed(cv::Point2d(0, 0), tilt_deg(60, 33)).x, DoubleNear(0, 1e-12));
}

TEST(repeatability, counts_what_both_views_see_and_no_more)
{
    const Views views{{100, 100}, {100, 100}, {1, 0, 30, 0, 1, 0, 0, 0, 1}}; // 30 px to the right
    const auto at = [](double x, double y) { return Found{{x, y}, 1, {}, OC_KIND_OTHER}; };
    const std::vector<Found> first = {at(20, 50), at(80, 50) /* leaves */, at(40, 50), at(30, 30), at(5, 50)};
    const std::vector<Found> second = {at(51, 50), at(20, 50) /* comes in */, at(73, 50), at(61, 31)};
    int n = 100;
    EXPECT_DOUBLE_EQ(share_repeated(views, first, second, &n), 2.0 / 3); // 3 px off is not found again
    EXPECT_EQ(n, 3);
    n = 1;
    EXPECT_DOUBLE_EQ(share_repeated(views, first, second, &n), 1);
    EXPECT_EQ(n, 1);
    EXPECT_DOUBLE_EQ(share_repeated(views, first, {}, &n), 0);
    EXPECT_EQ(n, 0);
}

// ---- scenes

TEST(scenes, hold_what_they_promise)
{
    int n_of_kind[OC_KIND_X + 1] = {};
    for (const Scene &scene : make_cells(60)) n_of_kind[kind_of(scene.junctions.at(0))]++;
    EXPECT_THAT(n_of_kind, testing::ElementsAre(0, 20, 10, 10, 20));
    EXPECT_THAT(make_set("cells-T", true), SizeIs(20));
    for (const Scene &scene : make_chessboards(2)) {
        for (const TrueJunction &junction : scene.junctions) {
            EXPECT_EQ(kind_of(junction), OC_KIND_X);
            EXPECT_THAT(junction.angle_rad, SizeIs(4));
        }
    }
    for (const Scene &scene : make_triangles(20)) {
        double sum = 0;
        for (const TrueJunction &junction : scene.junctions)
            sum += turn_between(junction.angle_rad.at(0), junction.angle_rad.at(1));
        EXPECT_THAT(sum, DoubleNear(kPi, 1e-9));
    }
}

TEST(scenes, are_the_same_every_time)
{
    const Scene first = make_polygons(1).at(0), again = make_polygons(1).at(0);
    ASSERT_EQ(first.junctions.size(), again.junctions.size());
    for (std::size_t i = 0; i < first.junctions.size(); i++)
        EXPECT_EQ(first.junctions[i].at_px, again.junctions[i].at_px);
    EXPECT_NE(make_polygons(1, 1).at(0).junctions.at(0).at_px, first.junctions[0].at_px);
}

// ---- counts

TEST(pairing, takes_the_nearest_first_and_each_once)
{
    const std::vector<Pairing> pairs = pair_points({{0, 0}, {3, 0}}, {{1.5, 0}, {0.4, 0}, {9, 9}}, 2);
    ASSERT_THAT(pairs, SizeIs(2));
    EXPECT_EQ(pairs[0].truth, 0);
    EXPECT_EQ(pairs[0].found, 1);
    EXPECT_EQ(pairs[1].truth, 1);
    EXPECT_EQ(pairs[1].found, 0);
    EXPECT_THAT(pairs[1].distance, DoubleNear(1.5, 1e-12));
}

TEST(pairing, of_directions_goes_round_zero)
{
    const std::vector<Pairing> pairs = pair_angles({0.05, 3}, {6.25, 3.5}, kMatchAngle);
    ASSERT_THAT(pairs, SizeIs(1));
    EXPECT_EQ(pairs[0].found, 0);
    EXPECT_THAT(pairs[0].distance, DoubleNear(0.05 + 2 * kPi - 6.25, 1e-12));
}

Scene two_corners()
{
    const double quarter = kPi / 2;
    return {{100, 100, 0, {}},
            {{{30, 30}, {0, quarter}, true}, {{70, 70}, {0, quarter}, true}, {{30, 70}, {0, quarter}, false}},
            8};
}

TEST(tally, counts_as_one_does_by_hand)
{
    Tally tally;
    tally.add(two_corners(), {
                                 {{31, 30}, 9, {0.1, kPi / 2 + 0.3}, OC_KIND_L}, // found, one branch 17 degrees off
                                 {{31.5, 30}, 8, {0, kPi / 2}, OC_KIND_L},       // the same once more: false
                                 {{50, 50}, 7, {0, kPi / 2}, OC_KIND_L},         // false
                                 {{33, 72}, 6, {0, kPi / 2}, OC_KIND_L},         // near one that does not count
                                 {{2, 50}, 5, {0, kPi / 2}, OC_KIND_L},          // in the margin
                             });
    const std::map<std::string, double> figures = tally.figures();
    EXPECT_DOUBLE_EQ(figures.at("n_truth"), 2);
    EXPECT_DOUBLE_EQ(figures.at("n_found"), 3);
    EXPECT_DOUBLE_EQ(figures.at("recall"), 0.5);
    EXPECT_DOUBLE_EQ(figures.at("precision"), 1.0 / 3);
    EXPECT_DOUBLE_EQ(figures.at("rmse_px"), 1);
    EXPECT_DOUBLE_EQ(figures.at("branch_recall"), 0.5);
    EXPECT_DOUBLE_EQ(figures.at("branch_precision"), 0.5);
    EXPECT_THAT(figures.at("angle_rmse_deg"), DoubleNear(0.1 / kDegree, 1e-9));
    EXPECT_DOUBLE_EQ(figures.at("kind_confusion"), 0);
    EXPECT_EQ(figures.count("l_bias_deg"), 0u);
}

TEST(tally, of_a_corner_found_too_wide_has_a_positive_bias)
{
    Tally tally;
    tally.add(two_corners(), {{{30, 30}, 9, {kPi / 2 + 0.02, 2 * kPi - 0.01}, OC_KIND_T}});
    EXPECT_THAT(tally.figures().at("l_bias_deg"), DoubleNear(0.03 / kDegree, 1e-9));
    EXPECT_DOUBLE_EQ(tally.figures().at("kind_confusion"), 1);
}

TEST(tally, of_nothing_found_has_no_errors_to_show)
{
    Tally tally;
    tally.add(two_corners(), {});
    EXPECT_DOUBLE_EQ(tally.figures().at("recall"), 0);
    EXPECT_EQ(tally.figures().count("precision"), 0u);
    EXPECT_EQ(tally.figures().count("rmse_px"), 0u);
}

TEST(target, that_is_not_measured_is_missed)
{
    const std::vector<Target> targets = {{"recall", true, 0.9, 2}, {"rmse_px", false, 0.1, 2}};
    const std::vector<Verdict> verdicts = judge(targets, {{"recall", 0.9}});
    EXPECT_TRUE(verdicts.at(0).is_met);
    EXPECT_FALSE(verdicts.at(1).is_met);
    EXPECT_FALSE(judge(targets, {{"rmse_px", std::nan("")}}).at(1).is_met);
    EXPECT_EQ(to_text(judge(targets, {{"recall", 0.8}, {"rmse_px", 0.1}})),
              "recall >= 0.9: MISSED by 0.1; rmse_px <= 0.1: met");
}

} // namespace
