/* SPDX-License-Identifier: BSD-3-Clause
 * JUDOCA: places where rays along edges meet, then the sub-pixel fit. */
#include "vehicle/judoca.h"

#include <math.h>
#include <string.h>

#include "vehicle/judoca_fit.h"
#include "vehicle/judoca_select.h"
#include "vehicle/judoca_thesis.h"

#define PI 3.14159265358979f

/* Samples nearer to the apex than this are not asked for: there the ridges of
 * the branches have run into each other, and an X has no gradient at all. */
#define FIRST_SAMPLE_PX 2

/* A pair of rays straighter than this is not looked at; the final test is on
 * the fitted angles (min_bend_rad). */
#define COARSE_COS_BEND 0.92f

static const float kTurn = 2.0f * PI;

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
        .max_candidates = 8192,
        .spread_cell_px = 40,
        .method = OC_JUDOCA_REFINED,
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
           p->max_junctions >= 1 && p->max_junctions <= OC_MAX_JUNCTIONS && p->max_candidates >= 16 &&
           p->max_candidates <= OC_JUDOCA_MAX_CANDIDATES && p->spread_cell_px >= 8 &&
           p->spread_cell_px <= OC_MAX_IMAGE_SIDE && (p->method == OC_JUDOCA_REFINED || p->method == OC_JUDOCA_THESIS);
}

/* The maps carry a border that no ray leaves, so rays need no bounds test. */
static uint32_t judoca_border(const oc_judoca_params_t *params)
{
    const float widest = fmaxf((float)params->lambda_px, params->min_distance_px);
    return (uint32_t)widest + 3u;
}

typedef struct judoca_pieces {
    size_t ray, map, prescore, peak, found, rank, cell; /* bytes */
} judoca_pieces_t;

static judoca_pieces_t judoca_measure(uint32_t width_px, uint32_t height_px, const oc_judoca_params_t *params)
{
    const size_t border = judoca_border(params);
    const size_t area = (width_px + 2u * border) * (height_px + 2u * border);
    const size_t cols = (width_px - 1u) / params->spread_cell_px + 1u;
    const size_t rows = (height_px - 1u) / params->spread_cell_px + 1u;
    return (judoca_pieces_t){
        .ray = OC_JUDOCA_MAX_RAYS * sizeof(oc_judoca_ray_t),
        .map = area * sizeof(uint32_t),
        .prescore = area * sizeof(uint16_t),
        .peak = params->max_candidates * sizeof(uint32_t),
        .found = OC_JUDOCA_MAX_FOUND * sizeof(oc_junction_t),
        .rank = OC_JUDOCA_MAX_FOUND * sizeof(oc_judoca_rank_t),
        .cell = cols * rows * sizeof(uint16_t),
    };
}

size_t oc_judoca_size_bytes(uint32_t width_px, uint32_t height_px, const oc_judoca_params_t *params)
{
    OC_ASSERT(params);

    const size_t gradient = oc_gradient_size_bytes(width_px, height_px);
    if (gradient == 0 || !oc_judoca_params_are_valid(params)) return 0;

    const judoca_pieces_t p = judoca_measure(width_px, height_px, params);
    return OC_ARENA_ALIGN + gradient + oc_arena_cost(p.ray) + oc_arena_cost(p.map) + oc_arena_cost(p.prescore) +
           oc_arena_cost(p.peak) + oc_arena_cost(p.found) + oc_arena_cost(p.rank) + oc_arena_cost(p.cell);
}

/* Sector bit of a gradient direction. */
static uint16_t judoca_bit(float angle_rad)
{
    const int32_t sector = (int32_t)lrintf(angle_rad * (16.0f / kTurn)) & 15;
    return (uint16_t)(1u << sector);
}

