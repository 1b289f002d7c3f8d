// SPDX-License-Identifier: BSD-3-Clause
// Candidates in epipolar strips, looked up in buckets of the right view.
#include "site/strip.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace outcrop {
namespace {

constexpr int kBucketPx = 16;
constexpr double kThesisLinePx = 3;    // t_F of the thesis' section 5.9, where margins leave no strip
constexpr double kNoHeightLimit = 1e4; // metres

struct Rect {
    double x_min = 0, y_min = 0, x_max = 0, y_max = 0;
};

// Right junctions by the bucket they lie in.
class BucketIndex {
public:
    BucketIndex(const View &view, bool with_ground)
        : view_(view), n_x_(static_cast<int>(view.camera.k.width_px) / kBucketPx + 1),
          n_y_(static_cast<int>(view.camera.k.height_px) / kBucketPx + 1),
          buckets_(static_cast<std::size_t>(n_x_) * n_y_)
    {
        for (std::size_t i = 0; i < view.junctions.size(); i++) {
            const oc_junction_t &junction = view.junctions[i];
            if (!with_ground && junction.label == OC_LABEL_GROUND) continue;
            buckets_[cell(junction.y_px, n_y_) * n_x_ + cell(junction.x_px, n_x_)].push_back(static_cast<int>(i));
        }
    }

    // Junctions inside the rectangle, ascending.
    void find(const Rect &rect, std::vector<int> *found) const
    {
        found->clear();
        for (int by = cell(rect.y_min, n_y_); by <= cell(rect.y_max, n_y_); by++) {
            for (int bx = cell(rect.x_min, n_x_); bx <= cell(rect.x_max, n_x_); bx++) {
                for (const int i : buckets_[static_cast<std::size_t>(by) * n_x_ + bx]) {
                    const oc_junction_t &j = view_.junctions[i];
                    if (j.x_px >= rect.x_min && j.x_px <= rect.x_max && j.y_px >= rect.y_min && j.y_px <= rect.y_max) {
                        found->push_back(i);
                    }
                }
            }
        }
        std::sort(found->begin(), found->end());
    }

private:
    static int cell(double coordinate_px, int n)
    {
        return static_cast<int>(std::clamp(coordinate_px / kBucketPx, 0.0, n - 1.0));
    }

    const View &view_;
    int n_x_, n_y_;
    std::vector<std::vector<int>> buckets_;
};

// Strip and segment of one left junction, of either method.
class Gate {
public:
    Gate(const oc_pair_t &pair, const PosedView &left, const PosedView &right, const Area &area,
         const StripOptions &options)
        : pair_(pair), options_(options), width_px_(right.camera.k.width_px), height_px_(right.camera.k.height_px)
    {
        reach_.z_min_m = -options.below_ground_m;
        reach_.z_max_m = std::max(area.z_max, reach_.z_min_m + 1e-6);
        reach_.depth_min_m = 1e-3;
        reach_.depth_max_m = 1e6;
        rival_reach_ = reach_;
        if (options.with_rivals) rival_reach_.z_max_m = kNoHeightLimit;
        if (options.method != StripMethod::kThesis) return;
        if (oc_pair_prepare_thesis(&thesis_pair_, &left.camera, &left.margin, &right.camera, &right.margin) != OC_OK) {
            throw std::invalid_argument("find_candidates: the thesis' strip cannot be prepared");
        }
    }

    // False when the left pixel has no strip. rect is where to look.
    bool open(double x_px, double y_px, Rect *rect)
    {
        if (oc_strip_prepare(&pair_, x_px, y_px, &strip_) != OC_OK) return false;
        if (options_.method == StripMethod::kThesis) {
            *rect = Rect{0, 0, width_px_, height_px_};
            return oc_strip_prepare_thesis(&thesis_pair_, x_px, y_px, width_px_, &thesis_strip_) == OC_OK;
        }
        has_inner_ = oc_strip_segment(&pair_, x_px, y_px, &reach_, &inner_) == OC_OK;
        if (!has_inner_ && !options_.with_rivals) return false;
        if (oc_strip_segment(&pair_, x_px, y_px, &rival_reach_, &outer_) != OC_OK) return false;
        const double *a = outer_.low_px;
        const double *b = outer_.high_px;
        const double pad =
            std::max(half_width_px(a), half_width_px(b)) + std::max(outer_.low_slack_px, outer_.high_slack_px) + 1;
        *rect = Rect{std::min(a[0], b[0]) - pad, std::min(a[1], b[1]) - pad, std::max(a[0], b[0]) + pad,
                     std::max(a[1], b[1]) + pad};
        return true;
    }

