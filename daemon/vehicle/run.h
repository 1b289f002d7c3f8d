/* SPDX-License-Identifier: BSD-3-Clause
 * The daemon's loop: frames in, packets out, requests answered.
 *
 * One thread owns the vehicle and the way of a frame, from the camera's buffer
 * to the packet on the link; after the start it never allocates. Receiving,
 * tile encoding, opening cameras and the GPIO lines have threads of their own. */
#ifndef OUTCROP_DAEMON_RUN_H
#define OUTCROP_DAEMON_RUN_H

#include <stdbool.h>
#include <stddef.h>

#include "config.h"

/* Run until SIGTERM or SIGINT. SIGHUP is ignored and said so once; SIGUSR1 is
 * a mark, as the input of that name. False and one line in error when
 * something could not be set up or the link failed. */
bool oc_run(const oc_config_t *config, char *error, size_t error_bytes);

/* What --check does beyond reading the file: open a site folder and read all
 * of it; cameras and lines are left alone. Prints a summary. */
bool oc_run_check(const oc_config_t *config, char *error, size_t error_bytes);

#endif
