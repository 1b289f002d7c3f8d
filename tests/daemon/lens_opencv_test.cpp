// SPDX-License-Identifier: BSD-3-Clause
// Lenses against OpenCV's own projection.
#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <random>
#include <vector>

#include "lens.h"

namespace {

constexpr oc_intrinsics_t kRaw{412.5, 398.25, 331, 228.5, 640, 480};
constexpr oc_intrinsics_t kRectified{250, 260, 301, 211.5, 600, 420};

const cv::Matx33d kCamera(kRaw.fx_px, 0, kRaw.cx_px, 0, kRaw.fy_px, kRaw.cy_px, 0, 0, 1);

oc_lens_t random_lens(oc_lens_model_t model, double size, std::mt19937_64 *random)
{
    std::uniform_real_distribution<double> draw(-size, size);
    oc_lens_t lens{};
    lens.model = model;
    for (double &k : lens.k) k = draw(*random);
    lens.raw = kRaw;
    lens.rectified = kRectified;
    return lens;
}

cv::Point2d normalised(double x_px, double y_px)
{
    return {(x_px - kRectified.cx_px) / kRectified.fx_px, (y_px - kRectified.cy_px) / kRectified.fy_px};
}

void expect_same(const oc_lens_t &lens, double x_px, double y_px, const cv::Point2d &expected)
{
    double x = 0, y = 0;
    oc_lens_distort(&lens, x_px, y_px, &x, &y);
    EXPECT_NEAR(x, expected.x, 1e-8);
    EXPECT_NEAR(y, expected.y, 1e-8);
}

TEST(LensOpencv, PlumbBobProjectsAsProjectPointsDoes)
{
    std::mt19937_64 random(41);
    for (int i = 0; i < 50; i++) {
        const oc_lens_t lens = random_lens(OC_LENS_PLUMB_BOB, 0.3, &random);
        const std::vector<double> coefficients(lens.k, lens.k + 5);
        for (int j = 0; j < 40; j++) {
            const double x = random() % 600, y = random() % 420;
            const cv::Point2d p = normalised(x, y);
            std::vector<cv::Point2d> expected;
            cv::projectPoints(std::vector<cv::Point3d>{{p.x, p.y, 1}}, cv::Vec3d(), cv::Vec3d(), kCamera, coefficients,
                              expected);
            expect_same(lens, x, y, expected[0]);
        }
    }
}

TEST(LensOpencv, FisheyeBendsAsDistortPointsDoes)
{
    std::mt19937_64 random(42);
    for (int i = 0; i < 50; i++) {
        const oc_lens_t lens = random_lens(OC_LENS_FISHEYE, 0.2, &random);
        const cv::Vec4d coefficients(lens.k[0], lens.k[1], lens.k[2], lens.k[3]);
        for (int j = 0; j < 40; j++) {
            const double x = random() % 600, y = random() % 420;
            std::vector<cv::Point2d> expected;
            cv::fisheye::distortPoints(std::vector<cv::Point2d>{normalised(x, y)}, expected, kCamera, coefficients);
            expect_same(lens, x, y, expected[0]);
        }
    }
}

} // namespace
