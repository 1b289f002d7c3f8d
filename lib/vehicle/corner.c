/* SPDX-License-Identifier: BSD-3-Clause
 * Corners: structure tensor and its smaller eigenvalue row by row, maxima per cell, Foerstner's point. */
#include "vehicle/corner.h"

#include <math.h>
#include <string.h>

#include "core/angle.h"

/* Derivatives are shortened to 1/16 grey level per px, so that a whole window's products fit 32 bits:
 * (2040 * 2040) * 256 < 2^31. */
#define SHORTEN 4
#define SHORT_ONE (OC_GRADIENT_ONE >> SHORTEN)

/* Half side of the binomial window; its weights sum to 2^8. */
#define WINDOW 2
#define WINDOW_WEIGHT 256.0f

/* Rows of dx dx, dx dy and dy dy summed along the row, and three more for the sum down the columns. */
#define N_TENSOR (2 * WINDOW + 1)
#define N_TENSOR_ROWS (3 * N_TENSOR + 3)

/* Rows of strengths that one maximum is compared with. */
#define N_STRENGTH_ROWS (2 * OC_CORNER_REACH_PX + 1)

/* First and last row with a strength: the derivative next to the border saw replicated pixels. */
#define FIRST_ROW (OC_CORNER_MARGIN_PX - (uint32_t)OC_CORNER_REACH_PX)

/* The k-th corner of a cell competes with strength / (1 + k * CROWDING), as junctions do. */
#define CROWDING 0.15f

/* Half side of the window of Foerstner's point. */
#define POINT_REACH 4

/* A point's lines must cross: the determinant against the trace squared. */
#define LEAST_ROUNDNESS 0.02f

/* A corner's score is the gain times a share of 1 that rises with the strength. A junction's score is a like share of
 * its contrast times the root of its length (judoca_fit.c), near 2 for a good one. More gain ranks texture higher and
 * false corners in noise with it. */
#define SCORE_GAIN 2.0f
#define HALF_STRENGTH 10.0f

typedef struct corner_pieces {
    size_t tensor, strength, is_peak, n_in_cell, peak, order; /* bytes */
} corner_pieces_t;

static uint32_t corner_columns(uint32_t side_px, uint32_t cell_px)
{
    return (side_px - 1u) / cell_px + 1u;
}

static bool corner_size_is_valid(uint32_t width_px, uint32_t height_px, uint32_t cell_px)
{
    return width_px >= OC_MIN_IMAGE_SIDE && width_px <= OC_MAX_IMAGE_SIDE && height_px >= OC_MIN_IMAGE_SIDE &&
           height_px <= OC_MAX_IMAGE_SIDE && cell_px >= 8u && cell_px <= OC_MAX_IMAGE_SIDE;
}

static corner_pieces_t corner_measure(uint32_t width_px, uint32_t height_px, uint32_t cell_px)
{
    const size_t n_cells = (size_t)corner_columns(width_px, cell_px) * corner_columns(height_px, cell_px);
    return (corner_pieces_t){
        .tensor = N_TENSOR_ROWS * (size_t)width_px * sizeof(int32_t),
        .strength = N_STRENGTH_ROWS * (size_t)width_px * sizeof(float),
        .is_peak = (width_px + 7u) / 8u * 8u,
        .n_in_cell = n_cells * sizeof(uint16_t),
        .peak = n_cells * OC_CORNER_PER_CELL * sizeof(oc_corner_peak_t),
        .order = n_cells * OC_CORNER_PER_CELL * sizeof(uint64_t),
    };
}

size_t oc_corner_size_bytes(uint32_t width_px, uint32_t height_px, uint32_t cell_px)
{
    if (!corner_size_is_valid(width_px, height_px, cell_px)) return 0;

    const corner_pieces_t p = corner_measure(width_px, height_px, cell_px);
    return oc_arena_cost(p.tensor) + oc_arena_cost(p.strength) + oc_arena_cost(p.is_peak) + oc_arena_cost(p.n_in_cell) +
           oc_arena_cost(p.peak) + oc_arena_cost(p.order);
}

