// SPDX-License-Identifier: BSD-3-Clause
// MP4 through the ffmpeg program, frames over a pipe.
#pragma once

#include <sys/types.h>

#include <string>

#include <opencv2/core.hpp>

namespace outcrop {

// Writes PATH.part.mp4 and renames it when it is whole. Never throws for a
// missing ffmpeg: then is_open() is false and note() says why in one line.
class VideoWriter {
public:
    VideoWriter(const std::string &path, cv::Size size, int frames_per_s);
    ~VideoWriter();
    VideoWriter(const VideoWriter &) = delete;
    VideoWriter &operator=(const VideoWriter &) = delete;

    bool is_open() const { return fd_ >= 0; }
    const std::string &note() const { return note_; }
    void add(const cv::Mat3b &rgb);

    // Finish the file; true when it is there and whole.
    bool close();

private:
    void fail(const std::string &why);
    int wait();

    std::string path_, part_, note_;
    cv::Size size_;
    pid_t pid_ = -1;
    int fd_ = -1;
};

} // namespace outcrop
