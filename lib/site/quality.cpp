// SPDX-License-Identifier: BSD-3-Clause
// One small function per statement.
#include "site/quality.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>

#include "site/boxes.h"
#include "site/triangulate.h"

namespace outcrop {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kSigmas99 = 2.58;

double median(std::vector<double> values)
{
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
}

double count(const SiteModel &model, const char *name)
{
    const auto at = model.counts.find(name);
    return at == model.counts.end() ? 0 : at->second;
}

std::string percent(double share)
{
    return std::to_string(std::lround(100 * share)) + " %";
}

// Standard deviation of where everything stands, in X or Y.
double place_sigma(const SiteModel &model)
{
    std::vector<double> sigmas;
    for (const RefinedView &view : model.views) sigmas.push_back(std::max(view.posterior.v[0], view.posterior.v[1]));
    return median(std::move(sigmas));
}

class Judge {
public:
    Judge(const QualityFacts &facts, const QualityOptions &options, SiteModel *model)
        : facts_(facts), options_(options), model_(*model), views_(*facts.views)
    {}

    void run()
    {
        judge_views();
        judge_ground();
        judge_poses();
        judge_matches();
        judge_boxes();
    }

private:
    void say(Severity severity, const char *code, std::string text)
    {
        model_.quality.push_back({code, std::move(text), severity});
    }

    void judge_views()
    {
        if (views_.size() < 2) {
            say(Severity::kFault, "one_view",
                views_.empty() ? "No view has come." : "One view alone says nothing of depth.");
            return;
        }
        double height = 0, widest = 0;
        for (const View &a : views_) {
            height += std::abs(camera_centre(a.camera).z()) / static_cast<double>(views_.size());
            widest = std::max(widest, (camera_centre(a.camera) - camera_centre(views_[0].camera)).norm());
        }
        if (widest < options_.min_baseline_share * height) {
            say(Severity::kFault, "views_all_alike", "All views were taken from one place: nothing can be measured.");
        } else if (count(model_, "pairs") == 0) {
            say(Severity::kFault, "no_parallax",
                "No two views see the same part of the area from usefully different directions.");
        }
    }

    void judge_ground()
    {
        if (views_.size() < 2) return;
        if (!facts_.sees_common_ground) {
            say(Severity::kFault, "no_ground_in_sight", "No two views see the same ground.");
            return;
        }
        if (facts_.is_exact) return;
        if (facts_.n_ground_sightings == 0) {
            say(Severity::kWarning, "no_ground_seen",
                "No point of the ground was found in two views: heights rest on the sensors alone.");
        } else if (facts_.n_ground_sightings >= options_.min_ground_sightings) {
            const double share = static_cast<double>(facts_.n_ground_misfits) / facts_.n_ground_sightings;
            if (share > options_.max_ground_misfit_share)
                say(Severity::kFault, "ground_not_flat",
                    "A flat ground does not explain " + percent(share) + " of the ground's points.");
        }
    }

    // Sightings of the ground that fit far better when the picture is turned over.
    bool looks_mirrored() const
    {
        std::map<int, const View *> by_id;
        for (const View &view : views_) by_id[view.id] = &view;
        std::vector<double> plain, mirrored;
        for (const View &view : views_) {
            for (const oc_tie_t &tie : view.ties) {
                const auto ref = by_id.find(tie.ref_view);
                if (ref == by_id.end()) continue;
                for (const bool is_mirrored : {false, true}) {
                    const auto a = on_ground(view, tie.x_px, tie.y_px, is_mirrored);
                    const auto b = on_ground(*ref->second, tie.ref_x_px, tie.ref_y_px, is_mirrored);
                    if (a && b) (is_mirrored ? mirrored : plain).push_back((*a - *b).norm());
                }
            }
        }
        return static_cast<int>(mirrored.size()) >= options_.min_ground_sightings && !plain.empty() &&
               median(mirrored) < 0.25 * median(plain) && 2 * mirrored.size() > plain.size();
    }