static void judoca_fill_ray(oc_judoca_ray_t *ray, int32_t x, int32_t y, float s_j, int32_t pitch)
{
    const float length = sqrtf((float)(x * x + y * y));
    const float angle = atan2f((float)y, (float)x);
    const int32_t steps = (x < 0 ? -x : x) > (y < 0 ? -y : y) ? (x < 0 ? -x : x) : (y < 0 ? -y : y);

    ray->n = 0;
    ray->angle_rad = angle < 0.0f ? angle + kTurn : angle;
    for (int32_t i = steps; i > 0; i--) {
        const float part = (float)i / (float)steps;
        if (part * length < (float)FIRST_SAMPLE_PX - 0.5f) break;
        const int32_t dx = (int32_t)lrintf((float)x * part);
        const int32_t dy = (int32_t)lrintf((float)y * part);
        ray->offset[ray->n++] = dy * pitch + dx;
    }
    ray->n_needed = (uint8_t)ceilf(s_j * (float)ray->n - 1e-4f);
    ray->per_hit = ray->n > 0 ? 0.5f / (float)ray->n : 0.0f;
    ray->ux = (float)x / length;
    ray->uy = (float)y / length;
    ray->bit = judoca_bit(angle + 0.5f * PI);
    ray->bit_back = judoca_bit(angle - 0.5f * PI);
}

/* All pixels whose distance rounds to the radius, in order of angle. */
static void judoca_build_rays(oc_judoca_ws_t *ws, int32_t radius)
{
    ws->n_rays = 0;
    for (int32_t y = -radius; y <= radius; y++) {
        for (int32_t x = -radius; x <= radius; x++) {
            const float r = sqrtf((float)(x * x + y * y));
            if (lrintf(r) != radius || ws->n_rays == OC_JUDOCA_MAX_RAYS) continue;

            oc_judoca_ray_t made;
            memset(&made, 0, sizeof made);
            judoca_fill_ray(&made, x, y, ws->params.s_j, ws->map_pitch);
            uint32_t at = ws->n_rays++;
            for (; at > 0 && ws->ray[at - 1].angle_rad > made.angle_rad; at--) {
                ws->ray[at] = ws->ray[at - 1];
            }
            ws->ray[at] = made;
        }
    }
}

oc_status_t oc_judoca_init(oc_judoca_ws_t *ws, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                           const oc_judoca_params_t *params)
{
    OC_ASSERT(ws && arena && params);

    if (oc_judoca_size_bytes(width_px, height_px, params) == 0) return OC_E_ARG;

    memset(ws, 0, sizeof *ws);
    oc_status_t status = oc_gradient_init(&ws->gradient, arena, width_px, height_px, params->sigma_px);
    if (status != OC_OK) return status;

    const judoca_pieces_t p = judoca_measure(width_px, height_px, params);
    const size_t bytes[7] = {p.ray, p.map, p.prescore, p.peak, p.found, p.rank, p.cell};
    void *piece[7];
    for (uint32_t i = 0; i < 7; i++) {
        status = oc_arena_take(arena, bytes[i], &piece[i]);
        if (status != OC_OK) return status;
    }
    ws->params = *params;
    ws->cos_min_angle = cosf(params->min_angle_rad);
    ws->ray = piece[0];
    ws->oriented = piece[1];
    ws->prescore = piece[2];
    ws->place = piece[3];
    ws->found = piece[4];
    ws->rank = piece[5];
    ws->cell = piece[6];
    ws->map_border = (int32_t)judoca_border(params);
    ws->map_pitch = (int32_t)width_px + 2 * ws->map_border;
    judoca_build_rays(ws, params->method == OC_JUDOCA_THESIS ? params->lambda_px : params->lambda_min_px);
    return OC_OK;
}

/* Write each B+ pixel's gradient sector and the two beside it into the pixel
 * and its two neighbours across the edge: "B+ within one pixel of the ray, its
 * gradient along the ray's normal" is then one bit test. */
