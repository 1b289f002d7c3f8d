// SPDX-License-Identifier: BSD-3-Clause
// posix_spawn, no shell.
#include "site/video.h"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>
#include <vector>

extern char **environ;

namespace outcrop {

VideoWriter::VideoWriter(const std::string &path, cv::Size size, int frames_per_s)
    : path_(path), part_(path + ".part.mp4"), size_(size)
{
    // A socket instead of a pipe: MSG_NOSIGNAL keeps a dying ffmpeg from killing us.
    int ends[2];
    if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
        fail(std::string("socketpair: ") + std::strerror(errno));
        return;
    }
    const std::string dimensions = std::to_string(size.width) + "x" + std::to_string(size.height);
    std::vector<std::string> words = {"ffmpeg",   "-loglevel", "error",     "-y",
                                      "-f",       "rawvideo",  "-pix_fmt",  "rgb24",
                                      "-s",       dimensions,  "-r",        std::to_string(frames_per_s),
                                      "-i",       "-",         "-vf",       "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                                      "-c:v",     "libx264",   "-crf",      "20",
                                      "-pix_fmt", "yuv420p",   "-movflags", "+faststart",
                                      part_};
    std::vector<char *> argv;
    for (std::string &word : words) argv.push_back(word.data());
    argv.push_back(nullptr);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[0], STDIN_FILENO);
    const int fault = posix_spawnp(&pid_, "ffmpeg", &actions, nullptr, argv.data(), environ);
    posix_spawn_file_actions_destroy(&actions);
    ::close(ends[0]);
    if (fault != 0) {
        ::close(ends[1]);
        pid_ = -1;
        fail(fault == ENOENT ? "no video: the ffmpeg program is not installed"
                             : std::string("no video: ffmpeg: ") + std::strerror(fault));
        return;
    }
    fd_ = ends[1];
}

VideoWriter::~VideoWriter()
{
    if (fd_ >= 0) ::close(fd_);
    if (pid_ > 0) {
        kill(pid_, SIGTERM);
        wait();
    }
    std::remove(part_.c_str());
}

void VideoWriter::fail(const std::string &why)
{
    if (note_.empty()) note_ = why;
    if (fd_ >= 0) ::close(fd_);
    fd_ = -1;
}

int VideoWriter::wait()
{
    int status = -1;
    while (waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
}

void VideoWriter::add(const cv::Mat3b &rgb)
{
    if (!is_open()) return;
    if (rgb.size() != size_) {
        fail("no video: the frames are not of one size");
        return;
    }
    const cv::Mat3b whole = rgb.isContinuous() ? rgb : rgb.clone();
    const auto *bytes = reinterpret_cast<const char *>(whole.data);
    std::size_t left = whole.total() * 3;
    while (left > 0) {
        const ssize_t n = send(fd_, bytes, left, MSG_NOSIGNAL);
        if (n < 0 && errno == EINTR) continue;
        if (n <= 0) {
            fail("no video: ffmpeg ended early");
            return;
        }
        bytes += n;
        left -= static_cast<std::size_t>(n);
    }
}

bool VideoWriter::close()
{
    if (!is_open()) return false;
    ::close(fd_);
    fd_ = -1;
    const int status = wait();
    if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) {
        fail("no video: ffmpeg failed");
        return false;
    }
    if (std::rename(part_.c_str(), path_.c_str()) == 0) return true;
    fail(path_ + ": cannot be written");
    return false;
}

} // namespace outcrop
