// SPDX-License-Identifier: BSD-3-Clause
// outcrop-bench-junctions: accuracy and repeatability of the junction detector beside others.
#include "accuracy.h"
#include "random.h"
#include "repeatability.h"
#include "scenes.h"
#include "thesis.h"

#include <CLI/CLI.hpp>
#include <fstream>
#include <iostream>
#include <opencv2/core/utility.hpp>

namespace {

using namespace outcrop::bench;

struct Output {
    std::string json_file;

    void write(const std::string &what, const nlohmann::json &result) const
    {
        if (json_file.empty()) return;
        std::ofstream file(json_file);
        file << nlohmann::json{{"bench", what}, {"seed", kSeed}, {"result", result}}.dump(1) << '\n';
        if (!file.flush()) throw std::runtime_error("cannot write " + json_file);
    }
};

// 0 when all are met.
template <typename Row>
int judge_all(const std::vector<Row> &rows, const char *what)
{
    std::size_t n_met = 0, n_judged = 0;
    for (const Row &row : rows) {
        for (const Verdict &verdict : row.verdicts) {
            n_judged++;
            n_met += verdict.is_met ? 1 : 0;
        }
    }
    std::cout << what << ": " << n_met << " of " << n_judged << " met\n";
    return n_met == n_judged && n_judged > 0 ? 0 : 1;
}

int run_accuracy(AccuracyOptions options, const std::string &set, const Output &output)
{
    options.sets = set.empty() ? kSets : set == "kinds" ? kCellSets : std::vector<std::string>{set};
    if (options.variances.empty())
        options.variances = options.is_quick ? std::vector<int>{0, 100} : std::vector<int>{0, 100, 400, 1000};
    if (options.lambdas.empty())
        options.lambdas = options.is_quick ? std::vector<int>{10, 15} : std::vector<int>{8, 10, 13, 15, 20};
    const std::vector<AccuracyRow> rows = measure_accuracy(options);
    std::cout << "seed " << kSeed << ", draw " << options.draw << ", blur 0.7 px, match within 2 px and 15 degrees\n"
              << to_table(rows);
    output.write("accuracy", to_json(rows));
    const int status = judge_all(rows, options.is_checked ? "gates" : "targets");
    return options.is_checked ? status : 0;
}

int run_repeatability(const RepeatabilityOptions &options, const Output &output)
{
    const Repeatability result = measure_repeatability(options);
    std::cout << "seed " << kSeed << ", match within 2 px\n" << to_table(result);
    if (options.natural.empty()) std::cout << "SKIPPED: natural pictures, no --natural given\n";
    output.write("repeatability", to_json(result));
    judge_all(result.rows, "targets");
    return 0;
}

struct ThesisOptions {
    std::string figure;
    std::vector<std::filesystem::path> sites;
};

int run_thesis(const ThesisOptions &options, const Output &output)
{
    nlohmann::json result;
    const auto is_wanted = [&](const char *figure) { return options.figure.empty() || options.figure == figure; };
    if (is_wanted("3.2")) result["noise"] = thesis_noise();
    if (is_wanted("3.5")) result["triangle"] = thesis_triangle();
    if (is_wanted("3.6")) result["chess"] = thesis_chess();
    if (is_wanted("3.10")) result["lines"] = thesis_lines(options.sites);
    std::cout << "seed " << kSeed << '\n';
    for (auto &[name, part] : result.items()) {
        std::cout << part.at("text").get<std::string>() << '\n';
        part.erase("text");
    }
    output.write("thesis", result);
    return 0;
}

int run_chess_stereo(const std::filesystem::path &folder, const Output &output)
{
    nlohmann::json result = chess_stereo(folder);
    std::cout << result.at("text").get<std::string>();
    result.erase("text");
    output.write("chess-stereo", result);
    return 0;
}

CLI::App *add_accuracy(CLI::App &app, AccuracyOptions &options, std::string &set)
{
    CLI::App *accuracy = app.add_subcommand("accuracy", "place and angle on exact scenes");
    std::vector<std::string> names = kSets;
    names.insert(names.end(), kCellSets.begin(), kCellSets.end());
    names.push_back("kinds");
    accuracy->add_option("--set", set, "only this set; kinds: the cells of each kind")->check(CLI::IsMember(names));
    accuracy->add_option("--draw", options.draw, "other scenes of the same kind")->check(CLI::Range(0, 1000));
    accuracy->add_option("--variance", options.variances, "only these noise variances")->delimiter(',');
    accuracy->add_option("--lambda", options.lambdas, "only these branch lengths, px")->delimiter(',');
    accuracy->add_flag("--quick", options.is_quick, "few scenes, variance 0 and 100, lambda 10 and 15");
    accuracy->add_flag("!--no-rivals", options.has_rivals, "our detector only");
    accuracy->add_flag("--check", options.is_checked, "judge by the gates; exit 1 unless all hold");
    accuracy->add_option("--plant-shift", options.damage.shift_px, "move what was found, px");
    accuracy->add_option("--plant-turn", options.damage.turn_deg, "turn every second branch found, degrees");
    accuracy->add_option("--plant-drop", options.damage.drop_every, "lose one junction in so many");
    return accuracy;
}

CLI::App *add_repeatability(CLI::App &app, RepeatabilityOptions &options)
{
    CLI::App *repeatability = app.add_subcommand("repeatability", "share of points found again in another view");
    repeatability->add_option("--natural", options.natural, "list of crops with natural texture")
        ->check(CLI::ExistingFile);
    repeatability->add_option("--sites", options.sites, "folder of sites; may be repeated, first found is used");
    repeatability->add_flag("--quick", options.is_quick, "few scenes");
    return repeatability;
}

CLI::App *add_thesis(CLI::App &app, ThesisOptions &options)
{
    CLI::App *thesis = app.add_subcommand("thesis", "the experiments of thesis 3.4, as printed and with ours");
    thesis->add_option("--figure", options.figure, "only this one; 3.2 is 3.3 as well")
        ->check(CLI::IsMember({"3.2", "3.5", "3.6", "3.10"}));
    thesis->add_option("--sites", options.sites, "folder of sites with cubes in it, for 3.10; may be repeated");
    return thesis;
}

CLI::App *add_chess_stereo(CLI::App &app, std::filesystem::path &folder)
{
    CLI::App *chess = app.add_subcommand("chess-stereo", "photographed chessboards");
    chess->add_option("--real", folder, "folder with cameras.json and images/")->required();
    return chess;
}

} // namespace

