// SPDX-License-Identifier: BSD-3-Clause
// Our matches beside the rivals' at pairs 40 to 60 degrees apart.
#include "wide.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <optional>

#include "losses.h"

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr double kUsualRatio = 0.8;
constexpr double kPrecision = 0.95;
constexpr double kDegree = 3.14159265358979323846 / 180;

double mean_points(const std::vector<View> &views)
{
    double sum = 0;
    for (const View &view : views) sum += static_cast<double>(view.junctions.size());
    return sum / static_cast<double>(views.size());
}

// Runs one method and adds what it finds.
void add(const std::string &name, const SiteCase &site, const std::vector<View> &views,
         const std::function<SiteModel()> &build, WideCase *out)
{
    const auto begin = Clock::now();
    const SiteModel model = build();
    const double ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
    const std::vector<PixelMatch> matches = without_repeats(pixel_matches(views, model.pairs));
    const MatchCount count = count_matches(site, matches);
    out->n_pairs = static_cast<int>(model.pairs.size());
    out->counts[name] = count;
    Json row = {{"method", name}, {"points", mean_points(views)}, {"ms", ms}};
    row.update(to_json(count));
    row["wrong"] = to_json(sort_wrong(site, matches));
    out->json["methods"].push_back(row);
    std::printf("  %-32s %5.0f points, %5d of %5d right, %5d on obstacles\n", name.c_str(), mean_points(views),
                count.correct, count.n, count.correct_on_obstacle);
    std::fflush(stdout);
}

std::string with_ratio(Feature feature, double ratio)
{
    char text[16];
    std::snprintf(text, sizeof text, " %.2f", ratio);
    return name_of(feature) + std::string(text);
}

const std::vector<double> &ratios_of(Feature feature, const WideOptions &options)
{
    return feature == Feature::kAffineSift ? options.affine_ratios : options.ratios;
}

} // namespace

PairOptions wide_pairs()
{
    PairOptions pairs;
    pairs.min_parallax_rad = 40 * kDegree;
    pairs.max_parallax_rad = 60 * kDegree;
    pairs.best_parallax_rad = 50 * kDegree;
    pairs.min_overlap = 0.1;
    pairs.max_scale_ratio = 3;
    pairs.best_per_view = 1000;
    return pairs;
}

const std::vector<Described> &Descriptions::of(const SiteCase &site, Feature feature)
{
    std::vector<Described> &known = known_[{site.name, feature}];
    if (known.empty())
        for (const View &view : site.views) known.push_back(describe(feature, view.grey));
    return known;
}

WideCase measure_wide(const SiteCase &site, const SiteCase &all, const WideOptions &options, Descriptions *descriptions)
{
    WideCase out;
    BuildOptions build;
    build.pairs = wide_pairs();
    std::printf("%s, poses %s\n", site.name.c_str(), site.poses.c_str());
    out.json = {{"site", site.name}, {"poses", site.poses}, {"pairs", 0}, {"methods", Json::array()}};
    const auto ours = [&](const SiteCase &from) { return build_site(from.views, from.area, build); };
    add(
        "ours", site, site.views, [&] { return ours(site); }, &out);
    add(
        "ours, every junction", all, all.views, [&] { return ours(all); }, &out);
    build.match.correlate.support = Support::kWedge;
    add(
        "ours, wedge", site, site.views, [&] { return ours(site); }, &out);
    build.match.correlate.support = Support::kWindow;
    build.with_third_views = false;
    add(
        "ours, two views only", site, site.views, [&] { return ours(site); }, &out);
    out.json["losses"] = to_json(measure_funnel(site, build.pairs, build.match));
    for (const Feature feature : options.features) {
        const std::vector<Described> &described = descriptions->of(site, feature);
        const std::vector<View> views = with_points(site.views, described);
        for (const double ratio : ratios_of(feature, options)) {
            RivalOptions rival;
            rival.max_ratio = ratio;
            rival.pairs = build.pairs;
            add(
                with_ratio(feature, ratio), site, views,
                [&] { return build_from_matches(views, site.area, rival_matcher(described, rival), build); }, &out);
        }
    }
    out.json["pairs"] = out.n_pairs;
    return out;
}

namespace {

// The laxest ratio whose matches are right in 95 %; nothing when none is.
std::optional<double> ratio_at_95(Feature feature, const WideCounts &sums, const WideOptions &options)
{
    std::optional<double> out;
    for (const double ratio : ratios_of(feature, options)) {
        const MatchCount &count = sums.at(with_ratio(feature, ratio));
        if (count.n > 0 && count.correct >= kPrecision * count.n) out = std::max(out.value_or(ratio), ratio);
    }
    return out;
}

Json over(const MatchCount &ours, const MatchCount &rival)
{
    if (rival.correct_on_obstacle == 0) return nullptr;
    return static_cast<double>(ours.correct_on_obstacle) / rival.correct_on_obstacle;
}

} // namespace

Json sum_wide(const std::string &title, const std::vector<WideCase> &cases, const WideOptions &options)
{
    WideCounts sums;
    Json names = Json::array();
    int n_pairs = 0;
    for (const WideCase &one : cases) {
        for (const auto &[name, count] : one.counts) sums[name].add(count);
        names.push_back(one.json["site"].get<std::string>() + ", " + one.json["poses"].get<std::string>());
        n_pairs += one.n_pairs;
    }
    Json rows = Json::array();
    for (const auto &[name, count] : sums) {
        rows.push_back({{"method", name}});
        rows.back().update(to_json(count));
    }
    Json ratios = Json::array();
    const MatchCount &ours = sums["ours"];
    for (const Feature feature : options.features) {
        const auto at_95 = ratio_at_95(feature, sums, options);
        ratios.push_back(
            {{"rival", name_of(feature)},
             {"ratio", kUsualRatio},
             {"ours_over_rival", over(ours, sums[with_ratio(feature, kUsualRatio)])},
             {"ratio_at_95", at_95 ? Json(*at_95) : Json(nullptr)},
             {"ours_over_rival_at_95", at_95 ? over(ours, sums[with_ratio(feature, *at_95)]) : Json(nullptr)}});
        std::printf("%s: %s\n", title.c_str(), ratios.back().dump().c_str());
    }
    return {{"title", title}, {"cases", names}, {"pairs", n_pairs}, {"methods", rows}, {"ratios", ratios}};
}

} // namespace outcrop::bench
