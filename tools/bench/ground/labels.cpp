// SPDX-License-Identifier: BSD-3-Clause
// Labels of a whole run against the truth of its site.
#include "labels.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "scene.h"

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

eval::Label label_of(const oc_junction_t &junction)
{
    if (junction.label == OC_LABEL_GROUND) return eval::Label::kGround;
    return junction.label == OC_LABEL_OBSTACLE ? eval::Label::kObstacle : eval::Label::kUnknown;
}

struct Labelled {
    std::vector<eval::ViewJunctions> views;
    std::vector<std::vector<double>> confidence;
    double push_ms = 0; // all frames
};

Labelled run(const Scene &scene)
{
    const Vehicle vehicle(drive_config(scene));
    Labelled out;
    const auto begin = Clock::now();
    for (const Frame &frame : scene.frames) {
        oc_push_report_t report;
        if (oc_vehicle_push(vehicle.get(), &frame.frame, &report) != OC_OK)
            throw std::runtime_error("a frame was refused");
    }
    out.push_ms = std::chrono::duration<double, std::milli>(Clock::now() - begin).count();
    for (const Frame &frame : scene.frames) {
        const oc_junction_t *junctions = nullptr;
        std::uint32_t n = 0;
        if (oc_vehicle_junctions(vehicle.get(), frame.frame.view_id, &junctions, &n) != OC_OK)
            throw std::runtime_error("a view has left the ring");
        eval::ViewJunctions view;
        view.view = frame.frame.view_id;
        out.confidence.emplace_back();
        for (std::uint32_t i = 0; i < n; i++) {
            const oc_junction_t &j = junctions[i];
            view.junctions.push_back(
                {{static_cast<double>(j.x_px), static_cast<double>(j.y_px)}, label_of(j), std::nullopt});
            out.confidence.back().push_back(j.confidence / 255.0);
        }
        out.views.push_back(std::move(view));
    }
    return out;
}

// Of the labels given: how many, how many right, and what their confidence promised.
struct Calibration {
    int n = 0, right = 0;
    double promised = 0;

    void add(bool is_right, double confidence)
    {
        n++;
        right += is_right;
        promised += confidence;
    }
    Json json() const
    {
        if (n == 0) return nullptr;
        return {{"n", n}, {"right", static_cast<double>(right) / n}, {"promised", promised / n}};
    }
};

double height_m(const eval::Truth &truth, std::size_t view, const Eigen::Vector2d &pixel)
{
    const eval::DepthMap &map = *truth.depth[view];
    double highest = 0;
    for (int dy = -2; dy <= 2; dy++)
        for (int dx = -2; dx <= 2; dx++) {
            const int x = static_cast<int>(std::lround(pixel.x())) + dx,
                      y = static_cast<int>(std::lround(pixel.y())) + dy;
            if (x < 0 || y < 0 || x >= map.mask.cols || y >= map.mask.rows) continue;
            if (!eval::is_obstacle_code(map.mask.at<std::uint8_t>(y, x))) continue;
            const double depth = static_cast<double>(map.depth_m.at<float>(y, x));
            const Eigen::Vector3d p = truth.views[view].centre_m() + depth * truth.views[view].ray({x, y});
            highest = std::max(highest, p.z());
        }
    return highest;
}

void list_junctions(const eval::Truth &truth, const Labelled &labelled, bool is_all)
{
    static const char *const names[] = {"unknown", "ground", "obstacle"};
    for (std::size_t v = 0; v < labelled.views.size(); v++) {
        const eval::ViewJunctions &view = labelled.views[v];
        if (!truth.depth[view.view]) continue;
        for (std::size_t i = 0; i < view.junctions.size(); i++) {
            const eval::FoundJunction &j = view.junctions[i];
            const bool is_ground = eval::is_true_ground(*truth.depth[view.view], j.px);
            const bool is_seen_twice = is_ground && eval::is_covisible(truth, labelled.views, v, j);
            if (!is_all && is_ground == (j.label == eval::Label::kGround)) continue;
            std::printf("    view %2zu (%9.4f, %9.4f) %-8s is %s, confidence %.2f, obstacle to %.3f m\n", view.view,
                        j.px.x(), j.px.y(), names[static_cast<int>(j.label)],
                        is_seen_twice ? "ground_seen_twice"
                        : is_ground   ? "ground"
                                      : "not_ground",
                        labelled.confidence[v][i], height_m(truth, view.view, j.px));
        }
    }
}

