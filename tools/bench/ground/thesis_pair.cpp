// SPDX-License-Identifier: BSD-3-Clause
// Ground matches of a pair as section 4.9 of the thesis finds them.
#include "thesis_pair.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>

#include "core/epipolar.h"
#include "core/plane.h"
#include "core/window.h"
#include "vehicle/ground_internal.h"

namespace outcrop::bench {
namespace {

struct Pixel {
    double at[2];
};

Pixel pixel_of(const oc_junction_t &j)
{
    return {{static_cast<double>(j.x_px), static_cast<double>(j.y_px)}};
}

// Height of the middle between the two rays (Eq 4.41); infinite when there is none.
double height_m(const oc_camera_t &left, const Pixel &a, const oc_camera_t &right, const Pixel &b)
{
    oc_midpoint_t middle;
    const oc_status_t status = oc_epipolar_midpoint(&left, a.at[0], a.at[1], &right, b.at[0], b.at[1], &middle);
    return status == OC_OK ? middle.p_in_world[2] : INFINITY;
}

// The worse of both correlations.
float correlate_both(const ground_patch_t &patch, const Pixel &a, const oc_ground_view_t &left, const double H[9],
                     const Pixel &b, const oc_ground_view_t &right, const double H_inv[9])
{
    ground_patch_t other;
    const float there = oc_ground_correlate(&patch, a.at, &right.grey, H, b.at);
    if (there < 0 || !oc_ground_patch_take(&right.grey, b.at, patch.n, false, &other)) return -1;
    return std::min(there, oc_ground_correlate(&other, b.at, &left.grey, H_inv, a.at));
}

} // namespace

std::vector<oc_ground_match_t> thesis_ground_matches(const oc_ground_view_t &left, const oc_ground_view_t &right,
                                                     unsigned window_px, float t_g, double t_h_m)
{
    const auto pair = std::make_unique<oc_pair_thesis_t>();
    double H_inv[9];
    if (oc_pair_prepare_thesis(pair.get(), &left.camera, &left.margin, &right.camera, &right.margin) != OC_OK ||
        oc_plane_ground_homography(&right.camera, &left.camera, H_inv) != OC_OK)
        throw std::runtime_error("a camera stands in the ground");
    std::vector<oc_ground_match_t> best_of_left(left.n_junctions), best_of_right(right.n_junctions);
    for (std::uint32_t i = 0; i < left.n_junctions; i++) {
        const Pixel a = pixel_of(left.junctions[i]);
        oc_rect_t window;
        ground_patch_t patch;
        if (oc_window_ground_thesis(pair.get(), a.at[0], a.at[1], &window) != OC_OK) continue;
        if (!oc_ground_patch_take(&left.grey, a.at, window_px, false, &patch)) continue;
        for (std::uint32_t j = 0; j < right.n_junctions; j++) {
            const Pixel b = pixel_of(right.junctions[j]);
            if (!(b.at[0] >= window.x_min_px && b.at[0] <= window.x_max_px && b.at[1] >= window.y_min_px &&
                  b.at[1] <= window.y_max_px))
                continue;
            const float ncc = correlate_both(patch, a, left, pair->H, b, right, H_inv);
            if (!(ncc >= t_g) || !(std::abs(height_m(left.camera, a, right.camera, b)) < t_h_m)) continue;
            const oc_ground_match_t match = {static_cast<std::uint16_t>(i), static_cast<std::uint16_t>(j), ncc};
            if (ncc > best_of_left[i].ncc) best_of_left[i] = match;
            if (ncc > best_of_right[j].ncc) best_of_right[j] = match;
        }
    }
    std::vector<oc_ground_match_t> out;
    for (std::uint32_t i = 0; i < left.n_junctions; i++) {
        const oc_ground_match_t &m = best_of_left[i];
        if (m.ncc > 0 && best_of_right[m.right].ncc > 0 && best_of_right[m.right].left == i) out.push_back(m);
    }
    return out;
}

} // namespace outcrop::bench
