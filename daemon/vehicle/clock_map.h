/* SPDX-License-Identifier: BSD-3-Clause
 * Monotonic time to UTC: the two clocks read together, once a second. */
#ifndef OUTCROP_DAEMON_CLOCK_MAP_H
#define OUTCROP_DAEMON_CLOCK_MAP_H

#include <stdbool.h>
#include <stdint.h>

typedef struct oc_clock_map {
    bool is_set;
    int64_t offset_ns;      /* UTC - monotonic */
    int64_t uncertainty_ns; /* half of what the readings took */
    int64_t read_ns;        /* monotonic, when it was read */
} oc_clock_map_t;

/* Reads both clocks (a seam for tests; NULL = the system's): monotonic before, UTC, monotonic after. */
typedef void (*oc_clock_read_t)(int64_t *before_ns, int64_t *utc_ns, int64_t *after_ns);

/* Read the clocks when the last reading is a second old: the tightest of a few
 * tries. True when UTC has stepped by more than step_limit_ns since (somebody
 * set the clock; a slewing one never does). */
bool oc_clock_map_update(oc_clock_map_t *map, int64_t now_ns, int64_t step_limit_ns, oc_clock_read_t read);

/* UTC microseconds of a monotonic time. The map must be set. */
int64_t oc_clock_map_utime_us(const oc_clock_map_t *map, int64_t mono_ns);

/* CLOCK_MONOTONIC now. */
int64_t oc_mono_ns(void);

#endif
