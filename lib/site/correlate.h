// SPDX-License-Identifier: BSD-3-Clause
// Homographic correlation: how alike two junctions look when one is warped onto the other.
//
// The plane of a junction follows from two of its branches seen in two views
// (thesis Eq 5.17-5.29). Its homography, anchored so that it sends the left
// apex onto the right one, carries the window of one view into the other; the
// grey values are then compared there (thesis Eq 5.34, 5.35).
#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>
#include <opencv2/core.hpp>

#include "core/plane.h"
#include "core/window.h"
#include "site/pairs.h"

namespace outcrop {

enum class Measure {
    kVnc, // variance-normalised correlation, means over the warped samples; score -1..1
    kSad  // mean-removed absolute difference; score 1 - mean / 64, at least 0
};
enum class Support {
    kWindow, // the upright square
    kWedge   // only the part of it between the two branches that span the plane
};
enum class Warp {
    kHomography,
    kUnanchored, // as Eq 5.34 is printed: wrong poses shift the window off the corner
    kNone        // upright squares compared as they are
};

struct CorrelateOptions {
    Measure measure = Measure::kVnc;
    Support support = Support::kWindow;
    Warp warp = Warp::kHomography;
    bool with_extra_planes = true; // also a level, a facing and three upright planes through the point
    int window_px = 21;            // side, odd, 7..31
    double gauss_sigma_px = 5;     // of the weights round the apex; 0: all alike
    double smooth_sigma_px = 1;    // of the pixels before sampling; 0: none
    double min_known = 0.6;        // share of the window that both views must know
    double min_contrast = 3;       // standard deviation in grey levels; flatter windows say nothing
    double min_sine = 0.05;        // of the planes of a branch in both views; less: along the epipolar line
    double min_bend_sine = 0.2;    // of the two edges in space that span a plane
    double max_scale = 3;          // of the warp, either way
    double max_stretch = 5;        // ratio of its singular values: no grazing planes
    double coarse_reject = 0.5;    // VNC of a 7 x 7 sample under which a plane is dropped
    int max_fine = 4;              // planes of a candidate that get the full window, best sample first
};

// A plane under which two junctions look alike.
struct Correlation {
    double score = 0; // the worse of left to right and right to left
    oc_plane_t plane{};
};

// Pixels, branches and upright windows of one view with its pose, ready for
// correlation; made once per view and pose, shared by its pairs. The view must
// outlive this. Memory: 4 B per pixel and 2 kB per junction at 21 px.
class PreparedView {
public:
    // Throws std::invalid_argument when view is null, grey or known do not have
    // the camera's size, or options are out of range.
    PreparedView(const PosedView &posed, const CorrelateOptions &options);

    const PosedView &posed() const { return posed_; }
    const oc_junction_t &junction(int index) const { return posed_.view->junctions[index]; }
    const oc_edge3_t *edges(int index) const { return &edges_[static_cast<std::size_t>(index) * OC_MAX_BRANCHES]; }

    // Is enough of the junction's window known, and is it not flat?
    bool is_usable(int index) const { return is_usable_[index] != 0; }

    // Row-major window_px^2 grey values round the apex; negative: unknown.
    const float *patch(int index) const { return &patches_[static_cast<std::size_t>(index) * n_patch_]; }
    // Every third of them (the 7 x 7 sample).
    const float *coarse_patch(int index) const { return &coarse_[static_cast<std::size_t>(index) * kCoarse]; }

    // Of a window's pixels, row-major.
    const std::vector<float> &weights() const { return weights_; }

    // Grey value by bilinear interpolation; negative when one of the four pixels is not known.
    float sample(float x_px, float y_px) const
    {
        const float limit_x = static_cast<float>(grey_.cols - 1);
        const float limit_y = static_cast<float>(grey_.rows - 1);
        if (!(x_px >= 0 && y_px >= 0 && x_px < limit_x && y_px < limit_y)) return -1;
        const int ix = static_cast<int>(x_px);
        const int iy = static_cast<int>(y_px);
        if (is_known_(iy, ix) == 0) return -1;
        const float fx = x_px - static_cast<float>(ix);
        const float fy = y_px - static_cast<float>(iy);
        const float *a = grey_[iy] + ix;
        const float *b = grey_[iy + 1] + ix;
        const float top = a[0] + fx * (a[1] - a[0]);
        const float bottom = b[0] + fx * (b[1] - b[0]);
        return top + fy * (bottom - top);
    }

    static constexpr int kCoarseSide = 7;
    static constexpr int kCoarse = kCoarseSide * kCoarseSide;

private:
    void prepare_pixels(double smooth_sigma_px);
    void prepare_junctions(const CorrelateOptions &options);

    PosedView posed_;
    std::size_t n_patch_;
    cv::Mat1f grey_;     // smoothed over known pixels
    cv::Mat1b is_known_; // the pixel and its right and lower neighbours
    std::vector<oc_edge3_t> edges_;
    std::vector<float> patches_, coarse_, weights_;
    std::vector<char> is_usable_;
};

// Correlates junctions of two prepared views. Cheap to make; read only, so
// threads may share one. Both views must have been prepared with these options.
class Correlator {
public:
    Correlator(const PreparedView &left, const PreparedView &right, const oc_pair_t &pair,
               const CorrelateOptions &options);

    // Best plane of a candidate, tried over all pairs of branches that fit
    // together in space; nothing when no plane is possible or none is alike.
    // About 2 us for a hopeless candidate, 5 us for each plane tried in full.
    std::optional<Correlation> correlate(int left, int right, const Eigen::Vector3d &point) const;

    // Score with a given plane, normally the horizontal one through the point:
    // is this a corner drawn on the ground? Nothing when the plane is degenerate.
    std::optional<double> score_on_plane(int left, int right, const oc_plane_t &plane) const;

private:
    struct Hypothesis;
    using Hypotheses = std::vector<Hypothesis>;

    void add_branch_planes(int left, int right, const Eigen::Vector3d &point, Hypotheses *out) const;
    void add_extra_planes(int left, int right, const Eigen::Vector3d &point, Hypotheses *out) const;
    bool complete(int left, int right, Hypothesis *hypothesis) const;
    double coarse_score(int left, const Hypothesis &hypothesis) const;
    double full_score(int left, int right, const Hypothesis &hypothesis, double to_beat) const;
    std::optional<Correlation> correlate_upright(int left, int right, const Eigen::Vector3d &point) const;

    const PreparedView &left_;
    const PreparedView &right_;
    const oc_pair_t &pair_;
    CorrelateOptions options_;
    Eigen::Vector3d left_centre_, right_centre_;
    std::vector<float> weights_; // of the window
};

// VNC of a junction's upright window with another view under a homography that
// sends the apex where it is to be looked for; nothing when too little is known.
std::optional<double> correlate_warped(const PreparedView &from, int junction, const PreparedView &to,
                                       const double to_from_from[9], const CorrelateOptions &options);

} // namespace outcrop
