/* SPDX-License-Identifier: BSD-3-Clause
 * The junction detector as thesis 3.3 words it, for comparison. */
#include "vehicle/judoca_thesis.h"

#include <math.h>
#include <string.h>

#include "vehicle/judoca_fit.h"
#include "vehicle/judoca_select.h"

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

static void thesis_map(oc_judoca_ws_t *ws)
{
    const oc_gradient_t *g = &ws->gradient;
    const int32_t pitch = ws->map_pitch;
    const size_t rows = g->height_px + 2u * (size_t)ws->map_border;
    memset(ws->oriented, 0, rows * (size_t)pitch * sizeof ws->oriented[0]);

    for (uint32_t y = 0; y < g->height_px; y++) {
        uint32_t *map = ws->oriented + ((int32_t)y + ws->map_border) * pitch + ws->map_border;
        for (uint32_t x = 0; x < g->width_px; x++) {
            const uint32_t edge = g->edge[(size_t)y * g->width_px + x];
            if (edge == 0) continue;

            const bool thin = (edge & OC_EDGE_THIN) != 0;
            const uint32_t flat = thin ? THICK_FLAT | THIN_FLAT : THICK_FLAT;
            const uint32_t steep = thin ? THICK_STEEP | THIN_STEEP : THICK_STEEP;
            uint32_t *at = map + x;
            *at |= flat | steep | THICK | (thin ? THIN : 0);
            *(at - pitch) |= flat;
            *(at + pitch) |= flat;
            *(at - 1) |= steep;
            *(at + 1) |= steep;
        }
    }
}

/* Strength of the branch to one pixel of the circle, 0 when there is none. */
static float thesis_ray_strength(const oc_judoca_ray_t *ray, const uint32_t *centre)
{
    if (!(centre[ray->offset[0]] & THIN)) return 0.0f;

    const bool flat = fabsf(cosf(ray->angle_rad)) >= fabsf(sinf(ray->angle_rad));
    const uint32_t path = flat ? THICK_FLAT : THICK_STEEP;
    const uint32_t ridge = flat ? THIN_FLAT : THIN_STEEP;
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
static uint32_t thesis_branches(const oc_judoca_ws_t *ws, const uint32_t *centre, oc_branch_t branch[OC_MAX_BRANCHES])
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < ws->n_rays; i++) {
        const float strength = thesis_ray_strength(&ws->ray[i], centre);
        if (strength <= 0.0f) continue;

        const float angle = ws->ray[i].angle_rad;
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
    const size_t rows = g->height_px + 2u * (size_t)ws->map_border;
    memset(ws->prescore, 0, rows * (size_t)ws->map_pitch * sizeof ws->prescore[0]);

    for (uint32_t y = 0; y < g->height_px; y++) {
        const int32_t start = ((int32_t)y + ws->map_border) * ws->map_pitch + ws->map_border;
        for (uint32_t x = 0; x < g->width_px; x++) {
            const uint32_t *centre = ws->oriented + start + x;
            if (!(*centre & THICK)) continue;

            oc_branch_t branch[OC_MAX_BRANCHES];
            const uint32_t n = thesis_branches(ws, centre, branch);
            const float strength = thesis_strength(ws, branch, n);
            if (strength > 0.0f) ws->prescore[start + (int32_t)x] = (uint16_t)(strength * 7000.0f);
        }
    }
}

void oc_judoca_thesis_find(oc_judoca_ws_t *ws)
{
    OC_ASSERT(ws && ws->oriented);

    thesis_map(ws);
    thesis_prescore(ws);
    oc_judoca_pick(ws, PEAK_RADIUS);
    if (ws->stats.n_fitted > OC_JUDOCA_MAX_FOUND) ws->stats.n_fitted = OC_JUDOCA_MAX_FOUND;
    for (uint32_t i = 0; i < ws->stats.n_fitted; i++) {
        const int32_t at = (int32_t)ws->place[i];
        oc_junction_t *j = &ws->found[i];
        memset(j, 0, sizeof *j);
        j->x_px = (float)(at % ws->map_pitch - ws->map_border);
        j->y_px = (float)(at / ws->map_pitch - ws->map_border);
        j->n_branches = (uint8_t)thesis_branches(ws, ws->oriented + at, j->branch);
        j->score = thesis_strength(ws, j->branch, j->n_branches);
        oc_judoca_sort_branches(j);
        oc_judoca_set_kind(j, ws->params.min_bend_rad);
    }
    ws->stats.n_found = ws->stats.n_fitted;
}
