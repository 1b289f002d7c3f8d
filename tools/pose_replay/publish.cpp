// SPDX-License-Identifier: BSD-3-Clause
// The pace of publishing.
#include "publish.h"

#include <poll.h>
#include <signal.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <stdexcept>

#include "bot_core_pose_t.h"
#include "daemon/link_lcm.h"
#include "lcm/lcm.h"
#include "outcrop_pose_t.h"

namespace outcrop {
namespace {

using clock = std::chrono::steady_clock;

std::int64_t utc_us()
{
    return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::system_clock::now().time_since_epoch())
        .count();
}

class Publisher {
public:
    explicit Publisher(const PublishOptions &options) : options_(options)
    {
        char error[256];
        if (!oc_link_has_route(options.url.c_str(), error, sizeof error)) throw std::runtime_error(error);
        lcm_.reset(lcm_create(options.url.c_str()));
        if (!lcm_) throw std::runtime_error("cannot open " + options.url);
        channel_ = options.channel;
        if (channel_.empty()) channel_ = options.type == OC_POSE_OUTCROP ? "OUTCROP_POSE" : "POSE";
    }

    void send(const oc_body_pose_t &pose)
    {
        const bool is_sent = options_.type == OC_POSE_OUTCROP ? send_outcrop(pose) : send_bot_core(pose);
        if (!is_sent) throw std::runtime_error(options_.url + ": a pose could not be sent");
        n_sent_++;
    }

    long n_sent() const { return n_sent_; }

private:
    struct Destroy {
        void operator()(lcm_t *lcm) const { lcm_destroy(lcm); }
    };

    bool send_outcrop(const oc_body_pose_t &pose)
    {
        outcrop_pose_t out{};
        out.utime = pose.utime_us;
        std::memcpy(out.position, pose.position_m, sizeof out.position);
        std::memcpy(out.orientation, pose.q_wxyz, sizeof out.orientation);
        out.has_covariance = pose.has_covariance;
        if (pose.has_covariance) std::memcpy(out.covariance, pose.covariance, sizeof out.covariance);
        return outcrop_pose_t_publish(lcm_.get(), channel_.c_str(), &out) == 0;
    }

    // bot_core's body has its z down: half a turn about x.
    bool send_bot_core(const oc_body_pose_t &pose)
    {
        bot_core_pose_t out{};
        const double *q = pose.q_wxyz;
        out.utime = pose.utime_us;
        std::memcpy(out.pos, pose.position_m, sizeof out.pos);
        const double turned[4] = {-q[1], q[0], q[3], -q[2]};
        std::memcpy(out.orientation, turned, sizeof out.orientation);
        return bot_core_pose_t_publish(lcm_.get(), channel_.c_str(), &out) == 0;
    }

    PublishOptions options_;
    std::unique_ptr<lcm_t, Destroy> lcm_;
    std::string channel_;
    long n_sent_ = 0;
};

// Sleeps to the next beat; false when a signal asks to end. Lines on standard input go to on_line.
class Beat {
public:
    explicit Beat(double rate_hz) : period_(std::chrono::duration<double>(1 / rate_hz)), next_(clock::now())
    {
        sigset_t signals;
        sigemptyset(&signals);
        sigaddset(&signals, SIGTERM);
        sigaddset(&signals, SIGINT);
        sigprocmask(SIG_BLOCK, &signals, nullptr);
        signal_fd_ = signalfd(-1, &signals, SFD_CLOEXEC);
    }
    ~Beat() { close(signal_fd_); }
    Beat(const Beat &) = delete;
    Beat &operator=(const Beat &) = delete;