oc_status_t oc_corner_init(oc_corner_ws_t *ws, oc_arena_t *arena, uint32_t width_px, uint32_t height_px,
                           uint32_t cell_px)
{
    OC_ASSERT(ws && arena);

    if (!corner_size_is_valid(width_px, height_px, cell_px)) return OC_E_ARG;

    const corner_pieces_t p = corner_measure(width_px, height_px, cell_px);
    const size_t bytes[6] = {p.tensor, p.strength, p.is_peak, p.n_in_cell, p.peak, p.order};
    void *piece[6];
    for (uint32_t i = 0; i < 6; i++) {
        const oc_status_t status = oc_arena_take(arena, bytes[i], &piece[i]);
        if (status != OC_OK) return status;
    }
    *ws = (oc_corner_ws_t){
        .width_px = width_px,
        .height_px = height_px,
        .cell_px = cell_px,
        .n_cols = corner_columns(width_px, cell_px),
        .n_cells = corner_columns(width_px, cell_px) * corner_columns(height_px, cell_px),
        .tensor = piece[0],
        .strength = piece[1],
        .is_peak = piece[2],
        .n_in_cell = piece[3],
        .peak = piece[4],
        .order = piece[5],
    };
    return OC_OK;
}

/* ---- strength ---- */

/* Products of one row of derivatives, summed along the row; columns WINDOW .. width - WINDOW - 1. */
static void tensor_row(const int16_t *restrict dxdy, uint32_t width, int32_t *restrict product, int32_t *restrict xx,
                       int32_t *restrict xy, int32_t *restrict yy)
{
    int32_t *restrict out[3] = {xx, xy, yy};
    for (uint32_t part = 0; part < 3; part++) {
        const uint32_t a = part == 2 ? 1 : 0, b = part == 0 ? 0 : 1;
        for (uint32_t x = 0; x < width; x++) {
            const int16_t left = (int16_t)(dxdy[2 * x + a] >> SHORTEN), right = (int16_t)(dxdy[2 * x + b] >> SHORTEN);
            product[x] = left * right;
        }
        int32_t *restrict to = out[part];
        for (uint32_t x = WINDOW; x + WINDOW < width; x++) {
            to[x] = product[x - 2] + product[x + 2] + 4 * (product[x - 1] + product[x + 1]) + 6 * product[x];
        }
    }
}

static void tensor_down(int32_t *const rows[N_TENSOR], uint32_t width, int32_t *restrict out)
{
    const int32_t *restrict a = rows[0], *restrict b = rows[1], *restrict c = rows[2], *restrict d = rows[3],
                            *restrict e = rows[4];
    for (uint32_t x = WINDOW; x + WINDOW < width; x++) out[x] = a[x] + e[x] + 4 * (b[x] + d[x]) + 6 * c[x];
}

/* Root of the smaller eigenvalue, grey levels per px. */
static void strength_row(const int32_t *restrict xx, const int32_t *restrict xy, const int32_t *restrict yy,
                         uint32_t width, float *restrict out)
{
    const float unit = 1.0f / (WINDOW_WEIGHT * (float)(SHORT_ONE * SHORT_ONE));
    for (uint32_t x = WINDOW; x + WINDOW < width; x++) {
        const float a = (float)xx[x], b = (float)xy[x], c = (float)yy[x];
        const float half = 0.5f * (a - c);
        const float smaller = 0.5f * (a + c) - sqrtf(half * half + b * b);
        out[x] = sqrtf((smaller > 0.0f ? smaller : 0.0f) * unit);
    }
}

/* ---- maxima ---- */

/* Larger than the eight round it; of equal ones the first in reading order. */
static uint32_t peak_row(const float *restrict above, const float *restrict here, const float *restrict below,
                         uint32_t width, float floor, uint8_t *restrict is_peak)
{
    uint32_t n = 0;
    for (uint32_t x = OC_CORNER_MARGIN_PX; x + OC_CORNER_MARGIN_PX < width; x++) {
        const float v = here[x];
        const int is = (v >= floor) & (v > above[x - 1]) & (v > above[x]) & (v > above[x + 1]) & (v > here[x - 1]) &
                       (v >= here[x + 1]) & (v >= below[x - 1]) & (v >= below[x]) & (v >= below[x + 1]);
        is_peak[x] = (uint8_t)is;
        n += (uint32_t)is;
    }
    return n;
}

/* The largest of its whole neighbourhood, by the same rule. */
static bool peak_stands(const float *const rows[N_STRENGTH_ROWS], uint32_t x)
{
    const float v = rows[OC_CORNER_REACH_PX][x];
    for (int32_t r = 0; r < N_STRENGTH_ROWS; r++) {
        const float *row = rows[r] + x;
        for (int32_t i = -OC_CORNER_REACH_PX; i <= OC_CORNER_REACH_PX; i++) {
            const bool is_before = r < OC_CORNER_REACH_PX || (r == OC_CORNER_REACH_PX && i < 0);
            if (row[i] > v || (is_before && row[i] == v)) return false;
        }
    }
    return true;
}

