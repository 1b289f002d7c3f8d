// SPDX-License-Identifier: BSD-3-Clause
// outcrop-base: the operator's end of Outcrop.
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <opencv2/core.hpp>

#include "config.h"
#include "live.h"
#include "recall.h"
#include "replay.h"

namespace {

void say(const std::string &text)
{
    std::printf("outcrop-base: %s\n", text.c_str());
    std::fflush(stdout);
}

void print_fault(void *, const char *line)
{
    std::fprintf(stderr, "outcrop-base: %s\n", line);
}

int live(const std::string &file, bool is_check)
{
    oc_base_config_t config;
    if (!oc_base_config_load(file.c_str(), &config, print_fault, nullptr)) return 1;
    if (is_check) {
        outcrop::OutputOptions output;
        output.path = config.path;
        outcrop::check_output(output);
    } else {
        outcrop::run_live(config);
    }
    return 0;
}

int replay(outcrop::ReplayOptions options, const std::vector<double> &area)
{
    if (!area.empty()) {
        options.area = outcrop::Area{area[0], area[1], area[2], area[3], area[4]};
        if (!(area[0] < area[1] && area[2] < area[3] && area[4] > 0))
            throw std::runtime_error("--area must be X_MIN,X_MAX,Y_MIN,Y_MAX,Z_MAX, ascending, in metres");
    }
    outcrop::run_replay(options, say);
    say(options.output.dir + " written");
    return 0;
}

struct RecallTimes {
    double last_s = -1; // below 0: from and to
    std::string from, to;
};

// What was asked for; wrong words are wrong usage.
oc_recall_request_t recall_request(const RecallTimes &times)
{
    oc_recall_request_t request{};
    request.is_relative = times.last_s >= 0;
    if (request.is_relative) {
        request.last_ms = static_cast<std::uint32_t>(times.last_s * 1000);
        return request;
    }
    request.from_us = outcrop::parse_utc(times.from);
    request.to_us = outcrop::parse_utc(times.to);
    if (request.from_us > request.to_us) throw std::runtime_error("--from is later than --to");
    return request;
}

int recall(const std::string &file, const RecallTimes &times)
{
    oc_recall_request_t request;
    try {
        request = recall_request(times);
    } catch (const std::exception &fault) {
        std::fprintf(stderr, "outcrop-base: %s\n", fault.what());
        return 2;
    }
    oc_base_config_t config;
    if (!oc_base_config_load(file.c_str(), &config, print_fault, nullptr)) return 1;
    const int n = outcrop::send_recall(config, request, {});
    say(std::to_string(n) + " packets of views of that time have come");
    return 0;
}

void add_recall(CLI::App *command, std::string *config, RecallTimes *times)
{
    command->add_option("--config", *config, "YAML configuration, as of live")->required();
    CLI::Option *last =
        command->add_option("--last", times->last_s, "seconds before the request arrives")->check(CLI::Range(0.0, 4e6));
    CLI::Option *from = command->add_option("--from", times->from, "UTC, 2026-01-31T12:00:00Z or microseconds");
    CLI::Option *to = command->add_option("--to", times->to, "UTC, not before --from");
    from->needs(to)->excludes(last);
    to->needs(from)->excludes(last);
    command->final_callback([=] {
        if (last->count() == 0 && from->count() == 0)
            throw CLI::RequiredError("--last SECONDS, or --from UTC --to UTC");
    });
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app{"outcrop-base: the operator's end of Outcrop"};
    app.set_version_flag("--version", "outcrop-base " OUTCROP_VERSION);
    app.require_subcommand(1);

    std::string config;
    CLI::App *live_command = app.add_subcommand("live", "listen to a vehicle, write the run's folder when settled");
    CLI::Option_group *what = live_command->add_option_group("what");
    what->add_option("--config", config, "YAML configuration");
    bool is_check = false, is_print = false;
    what->add_flag("--print-config", is_print, "print a sample configuration: every key with unit, range, default");
    what->require_option(1);
    live_command->add_flag("--check", is_check, "check the configuration, then exit");

    outcrop::ReplayOptions options;
    std::vector<double> area;
    CLI::App *replay_command = app.add_subcommand("replay", "the same on a captured LCM log");
    replay_command->add_option("LOG", options.log, "LCM log with the channels OCD and OCU")->required();
    replay_command->add_option("--out", options.output.dir, "folder to write")->required();
    replay_command->add_option("--as", options.output.represent, "boxes, voxels or none")
        ->check(CLI::IsMember({"boxes", "voxels", "none"}));
    replay_command->add_flag("!--no-textures", options.output.with_textures, "volumes of silhouettes alone");
    replay_command->add_option("--path", options.output.path, "path file; default: a loop round the obstacles");
    replay_command->add_option("--area", area, "working area X_MIN,X_MAX,Y_MIN,Y_MAX,Z_MAX in metres")
        ->delimiter(',')
        ->expected(5);
    replay_command->add_option("--method", options.output.method, "best or thesis")
        ->check(CLI::IsMember({"best", "thesis"}));
    replay_command->add_option("--vehicle", options.vehicle, "id; default: the first in the log")
        ->check(CLI::Range(0, 255));

    RecallTimes times;
    CLI::App *recall_command = app.add_subcommand("recall", "have views of a stretch of time sent, held back or not");
    add_recall(recall_command, &config, &times);

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &fault) {
        const int code = app.exit(fault);
        return code == 0 ? 0 : 2;
    }
    cv::setNumThreads(1); // sums in one order, whatever the machine
    try {
        if (is_print) return oc_base_config_print_sample(stdout) ? 0 : 1;
        if (*recall_command) return recall(config, times);
        return *live_command ? live(config, is_check) : replay(options, area);
    } catch (const std::exception &fault) {
        std::fprintf(stderr, "outcrop-base: %s\n", fault.what());
        return 1;
    }
}
