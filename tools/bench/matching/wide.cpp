// SPDX-License-Identifier: BSD-3-Clause
// Our matches beside the rivals' at pairs 40 to 60 degrees apart.
#include "wide.h"
#include "losses.h"

#include <chrono>
#include <cstdio>

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr double kDegree = 3.14159265358979323846 / 180;

double mean_points(const std::vector<View> &views)
{
    double sum = 0;
    for (const View &view : views) sum += static_cast<double>(view.junctions.size());
    return sum / static_cast<double>(views.size());
}

void put(const std::string &name, const std::vector<View> &views, const SiteCase &site, const SiteModel &model,
         Clock::time_point begin, WideCase *out)
{
    const double ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
    const MatchCount count = count_matches(site, pixel_matches(views, model.pairs));
    out->n_pairs = static_cast<int>(model.pairs.size());
    out->counts[name] = count;
    Json row = {{"name", name}, {"points", mean_points(views)}, {"model_ms", ms}};
    if (getenv("DUMP")) std::printf("%.0f ms\n", ms);
    row.update(to_json(count));
    row["wrong"] = to_json(sort_wrong(site, without_repeats(pixel_matches(views, model.pairs))));
    if (getenv("DUMP")) std::printf("%s\n", row["wrong"].dump().c_str());
    out->json["methods"].push_back(row);
    std::printf("  %-34s %6.0f points, %5d matches, %5d correct, %5d of them on obstacles; ground %5d, %5d\n",
                name.c_str(), mean_points(views), count.n, count.correct, count.correct_on_obstacle, count.ground_n,
                count.ground_correct);
    std::fflush(stdout);
}

std::string with_ratio(Feature feature, double ratio)
{
    char text[16];
    std::snprintf(text, sizeof text, " %.2f", ratio);
    return name_of(feature) + std::string(text);
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

WideCase measure_wide(const SiteCase &site, const WideOptions &options, Descriptions *descriptions)
{
    WideCase out;
    BuildOptions build;
    build.pairs = wide_pairs();
    if (getenv("MS")) build.match.min_score = atof(getenv("MS"));
    if (getenv("MM")) build.match.min_margin = atof(getenv("MM"));
    if (getenv("CR")) build.match.correlate.coarse_reject = atof(getenv("CR"));
    if (getenv("MF")) build.match.correlate.max_fine = atoi(getenv("MF"));
    if (getenv("WIN")) build.match.correlate.window_px = atoi(getenv("WIN"));
    if (getenv("GS")) build.match.correlate.gauss_sigma_px = atof(getenv("GS"));
    if (getenv("SM")) build.match.correlate.smooth_sigma_px = atof(getenv("SM"));
    if (getenv("WEDGE")) build.match.correlate.support = Support::kWedge;
    if (getenv("DEN")) build.third_views.max_denied = atof(getenv("DEN"));
    if (getenv("REP")) build.tracks.max_reprojection_px = atof(getenv("REP"));
    std::printf("%s, poses %s\n", site.name.c_str(), site.poses.c_str());
    out.json = {{"site", site.name}, {"poses", site.poses}, {"methods", Json::array()}};
    auto begin = Clock::now();
    put("ours", site.views, site, build_site(site.views, site.area, build), begin, &out);
    begin = Clock::now();
    build.with_third_views = false;
    put("ours, two views only", site.views, site, build_site(site.views, site.area, build), begin, &out);
    if (getenv("DUMP")) {
    out.json["funnel"] = to_json(measure_funnel(site, build.pairs, build.match));
    std::printf("%s\n", out.json["funnel"].dump().c_str());
    }
    for (const Feature feature : options.features) {
        const std::vector<Described> &described = descriptions->of(site, feature);
        const std::vector<View> views = with_points(site.views, described);
        for (const double ratio : feature == Feature::kAffineSift ? options.affine_ratios : options.ratios) {
            RivalOptions rival;
            rival.max_ratio = ratio;
            rival.pairs = build.pairs;
            begin = Clock::now();
            const SiteModel model = build_from_matches(views, site.area, rival_matcher(described, rival), build);
            put(with_ratio(feature, ratio), views, site, model, begin, &out);
        }
    }
    out.json["pairs"] = out.n_pairs;
    return out;
}

} // namespace outcrop::bench