int main(int argc, char **argv)
{
    CLI::App app("Accuracy and repeatability of the junction detector.", "outcrop-bench-junctions");
    app.footer("Exit: 0 measured, 1 a gate does not hold or a file cannot be read, 2 wrong usage.");
    app.require_subcommand(1);
    app.fallthrough();
    Output output;
    app.add_option("--json", output.json_file, "write the figures to this file");
    AccuracyOptions accuracy_options;
    std::string set;
    const CLI::App *accuracy = add_accuracy(app, accuracy_options, set);
    RepeatabilityOptions repeatability_options;
    const CLI::App *repeatability = add_repeatability(app, repeatability_options);
    ThesisOptions thesis_options;
    const CLI::App *thesis = add_thesis(app, thesis_options);
    std::filesystem::path real;
    const CLI::App *chess = add_chess_stereo(app, real);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError &e) {
        return app.exit(e) == 0 ? 0 : 2;
    }
    cv::setNumThreads(1);
    try {
        if (accuracy->parsed()) return run_accuracy(accuracy_options, set, output);
        if (repeatability->parsed()) return run_repeatability(repeatability_options, output);
        if (thesis->parsed()) return run_thesis(thesis_options, output);
        if (chess->parsed()) return run_chess_stereo(real, output);
    } catch (const std::exception &e) {
        std::cerr << "outcrop-bench-junctions: " << e.what() << '\n';
        return 1;
    }
    return 0;
}
