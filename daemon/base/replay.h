// SPDX-License-Identifier: BSD-3-Clause
// outcrop-base replay: the session on a captured log; the same packets give the same model as live.
#pragma once

#include <optional>
#include <string>

#include "output.h"

namespace outcrop {

struct ReplayOptions {
    std::string log;
    OutputOptions output;
    std::optional<Area> area;
    int vehicle = -1;
};

// Throws std::runtime_error with one line; then nothing of the run's folder was written.
void run_replay(const ReplayOptions &options, const Progress &progress);

} // namespace outcrop
