/* SPDX-License-Identifier: BSD-3-Clause
 * JUDOCA: gradient, bit-parallel search for places, sub-pixel fit, choice. */
#include "vehicle/judoca.h"

#include <math.h>
#include <string.h>

#include "vehicle/judoca_fit.h"
#include "vehicle/judoca_select.h"
#include "vehicle/judoca_thesis.h"

/* The first look's directions are rough: it calls a line only what bends less than this share of min_bend_rad. */
#define FIRST_BEND_SHARE 0.7

/* Cosine of the least bend of two seeds, 17 degrees. */
#define COARSE_COS_BEND 0.956f

oc_judoca_params_t oc_judoca_defaults(void)
{
    return (oc_judoca_params_t){
        .sigma_px = 1.2f,
        .t_b = 6.0f,
        .t_b_noise_k = 5.0f,
        .s_j = 0.6f,
        .lambda_px = 10,
        .lambda_min_px = 6,
        .min_angle_rad = 0.26f,
        .min_bend_rad = 0.26f,
        .max_rms_px = 0.6f,
        .max_apex_sigma_px = 1.0f,
        .min_distance_px = 3.0f,
        .max_junctions = 600,
        .max_corners = 0,
        .max_candidates = 0,
        .spread_cell_px = 40,
        .method = OC_JUDOCA_REFINED,
        .simd = OC_SIMD_AUTO,
    };
}

static bool in_range(float value, float low, float high)
{
    return value >= low && value <= high;
}

bool oc_judoca_params_are_valid(const oc_judoca_params_t *p)
{
    OC_ASSERT(p);

    return in_range(p->sigma_px, OC_GRADIENT_MIN_SIGMA_PX, OC_GRADIENT_MAX_SIGMA_PX) &&
           (p->t_b == 0.0f || in_range(p->t_b, 0.5f, 100.0f)) && in_range(p->t_b_noise_k, 1.0f, 20.0f) &&
           in_range(p->s_j, 0.3f, 1.0f) && p->lambda_px >= 6 && p->lambda_px <= OC_JUDOCA_MAX_LAMBDA_PX &&
           p->lambda_min_px >= 4 && p->lambda_min_px <= p->lambda_px && in_range(p->min_angle_rad, 0.1f, 1.0f) &&
           in_range(p->min_bend_rad, 0.05f, 1.0f) && in_range(p->max_rms_px, 0.1f, 2.0f) &&
           in_range(p->max_apex_sigma_px, 0.1f, 3.0f) && in_range(p->min_distance_px, 1.0f, 20.0f) &&
           p->max_junctions >= 1 && p->max_junctions <= OC_MAX_JUNCTIONS && p->max_corners <= OC_MAX_JUNCTIONS &&
           (p->max_candidates == 0 || p->max_candidates >= 16) && p->max_candidates <= OC_JUDOCA_MAX_CANDIDATES &&
           p->spread_cell_px >= 8 && p->spread_cell_px <= OC_MAX_IMAGE_SIDE &&
           (p->method == OC_JUDOCA_REFINED || p->method == OC_JUDOCA_THESIS) &&
           (uint32_t)p->simd <= (uint32_t)OC_SIMD_AVX2;
}

/* ---- memory ---- */

typedef struct judoca_pieces {
    size_t done, found, rank, next, owner, cell; /* bytes */
} judoca_pieces_t;

static judoca_pieces_t judoca_measure(uint32_t width_px, uint32_t height_px, const oc_judoca_params_t *params)
{
    const size_t cols = (width_px - 1u) / params->spread_cell_px + 1u;
    const size_t rows = (height_px - 1u) / params->spread_cell_px + 1u;
    return (judoca_pieces_t){
        .done = oc_bitmap_words(width_px, height_px) * sizeof(uint64_t),
        .found = OC_JUDOCA_MAX_FOUND * sizeof(oc_junction_t),
        .rank = OC_JUDOCA_MAX_FOUND * sizeof(oc_judoca_rank_t),
        .next = OC_JUDOCA_MAX_FOUND * sizeof(uint16_t),
        .owner = oc_judoca_owner_squares(width_px, height_px) * sizeof(uint16_t),
        .cell = cols * rows * sizeof(uint16_t),
    };
}

