/* SPDX-License-Identifier: BSD-3-Clause
 * The junction detector as thesis 3.3 words it, for comparison. */
#include "vehicle/judoca_thesis.h"

#include <math.h>
#include <string.h>

#include "core/angle.h"
#include "vehicle/judoca_fit.h"

/* Bits of the padded map. Grown means: here or one pixel aside, up/down for
 * flat rays, left/right for steep ones. */
#define THIN 1u
#define THICK_FLAT 2u
#define THICK_STEEP 4u
#define THIN_FLAT 8u
#define THIN_STEEP 16u
#define THICK 32u

/* Half width of the neighbourhood in which one place stays. */
#define PEAK_RADIUS 2

#define PI 3.14159265358979f

/* Prescores are at most this (9 sums of 7001). */
#define MAX_SUM 63009u
#define SUM_BINS 1024u

/* Directions looked at from one pixel: the pixels of a circle of the largest radius. */
#define MAX_RAYS 192u

#define FIRST_SAMPLE_PX 2

/* One ray: from the centre to a pixel of the circle. */
typedef struct thesis_ray {
    uint8_t n;        /* samples, from the circle inwards */
    uint8_t n_needed; /* of these on B+ for strength s_j */
    bool is_flat;
    float angle_rad;
    int32_t offset[OC_JUDOCA_MAX_LAMBDA_PX]; /* into a padded map */
} thesis_ray_t;

typedef struct oc_judoca_thesis {
    uint32_t n_rays;
    thesis_ray_t ray[MAX_RAYS];
    int32_t border, pitch; /* of the padded maps: no ray leaves them */
    uint8_t *map;
    uint16_t *prescore; /* strength of the place in 1/7000, 0 = no junction */
    uint32_t *place;    /* [max_candidates] index into prescore of a place to report */
} oc_judoca_thesis_t;

/* Every place that fits the answer is reported: there is no fit whose time to bound. */
static uint32_t thesis_limit(const oc_judoca_params_t *params)
{
    return params->max_candidates > 0 ? params->max_candidates : OC_JUDOCA_MAX_FOUND;
}

static size_t thesis_area(uint32_t width_px, uint32_t height_px, const oc_judoca_params_t *params)
{
    const size_t border = (size_t)params->lambda_px + 3u;
    return (width_px + 2u * border) * (height_px + 2u * border);
}

size_t oc_judoca_thesis_size_bytes(uint32_t width_px, uint32_t height_px, const oc_judoca_params_t *params)
{
    const size_t area = thesis_area(width_px, height_px, params);
    return oc_arena_cost(sizeof(oc_judoca_thesis_t)) + oc_arena_cost(area) + oc_arena_cost(area * sizeof(uint16_t)) +
           oc_arena_cost(thesis_limit(params) * sizeof(uint32_t));
}

/* ---- tables ---- */

static void ray_fill(thesis_ray_t *ray, int32_t x, int32_t y, float s_j, int32_t pitch)
{
    const float length = sqrtf((float)(x * x + y * y));
    const int32_t ax = x < 0 ? -x : x, ay = y < 0 ? -y : y, steps = ax > ay ? ax : ay;

    memset(ray, 0, sizeof *ray);
    const float angle = oc_angle_of((float)y, (float)x);
    ray->angle_rad = angle < 0.0f ? angle + 2.0f * PI : angle;
    ray->is_flat = ax >= ay;
    for (int32_t i = steps; i > 0; i--) {
        const float part = (float)i / (float)steps;
        if (part * length < (float)FIRST_SAMPLE_PX - 0.5f) break;
        const int32_t dx = (int32_t)lrintf((float)x * part);
        const int32_t dy = (int32_t)lrintf((float)y * part);
        ray->offset[ray->n++] = dy * pitch + dx;
    }
    ray->n_needed = (uint8_t)ceilf(s_j * (float)ray->n - 1e-4f);
}

/* All pixels whose distance rounds to the radius, in order of angle. */
static void thesis_build_rays(oc_judoca_thesis_t *t, int32_t radius, float s_j)
{
    for (int32_t y = -radius; y <= radius; y++) {
        for (int32_t x = -radius; x <= radius; x++) {
            const float r = sqrtf((float)(x * x + y * y));
            if (lrintf(r) != radius || t->n_rays == MAX_RAYS) continue;

            thesis_ray_t made;
            ray_fill(&made, x, y, s_j, t->pitch);
            uint32_t at = t->n_rays++;
            for (; at > 0 && t->ray[at - 1].angle_rad > made.angle_rad; at--) t->ray[at] = t->ray[at - 1];
            t->ray[at] = made;
        }
    }
}

