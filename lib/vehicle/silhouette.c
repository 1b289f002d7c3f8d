/* SPDX-License-Identifier: BSD-3-Clause
 * From comparisons with other views to the labels of a box's projection. */
#include "vehicle/silhouette.h"

#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "core/plane.h"
#include "core/silhouette.h"
#include "vehicle/silhouette_internal.h"

/* Rows of ws->columns and ws->row. */
#define N_LINES 10u

/* Pixels round the projection that windows and filter may look at. */
#define MARGIN_PX 12u

/* Sample pixels of the projection that references are chosen by. */
#define SAMPLES_PER_SIDE 11u
#define MAX_POINTS (SAMPLES_PER_SIDE * SAMPLES_PER_SIDE)

/* How far apart, in the reference, half the subject's height and the ground behind it must be: nearer than a window
 * an obstacle looks like itself and passes for ground. Farther than the second is as good as any. */
#define MIN_PARALLAX_PX 10.0
#define GOOD_PARALLAX_PX 25.0

/* A point that has been covered counts so much less for the next reference. */
#define COVERED_WORTH 0.4

/* Evidence of standing out, about a log likelihood ratio: rises with the least difference (grey levels), falls with
 * the greatest likeness. Fitted by logistic regression to rendered sites; a change by a third moves few labels. */
#define DIFFERENCE_WEIGHT 0.17f
#define LIKENESS_WEIGHT 4.5f
#define EVIDENCE_OFFSET 1.0f
#define MAX_DIFFERENCE 60.0f
#define MAX_EVIDENCE 4.0f
#define EVIDENCE_SCALE 1024.0f

/* Guided filter: half its window, and the variance (grey levels squared) that counts as an edge. */
#define GUIDE_HALF 7u
#define GUIDE_VARIANCE 50.0f
#define SLOPE_SCALE 16384.0f
#define BASE_SCALE 128.0f

/* References that must agree on textured ground which boxes should hide. */
#define MIN_SURE 2u

/* Half of the window of the last majority. */
#define MAJORITY_HALF 2u

/* ---- memory ---- */

static size_t bits_of(uint32_t width_px, uint32_t height_px)
{
    return (size_t)height_px * ((width_px + 7u) / 8u);
}

size_t oc_silhouette_size_bytes(uint32_t max_width_px, uint32_t max_height_px)
{
    const size_t n = (size_t)max_width_px * max_height_px;
    return oc_arena_cost(3u * n) + oc_arena_cost(4u * n) + 5u * oc_arena_cost(n) + oc_arena_cost(n * sizeof(int16_t)) +
           oc_arena_cost(N_LINES * max_width_px * sizeof(int32_t)) +
           oc_arena_cost(N_LINES * max_width_px * sizeof(float)) +
           2u * oc_arena_cost(bits_of(max_width_px, max_height_px)) +
           oc_arena_cost(6u * OC_SILHOUETTE_SAMPLES * sizeof(float));
}

oc_status_t oc_silhouette_init(oc_silhouette_ws_t *ws, oc_arena_t *arena, uint32_t max_width_px, uint32_t max_height_px)
{
    OC_ASSERT(ws && arena);
    const size_t n = (size_t)max_width_px * max_height_px, bits = bits_of(max_width_px, max_height_px);
    oc_silhouette_ws_t made = {.max_px = (uint32_t)n, .max_width_px = max_width_px, .max_height_px = max_height_px};
    struct {
        void **piece;
        size_t bytes;
    } const pieces[] = {
        {(void **)&made.own, 3u * n},
        {(void **)&made.own_grey, n},
        {(void **)&made.warped, 4u * n}, /* and its grey values; later the lines of the guided filter */
        {(void **)&made.mask, n},
        {(void **)&made.difference, n},
        {(void **)&made.counts, n},
        {(void **)&made.likeness, n},
        {(void **)&made.evidence, n * sizeof(int16_t)},
        {(void **)&made.columns, N_LINES * max_width_px * sizeof(int32_t)},
        {(void **)&made.row, N_LINES * max_width_px * sizeof(float)},
        {(void **)&made.own_boxes, bits},
        {(void **)&made.ref_boxes, bits},
        {(void **)&made.samples, 6u * OC_SILHOUETTE_SAMPLES * sizeof(float)},
    };
    for (size_t i = 0; i < sizeof pieces / sizeof pieces[0]; i++) {
        const oc_status_t status = oc_arena_take(arena, pieces[i].bytes, pieces[i].piece);
        if (status != OC_OK) return status;
    }
    made.warped_grey = made.warped + 3u * n;
    *ws = made;
    return OC_OK;
}