size_t oc_judoca_size_bytes(uint32_t width_px, uint32_t height_px, const oc_judoca_params_t *params)
{
    OC_ASSERT(params);

    const size_t gradient = oc_gradient_size_bytes(width_px, height_px);
    if (gradient == 0 || !oc_judoca_params_are_valid(params)) return 0;

    const judoca_pieces_t p = judoca_measure(width_px, height_px, params);
    const size_t method = params->method == OC_JUDOCA_THESIS ? oc_judoca_thesis_size_bytes(width_px, height_px, params)
                                                             : oc_search_size_bytes(width_px, height_px);
    const size_t corner =
        params->max_corners > 0 ? oc_corner_size_bytes(width_px, height_px, params->spread_cell_px) : 0;
    return OC_ARENA_ALIGN + gradient + method + corner + oc_arena_cost(p.done) + oc_arena_cost(p.found) +
           oc_arena_cost(p.rank) + oc_arena_cost(p.next) + oc_arena_cost(p.owner) + oc_arena_cost(p.cell);
}

oc_status_t oc_judoca_init(oc_judoca_ws_t *ws, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                           const oc_judoca_params_t *params)
{
    OC_ASSERT(ws && arena && params);

    if (oc_judoca_size_bytes(width_px, height_px, params) == 0) return OC_E_ARG;

    memset(ws, 0, sizeof *ws);
    oc_status_t status = oc_gradient_init(&ws->gradient, arena, width_px, height_px, params->sigma_px, params->simd);
    if (status != OC_OK) return status;

    const judoca_pieces_t p = judoca_measure(width_px, height_px, params);
    const size_t bytes[6] = {p.done, p.found, p.rank, p.next, p.owner, p.cell};
    void *piece[6];
    for (uint32_t i = 0; i < 6; i++) {
        status = oc_arena_take(arena, bytes[i], &piece[i]);
        if (status != OC_OK) return status;
    }
    if (params->max_corners > 0) {
        status = oc_corner_init(&ws->corner, arena, width_px, height_px, params->spread_cell_px);
        if (status != OC_OK) return status;
    }
    ws->params = *params;
    oc_judoca_ring_build(&ws->ring[0], 3, width_px);
    oc_judoca_ring_build(&ws->ring[1], 6, width_px);
    ws->done = piece[0];
    ws->found = piece[1];
    ws->rank = piece[2];
    ws->next = piece[3];
    ws->owner = piece[4];
    ws->cell = piece[5];
    if (params->method == OC_JUDOCA_THESIS) return oc_judoca_thesis_init(ws, arena);
    return oc_search_init(&ws->search, arena, width_px, height_px, params->lambda_min_px, params->s_j);
}

/* ---- seeds ---- */

/* Half steps of direction, unit vectors: cos and sin of i / 64 of a turn, i = 0..16. */
static const float kQuarter[17] = {
    1.0f,         0.995184727f, 0.98078528f,  0.956940336f,  0.923879533f, 0.881921264f,
    0.831469612f, 0.773010453f, 0.707106781f, 0.634393284f,  0.555570233f, 0.471396737f,
    0.382683432f, 0.290284677f, 0.195090322f, 0.0980171403f, 0.0f,
};

static void unit_vector(uint32_t half_steps, float *x, float *y)
{
    const uint32_t i = half_steps % 64u, part = i % 16u;
    const float c = kQuarter[part], s = kQuarter[16u - part];
    switch (i / 16u) {
    case 0:
        *x = c;
        *y = s;
        break;
    case 1:
        *x = -s;
        *y = c;
        break;
    case 2:
        *x = -c;
        *y = -s;
        break;
    default:
        *x = s;
        *y = -c;
        break;
    }
}

static uint32_t rotated(uint32_t bits, uint32_t by)
{
    return by == 0 ? bits : bits >> by | bits << (32u - by);
}

/* One seed per run of neighbouring directions; a single missing one does not
 * part a run. All round is texture. */
static uint32_t seeds_of_side(uint32_t directions, float side, oc_fit_seed_t seed[OC_FIT_MAX_BRANCHES], uint32_t n)
{
    const uint32_t closed = directions | (rotated(directions, 1) & rotated(directions, 31));
    if (closed == 0 || closed == UINT32_MAX) return n;

    const uint32_t start = (uint32_t)__builtin_ctz(~closed); /* no run goes across this bit */
    uint32_t rest = rotated(closed, start);
    while (rest && n < OC_FIT_MAX_BRANCHES) {
        const uint32_t first = (uint32_t)__builtin_ctz(rest);
        const uint32_t length = (uint32_t)__builtin_ctz(~(rest >> first));
        seed[n].side = side;
        unit_vector(2u * start + 2u * first + length - 1u, &seed[n].ux, &seed[n].uy);
        n++;
        rest &= length + first >= 32u ? 0u : UINT32_MAX << (first + length);
    }
    return n;
}

