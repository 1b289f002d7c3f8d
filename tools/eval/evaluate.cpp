// SPDX-License-Identifier: BSD-3-Clause
// Reads both folders and holds one against the other.
#include "report.h"

namespace outcrop::eval {

Report evaluate(const std::filesystem::path &site, const std::filesystem::path &dir, Notes &notes)
{
    const Truth truth = read_truth(site, notes);
    const Run run = read_run(dir, truth.views.size(), notes);
    Report report;
    report.matches = evaluate_matches(truth, run, notes);
    report.ground = evaluate_ground(truth, run, notes);
    report.boxes = evaluate_boxes(truth, run);
    if (report.boxes) report.voxels = evaluate_voxels(truth, run, *report.boxes, notes);
    report.poses = evaluate_poses(truth, run, notes);
    report.sequences = evaluate_sequences(truth, run, report.boxes, notes);
    report.footprint = evaluate_footprint(truth, run, notes);
    report.bytes = run.bytes;
    return report;
}

} // namespace outcrop::eval
