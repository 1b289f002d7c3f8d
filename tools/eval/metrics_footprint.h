/* SPDX-License-Identifier: BSD-3-Clause
 * Does the ground map ever show an obstacle's ground as free? */
#ifndef OUTCROP_EVAL_METRICS_FOOTPRINT_H
#define OUTCROP_EVAL_METRICS_FOOTPRINT_H

#include "run.h"
#include "truth.h"

#include <optional>

namespace outcrop::eval {

struct FootprintMetrics {
    double cell_m = 0;
    std::optional<double> covered;     /* share of the footprint that is not shown as free */
    double false_free_m2 = 0;          /* area of the footprint shown as free */
    std::optional<double> free_recall; /* share of free ground seen by two views or more shown as free */
};

/* On cells of 20 mm where the area's longer side is over 3 m, else 3 mm. The
 * footprint is the true meshes seen from above; cells within one cell of its
 * outline are left out. What lies outside ground.png is unseen. Free ground is
 * seen by a view of the run when no true obstacle hides it there. */
std::optional<FootprintMetrics> evaluate_footprint(const Truth &truth, const Run &run, Notes &notes);

} // namespace outcrop::eval
#endif
