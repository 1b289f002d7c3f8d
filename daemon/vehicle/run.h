/* SPDX-License-Identifier: BSD-3-Clause
 * The vehicle's loop: frames in, packets out, requests answered, until a signal. */
#ifndef OUTCROP_DAEMON_RUN_H
#define OUTCROP_DAEMON_RUN_H

#include <stdbool.h>
#include <stddef.h>

#include "capture.h"
#include "config.h"

/* Run until SIGTERM or SIGINT. False, and one line in error, when something
 * that was needed at start could not be had. */
bool oc_run(const oc_config_t *config, oc_capture_t *capture, char *error, size_t error_bytes);

#endif
