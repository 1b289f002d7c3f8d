// SPDX-License-Identifier: BSD-3-Clause
// The folder of a run: model, matches, overhead map, sequence and report.
#pragma once

#include <functional>
#include <string>

#include "ledger.h"
#include "session.h"

namespace outcrop {

struct OutputOptions {
    std::string dir;
    std::string represent = "boxes"; // "boxes", "voxels" or "none"
    bool with_textures = true;       // colour for voxels
    std::string path;                // path file; empty: a loop round the obstacles
    std::string method = "best";
};

// What the report says besides the session: counts of what the receiver dropped.
struct ReceiveCounts {
    std::uint64_t ill_formed = 0, foreign = 0, garbage_bytes = 0;
    bool is_log_cut = false;
};

using Progress = std::function<void(const std::string &)>;

// What can be said before anything is computed: that a path file is one.
// Throws std::runtime_error with one line.
void check_output(const OutputOptions &options);

// Settle the session and write everything but link.lcm. Each file appears
// whole or not at all. Throws std::runtime_error with one line.
void write_output(Session &session, const Ledger &ledger, const ReceiveCounts &received, const OutputOptions &options,
                  const Progress &progress);

// Options of a session for a method, "best" or "thesis", and a representation.
SessionOptions session_options(const OutputOptions &options);

} // namespace outcrop
