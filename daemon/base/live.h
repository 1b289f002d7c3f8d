// SPDX-License-Identifier: BSD-3-Clause
// outcrop-base live: the session on a real link.
#pragma once

#include "config.h"

namespace outcrop {

// Runs until SIGTERM or SIGINT, or until settled when the configuration says
// so. Prints "outcrop-base: ready" once it listens. Writes the run's folder
// whenever the model settles, and link.lcm as packets come and go. Throws
// std::runtime_error with one line.
void run_live(const oc_base_config_t &config);

} // namespace outcrop
