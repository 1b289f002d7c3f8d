// SPDX-License-Identifier: BSD-3-Clause
// One pair of views matched in every way that the thesis knows, and in ours.
#include "one_pair.h"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "site/fundamental.h"
#include "site/invariants.h"

namespace outcrop::bench {
namespace {

constexpr double kSadFullScale = 64; // grey levels a pixel that score 0, as in correlate

double score_of_sad(double levels_per_px)
{
    return 1 - levels_per_px / kSadFullScale;
}

struct Scored {
    Candidate candidate;
    double score = 0;
};

// Best for each other (what the thesis' stable marriage comes to) and at least min_score.
std::vector<Scored> mutual_best(const std::vector<Scored> &scored, std::size_t n_left, std::size_t n_right,
                                double min_score)
{
    std::vector<int> left(n_left, -1), right(n_right, -1);
    const auto challenge = [&](int *best, int i) {
        if (*best < 0 || scored[static_cast<std::size_t>(i)].score > scored[static_cast<std::size_t>(*best)].score)
            *best = i;
    };
    for (int i = 0; i < static_cast<int>(scored.size()); i++) {
        challenge(&left[static_cast<std::size_t>(scored[static_cast<std::size_t>(i)].candidate.left)], i);
        challenge(&right[static_cast<std::size_t>(scored[static_cast<std::size_t>(i)].candidate.right)], i);
    }
    std::vector<Scored> out;
    for (const int i : left) {
        if (i < 0) continue;
        const Scored &s = scored[static_cast<std::size_t>(i)];
        if (s.score >= min_score && right[static_cast<std::size_t>(s.candidate.right)] == i) out.push_back(s);
    }
    return out;
}

// The view with one channel of its picture in place of grey.
View channel_view(const SiteCase &site, int index, int channel)
{
    View out = site.views[static_cast<std::size_t>(index)];
    cv::extractChannel(site.pictures.at(static_cast<std::size_t>(index)), out.grey, channel);
    return out;
}

class ChannelCorrelator {
public:
    ChannelCorrelator(const SiteCase &site, const PairOfViews &pair, int channel, const oc_pair_t &geometry,
                      const CorrelateOptions &options)
        : left_view_(channel_view(site, pair.left, channel)), right_view_(channel_view(site, pair.right, channel)),
          left_(as_reported(left_view_), options), right_(as_reported(right_view_), options),
          correlator_(left_, right_, geometry, options)
    {}

