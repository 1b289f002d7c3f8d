/* SPDX-License-Identifier: BSD-3-Clause
 * Where true matches are lost on the way, and what the wrong ones are. */
#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "judge.h"
#include "site/model.h"
#include "site_case.h"

namespace outcrop::bench {

/* Junctions of left views on true obstacles, over all pairs; each count is a part of the one before it. */
struct Funnel {
    int visible = 0;    /* truly seen by the right view */
    int detected = 0;   /* the right view has a junction within 3 px of where it is seen */
    int candidate = 0;  /* ... and the strip holds it */
    int correlated = 0; /* some plane makes the two alike at all */
    int alike = 0;      /* by min_score or more */
    int best = 0;       /* the best of both, by the margin: a match at right poses */

    void add(const Funnel &other);
};

/* Strips of the true poses with margins of a tenth of the site's, which is about what refinement leaves. */
Funnel measure_funnel(const SiteCase &site, const PairOptions &pairs, const MatchOptions &options);

/* Obstacle matches that are wrong, by what is true of them. */
struct WrongMatches {
    int near_px = 0;  /* 3 to 10 px off: a neighbour, or the corner ill placed */
    int far_px = 0;   /* further */
    int hidden = 0;   /* the left point is not seen by the right view: no partner was right */
    int no_depth = 0; /* nothing true at the left pixel */
};
WrongMatches sort_wrong(const SiteCase &site, const std::vector<PixelMatch> &matches);

nlohmann::ordered_json to_json(const Funnel &funnel);
nlohmann::ordered_json to_json(const WrongMatches &wrong);

} // namespace outcrop::bench
