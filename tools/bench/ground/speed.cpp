// SPDX-License-Identifier: BSD-3-Clause
// The clock of the ground filter.
#include "speed.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "pairs.h"

namespace outcrop::bench {
namespace {

using Json = nlohmann::ordered_json;
using Clock = std::chrono::steady_clock;

struct Timed {
    double ms = std::numeric_limits<double>::infinity();
    oc_ground_result_t result{};
};

Timed time_pair(oc_ground_ws_t *ws, const GroundView &left, const GroundView &right, unsigned repeats)
{
    const oc_ground_params_t params = oc_ground_defaults();
    Timed out;
    for (unsigned i = 0; i < repeats; i++) {
        std::vector<oc_ground_votes_t> votes(OC_MAX_JUNCTIONS), other_votes(OC_MAX_JUNCTIONS);
        const auto begin = Clock::now();
        const oc_status_t status =
            oc_ground_match_views(ws, &params, &left.view, &right.view, votes.data(), other_votes.data(), &out.result);
        out.ms = std::min(out.ms, std::chrono::duration<double, std::milli>(Clock::now() - begin).count());
        if (status != OC_OK) throw std::runtime_error(oc_status_text(status));
    }
    return out;
}

} // namespace

Json measure_speed(const SpeedOptions &options)
{
    ReportedSiteOptions reported;
    reported.site = options.site;
    if (options.poses != "exact") reported.perturbation = parse_perturbation(options.poses);
    const Scene scene = load_scene(reported);
    const std::vector<GroundView> views = ground_views(scene, options.n_junctions);
    const auto ws = std::make_unique<oc_ground_ws_t>();
    Json pairs = Json::array();
    std::vector<double> all_ms;
    std::printf("%5s %5s %11s %10s %8s %7s %8s %7s %8s\n", "left", "right", "junctions", "candidates", "matches",
                "pins", "inliers", "rms px", "ms");
    for (std::size_t i = 1; i < views.size(); i++) {
        const oc_ground_view_t &left = views[i].view, &right = views[i - 1].view;
        const Timed t = time_pair(ws.get(), views[i], views[i - 1], options.repeats);
        std::printf("%5u %5u %5u x %3u %10u %8u %7u %8u %7.2f %8.2f%s\n", left.view, right.view, left.n_junctions,
                    right.n_junctions, t.result.n_candidates, t.result.n_matches, ws->n_pins, t.result.n_inliers,
                    t.result.rms_px, t.ms, t.result.is_refined ? "" : "  not refined");
        pairs.push_back({{"left", left.view},
                         {"right", right.view},
                         {"left_junctions", left.n_junctions},
                         {"right_junctions", right.n_junctions},
                         {"candidates", t.result.n_candidates},
                         {"matches", t.result.n_matches},
                         {"inliers", t.result.n_inliers},
                         {"is_refined", t.result.is_refined},
                         {"ms", t.ms}});
        all_ms.push_back(t.ms);
    }
    std::sort(all_ms.begin(), all_ms.end());
    std::printf("median %.2f ms, most %.2f ms a pair\n", all_ms[all_ms.size() / 2], all_ms.back());
    return {{"poses", options.poses},
            {"max_junctions", options.n_junctions},
            {"median_ms", all_ms[all_ms.size() / 2]},
            {"most_ms", all_ms.back()},
            {"pairs", pairs}};
}

} // namespace outcrop::bench
