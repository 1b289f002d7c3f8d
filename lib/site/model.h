// SPDX-License-Identifier: BSD-3-Clause
// The way from views to the settled model of a site.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "site/boxes.h"
#include "site/cluster.h"
#include "site/match.h"
#include "site/pairs.h"
#include "site/quality.h"
#include "site/refine.h"
#include "site/site_model.h"
#include "site/suspects.h"
#include "site/tracks.h"
#include "site/view.h"

namespace outcrop {

struct BuildOptions {
    PairOptions pairs;
    MatchOptions match;
    ThirdViewOptions third_views;
    bool with_third_views = true;     // matches of the last pass are checked in other views
    double min_score_to_refine = 0.9; // of matches that only serve to refine the poses (all passes but the last)
    TrackOptions tracks;
    RefineOptions refine;
    ClusterOptions cluster;
    BoxOptions boxes;
    SuspectOptions suspects;
    QualityOptions quality;
    int passes = 2;            // of matching; refinement comes after each but is left out when every pose is exact
    bool ties_first = true;    // refine on the vehicle's ground ties alone before the first pass: narrower strips
    double area_z_share = 1.0; // z_max of a derived area, of the mean camera height
    double area_reach = 8.0;   // a derived area reaches no farther from a camera than this many camera heights
    void check() const;        // throws std::invalid_argument
};

// What one matching pass gets: the views in ascending order of id, with the poses believed now.
struct MatchPass {
    int index = 0;
    bool is_last = false;
    std::vector<PosedView> views;
    oc_angle_error_t angles = OC_ANGLE_ERROR_OPK; // how the margins' angles are meant
    Area area;
};
using Matcher = std::function<std::vector<PairMatches>(const MatchPass &)>;

// Refinement on the ties -> pairs -> sure matches in the posterior's strips -> tracks -> refinement -> all matches in
// the new posterior's strips, checked in third views -> tracks -> refinement -> points -> clusters -> boxes. A pure
// function of the views as a set: they are sorted by id first, sums run in fixed order, one thread. Bit-identical
// between calls (SiteModel::ms apart). area empty: derive_area. Fewer than two views give a model without points. Last comes judge() of quality.h.
// Throws std::invalid_argument for options out of range, ids that appear twice and cameras or margins that are not
// valid.
SiteModel build_site(const std::vector<View> &views, const std::optional<Area> &area, const BuildOptions &options = {});

// The same with another matcher; what build_site and the tests share.
SiteModel build_from_matches(const std::vector<View> &views, const std::optional<Area> &area, const Matcher &matcher,
                             const BuildOptions &options = {});

// The ground that at least two views share: bounding rectangle of the cells of a coarse grid (64 x 64 over all
// footprints) that two or more views see, each no farther than area_reach camera heights; z_max = area_z_share of the
// mean camera height. Without such ground: a square round the cameras' mean centre, two mean heights wide.
Area derive_area(const std::vector<View> &views, const BuildOptions &options = {});

} // namespace outcrop
