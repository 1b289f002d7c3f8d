// SPDX-License-Identifier: BSD-3-Clause
// outcrop-bench-ground: the ground filter against truth, the thesis' table 4.1, and the clock.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "labels.h"
#include "core/junction.h"
#include "speed.h"
#include "table.h"

namespace {

using Json = nlohmann::ordered_json;

// The folder's own name: figures travel, paths do not.
std::string name_of(const std::string &site)
{
    const std::filesystem::path path = std::filesystem::path(site) / "";
    return path.parent_path().filename().string();
}

void write_json(const std::string &file, const Json &json)
{
    if (file.empty()) return;
    std::ofstream out(file);
    out << json.dump(1) << '\n';
    if (!out.flush()) throw std::runtime_error(file + ": cannot be written");
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("The ground filter on site folders, without a link.", "outcrop-bench-ground");
    app.require_subcommand(1);
    std::string json_file;

    auto *labels = app.add_subcommand("labels", "labels of whole runs against the sites' truth");
    std::vector<std::string> sites;
    outcrop::bench::LabelOptions options;
    labels->add_option("SITE", sites, "site folders")->required();
    labels->add_option("--poses", options.modes, "exact, or as outcrop-drive --perturb: 1 2 3:drift");
    labels->add_option("--images", options.images, "pictures from this folder of the site");
    labels->add_flag("--errors", options.lists_errors, "one line per wrong label");
    labels->add_flag("--all", options.lists_all, "one line per junction");
    labels->add_option("--json", json_file, "also write the figures here");

    auto *speed = app.add_subcommand("speed", "milliseconds a pair, each view against the one before it");
    outcrop::bench::SpeedOptions speed_options;
    speed->add_option("SITE", sites, "site folders")->required();
    speed->add_option("--poses", speed_options.poses, "exact, or as outcrop-drive --perturb")->capture_default_str();
    speed->add_option("--junctions", speed_options.n_junctions, "best of each view")
        ->check(CLI::Range(1u, OC_MAX_JUNCTIONS))
        ->capture_default_str();
    speed->add_option("--repeats", speed_options.repeats, "the quickest counts")->check(CLI::Range(1, 1000));
    speed->add_option("--json", json_file, "also write the figures here");

    auto *table = app.add_subcommand("table", "table 4.1 of the thesis: windows by t_g, the thesis' form and ours");
    outcrop::bench::TableOptions table_options;
    table->add_option("SITE", table_options.site, "site folder (the thesis': cubes)")->required();
    table->add_option("--poses", table_options.poses, "exact, or as outcrop-drive --perturb")->capture_default_str();
    table->add_option("--left", table_options.left, "view")->capture_default_str();
    table->add_option("--right", table_options.right, "view")->capture_default_str();
    table->add_option("--junctions", table_options.n_junctions, "best of each view")
        ->check(CLI::Range(1u, OC_MAX_JUNCTIONS))
        ->capture_default_str();
    table->add_option("--json", json_file, "also write the figures here");

    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &e) {
        return app.exit(e) == 0 ? 0 : 2;
    }
    try {
        Json out = Json::object();
        if (labels->parsed()) {
            for (const std::string &site : sites) {
                std::printf("%s\n", site.c_str());
                options.site = site;
                out[name_of(site)] = outcrop::bench::measure_labels(options);
            }
        }
        if (speed->parsed()) {
            for (const std::string &site : sites) {
                std::printf("%s\n", site.c_str());
                speed_options.site = site;
                out[name_of(site)] = outcrop::bench::measure_speed(speed_options);
            }
        }
        if (table->parsed()) out[name_of(table_options.site)] = outcrop::bench::measure_table(table_options);
        write_json(json_file, out);
    } catch (const std::exception &e) {
        std::cerr << "outcrop-bench-ground: " << e.what() << '\n';
        return 1;
    }
    return 0;
}
