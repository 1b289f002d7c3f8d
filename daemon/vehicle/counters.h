/* SPDX-License-Identifier: BSD-3-Clause
 * Counts of what the daemon drops or survives, from any of its threads. */
#ifndef OUTCROP_DAEMON_COUNTERS_H
#define OUTCROP_DAEMON_COUNTERS_H

#include <stdatomic.h>
#include <stdint.h>

#include "core/packet.h"

/* Zero-initialised; published together with the vehicle's own counters. */
typedef struct oc_counters {
    atomic_uint_least32_t n[OC_N_COUNTERS];
} oc_counters_t;

static inline void oc_counters_add(oc_counters_t *counters, oc_counter_t counter, uint32_t n)
{
    atomic_fetch_add_explicit(&counters->n[counter], n, memory_order_relaxed);
}

static inline uint32_t oc_counters_get(const oc_counters_t *counters, oc_counter_t counter)
{
    return atomic_load_explicit(&counters->n[counter], memory_order_relaxed);
}

#endif