/* Two seeds that are not the two ends of one straight edge; their directions are good to some 6 degrees. */
static bool seeds_bend(const oc_fit_seed_t seed[], uint32_t n)
{
    for (uint32_t i = 1; i < n; i++) {
        for (uint32_t j = 0; j < i; j++) {
            if (seed[i].ux * seed[j].ux + seed[i].uy * seed[j].uy > -COARSE_COS_BEND) return true;
        }
    }
    return false;
}

/* ---- fit ---- */

/* Prescores are compared in this many steps. */
#define PRESCORE_BINS 1024u

/* Which places are fitted when there are more than max_candidates: all above
 * a bin of the prescore, and of that bin an even share. */
typedef struct places_choice {
    uint32_t bin;      /* the one that is shared */
    uint32_t n, quota; /* places in it, and how many of them are taken */
    uint32_t met;
} places_choice_t;

/* No more than there is room for, were all of them junctions: what came last in the image would go without. */
static uint32_t candidates_limit(const oc_judoca_ws_t *ws)
{
    const uint32_t n_px = ws->gradient.width_px * ws->gradient.height_px;
    const uint32_t own = n_px / OC_JUDOCA_PX_PER_CANDIDATE + OC_JUDOCA_LEAST_CANDIDATES;
    const uint32_t limit = ws->params.max_candidates > 0 ? ws->params.max_candidates : own;
    return limit < OC_JUDOCA_MAX_FOUND ? limit : OC_JUDOCA_MAX_FOUND;
}

static places_choice_t places_choose(const oc_judoca_ws_t *ws, uint32_t n, uint32_t limit)
{
    uint32_t histogram[PRESCORE_BINS] = {0};
    for (uint32_t i = 0; i < n; i++) histogram[ws->search.place[i].prescore / (65536u / PRESCORE_BINS)]++;
    uint32_t bin = PRESCORE_BINS - 1u, sum = 0;
    while (bin > 0 && sum + histogram[bin] <= limit) sum += histogram[bin--];
    const uint32_t room = limit - sum;
    return (places_choice_t){bin, histogram[bin], histogram[bin] < room ? histogram[bin] : room, 0};
}

static bool places_take(places_choice_t *choice, const oc_place_t *place)
{
    const uint32_t bin = place->prescore / (65536u / PRESCORE_BINS);
    if (bin != choice->bin) return bin > choice->bin;
    /* Multiples of the golden ratio are even on every part of the image, and in step with no pattern in it. */
    const uint32_t part = choice->met++ * 2654435769u;
    return (uint64_t)part * choice->n < (uint64_t)choice->quota << 32;
}

static bool is_in_image(const oc_gradient_t *gradient, float x, float y)
{
    return x >= 0.0f && y >= 0.0f && x < (float)gradient->width_px && y < (float)gradient->height_px;
}

/* Has an apex in this pixel been fitted before? It has now. */
static bool done_test_and_set(const oc_judoca_ws_t *ws, float x, float y)
{
    uint64_t *word = &ws->done[oc_bitmap_at(ws->gradient.pitch, (uint32_t)x / 64u, (uint32_t)y)];
    const uint64_t bit = (uint64_t)1 << (uint32_t)x % 64u;
    const bool is_done = (*word & bit) != 0;
    *word |= bit;
    return is_done;
}

/* Has an apex in this pixel been fitted before, or is a junction within two pixels? */
static bool done_test(const oc_judoca_ws_t *ws, uint32_t x, uint32_t y)
{
    return ws->done[oc_bitmap_at(ws->gradient.pitch, x / 64u, y)] >> x % 64u & 1u;
}