    static std::optional<Vector2d> on_ground(const View &view, float x, float y, bool is_mirrored)
    {
        const double x_px = static_cast<double>(x), y_px = static_cast<double>(y);
        Vector3d ray;
        oc_camera_ray(&view.camera, is_mirrored ? view.camera.k.width_px - 1.0 - x_px : x_px, y_px, ray.data());
        const Vector3d centre = camera_centre(view.camera);
        const double reach = -centre.z() / ray.z();
        if (!(reach > 0) || !std::isfinite(reach)) return std::nullopt;
        return Vector2d((centre + reach * ray).head<2>());
    }

    // By how many margins was a view moved, when that is beyond doubt? Worst parameter.
    double margins_moved(std::size_t i) const
    {
        oc_pose6_t before, after;
        oc_pose_to_6(&views_[i].camera.pose, &before);
        oc_pose_to_6(&model_.views[i].camera.pose, &after);
        double worst = 0;
        for (int k = 0; k < 6; ++k) {
            const double margin = views_[i].margin.v[k];
            double moved = std::abs(after.v[k] - before.v[k]);
            if (k >= 3) moved = std::abs(std::remainder(moved, 2 * 3.14159265358979323846));
            moved -= options_.margin_sigmas * model_.views[i].posterior.v[k];
            if (margin > 0) worst = std::max(worst, moved / margin);
        }
        return worst;
    }

    void judge_poses()
    {
        if (views_.size() < 2) return;
        if (looks_mirrored())
            say(Severity::kFault, "mirrored_camera", "The ground's points fit only when the pictures are turned over.");
        if (facts_.is_exact) return;
        int n_outside = 0, n_improved = 0;
        for (std::size_t i = 0; i < views_.size(); ++i) {
            n_outside += margins_moved(i) > options_.margin_slack;
            n_improved += model_.views[i].is_improved;
        }
        const int n_views = static_cast<int>(views_.size());
        if (n_outside > options_.max_outside_share * n_views) {
            say(Severity::kFault, "poses_outside_margins",
                std::to_string(n_outside) + " of " + std::to_string(n_views) +
                    " poses had to move farther than their margins allow.");
        } else if (n_outside > 0) {
            say(Severity::kWarning, "pose_outside_margins",
                std::to_string(n_outside) + " poses had to move farther than their margins allow.");
        }
        if (n_improved < n_views)
            say(n_improved == 0 ? Severity::kWarning : Severity::kNote, "poses_not_improved",
                std::to_string(n_views - n_improved) + " of " + std::to_string(n_views) +
                    " poses could not be improved and are as the sensors told them.");
    }

    void judge_matches()
    {
        if (views_.size() < 2 || count(model_, "pairs") == 0) return;
        double n_junctions = 0;
        for (const View &view : views_)
            for (const oc_junction_t &j : view.junctions) n_junctions += j.label != OC_LABEL_GROUND;
        const double n_matched = count(model_, "matches");
        if (n_junctions >= options_.min_obstacle_junctions && n_matched < options_.min_match_share * n_junctions)
            say(Severity::kFault, "patches_do_not_fit",
                "Of " + std::to_string(std::lround(n_junctions)) + " corners that may be obstacles' only " +
                    std::to_string(std::lround(n_matched)) + " matches were found.");
        const double n_merged = count(model_, "tracks_merged");
        const double n_dropped = count(model_, "tracks_inconsistent") + count(model_, "tracks_uncertain") +
                                 count(model_, "tracks_below_ground") + count(model_, "tracks_doubtful");
        if (n_merged >= options_.min_ground_sightings && n_dropped > options_.max_dropped_share * n_merged)
            say(Severity::kFault, "poses_too_poor",
                percent(n_dropped / n_merged) + " of what was matched does not come together in space.");
    }

    // Why a box cannot be claimed; empty when it can.
    std::string doubt(const Obstacle &box, double sigma) const
    {
        int n_in_front = 0;
        for (const RefinedView &view : model_.views) {
            const Vector3d centre = camera_centre(view.camera);
            if (footprint_contains(box, centre.x(), centre.y()) && centre.z() <= box.aabb_max.z()) return "camera";
            const Vector3d in_cam = camera_rotation(view.camera) * (box.obb_centre - centre);
            n_in_front += in_cam.z() > 0;
        }
        if (n_in_front < 2) return "camera";
        const double lesser = std::min(box.obb_size.x(), box.obb_size.y());
        return kSigmas99 * sigma > options_.max_place_share * lesser ? "place" : "";
    }

