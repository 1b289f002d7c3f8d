// SPDX-License-Identifier: BSD-3-Clause
// outcrop-pose-replay: body poses of a site folder or a CSV table, published over LCM.
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>

#include "publish.h"

namespace {

struct Arguments {
    std::string source, type = "outcrop";
    std::vector<double> mount{0, 0, 0, 0, 0, 0};
    outcrop::PublishOptions publish;
};

void add_options(CLI::App *app, Arguments *a)
{
    outcrop::PublishOptions *p = &a->publish;
    app->add_option("SOURCE", a->source,
                    "site folder, its cameras.json, or a .csv of utime_us,x,y,z,qw,qx,qy,qz[,36 of covariance]")
        ->required();
    app->add_option("-l,--lcm-url", p->url, "where to publish")->capture_default_str();
    app->add_option("--channel", p->channel, "default: OUTCROP_POSE, or POSE with --as bot_core");
    app->add_option("--as", a->type, "message type")
        ->check(CLI::IsMember({"outcrop", "bot_core"}))
        ->capture_default_str();
    app->add_option("--rate", p->rate_hz, "poses a second, interpolated")
        ->check(CLI::Range(0.1, 1000.0))
        ->capture_default_str();
    app->add_option("--speed", p->speed, "times faster than recorded")
        ->check(CLI::Range(0.001, 1000.0))
        ->capture_default_str();
    app->add_option("--mount", a->mount, "a site's camera on the body: x,y,z in metres, roll,pitch,yaw in degrees")
        ->delimiter(',')
        ->expected(6);
    app->add_flag("--now", p->is_now, "shift times so that the first pose is now");
    app->add_flag("--loop", p->is_looped, "begin anew at the end; needs --now");
    app->add_option("--hold", p->hold_view,
                    "publish this view's pose for ever, dated now; a view number on standard input changes it")
        ->check(CLI::Range(0, 65535));
}

outcrop::PoseList read_poses(const Arguments &a)
{
    if (std::filesystem::path(a.source).extension() == ".csv") return outcrop::read_csv_poses(a.source);
    const double rad[3] = {a.mount[3] * 0.017453292519943295, a.mount[4] * 0.017453292519943295,
                           a.mount[5] * 0.017453292519943295};
    return outcrop::read_site_poses(a.source, oc_mount_from_xyzrpy(a.mount.data(), rad));
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app{
        "outcrop-pose-replay: publishes the poses of a site folder or a table, as a vehicle's own program would"};
    app.set_version_flag("--version", "outcrop-pose-replay " OUTCROP_VERSION);
    Arguments a;
    add_options(&app, &a);
    try {
        app.parse(argc, argv);
        if (a.publish.is_looped && !a.publish.is_now) throw CLI::ValidationError("--loop", "needs --now");
    } catch (const CLI::ParseError &fault) {
        return app.exit(fault) == 0 ? 0 : 2;
    }
    a.publish.type = a.type == "outcrop" ? OC_POSE_OUTCROP : OC_POSE_BOT_CORE;
    try {
        const long n = outcrop::publish_poses(read_poses(a), a.publish);
        std::printf("outcrop-pose-replay: %ld poses sent\n", n);
        return 0;
    } catch (const std::exception &fault) {
        std::fprintf(stderr, "outcrop-pose-replay: %s\n", fault.what());
        return 1;
    }
}
