// SPDX-License-Identifier: BSD-3-Clause
// The way from views to the settled model of a site.
#include "site/model.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>

namespace outcrop {

namespace {

using Eigen::Vector3d;

// Adds the time of its life to a step.
class StepTimer {
public:
    StepTimer(std::map<std::string, double> *ms, const char *step)
        : ms_(ms), step_(step), start_(std::chrono::steady_clock::now())
    {}
    ~StepTimer()
    {
        const std::chrono::duration<double, std::milli> spent = std::chrono::steady_clock::now() - start_;
        (*ms_)[step_] += spent.count();
    }
    StepTimer(const StepTimer &) = delete;
    StepTimer &operator=(const StepTimer &) = delete;

private:
    std::map<std::string, double> *ms_;
    const char *step_;
    std::chrono::steady_clock::time_point start_;
};

std::vector<View> sorted_views(const std::vector<View> &views)
{
    std::vector<View> sorted = views; // pixels are shared, not copied
    std::sort(sorted.begin(), sorted.end(), [](const View &a, const View &b) { return a.id < b.id; });
    for (std::size_t i = 0; i < sorted.size(); ++i) {
        const std::string name = "model: view " + std::to_string(sorted[i].id);
        if (i > 0 && sorted[i].id == sorted[i - 1].id) throw std::invalid_argument(name + " is there twice");
        if (!oc_intrinsics_is_valid(&sorted[i].camera.k) || !oc_pose_is_valid(&sorted[i].camera.pose))
            throw std::invalid_argument(name + " has a camera that is not valid");
        for (const double half_width : sorted[i].margin.v)
            if (!(half_width >= 0) || !std::isfinite(half_width))
                throw std::invalid_argument(name + " has a margin that is negative or not a number");
    }
    return sorted;
}

void check_area(const Area &area)
{
    const bool is_good = area.x_max > area.x_min && area.y_max > area.y_min && area.z_max > 0 &&
                         std::isfinite(area.x_max - area.x_min) && std::isfinite(area.y_max - area.y_min) &&
                         std::isfinite(area.z_max);
    if (!is_good) throw std::invalid_argument("model: the area must have x, y ascending and z_max > 0");
}

double mean_height(const std::vector<View> &views)
{
    double sum = 0;
    for (const View &view : views) sum += std::abs(camera_centre(view.camera).z());
    return views.empty() ? 0 : sum / static_cast<double>(views.size());
}

bool sees_ground(const View &view, const Vector3d &ground, double reach)
{
    const Vector3d centre = camera_centre(view.camera);
    if ((ground - centre).head<2>().norm() > reach * std::abs(centre.z())) return false;
    double x, y;
    if (!(oc_camera_project(&view.camera, ground.data(), &x, &y) > 0)) return false;
    return x >= 0 && y >= 0 && x <= view.camera.k.width_px - 1.0 && y <= view.camera.k.height_px - 1.0;
}

// Do two views see one point of a coarse grid over the area?
bool sees_common_ground(const std::vector<View> &views, const Area &area, double reach)
{
    constexpr int kCells = 32;
    for (int row = 0; row < kCells; ++row) {
        for (int col = 0; col < kCells; ++col) {
            const Vector3d ground(area.x_min + (col + 0.5) / kCells * (area.x_max - area.x_min),
                                  area.y_min + (row + 0.5) / kCells * (area.y_max - area.y_min), 0);
            int n_seen = 0;
            for (const View &view : views) n_seen += sees_ground(view, ground, reach);
            if (n_seen >= 2) return true;
        }
    }
    return false;
}

bool is_exact(const View &view, double exact_sigma)
{
    for (const double half_width : view.margin.v)
        if (!(half_width < exact_sigma)) return false;
    return true;
}

} // namespace

void BuildOptions::check() const
{
    tracks.check();
    refine.check();
    cluster.check();
    boxes.check();
    suspects.check();
    quality.check();
    if (passes < 1 || passes > 10) throw std::invalid_argument("model: passes must be 1..10");
    if (!(area_z_share > 0) || !(area_reach > 0)) throw std::invalid_argument("model: area shares must be > 0");
}

Area derive_area(const std::vector<View> &views, const BuildOptions &options)
{
    Area area;
    if (views.empty()) return area;
    constexpr int kCells = 64;
    constexpr double kHuge = std::numeric_limits<double>::infinity();
    Eigen::Vector2d low(kHuge, kHuge), high(-kHuge, -kHuge), mean(0, 0);
    for (const View &view : views) {
        const Vector3d centre = camera_centre(view.camera);
        const Eigen::Vector2d reach = Eigen::Vector2d::Constant(options.area_reach * std::abs(centre.z()));
        low = low.cwiseMin(centre.head<2>() - reach);
        high = high.cwiseMax(centre.head<2>() + reach);
        mean += centre.head<2>() / static_cast<double>(views.size());
    }
    const Eigen::Vector2d cell = (high - low) / kCells;
    Eigen::Vector2d least(kHuge, kHuge), most(-kHuge, -kHuge);
    for (int row = 0; row < kCells; ++row) {
        for (int col = 0; col < kCells; ++col) {
            const Eigen::Vector2d corner = low + Eigen::Vector2d(col * cell.x(), row * cell.y());
            const Vector3d ground(corner.x() + cell.x() / 2, corner.y() + cell.y() / 2, 0);
            int n_seen = 0;
            for (const View &view : views) n_seen += sees_ground(view, ground, options.area_reach);
            if (n_seen < 2) continue;
            least = least.cwiseMin(corner);
            most = most.cwiseMax(corner + cell);
        }
    }
    const double height = std::max(mean_height(views), 1e-3);
    if (!(most.x() > least.x())) {
        least = mean.array() - height;
        most = mean.array() + height;
    }
    area.x_min = least.x(), area.x_max = most.x();
    area.y_min = least.y(), area.y_max = most.y();
    area.z_max = options.area_z_share * height;
    return area;
}

namespace {

// What the steps hand on to each other.
class Builder {
public:
    Builder(std::vector<View> views, const std::optional<Area> &area, const BuildOptions &options)
        : views_(std::move(views)), options_(options)
    {
        model_.area = area ? *area : derive_area(views_, options);
        if (!views_.empty()) check_area(model_.area);
        diagonal_ = std::hypot(model_.area.x_max - model_.area.x_min, model_.area.y_max - model_.area.y_min);
        for (const View &view : views_) {
            cameras_.push_back(view.camera);
            margins_.push_back(view.margin);
            covariances_.push_back(pose_covariance(view.camera, view.margin));
            model_.views.push_back(unrefined(view));
            is_exact_ = is_exact_ && is_exact(view, options.refine.exact_sigma);
        }
    }