static void judoca_orient(oc_judoca_ws_t *ws)
{
    const oc_gradient_t *g = &ws->gradient;
    const size_t rows = g->height_px + 2u * (size_t)ws->map_border;
    memset(ws->oriented, 0, rows * (size_t)ws->map_pitch * sizeof ws->oriented[0]);

    for (uint32_t y = 0; y < g->height_px; y++) {
        const size_t row = (size_t)y * g->width_px;
        uint32_t *map = ws->oriented + ((int32_t)y + ws->map_border) * ws->map_pitch + ws->map_border;
        for (uint32_t x = 0; x < g->width_px; x++) {
            if (!(g->edge[row + x] & OC_EDGE_THIN)) continue;

            const int32_t dx = g->dx[row + x], dy = g->dy[row + x];
            const uint32_t s = oc_gradient_sector(dx, dy);
            const uint32_t three = 1u << s | 1u << ((s + 1u) & 15u) | 1u << ((s + 15u) & 15u);
            const bool upright = (dx < 0 ? -dx : dx) > (dy < 0 ? -dy : dy);
            const int32_t step = upright ? 1 : ws->map_pitch;
            uint32_t *at = map + x;
            *at |= three | three << 16;
            *(at - step) |= three;
            at[step] |= three;
        }
    }
}

/* Test one gradient sign of a ray. 0 when the branch is refused; otherwise its
 * hits, those exactly on the ray counted twice: near the apex many rays have
 * every sample within a pixel of B+, and only this tells them apart. The
 * circle is asked first: no anchor point there, no branch. */
static uint8_t judoca_test_ray(const oc_judoca_ray_t *ray, uint32_t bit, const uint32_t *centre)
{
    uint32_t spare = (uint32_t)ray->n - ray->n_needed;
    uint32_t hits = 0;
    for (uint32_t i = 0; i < ray->n; i++) {
        const uint32_t here = centre[ray->offset[i]];
        if (here & bit) {
            hits += here & bit << 16 ? 2u : 1u;
            continue;
        }
        if (i == 0 || spare == 0) return 0;
        spare--;
    }
    return (uint8_t)hits;
}

/* Accepted rays of one gradient sign, in order of angle. */
typedef struct judoca_accepted {
    uint32_t n;
    uint8_t ray[OC_JUDOCA_MAX_RAYS];
    uint8_t hits[OC_JUDOCA_MAX_RAYS];
} judoca_accepted_t;
static_assert(OC_JUDOCA_MAX_RAYS <= UINT8_MAX, "judoca_accepted_t counts rays in 8 bits");

/* A run of neighbouring accepted rays: anchor points of one edge. */
typedef struct judoca_run {
    float sx, sy, best;
} judoca_run_t;

static void judoca_extend_run(judoca_run_t *run, const oc_judoca_ray_t *ray, uint32_t hits)
{
    const float share = (float)hits * ray->per_hit;
    /* Squares favour the ray that lies on the edge over its neighbours. */
    run->sx += share * share * ray->ux;
    run->sy += share * share * ray->uy;
    if (share > run->best) run->best = share;
}

/* Close a run: one more seed in its mean direction, kept in order of strength. */
static uint32_t judoca_close_run(judoca_run_t *run, float side, oc_fit_seed_t seed[], uint32_t n)
{
    const float best = run->best;
    const float norm = sqrtf(run->sx * run->sx + run->sy * run->sy);
    const oc_fit_seed_t made = {run->sx / norm, run->sy / norm, side, best};
    *run = (judoca_run_t){0.0f, 0.0f, 0.0f};
    if (!(norm > 1e-3f)) return n; /* all round: texture */

    if (n == OC_FIT_MAX_BRANCHES) {
        if (seed[n - 1].strength >= best) return n;
        n--;
    }
    uint32_t at = n;
    for (; at > 0 && seed[at - 1].strength < best; at--) seed[at] = seed[at - 1];
    seed[at] = made;
    return n + 1;
}

/* Is this entry of the circular list not the neighbour of the one before? */
static bool judoca_starts_run(const judoca_accepted_t *a, uint32_t i, uint32_t n_rays)
{
    const uint32_t before = a->ray[i == 0 ? a->n - 1u : i - 1u];
    return a->ray[i] != (before + 1u == n_rays ? 0 : before + 1u);
}