/* ---- boxes in a view ---- */

/* All boxes as the view has them; false when one reaches the camera. */
static bool boxes_draw(const oc_silhouette_task_t *task, double grow, const oc_sight_t *sight, uint8_t *bits)
{
    const uint32_t w = sight->image.width_px, h = sight->image.height_px;
    oc_boxes_clear(bits, w, h);
    for (uint32_t i = 0; i < task->n_boxes; i++) {
        oc_hull_t hull;
        if (oc_hull_of_box(&task->boxes[i], grow, &sight->camera, &hull)) {
            oc_boxes_add(bits, w, h, &hull);
            continue;
        }
        /* Wholly behind it stands in nobody's way. */
        const double centre[3] = {task->boxes[i].x_m, task->boxes[i].y_m, 0.5 * task->boxes[i].height_m};
        const double reach =
            sqrt(task->boxes[i].length_m * task->boxes[i].length_m + task->boxes[i].width_m * task->boxes[i].width_m +
                 task->boxes[i].height_m * task->boxes[i].height_m);
        const double *R = sight->camera.pose.R, *t = sight->camera.pose.t;
        const double depth = R[6] * centre[0] + R[7] * centre[1] + R[8] * centre[2] + t[2];
        if (depth > -reach) return false;
    }
    return true;
}

/* ---- choice of references ---- */

typedef struct reference {
    double to_reference[9];
    double quality; /* 1 / (1 + octaves between the sizes of their pixels on the ground), less with little parallax */
    uint64_t sees[(MAX_POINTS + 63u) / 64u];
} reference_t;

typedef struct choice {
    uint32_t n_points;
    double x[MAX_POINTS], y[MAX_POINTS];
    oc_hull_t hulls[OC_MAX_SILHOUETTE_BOXES];
} choice_t;

/* Metres of ground that a pixel covers, the geometric mean of both ways. */
static double pixel_on_ground(const oc_camera_t *camera, const oc_ground_box_t *box)
{
    double c[3];
    oc_pose_centre(&camera->pose, c);
    const double dx = box->x_m - c[0], dy = box->y_m - c[1], far = sqrt(dx * dx + dy * dy + c[2] * c[2]);
    return far * sqrt(far / fmax(fabs(c[2]), 1e-9)) / camera->k.fx_px;
}

/* Distance in the reference between the middle of the subject and the ground that hides behind it. 0: not to be told. */
static double parallax_of(const oc_sight_t *view, const oc_sight_t *ref, const oc_ground_box_t *subject,
                          const double to_reference[9])
{
    const double middle[3] = {subject->x_m, subject->y_m, 0.5 * subject->height_m};
    double x, y, u, v, behind_u, behind_v;
    if (!(oc_camera_project(&view->camera, middle, &x, &y) > 0.0)) return 0.0;
    if (!(oc_camera_project(&ref->camera, middle, &u, &v) > 0.0)) return 0.0;
    /* Above the horizon, or behind the reference: as far apart as can be. */
    if (!(oc_homography_apply(to_reference, x, y, &behind_u, &behind_v) > 0.0)) return GOOD_PARALLAX_PX;
    return hypot(behind_u - u, behind_v - v);
}

