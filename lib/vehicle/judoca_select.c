/* SPDX-License-Identifier: BSD-3-Clause
 * Which places the junction detector fits, and which junctions it reports. */
#include "vehicle/judoca_select.h"

#include <string.h>

/* The k-th junction of a cell competes with score / (1 + k * CROWDING). */
#define CROWDING 0.15f

/* Prescores are at most this (9 sums of 7001). */
#define MAX_SUM 63009u
#define SUM_BINS 1024u

/* Sum over 3x3: the middle of a cluster of strong places beats its rim. */
static uint32_t select_sum(const uint16_t *at, int32_t pitch)
{
    uint32_t sum = 0;
    for (int32_t dy = -1; dy <= 1; dy++) {
        const uint16_t *row = at + dy * pitch;
        sum += (uint32_t)row[-1] + row[0] + row[1];
    }
    return sum;
}

/* The first in reading order wins a tie. */
static bool select_is_peak(const uint16_t *at, int32_t pitch, int32_t radius, uint32_t sum)
{
    for (int32_t dy = -radius; dy <= radius; dy++) {
        for (int32_t dx = -radius; dx <= radius; dx++) {
            const uint16_t *other = at + dy * pitch + dx;
            if (other == at || *other == 0) continue;
            const uint32_t theirs = select_sum(other, pitch);
            if (theirs > sum || (theirs == sum && other < at)) return false;
        }
    }
    return true;
}

/* Visit every place that qualifies; count it per bin, or store it when its bin is high enough. */
static uint32_t select_scan(oc_judoca_ws_t *ws, int32_t radius, uint32_t histogram[], uint32_t lowest_bin, uint32_t cap)
{
    const int32_t pitch = ws->map_pitch;
    uint32_t n = 0;
    for (uint32_t y = 0; y < ws->gradient.height_px; y++) {
        const int32_t start = ((int32_t)y + ws->map_border) * pitch + ws->map_border;
        for (uint32_t x = 0; x < ws->gradient.width_px; x++) {
            const uint16_t *at = ws->prescore + start + x;
            if (*at == 0) continue;
            const uint32_t sum = radius > 0 ? select_sum(at, pitch) : 9u * *at;
            const uint32_t bin = sum * (SUM_BINS - 1u) / MAX_SUM;
            if (bin < lowest_bin || !select_is_peak(at, pitch, radius, sum)) continue;
            if (histogram) histogram[bin]++;
            if (!histogram && n < cap) ws->place[n] = (uint32_t)start + x;
            n++;
        }
    }
    return n < cap ? n : cap;
}

void oc_judoca_pick(oc_judoca_ws_t *ws, int32_t radius)
{
    OC_ASSERT(ws && ws->prescore);

    uint32_t histogram[SUM_BINS] = {0};
    ws->stats.n_places = select_scan(ws, radius, histogram, 0, UINT32_MAX);

    /* Lowest bin that still fits; a bin that does not is left out whole, so
     * the choice does not depend on where in the image a place lies. */
    uint32_t bin = SUM_BINS;
    uint32_t n = 0;
    while (bin > 0 && n + histogram[bin - 1] <= ws->params.max_candidates) n += histogram[--bin];
    ws->stats.n_fitted = select_scan(ws, radius, NULL, bin, ws->params.max_candidates);
}

static bool rank_before(const oc_judoca_rank_t *a, const oc_judoca_rank_t *b)
{
    return a->key > b->key || (a->key == b->key && a->index < b->index);
}

static void rank_sink(oc_judoca_rank_t rank[], uint32_t n, uint32_t at)
{
    for (;;) {
        uint32_t last = at;
        for (uint32_t child = 2u * at + 1u; child < n && child <= 2u * at + 2u; child++) {
            if (rank_before(&rank[last], &rank[child])) last = child;
        }
        if (last == at) return;
        const oc_judoca_rank_t swap = rank[at];
        rank[at] = rank[last];
        rank[last] = swap;
        at = last;
    }
}