    SiteModel build(const Matcher &matcher)
    {
        model_.counts["views"] = static_cast<double>(views_.size());
        if (views_.size() >= 2) {
            const int passes = is_exact_ ? 1 : options_.passes;
            if (!is_exact_ && options_.ties_first && has_ties()) refine_on({});
            for (int i = 0; i < passes; ++i) pass(matcher, i);
            settle();
            keep_matches();
            make_points();
            group();
            look_for_suspects();
        }
        judge_all();
        return std::move(model_);
    }

private:
    bool has_ties() const
    {
        return std::any_of(views_.begin(), views_.end(), [](const View &view) { return !view.ties.empty(); });
    }

    static RefinedView unrefined(const View &view)
    {
        RefinedView refined;
        refined.id = view.id;
        refined.camera = view.camera;
        for (int k = 0; k < 6; ++k) refined.posterior.v[k] = view.margin.v[k] / std::sqrt(3.0);
        return refined;
    }

    void pass(const Matcher &matcher, int index)
    {
        {
            StepTimer timer(&model_.ms, "match");
            MatchPass request;
            request.index = index;
            request.is_last = index + 1 == (is_exact_ ? 1 : options_.passes);
            request.area = model_.area;
            request.angles = is_refined_ ? OC_ANGLE_ERROR_LOCAL : options_.match.strip.angles;
            for (std::size_t i = 0; i < views_.size(); ++i)
                request.views.push_back({&views_[i], cameras_[i], margins_[i]});
            model_.pairs = matcher(request);
        }
        std::sort(model_.pairs.begin(), model_.pairs.end(), [](const PairMatches &a, const PairMatches &b) {
            return a.left != b.left ? a.left < b.left : a.right < b.right;
        });
        {
            StepTimer timer(&model_.ms, "tracks");
            merged_ = merge_tracks(views_, model_.pairs, &model_.counts);
        }
        if (!is_exact_) refine();
    }