    bool contains(double x_px, double y_px) const
    {
        if (options_.method == StripMethod::kThesis) {
            return oc_strip_contains_thesis(&thesis_strip_, x_px, y_px) ||
                   std::abs(distance_px(x_px, y_px)) < kThesisLinePx;
        }
        if (!oc_strip_contains(&strip_, x_px, y_px)) return false;
        if (options_.max_half_width_px > 0 && std::abs(distance_px(x_px, y_px)) > options_.max_half_width_px) {
            return false;
        }
        return oc_segment_contains(&outer_, x_px, y_px);
    }

    // Of a pixel that is contained: at a height that obstacles may have.
    bool is_inside(double x_px, double y_px) const
    {
        if (options_.method == StripMethod::kThesis) return true;
        return has_inner_ && oc_segment_contains(&inner_, x_px, y_px);
    }

    double distance_px(double x_px, double y_px) const { return oc_strip_distance_px(&strip_, x_px, y_px); }

private:
    // The variance is a convex quadratic along the line: its largest value is at an end.
    double half_width_px(const double at[2]) const
    {
        const double width =
            OC_STRIP_MAX_SIGMA * std::sqrt(std::max(0.0, oc_strip_variance_px2(&strip_, at[0], at[1])));
        return options_.max_half_width_px > 0 ? std::min(width, options_.max_half_width_px) : width;
    }

    const oc_pair_t &pair_;
    const StripOptions &options_;
    double width_px_, height_px_;
    oc_reach_t reach_{}, rival_reach_{};
    oc_strip_t strip_{};
    bool has_inner_ = false;
    oc_segment_t inner_{}, outer_{}; // heights of obstacles, and of rivals
    oc_pair_thesis_t thesis_pair_{};
    oc_strip_thesis_t thesis_strip_{};
};

bool is_in_area(const oc_midpoint_t &midpoint, const Area &area, const StripOptions &options)
{
    if (options.method == StripMethod::kThesis) return true;
    const double *p = midpoint.p_in_world;
    const double slack = options.area_slack_m;
    return p[0] >= area.x_min - slack && p[0] <= area.x_max + slack && p[1] >= area.y_min - slack &&
           p[1] <= area.y_max + slack;
}

} // namespace

bool prepare_pair(const PosedView &left, const PosedView &right, const StripOptions &options, oc_pair_t *pair)
{
    const oc_status_t status = oc_pair_prepare(pair, &left.camera, &left.margin, &right.camera, &right.margin,
                                               options.angles, options.sigma_px);
    if (status == OC_E_ARG) throw std::invalid_argument("prepare_pair: a camera, a margin or sigma_px is not valid");
    return status == OC_OK;
}

std::vector<Candidate> find_candidates(const oc_pair_t &pair, const PosedView &left, const PosedView &right,
                                       const Area &area, const StripOptions &options)
{
    const BucketIndex index(*right.view, options.with_ground || options.with_rivals);
    Gate gate(pair, left, right, area, options);

    std::vector<Candidate> candidates;
    std::vector<int> near;
    for (std::size_t i = 0; i < left.view->junctions.size(); i++) {
        const oc_junction_t &l = left.view->junctions[i];
        Rect rect;
        const bool is_left_ground = !options.with_ground && l.label == OC_LABEL_GROUND;
        if (is_left_ground && !options.with_rivals) continue;
        if (!gate.open(l.x_px, l.y_px, &rect)) continue;
        index.find(rect, &near);
        for (const int j : near) {
            const oc_junction_t &r = right.view->junctions[j];
            const bool is_right_ground = !options.with_ground && r.label == OC_LABEL_GROUND;
            oc_midpoint_t midpoint;
            if (is_left_ground && is_right_ground) continue;
            if (!gate.contains(r.x_px, r.y_px)) continue;
            if (oc_epipolar_midpoint(&left.camera, l.x_px, l.y_px, &right.camera, r.x_px, r.y_px, &midpoint) != OC_OK) {
                continue;
            }
            if (!(midpoint.depth_left_m > 0 && midpoint.depth_right_m > 0)) continue;
            const bool is_rival = is_left_ground || is_right_ground || !gate.is_inside(r.x_px, r.y_px) ||
                                  !is_in_area(midpoint, area, options);
            if (is_rival && !options.with_rivals) continue;
            candidates.push_back(Candidate{static_cast<int>(i), j, gate.distance_px(r.x_px, r.y_px),
                                           Eigen::Vector3d(midpoint.p_in_world), is_rival});
        }
    }
    return candidates;
}

} // namespace outcrop