static uint32_t judoca_collect_runs(const oc_judoca_ws_t *ws, const judoca_accepted_t *a, float side,
                                    oc_fit_seed_t seed[], uint32_t n)
{
    uint32_t first = 0;
    while (first < a->n && !judoca_starts_run(a, first, ws->n_rays)) first++;
    if (first == a->n) return n; /* none, or edges in every direction: texture */

    judoca_run_t run = {0.0f, 0.0f, 0.0f};
    uint32_t i = first;
    do {
        judoca_extend_run(&run, &ws->ray[a->ray[i]], a->hits[i]);
        i = i + 1u == a->n ? 0 : i + 1u;
        if (i == first || judoca_starts_run(a, i, ws->n_rays)) {
            n = judoca_close_run(&run, side, seed, n);
        }
    } while (i != first);
    return n;
}

static void judoca_accept(judoca_accepted_t *a, const oc_judoca_ray_t *ray, uint32_t index, uint32_t bit,
                          const uint32_t *centre)
{
    const uint8_t hits = judoca_test_ray(ray, bit, centre);
    if (hits == 0) return;
    a->ray[a->n] = (uint8_t)index;
    a->hits[a->n++] = hits;
}

/* Branch directions at a place of the padded map, strongest first. */
static uint32_t judoca_seeds(const oc_judoca_ws_t *ws, const uint32_t *centre, oc_fit_seed_t seed[OC_FIT_MAX_BRANCHES])
{
    judoca_accepted_t front, back;
    front.n = back.n = 0;
    for (uint32_t i = 0; i < ws->n_rays; i++) {
        const oc_judoca_ray_t *ray = &ws->ray[i];
        const uint32_t anchor = centre[ray->offset[0]];
        if (!(anchor & (ray->bit | ray->bit_back))) continue;
        if (anchor & ray->bit) judoca_accept(&front, ray, i, ray->bit, centre);
        if (anchor & ray->bit_back) judoca_accept(&back, ray, i, ray->bit_back, centre);
    }
    const uint32_t n = judoca_collect_runs(ws, &front, 1.0f, seed, 0);
    return judoca_collect_runs(ws, &back, -1.0f, seed, n);
}

/* Strength of the best pair of seeds that is neither one branch nor a line;
 * the weaker branch decides (thesis 3.3 step 6). */
static float judoca_pair_strength(const oc_judoca_ws_t *ws, const oc_fit_seed_t seed[], uint32_t n)
{
    for (uint32_t j = 1; j < n; j++) { /* sorted: the first pair with this j is the best */
        for (uint32_t i = 0; i < j; i++) {
            const float c = seed[i].ux * seed[j].ux + seed[i].uy * seed[j].uy;
            if (c <= ws->cos_min_angle && c >= -COARSE_COS_BEND) return seed[j].strength;
        }
    }
    return 0.0f;
}

static void judoca_clear(const oc_judoca_ws_t *ws, uint16_t *map)
{
    const size_t rows = ws->gradient.height_px + 2u * (size_t)ws->map_border;
    memset(map, 0, rows * (size_t)ws->map_pitch * sizeof map[0]);
}

/* Strength times contrast for every B+ pixel, so that a limit on the fits
 * keeps clear corners and not just straight ones. */
static void judoca_prescore(oc_judoca_ws_t *ws)
{
    const oc_gradient_t *g = &ws->gradient;
    judoca_clear(ws, ws->prescore);

    for (uint32_t y = 0; y < g->height_px; y++) {
        const size_t row = (size_t)y * g->width_px;
        const size_t start = (size_t)(((int32_t)y + ws->map_border) * ws->map_pitch + ws->map_border);
        for (uint32_t x = 0; x < g->width_px; x++) {
            if (!(g->edge[row + x] & OC_EDGE_THIN)) continue;

            oc_fit_seed_t seed[OC_FIT_MAX_BRANCHES];
            const uint32_t n = judoca_seeds(ws, ws->oriented + start + x, seed);
            const float strength = judoca_pair_strength(ws, seed, n);
            if (strength <= 0.0f) continue;
            const float contrast = (float)g->magnitude[row + x] / (float)OC_GRADIENT_ONE;
            const float score = strength * contrast / (contrast + 10.0f);
            ws->prescore[start + x] = (uint16_t)(1.0f + score * 7000.0f);
        }
    }
}