/* Which sample points the reference sees as open ground. False when it is of no use. */
static bool reference_look(const oc_sight_t *view, const oc_sight_t *ref, const oc_silhouette_task_t *task,
                           choice_t *choice, reference_t *out)
{
    if (oc_plane_ground_homography(&view->camera, &ref->camera, out->to_reference) != OC_OK) return false;
    const double parallax = parallax_of(view, ref, &task->boxes[task->subject], out->to_reference);
    if (!(parallax >= MIN_PARALLAX_PX)) return false;
    uint32_t n_hulls = 0;
    for (uint32_t i = 0; i < task->n_boxes; i++) {
        if (oc_hull_of_box(&task->boxes[i], 0.0, &ref->camera, &choice->hulls[n_hulls])) n_hulls++;
    }
    const oc_ground_box_t *subject = &task->boxes[task->subject];
    const double ratio = pixel_on_ground(&ref->camera, subject) / pixel_on_ground(&view->camera, subject);
    out->quality = fmin(parallax / GOOD_PARALLAX_PX, 1.0) / (1.0 + fabs(log2(fmax(ratio, 1e-6))));
    memset(out->sees, 0, sizeof out->sees);
    for (uint32_t p = 0; p < choice->n_points; p++) {
        double u, v;
        const double depth = oc_homography_apply(out->to_reference, choice->x[p], choice->y[p], &u, &v);
        if (!(depth > 0.0) || !(u >= 1.0 && v >= 1.0)) continue;
        if (!(u < ref->image.width_px - 2.0 && v < ref->image.height_px - 2.0)) continue;
        bool is_hidden = false;
        for (uint32_t i = 0; i < n_hulls && !is_hidden; i++) is_hidden = oc_hull_contains(&choice->hulls[i], u, v);
        if (!is_hidden) out->sees[p / 64u] |= (uint64_t)1 << (p % 64u);
    }
    return true;
}

static double gain_of(const reference_t *ref, const double worth[], uint32_t n_points)
{
    double gain = 0.0;
    for (uint32_t p = 0; p < n_points; p++) {
        if (ref->sees[p / 64u] >> (p % 64u) & 1u) gain += worth[p];
    }
    return gain * ref->quality;
}

static void points_fill(const oc_hull_t *hull, const oc_pixel_rect_t *rect, choice_t *choice)
{
    choice->n_points = 0;
    for (uint32_t i = 0; i < MAX_POINTS; i++) {
        const double x = rect->x0 + (i % SAMPLES_PER_SIDE + 0.5) * (rect->x1 - rect->x0) / SAMPLES_PER_SIDE;
        const double y = rect->y0 + (i / SAMPLES_PER_SIDE + 0.5) * (rect->y1 - rect->y0) / SAMPLES_PER_SIDE;
        if (!oc_hull_contains(hull, x, y)) continue;
        choice->x[choice->n_points] = x;
        choice->y[choice->n_points++] = y;
    }
}

/* Views that together see most of the ground behind the projection, greedily. Writes indices; returns how many. */
static uint32_t references_choose(const oc_sight_t *view, const oc_sight_t refs[], uint32_t n,
                                  const oc_silhouette_task_t *task, const oc_hull_t *hull, const oc_pixel_rect_t *rect,
                                  reference_t chosen[OC_SILHOUETTE_REFERENCES],
                                  uint32_t index[OC_SILHOUETTE_REFERENCES])
{
    choice_t choice;
    points_fill(hull, rect, &choice);
    double worth[MAX_POINTS];
    for (uint32_t p = 0; p < choice.n_points; p++) worth[p] = 1.0;
    uint32_t n_chosen = 0;
    uint64_t taken = 0;
    while (n_chosen < OC_SILHOUETTE_REFERENCES) {
        double best = 0.0;
        for (uint32_t k = 0; k < n; k++) {
            reference_t one;
            if (taken >> k & 1u || !reference_look(view, &refs[k], task, &choice, &one)) continue;
            /* One that sees none of it may still know ground that a box seems to hide. */
            const double gain = gain_of(&one, worth, choice.n_points) + 1e-3 * one.quality;
            if (!(gain > best)) continue;
            best = gain;
            chosen[n_chosen] = one;
            index[n_chosen] = k;
        }
        if (!(best > 0.0)) break;
        taken |= (uint64_t)1 << index[n_chosen];
        for (uint32_t p = 0; p < choice.n_points; p++) {
            if (chosen[n_chosen].sees[p / 64u] >> (p % 64u) & 1u) worth[p] *= COVERED_WORTH;
        }
        n_chosen++;
    }
    return n_chosen;
}

