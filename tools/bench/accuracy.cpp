// SPDX-License-Identifier: BSD-3-Clause
#include "accuracy.h"

#include "bound.h"
#include "random.h"
#include "score.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace outcrop::bench {
namespace {

// ---- what is measured

struct Method {
    std::string name;
    int lambda_px;
    oc_judoca_params_t params;
};

// Blur and threshold that the targets are set for.
oc_judoca_params_t params_for(int variance)
{
    oc_judoca_params_t params = oc_judoca_defaults();
    params.sigma_px = variance <= 100 ? 1.2f : variance <= 400 ? 1.5f : 1.8f;
    params.t_b = variance <= 100 ? 6.0f : 8.0f;
    return params;
}

std::vector<Method> methods_for(int variance, const AccuracyOptions &options)
{
    std::vector<Method> methods;
    for (const int lambda : options.lambdas) {
        oc_judoca_params_t params = params_for(variance);
        params.lambda_px = params.lambda_min_px = lambda;
        methods.push_back({"fixed", lambda, params});
    }
    const oc_judoca_params_t grown = params_for(variance);
    methods.push_back({"grown", grown.lambda_px, grown});
    oc_judoca_params_t from_noise = grown;
    from_noise.t_b = 0;
    methods.push_back({"grown-auto", from_noise.lambda_px, from_noise});
    if (options.has_rivals) {
        oc_judoca_params_t thesis = params_for(variance);
        thesis.lambda_px = thesis.lambda_min_px = 10;
        thesis.method = OC_JUDOCA_THESIS;
        thesis.max_junctions = OC_MAX_JUNCTIONS;
        methods.push_back({"thesis", 10, thesis});
    }
    return methods;
}

void damage(std::vector<Found> &found, const Damage &damage)
{
    std::vector<Found> kept;
    for (std::size_t i = 0; i < found.size(); i++) {
        if (damage.drop_every > 0 && i % static_cast<std::size_t>(damage.drop_every) == 0) continue;
        kept.push_back(found[i]);
        kept.back().at_px.x += damage.shift_px;
        for (std::size_t b = 0; b < kept.back().angle_rad.size(); b += 2)
            kept.back().angle_rad[b] = wrapped(kept.back().angle_rad[b] + damage.turn_deg * kDegree);
    }
    found = kept;
}

// ---- one row

using Images = std::vector<cv::Mat>;

AccuracyRow measure_method(const std::string &set, int variance, const Method &method, const std::vector<Scene> &scenes,
                           const Images &images, const Damage &harm)
{
    Tally tally;
    Judoca judoca(method.params);
    std::vector<double> sums_deg;
    for (std::size_t i = 0; i < scenes.size(); i++) {
        std::vector<Found> found = judoca.find(images[i]);
        damage(found, harm);
        tally.add(scenes[i], found);
        double sum_deg;
        if (set == "triangles" && sum_of_angles(scenes[i], found, &sum_deg)) sums_deg.push_back(sum_deg);
    }
    AccuracyRow row{set, variance, method.name, method.lambda_px, tally.figures(), {}};
    if (const auto bias = row.figures.find("l_bias_deg"); bias != row.figures.end())
        row.figures["l_bias_size_deg"] = std::abs(bias->second);
    if (!sums_deg.empty()) {
        row.figures["sum_n"] = static_cast<double>(sums_deg.size());
        row.figures["sum_mean_deg"] = mean_of(sums_deg);
        row.figures["sum_sd_deg"] = deviation_of(sums_deg);
        row.figures["sum_error_deg"] = std::abs(mean_of(sums_deg) - 180);
    }
    return row;
}

AccuracyRow measure_gftt(const std::string &set, int variance, const std::vector<Scene> &scenes, const Images &images)
{
    Tally tally;
    for (std::size_t i = 0; i < scenes.size(); i++) {
        const int count = static_cast<int>(scenes[i].junctions.size()); // told to it; no other detector is
        tally.add(scenes[i], find_gftt(images[i], count, scenes[i].margin_px, true));
    }
    return {set, variance, "gftt+subpix", 0, tally.figures(), {}};
}

// `bounds` are those of variance 1, one for each of the options' lambdas.
void add_bounds(std::vector<AccuracyRow> &rows, const std::string &set, int variance, const AccuracyOptions &options,
                const std::vector<std::map<std::string, double>> &bounds)
{
    for (std::size_t i = 0; i < bounds.size(); i++) {
        std::map<std::string, double> figures;
        for (const auto &[name, value] : bounds[i]) figures[name] = value * std::sqrt(variance);
        rows.push_back({set, variance, "bound", options.lambdas[i], figures, {}});
    }
}

// ---- text

std::string cell(const AccuracyRow &row, const char *figure, int places, double scale = 1)
{
    const auto found = row.figures.find(figure);
    if (found == row.figures.end()) return "-";
    char text[32];
    std::snprintf(text, sizeof text, "%.*f", places, found->second * scale);
    return text;
}

} // namespace