    template <typename OnLine>
    bool wait(bool has_input, OnLine on_line)
    {
        next_ += std::chrono::duration_cast<clock::duration>(period_);
        if (next_ < clock::now()) next_ = clock::now(); // late: no burst to make up for it
        for (;;) {
            const auto left = std::chrono::duration_cast<std::chrono::microseconds>(next_ - clock::now()).count();
            if (left <= 0) return true;
            pollfd fds[2] = {{signal_fd_, POLLIN, 0}, {has_input && is_open_ ? STDIN_FILENO : -1, POLLIN, 0}};
            const timespec timeout{static_cast<time_t>(left / 1000000), static_cast<long>(left % 1000000 * 1000)};
            if (ppoll(fds, 2, &timeout, nullptr) <= 0) continue;
            if (fds[0].revents) return false;
            read_lines(on_line);
        }
    }

private:
    template <typename OnLine>
    void read_lines(OnLine on_line)
    {
        char bytes[256];
        const ssize_t n = ::read(STDIN_FILENO, bytes, sizeof bytes);
        is_open_ = n > 0;
        for (ssize_t i = 0; i < n; i++) {
            if (bytes[i] != '\n') {
                line_ += bytes[i];
                continue;
            }
            on_line(line_);
            line_.clear();
        }
    }

    std::chrono::duration<double> period_;
    clock::time_point next_;
    int signal_fd_ = -1;
    bool is_open_ = true;
    std::string line_;
};

oc_body_pose_t pose_of_view(const PoseList &list, const std::string &text)
{
    char *end;
    const long view = std::strtol(text.c_str(), &end, 10);
    const auto found = end == text.c_str() || *end ? list.by_view.end() : list.by_view.find(static_cast<int>(view));
    if (found == list.by_view.end()) throw std::runtime_error("there is no view " + text.substr(0, 20));
    return found->second;
}

void hold(const PoseList &list, const PublishOptions &options, Publisher *publisher)
{
    oc_body_pose_t pose = pose_of_view(list, std::to_string(options.hold_view));
    Beat beat(options.rate_hz);
    do {
        pose.utime_us = utc_us();
        publisher->send(pose);
    } while (beat.wait(true, [&](const std::string &line) { pose = pose_of_view(list, line); }));
}

// Once through the list; false when a signal came.
bool play(const PoseList &list, const PublishOptions &options, oc_pose_track_t *track, Beat *beat, Publisher *publisher)
{
    const std::int64_t first_us = list.poses.front().utime_us, last_us = list.poses.back().utime_us;
    const std::int64_t shift_us = options.is_now ? utc_us() - first_us : 0;
    const double step_us = 1e6 / options.rate_hz * options.speed;
    for (long i = 0;; i++) {
        const std::int64_t at_us =
            std::min(last_us, first_us + static_cast<std::int64_t>(std::llround(static_cast<double>(i) * step_us)));
        oc_body_pose_t pose;
        if (oc_pose_track_at(track, at_us, &pose) != OC_POSE_OK) throw std::runtime_error("no pose can be made up");
        // Slowed down or sped up, times are those of the publishing.
        pose.utime_us =
            options.is_now
                ? first_us + static_cast<std::int64_t>(static_cast<double>(at_us - first_us) / options.speed) + shift_us
                : at_us;
        publisher->send(pose);
        if (at_us == last_us) return beat->wait(false, [](const std::string &) {});
        if (!beat->wait(false, [](const std::string &) {})) return false;
    }
}

} // namespace

long publish_poses(const PoseList &list, const PublishOptions &options)
{
    Publisher publisher(options);
    if (options.hold_view >= 0) {
        hold(list, options, &publisher);
        return publisher.n_sent();
    }
    const std::unique_ptr<oc_pose_track_t, decltype(&oc_pose_track_destroy)> track(
        oc_pose_track_create(static_cast<std::uint32_t>(std::max<std::size_t>(list.poses.size(), 2)), INT64_MAX),
        oc_pose_track_destroy);
    if (!track) throw std::bad_alloc();
    for (const oc_body_pose_t &pose : list.poses) {
        if (oc_pose_track_add(track.get(), &pose) != OC_OK) throw std::runtime_error("a pose is out of order");
    }
    Beat beat(options.rate_hz);
    while (play(list, options, track.get(), &beat, &publisher) && options.is_looped) {
    }
    return publisher.n_sent();
}

} // namespace outcrop
