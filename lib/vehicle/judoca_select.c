/* SPDX-License-Identifier: BSD-3-Clause
 * Which of the junctions found the detector reports. */
#include "vehicle/judoca_select.h"

#include <math.h>
#include <string.h>

/* The k-th junction of a cell competes with score / (1 + k * CROWDING). */
#define CROWDING 0.3f

/* Junctions that a cell gets when all are alike. */
#define CELL_SHARE 2.0f

/* Least strength of a corner as a share of t_b. */
#define CORNER_FLOOR 0.5f

/* A corner this near to a junction is the same point of the scene. */
#define SAME_POINT_PX 1.0f

/* Side of an owner square. */
#define SQUARE_PX 8u

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

static uint32_t owner_columns(uint32_t width_px)
{
    return (width_px + SQUARE_PX - 1u) / SQUARE_PX;
}

size_t oc_judoca_owner_squares(uint32_t width_px, uint32_t height_px)
{
    return (size_t)owner_columns(width_px) * ((height_px + SQUARE_PX - 1u) / SQUARE_PX);
}

static void owner_clear(const oc_judoca_ws_t *ws)
{
    memset(ws->owner, 0, oc_judoca_owner_squares(ws->gradient.width_px, ws->gradient.height_px) * sizeof ws->owner[0]);
}

static void owner_add(const oc_judoca_ws_t *ws, uint32_t index)
{
    const oc_junction_t *j = &ws->found[index];
    uint16_t *owner = &ws->owner[(uint32_t)j->y_px / SQUARE_PX * owner_columns(ws->gradient.width_px) +
                                 (uint32_t)j->x_px / SQUARE_PX];
    ws->next[index] = *owner;
    *owner = (uint16_t)(index + 1u);
}

static bool is_in_image(const oc_gradient_t *g, const oc_junction_t *j)
{
    return j->x_px >= 0.0f && j->y_px >= 0.0f && j->x_px <= (float)(g->width_px - 1u) &&
           j->y_px <= (float)(g->height_px - 1u);
}

/* The best on the owner map within the distance, NULL when there is none. */
static oc_junction_t *owner_best_near(const oc_judoca_ws_t *ws, const oc_junction_t *j, float limit)
{
    const int32_t cols = (int32_t)owner_columns(ws->gradient.width_px);
    const int32_t rows = (int32_t)owner_columns(ws->gradient.height_px);
    const int32_t reach = (int32_t)limit / (int32_t)SQUARE_PX + 1;
    const int32_t col = (int32_t)j->x_px / (int32_t)SQUARE_PX, row = (int32_t)j->y_px / (int32_t)SQUARE_PX;
    oc_junction_t *best = NULL;
    for (int32_t y = row > reach ? row - reach : 0; y <= row + reach && y < rows; y++) {
        for (int32_t x = col > reach ? col - reach : 0; x <= col + reach && x < cols; x++) {
            for (uint32_t i = ws->owner[y * cols + x]; i != 0; i = ws->next[i - 1u]) {
                oc_junction_t *other = &ws->found[i - 1u];
                const float ex = other->x_px - j->x_px, ey = other->y_px - j->y_px;
                const bool is_near = ex * ex + ey * ey < limit * limit;
                if (is_near && (!best || other->score > best->score)) best = other;
            }
        }
    }
    return best;
}

void oc_judoca_add_corners(oc_judoca_ws_t *ws)
{
    const uint32_t n_junctions = ws->stats.n_found, room = OC_JUDOCA_MAX_FOUND - n_junctions;
    oc_junction_t *corner = ws->found + n_junctions;
    const uint32_t n = oc_corner_find(&ws->corner, &ws->gradient, CORNER_FLOOR * ws->stats.t_b, corner,
                                      ws->params.max_corners < room ? ws->params.max_corners : room);
    owner_clear(ws);
    for (uint32_t i = 0; i < n_junctions; i++) {
        if (is_in_image(&ws->gradient, &ws->found[i])) owner_add(ws, i);
    }
    uint32_t kept = 0;
    for (uint32_t i = 0; i < n; i++) {
        oc_junction_t *near = owner_best_near(ws, &corner[i], SAME_POINT_PX);
        if (!near) {
            corner[kept++] = corner[i];
        } else if (near->score < corner[i].score) {
            near->score = corner[i].score;
        }
    }
    ws->stats.n_corners = kept;
    ws->stats.n_found += kept;
}

/* Keep the ranked junctions that are inside the image and not near a better one. */
static uint32_t select_dedupe(oc_judoca_ws_t *ws, uint32_t n)
{
    owner_clear(ws);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t index = ws->rank[i].index;
        const oc_junction_t *j = &ws->found[index];
        if (!is_in_image(&ws->gradient, j) || owner_best_near(ws, j, ws->params.min_distance_px)) continue;
        owner_add(ws, index);
        ws->rank[kept++] = ws->rank[i];
    }
    return kept;
}

/* Lower the key of the later junctions of a crowded cell and sort again. */
static void select_spread(oc_judoca_ws_t *ws, uint32_t n, uint32_t limit)
{
    /* Cells of which each may have some: two, were they all alike. */
    const float area = (float)ws->gradient.width_px * (float)ws->gradient.height_px;
    const uint32_t fair = (uint32_t)sqrtf(CELL_SHARE * area / (float)(limit > 0 ? limit : 1u));
    const uint32_t side = fair > ws->params.spread_cell_px ? fair : ws->params.spread_cell_px;
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
        select_spread(ws, n, limit);
        n = limit;
        for (uint32_t i = 0; i < n; i++) ws->rank[i].key = ws->found[ws->rank[i].index].score;
        rank_sort(ws->rank, n);
    }
    ws->stats.n_dropped = ws->stats.n_found - n;
    for (uint32_t i = 0; i < n; i++) out[i] = ws->found[ws->rank[i].index];
    return n;
}