/* Fit from one place of the padded map. The apex of the first look decides
 * the place that is really fitted, once: what comes out then hardly depends on
 * which of the pixels around a corner led there. */
static bool judoca_fit_place(oc_judoca_ws_t *ws, const oc_fit_rules_t *rules, int32_t at)
{
    oc_fit_seed_t seed[OC_FIT_MAX_BRANCHES];
    oc_fit_t fit, again;
    int32_t x = at % ws->map_pitch - ws->map_border;
    int32_t y = at / ws->map_pitch - ws->map_border;
    uint32_t n = judoca_seeds(ws, ws->oriented + at, seed);
    if (!oc_judoca_fit_begin(&ws->gradient, rules, (float)x, (float)y, seed, n, &fit)) return false;

    x = (int32_t)floorf(fit.x_px + 0.5f);
    y = (int32_t)floorf(fit.y_px + 0.5f);
    at = (y + ws->map_border) * ws->map_pitch + x + ws->map_border;
    if (ws->prescore[at]) return false; /* the map has served and now marks places done */
    ws->prescore[at] = 1;

    n = judoca_seeds(ws, ws->oriented + at, seed);
    if (n >= 2 && oc_judoca_fit_begin(&ws->gradient, rules, (float)x, (float)y, seed, n, &again)) {
        fit = again;
    }
    return oc_judoca_fit_finish(&ws->gradient, rules, &fit, &ws->found[ws->stats.n_found]);
}

static void judoca_fit_places(oc_judoca_ws_t *ws)
{
    const oc_judoca_params_t *p = &ws->params;
    const oc_fit_rules_t rules = {(float)p->lambda_px, (float)p->lambda_min_px, p->s_j,        ws->stats.t_b,
                                  ws->cos_min_angle,   p->min_bend_rad,         p->max_rms_px, p->max_apex_sigma_px};
    judoca_clear(ws, ws->prescore);
    for (uint32_t i = 0; i < ws->stats.n_fitted && ws->stats.n_found < OC_JUDOCA_MAX_FOUND; i++) {
        if (judoca_fit_place(ws, &rules, (int32_t)ws->place[i])) ws->stats.n_found++;
    }
}

oc_status_t oc_judoca_detect(oc_judoca_ws_t *ws, const oc_image_t *grey, oc_junction_t out[], uint32_t cap,
                             uint32_t *count)
{
    OC_ASSERT(ws && ws->oriented && grey && count && (out || cap == 0));

    const oc_status_t status = oc_gradient_compute(&ws->gradient, grey);
    if (status != OC_OK) return status;

    memset(&ws->stats, 0, sizeof ws->stats);
    float t_b = ws->params.t_b;
    if (t_b == 0.0f) {
        t_b = ws->params.t_b_noise_k * oc_gradient_noise(&ws->gradient);
        t_b = fminf(fmaxf(t_b, OC_JUDOCA_MIN_T_B), OC_JUDOCA_MAX_T_B);
    }
    ws->stats.t_b = t_b;
    ws->stats.n_thin = oc_gradient_edges(&ws->gradient, t_b);

    if (ws->params.method == OC_JUDOCA_THESIS) {
        oc_judoca_thesis_find(ws);
    } else {
        judoca_orient(ws);
        judoca_prescore(ws);
        oc_judoca_pick(ws, 0);
        judoca_fit_places(ws);
    }
    *count = oc_judoca_select(ws, out, cap);
    return OC_OK;
}
