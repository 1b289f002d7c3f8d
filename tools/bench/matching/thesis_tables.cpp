// SPDX-License-Identifier: BSD-3-Clause
// Table 5.3 of the thesis and its comparisons of correlations.
#include "thesis_tables.h"

#include <chrono>
#include <cstdio>

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr double kDegree = 3.14159265358979323846 / 180;
constexpr int kWindows[] = {11, 13, 15, 17};
constexpr double kThresholds[] = {0.50, 0.55, 0.60, 0.65, 0.70, 0.75};

// Total and correct as printed, window by window.
constexpr int kPrinted[4][6][2] = {{{44, 40}, {40, 37}, {35, 33}, {27, 25}, {23, 21}, {16, 16}},
                                   {{42, 36}, {38, 34}, {35, 32}, {28, 27}, {23, 22}, {17, 17}},
                                   {{40, 36}, {34, 33}, {33, 33}, {28, 28}, {20, 20}, {18, 18}},
                                   {{38, 36}, {35, 35}, {33, 33}, {26, 26}, {20, 20}, {18, 18}}};

Json cell(const MatchCount &count)
{
    return {count.n, count.correct};
}

} // namespace

Json measure_table_5_3(const SiteCase &site, const PairOfViews &pair)
{
    Json rows = Json::array();
    for (std::size_t w = 0; w < std::size(kWindows); w++) {
        for (std::size_t t = 0; t < std::size(kThresholds); t++) {
            PairMethod thesis, ours;
            thesis.match = thesis_match_options();
            for (PairMethod *method : {&thesis, &ours}) {
                method->match.correlate.window_px = kWindows[w];
                method->match.min_score = kThresholds[t];
            }
            const MatchCount a = match_and_count(site, pair, thesis), b = match_and_count(site, pair, ours);
            rows.push_back({{"window_px", kWindows[w]},
                            {"t_vnc", kThresholds[t]},
                            {"printed", {kPrinted[w][t][0], kPrinted[w][t][1]}},
                            {"thesis_form", cell(a)},
                            {"ours", cell(b)}});
            std::printf("  %d px, %.2f: printed %d/%d, thesis form %d/%d, ours %d/%d\n", kWindows[w], kThresholds[t],
                        kPrinted[w][t][1], kPrinted[w][t][0], a.correct, a.n, b.correct, b.n);
        }
    }
    return {{"site", site.name}, {"poses", site.poses}, {"left", pair.left}, {"right", pair.right}, {"rows", rows}};
}

Json measure_methods(const SiteCase &site, const std::vector<PairOfViews> &pairs, const std::string &title,
                     const ThesisThresholds &thresholds, const std::string &printed)
{
    std::printf("%s, poses %s, %zu pairs: %s\n", site.name.c_str(), site.poses.c_str(), pairs.size(), title.c_str());
    Json rows = Json::array();
    for (const PairMethod &method : thesis_methods(thresholds)) {
        MatchCount sum;
        const auto begin = Clock::now();
        for (const PairOfViews &pair : pairs) sum.add(match_and_count(site, pair, method));
        const double ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
        Json row = {{"method", method.name}, {"ms", ms}};
        row.update(to_json(sum));
        rows.push_back(row);
        std::printf("  %-62s %4d of %4d\n", method.name.c_str(), sum.correct, sum.n);
    }
    return {{"title", title},
            {"site", site.name},
            {"poses", site.poses},
            {"pairs", pairs.size()},
            {"window_px", thresholds.window_px},
            {"printed", printed},
            {"rows", rows}};
}

std::vector<PairOfViews> pairs_between(const SiteCase &site, double min_deg, double max_deg)
{
    PairOptions options;
    options.min_parallax_rad = min_deg * kDegree;
    options.max_parallax_rad = max_deg * kDegree;
    options.best_parallax_rad = (min_deg + max_deg) / 2 * kDegree;
    options.best_per_view = 1000;
    std::vector<PosedView> posed;
    for (const View &view : site.views) posed.push_back(as_reported(view));
    std::vector<PairOfViews> out;
    for (const ViewPair &pair : select_pairs(posed, site.area, options)) out.push_back({pair.left, pair.right});
    return out;
}

} // namespace outcrop::bench