oc_status_t oc_judoca_thesis_init(oc_judoca_ws_t *ws, oc_arena_t *arena)
{
    OC_ASSERT(ws && arena);

    const oc_judoca_params_t *params = &ws->params;
    const uint32_t width = ws->gradient.width_px, height = ws->gradient.height_px;
    const size_t area = thesis_area(width, height, params);
    const size_t bytes[4] = {sizeof(oc_judoca_thesis_t), area, area * sizeof(uint16_t),
                             thesis_limit(params) * sizeof(uint32_t)};
    void *piece[4];
    for (uint32_t i = 0; i < 4; i++) {
        const oc_status_t status = oc_arena_take(arena, bytes[i], &piece[i]);
        if (status != OC_OK) return status;
    }
    oc_judoca_thesis_t *t = piece[0];
    t->map = piece[1];
    t->prescore = piece[2];
    t->place = piece[3];
    t->border = params->lambda_px + 3;
    t->pitch = (int32_t)width + 2 * t->border;
    thesis_build_rays(t, params->lambda_px, params->s_j);
    ws->thesis = t;
    return OC_OK;
}

/* ---- map ---- */

static void thesis_map(oc_judoca_ws_t *ws)
{
    const oc_gradient_t *g = &ws->gradient;
    const oc_judoca_thesis_t *t = ws->thesis;
    const int32_t pitch = t->pitch;
    memset(t->map, 0, thesis_area(g->width_px, g->height_px, &ws->params));

    for (uint32_t y = 0; y < g->height_px; y++) {
        uint8_t *map = t->map + ((int32_t)y + t->border) * pitch + t->border;
        for (uint32_t x = 0; x < g->width_px; x++) {
            const size_t word = oc_bitmap_at(g->pitch, x / 64u, y);
            if (!(g->thick[word] >> x % 64u & 1u)) continue;

            const bool thin = g->thin[word] >> x % 64u & 1u;
            const uint8_t flat = thin ? THICK_FLAT | THIN_FLAT : THICK_FLAT;
            const uint8_t steep = thin ? THICK_STEEP | THIN_STEEP : THICK_STEEP;
            uint8_t *at = map + x;
            at[0] |= (uint8_t)(flat | steep | THICK | (thin ? THIN : 0u));
            at[-pitch] |= flat;
            at[pitch] |= flat;
            at[-1] |= steep;
            at[1] |= steep;
        }
    }
}

/* Strength of the branch to one pixel of the circle, 0 when there is none. */
static float thesis_ray_strength(const thesis_ray_t *ray, const uint8_t *centre)
{
    if (!(centre[ray->offset[0]] & THIN)) return 0.0f;

    const uint32_t path = ray->is_flat ? THICK_FLAT : THICK_STEEP;
    const uint32_t ridge = ray->is_flat ? THIN_FLAT : THIN_STEEP;
    uint32_t on_ridge = 0;
    for (uint32_t i = 0; i < ray->n; i++) {
        const uint32_t here = centre[ray->offset[i]];
        if (!(here & path)) return 0.0f;
        on_ridge += (here & ridge) != 0;
    }
    return on_ridge < ray->n_needed ? 0.0f : (float)on_ridge / (float)ray->n;
}

static float thesis_between(float a, float b)
{
    const float d = fabsf(a - b);
    return d > PI ? 2.0f * PI - d : d;
}

/* Branches at a place; neighbouring anchor points within the least angle
 * count once, as the strongest of them. */
static uint32_t thesis_branches(const oc_judoca_ws_t *ws, const uint8_t *centre, oc_branch_t branch[OC_MAX_BRANCHES])
{
    const oc_judoca_thesis_t *t = ws->thesis;
    uint32_t n = 0;
    for (uint32_t i = 0; i < t->n_rays; i++) {
        const float strength = thesis_ray_strength(&t->ray[i], centre);
        if (strength <= 0.0f) continue;

        const float angle = t->ray[i].angle_rad;
        uint32_t same = 0;
        while (same < n && thesis_between(branch[same].angle_rad, angle) >= ws->params.min_angle_rad) {
            same++;
        }
        if (same == OC_MAX_BRANCHES) continue;
        if (same < n && branch[same].strength >= strength) continue;
        branch[same] = (oc_branch_t){angle, (float)ws->params.lambda_px, strength};
        if (same == n) n++;
    }
    return n;
}

/* Thesis 3.3 step 6: the weakest branch decides; 0 for a line or less. */
static float thesis_strength(const oc_judoca_ws_t *ws, const oc_branch_t branch[], uint32_t n)
{
    if (n < 2) return 0.0f;
    if (n == 2) {
        const float between = thesis_between(branch[0].angle_rad, branch[1].angle_rad);
        if (PI - between < ws->params.min_bend_rad) return 0.0f;
    }
    float weakest = 1.0f;
    for (uint32_t i = 0; i < n; i++) weakest = fminf(weakest, branch[i].strength);
    return weakest;
}

