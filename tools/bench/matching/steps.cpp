// SPDX-License-Identifier: BSD-3-Clause
// The thesis' own form of each step in the place of ours.
#include "steps.h"

#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>

#include "eval/metrics_box.h"
#include "judge.h"
#include "poses.h"
#include "site/fundamental.h"

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

constexpr double kNoGatePx = 1e3; // the thesis drops no point for not fitting its views

void strip_of_thesis(MatchOptions *match)
{
    match->strip.method = StripMethod::kThesis;
    match->strip.with_rivals = false;
}

void planes_of_thesis(MatchOptions *match)
{
    const CorrelateOptions thesis = thesis_match_options().correlate;
    match->correlate = thesis;
}

void choice_of_thesis(MatchOptions *match)
{
    match->min_score = thesis_match_options().min_score;
    match->min_margin = 0;
    match->narrows_strip = false;
}

void clusters_of_thesis(double t_m_m, ClusterOptions *cluster)
{
    cluster->z_weight = 1;
    cluster->group_reach = 1;
    cluster->t_m_m = t_m_m;
}

void boxes_of_thesis(BoxOptions *boxes)
{
    boxes->isolation = 0;
    boxes->trim_share = 0;
    boxes->widen_sigmas = 0;
    boxes->widen_gaps = 0;
    boxes->down_to_ground = false;
}

std::vector<PairMatches> match_and_hold(const MatchPass &pass, const BuildOptions &options,
                                        const std::vector<View> &reported)
{
    std::vector<PairMatches> out;
    std::vector<PosedView> posed;
    for (const View &view : reported) posed.push_back(as_reported(view));
    std::vector<std::unique_ptr<PreparedView>> prepared;
    for (const PosedView &view : posed)
        prepared.push_back(std::make_unique<PreparedView>(view, options.match.correlate));
    for (const ViewPair &pair : select_pairs(posed, pass.area, options.pairs)) {
        const PreparedView &left = *prepared[static_cast<std::size_t>(pair.left)];
        const PreparedView &right = *prepared[static_cast<std::size_t>(pair.right)];
        PairMatches found = match_pair(left, right, pass.area, options.match).pair;
        std::vector<PixelPair> pixels;
        for (const Match &m : found.matches) {
            const oc_junction_t &a = left.junction(m.left_junction), &b = right.junction(m.right_junction);
            pixels.push_back({{a.x_px, a.y_px}, {b.x_px, b.y_px}});
        }
        if (const auto fit = fundamental_by_seven_points(pixels)) {
            std::vector<Match> held;
            for (std::size_t i = 0; i < found.matches.size(); i++)
                if (fit->is_inlier[i]) held.push_back(found.matches[i]);
            found.matches = std::move(held);
        }
        out.push_back(std::move(found));
    }
    return out;
}

// Sums over the cases of one step.
struct Row {
    MatchCount matches;
    std::vector<double> iou, centre_m;
    int n_missed = 0, n_false = 0, n_suspected = 0;
    double match_ms = 0, refine_ms = 0, all_ms = 0;
};

eval::Run boxes_run(const SiteModel &model)
{
    eval::Run run;
    run.obstacles.emplace();
    for (const Obstacle &o : model.obstacles) {
        eval::FoundObstacle found;
        found.index = o.index;
        found.aabb = {o.aabb_min, o.aabb_max};
        found.obb = {o.obb_centre, o.obb_size, o.yaw_rad};
        run.obstacles->push_back(found);
    }
    return run;
}

double of(const std::map<std::string, double> &ms, const char *key)
{
    const auto at = ms.find(key);
    return at == ms.end() ? 0 : at->second;
}

void judge(const SiteCase &site, const SiteModel &model, double all_ms, Row *row)
{
    row->matches.add(count_matches(site, pixel_matches(site.views, model.pairs)));
    const auto boxes = eval::evaluate_boxes(site.truth, boxes_run(model));
    if (boxes) {
        for (const eval::BoxMetric &box : boxes->boxes) row->iou.push_back(box.iou);
        row->n_missed += static_cast<int>(boxes->missed.size());
        row->n_false += static_cast<int>(boxes->false_boxes.size());
    }
    row->n_suspected += static_cast<int>(model.suspected.size());
    for (const RefinedView &view : model.views)
        row->centre_m.push_back((camera_centre(view.camera) - camera_centre(true_camera(site, view.id))).norm());
    row->match_ms += of(model.ms, "match");
    row->refine_ms += of(model.ms, "refine");
    row->all_ms += all_ms;
}

} // namespace

