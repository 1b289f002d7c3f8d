// SPDX-License-Identifier: BSD-3-Clause
// Order of writing: model first, report last, so a reader that sees the report sees a finished run.
#include "output.h"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

#include "site/export.h"
#include "site/ground_map.h"
#include "site/path.h"
#include "site/sequence.h"
#include "site/shapes.h"

namespace outcrop {
namespace {

using json = nlohmann::json;

class Stopwatch {
public:
    double ms() const
    {
        return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin_).count();
    }

private:
    std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

json bytes_of(const Ledger &ledger, std::uint64_t LedgerLine::*field)
{
    json out = json::object();
    for (const char *layer : {"view", "patch", "silhouette", "texture", "overhead", "request", "status"})
        out[layer] = 0;
    for (const auto &[layer, line] : ledger.lines()) out[layer] = line.*field;
    out["total"] = ledger.total().*field;
    return out;
}

json counts_of(Session &session, const ReceiveCounts &received)
{
    json out = json::object();
    const SiteModel &model = session.model();
    for (const auto &[name, value] : model.counts) out[name] = value;
    std::size_t n_obstacle = 0, n_ground = 0;
    for (const PairMatches &pair : model.pairs) {
        for (const Match &match : pair.matches) (match.kind == MatchKind::kGround ? n_ground : n_obstacle)++;
    }
    out["views"] = session.views().size();
    out["matches_obstacle"] = n_obstacle;
    out["matches_ground"] = n_ground;
    out["points"] = model.points.size();
    out["obstacles"] = model.obstacles.size();
    out["suspected"] = model.suspected.size();
    out["tiles"] = session.tiles().size();
    out["requests_given_up"] = session.given_up();
    out["keyframes_refused"] = session.keyframes_refused();
    out["packets_ill_formed"] = received.ill_formed;
    out["packets_foreign"] = received.foreign;
    out["log_garbage_bytes"] = received.garbage_bytes;
    out["log_is_cut"] = received.is_log_cut;
    if (const auto &status = session.assembler().status()) {
        for (int i = 0; i < OC_N_COUNTERS; i++)
            out["vehicle"][oc_counter_name(static_cast<oc_counter_t>(i))] = status->counters[i];
    }
    return out;
}

void write_report(const std::string &path, const json &report)
{
    const std::string part = path + ".part";
    {
        std::ofstream file(part);
        file << report.dump(1) << '\n';
        if (!file.flush()) throw std::runtime_error(path + ": cannot be written");
    }
    std::filesystem::rename(part, path);
}

// What the points said stays doubtful ground where the volume says otherwise.
std::vector<Obstacle> points_boxes(const SiteModel &finished, const SiteModel &model)
{
    std::vector<Obstacle> boxes;
    for (std::size_t i = 0; i < finished.obstacles.size(); i++)
        if (finished.obstacles[i].voxel_m > 0) boxes.push_back(model.obstacles[i]);
    return boxes;
}

} // namespace

SessionOptions session_options(const OutputOptions &output)
{
    SessionOptions options;
    options.with_shapes = output.represent == "voxels";
    options.shapes.with_textures = output.with_textures;
    if (output.method == "thesis") {
        options.build.match = thesis_match_options();
        options.build.cluster.z_weight = 1;
        options.shapes.is_thesis = true;
    }
    return options;
}

void check_output(const OutputOptions &options)
{
    if (!options.path.empty()) read_path(options.path);
}

void write_output(Session &session, const Ledger &ledger, const ReceiveCounts &received, const OutputOptions &options,
                  const Progress &progress)
{
    json ms = json::object();
    std::filesystem::create_directories(options.dir);
    Stopwatch settle_watch;
    const SiteModel &model = session.settle();
    ms["settle"] = settle_watch.ms();
    for (const auto &[step, value] : model.ms) ms[step] = value;
    progress("model: " + std::to_string(model.obstacles.size()) + " obstacles, " +
             std::to_string(model.suspected.size()) + " suspected, " + std::to_string(model.points.size()) + " points");

    Stopwatch carve_watch;
    SiteModel finished = model;
    CarveOptions carve;
    int n_bad_textures = 0;
    if (options.method == "thesis") carve.method = CarveMethod::kThesis;
    const std::vector<Shape> shapes = carve_shapes(session.carve_views(&n_bad_textures),
                                                   session.options().shapes.grow_share, carve, progress, &finished);
    if (options.represent == "voxels" && shapes.empty() && !finished.obstacles.empty())
        progress("no silhouettes have come, obstacles stay boxes");
    ms["carve"] = carve_watch.ms();

    Stopwatch map_watch;
    const GroundMap ground = map_ground(finished, {}, points_boxes(finished, model));
    int n_bad_tiles = 0;
    const OverheadMap overhead = compose_overhead(model, session.tiles(), {}, &n_bad_tiles);
    ms["overhead"] = map_watch.ms();
    write_model_dir(options.dir, finished, session.views(), ground, overhead);
    write_shapes(options.dir + "/model", finished, shapes, overhead);

    json sequence = nullptr;
    if (options.represent != "none") {
        Stopwatch watch;
        const Path path = options.path.empty() ? loop_path(model) : read_path(options.path);
        const SequenceReport done =
            write_sequence(options.dir + "/sequence", options.represent, finished, shapes, overhead, path, {},
                           [&](int frame, int frames) {
                               if (frame % 10 == 0 || frame == frames)
                                   progress("frame " + std::to_string(frame) + " of " + std::to_string(frames));
                           });
        ms["sequence"] = watch.ms();
        sequence = {{"as", options.represent}, {"frames", path.frames.size()}, {"video", done.has_video}};
        if (!done.note.empty()) progress(done.note);
    }

    json report;
    report["bytes"] = bytes_of(ledger, &LedgerLine::bytes);
    report["bytes_ip"] = bytes_of(ledger, &LedgerLine::bytes_ip);
    report["messages"] = bytes_of(ledger, &LedgerLine::messages);
    report["ms"] = ms;
    report["counts"] = counts_of(session, received);
    for (const auto &[name, value] : finished.counts) // those of the shapes; the session's own go before
        if (!report["counts"].contains(name)) report["counts"][name] = value;
    report["counts"]["tiles_bad"] = n_bad_tiles;
    report["counts"]["textures_bad"] = n_bad_textures;
    report["options"] = {{"method", options.method}, {"path", options.path}, {"null_rival", session.is_null_rival()}};
    if (const auto area = session.area())
        report["options"]["area"] = {area->x_min, area->x_max, area->y_min, area->y_max, area->z_max};
    report["sequence"] = sequence;
    write_report(options.dir + "/report.json", report);
}

} // namespace outcrop
