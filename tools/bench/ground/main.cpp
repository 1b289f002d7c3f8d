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

struct Options {
    std::vector<std::string> sites;
    std::string json_file;
    outcrop::bench::LabelOptions labels;
    outcrop::bench::SpeedOptions speed;
    outcrop::bench::TableOptions table;
};

CLI::App *add_labels(CLI::App &app, Options &o)
{
    auto *sub = app.add_subcommand("labels", "labels of whole runs against the sites' truth");
    sub->add_option("SITE", o.sites, "site folders")->required();
    sub->add_option("--poses", o.labels.modes, "exact, or as outcrop-drive --perturb: 1 2 3:drift");
    sub->add_option("--images", o.labels.images, "pictures from this folder of the site");
    sub->add_flag("--errors", o.labels.lists_errors, "one line per wrong label");
    sub->add_flag("--all", o.labels.lists_all, "one line per junction");
    sub->add_option("--json", o.json_file, "also write the figures here");
    return sub;
}

CLI::App *add_speed(CLI::App &app, Options &o)
{
    auto *sub = app.add_subcommand("speed", "milliseconds a pair, each view against the one before it");
    sub->add_option("SITE", o.sites, "site folders")->required();
    sub->add_option("--poses", o.speed.poses, "exact, or as outcrop-drive --perturb")->capture_default_str();
    sub->add_option("--junctions", o.speed.n_junctions, "best of each view")
        ->check(CLI::Range(1u, OC_MAX_JUNCTIONS))
        ->capture_default_str();
    sub->add_option("--repeats", o.speed.repeats, "the quickest counts")->check(CLI::Range(1, 1000));
    sub->add_option("--json", o.json_file, "also write the figures here");
    return sub;
}

CLI::App *add_table(CLI::App &app, Options &o)
{
    auto *sub = app.add_subcommand("table", "table 4.1 of the thesis: windows by t_g, the thesis' form and ours");
    sub->add_option("SITE", o.table.site, "site folder (the thesis': cubes)")->required();
    sub->add_option("--poses", o.table.poses, "exact, or as outcrop-drive --perturb")->capture_default_str();
    sub->add_option("--left", o.table.left, "view")->capture_default_str();
    sub->add_option("--right", o.table.right, "view")->capture_default_str();
    sub->add_option("--junctions", o.table.n_junctions, "best of each view")
        ->check(CLI::Range(1u, OC_MAX_JUNCTIONS))
        ->capture_default_str();
    sub->add_option("--json", o.json_file, "also write the figures here");
    return sub;
}

// Each site in turn, its figures under its name.
template <typename Measure>
Json for_each_site(const std::vector<std::string> &sites, Measure measure)
{
    Json out = Json::object();
    for (const std::string &site : sites) {
        std::printf("%s\n", site.c_str());
        out[name_of(site)] = measure(site);
    }
    return out;
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("The ground filter on site folders, without a link.", "outcrop-bench-ground");
    app.require_subcommand(1);
    Options o;
    const auto *labels = add_labels(app, o), *speed = add_speed(app, o);
    (void)add_table(app, o);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &e) {
        return app.exit(e) == 0 ? 0 : 2;
    }
    try {
        if (labels->parsed()) {
            write_json(o.json_file, for_each_site(o.sites, [&](const std::string &site) {
                           o.labels.site = site;
                           return outcrop::bench::measure_labels(o.labels);
                       }));
        } else if (speed->parsed()) {
            write_json(o.json_file, for_each_site(o.sites, [&](const std::string &site) {
                           o.speed.site = site;
                           return outcrop::bench::measure_speed(o.speed);
                       }));
        } else {
            write_json(o.json_file, {{name_of(o.table.site), outcrop::bench::measure_table(o.table)}});
        }
    } catch (const std::exception &e) {
        std::cerr << "outcrop-bench-ground: " << e.what() << '\n';
        return 1;
    }
    return 0;
}
