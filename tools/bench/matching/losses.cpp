// SPDX-License-Identifier: BSD-3-Clause
// Where true matches are lost on the way.
#include "losses.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <set>

namespace outcrop::bench {
namespace {

constexpr double kDetectedPx = 3;
constexpr double kNearPx = 10;
constexpr double kMarginShare = 0.1; // of the site's, left after refinement

// Where what the left view shows at a pixel is seen by the right one; nothing when it is not.
struct Transfer {
    bool has_depth = false;
    std::optional<Eigen::Vector2d> right_px; // projection, hidden or not
    bool is_visible = false;
};

Transfer transfer(const SiteCase &site, int left_view, int right_view, const Eigen::Vector2d &px)
{
    const auto l = static_cast<std::size_t>(left_view), r = static_cast<std::size_t>(right_view);
    const eval::Camera &left = site.truth.views.at(l), &right = site.truth.views.at(r);
    Transfer out;
    const int x = static_cast<int>(std::lround(px.x())), y = static_cast<int>(std::lround(px.y()));
    if (x < 0 || y < 0 || x >= left.width || y >= left.height) return out;
    const double depth = static_cast<double>(site.truth.depth[l]->depth_m.at<float>(y, x));
    if (!(depth > 0)) return out;
    out.has_depth = true;
    const auto at = right.project(left.centre_m() + depth * left.ray(px));
    if (!at || !right.inside(at->pixel)) return out;
    out.right_px = at->pixel;
    out.is_visible = eval::is_visible(*site.truth.depth[r], *at);
    return out;
}

Eigen::Vector2d pixel_of(const oc_junction_t &j)
{
    return {static_cast<double>(j.x_px), static_cast<double>(j.y_px)};
}

PosedView refined(const SiteCase &site, const View &view)
{
    PosedView out = as_reported(view);
    out.camera = true_camera(site, view.id);
    for (double &half_width : out.margin.v) half_width *= kMarginShare;
    return out;
}

// The true partner of each left junction on an obstacle, -1: none detected, -2: not visible.
std::vector<int> true_partners(const SiteCase &site, const View &left, const View &right)
{
    std::vector<int> out;
    for (const oc_junction_t &j : left.junctions) {
        out.push_back(-2);
        const PixelMatch at = {left.id, right.id, pixel_of(j), {}, MatchKind::kObstacle, 0};
        if (j.label == OC_LABEL_GROUND || !is_on_obstacle(site, at)) continue;
        bool is_visible = false;
        double nearest = kDetectedPx;
        for (int dy = -1; dy <= 1; dy++) {
            for (int dx = -1; dx <= 1; dx++) { // as is_correct: a corner's own pixel may see past it
                const Transfer t = transfer(site, left.id, right.id, at.left_px + Eigen::Vector2d(dx, dy));
                if (!t.is_visible) continue;
                if (!is_visible) out.back() = -1;
                is_visible = true;
                for (std::size_t k = 0; k < right.junctions.size(); k++) {
                    const double off = (pixel_of(right.junctions[k]) - *t.right_px).norm();
                    if (off >= nearest) continue;
                    nearest = off;
                    out.back() = static_cast<int>(k);
                }
            }
        }
    }
    return out;
}

Funnel funnel_of(const SiteCase &site, const PreparedView &left, const PreparedView &right, const MatchOptions &options)
{
    const View &l = *left.posed().view, &r = *right.posed().view;
    const std::vector<int> partner = true_partners(site, l, r);
    Funnel out;
    for (const int p : partner) {
        out.visible += p != -2;
        out.detected += p >= 0;
    }
    oc_pair_t pair;
    if (!prepare_pair(left.posed(), right.posed(), options.strip, &pair)) return out;
    const Correlator correlator(left, right, pair, options.correlate);
    std::set<int> candidate, correlated, alike;
    for (const Candidate &c : find_candidates(pair, left.posed(), right.posed(), site.area, options.strip)) {
        const int p = partner[static_cast<std::size_t>(c.left)];
        if (p < 0) continue;
        const Eigen::Vector2d found = pixel_of(right.junction(c.right));
        if ((found - pixel_of(right.junction(p))).norm() >= kDetectedPx) continue;
        candidate.insert(c.left);
        const auto correlation = correlator.correlate(c.left, c.right, c.point);
        if (!correlation) continue;
        correlated.insert(c.left);
        if (correlation->score >= options.min_score) alike.insert(c.left);
    }
    out.candidate = static_cast<int>(candidate.size());
    out.correlated = static_cast<int>(correlated.size());
    out.alike = static_cast<int>(alike.size());
    for (const Match &m : match_pair(left, right, site.area, options).pair.matches) {
        const PixelMatch pixels = {
            l.id,   r.id,   pixel_of(left.junction(m.left_junction)), pixel_of(right.junction(m.right_junction)),
            m.kind, m.score};
        out.best += alike.count(m.left_junction) && is_right(site, pixels);
    }
    return out;
}

} // namespace

void Funnel::add(const Funnel &other)
{
    visible += other.visible;
    detected += other.detected;
    candidate += other.candidate;
    correlated += other.correlated;
    alike += other.alike;
    best += other.best;
}

Funnel measure_funnel(const SiteCase &site, const PairOptions &pairs, const MatchOptions &options)
{
    std::vector<PosedView> posed;
    std::vector<std::unique_ptr<PreparedView>> prepared;
    for (const View &view : site.views) posed.push_back(refined(site, view));
    for (const PosedView &view : posed) prepared.push_back(std::make_unique<PreparedView>(view, options.correlate));
    Funnel out;
    for (const ViewPair &pair : select_pairs(posed, site.area, pairs))
        out.add(funnel_of(site, *prepared[static_cast<std::size_t>(pair.left)],
                          *prepared[static_cast<std::size_t>(pair.right)], options));
    return out;
}

WrongMatches sort_wrong(const SiteCase &site, const std::vector<PixelMatch> &matches)
{
    WrongMatches out;
    for (const PixelMatch &match : matches) {
        if (match.kind == MatchKind::kGround || is_right(site, match)) continue;
        const Transfer t = transfer(site, match.left_view, match.right_view, match.left_px);
        if (!t.has_depth) {
            out.no_depth++;
        } else if (!t.is_visible) {
            out.hidden++;
        } else if ((*t.right_px - match.right_px).norm() < kNearPx) {
            out.near_px++;
        } else {
            out.far_px++;
        }
    }
    return out;
}

nlohmann::ordered_json to_json(const Funnel &f)
{
    return {{"visible", f.visible},       {"detected", f.detected}, {"candidate", f.candidate},
            {"correlated", f.correlated}, {"alike", f.alike},       {"best", f.best}};
}

nlohmann::ordered_json to_json(const WrongMatches &wrong)
{
    return {
        {"near_px", wrong.near_px}, {"far_px", wrong.far_px}, {"hidden", wrong.hidden}, {"no_depth", wrong.no_depth}};
}

} // namespace outcrop::bench
