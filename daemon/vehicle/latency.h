/* SPDX-License-Identifier: BSD-3-Clause
 * A histogram of durations: percentiles for ever in fixed memory. */
#ifndef OUTCROP_DAEMON_LATENCY_H
#define OUTCROP_DAEMON_LATENCY_H

#include <stdint.h>

#define OC_LATENCY_BIN_US 100
#define OC_LATENCY_BINS 5000u /* up to half a second; the last takes all that is longer */

/* Zero-initialised. */
typedef struct oc_latency {
    uint64_t n;
    int64_t max_us;
    uint32_t bins[OC_LATENCY_BINS];
} oc_latency_t;

static inline void oc_latency_add(oc_latency_t *latency, int64_t us)
{
    const int64_t bin = us < 0 ? 0 : us / OC_LATENCY_BIN_US;
    latency->bins[bin < (int64_t)OC_LATENCY_BINS ? (uint32_t)bin : OC_LATENCY_BINS - 1u]++;
    latency->n++;
    if (us > latency->max_us) latency->max_us = us;
}

/* The duration that `share` of all do not exceed, as the upper end of its bin; the longest one when that lies
 * beyond the bins, 0 when there is none. */
static inline int64_t oc_latency_percentile_us(const oc_latency_t *latency, double share)
{
    if (latency->n == 0) return 0;
    const double limit = share * (double)latency->n;
    uint64_t sum = 0;
    for (uint32_t i = 0; i + 1u < OC_LATENCY_BINS; i++) {
        sum += latency->bins[i];
        if ((double)sum < limit) continue;
        const int64_t end_us = (int64_t)(i + 1u) * OC_LATENCY_BIN_US;
        return end_us < latency->max_us ? end_us : latency->max_us;
    }
    return latency->max_us;
}

#endif
