/* SPDX-License-Identifier: BSD-3-Clause
 * What the bench's figures are held to. */
#ifndef OUTCROP_BENCH_TARGET_H
#define OUTCROP_BENCH_TARGET_H

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace outcrop::bench {

/* One limit on one figure of one row of a table. */
struct Target {
    std::string figure;
    bool is_floor; /* the figure is to be at least the limit, else at most */
    double limit;
    int number; /* of the list of targets in docs/measurements.md; 0 = a gate, what may not be lost again */
};

/* Held against a row's figures; a figure that is not there misses its target. */
struct Verdict {
    Target target;
    bool is_known, is_met;
    double value;
};
std::vector<Verdict> judge(const std::vector<Target> &targets, const std::map<std::string, double> &figures);

/* Several in one line: "rmse_px <= 0.42: met; recall >= 0.99: 0.012 short". */
std::string to_text(const std::vector<Verdict> &verdicts);
nlohmann::json to_json(const std::vector<Verdict> &verdicts);

/* Targets of the accuracy bench for branches of one length; empty where none is set. */
std::vector<Target> accuracy_targets(const std::string &set, int variance, int lambda_px);

/* What `accuracy --quick --check` demands: looser than the targets and always to be met. */
std::vector<Target> accuracy_gates(const std::string &set, int variance, int lambda_px);

/* For our detector's share of points found again. */
std::vector<Target> repeatability_targets(const std::string &set, const std::string &warp);

} // namespace outcrop::bench
#endif
