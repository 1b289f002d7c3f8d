// SPDX-License-Identifier: BSD-3-Clause
// Calibration files exchanged with OpenCV's own reader and writer.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <opencv2/core.hpp>
#include <random>
#include <string>

#include "calibration.h"

namespace {

class CalibrationOpencv : public ::testing::Test {
protected:
    void SetUp() override
    {
        path_ = std::filesystem::temp_directory_path() / ("outcrop_calibration_" + std::to_string(getpid()) + ".yaml");
    }
    void TearDown() override { std::filesystem::remove(path_); }

    oc_calibration_t read()
    {
        oc_calibration_t calibration{};
        char error[300] = "";
        EXPECT_TRUE(oc_calibration_read(path_.c_str(), &calibration, error, sizeof error)) << error;
        return calibration;
    }

    std::string read_error()
    {
        oc_calibration_t calibration{};
        char error[300] = "";
        EXPECT_FALSE(oc_calibration_read(path_.c_str(), &calibration, error, sizeof error));
        return std::string(error).substr(path_.string().size());
    }

    void write(const oc_calibration_t &calibration)
    {
        FILE *out = fopen(path_.c_str(), "wb");
        ASSERT_NE(out, nullptr);
        EXPECT_TRUE(oc_calibration_write(out, &calibration, OC_CALIBRATION_OPENCV));
        EXPECT_EQ(fclose(out), 0);
    }

    std::filesystem::path path_;
};

cv::Mat random_camera(std::mt19937_64 *random)
{
    std::uniform_real_distribution<double> draw(100, 900);
    return (cv::Mat_<double>(3, 3) << draw(*random), 0, draw(*random), 0, draw(*random), draw(*random) / 2, 0, 0, 1);
}

void expect_camera(const oc_intrinsics_t &k, const cv::Mat &camera)
{
    EXPECT_EQ(k.fx_px, camera.at<double>(0, 0));
    EXPECT_EQ(k.cx_px, camera.at<double>(0, 2));
    EXPECT_EQ(k.fy_px, camera.at<double>(1, 1));
    EXPECT_EQ(k.cy_px, camera.at<double>(1, 2));
}

// What samples/cpp/tutorial_code/calib3d/camera_calibration writes, in its order.
void write_as_the_sample(const std::string &path, const cv::Mat &camera, const cv::Mat &distortion, bool is_fisheye)
{
    cv::FileStorage fs(path, cv::FileStorage::WRITE | cv::FileStorage::FORMAT_YAML);
    fs << "calibration_time"
       << "Wed Nov 25 06:00:04 2026";
    fs << "nr_of_frames" << 25 << "image_width" << 1280 << "image_height" << 720;
    fs << "board_width" << 9 << "board_height" << 6 << "square_size" << 50.f;
    fs << "fix_aspect_ratio" << 1.;
    fs.writeComment("flags: +fix_aspectRatio+fix_principal_point+zero_tangent_dist");
    fs << "flags" << 14 << "fisheye_model" << is_fisheye;
    fs << "camera_matrix" << camera << "distortion_coefficients" << distortion;
    fs << "avg_reprojection_error" << 0.21;
    fs << "per_view_reprojection_errors" << cv::Mat(25, 1, CV_32F, cv::Scalar(0.3f));
    fs << "extrinsic_parameters" << cv::Mat(25, 6, CV_64F, cv::Scalar(0.1));
    fs << "image_points" << cv::Mat(25, 54, CV_32FC2, cv::Scalar(1.5f, 2.5f));
}

TEST_F(CalibrationOpencv, FilesOfItsSampleAreRead)
{
    std::mt19937_64 random(7);
    std::normal_distribution<double> draw(0, 0.1);
    for (int i = 0; i < 40; i++) {
        const bool is_fisheye = i % 2 == 1;
        const int n = is_fisheye ? 4 : i % 4 == 0 ? 5 : 4;
        cv::Mat distortion(n, 1, CV_64F);
        for (int j = 0; j < n; j++) distortion.at<double>(j) = draw(random);
        if (i % 3 == 0) distortion = distortion.t();
        const cv::Mat camera = random_camera(&random);
        write_as_the_sample(path_, camera, distortion, is_fisheye);
        const oc_lens_t lens = read().lens;
        EXPECT_EQ(lens.model, is_fisheye ? OC_LENS_FISHEYE : OC_LENS_PLUMB_BOB);
        EXPECT_EQ(lens.raw.width_px, 1280u);
        EXPECT_EQ(lens.raw.height_px, 720u);
        expect_camera(lens.raw, camera);
        expect_camera(lens.rectified, camera);
        for (int j = 0; j < 5; j++) EXPECT_EQ(lens.k[j], j < n ? distortion.at<double>(j) : 0) << j;
    }
}

TEST_F(CalibrationOpencv, WhatItWritesForNoNumberIsRefused)
{
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                             -std::numeric_limits<double>::infinity()}) {
        std::mt19937_64 random(8);
        cv::Mat distortion = cv::Mat::zeros(5, 1, CV_64F);
        distortion.at<double>(2) = bad;
        write_as_the_sample(path_, random_camera(&random), distortion, false);
        EXPECT_NE(read_error().find("is not a finite number"), std::string::npos) << read_error();
    }
}