/* ---- evidence ---- */

static float is_judged(const oc_silhouette_ws_t *ws, size_t i)
{
    return (ws->counts[i] & 15u) ? 1.0f : 0.0f;
}

static void evidence_fill(oc_silhouette_ws_t *ws, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        const float difference = fminf((float)ws->difference[i] * 0.25f, MAX_DIFFERENCE);
        const float e =
            DIFFERENCE_WEIGHT * difference - LIKENESS_WEIGHT * (float)ws->likeness[i] * 0.01f + EVIDENCE_OFFSET;
        const float kept = is_judged(ws, i) > 0.0f ? fminf(fmaxf(e, -MAX_EVIDENCE), MAX_EVIDENCE) : 0.0f;
        ws->evidence[i] = (int16_t)(kept * EVIDENCE_SCALE);
    }
}

/* Adds row y of the five sums of the guided filter. */
static void guide_row(oc_silhouette_ws_t *ws, uint32_t w, uint32_t y, float sign, float *columns)
{
    for (uint32_t x = 0; x < w; x++) {
        const size_t i = (size_t)y * w + x;
        const float m = sign * is_judged(ws, i), g = (float)ws->own_grey[i], p = (float)ws->evidence[i];
        columns[x] += m;
        columns[w + x] += m * g;
        columns[2u * w + x] += m * p;
        columns[3u * w + x] += m * g * g;
        columns[4u * w + x] += m * g * p;
    }
}

static void across(const float *columns, uint32_t w, uint32_t half, float *out)
{
    /* Whole numbers far below 2^24 times a window's size would round: sums anew now and then would not be exact either,
     * so each window is summed by itself. */
    for (uint32_t x = 0; x < w; x++) {
        const uint32_t from = x > half ? x - half : 0, to = x + half < w ? x + half : w - 1u;
        float sum = 0.0f;
        for (uint32_t k = from; k <= to; k++) sum += columns[k];
        out[x] = sum;
    }
}

/* slope and base of evidence over grey, for the window round each pixel. They take the room of the warped picture. */
static void guide_fit(oc_silhouette_ws_t *ws, uint32_t w, uint32_t h, int16_t *slope, int16_t *base)
{
    float *columns = (float *)(void *)ws->columns, *sums = ws->row;
    memset(columns, 0, 5u * w * sizeof columns[0]);
    for (uint32_t y = 0; y < GUIDE_HALF && y < h; y++) guide_row(ws, w, y, 1.0f, columns);
    for (uint32_t y = 0; y < h; y++) {
        if (y + GUIDE_HALF < h) guide_row(ws, w, y + GUIDE_HALF, 1.0f, columns);
        if (y > GUIDE_HALF) guide_row(ws, w, y - GUIDE_HALF - 1u, -1.0f, columns);
        for (uint32_t k = 0; k < 5u; k++) across(columns + k * w, w, GUIDE_HALF, sums + k * w);
        for (uint32_t x = 0; x < w; x++) {
            const float n = sums[x], inverse = n > 0.5f ? 1.0f / n : 0.0f;
            const float g = sums[w + x] * inverse, p = sums[2u * w + x] * inverse / EVIDENCE_SCALE;
            const float var = fmaxf(sums[3u * w + x] * inverse - g * g, 0.0f);
            const float cov = sums[4u * w + x] * inverse / EVIDENCE_SCALE - g * p;
            const float a = fminf(fmaxf(cov / (var + GUIDE_VARIANCE), -1.9f), 1.9f);
            const size_t i = (size_t)y * w + x;
            slope[i] = (int16_t)(a * SLOPE_SCALE);
            base[i] = (int16_t)(fminf(fmaxf(p - a * g, -250.0f), 250.0f) * BASE_SCALE);
        }
    }
}