/* Into its cell's list, the weakest of a full list falls out. */
static void cell_insert(oc_corner_ws_t *ws, oc_corner_peak_t peak)
{
    const uint32_t cell = peak.y / ws->cell_px * ws->n_cols + peak.x / ws->cell_px;
    oc_corner_peak_t *list = ws->peak + (size_t)cell * OC_CORNER_PER_CELL;
    uint32_t at = ws->n_in_cell[cell];
    if (at == OC_CORNER_PER_CELL) {
        if (!(peak.strength > list[at - 1u].strength)) return;
        at--;
    } else {
        ws->n_in_cell[cell]++;
    }
    for (; at > 0 && list[at - 1u].strength < peak.strength; at--) list[at] = list[at - 1u];
    list[at] = peak;
}

/* Row y, with the strengths of the rows beside it in rows. */
static void find_row(oc_corner_ws_t *ws, const float *const rows[N_STRENGTH_ROWS], uint32_t y, float floor)
{
    const float *const *mid = rows + OC_CORNER_REACH_PX;
    if (peak_row(mid[-1], mid[0], mid[1], ws->width_px, floor, ws->is_peak) == 0) return;
    for (uint32_t x = OC_CORNER_MARGIN_PX; x + OC_CORNER_MARGIN_PX < ws->width_px; x++) {
        if (ws->is_peak[x] && peak_stands(rows, x))
            cell_insert(ws, (oc_corner_peak_t){mid[0][x], (uint16_t)x, (uint16_t)y});
    }
}

static void find_peaks(oc_corner_ws_t *ws, const oc_gradient_t *gradient, float floor)
{
    const uint32_t width = ws->width_px, height = ws->height_px;
    int32_t *const scratch = ws->tensor + (size_t)3 * N_TENSOR * width;
    memset(ws->n_in_cell, 0, ws->n_cells * sizeof ws->n_in_cell[0]);
    for (uint32_t y = FIRST_ROW - WINDOW; y + FIRST_ROW - WINDOW < height; y++) {
        int32_t *const row = ws->tensor + (size_t)(y % N_TENSOR) * 3 * width;
        tensor_row(gradient->dxdy + 2u * (size_t)y * width, width, scratch, row, row + width, row + 2 * width);
        if (y < FIRST_ROW + WINDOW) continue;

        for (uint32_t part = 0; part < 3; part++) {
            int32_t *rows[N_TENSOR];
            for (uint32_t i = 0; i < N_TENSOR; i++)
                rows[i] = ws->tensor + ((size_t)((y + 1u + i) % N_TENSOR) * 3 + part) * width;
            tensor_down(rows, width, scratch + part * width);
        }
        const uint32_t at = y - WINDOW; /* whose strength is complete */
        strength_row(scratch, scratch + width, scratch + 2 * width, width,
                     ws->strength + (size_t)(at % N_STRENGTH_ROWS) * width);
        if (at < FIRST_ROW + N_STRENGTH_ROWS - 1u) continue;

        const float *rows[N_STRENGTH_ROWS];
        for (uint32_t i = 0; i < N_STRENGTH_ROWS; i++)
            rows[i] = ws->strength + (size_t)((at + 1u + i) % N_STRENGTH_ROWS) * width;
        find_row(ws, rows, at - (uint32_t)OC_CORNER_REACH_PX, floor);
    }
}

/* ---- place and orientation ---- */

/* Sums over the window round a maximum, weighted by a product of tents. */
typedef struct corner_sums {
    float xx, xy, yy; /* outer product of the derivative */
    float px, py;     /* the same times the pixel's place */
    float gx, gy;     /* derivative */
} corner_sums_t;

static corner_sums_t sums_round(const oc_gradient_t *gradient, uint32_t x0, uint32_t y0)
{
    corner_sums_t s = {0};
    for (int32_t j = -POINT_REACH; j <= POINT_REACH; j++) {
        const int16_t *row = gradient->dxdy + 2 * (size_t)((uint32_t)((int32_t)y0 + j) * gradient->width_px + x0);
        for (int32_t i = -POINT_REACH; i <= POINT_REACH; i++) {
            const int32_t wx = POINT_REACH + 1 - (i < 0 ? -i : i), wy = POINT_REACH + 1 - (j < 0 ? -j : j);
            const float gx = (float)row[2 * i], gy = (float)row[2 * i + 1], w = (float)(wx * wy);
            const float xx = w * gx * gx, xy = w * gx * gy, yy = w * gy * gy;
            s.xx += xx;
            s.xy += xy;
            s.yy += yy;
            s.px += xx * (float)i + xy * (float)j;
            s.py += xy * (float)i + yy * (float)j;
            s.gx += w * gx;
            s.gy += w * gy;
        }
    }
    return s;
}

