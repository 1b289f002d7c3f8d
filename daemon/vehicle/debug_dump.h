/* SPDX-License-Identifier: BSD-3-Clause
 * What the vehicle knows and did not send, for evaluation: junctions.json. */
#ifndef OUTCROP_DAEMON_DEBUG_DUMP_H
#define OUTCROP_DAEMON_DEBUG_DUMP_H

#include <stdbool.h>
#include <stddef.h>

#include "vehicle/vehicle.h"

/* Write folder/junctions.json (made whole, then renamed): every junction of
 * every view still stored, with its label and confidence. False and one line
 * in error when it cannot be written. */
bool oc_debug_dump(const oc_vehicle_t *vehicle, const char *folder, char *error, size_t error_bytes);

#endif
