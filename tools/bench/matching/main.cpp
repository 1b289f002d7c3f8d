// SPDX-License-Identifier: BSD-3-Clause
// outcrop-bench-matching: matches, poses and the model's steps beside their rivals.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>

#include "boxes_of_points.h"
#include "poses.h"
#include "steps.h"
#include "thesis_tables.h"
#include "wide.h"

namespace {

namespace fs = std::filesystem;
using namespace outcrop::bench;
using Json = nlohmann::ordered_json;

const std::vector<std::string> kParts = {"wide", "tables", "poses", "steps"};
const std::vector<std::string> kSites = {"depot", "two_obstacles", "cubes"};

struct Options {
    std::vector<std::string> folders;
    std::vector<std::string> parts = kParts;
    std::vector<std::string> seeds = {"1", "2", "3", "4", "5"};
    bool is_quick = false;
    std::string json_file, site, points_file;
};

bool has_part(const Options &o, const char *part)
{
    return std::find(o.parts.begin(), o.parts.end(), part) != o.parts.end();
}

// The site's folder in the first of the given ones that holds it, or "".
std::string find_site(const Options &o, const std::string &name, const std::string &images = "")
{
    for (const std::string &folder : o.folders) {
        const fs::path site = fs::path(folder) / name;
        if (fs::exists(site / "cameras.json") && fs::exists(site / "depth") && fs::exists(site / images))
            return site.string();
    }
    return "";
}

std::vector<SiteCase> load_cases(const Options &o, const std::string &poses, Json *skipped)
{
    std::vector<SiteCase> out;
    for (const std::string &name : kSites) {
        const std::string site = find_site(o, name);
        if (site.empty()) {
            if (std::find(skipped->begin(), skipped->end(), name) == skipped->end()) skipped->push_back(name);
        } else {
            out.push_back(load_site_case({site, "", poses}));
        }
    }
    return out;
}

struct WideInput {
    std::string name, images, poses;
};

WideCase wide_case(const Options &o, const WideInput &input, const WideOptions &wide, Descriptions *descriptions)
{
    SiteCaseOptions options = {find_site(o, input.name, input.images), input.images, input.poses};
    const SiteCase site = load_site_case(options);
    options.finds_all = true;
    return measure_wide(site, load_site_case(options), wide, descriptions);
}

Json wide_group(const Options &o, const std::string &title, const std::vector<WideInput> &inputs,
                const WideOptions &wide, Descriptions *descriptions, Json *cases)
{
    std::vector<WideCase> measured;
    for (const WideInput &input : inputs) {
        if (find_site(o, input.name, input.images).empty()) continue;
        measured.push_back(wide_case(o, input, wide, descriptions));
        cases->push_back(measured.back().json);
    }
    return measured.empty() ? Json(nullptr) : sum_wide(title, measured, wide);
}

Json measure_wide_part(const Options &o)
{
    WideOptions wide;
    if (o.is_quick) wide.features = {Feature::kSift, Feature::kAkaze};
    Descriptions descriptions;
    Json groups = Json::array(), cases = Json::array();
    const auto add = [&](const std::string &title, const std::vector<WideInput> &inputs) {
        const Json group = wide_group(o, title, inputs, wide, &descriptions, &cases);
        if (!group.is_null()) groups.push_back(group);
    };
    std::vector<WideInput> exact, moved, light, noise;
    for (const std::string &name : kSites) {
        exact.push_back({name, "", "exact"});
        moved.push_back({name, "", o.seeds.front()});
        if (name == "cubes") continue;
        light.push_back({name, "images_light", o.seeds.front()});
        noise.push_back({name, "images_noise", o.seeds.front()});
    }
    add("exact poses", exact);
    add("poses moved inside the margins", moved);
    add("changed light, poses moved", light);
    add("noise, poses moved", noise);
    return {{"groups", groups}, {"cases", cases}};
}

Json measure_tables_part(const Options &o)
{
    Json out = {{"table_5_3", Json::array()}, {"methods", Json::array()}};
    for (const std::string &poses : {std::string("exact"), o.seeds.front()}) {
        if (const std::string site = find_site(o, "cubes"); !site.empty()) {
            const SiteCase cubes = load_site_case({site, "", poses});
            out["table_5_3"].push_back(measure_table_5_3(cubes, {4, 5}));
            out["methods"].push_back(measure_methods(cubes, {{4, 5}}, "Figure 5.14, cubes e-f", {11, 0.75, 22.7, 33.1},
                                                     "plain SAD 55.0 %, H-SAD 100 %, H-VNC 100 %; invariants 45.5 %"));
            out["methods"].push_back(measure_methods(cubes, {{4, 5}}, "Figure 5.18, cubes e-f", {17, 0.70, 24.2, 24.2},
                                                     "plain SAD: no match, H-SAD 100 %, H-VNC 100 %"));
        }
        if (const std::string site = find_site(o, "depot"); !site.empty()) {
            const SiteCase depot = load_site_case({site, "", poses});
            out["methods"].push_back(measure_methods(
                depot, pairs_between(depot, 32, 43), "Figure 5.9, box-like pairs (32 to 43 degrees)",
                {21, 0.75, 29.5, 29.5}, "plain SAD 23.8 %, H-SAD 96.0 %, H-VNC 100 %; H-SAD with F 100 %"));
        }
        if (const std::string site = find_site(o, "two_obstacles"); !site.empty()) {
            const SiteCase two = load_site_case({site, "", poses});
            out["methods"].push_back(measure_methods(two, {{5, 6}}, "Section 7.9, two obstacles f-g",
                                                     {15, 0.70, 27.6, 27.6}, "H-SAD 83.3 %"));
        }
    }
    return out;
}

Json measure_poses_part(const Options &o, Json *skipped)
{
    Json out = Json::array();
    std::map<std::string, std::vector<PoseCase>> cases;
    for (const std::string &seed : o.seeds)
        for (const SiteCase &site : load_cases(o, seed, skipped)) cases[site.name].push_back(measure_poses(site));
    for (const std::string &name : kSites)
        if (cases.count(name)) out.push_back(summary_of(name, o.seeds, cases[name]));
    return out;
}

// Set by hand in the thesis: 60 mm in section 6.5, 150 mm in 7.9. None for a site that it does not have.
double thesis_t_m_m(const std::string &site)
{
    if (site == "cubes") return 0.06;
    return site == "two_obstacles" ? 0.15 : 0;
}

Json measure_steps_part(const Options &o, Json *skipped)
{
    Json out = Json::array();
    for (const std::string &poses : {std::string("exact"), o.seeds.front()})
        out.push_back({{"poses", poses}, {"rows", measure_steps(load_cases(o, poses, skipped), thesis_t_m_m)}});
    return out;
}

Json measure(const Options &o)
{
    Json skipped = Json::array(), out;
    out["seeds"] = o.seeds;
    if (has_part(o, "wide")) out["wide"] = measure_wide_part(o);
    if (has_part(o, "tables")) out["tables"] = measure_tables_part(o);
    if (has_part(o, "poses")) out["poses"] = measure_poses_part(o, &skipped);
    if (has_part(o, "steps")) out["steps"] = measure_steps_part(o, &skipped);
    out["skipped"] = skipped;
    return out;
}

void write_json(const std::string &file, const Json &json)
{
    if (file.empty()) {
        std::cout << json.dump(1) << '\n';
        return;
    }
    std::ofstream out(file);
    out << json.dump(1) << '\n';
    if (!out.flush()) throw std::runtime_error(file + ": cannot be written");
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Matches, poses and the model's steps beside their rivals, on sites with truth.",
                 "outcrop-bench-matching");
    Options o;
    app.add_option("--sites", o.folders,
                   "folders that hold depot, two_obstacles, cubes; the first that has a site counts");
    app.add_option("--parts", o.parts, "of wide, tables, poses, steps; all if not told")->check(CLI::IsMember(kParts));
    app.add_option("--seeds", o.seeds,
                   "how poses are moved, as outcrop-drive --perturb; the first alone where one is enough")
        ->capture_default_str();
    app.add_flag("--quick", o.is_quick, "without affine SIFT");
    app.add_option("--json", o.json_file, "figures go here and not to standard output");
    auto *points = app.add_subcommand("points", "obstacles out of another program's points, held against the truth");
    points->add_option("SITE", o.site, "site folder")->required();
    points->add_option("FILE", o.points_file, "x y z in metres, a line each")->required();
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &e) {
        return app.exit(e) == 0 ? 0 : 2;
    }
    try {
        if (!points->parsed() && o.folders.empty()) throw std::runtime_error("--sites is missing");
        write_json(o.json_file, points->parsed() ? judge_points(o.site, o.points_file) : measure(o));
    } catch (const std::exception &e) {
        std::cerr << "outcrop-bench-matching: " << e.what() << '\n';
        return 1;
    }
    return 0;
}