static void thesis_prescore(oc_judoca_ws_t *ws)
{
    const oc_gradient_t *g = &ws->gradient;
    const oc_judoca_thesis_t *t = ws->thesis;
    memset(t->prescore, 0, thesis_area(g->width_px, g->height_px, &ws->params) * sizeof t->prescore[0]);

    for (uint32_t y = 0; y < g->height_px; y++) {
        const int32_t start = ((int32_t)y + t->border) * t->pitch + t->border;
        for (uint32_t x = 0; x < g->width_px; x++) {
            const uint8_t *centre = t->map + start + x;
            if (!(*centre & THICK)) continue;

            oc_branch_t branch[OC_MAX_BRANCHES];
            const uint32_t n = thesis_branches(ws, centre, branch);
            const float strength = thesis_strength(ws, branch, n);
            if (strength > 0.0f) t->prescore[start + (int32_t)x] = (uint16_t)(strength * 7000.0f);
        }
    }
}

/* ---- choice ---- */

/* Sum over 3x3: the middle of a cluster of strong places beats its rim. */
static uint32_t place_sum(const uint16_t *at, int32_t pitch)
{
    uint32_t sum = 0;
    for (int32_t dy = -1; dy <= 1; dy++) {
        const uint16_t *row = at + dy * pitch;
        sum += (uint32_t)row[-1] + row[0] + row[1];
    }
    return sum;
}

/* The first in reading order wins a tie. */
static bool place_is_peak(const uint16_t *at, int32_t pitch, int32_t radius, uint32_t sum)
{
    for (int32_t dy = -radius; dy <= radius; dy++) {
        for (int32_t dx = -radius; dx <= radius; dx++) {
            const uint16_t *other = at + dy * pitch + dx;
            if (other == at || *other == 0) continue;
            const uint32_t theirs = place_sum(other, pitch);
            if (theirs > sum || (theirs == sum && other < at)) return false;
        }
    }
    return true;
}

/* Visit every place that qualifies; count it per bin, or store it when its bin is high enough. */
static uint32_t place_scan(oc_judoca_ws_t *ws, int32_t radius, uint32_t histogram[], uint32_t lowest_bin, uint32_t cap)
{
    const oc_judoca_thesis_t *t = ws->thesis;
    const int32_t pitch = t->pitch;
    uint32_t n = 0;
    for (uint32_t y = 0; y < ws->gradient.height_px; y++) {
        const int32_t start = ((int32_t)y + t->border) * pitch + t->border;
        for (uint32_t x = 0; x < ws->gradient.width_px; x++) {
            const uint16_t *at = t->prescore + start + x;
            if (*at == 0) continue;
            const uint32_t sum = radius > 0 ? place_sum(at, pitch) : 9u * *at;
            const uint32_t bin = sum * (SUM_BINS - 1u) / MAX_SUM;
            if (bin < lowest_bin || !place_is_peak(at, pitch, radius, sum)) continue;
            if (histogram) histogram[bin]++;
            if (!histogram && n < cap) t->place[n] = (uint32_t)start + x;
            n++;
        }
    }
    return n < cap ? n : cap;
}

/* Places with a prescore into place[], in reading order, at most max_candidates: the best ones, of each
 * neighbourhood the middle of its strongest cluster. */
static void thesis_pick(oc_judoca_ws_t *ws, int32_t radius)
{
    uint32_t histogram[SUM_BINS] = {0};
    ws->stats.n_places = place_scan(ws, radius, histogram, 0, UINT32_MAX);

    /* Lowest bin that still fits; a bin that does not is left out whole, so
     * the choice does not depend on where in the image a place lies. */
    uint32_t bin = SUM_BINS;
    uint32_t n = 0;
    while (bin > 0 && n + histogram[bin - 1] <= thesis_limit(&ws->params)) n += histogram[--bin];
    ws->stats.n_fitted = place_scan(ws, radius, NULL, bin, thesis_limit(&ws->params));
}

void oc_judoca_thesis_find(oc_judoca_ws_t *ws)
{
    OC_ASSERT(ws && ws->thesis);

    thesis_map(ws);
    thesis_prescore(ws);
    thesis_pick(ws, PEAK_RADIUS);
    const oc_judoca_thesis_t *t = ws->thesis;
    if (ws->stats.n_fitted > OC_JUDOCA_MAX_FOUND) ws->stats.n_fitted = OC_JUDOCA_MAX_FOUND;
    for (uint32_t i = 0; i < ws->stats.n_fitted; i++) {
        const int32_t at = (int32_t)t->place[i];
        oc_junction_t *j = &ws->found[i];
        memset(j, 0, sizeof *j);
        j->x_px = (float)(at % t->pitch - t->border);
        j->y_px = (float)(at / t->pitch - t->border);
        j->n_branches = (uint8_t)thesis_branches(ws, t->map + at, j->branch);
        j->score = thesis_strength(ws, j->branch, j->n_branches);
        oc_judoca_sort_branches(j);
        j->kind = (uint8_t)oc_junction_kind_of(j->branch, j->n_branches);
    }
    ws->stats.n_found = ws->stats.n_fitted;
}