/* What leads to within two pixels of a junction would find it again. */
static void done_surround(const oc_judoca_ws_t *ws, float x_px, float y_px)
{
    for (int32_t dy = -2; dy <= 2; dy++) {
        for (int32_t dx = -2; dx <= 2; dx++) {
            const float x = x_px + 0.5f + (float)dx, y = y_px + 0.5f + (float)dy;
            if (is_in_image(&ws->gradient, x, y)) (void)done_test_and_set(ws, x, y);
        }
    }
}

/* Fit from one place. Places around one corner lead to one apex, which is
 * fitted once. */
static bool fit_place(oc_judoca_ws_t *ws, const oc_fit_rules_t *rules, const oc_place_t *place)
{
    if (done_test(ws, place->x, place->y)) return false;
    oc_fit_seed_t seed[OC_FIT_MAX_BRANCHES];
    uint32_t n = seeds_of_side(place->left, 1.0f, seed, 0);
    n = seeds_of_side(place->right, -1.0f, seed, n);
    oc_fit_t fit;
    if (!seeds_bend(seed, n) || !oc_judoca_fit_begin(&ws->gradient, rules, place->x, place->y, seed, n, &fit))
        return false;

    const float x = fit.x_px + 0.5f, y = fit.y_px + 0.5f;
    if (!is_in_image(&ws->gradient, x, y)) return false;
    if (done_test_and_set(ws, x, y)) return false;
    oc_junction_t *junction = &ws->found[ws->stats.n_found];
    if (!oc_judoca_fit_finish(&ws->gradient, rules, &fit, junction)) return false;
    done_surround(ws, junction->x_px, junction->y_px);
    return true;
}

static void fit_places(oc_judoca_ws_t *ws)
{
    const oc_judoca_params_t *p = &ws->params;
    const oc_fit_rules_t rules = {.sigma_px = p->sigma_px,
                                  .lambda_px = (float)p->lambda_px,
                                  .lambda_min_px = (float)p->lambda_min_px,
                                  .s_j = p->s_j,
                                  .t_b = ws->stats.t_b,
                                  .cos_min_angle = (float)cos((double)p->min_angle_rad),
                                  .cos_min_bend = (float)cos((double)p->min_bend_rad),
                                  .cos_first_bend = (float)cos(FIRST_BEND_SHARE * (double)p->min_bend_rad),
                                  .ring = ws->ring,
                                  .max_rms_px = p->max_rms_px,
                                  .max_apex_sigma_px = p->max_apex_sigma_px};
    const oc_gradient_t *g = &ws->gradient;
    memset(ws->done, 0, oc_bitmap_words(g->width_px, g->height_px) * sizeof ws->done[0]);
    const uint32_t n = ws->search.n_places < ws->search.max_places ? ws->search.n_places : ws->search.max_places;
    const uint32_t limit = candidates_limit(ws);
    places_choice_t choice = places_choose(ws, n, limit);
    for (uint32_t i = 0; i < n && ws->stats.n_fitted < limit; i++) {
        if (!places_take(&choice, &ws->search.place[i])) continue;
        ws->stats.n_fitted++;
        if (fit_place(ws, &rules, &ws->search.place[i])) ws->stats.n_found++;
    }
}

oc_status_t oc_judoca_detect(oc_judoca_ws_t *ws, const oc_image_t *grey, oc_junction_t out[], uint32_t cap,
                             uint32_t *count)
{
    OC_ASSERT(ws && ws->found && grey && count && (out || cap == 0));

    float t_b = ws->params.t_b;
    if (t_b == 0.0f) {
        float noise;
        const oc_status_t status = oc_gradient_noise(&ws->gradient, grey, &noise);
        if (status != OC_OK) return status;
        t_b = fminf(fmaxf(ws->params.t_b_noise_k * noise, OC_JUDOCA_MIN_T_B), OC_JUDOCA_MAX_T_B);
    }
    const oc_status_t status = oc_gradient_compute(&ws->gradient, grey, t_b);
    if (status != OC_OK) return status;

    ws->stats = (oc_judoca_stats_t){.t_b = t_b, .n_thin = ws->gradient.n_thin};
    if (ws->params.method == OC_JUDOCA_THESIS) {
        oc_judoca_thesis_find(ws);
    } else {
        oc_search_run(&ws->search, &ws->gradient);
        ws->stats.n_places = ws->search.n_places;
        fit_places(ws);
    }
    if (ws->params.max_corners > 0) oc_judoca_add_corners(ws);
    *count = oc_judoca_select(ws, out, cap);
    return OC_OK;
}