    void refine()
    {
        settle();
        std::vector<Track> sure;
        for (const Track &track : tracks_)
            if (!track.is_doubtful) sure.push_back(track);
        refine_on(sure);
    }

    // From the reported poses anew, with all there is: the vehicle's ties and these tracks.
    void refine_on(const std::vector<Track> &tracks)
    {
        StepTimer timer(&model_.ms, "refine");
        RefineResult result = refine_poses(views_, tracks, options_.refine);
        is_refined_ = true;
        model_.views = result.views;
        covariances_ = std::move(result.relative_covariances);
        margins_ = std::move(result.matching_margins);
        n_ground_sightings_ = result.n_ground_sightings;
        n_ground_misfits_ = result.n_ground_rejected;
        for (std::size_t i = 0; i < views_.size(); ++i) cameras_[i] = model_.views[i].camera;
        model_.counts["refine_ground"] = result.n_ground;
        model_.counts["refine_points"] = result.n_points;
        model_.counts["refine_rejected"] = result.n_rejected;
        model_.counts["refine_rms_before_px"] = result.rms_before_px;
        model_.counts["refine_rms_after_px"] = result.rms_after_px;
    }

    void settle()
    {
        StepTimer timer(&model_.ms, "tracks");
        tracks_ = settle_tracks(views_, cameras_, is_exact_ ? std::vector<Matrix6d>() : covariances_, merged_,
                                model_.area, options_.tracks, &model_.counts);
    }

    // Matches that no sure track holds are left out; the others take its point.
    void keep_matches()
    {
        std::map<int, int> index;
        for (std::size_t i = 0; i < views_.size(); ++i) index[views_[i].id] = static_cast<int>(i);
        std::map<TrackPixel, const Track *> track_of;
        for (const Track &track : tracks_) {
            if (track.is_doubtful) continue;
            for (const TrackPixel &p : track.pixels) track_of[p] = &track;
        }
        double n_matches = 0;
        for (PairMatches &pair : model_.pairs) {
            std::vector<Match> kept;
            for (Match &match : pair.matches) {
                const auto left = track_of.find({index[pair.left], match.left_junction});
                const auto right = track_of.find({index[pair.right], match.right_junction});
                if (left == track_of.end() || right == track_of.end() || left->second != right->second) continue;
                match.kind = left->second->kind;
                match.point = left->second->fit.point;
                match.covariance = left->second->fit.covariance;
                kept.push_back(match);
            }
            pair.matches = std::move(kept);
            n_matches += static_cast<double>(pair.matches.size());
        }
        model_.counts["pairs"] = static_cast<double>(model_.pairs.size());
        model_.counts["matches"] = n_matches;
    }

    // Mean of the pixels known round the apex, in all views.
    cv::Vec3b colour_of(const Track &track) const
    {
        double sum = 0;
        int n = 0;
        for (const TrackPixel &p : track.pixels) {
            const View &view = views_[static_cast<std::size_t>(p.view)];
            const oc_junction_t &j = view.junctions[static_cast<std::size_t>(p.junction)];
            const int x = static_cast<int>(std::lround(j.x_px)), y = static_cast<int>(std::lround(j.y_px));
            for (int v = std::max(0, y - 3); v <= std::min(view.grey.rows - 1, y + 3); ++v) {
                for (int u = std::max(0, x - 3); u <= std::min(view.grey.cols - 1, x + 3); ++u) {
                    if (view.known.empty() || !view.known(v, u)) continue;
                    sum += view.grey(v, u);
                    ++n;
                }
            }
        }
        if (n == 0) return {200, 200, 200};
        const uchar grey = static_cast<uchar>(std::lround(sum / n));
        return {grey, grey, grey};
    }

