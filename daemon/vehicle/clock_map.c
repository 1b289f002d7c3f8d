/* SPDX-License-Identifier: BSD-3-Clause
 * Two clocks read together. */
#include "clock_map.h"

#include <stdlib.h>
#include <time.h>

#define NS_PER_S 1000000000LL
#define N_TRIES 5

static int64_t read_ns(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return (int64_t)t.tv_sec * NS_PER_S + t.tv_nsec;
}

int64_t oc_mono_ns(void)
{
    return read_ns(CLOCK_MONOTONIC);
}

static void read_system(int64_t *before_ns, int64_t *utc_ns, int64_t *after_ns)
{
    *before_ns = read_ns(CLOCK_MONOTONIC);
    *utc_ns = read_ns(CLOCK_REALTIME);
    *after_ns = read_ns(CLOCK_MONOTONIC);
}

bool oc_clock_map_update(oc_clock_map_t *map, int64_t now_ns, int64_t step_limit_ns, oc_clock_read_t read)
{
    if (map->is_set && now_ns - map->read_ns < NS_PER_S) return false;
    int64_t offset_ns = 0, width_ns = INT64_MAX;
    for (int i = 0; i < N_TRIES; i++) {
        int64_t before_ns, utc_ns, after_ns;
        (read ? read : read_system)(&before_ns, &utc_ns, &after_ns);
        if (after_ns - before_ns >= width_ns) continue;
        width_ns = after_ns - before_ns;
        offset_ns = utc_ns - (before_ns + width_ns / 2);
    }
    const bool is_step = map->is_set && llabs(offset_ns - map->offset_ns) > step_limit_ns;
    *map = (oc_clock_map_t){
        .is_set = true, .offset_ns = offset_ns, .uncertainty_ns = (width_ns + 1) / 2, .read_ns = now_ns};
    return is_step;
}

int64_t oc_clock_map_utime_us(const oc_clock_map_t *map, int64_t mono_ns)
{
    const int64_t utc_ns = mono_ns + map->offset_ns;
    return utc_ns >= 0 ? (utc_ns + 500) / 1000 : 0;
}