std::vector<AccuracyRow> measure_accuracy(const AccuracyOptions &options)
{
    std::vector<AccuracyRow> rows;
    for (const std::string &set : options.sets) {
        const std::vector<Scene> scenes = make_set(set, options.is_quick, options.draw);
        Images clean;
        for (const Scene &scene : scenes) clean.push_back(render(scene.picture));
        std::vector<std::map<std::string, double>> bounds;
        if (options.has_rivals && set.rfind("cells", 0) == 0) bounds = information_bounds(scenes, options.lambdas);
        for (const int variance : options.variances) {
            Images images;
            for (const cv::Mat &image : clean)
                images.push_back(with_noise(image, variance,
                                            kSeed + images.size() * 7919 + set.size() +
                                                1000003 * static_cast<std::uint64_t>(options.draw)));
            for (const Method &method : methods_for(variance, options)) {
                rows.push_back(measure_method(set, variance, method, scenes, images, options.damage));
                if (method.name == "fixed")
                    rows.back().verdicts = judge(options.is_checked ? accuracy_gates(set, variance, method.lambda_px)
                                                                    : accuracy_targets(set, variance, method.lambda_px),
                                                 rows.back().figures);
            }
            if (variance > 0) add_bounds(rows, set, variance, options, bounds);
            if (options.has_rivals) rows.push_back(measure_gftt(set, variance, scenes, images));
        }
    }
    return rows;
}

std::string to_table(const std::vector<AccuracyRow> &rows)
{
    std::string text;
    std::string set;
    for (const AccuracyRow &row : rows) {
        char line[256];
        if (row.set != set) {
            std::snprintf(line, sizeof line, "%s%-10s %4s %-11s %3s %6s %6s %5s %6s %6s %6s %6s %6s %6s %5s  %s\n",
                          set.empty() ? "" : "\n", row.set.c_str(), "var", "method", "lam", "recall", "prec", "found",
                          "rmse", "median", "angle", "brRec", "brPrec", "Lbias", "kind", "triangle sum, sd, n");
            text += line;
            set = row.set;
        }
        const std::string sums =
            row.figures.count("sum_n") == 0
                ? ""
                : cell(row, "sum_mean_deg", 2) + " " + cell(row, "sum_sd_deg", 2) + " " + cell(row, "sum_n", 0);
        std::snprintf(line, sizeof line, "%-10s %4d %-11s %3d %6s %6s %5s %6s %6s %6s %6s %6s %6s %5s  %s\n", "",
                      row.variance, row.method.c_str(), row.lambda_px, cell(row, "recall", 3).c_str(),
                      cell(row, "precision", 3).c_str(), cell(row, "n_found", 0).c_str(),
                      cell(row, "rmse_px", 3).c_str(), cell(row, "median_px", 3).c_str(),
                      cell(row, "angle_rmse_deg", 2).c_str(), cell(row, "branch_recall", 3).c_str(),
                      cell(row, "branch_precision", 3).c_str(), cell(row, "l_bias_deg", 2).c_str(),
                      cell(row, "kind_confusion", 3).c_str(), sums.c_str());
        text += line;
        if (!row.verdicts.empty()) text += "             target " + to_text(row.verdicts) + "\n";
    }
    return text;
}

nlohmann::json to_json(const std::vector<AccuracyRow> &rows)
{
    nlohmann::json list = nlohmann::json::array();
    for (const AccuracyRow &row : rows) {
        list.push_back({{"set", row.set},
                        {"variance", row.variance},
                        {"method", row.method},
                        {"lambda_px", row.lambda_px},
                        {"figures", row.figures},
                        {"targets", to_json(row.verdicts)}});
    }
    return list;
}

} // namespace outcrop::bench
