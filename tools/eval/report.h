/* SPDX-License-Identifier: BSD-3-Clause
 * All figures of one run, and how they are shown. */
#ifndef OUTCROP_EVAL_REPORT_H
#define OUTCROP_EVAL_REPORT_H

#include "metrics_box.h"
#include "metrics_footprint.h"
#include "metrics_match.h"
#include "metrics_pose.h"
#include "metrics_sequence.h"
#include "metrics_voxel.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace outcrop::eval {

/* What is empty could not be judged; the notes say why. */
struct Report {
    std::optional<ShareMetric> matches, ground;
    std::optional<BoxMetrics> boxes;
    std::optional<std::vector<VoxelMetric>> voxels;
    std::optional<PoseMetrics> poses;
    std::optional<Sequences> sequences;
    std::optional<FootprintMetrics> footprint;
    std::optional<Json> bytes;
};

/* Reads both folders and holds one against the other. Throws EvalError. */
Report evaluate(const std::filesystem::path &site, const std::filesystem::path &dir, Notes &notes);

/* The keys of docs/operating.md, section 8 (outcrop-eval --json); null for what is empty. */
nlohmann::ordered_json to_json(const Report &report);

/* The same as aligned text. */
std::string to_table(const Report &report);

} // namespace outcrop::eval
#endif
