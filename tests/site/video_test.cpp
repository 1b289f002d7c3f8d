// SPDX-License-Identifier: BSD-3-Clause
// Video and sequence files, with and without the ffmpeg program.
#include "site/video.h"

#include <unistd.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

#include "site/sequence.h"
#include "textured_scene.h"

namespace outcrop {
namespace {

namespace fs = std::filesystem;

class Video : public testing::Test {
protected:
    void SetUp() override
    {
        dir_ = testing::TempDir() + "outcrop_video_" + std::to_string(getpid());
        fs::remove_all(dir_);
        fs::create_directories(dir_);
        const char *path = std::getenv("PATH");
        path_ = path ? path : "";
    }
    void TearDown() override
    {
        setenv("PATH", path_.c_str(), 1);
        fs::remove_all(dir_);
    }

    bool has_ffmpeg() const { return std::system("ffmpeg -version >/dev/null 2>&1") == 0; }

    int n_files() const
    {
        int n = 0;
        for ([[maybe_unused]] const auto &entry : fs::directory_iterator(dir_)) n++;
        return n;
    }

    // A program called ffmpeg that does what the script says.
    void fake_ffmpeg(const std::string &script)
    {
        fs::create_directories(dir_ + "/bin");
        std::ofstream(dir_ + "/bin/ffmpeg") << "#!/bin/sh\n" << script << "\n";
        fs::permissions(dir_ + "/bin/ffmpeg", fs::perms::owner_all);
        setenv("PATH", (dir_ + "/bin:" + path_).c_str(), 1);
    }

    std::string dir_, path_;
};

TEST_F(Video, WithoutFfmpegThereIsANoteAndNoFile)
{
    setenv("PATH", dir_.c_str(), 1);
    VideoWriter video(dir_ + "/a.mp4", {64, 48}, 10);
    EXPECT_FALSE(video.is_open());
    video.add(cv::Mat3b(48, 64));
    EXPECT_FALSE(video.close());
    EXPECT_THAT(video.note(), testing::HasSubstr("ffmpeg"));
    EXPECT_THAT(video.note(), testing::Not(testing::HasSubstr("\n")));
    EXPECT_EQ(n_files(), 0);
}

TEST_F(Video, OddSizesAreWritten)
{
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
    VideoWriter video(dir_ + "/a.mp4", {65, 47}, 10);
    for (int i = 0; i < 5; i++) video.add(cv::Mat3b(47, 65, cv::Vec3b(10, 200, static_cast<unsigned char>(40 * i))));
    EXPECT_TRUE(video.close()) << video.note();
    EXPECT_GT(fs::file_size(dir_ + "/a.mp4"), 300u);
    EXPECT_EQ(n_files(), 1);
}

TEST_F(Video, AFrameOfAnotherSizeEndsTheVideoWithANote)
{
    fake_ffmpeg("cat >/dev/null");
    VideoWriter video(dir_ + "/a.mp4", {64, 48}, 10);
    ASSERT_TRUE(video.is_open());
    video.add(cv::Mat3b(47, 64));
    EXPECT_FALSE(video.close());
    EXPECT_THAT(video.note(), testing::HasSubstr("size"));
    EXPECT_FALSE(fs::exists(dir_ + "/a.mp4"));
}

TEST_F(Video, AnFfmpegThatFailsOrDiesIsANoteNotASignal)
{
    for (const char *script : {"cat >/dev/null; exit 3", "exit 1", "kill -9 $$"}) {
        fake_ffmpeg(script);
        VideoWriter video(dir_ + "/a.mp4", {640, 480}, 10);
        for (int i = 0; i < 20; i++) video.add(cv::Mat3b(480, 640, cv::Vec3b(1, 2, 3)));
        EXPECT_FALSE(video.close()) << script;
        EXPECT_THAT(video.note(), testing::HasSubstr("ffmpeg")) << script;
        EXPECT_FALSE(fs::exists(dir_ + "/a.mp4"));
        setenv("PATH", path_.c_str(), 1);
    }
}

TEST_F(Video, AWriterThatIsDroppedLeavesNothing)
{
    if (!has_ffmpeg()) GTEST_SKIP() << "ffmpeg is not installed";
    {
        VideoWriter video(dir_ + "/a.mp4", {64, 48}, 10);
        video.add(cv::Mat3b(48, 64, cv::Vec3b(1, 2, 3)));
    }
    EXPECT_EQ(n_files(), 0);
}

class Sequence : public Video {
protected:
    SequenceReport write(int n_frames, const std::string &as = "boxes")
    {
        Path path;
        for (int i = 0; i < n_frames; i++) path.frames.push_back(scene::on_ring(3.0 * i));
        for (oc_camera_t &frame : path.frames) {
            frame.k.width_px = 33;
            frame.k.height_px = 35;
            frame.k.cx_px = 16;
            frame.k.cy_px = 17;
        }
        OverheadMap map;
        map.metres_per_pixel = 0.02;
        map.rgb = cv::Mat3b(100, 100, cv::Vec3b(200, 100, 50));
        map.seen = cv::Mat1b(100, 100, static_cast<unsigned char>(255));
        map.x_min = -1;
        map.y_max = 1;
        return write_sequence(dir_, as, {}, {}, map, path, {}, [&](int done, int all) {
            EXPECT_EQ(all, n_frames);
            EXPECT_EQ(done, ++n_done_);
        });
    }
    int n_done_ = 0;
};

TEST_F(Sequence, WithoutFfmpegFramesAndMasksAreThereAndOldOnesGone)
{
    setenv("PATH", dir_.c_str(), 1);
    fs::create_directories(dir_ + "/boxes");
    for (const char *name : {"frame_07.png", "mask_07.png", "frame_002.png", "notes.txt"})
        std::ofstream(dir_ + "/boxes/" + name) << "old";
    const SequenceReport report = write(3);
    EXPECT_EQ(n_done_, 3);
    EXPECT_FALSE(report.has_video);
    EXPECT_THAT(report.note, testing::HasSubstr("ffmpeg"));
    std::vector<std::string> names;
    for (const auto &entry : fs::directory_iterator(dir_ + "/boxes")) names.push_back(entry.path().filename());
    EXPECT_THAT(names, testing::UnorderedElementsAre("frame_00.png", "frame_01.png", "frame_02.png", "mask_00.png",
                                                     "mask_01.png", "mask_02.png", "notes.txt"));
    const cv::Mat3b frame = cv::imread(dir_ + "/boxes/frame_01.png");
    ASSERT_EQ(frame.size(), cv::Size(33, 35));
    EXPECT_EQ(cv::imread(dir_ + "/boxes/mask_01.png", cv::IMREAD_UNCHANGED).type(), CV_8U);
}

TEST_F(Sequence, MoreThanAHundredFramesHaveThreeDigits)
{
    setenv("PATH", dir_.c_str(), 1);
    write(101);
    EXPECT_TRUE(fs::exists(dir_ + "/boxes/frame_000.png"));
    EXPECT_TRUE(fs::exists(dir_ + "/boxes/mask_100.png"));
}

TEST_F(Sequence, EmptyPathsAndUnknownRepresentationsAreRefused)
{
    EXPECT_THROW(write(0), std::invalid_argument);
    EXPECT_THROW(write(1, "cubes"), std::invalid_argument);
    EXPECT_EQ(n_files(), 0);
}

} // namespace
} // namespace outcrop