static void lines_row(const int16_t *slope, const int16_t *base, uint32_t w, uint32_t y, int32_t sign, int32_t *columns)
{
    for (uint32_t x = 0; x < w; x++) {
        columns[x] += sign * slope[(size_t)y * w + x];
        columns[w + x] += sign * base[(size_t)y * w + x];
    }
}

static void across_whole(const int32_t *columns, uint32_t w, uint32_t half, int32_t *out)
{
    int32_t sum = 0;
    for (uint32_t x = 0; x < half && x < w; x++) sum += columns[x];
    for (uint32_t x = 0; x < w; x++) {
        if (x + half < w) sum += columns[x + half];
        if (x > half) sum -= columns[x - half - 1u];
        out[x] = sum;
    }
}

/* The mean line through each pixel, at its own grey value: smoothed evidence in place. */
static void guide_apply(oc_silhouette_ws_t *ws, uint32_t w, uint32_t h, const int16_t *slope, const int16_t *base)
{
    int32_t *columns = ws->columns, *sums = (int32_t *)(void *)ws->row;
    memset(columns, 0, 2u * w * sizeof columns[0]);
    for (uint32_t y = 0; y < GUIDE_HALF && y < h; y++) lines_row(slope, base, w, y, 1, columns);
    for (uint32_t y = 0; y < h; y++) {
        if (y + GUIDE_HALF < h) lines_row(slope, base, w, y + GUIDE_HALF, 1, columns);
        if (y > GUIDE_HALF) lines_row(slope, base, w, y - GUIDE_HALF - 1u, -1, columns);
        across_whole(columns, w, GUIDE_HALF, sums);
        across_whole(columns + w, w, GUIDE_HALF, sums + w);
        for (uint32_t x = 0; x < w; x++) {
            const float a = (float)sums[x] / SLOPE_SCALE, b = (float)sums[w + x] / BASE_SCALE;
            const float e = a * (float)ws->own_grey[(size_t)y * w + x] + b;
            /* Only the sign counts from here on. */
            ws->evidence[(size_t)y * w + x] = e > 0.0f ? (int16_t)1 : (int16_t)-1;
        }
    }
}

/* ---- labels ---- */

static uint8_t label_best(const oc_silhouette_ws_t *ws, size_t i)
{
    if (ws->counts[i] & 15u) return ws->evidence[i] > 0 ? OC_LABEL_OBSTACLE : OC_LABEL_GROUND;
    return ws->counts[i] >> 4 >= MIN_SURE ? OC_LABEL_GROUND : OC_LABEL_UNKNOWN;
}

static uint8_t label_thesis(const oc_silhouette_ws_t *ws, size_t i, uint32_t n_references)
{
    const uint32_t n_ground = ws->counts[i] & 15u, n_obstacle = (uint32_t)ws->counts[i] >> 4;
    const oc_votes_t votes = {n_references - n_ground - n_obstacle, n_obstacle, n_ground};
    return (uint8_t)oc_silhouette_vote_thesis(&votes);
}

/* What a window mostly says; obstacle before unknown before ground. */
static void majority(const uint8_t *in, uint32_t w, uint32_t h, uint8_t *out)
{
    for (uint32_t y = 0; y < h; y++) {
        const uint32_t y0 = y > MAJORITY_HALF ? y - MAJORITY_HALF : 0;
        const uint32_t y1 = y + MAJORITY_HALF < h ? y + MAJORITY_HALF : h - 1u;
        for (uint32_t x = 0; x < w; x++) {
            const uint32_t x0 = x > MAJORITY_HALF ? x - MAJORITY_HALF : 0;
            const uint32_t x1 = x + MAJORITY_HALF < w ? x + MAJORITY_HALF : w - 1u;
            const uint8_t here = in[(size_t)y * w + x];
            uint32_t n[3] = {0, 0, 0};
            for (uint32_t v = y0; v <= y1; v++) {
                for (uint32_t u = x0; u <= x1; u++) n[in[(size_t)v * w + u]]++;
            }
            uint8_t best = here;
            if (n[OC_LABEL_GROUND] > n[best]) best = OC_LABEL_GROUND;
            if (n[OC_LABEL_UNKNOWN] > n[best]) best = OC_LABEL_UNKNOWN;
            if (n[OC_LABEL_OBSTACLE] >= n[best]) best = OC_LABEL_OBSTACLE;
            out[(size_t)y * w + x] = best;
        }
    }
}

