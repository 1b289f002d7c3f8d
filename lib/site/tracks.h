// SPDX-License-Identifier: BSD-3-Clause
// Matches of pairs merged into tracks over all views, and tracks into points.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "site/site_model.h"
#include "site/triangulate.h"
#include "site/view.h"

namespace outcrop {

struct TrackPixel {
    int view = 0;     // index in the list of views, not the id
    int junction = 0; // index in View::junctions
    bool operator<(const TrackPixel &o) const { return view != o.view ? view < o.view : junction < o.junction; }
    bool operator==(const TrackPixel &o) const { return view == o.view && junction == o.junction; }
};

// One corner in space, seen in two or more views, at most once in each.
struct Track {
    std::vector<TrackPixel> pixels; // ascending view
    MatchKind kind = MatchKind::kObstacle;
    double score = 0; // best of its matches
    Triangulated fit; // valid after settle_tracks
    // Fits only loosely, or two views alone say so and no other point is near: a sign that something may stand there,
    // but no match to build on.
    bool is_doubtful = false;
};

struct TrackOptions {
    TriangulateOptions triangulate;
    double max_reprojection_px = 2.0; // of a sighting, on top of what the poses' covariance allows
    double chi = 2.58;                // gate on uncertain poses, in sigmas
    // Of the residuals of a track over what it has to spare (2 n - 3), on top of the same: two sightings always meet
    // halfway, so half of what they miss each other by is seen in each. 0: no such gate.
    double max_unit_px = 1.1;
    double ground_height_m = 0; // t_h: lower points are ground; 0: height_share of the mean camera height
    double height_share = 0.006;
    // A point within so many sigma_Z of Z = 0 is ground as well, unless it is higher than max_ground_height_share of
    // the mean camera height: where its matches call it ground, and where they call it obstacle.
    double ground_sigmas = 2.58;
    double obstacle_sigmas = 1.0;
    double max_ground_height_share = 0.03;
    double area_slack = 0.02;      // of the area's diagonal; points farther outside are dropped
    double max_sigma_share = 0.05; // of the area's diagonal; less certain points are dropped
    double lonely_share = 0.03;    // of the area's diagonal: a point of two views without another so near is in doubt
    void check() const;
};

// Merge by union-find over (view, junction), best supported match first (closed triangles, then score): a match
// that would put two junctions of one view into a track is left out. Deterministic, whatever the order of pairs.
// kind is what most of the matches say, ground on a tie. views: ascending id.
std::vector<Track> merge_tracks(const std::vector<View> &views, const std::vector<PairMatches> &pairs,
                                std::map<std::string, double> *counts = nullptr);

// Triangulate with the given cameras; leave out sightings that do not fit (worst first, while two remain), drop
// tracks that are not consistent, below ground, behind a camera, without parallax or outside the area; decide
// ground or obstacle from the height. pose_covariances may be empty (exact poses), else one per view.
std::vector<Track> settle_tracks(const std::vector<View> &views, const std::vector<oc_camera_t> &cameras,
                                 const std::vector<Matrix6d> &pose_covariances, const std::vector<Track> &tracks,
                                 const Area &area, const TrackOptions &options,
                                 std::map<std::string, double> *counts = nullptr);

// t_h in metres as the options and the cameras' heights say.
double ground_height(const std::vector<oc_camera_t> &cameras, const TrackOptions &options);

} // namespace outcrop