std::vector<Step> steps(double t_m_m)
{
    const BuildOptions ours;
    std::vector<Step> out = {{"ours", "", ours, false},
                             {"strip", "one parameter at a time, no limits of height (5.9 to 5.16)", ours, false},
                             {"planes", "branches' planes only, plain window of 21 px (5.17 to 5.35)", ours, false},
                             {"choice", "mutual best over .75: no margin, no narrowing", ours, false},
                             {"third views", "none", ours, false},
                             {"poses", "matches held by F of seven points, t_F 3, poses as reported (5.5)", ours, true},
                             {"clusters", "all of height counts, one t_M (6.4)", ours, false},
                             {"boxes", "the points' own extent (6.3)", ours, false},
                             {"all of them", "", ours, true}};
    const auto both = [&](std::size_t i, const std::function<void(BuildOptions *)> &change) {
        change(&out[i].build);
        change(&out.back().build);
    };
    both(1, [](BuildOptions *b) { strip_of_thesis(&b->match); });
    both(2, [](BuildOptions *b) { planes_of_thesis(&b->match); });
    both(3, [](BuildOptions *b) { choice_of_thesis(&b->match); });
    both(4, [](BuildOptions *b) { b->with_third_views = false; });
    both(5, [](BuildOptions *b) { b->tracks.max_reprojection_px = kNoGatePx; });
    both(6, [&](BuildOptions *b) { clusters_of_thesis(t_m_m, &b->cluster); });
    both(7, [](BuildOptions *b) { boxes_of_thesis(&b->boxes); });
    return out;
}

SiteModel build_step(const SiteCase &site, const Step &step)
{
    if (!step.updates_by_f) return build_site(site.views, site.area, step.build);
    // Poses that nothing may move: the margins go to the strips only.
    std::vector<View> held = site.views;
    for (View &view : held) view.margin = oc_margin_t{};
    const Matcher matcher = [&](const MatchPass &pass) { return match_and_hold(pass, step.build, site.views); };
    return build_from_matches(held, site.area, matcher, step.build);
}

Json measure_steps(const std::vector<SiteCase> &cases, const std::function<double(const std::string &)> &t_m_m)
{
    Json rows = Json::array();
    const std::size_t n_steps = steps(0).size();
    for (std::size_t i = 0; i < n_steps; i++) {
        Row row;
        Step step;
        for (const SiteCase &site : cases) {
            step = steps(t_m_m(site.name))[i];
            const auto begin = Clock::now();
            const SiteModel model = build_step(site, step);
            judge(site, model, std::chrono::duration<double, std::milli>(Clock::now() - begin).count(), &row);
        }
        double iou = 0, square = 0;
        for (const double value : row.iou) iou += value / static_cast<double>(row.iou.size());
        for (const double value : row.centre_m) square += value * value / static_cast<double>(row.centre_m.size());
        Json json = {{"step", step.name},
                     {"about", step.about},
                     {"matches", to_json(row.matches)},
                     {"position_rmse_m", std::sqrt(square)},
                     {"mean_iou", iou},
                     {"least_iou", quantile(row.iou, 0)},
                     {"obstacles", row.iou.size()},
                     {"missed", row.n_missed},
                     {"false", row.n_false},
                     {"suspected", row.n_suspected},
                     {"match_ms", row.match_ms},
                     {"refine_ms", row.refine_ms},
                     {"all_ms", row.all_ms}};
        std::printf("  %-12s %5d of %5d matches, centres %5.2f mm, mean IoU %.3f, missed %d, false %d, %.0f ms\n",
                    step.name.c_str(), row.matches.correct, row.matches.n, std::sqrt(square) * 1e3, iou, row.n_missed,
                    row.n_false, row.all_ms);
        std::fflush(stdout);
        rows.push_back(json);
    }
    return rows;
}

} // namespace outcrop::bench