/* Outside the projection a row goes on as it ends: that costs nothing to send. */
static void outside_fill(const oc_hull_t *hull, const oc_pixel_rect_t *rect, uint8_t *labels)
{
    const uint32_t w = rect->x1 - rect->x0, h = rect->y1 - rect->y0;
    for (uint32_t y = 0; y < h; y++) {
        uint8_t *row = labels + (size_t)y * w;
        double from, to;
        if (!oc_hull_span(hull, (double)rect->y0 + y, &from, &to) || to < rect->x0 || from >= rect->x1) {
            memset(row, OC_LABEL_GROUND, w);
            continue;
        }
        const uint32_t first = from > rect->x0 ? (uint32_t)from - rect->x0 : 0;
        const uint32_t last = to < rect->x1 ? (uint32_t)to - rect->x0 : w - 1u;
        memset(row, row[first], first);
        memset(row + last, row[last], w - last);
    }
}

static void cut(const uint8_t *in, uint32_t in_width, uint32_t x0, uint32_t y0, uint32_t w, uint32_t h, uint8_t *out)
{
    for (uint32_t y = 0; y < h; y++) memmove(out + (size_t)y * w, in + (size_t)(y0 + y) * in_width + x0, w);
}

static oc_pixel_rect_t grown(const oc_pixel_rect_t *rect, uint32_t width_px, uint32_t height_px)
{
    return (oc_pixel_rect_t){rect->x0 > MARGIN_PX ? rect->x0 - MARGIN_PX : 0,
                             rect->y0 > MARGIN_PX ? rect->y0 - MARGIN_PX : 0,
                             rect->x1 + MARGIN_PX < width_px ? rect->x1 + MARGIN_PX : width_px,
                             rect->y1 + MARGIN_PX < height_px ? rect->y1 + MARGIN_PX : height_px};
}

static bool sight_is_valid(const oc_sight_t *s)
{
    return oc_image_is_valid(&s->image) && oc_intrinsics_is_valid(&s->camera.k) && oc_pose_is_valid(&s->camera.pose) &&
           s->camera.k.width_px == s->image.width_px && s->camera.k.height_px == s->image.height_px;
}