Json judge(const eval::Truth &truth, const Labelled &labelled)
{
    eval::Notes notes;
    const eval::ShareMetric m = eval::judge_ground(truth, labelled.views, notes);
    Calibration ground, obstacle;
    int n_true_ground = 0, called_obstacle = 0, n_obstacle = 0, obstacle_open = 0;
    for (std::size_t v = 0; v < labelled.views.size(); v++) {
        const auto &depth = truth.depth[labelled.views[v].view];
        if (!depth) continue;
        for (std::size_t i = 0; i < labelled.views[v].junctions.size(); i++) {
            const eval::FoundJunction &j = labelled.views[v].junctions[i];
            const bool is_ground = eval::is_true_ground(*depth, j.px),
                       is_obstacle = eval::is_true_obstacle(*depth, j.px);
            const double confidence = labelled.confidence[v][i];
            n_true_ground += is_ground;
            n_obstacle += is_obstacle;
            called_obstacle += is_ground && j.label == eval::Label::kObstacle;
            obstacle_open += is_obstacle && j.label == eval::Label::kUnknown;
            if (j.label == eval::Label::kGround) ground.add(is_ground, confidence);
            if (j.label == eval::Label::kObstacle) obstacle.add(!is_ground, confidence);
        }
    }
    const auto maybe = [](const std::optional<double> &x) { return x ? Json(*x) : Json(nullptr); };
    return {{"n", m.n},
            {"correct", m.correct},
            {"precision", maybe(m.precision)},
            {"recall", maybe(m.recall)},
            {"obstacle_as_ground", maybe(m.obstacle_as_ground)},
            {"ground_as_obstacle",
             n_true_ground ? Json(static_cast<double>(called_obstacle) / n_true_ground) : Json(nullptr)},
            {"obstacle_open", n_obstacle ? Json(static_cast<double>(obstacle_open) / n_obstacle) : Json(nullptr)},
            {"confidence_ground", ground.json()},
            {"confidence_obstacle", obstacle.json()}};
}

std::string percent(const Json &share)
{
    if (share.is_null()) return "     -";
    char text[32];
    std::snprintf(text, sizeof text, "%6.2f", 100 * share.get<double>());
    return text;
}

std::string calibration_text(const Json &c)
{
    return c.is_null() ? "-" : percent(c["promised"]) + " ->" + percent(c["right"]);
}

} // namespace

Json measure_labels(const LabelOptions &options)
{
    eval::Notes notes;
    const eval::Truth truth = eval::read_truth(options.site, notes);
    if (!truth.has_depth()) throw std::runtime_error(options.site + ": has no true depth");
    std::printf("%-14s %6s %9s %9s %9s %9s %9s   %-18s %-18s %7s\n", "poses", "n", "precision", "recall", "obst->gr",
                "gr->obst", "obst open", "ground conf->right", "obst conf->right", "ms/view");
    Json rows = Json::array();
    for (const std::string &mode : options.modes) {
        ReportedSiteOptions reported;
        reported.site = options.site;
        reported.images = options.images;
        if (mode != "exact") reported.perturbation = parse_perturbation(mode);
        const Scene scene = load_scene(reported);
        const Labelled labelled = run(scene);
        Json row = {{"poses", mode}};
        row.update(judge(truth, labelled));
        row["ms_per_view"] = labelled.push_ms / static_cast<double>(scene.frames.size());
        std::printf("%-14s %6d %9s %9s %9s %9s %9s   %-18s %-18s %7.1f\n", mode.c_str(), row["n"].get<int>(),
                    percent(row["precision"]).c_str(), percent(row["recall"]).c_str(),
                    percent(row["obstacle_as_ground"]).c_str(), percent(row["ground_as_obstacle"]).c_str(),
                    percent(row["obstacle_open"]).c_str(), calibration_text(row["confidence_ground"]).c_str(),
                    calibration_text(row["confidence_obstacle"]).c_str(), row["ms_per_view"].get<double>());
        if (options.lists_errors || options.lists_all) list_junctions(truth, labelled, options.lists_all);
        rows.push_back(std::move(row));
    }
    return rows;
}

} // namespace outcrop::bench
