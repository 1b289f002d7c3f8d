// SPDX-License-Identifier: BSD-3-Clause
// Table 4.1 of the thesis.
#include "table.h"

#include <cstdio>
#include <functional>
#include <memory>
#include <stdexcept>
#include <vector>

#include "eval/metrics_match.h"
#include "pairs.h"
#include "thesis_pair.h"

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;

constexpr unsigned kWindows[] = {11, 13, 15, 17, 19, 21, 23, 25};
constexpr double kThresholds[] = {0.50, 0.55, 0.60, 0.65, 0.70};

// Total and correct as printed, window by window.
constexpr int kPrinted[8][5][2] = {
    {{65, 49}, {58, 47}, {51, 43}, {47, 40}, {34, 29}}, {{58, 47}, {55, 46}, {51, 44}, {45, 40}, {39, 35}},
    {{57, 47}, {53, 46}, {48, 44}, {46, 43}, {37, 34}}, {{57, 50}, {48, 46}, {46, 43}, {44, 41}, {35, 32}},
    {{53, 50}, {51, 49}, {44, 42}, {43, 42}, {34, 33}}, {{54, 51}, {52, 50}, {47, 45}, {40, 38}, {30, 30}},
    {{56, 53}, {52, 50}, {50, 49}, {39, 39}, {34, 34}}, {{56, 53}, {52, 46}, {46, 43}, {39, 38}, {32, 32}}};

struct Cell {
    int total = 0, correct = 0;
};

class Pair {
public:
    Pair(const TableOptions &options)
        : options_(options), truth_(eval::read_truth(options.site, notes_)), ws_(std::make_unique<oc_ground_ws_t>())
    {
        ReportedSiteOptions reported;
        reported.site = options.site;
        if (options.poses != "exact") reported.perturbation = parse_perturbation(options.poses);
        scene_ = load_scene(reported);
        views_ = ground_views(scene_, options.n_junctions);
        if (options.left >= views_.size() || options.right >= views_.size() || options.left == options.right)
            throw std::runtime_error(options.site + ": has no such pair of views");
    }

    const oc_ground_view_t &left() const { return views_[options_.left].view; }
    const oc_ground_view_t &right() const { return views_[options_.right].view; }

    Cell thesis(unsigned window_px, double t_g) const
    {
        return judge(thesis_ground_matches(left(), right(), window_px, static_cast<float>(t_g), options_.t_h_m));
    }

    Cell ours(unsigned window_px, double t_g) const
    {
        oc_ground_params_t params = oc_ground_defaults();
        params.window_px = window_px;
        params.t_g = static_cast<float>(t_g);
        params.t_h_m = options_.t_h_m;
        std::vector<oc_ground_votes_t> votes(OC_MAX_JUNCTIONS), other_votes(OC_MAX_JUNCTIONS);
        oc_ground_result_t result;
        const oc_status_t status =
            oc_ground_match_views(ws_.get(), &params, &left(), &right(), votes.data(), other_votes.data(), &result);
        if (status != OC_OK) throw std::runtime_error(oc_status_text(status));
        return judge({ws_->matches, ws_->matches + ws_->n_matches});
    }

private:
    Cell judge(const std::vector<oc_ground_match_t> &matches) const
    {
        Cell out;
        for (const oc_ground_match_t &m : matches) {
            const oc_junction_t &a = left().junctions[m.left], &b = right().junctions[m.right];
            const eval::FoundMatch found = {left().view,
                                            right().view,
                                            {static_cast<double>(a.x_px), static_cast<double>(a.y_px)},
                                            {static_cast<double>(b.x_px), static_cast<double>(b.y_px)},
                                            eval::Label::kGround};
            const auto correct = eval::is_correct(found, truth_);
            if (!correct) throw std::runtime_error(options_.site + ": has no true depth for the pair");
            out.total++;
            out.correct += *correct && eval::is_true_ground(*truth_.depth[left().view], found.left_px);
        }
        return out;
    }

    TableOptions options_;
    eval::Notes notes_;
    eval::Truth truth_;
    Scene scene_;
    std::vector<GroundView> views_;
    std::unique_ptr<oc_ground_ws_t> ws_;
};

Json grid(const char *title, const std::function<Cell(std::size_t, std::size_t)> &cell_of)
{
    Json rows = Json::array();
    std::printf("%s\n%-8s", title, "window");
    for (const double t_g : kThresholds) std::printf("  t_g %.2f            ", t_g);
    std::printf("\n");
    for (std::size_t w = 0; w < std::size(kWindows); w++) {
        std::printf("%2u x %-3u", kWindows[w], kWindows[w]);
        for (std::size_t t = 0; t < std::size(kThresholds); t++) {
            const Cell cell = cell_of(w, t);
            const double share = cell.total > 0 ? static_cast<double>(cell.correct) / cell.total : 0;
            std::printf("  %4d %4d %5.1f %%   ", cell.total, cell.correct, 100 * share);
            rows.push_back({{"window_px", kWindows[w]},
                            {"t_g", kThresholds[t]},
                            {"total", cell.total},
                            {"correct", cell.correct},
                            {"share_correct", cell.total > 0 ? Json(share) : Json(nullptr)}});
        }
        std::printf("\n");
    }
    std::printf("\n");
    return rows;
}

} // namespace

Json measure_table(const TableOptions &options)
{
    const Pair pair(options);
    std::printf("views %u and %u, %u x %u junctions, poses %s; total, correct, share\n\n", pair.left().view,
                pair.right().view, pair.left().n_junctions, pair.right().n_junctions, options.poses.c_str());
    Json out = {{"left", options.left},
                {"right", options.right},
                {"left_junctions", pair.left().n_junctions},
                {"right_junctions", pair.right().n_junctions},
                {"poses", options.poses},
                {"t_h_m", options.t_h_m}};
    out["printed_in_thesis"] =
        grid("thesis, table 4.1 as printed (its own pictures)", [](std::size_t w, std::size_t t) {
            return Cell{kPrinted[w][t][0], kPrinted[w][t][1]};
        });
    out["thesis_form"] = grid("the thesis' form: one pass, NCC by window and t_g, height within t_h",
                              [&](std::size_t w, std::size_t t) { return pair.thesis(kWindows[w], kThresholds[t]); });
    out["ours"] = grid("ours: final ground matches, both junctions judged ground",
                       [&](std::size_t w, std::size_t t) { return pair.ours(kWindows[w], kThresholds[t]); });
    return out;
}

} // namespace outcrop::bench