    double score(const Candidate &c, const oc_plane_t &plane) const
    {
        return correlator_.score_on_plane(c.left, c.right, plane).value_or(-1);
    }

private:
    View left_view_, right_view_;
    PreparedView left_, right_;
    Correlator correlator_;
};

std::vector<Scored> match_colour(const SiteCase &site, const PairOfViews &pair, const PairMethod &method,
                                 const PreparedView &left, const PreparedView &right)
{
    oc_pair_t geometry;
    if (!prepare_pair(left.posed(), right.posed(), method.match.strip, &geometry)) return {};
    const Correlator grey(left, right, geometry, method.match.correlate);
    std::vector<std::unique_ptr<ChannelCorrelator>> channels;
    for (int c = 0; c < 3; c++)
        channels.push_back(std::make_unique<ChannelCorrelator>(site, pair, c, geometry, method.match.correlate));
    std::vector<Scored> scored;
    for (const Candidate &c : find_candidates(geometry, left.posed(), right.posed(), site.area, method.match.strip)) {
        const auto chosen = grey.correlate(c.left, c.right, c.point);
        if (!chosen) continue;
        double sum = 0;
        for (const auto &channel : channels) sum += channel->score(c, chosen->plane);
        scored.push_back({c, sum / 3});
    }
    return mutual_best(scored, left.posed().view->junctions.size(), right.posed().view->junctions.size(),
                       method.match.min_score);
}

std::vector<Scored> match_invariants(const SiteCase &site, const PairOfViews &pair, const PairMethod &method)
{
    const View &l = site.views[static_cast<std::size_t>(pair.left)];
    const View &r = site.views[static_cast<std::size_t>(pair.right)];
    oc_pair_t geometry;
    if (!prepare_pair(as_reported(l), as_reported(r), method.match.strip, &geometry)) return {};
    const auto candidates = find_candidates(geometry, as_reported(l), as_reported(r), site.area, method.match.strip);
    const auto left = colour_invariants(site.pictures.at(static_cast<std::size_t>(pair.left)), l.junctions);
    const auto right = colour_invariants(site.pictures.at(static_cast<std::size_t>(pair.right)), r.junctions);
    std::vector<Scored> out;
    for (const InvariantMatch &m : match_by_invariants(left, right, candidates)) {
        Candidate c;
        c.left = m.left;
        c.right = m.right;
        out.push_back({c, m.votes / 8.0});
    }
    return out;
}

std::vector<PixelMatch> find(const SiteCase &site, const PairOfViews &pair, const PairMethod &method)
{
    const View &l = site.views.at(static_cast<std::size_t>(pair.left));
    const View &r = site.views.at(static_cast<std::size_t>(pair.right));
    std::vector<Scored> found;
    if (method.is_invariants) {
        found = match_invariants(site, pair, method);
    } else {
        const PreparedView left(as_reported(l), method.match.correlate), right(as_reported(r), method.match.correlate);
        if (method.is_colour) {
            found = match_colour(site, pair, method, left, right);
        } else {
            for (const Match &m : match_pair(left, right, site.area, method.match).pair.matches) {
                Candidate c;
                c.left = m.left_junction;
                c.right = m.right_junction;
                found.push_back({c, m.score});
            }
        }
    }
    std::vector<PixelMatch> out;
    for (const Scored &s : found) {
        const oc_junction_t &a = l.junctions[static_cast<std::size_t>(s.candidate.left)];
        const oc_junction_t &b = r.junctions[static_cast<std::size_t>(s.candidate.right)];
        out.push_back({l.id, r.id, {a.x_px, a.y_px}, {b.x_px, b.y_px}, MatchKind::kObstacle, s.score});
    }
    return out;
}

// Section 5.5: only what the largest support set of seven points holds. Too few matches to vote: all stay.
std::vector<PixelMatch> held_by_f(const std::vector<PixelMatch> &matches, double t_f_px)
{
    std::vector<PixelPair> pixels;
    for (const PixelMatch &m : matches) pixels.push_back({m.left_px, m.right_px});
    FundamentalOptions options;
    options.t_f_px = t_f_px;
    const auto fit = fundamental_by_seven_points(pixels, options);
    if (!fit) return matches;
    std::vector<PixelMatch> kept;
    for (std::size_t i = 0; i < matches.size(); i++)
        if (fit->is_inlier[i]) kept.push_back(matches[i]);
    return kept;
}

PairMethod method_of(const char *name, Warp warp, Measure measure, double min_score, const ThesisThresholds &t)
{
    PairMethod out;
    out.name = name;
    out.match = thesis_match_options();
    out.match.correlate.window_px = t.window_px;
    out.match.correlate.warp = warp;
    out.match.correlate.measure = measure;
    out.match.min_score = min_score;
    return out;
}

} // namespace

std::vector<PairMethod> thesis_methods(const ThesisThresholds &t)
{
    const double sad = score_of_sad(t.t_sad), plain = score_of_sad(t.t_plain_sad);
    std::vector<PairMethod> out = {
        method_of("plain SAD", Warp::kNone, Measure::kSad, plain, t),
        method_of("plain SAD, threshold of the homographic one", Warp::kNone, Measure::kSad, sad, t),
        method_of("plain NCC", Warp::kNone, Measure::kVnc, t.t_vnc, t),
        method_of("homographic SAD, as printed (not anchored)", Warp::kUnanchored, Measure::kSad, sad, t),
        method_of("homographic VNC, as printed (not anchored)", Warp::kUnanchored, Measure::kVnc, t.t_vnc, t),
        method_of("homographic SAD, anchored", Warp::kHomography, Measure::kSad, sad, t),
        method_of("homographic VNC, anchored", Warp::kHomography, Measure::kVnc, t.t_vnc, t),
        method_of("homographic VNC, anchored, colour", Warp::kHomography, Measure::kVnc, t.t_vnc, t),
        method_of("homographic VNC, anchored, wedge", Warp::kHomography, Measure::kVnc, t.t_vnc, t),
        method_of("homographic SAD, anchored, then F (t_F 3)", Warp::kHomography, Measure::kSad, sad, t),
        method_of("homographic VNC, anchored, then F (t_F 3)", Warp::kHomography, Measure::kVnc, t.t_vnc, t),
        method_of("8 invariants, 3 votes (5.36)", Warp::kNone, Measure::kVnc, 0, t)};
    out[7].is_colour = true;
    out[8].match.correlate.support = Support::kWedge;
    out[9].t_f_px = out[10].t_f_px = 3;
    out[11].is_invariants = true;
    PairMethod ours;
    ours.name = "ours (defaults: 21 px, covariance strip, narrowing, margin)";
    out.push_back(ours);
    ours.name = "ours, wedge";
    ours.match.correlate.support = Support::kWedge;
    out.push_back(ours);
    return out;
}

MatchCount match_and_count(const SiteCase &site, const PairOfViews &pair, const PairMethod &method)
{
    if ((method.is_colour || method.is_invariants) && site.pictures.size() != site.views.size())
        throw std::runtime_error(site.name + ": has no colour for " + method.name);
    std::vector<PixelMatch> matches = find(site, pair, method);
    if (method.t_f_px > 0) matches = held_by_f(matches, method.t_f_px);
    return count_matches(site, matches);
}

} // namespace outcrop::bench