    void judge_boxes()
    {
        if (static_cast<int>(model_.obstacles.size()) > options_.max_obstacles)
            say(Severity::kWarning, "too_many_obstacles",
                std::to_string(model_.obstacles.size()) + " boxes: more than a site of this kind should hold.");
        const double sigma = facts_.is_exact ? 0 : place_sigma(model_);
        const bool is_all = has_fault(model_);
        std::vector<char> is_doubted;
        int n_behind = 0, n_astray = 0;
        for (const Obstacle &box : model_.obstacles) {
            const std::string why = doubt(box, sigma);
            n_behind += why == "camera";
            n_astray += why == "place";
            is_doubted.push_back(is_all || !why.empty());
        }
        const int n_boxes = static_cast<int>(model_.obstacles.size());
        demote(is_doubted);
        if (n_behind > 0)
            say(Severity::kWarning, "box_behind_camera",
                std::to_string(n_behind) + " boxes hold a camera or have fewer than two in front of them.");
        if (n_astray > 0)
            say(2 * n_astray > n_boxes ? Severity::kFault : Severity::kWarning, "poses_too_poor",
                "Poses are known to " + std::to_string(std::lround(1000 * kSigmas99 * sigma)) + " mm: the place of " +
                    std::to_string(n_astray) + " boxes is not known to half their width.");
        if (has_fault(model_) && !is_all) demote(std::vector<char>(model_.obstacles.size(), 1));
    }

    // The points' boxes are told by index, so they move with them.
    void demote(const std::vector<char> &is_doubted)
    {
        std::vector<int> new_index(model_.obstacles.size(), -2);
        std::vector<Obstacle> kept;
        for (std::size_t i = 0; i < model_.obstacles.size(); ++i) {
            Obstacle &box = model_.obstacles[i];
            if (is_doubted[i]) {
                box.is_suspected = true;
                box.index = static_cast<int>(model_.suspected.size()) + 1;
                model_.suspected.push_back(box);
                continue;
            }
            new_index[i] = static_cast<int>(kept.size());
            box.index = new_index[i] + 1;
            kept.push_back(box);
        }
        model_.obstacles = std::move(kept);
        for (SitePoint &p : model_.points)
            if (p.obstacle >= 0) p.obstacle = new_index[static_cast<std::size_t>(p.obstacle)];
        if (model_.counts.count("obstacles") == 0) return;
        model_.counts["obstacles"] = static_cast<double>(model_.obstacles.size());
        model_.counts["suspected"] = static_cast<double>(model_.suspected.size());
    }

    const QualityFacts &facts_;
    const QualityOptions &options_;
    SiteModel &model_;
    const std::vector<View> &views_;
};

} // namespace

void QualityOptions::check() const
{
    const double shares[] = {min_baseline_share, max_place_share, margin_slack,      margin_sigmas,
                             max_outside_share,  min_match_share, max_dropped_share, max_ground_misfit_share};
    for (const double share : shares)
        if (!(share >= 0)) throw std::invalid_argument("quality: shares and sigmas must be >= 0");
    if (min_ground_sightings < 1 || min_obstacle_junctions < 1 || max_obstacles < 1)
        throw std::invalid_argument("quality: counts must be >= 1");
}

void judge(const QualityFacts &facts, const QualityOptions &options, SiteModel *model)
{
    options.check();
    if (!facts.views || facts.views->size() != model->views.size())
        throw std::invalid_argument("quality: the views and the model's must be the same");
    model->quality.clear();
    Judge(facts, options, model).run();
}

bool has_fault(const SiteModel &model)
{
    return std::any_of(model.quality.begin(), model.quality.end(),
                       [](const Statement &s) { return s.severity == Severity::kFault; });
}

} // namespace outcrop
