// SPDX-License-Identifier: BSD-3-Clause
// Asking a vehicle for the views of a stretch of time, held back or not.
#pragma once

#include <cstdint>
#include <string>

#include "config.h"
#include "core/packet.h"

namespace outcrop {

// "2026-01-31T12:00:00Z", with a fraction of a second if wanted, or microseconds since 1970. Throws std::runtime_error.
std::int64_t parse_utc(const std::string &text);

struct RecallOptions {
    int n_tries = 5;
    int wait_ms = 2000; // for an answer to each try
};

// Send the request on the up link and wait until a view of that time comes; again when none does. A base that runs
// beside this hears the views as well. Returns how many packets of such views came. Throws std::runtime_error when the
// link cannot be opened or nothing came.
int send_recall(const oc_base_config_t &config, const oc_recall_request_t &request, const RecallOptions &options);

} // namespace outcrop
