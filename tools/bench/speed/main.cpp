// SPDX-License-Identifier: BSD-3-Clause
// outcrop-bench-speed: the detector's time on one thread, beside GaussianBlur + Canny in pairs and beside others in rows.
#include <CLI/CLI.hpp>
#include <benchmark/benchmark.h>
#include <fstream>
#include <iostream>
#include <opencv2/core.hpp>

#include "images.h"
#include "paired.h"
#include "rivals.h"
#include "rows.h"

using namespace outcrop::bench;

namespace {

struct Options {
    std::vector<std::string> sites = {"tests/data/sites", "../shared/sites"};
    std::vector<std::string> sizes = {"640x480", "1920x1080"};
    std::string only, json;
    PairedOptions paired;
    bool has_rows = true, has_pairs = true;
};

std::vector<Picture> pictures_of(const Options &options, std::vector<std::string> &missing)
{
    std::vector<Picture> all;
    for (const std::string &text : options.sizes) {
        cv::Size size;
        if (std::sscanf(text.c_str(), "%dx%d", &size.width, &size.height) != 2)
            throw std::runtime_error(text + " is no size");
        missing.clear();
        for (Picture &picture : make_pictures(size, options.sites, missing)) {
            if (picture.name.find(options.only) != std::string::npos) all.push_back(std::move(picture));
        }
    }
    for (const std::string &name : missing)
        std::cerr << "outcrop-bench-speed: SKIPPED, no such photograph in any site directory: " << name << '\n';
    return all;
}

void run(const Options &options)
{
    std::vector<std::string> missing;
    const std::vector<Picture> pictures = pictures_of(options, missing);
    nlohmann::json result = {{"threads", 1},
                             {"opencv", CV_VERSION},
                             {"canny_thresholds", {kCannyThreshold, kCannyThreshold}},
                             {"skipped", missing}};
    if (options.has_pairs) {
        std::vector<PairedRow> rows;
        for (const Picture &picture : pictures) rows.push_back(take_pairs(picture, options.paired));
        print_table(std::cout, rows);
        for (const PairedRow &row : rows) result["paired"].push_back(to_json(row));
    }
    if (options.has_rows) result["rows"] = run_rows(pictures);
    if (options.json.empty()) return;
    std::ofstream file(options.json);
    file << result.dump(2) << '\n';
    if (!file.flush()) throw std::runtime_error("cannot write " + options.json);
}

} // namespace

int main(int argc, char **argv)
{
    benchmark::Initialize(&argc, argv); // takes the --benchmark_... options out
    cv::setNumThreads(1);

    Options options;
    CLI::App app("Times the junction detector on one thread beside OpenCV's detectors.", "outcrop-bench-speed");
    app.footer("Also takes Google Benchmark's options, such as --benchmark_filter=LSD and --benchmark_min_time=0.1.");
    app.add_option("--sites", options.sites, "directories of site folders")->capture_default_str();
    app.add_option("--sizes", options.sizes, "WIDTHxHEIGHT...")->capture_default_str();
    app.add_option("--only", options.only, "only pictures whose name contains this");
    app.add_option("--pairs", options.paired.n_pairs, "pairs per picture")->capture_default_str();
    app.add_option("--json", options.json, "write all figures there");
    app.add_flag("!--no-literal", options.paired.has_literal, "leave the literal method out of the pairs");
    app.add_flag("!--no-rows", options.has_rows, "pairs only");
    app.add_flag("!--no-pairs", options.has_pairs, "rows only");
    try {
        app.parse(argc, argv);
        run(options);
    } catch (const CLI::ParseError &e) {
        return app.exit(e) == 0 ? 0 : 2;
    } catch (const std::exception &e) {
        std::cerr << "outcrop-bench-speed: " << e.what() << '\n';
        return 1;
    }
    return 0;
}
