// SPDX-License-Identifier: BSD-3-Clause
#include "target.h"

#include <cmath>
#include <cstdio>

namespace outcrop::bench {
namespace {

struct Entry {
    const char *set;
    int variance, lambda_px;
    Target target;
};

// "<=" as {figure, false, limit}, ">=" as {figure, true, limit}.
const std::vector<Entry> kTargets = {
    {"chess", 0, 10, {"rmse_px", false, 0.03, 2}},          {"chess", 0, 10, {"angle_rmse_deg", false, 0.15, 2}},
    {"cells", 0, 10, {"rmse_px", false, 0.08, 2}},          {"cells", 0, 10, {"angle_rmse_deg", false, 0.3, 2}},
    {"cells", 0, 10, {"l_bias_size_deg", false, 0.2, 2}},   {"cells", 100, 10, {"rmse_px", false, 0.42, 3}},
    {"cells", 100, 10, {"angle_rmse_deg", false, 2.0, 3}},  {"cells", 100, 10, {"recall", true, 0.99, 3}},
    {"cells", 100, 10, {"precision", true, 0.98, 3}},       {"cells", 100, 15, {"rmse_px", false, 0.28, 3}},
    {"cells", 100, 15, {"angle_rmse_deg", false, 1.05, 3}}, {"cells", 100, 15, {"recall", true, 0.99, 3}},
    {"cells", 100, 15, {"precision", true, 0.98, 3}},       {"cells", 100, 20, {"rmse_px", false, 0.22, 3}},
    {"cells", 100, 20, {"angle_rmse_deg", false, 0.68, 3}}, {"cells", 100, 20, {"recall", true, 0.99, 3}},
    {"cells", 100, 20, {"precision", true, 0.98, 3}},       {"cells", 400, 15, {"recall", true, 0.95, 3}},
    {"cells", 400, 15, {"precision", true, 0.95, 3}},       {"cells", 1000, 10, {"recall", true, 0.87, 3}},
    {"cells", 1000, 10, {"precision", true, 0.90, 3}},      {"triangles", 0, 10, {"sum_error_deg", false, 1.0, 4}},
    {"triangles", 0, 15, {"sum_error_deg", false, 0.2, 4}}, {"triangles", 0, 20, {"sum_error_deg", false, 0.2, 4}},
};

// Just below what the detector reaches on draw 0, quick or whole; other draws stray by up to a fifth.
const std::vector<Entry> kGates = {
    {"cells", 0, 10, {"recall", true, 0.98, 0}},
    {"cells", 0, 10, {"precision", true, 0.99, 0}},
    {"cells", 0, 10, {"rmse_px", false, 0.08, 0}},
    {"cells", 0, 10, {"angle_rmse_deg", false, 0.3, 0}},
    {"cells", 0, 10, {"l_bias_size_deg", false, 0.2, 0}},
    {"cells", 0, 15, {"rmse_px", false, 0.06, 0}},
    {"cells", 0, 15, {"angle_rmse_deg", false, 0.2, 0}},
    {"cells", 100, 10, {"recall", true, 0.96, 0}},
    {"cells", 100, 10, {"precision", true, 0.96, 0}},
    {"cells", 100, 10, {"rmse_px", false, 0.45, 0}},
    {"cells", 100, 10, {"angle_rmse_deg", false, 2.2, 0}},
    {"cells", 100, 15, {"rmse_px", false, 0.37, 0}},
    {"cells", 100, 15, {"angle_rmse_deg", false, 1.25, 0}},
    {"polys", 0, 10, {"recall", true, 0.98, 0}},
    {"polys", 0, 10, {"precision", true, 0.99, 0}},
    {"polys", 0, 10, {"rmse_px", false, 0.04, 0}},
    {"polys", 0, 10, {"angle_rmse_deg", false, 0.2, 0}},
    {"chess", 0, 10, {"recall", true, 0.999, 0}},
    {"chess", 0, 10, {"precision", true, 0.999, 0}},
    {"chess", 0, 10, {"rmse_px", false, 0.01, 0}},
    {"chess", 0, 10, {"angle_rmse_deg", false, 0.08, 0}},
    {"chess", 100, 10, {"recall", true, 0.99, 0}},
    {"chess", 100, 10, {"rmse_px", false, 0.18, 0}},
    {"triangles", 0, 10, {"sum_error_deg", false, 0.5, 0}},
    {"triangles", 0, 15, {"sum_error_deg", false, 0.2, 0}},
};

std::vector<Target> select(const std::vector<Entry> &entries, const std::string &set, int variance, int lambda_px)
{
    std::vector<Target> chosen;
    for (const Entry &entry : entries) {
        if (entry.set == set && entry.variance == variance && entry.lambda_px == lambda_px)
            chosen.push_back(entry.target);
    }
    return chosen;
}

} // namespace

std::vector<Verdict> judge(const std::vector<Target> &targets, const std::map<std::string, double> &figures)
{
    std::vector<Verdict> verdicts;
    for (const Target &target : targets) {
        const auto figure = figures.find(target.figure);
        const bool is_known = figure != figures.end();
        const double value = is_known ? figure->second : std::nan("");
        const bool is_met = target.is_floor ? value >= target.limit : value <= target.limit; // NaN misses
        verdicts.push_back({target, is_known, is_met, value});
    }
    return verdicts;
}

std::string to_text(const std::vector<Verdict> &verdicts)
{
    std::string text;
    for (const Verdict &verdict : verdicts) {
        char line[160];
        const char *sign = verdict.target.is_floor ? ">=" : "<=";
        if (verdict.is_met || !verdict.is_known)
            std::snprintf(line, sizeof line, "%s %s %g: %s", verdict.target.figure.c_str(), sign, verdict.target.limit,
                          verdict.is_met ? "met" : "NOT KNOWN");
        else
            std::snprintf(line, sizeof line, "%s %s %g: MISSED by %.3g", verdict.target.figure.c_str(), sign,
                          verdict.target.limit, std::abs(verdict.value - verdict.target.limit));
        text += (text.empty() ? "" : "; ") + std::string(line);
    }
    return text;
}

nlohmann::json to_json(const std::vector<Verdict> &verdicts)
{
    nlohmann::json list = nlohmann::json::array();
    for (const Verdict &verdict : verdicts) {
        list.push_back({{"figure", verdict.target.figure},
                        {"is_floor", verdict.target.is_floor},
                        {"limit", verdict.target.limit},
                        {"number", verdict.target.number},
                        {"value", verdict.is_known ? nlohmann::json(verdict.value) : nlohmann::json()},
                        {"met", verdict.is_met}});
    }
    return list;
}

std::vector<Target> accuracy_targets(const std::string &set, int variance, int lambda_px)
{
    return select(kTargets, set, variance, lambda_px);
}

std::vector<Target> accuracy_gates(const std::string &set, int variance, int lambda_px)
{
    return select(kGates, set, variance, lambda_px);
}

std::vector<Target> repeatability_targets(const std::string &set, const std::string &warp)
{
    static const std::map<std::string, double> natural = {{"rot15", 0.6}, {"scale.75", 0.5}, {"tilt40", 0.55}};
    if (set == "natural") return {{"repeatability", true, natural.at(warp), 5}};
    std::vector<Target> targets = {{"lead_over_harris", true, 0.001, 5}};
    if (warp != "scale.75") targets.push_back({"repeatability", true, 0.95, 5});
    return targets;
}

} // namespace outcrop::bench
