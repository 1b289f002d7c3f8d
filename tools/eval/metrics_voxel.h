/* SPDX-License-Identifier: BSD-3-Clause
 * How well the carved volume fills the true one. */
#ifndef OUTCROP_EVAL_METRICS_VOXEL_H
#define OUTCROP_EVAL_METRICS_VOXEL_H

#include "metrics_box.h"
#include "run.h"
#include "truth.h"

#include <optional>
#include <vector>

namespace outcrop::eval {

struct VoxelMetric {
    int truth = 0;
    double iou = 0;
    std::optional<double> chamfer_m; /* mean of the two mean surface distances */
    std::optional<double> hull_iou;  /* of the hull carved from the true masks, same grid */
};

/* For each found obstacle given to a true one that has model/K.voxels.ply:
 * cells of its own grid against the cells whose centre lies inside the true
 * mesh. The surface is model/K.ply, or the voxels' outer faces without it. The
 * hull takes every view of known depth; a view that another obstacle hides the
 * cell from does not carve it. Nothing when the run has no voxels. */
std::optional<std::vector<VoxelMetric>> evaluate_voxels(const Truth &truth, const Run &run, const BoxMetrics &boxes,
                                                        Notes &notes);

} // namespace outcrop::eval
#endif
