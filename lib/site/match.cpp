// SPDX-License-Identifier: BSD-3-Clause
// From scored candidates to matches: mutual best, uniqueness, point, ground or obstacle, third views.
#include "site/match.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Geometry>

#include "core/epipolar.h"
#include "core/homography.h"
#include "site/pair_errors.h"

namespace outcrop {
namespace {

constexpr int kNarrowings = 2;

struct Scored {
    Candidate candidate;
    Correlation correlation;
};

// Best candidate of one junction, and the best that is another corner of the other view.
struct Rank {
    int best = -1;
    double runner_up = 0;
};

bool is_same_place(const oc_junction_t &a, const oc_junction_t &b, double within_px)
{
    return std::hypot(a.x_px - b.x_px, a.y_px - b.y_px) < within_px;
}

// Ranks by left (side 0) or right (side 1) junction. Of equal scores the first in order wins.
std::vector<Rank> rank_by(int side, const std::vector<Scored> &scored, const PreparedView &left,
                          const PreparedView &right, double same_place_px)
{
    const auto own = [&](const Scored &s) { return side == 0 ? s.candidate.left : s.candidate.right; };
    const auto other = [&](const Scored &s) -> const oc_junction_t & {
        return side == 0 ? right.junction(s.candidate.right) : left.junction(s.candidate.left);
    };
    std::vector<Rank> ranks((side == 0 ? left : right).posed().view->junctions.size());
    for (std::size_t i = 0; i < scored.size(); i++) {
        int &best = ranks[own(scored[i])].best;
        if (best < 0 || scored[i].correlation.score > scored[best].correlation.score) best = static_cast<int>(i);
    }
    for (const Scored &s : scored) {
        Rank &rank = ranks[own(s)];
        if (is_same_place(other(s), other(scored[rank.best]), same_place_px)) continue;
        rank.runner_up = std::max(rank.runner_up, s.correlation.score);
    }
    return ranks;
}

// Adds J diag(a^2 / 3) J^T of one camera's margins by central differences.
void add_pose_covariance(const PosedView &left, const oc_junction_t &l, const PosedView &right, const oc_junction_t &r,
                         bool moves_left, Eigen::Matrix3d *covariance)
{
    const PosedView &moved = moves_left ? left : right;
    oc_pose6_t six;
    oc_pose_to_6(&moved.camera.pose, &six);
    for (int p = 0; p < 6; p++) {
        const double step = moved.margin.v[p];
        if (!(step > 0)) continue;
        Eigen::Vector3d at[2];
        bool ok = true;
        for (int k = 0; k < 2; k++) {
            oc_pose6_t there = six;
            there.v[p] += k == 0 ? step : -step;
            oc_camera_t camera = moved.camera;
            oc_pose_from_6(&there, &camera.pose);
            oc_midpoint_t midpoint;
            ok = ok && oc_epipolar_midpoint(moves_left ? &camera : &left.camera, l.x_px, l.y_px,
                                            moves_left ? &right.camera : &camera, r.x_px, r.y_px, &midpoint) == OC_OK;
            if (ok) at[k] = Eigen::Vector3d(midpoint.p_in_world);
        }
        if (!ok) continue;
        const Eigen::Vector3d slope = (at[0] - at[1]) / 2;
        *covariance += slope * slope.transpose() / 3;
    }
}

struct Covariances {
    Eigen::Matrix3d of_pixels, of_all;
};

bool point_covariances(const PosedView &left, const oc_junction_t &l, const PosedView &right, const oc_junction_t &r,
                       double sigma_px, Covariances *out)
{
    double cov[9];
    if (oc_epipolar_midpoint_covariance(&left.camera, l.x_px, l.y_px, &right.camera, r.x_px, r.y_px, sigma_px, cov) !=
        OC_OK) {
        return false;
    }
    out->of_pixels = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(cov);
    out->of_all = out->of_pixels;
    add_pose_covariance(left, l, right, r, true, &out->of_all);
    add_pose_covariance(left, l, right, r, false, &out->of_all);
    return true;
}

// Is the corner one that is drawn on the ground?
MatchKind kind_of(const Scored &scored, const Correlator &correlator, double sigma_z, const MatchOptions &options)
{
    const Candidate &c = scored.candidate;
    if (!(std::abs(c.point.z()) <= std::max(options.ground_height_m, OC_STRIP_MAX_SIGMA * sigma_z))) {
        return MatchKind::kObstacle;
    }
    const oc_plane_t level{{0, 0, 1}, -c.point.z()};
    const std::optional<double> score = correlator.score_on_plane(c.left, c.right, level);
    const bool explains = score && *score >= scored.correlation.score - options.ground_score_slack;
    return explains ? MatchKind::kGround : MatchKind::kObstacle;
}

std::vector<Scored> score_candidates(const std::vector<Candidate> &candidates, const Correlator &correlator)
{
    std::vector<Scored> scored;
    for (const Candidate &candidate : candidates) {
        const std::optional<Correlation> correlation =
            correlator.correlate(candidate.left, candidate.right, candidate.point);
        if (correlation) scored.push_back(Scored{candidate, *correlation});
    }
    return scored;
}

// A mutual best pair that is alike and unique enough.
struct Chosen {
    int index = 0; // in the scored candidates
    double margin = 0;
};

std::vector<Chosen> choose(const std::vector<Scored> &scored, const PreparedView &left, const PreparedView &right,
                           const MatchOptions &options)
{
    const std::vector<Rank> of_left = rank_by(0, scored, left, right, options.same_place_px);
    const std::vector<Rank> of_right = rank_by(1, scored, left, right, options.same_place_px);
    std::vector<Chosen> chosen;
    for (int i = 0; i < static_cast<int>(scored.size()); i++) {
        const Rank &l = of_left[scored[i].candidate.left];
        const Rank &r = of_right[scored[i].candidate.right];
        const double score = scored[i].correlation.score;
        const double margin = score - std::max(l.runner_up, r.runner_up);
        if (l.best != i || r.best != i) continue;
        if (score >= options.min_score && margin >= options.min_margin) chosen.push_back(Chosen{i, margin});
    }
    return chosen;
}

// Drop candidates that do not go with the pose errors which the matches so far speak for.
void narrow(const oc_pair_t &pair, const PreparedView &left, const PreparedView &right, const MatchOptions &options,
            std::vector<Scored> *scored)
{
    const auto pixels_of = [&](const Scored &s) {
        const oc_junction_t &l = left.junction(s.candidate.left);
        const oc_junction_t &r = right.junction(s.candidate.right);
        return PairErrors::PixelPair{l.x_px, l.y_px, r.x_px, r.y_px};
    };
    MatchOptions strict = options;
    strict.min_score = std::max(options.min_score, options.min_score_to_narrow);
    for (int round = 0; round < kNarrowings; round++) {
        std::vector<PairErrors::PixelPair> matches;
        for (const Chosen &c : choose(*scored, left, right, strict)) matches.push_back(pixels_of((*scored)[c.index]));
        PairErrors errors(pair);
        errors.fit(matches);
        const auto is_off = [&](const Scored &s) { return errors.deviation(pixels_of(s)) > OC_STRIP_MAX_SIGMA; };
        scored->erase(std::remove_if(scored->begin(), scored->end(), is_off), scored->end());
    }
}

} // namespace

MatchOptions thesis_match_options()
{
    MatchOptions options;
    options.strip.method = StripMethod::kThesis;
    options.strip.with_rivals = false;
    options.correlate.support = Support::kWindow;
    options.correlate.with_extra_planes = false;
    options.correlate.smooth_sigma_px = 0;
    options.correlate.gauss_sigma_px = 0;
    options.correlate.coarse_reject = -1;
    options.correlate.max_fine = 64;
    options.min_score = 0.75;
    options.min_margin = 0;
    options.narrows_strip = false;
    return options;
}

PairResult match_pair(const PreparedView &left, const PreparedView &right, const Area &area,
                      const MatchOptions &options)
{
    const PosedView &posed_left = left.posed();
    const PosedView &posed_right = right.posed();
    PairResult result;
    result.pair.left = posed_left.view->id;
    result.pair.right = posed_right.view->id;
    oc_pair_t pair;
    if (!prepare_pair(posed_left, posed_right, options.strip, &pair)) return result;

    const std::vector<Candidate> candidates = find_candidates(pair, posed_left, posed_right, area, options.strip);
    const Correlator correlator(left, right, pair, options.correlate);
    std::vector<Scored> scored = score_candidates(candidates, correlator);
    result.n_candidates = static_cast<int>(candidates.size());
    if (options.narrows_strip) narrow(pair, left, right, options, &scored);

    for (const Chosen &chosen : choose(scored, left, right, options)) {
        const Scored &s = scored[chosen.index];
        Covariances covariances;
        if (s.candidate.is_rival) continue;
        if (!point_covariances(posed_left, left.junction(s.candidate.left), posed_right,
                               right.junction(s.candidate.right), options.strip.sigma_px, &covariances)) {
            continue;
        }
        Match match;
        match.left_junction = s.candidate.left;
        match.right_junction = s.candidate.right;
        match.score = s.correlation.score;
        match.margin = chosen.margin;
        match.point = s.candidate.point;
        match.covariance = options.with_pose_covariance ? covariances.of_all : covariances.of_pixels;
        match.kind = kind_of(s, correlator, std::sqrt(covariances.of_all(2, 2)), options);
        result.pair.matches.push_back(match);
        result.planes.push_back(s.correlation.plane);
    }
    return result;
}

// ---- third views ----

namespace {

// Best score of a match's left window in a third view near the point's projection; nothing when it has no say.
std::optional<double> look_in(const PreparedView &third, const PreparedView &left, const Match &match,
                              const oc_plane_t &plane, const CorrelateOptions &correlate, double search_px)
{
    double x = 0;
    double y = 0;
    double H[9];
    bool same_side = false;
    const oc_camera_t &from = left.posed().camera;
    const oc_camera_t &to = third.posed().camera;
    const oc_junction_t &junction = left.junction(match.left_junction);
    if (!(oc_camera_project(&to, match.point.data(), &x, &y) > 0)) return std::nullopt;
    if (third.sample(static_cast<float>(x), static_cast<float>(y)) < 0) return std::nullopt;
    if (oc_plane_homography(&from, &to, &plane, H, &same_side) != OC_OK || !same_side) return std::nullopt;

    std::optional<double> best;
    for (double dy = -search_px; dy <= search_px; dy += 1) {
        for (double dx = -search_px; dx <= search_px; dx += 1) {
            double anchored[9];
            if (oc_homography_anchor(H, junction.x_px, junction.y_px, x + dx, y + dy, anchored) != OC_OK) continue;
            const std::optional<double> score = correlate_warped(left, match.left_junction, third, anchored, correlate);
            if (score && *score > best.value_or(-2)) best = score;
        }
    }
    return best;
}

bool is_denied(const PreparedView &left, const PreparedView &right, const std::vector<const PreparedView *> &others,
               const Match &match, const oc_plane_t &plane, const CorrelateOptions &correlate,
               const ThirdViewOptions &options)
{
    int denials = 0;
    for (const PreparedView *third : others) {
        const int id = third->posed().view->id;
        if (id == left.posed().view->id || id == right.posed().view->id) continue;
        const std::optional<double> score = look_in(*third, left, match, plane, correlate, options.search_px);
        if (!score) continue;
        if (*score >= options.min_confirmed) return false;
        if (*score < options.max_denied) denials++;
    }
    return denials >= options.min_denials;
}

} // namespace

int verify_with_third_views(const PreparedView &left, const PreparedView &right,
                            const std::vector<const PreparedView *> &others, const CorrelateOptions &correlate,
                            const ThirdViewOptions &options, PairResult *result)
{
    std::vector<Match> kept;
    std::vector<oc_plane_t> planes;
    for (std::size_t i = 0; i < result->pair.matches.size(); i++) {
        const Match &match = result->pair.matches[i];
        if (is_denied(left, right, others, match, result->planes[i], correlate, options)) continue;
        kept.push_back(match);
        planes.push_back(result->planes[i]);
    }
    const int n_dropped = static_cast<int>(result->pair.matches.size() - kept.size());
    result->pair.matches = std::move(kept);
    result->planes = std::move(planes);
    return n_dropped;
}

} // namespace outcrop