/* Heap sort, best first: no recursion and no memory of its own. */
static void rank_sort(oc_judoca_rank_t rank[], uint32_t n)
{
    for (uint32_t i = n / 2u; i > 0; i--) rank_sink(rank, n, i - 1u);
    for (uint32_t end = n; end > 1; end--) {
        const oc_judoca_rank_t swap = rank[0];
        rank[0] = rank[end - 1u];
        rank[end - 1u] = swap;
        rank_sink(rank, end - 1u, 0);
    }
}

/* Is a better junction, already on the owner map, within the distance? */
static bool select_is_near(const oc_judoca_ws_t *ws, const oc_junction_t *j, uint16_t *at)
{
    const float limit = ws->params.min_distance_px;
    const int32_t reach = (int32_t)limit + 1;
    for (int32_t dy = -reach; dy <= reach; dy++) {
        for (int32_t dx = -reach; dx <= reach; dx++) {
            const uint32_t owner = at[dy * ws->map_pitch + dx];
            if (owner == 0) continue;
            const float ex = ws->found[owner - 1u].x_px - j->x_px;
            const float ey = ws->found[owner - 1u].y_px - j->y_px;
            if (ex * ex + ey * ey < limit * limit) return true;
        }
    }
    return false;
}

/* Keep the ranked junctions that are inside the image and not near a better one. */
static uint32_t select_dedupe(oc_judoca_ws_t *ws, uint32_t n)
{
    const oc_gradient_t *g = &ws->gradient;
    const size_t rows = g->height_px + 2u * (size_t)ws->map_border;
    memset(ws->prescore, 0, rows * (size_t)ws->map_pitch * sizeof ws->prescore[0]);

    uint32_t kept = 0;
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t index = ws->rank[i].index;
        const oc_junction_t *j = &ws->found[index];
        if (!(j->x_px >= 0.0f && j->y_px >= 0.0f && j->x_px <= (float)(g->width_px - 1u) &&
              j->y_px <= (float)(g->height_px - 1u))) {
            continue;
        }
        const int32_t x = (int32_t)(j->x_px + 0.5f) + ws->map_border;
        const int32_t y = (int32_t)(j->y_px + 0.5f) + ws->map_border;
        uint16_t *at = ws->prescore + y * ws->map_pitch + x;
        if (select_is_near(ws, j, at)) continue;
        *at = (uint16_t)(index + 1u);
        ws->rank[kept++] = ws->rank[i];
    }
    return kept;
}

/* Lower the key of the later junctions of a crowded cell and sort again. */
static void select_spread(oc_judoca_ws_t *ws, uint32_t n)
{
    const uint32_t side = ws->params.spread_cell_px;
    const uint32_t cols = (ws->gradient.width_px - 1u) / side + 1u;
    const uint32_t rows = (ws->gradient.height_px - 1u) / side + 1u;
    memset(ws->cell, 0, (size_t)cols * rows * sizeof ws->cell[0]);
    for (uint32_t i = 0; i < n; i++) {
        const oc_junction_t *j = &ws->found[ws->rank[i].index];
        uint16_t *cell = &ws->cell[(uint32_t)j->y_px / side * cols + (uint32_t)j->x_px / side];
        ws->rank[i].key /= 1.0f + CROWDING * (float)*cell;
        (*cell)++;
    }
    rank_sort(ws->rank, n);
}

uint32_t oc_judoca_select(oc_judoca_ws_t *ws, oc_junction_t out[], uint32_t cap)
{
    OC_ASSERT(ws && ws->rank && (out || cap == 0));

    uint32_t n = ws->stats.n_found;
    for (uint32_t i = 0; i < n; i++) ws->rank[i] = (oc_judoca_rank_t){ws->found[i].score, i};
    rank_sort(ws->rank, n);
    n = select_dedupe(ws, n);

    ws->stats.n_found = n;
    const uint32_t limit = cap < ws->params.max_junctions ? cap : ws->params.max_junctions;
    if (n > limit) {
        select_spread(ws, n);
        n = limit;
        for (uint32_t i = 0; i < n; i++) ws->rank[i].key = ws->found[ws->rank[i].index].score;
        rank_sort(ws->rank, n);
    }
    ws->stats.n_dropped = ws->stats.n_found - n;
    for (uint32_t i = 0; i < n; i++) out[i] = ws->found[ws->rank[i].index];
    return n;
}