TEST_F(CalibrationOpencv, ModelsWithMoreCoefficientsAreRefusedUnlessTheyAreZero)
{
    std::mt19937_64 random(9);
    const cv::Mat camera = random_camera(&random);
    for (const int n : {8, 12, 14}) {
        cv::Mat distortion = cv::Mat::zeros(1, n, CV_64F);
        distortion.at<double>(0) = -0.2;
        write_as_the_sample(path_, camera, distortion, false);
        EXPECT_EQ(read().lens.k[0], -0.2);
        distortion.at<double>(n - 1) = 1e-9;
        write_as_the_sample(path_, camera, distortion, false);
        EXPECT_NE(read_error().find("recalibrate with plumb_bob"), std::string::npos) << read_error();
    }
}

TEST_F(CalibrationOpencv, ItReadsWhatWeWrite)
{
    std::mt19937_64 random(10);
    std::uniform_real_distribution<double> draw(-1, 1);
    for (int i = 0; i < 40; i++) {
        oc_calibration_t calibration{};
        std::snprintf(calibration.camera_name, sizeof calibration.camera_name, "it's \"%d\": # {", i);
        oc_lens_t &lens = calibration.lens;
        lens.model = static_cast<oc_lens_model_t>(i % 3);
        const int n = lens.model == OC_LENS_FISHEYE ? 4 : 5;
        for (int j = 0; j < n; j++) lens.k[j] = draw(random) * std::pow(10, -j);
        lens.raw = {500 + draw(random), 500, 320 + draw(random), 240 + draw(random), 640, 480};
        lens.rectified = lens.raw;
        if (i % 2 == 0) lens.rectified.fx_px = 400 + draw(random);
        write(calibration);

        cv::FileStorage fs(path_.string(), cv::FileStorage::READ);
        ASSERT_TRUE(fs.isOpened());
        cv::Mat camera, distortion, projection;
        fs["camera_matrix"] >> camera;
        fs["distortion_coefficients"] >> distortion;
        fs["projection_matrix"] >> projection;
        EXPECT_EQ(static_cast<int>(fs["image_width"]), 640);
        EXPECT_EQ(static_cast<int>(fs["image_height"]), 480);
        EXPECT_EQ(static_cast<int>(fs["fisheye_model"]), lens.model == OC_LENS_FISHEYE);
        EXPECT_EQ(static_cast<std::string>(fs["camera_name"]), calibration.camera_name);
        ASSERT_EQ(camera.size(), cv::Size(3, 3));
        ASSERT_EQ(camera.type(), CV_64F);
        expect_camera(lens.raw, camera);
        EXPECT_EQ(camera.at<double>(2, 2), 1);
        ASSERT_EQ(distortion.total(), static_cast<std::size_t>(n));
        for (int j = 0; j < n; j++) EXPECT_EQ(distortion.at<double>(j), lens.model == OC_LENS_PINHOLE ? 0 : lens.k[j]);
        EXPECT_EQ(projection.empty(), i % 2 == 1);
        if (projection.empty()) continue;
        EXPECT_EQ(projection.at<double>(0, 0), lens.rectified.fx_px);
    }
}

} // namespace