    void make_points()
    {
        StepTimer timer(&model_.ms, "points");
        double n_ground = 0;
        for (const Track &track : tracks_) {
            if (track.kind == MatchKind::kGround) {
                ++n_ground;
                continue;
            }
            SitePoint point;
            point.position = track.fit.point;
            point.covariance = track.fit.covariance;
            point.n_views = static_cast<int>(track.pixels.size());
            point.score = track.score;
            point.is_doubtful = track.is_doubtful;
            point.colour = colour_of(track);
            model_.points.push_back(point);
        }
        model_.counts["ground_points"] = n_ground;
        model_.counts["points"] = static_cast<double>(model_.points.size());
    }

    void group()
    {
        StepTimer timer(&model_.ms, "cluster");
        const Clusters clusters = cluster_points(model_.points, diagonal_, options_.cluster);
        make_boxes(clusters, diagonal_, options_.boxes, &model_.points, &model_.obstacles, &model_.suspected);
        model_.counts["t_m_m"] = clusters.t_m_m;
        model_.counts["obstacles"] = static_cast<double>(model_.obstacles.size());
        model_.counts["suspected"] = static_cast<double>(model_.suspected.size());
    }

    void look_for_suspects()
    {
        std::set<std::pair<int, int>> matched;
        for (const Track &track : tracks_)
            for (const TrackPixel &p : track.pixels) matched.insert({p.view, p.junction});
        model_.suspects = find_suspects(views_, matched, model_, options_.suspects);
        model_.counts["suspect_places"] = static_cast<double>(model_.suspects.size());
    }

    void judge_all()
    {
        QualityFacts facts;
        facts.views = &views_;
        facts.is_exact = is_exact_;
        facts.sees_common_ground = sees_common_ground(views_, model_.area, options_.area_reach);
        facts.n_ground_sightings = n_ground_sightings_;
        facts.n_ground_misfits = n_ground_misfits_;
        judge(facts, options_.quality, &model_);
    }

    std::vector<View> views_;
    const BuildOptions &options_;
    SiteModel model_;
    double diagonal_ = 0;
    bool is_exact_ = true;
    int n_ground_sightings_ = 0, n_ground_misfits_ = 0; // of the last refinement
    bool is_refined_ = false;                           // cameras_ and margins_ come from refine_poses
    std::vector<oc_camera_t> cameras_;                  // as believed now
    std::vector<oc_margin_t> margins_;                  // for matching
    std::vector<Matrix6d> covariances_;                 // of the poses, between views
    std::vector<Track> merged_, tracks_;
};

std::vector<PairMatches> match_all(const MatchPass &pass, const BuildOptions &options)
{
    MatchOptions match = options.match;
    match.strip.angles = pass.angles;
    if (!pass.is_last) match.min_score = std::max(match.min_score, options.min_score_to_refine);
    std::vector<std::unique_ptr<PreparedView>> prepared;
    for (const PosedView &view : pass.views) prepared.push_back(std::make_unique<PreparedView>(view, match.correlate));
    std::vector<PairMatches> matches;
    for (const ViewPair &pair : select_pairs(pass.views, pass.area, options.pairs)) {
        const PreparedView &left = *prepared[static_cast<std::size_t>(pair.left)];
        const PreparedView &right = *prepared[static_cast<std::size_t>(pair.right)];
        PairResult result = match_pair(left, right, pass.area, match);
        if (options.with_third_views && pass.is_last) {
            std::vector<const PreparedView *> others;
            for (const auto &view : prepared) others.push_back(view.get());
            verify_with_third_views(left, right, others, match.correlate, options.third_views, &result);
        }
        matches.push_back(std::move(result.pair));
    }
    return matches;
}

} // namespace

SiteModel build_from_matches(const std::vector<View> &views, const std::optional<Area> &area, const Matcher &matcher,
                             const BuildOptions &options)
{
    options.check();
    return Builder(sorted_views(views), area, options).build(matcher);
}

SiteModel build_site(const std::vector<View> &views, const std::optional<Area> &area, const BuildOptions &options)
{
    return build_from_matches(
        views, area, [&options](const MatchPass &pass) { return match_all(pass, options); }, options);
}

} // namespace outcrop
