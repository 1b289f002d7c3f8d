// SPDX-License-Identifier: BSD-3-Clause
// Refinement of all poses at once: bundle adjustment with the sensors' margins as priors and the ground at Z = 0.
#pragma once

#include <vector>

#include "site/site_model.h"
#include "site/tracks.h"

namespace outcrop {

struct RefineOptions {
    double sigma_px = 0.7;       // of a pixel coordinate; scale of the loss
    double loss_sigmas = 2.0;    // Cauchy's scale in sigmas
    double reject_sigmas = 4.0;  // sightings with larger residuals leave before the second solve
    double ground_sigma_m = 0;   // 0: ground points have no Z at all; else Z / sigma is a residual
    double tie_merge_px = 1.0;   // ties nearer than this in one view are one point
    double exact_sigma = 1e-6;   // a margin below it (metres, radians) is exact: the parameter's view is held
    int max_iterations = 40;     // per solve
    int min_sightings = 6;       // a view with fewer keeps the sensor's pose
    int sightings_per_view = 80; // of the ground and of obstacles each that are enough: points seen most often come
                                 // first, others only while a view of theirs has fewer. 0: all
    bool use_ties = true;
    bool use_tracks = true;
    void check() const; // throws std::invalid_argument
};

struct RefineResult {
    std::vector<RefinedView> views;             // one per view, same order
    std::vector<Matrix6d> pose_covariances;     // posterior of (centre, rotation vector), gauge included
    std::vector<Matrix6d> relative_covariances; // the same without what moves all cameras alike (X, Y, yaw):
                                                // what matching and consistency between views need
    // Half-widths for the next matching pass, from relative_covariances; the angles are turns about the camera's own
    // axes (OC_ANGLE_ERROR_LOCAL).
    std::vector<oc_margin_t> matching_margins;
    int n_ground = 0, n_points = 0; // tracks in the last solve
    int n_rejected = 0;             // sightings left out
    int n_ground_sightings = 0;     // of the first solve ...
    int n_ground_rejected = 0;      // ... and those of them that were left out: a flat ground does not explain them
    // Of the sightings of the last solve, at the sensor's and at the final poses.
    double rms_before_px = 0, rms_after_px = 0;
};

// Parameters: per view the centre (3) and a local rotation vector (3); per obstacle track a point (3); per ground
// track and merged tie a point of the plane (2). Priors: margins as uniform half-widths a, sigma = a / sqrt(3),
// omega-phi-kappa carried over to the rotation vector. Robust loss, one rejection, second solve (in the spirit of
// thesis 5.5 "updating the projection matrices"; why not through F: docs/design.md).
//
// views ascending by id; ties to views that are not there are ignored. When every margin of a view is below
// exact_sigma its pose is returned untouched. is_improved is true when the view's own residuals fell and the
// posterior of its pose is smaller than the prior. Single thread, deterministic. 14 views with 500 points: < 0.3 s.
RefineResult refine_poses(const std::vector<View> &views, const std::vector<Track> &tracks,
                          const RefineOptions &options = {});

} // namespace outcrop