oc_status_t oc_silhouette_find(oc_silhouette_ws_t *ws, const oc_sight_t *view, const oc_sight_t refs[], uint32_t n,
                               const oc_silhouette_task_t *task, oc_pixel_rect_t *rect, const uint8_t **labels)
{
    OC_ASSERT(ws && view && (refs || n == 0) && task && rect && labels);
    if (!sight_is_valid(view) || n > OC_MAX_SILHOUETTE_VIEWS || task->n_boxes > OC_MAX_SILHOUETTE_BOXES ||
        task->subject >= task->n_boxes || !(task->grow >= 0.0 && task->grow <= 1.0))
        return OC_E_ARG;
    const uint32_t width = view->image.width_px, height = view->image.height_px;
    for (uint32_t k = 0; k <= n; k++) {
        const oc_sight_t *one = k < n ? &refs[k] : view;
        if (!sight_is_valid(one)) return OC_E_ARG;
        if (one->image.width_px > ws->max_width_px || one->image.height_px > ws->max_height_px) return OC_E_LIMIT;
    }
    oc_hull_t hull;
    oc_pixel_rect_t inner;
    if (!oc_hull_of_box(&task->boxes[task->subject], task->grow, &view->camera, &hull)) return OC_E_DEGENERATE;
    if (!oc_hull_rect(&hull, width, height, &inner)) return OC_E_DEGENERATE;
    if (!boxes_draw(task, task->grow, view, ws->own_boxes)) return OC_E_DEGENERATE;

    oc_comparison_t cmp = {.view = view, .rect = grown(&inner, width, height), .method = task->method};
    reference_t chosen[OC_SILHOUETTE_REFERENCES];
    uint32_t index[OC_SILHOUETTE_REFERENCES], n_used = 0;
    const uint32_t n_chosen = references_choose(view, refs, n, task, &hull, &inner, chosen, index);
    oc_compare_begin(ws, view, &cmp.rect);
    for (uint32_t k = 0; k < n_chosen; k++) {
        cmp.reference = &refs[index[k]];
        memcpy(cmp.to_reference, chosen[k].to_reference, sizeof cmp.to_reference);
        if (!boxes_draw(task, 0.0, cmp.reference, ws->ref_boxes)) continue;
        if (oc_compare_add(ws, &cmp)) n_used++;
    }

    const uint32_t w = cmp.rect.x1 - cmp.rect.x0, h = cmp.rect.y1 - cmp.rect.y0;
    const size_t n_px = (size_t)w * h;
    uint8_t *raw = ws->own, *clean = ws->own + n_px;
    if (task->method == OC_SILHOUETTE_THESIS) {
        for (size_t i = 0; i < n_px; i++) raw[i] = label_thesis(ws, i, n_used);
        memcpy(clean, raw, n_px);
    } else {
        int16_t *slope = (int16_t *)(void *)ws->warped, *base = slope + ws->max_px;
        evidence_fill(ws, n_px);
        guide_fit(ws, w, h, slope, base);
        guide_apply(ws, w, h, slope, base);
        for (size_t i = 0; i < n_px; i++) raw[i] = label_best(ws, i);
        majority(raw, w, h, clean);
    }
    cut(clean, w, inner.x0 - cmp.rect.x0, inner.y0 - cmp.rect.y0, inner.x1 - inner.x0, inner.y1 - inner.y0, clean);
    outside_fill(&hull, &inner, clean);
    *rect = inner;
    *labels = clean;
    return OC_OK;
}

void oc_silhouette_to_cells(const oc_pixel_rect_t *rect, const uint8_t labels[], uint32_t step_px, oc_silhouette_t *out,
                            uint8_t cells[])
{
    OC_ASSERT(rect && labels && out && cells && step_px > 0);
    const uint32_t col = rect->x0 / step_px, row = rect->y0 / step_px, w = rect->x1 - rect->x0;
    const uint32_t n_cols = (rect->x1 + step_px - 1u) / step_px - col;
    const uint32_t n_rows = (rect->y1 + step_px - 1u) / step_px - row;
    for (uint32_t r = 0; r < n_rows; r++) {
        for (uint32_t c = 0; c < n_cols; c++) {
            uint32_t n[3] = {0, 0, 0};
            for (uint32_t y = (row + r) * step_px; y < (row + r + 1u) * step_px; y++) {
                for (uint32_t x = (col + c) * step_px; x < (col + c + 1u) * step_px; x++) {
                    if (x < rect->x0 || x >= rect->x1 || y < rect->y0 || y >= rect->y1) continue;
                    n[labels[(size_t)(y - rect->y0) * w + (x - rect->x0)]]++;
                }
            }
            uint8_t best = OC_LABEL_OBSTACLE;
            if (n[OC_LABEL_UNKNOWN] > n[best]) best = OC_LABEL_UNKNOWN;
            if (n[OC_LABEL_GROUND] > n[best]) best = OC_LABEL_GROUND;
            cells[(size_t)r * n_cols + c] = best;
        }
    }
    *out = (oc_silhouette_t){.view = out->view,
                             .key = out->key,
                             .box = out->box,
                             .step_px = (uint8_t)step_px,
                             .col = (uint16_t)col,
                             .row = (uint16_t)row,
                             .n_cols = (uint16_t)n_cols,
                             .n_rows = (uint16_t)n_rows};
}