static float angle_in_turn(float y, float x)
{
    const float turn = 6.28318531f;
    const float angle = oc_angle_of(y, x);
    const float positive = angle < 0.0f ? angle + turn : angle;
    return positive < turn ? positive : 0.0f;
}

/* From the maximum to Foerstner's point, or nowhere when its lines do not cross near by. One step only: a window that
 * follows the point comes nearer to the apex of two straight edges and repeats less well in texture. */
static void point_of(const corner_sums_t *s, float *to_x, float *to_y)
{
    const float det = s->xx * s->yy - s->xy * s->xy, trace = s->xx + s->yy, reach = (float)OC_CORNER_REACH_PX;
    *to_x = *to_y = 0.0f;
    if (!(det > LEAST_ROUNDNESS * trace * trace)) return;
    const float x = (s->yy * s->px - s->xy * s->py) / det, y = (s->xx * s->py - s->xy * s->px) / det;
    if (!(x * x + y * y <= reach * reach)) return;
    *to_x = x;
    *to_y = y;
}

static void corner_write(const oc_gradient_t *gradient, const oc_corner_peak_t *peak, oc_junction_t *out)
{
    const corner_sums_t s = sums_round(gradient, peak->x, peak->y);
    float to_x, to_y;
    point_of(&s, &to_x, &to_y);
    memset(out, 0, sizeof *out);
    out->x_px = (float)peak->x + to_x;
    out->y_px = (float)peak->y + to_y;
    out->score = SCORE_GAIN * peak->strength / (peak->strength + HALF_STRENGTH);
    out->n_branches = 1;
    out->kind = OC_KIND_CORNER;
    out->branch[0] = (oc_branch_t){angle_in_turn(s.gy, s.gx), (float)OC_CORNER_REACH_PX, 1.0f};
}

/* ---- choice ---- */

/* Descending, Shell's way with gaps by 2.25. */
static void order_sort(uint64_t order[], uint32_t n)
{
    uint32_t step = n;
    while (step > 1) {
        step = step * 4u / 9u > 1u ? step * 4u / 9u : 1u;
        for (uint32_t i = step; i < n; i++) {
            const uint64_t key = order[i];
            uint32_t at = i;
            for (; at >= step && order[at - step] < key; at -= step) order[at] = order[at - step];
            order[at] = key;
        }
    }
}

/* Strengths are positive, and so ordered as their bits are; of equal ones the first place wins. */
static uint64_t order_key(float strength, uint32_t place)
{
    uint32_t bits;
    memcpy(&bits, &strength, sizeof bits);
    return (uint64_t)bits << 32 | (UINT32_MAX - place);
}

uint32_t oc_corner_find(oc_corner_ws_t *ws, const oc_gradient_t *gradient, float floor, oc_junction_t out[],
                        uint32_t cap)
{
    OC_ASSERT(ws && gradient && gradient->dxdy && (out || cap == 0));
    OC_ASSERT(ws->width_px == gradient->width_px && ws->height_px == gradient->height_px && floor > 0.0f);

    find_peaks(ws, gradient, floor);

    uint32_t n = 0;
    for (uint32_t cell = 0; cell < ws->n_cells; cell++) {
        for (uint32_t k = 0; k < ws->n_in_cell[cell]; k++) {
            const uint32_t place = cell * OC_CORNER_PER_CELL + k;
            ws->order[n++] = order_key(ws->peak[place].strength / (1.0f + CROWDING * (float)k), place);
        }
    }
    order_sort(ws->order, n);
    if (n > cap) n = cap;
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t place = UINT32_MAX - (uint32_t)ws->order[i];
        ws->order[i] = order_key(ws->peak[place].strength, place);
    }
    order_sort(ws->order, n);
    for (uint32_t i = 0; i < n; i++) corner_write(gradient, &ws->peak[UINT32_MAX - (uint32_t)ws->order[i]], &out[i]);
    return n;
}
