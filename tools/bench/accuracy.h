/* SPDX-License-Identifier: BSD-3-Clause
 * Place and angle of the detectors on scenes whose junctions are known exactly. */
#ifndef OUTCROP_BENCH_ACCURACY_H
#define OUTCROP_BENCH_ACCURACY_H

#include "target.h"

#include <map>
#include <string>
#include <vector>

namespace outcrop::bench {

/* What is done to our detector's answers before they are judged: proof that the bench sees it. */
struct Damage {
    double shift_px = 0; /* to the right */
    double turn_deg = 0; /* of every second branch */
    int drop_every = 0;  /* one in so many is lost */
};

struct AccuracyOptions {
    std::vector<std::string> sets;
    std::vector<int> variances, lambdas;
    int draw = 0;
    bool is_quick = false, has_rivals = true, is_checked = false;
    Damage damage;
};

struct AccuracyRow {
    std::string set;
    int variance;
    std::string method; /* fixed, grown, grown-auto, thesis, gftt+subpix; bound: what noise allows */
    int lambda_px;      /* 0 where it means nothing */
    std::map<std::string, double> figures;
    std::vector<Verdict> verdicts;
};

std::vector<AccuracyRow> measure_accuracy(const AccuracyOptions &options);

std::string to_table(const std::vector<AccuracyRow> &rows);
nlohmann::json to_json(const std::vector<AccuracyRow> &rows);

} // namespace outcrop::bench
#endif
