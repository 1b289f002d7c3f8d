// SPDX-License-Identifier: BSD-3-Clause
#include "repeatability.h"

#include "eval/image_file.h"
#include "random.h"
#include "scenes.h"
#include "score.h"
#include "warp.h"

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

namespace outcrop::bench {
namespace {

constexpr double kMarginPx = 16; // no detector looks farther round a point than about this
constexpr int kMaxStructured = 300, kMaxNatural = 100;

struct Detector {
    std::string name;
    std::function<std::vector<Found>(const cv::Mat &)> find;
};

std::function<std::vector<Found>(const cv::Mat &)> judoca(oc_judoca_params_t params)
{
    params.max_junctions = OC_MAX_JUNCTIONS;
    return [params](const cv::Mat &grey) { return Judoca(params).find(grey); };
}

// Ours first: it sets the count.
std::vector<Detector> detectors()
{
    oc_judoca_params_t thesis = oc_judoca_defaults();
    thesis.lambda_min_px = thesis.lambda_px;
    thesis.method = OC_JUDOCA_THESIS;
    oc_judoca_params_t corners = oc_judoca_defaults();
    corners.max_corners = OC_MAX_JUNCTIONS;
    return {{"ours", judoca(oc_judoca_defaults())},
            {"harris", find_harris},
            {"gftt", [](const cv::Mat &grey) { return find_gftt(grey, 2000, 3, false); }},
            {"fast", find_fast},
            {"orb", find_orb},
            {"sift", find_sift},
            {"thesis", judoca(thesis)},
            {"ours+corners", judoca(corners)}};
}

struct Pair {
    cv::Mat first, second;
    Views views;
};

std::vector<NamedWarp> structured_warps(int scene)
{
    const double axis = 90 + 37.0 * scene;
    return {{"rot15", rotation_deg(15)},    {"rot45", rotation_deg(45)},    {"scale.75", scaling(0.75)},
            {"scale.5", scaling(0.5)},      {"tilt20", tilt_deg(20, axis)}, {"tilt40", tilt_deg(40, axis)},
            {"tilt50", tilt_deg(50, axis)}, {"tilt60", tilt_deg(60, axis)}};
}

std::vector<NamedWarp> natural_warps(int crop)
{
    return {{"rot15", rotation_deg(15)}, {"scale.75", scaling(0.75)}, {"tilt40", tilt_deg(40, 90 + 37.0 * crop)}};
}

bool is_inside(const cv::Point2d &point, const cv::Size &size)
{
    return point.x >= kMarginPx && point.y >= kMarginPx && point.x <= size.width - 1 - kMarginPx &&
           point.y <= size.height - 1 - kMarginPx;
}

// Points of one view that both see, in its own pixels.
std::vector<cv::Point2d> shared(const std::vector<Found> &found, const cv::Matx33d &other_from_here,
                                const cv::Size &here, const cv::Size &other)
{
    std::vector<cv::Point2d> points;
    for (const Found &one : found) {
        if (is_inside(one.at_px, here) && is_inside(transformed(one.at_px, other_from_here), other))
            points.push_back(one.at_px);
    }
    return points;
}

// ---- pairs

Pair structured_pair(const Scene &scene, const NamedWarp &warp, int variance, std::uint64_t seed)
{
    const cv::Size size(scene.picture.width_px, scene.picture.height_px);
    const cv::Matx33d matrix = about_middle(warp.matrix, size.width, size.height);
    const cv::Mat second = render(transformed(scene.picture, matrix, size.width, size.height));
    return {with_noise(render(scene.picture), variance, seed),
            with_noise(second, variance, seed + 1),
            {size, size, matrix}};
}

struct Crop {
    std::string name;
    cv::Mat grey; // the whole picture
    cv::Rect part;
};

std::vector<Crop> read_crops(const RepeatabilityOptions &options, std::vector<std::string> &skipped)
{
    std::ifstream file(options.natural);
    if (!file) throw std::runtime_error("cannot read " + options.natural.string());
    std::vector<Crop> crops;
    const nlohmann::json list = nlohmann::json::parse(file);
    for (const nlohmann::json &crop : list.at("crops")) {
        const std::string image = crop.at("image"), name = image + ", " + crop.at("kind").get<std::string>();
        std::optional<std::filesystem::path> found;
        for (const std::filesystem::path &sites : options.sites) {
            if (!found) found = eval::find_image(sites / image);
        }
        if (!found) {
            skipped.push_back(name);
            continue;
        }
        const cv::Rect part(crop.at("x"), crop.at("y"), crop.at("w"), crop.at("h"));
        crops.push_back({name, eval::read_image(*found, cv::IMREAD_GRAYSCALE), part});
        if ((part & cv::Rect({}, crops.back().grey.size())) != part)
            throw std::runtime_error(options.natural.string() + ": " + name + " is not inside its picture");
    }
    return crops;
}

// The second view takes in what lies round the crop as well, so that it has no false border.
Pair natural_pair(const Crop &crop, const NamedWarp &warp)
{
    const cv::Size size = crop.part.size();
    const cv::Matx33d matrix = about_middle(warp.matrix, size.width, size.height);
    const cv::Matx33d crop_from_picture(1, 0, -crop.part.x, 0, 1, -crop.part.y, 0, 0, 1);
    return {crop.grey(crop.part).clone(), warped(crop.grey, matrix * crop_from_picture, size), {size, size, matrix}};
}

// ---- rows

struct Sums {
    double repeated = 0, n = 0;
    int n_pairs = 0;
};

// All detectors on one pair; pairs with too few points to speak of are left out for all.
void add_pair(const Pair &pair, int max_points, const std::vector<Detector> &all, std::vector<Sums> &sums)
{
    constexpr int kFewest = 10;
    int n_ours = max_points;
    for (std::size_t i = 0; i < all.size(); i++) {
        int n = n_ours;
        const double share = share_repeated(pair.views, all[i].find(pair.first), all[i].find(pair.second), &n);
        if (i == 0) n_ours = n;
        if (n_ours < kFewest) return;
        sums[i].repeated += share;
        sums[i].n += n;
        sums[i].n_pairs++;
    }
}

void add_rows(std::vector<RepeatabilityRow> &rows, const std::string &set, const std::string &warp, int variance,
              const std::vector<Detector> &all, const std::vector<Sums> &sums)
{
    const std::size_t first = rows.size();
    for (std::size_t i = 0; i < all.size(); i++) {
        const Sums &sum = sums[i];
        if (sum.n_pairs == 0) continue;
        const std::map<std::string, double> figures = {
            {"repeatability", sum.repeated / sum.n_pairs}, {"n", sum.n / sum.n_pairs}, {"n_pairs", sum.n_pairs}};
        rows.push_back({set, warp, all[i].name, variance, figures, {}});
    }
    if (rows.size() < first + 2) return;
    RepeatabilityRow &ours = rows[first];
    ours.figures["lead_over_harris"] = ours.figures.at("repeatability") - rows[first + 1].figures.at("repeatability");
    if (variance == 0) ours.verdicts = judge(repeatability_targets(set, warp), ours.figures);
}

void measure_structured(const RepeatabilityOptions &options, std::vector<RepeatabilityRow> &rows)
{
    const std::vector<Detector> all = detectors();
    std::vector<Scene> scenes = make_set("polys", options.is_quick);
    for (const Scene &board : make_set("chess", options.is_quick)) scenes.push_back(board);
    for (const int variance : {0, 100}) {
        for (std::size_t w = 0; w < structured_warps(0).size(); w++) {
            std::vector<Sums> sums(all.size());
            for (std::size_t s = 0; s < scenes.size(); s++) {
                const NamedWarp warp = structured_warps(static_cast<int>(s))[w];
                add_pair(structured_pair(scenes[s], warp, variance, kSeed + 2 * (s + 100 * w)), kMaxStructured, all,
                         sums);
            }
            add_rows(rows, "structured", structured_warps(0)[w].name, variance, all, sums);
        }
    }
}

void measure_natural(const RepeatabilityOptions &options, Repeatability &result)
{
    const std::vector<Detector> all = detectors();
    const std::vector<Crop> crops = read_crops(options, result.skipped);
    for (std::size_t w = 0; w < natural_warps(0).size(); w++) {
        std::vector<Sums> sums(all.size());
        for (std::size_t c = 0; c < crops.size(); c++)
            add_pair(natural_pair(crops[c], natural_warps(static_cast<int>(c))[w]), kMaxNatural, all, sums);
        add_rows(result.rows, "natural", natural_warps(0)[w].name, 0, all, sums);
    }
}

} // namespace

double share_repeated(const Views &views, const std::vector<Found> &first, const std::vector<Found> &second, int *n)
{
    std::vector<cv::Point2d> here = shared(first, views.second_from_first, views.first_px, views.second_px);
    std::vector<cv::Point2d> there = shared(second, views.second_from_first.inv(), views.second_px, views.first_px);
    const std::size_t count = std::min({static_cast<std::size_t>(*n), here.size(), there.size()});
    *n = static_cast<int>(count);
    if (count == 0) return 0;
    here.resize(count);
    there.resize(count);
    for (cv::Point2d &point : here) point = transformed(point, views.second_from_first);
    return static_cast<double>(pair_points(here, there, kMatchPx).size()) / static_cast<double>(count);
}

Repeatability measure_repeatability(const RepeatabilityOptions &options)
{
    Repeatability result;
    measure_structured(options, result.rows);
    if (!options.natural.empty()) measure_natural(options, result);
    return result;
}

std::string to_table(const Repeatability &result)
{
    std::string text, judged;
    double n_ours = 0;
    for (const RepeatabilityRow &row : result.rows) {
        char cell[96];
        const double n = row.figures.at("n");
        if (row.detector == "ours") {
            n_ours = n;
            std::snprintf(cell, sizeof cell, "%s%-10s %-8s var %-3d n %-4.0f", text.empty() ? "" : "\n",
                          row.set.c_str(), row.warp.c_str(), row.variance, n);
            text += cell;
        }
        std::snprintf(cell, sizeof cell, "  %s %.3f", row.detector.c_str(), row.figures.at("repeatability"));
        text += cell;
        if (n < n_ours - 0.5) text += " (n " + std::to_string(static_cast<int>(n + 0.5)) + ")";
        if (!row.verdicts.empty()) judged += "target " + row.set + " " + row.warp + ": " + to_text(row.verdicts) + "\n";
    }
    text += "\n" + judged;
    for (const std::string &name : result.skipped) text += "SKIPPED, its picture is not there: " + name + "\n";
    return text;
}

nlohmann::json to_json(const Repeatability &result)
{
    nlohmann::json rows = nlohmann::json::array();
    for (const RepeatabilityRow &row : result.rows) {
        rows.push_back({{"set", row.set},
                        {"warp", row.warp},
                        {"variance", row.variance},
                        {"detector", row.detector},
                        {"figures", row.figures},
                        {"targets", to_json(row.verdicts)}});
    }
    return {{"rows", rows}, {"skipped", result.skipped}};
}

} // namespace outcrop::bench
