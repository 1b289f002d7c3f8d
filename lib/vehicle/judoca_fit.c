/* SPDX-License-Identifier: BSD-3-Clause
 * Sub-pixel step of the junction detector: all branches and their common apex in one least-squares fit. */
#include "vehicle/judoca_fit.h"

#include <math.h>
#include <string.h>

#include "core/angle.h"

#define PI 3.14159265358979f

/* A branch is fitted over at least this length. */
#define SPAN_PX 4.0f

/* The apex is at most the reach of the blur plus this from the pixel where the
 * junction was seen. */
#define BLUNT_PX 0.5f

/* A third branch whose line misses the apex by more is another edge. */
#define STRAY_PX 0.75f

/* Fits after the first look, at most; another is done while the apex moves by more than SETTLED_PX. */
#define PASSES 3u
#define SETTLED_PX 0.05f

/* First look: nearer to the apex than INNER + ACUTE cot(angle to the nearest
 * branch) the ridges of an acute pair have run into each other. */
#define INNER_PX 1.5f
#define ACUTE_PX 2.5f
#define ACUTE_MAX_PX 5.0f

/* Longest branch of the first look, whose directions are good to a few degrees only. */
#define FIRST_LOOK_PX 8.0f

/* Each fit follows the branches this much further than the one before. */
#define GROWTH 1.6f

/* After a first look that moved the apex by more, the branches are sought over two pixels once more. */
#define AGAIN_PX 1.0f
#define VAGUE_PX 0.3f

/* The furthest pixel that a look round the apex takes in, and what counts as a branch that is there already. */
#define RING_REACH 11
#define RING_SAME_COS 0.9f
#define RING_HIDDEN_COS 0.6f
#define RING_CONTRAST 0.9f

/* With the rivals taken off, positions from here on count. */
#define MODEL_INNER_PX 1.5f

/* Variance that optics and pixels add to the Gaussian's, at least and at most. */
#define MIN_BLUR_PX2 0.3f
#define MAX_BLUR_PX2 4.0f

/* Floor of a position's sd: what sampling alone leaves. */
#define FLOOR_SIGMA_PX 0.03f

/* Contrast at which the score reaches one half, grey levels per px. */
#define HALF_CONTRAST 20.0f

/* libm's take NaN into account and are calls. */
static inline float larger(float a, float b)
{
    return a > b ? a : b;
}

static inline float smaller(float a, float b)
{
    return a < b ? a : b;
}

/* How far a pass looks across and along a branch. */
typedef struct fit_reach {
    int32_t across_px;
    float inner_px, shortest_px, longest_px;
    bool has_model;
} fit_reach_t;

static float fit_cos_between(const oc_fit_branch_t *a, const oc_fit_branch_t *b)
{
    return a->ux * b->ux + a->uy * b->uy;
}

static float fit_sin_between(const oc_fit_branch_t *a, const oc_fit_branch_t *b)
{
    return fabsf(a->ux * b->uy - a->uy * b->ux);
}

/* ---- all branches ---- */

static void fit_remove(oc_fit_t *fit, uint32_t i)
{
    memmove(&fit->branch[i], &fit->branch[i + 1], (fit->n - i - 1u) * sizeof fit->branch[0]);
    fit->n--;
}

/* Of two branches with nearly one direction (the sides of a thin line) keep
 * the one of higher contrast. */
static void fit_merge(oc_fit_t *fit, float cos_min_angle)
{
    for (uint32_t i = 0; i < fit->n; i++) {
        for (uint32_t j = i + 1; j < fit->n;) {
            if (fit_cos_between(&fit->branch[i], &fit->branch[j]) <= cos_min_angle) {
                j++;
                continue;
            }
            if (fit->branch[j].amplitude > fit->branch[i].amplitude) fit->branch[i] = fit->branch[j];
            fit_remove(fit, j);
        }
    }
}

/* Variance of one position of amplitude 1, pooled over the branches. */
static float fit_pooled(const oc_fit_t *fit)
{
    float sum = 0.0f, n = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        const oc_fit_branch_t *b = &fit->branch[i];
        const float rms = b->rms_px * b->amplitude, spare = b->n - 2.0f;
        sum += rms * rms * spare;
        n += spare;
    }
    return sum / larger(n, 1.0f);
}

/* The apex that all lines agree on best. A branch counts by how well its own
 * line is known at the present apex. False when they are parallel. */
static bool fit_intersect(oc_fit_t *fit, float move[2])
{
    const float pooled = fit_pooled(fit);
    float a = 0, b = 0, c = 0, d = 0, e = 0;
    for (uint32_t i = 0; i < fit->n; i++) {
        const oc_fit_branch_t *branch = &fit->branch[i];
        const oc_fit_sums_t *s = &branch->sums;
        const float variance = pooled / (branch->amplitude * branch->amplitude) + FLOOR_SIGMA_PX * FLOOR_SIGMA_PX;
        const float w = (s->w - s->wt * s->wt / s->wtt) / variance;
        const float nx = -branch->uy, ny = branch->ux;
        a += w * nx * nx;
        b += w * nx * ny;
        c += w * ny * ny;
        d += w * nx * branch->offset_px;
        e += w * ny * branch->offset_px;
    }
    const float det = a * c - b * b;
    const float half = 0.5f * (a + c);
    if (!(det > 1e-6f * half * half)) return false;

    move[0] = (c * d - b * e) / det;
    move[1] = (a * e - b * d) / det;
    /* Smaller eigenvalue of the information, without cancellation. */
    const float root = sqrtf(larger(half * half - det, 0.0f));
    fit->sigma_px = sqrtf((half + root) / det);
    return true;
}

static float fit_miss(const oc_fit_branch_t *b, const float move[2])
{
    return fabsf(b->offset_px - (b->ux * move[1] - b->uy * move[0]));
}

/* Drop the branch whose line misses the apex most, if by too much and three
 * or more are left. */
static bool fit_drop_stray(oc_fit_t *fit, const float move[2])
{
    uint32_t worst = 0;
    for (uint32_t i = 1; i < fit->n; i++) {
        if (fit_miss(&fit->branch[i], move) > fit_miss(&fit->branch[worst], move)) worst = i;
    }
    if (fit->n <= 2 || fit_miss(&fit->branch[worst], move) <= STRAY_PX) return false;
    fit_remove(fit, worst);
    return true;
}

/* Move the apex and turn each branch to what fits best through it. */
static void fit_apply(oc_fit_t *fit, const float move[2])
{
    for (uint32_t i = 0; i < fit->n; i++) {
        oc_fit_branch_t *b = &fit->branch[i];
        const float shift = b->ux * move[1] - b->uy * move[0];
        const float turn = (b->sums.wtd - b->sums.wt * shift) / b->sums.wtt;
        const float ux = b->ux - turn * b->uy, uy = b->uy + turn * b->ux;
        const float inv = 1.0f / sqrtf(ux * ux + uy * uy);
        b->ux = ux * inv;
        b->uy = uy * inv;
    }
    fit->x_px += move[0];
    fit->y_px += move[1];
}

/* Blur of the ridges from how sharply they bend: of a Gaussian of variance v,
 * bend / 2 value = 1 - exp(-1 / 2 v). */
static void fit_measure_blur(oc_fit_t *fit, float sigma_px)
{
    float sum = 0.0f, n = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        const oc_fit_branch_t *b = &fit->branch[i];
        const float major2 = larger(b->ux * b->ux, b->uy * b->uy);
        const float q = 0.5f * b->sums.bend / b->sums.level;
        if (!(b->sums.level > 0.0f && q > 0.02f && q < 0.6f)) continue;
        sum += b->sums.level * major2 / (2.0f * (q + q * q * (0.5f + q * (1.0f / 3.0f + 0.25f * q))));
        n += b->sums.level;
    }
    if (!(n > 0.0f)) return;
    const float base = sigma_px * sigma_px;
    fit->blur_px2 = smaller(larger(sum / n, base + MIN_BLUR_PX2), base + MAX_BLUR_PX2);
}

static void fit_list(const oc_fit_t *fit, oc_fit_crowd_t *crowd)
{
    crowd->n = fit->n;
    for (uint32_t i = 0; i < fit->n; i++) {
        const oc_fit_branch_t *b = &fit->branch[i];
        crowd->ux[i] = b->ux;
        crowd->uy[i] = b->uy;
        crowd->side[i] = b->side;
        crowd->amplitude[i] = b->amplitude;
    }
}

static float fit_largest_cot(const oc_kernels_t *kernels, oc_fit_t *fit)
{
    float cot[OC_FIT_MAX_BRANCHES], largest = 0.0f;
    fit_list(fit, &fit->crowd);
    kernels->acute(&fit->crowd, cot);
    for (uint32_t i = 0; i < fit->n; i++) largest = larger(largest, cot[i]);
    return largest;
}

/* Is the apex where a corner seen at the pixel may have it? Blur moves the
 * seen tip of an acute corner inwards. */
static bool fit_is_near(const oc_kernels_t *kernels, oc_fit_t *fit)
{
    const float dx = fit->x_px - fit->from_x_px;
    const float dy = fit->y_px - fit->from_y_px;
    const float away2 = dx * dx + dy * dy, always_px = INNER_PX + 2.0f + BLUNT_PX;
    if (away2 <= always_px * always_px) return true;

    const float limit_px = smaller(INNER_PX + 2.0f * ACUTE_PX * fit_largest_cot(kernels, fit), 6.0f) + 2.0f + BLUNT_PX;
    return away2 <= limit_px * limit_px;
}

/* Two branches that are neither one nor a line. */
static bool fit_bends(const oc_fit_t *fit, float cos_min_angle, float cos_min_bend)
{
    for (uint32_t i = 1; i < fit->n; i++) {
        for (uint32_t j = 0; j < i; j++) {
            const float c = fit_cos_between(&fit->branch[i], &fit->branch[j]);
            if (c <= cos_min_angle && c >= -cos_min_bend) return true;
        }
    }
    return false;
}

/* What an acute pair loses at the tip it may take further out. */
static void span_from(const fit_reach_t *reach, float inner_px, oc_fit_span_t *span)
{
    span->inner_px = inner_px;
    span->shortest_px = larger(reach->shortest_px, inner_px + SPAN_PX);
    span->longest_px = larger(reach->longest_px + inner_px - reach->inner_px, span->shortest_px);
}

static oc_fit_blur_t blur_of(float s2)
{
    const float s = sqrtf(s2), st = sqrtf(s2 - OC_FIT_DIFFERENCE_PX2), inv_s = 1.0f / s;
    return (oc_fit_blur_t){s, st, inv_s, 1.0f / st, inv_s * inv_s};
}

/* Follow all branches where their neighbours allow; those that do not hold there, from as near to the apex as the
 * others. Returns those that hold. */
static uint32_t fit_follow(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const fit_reach_t *reach,
                           oc_fit_t *fit)
{
    float cot[OC_FIT_MAX_BRANCHES];
    fit_list(fit, &fit->crowd);
    gradient->kernels->acute(&fit->crowd, cot);
    const oc_fit_blur_t blur = blur_of(fit->blur_px2);
    const float searched = reach->across_px > 0 ? 1.0f : 0.0f;
    const uint32_t all = (1u << fit->n) - 1u;
    oc_fit_span_t span[OC_FIT_MAX_BRANCHES];
    uint32_t again = 0;
    for (uint32_t i = 0; i < fit->n; i++) {
        const float acute_px = smaller(ACUTE_PX * cot[i], ACUTE_MAX_PX), further_px = searched * acute_px;
        span[i].crowded_px = reach->inner_px + acute_px;
        span[i].asked_px = reach->shortest_px;
        span[i].across_px = reach->across_px;
        span[i].has_model = reach->has_model;
        span_from(reach, reach->inner_px + further_px, &span[i]);
        again |= (uint32_t)((further_px > 0.5f) & (fit->branch[i].n > 0.0f)) << i;
    }
    const uint32_t holds = oc_judoca_branches_follow(gradient, rules, fit, &blur, all, span);
    again &= ~holds;
    if (again == 0) return holds;
    for (uint32_t i = 0; i < fit->n; i++) span_from(reach, reach->inner_px, &span[i]);
    return holds | oc_judoca_branches_follow(gradient, rules, fit, &blur, again, span);
}

/* Keep the branches whose bit is set. */
static void fit_keep(oc_fit_t *fit, uint32_t holds)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < fit->n; i++) {
        if (!(holds >> i & 1u)) continue;
        if (n != i) fit->branch[n] = fit->branch[i];
        n++;
    }
    fit->n = n;
}

/* Once round: follow all branches from the apex, then move the apex. */
static bool fit_pass(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const fit_reach_t *reach,
                     oc_fit_t *fit, float *moved_px)
{
    const uint32_t holds = fit_follow(gradient, rules, reach, fit);
    if (holds != (1u << fit->n) - 1u) fit_keep(fit, holds);
    fit_merge(fit, rules->cos_min_angle);
    if (fit->n < 2) return false;

    float move[2];
    if (!fit_intersect(fit, move)) return false;
    if (fit_drop_stray(fit, move) && !fit_intersect(fit, move)) return false;
    fit_apply(fit, move);
    *moved_px = sqrtf(move[0] * move[0] + move[1] * move[1]);
    fit_measure_blur(fit, rules->sigma_px);
    return fit_is_near(gradient->kernels, fit) &&
           fit_bends(fit, rules->cos_min_angle, reach->has_model ? rules->cos_min_bend : rules->cos_first_bend);
}

void oc_judoca_ring_build(oc_ring_table_t *table, int32_t first_px, uint32_t width_px)
{
    OC_ASSERT(table && first_px + (int32_t)OC_RING_SAMPLES <= RING_REACH);

    for (uint32_t d = 0; d < OC_RAYS; d++) {
        const double angle = d * 6.283185307179586 / OC_RAYS;
        table->ux[d] = (float)cos(angle);
        table->uy[d] = (float)sin(angle);
        table->across[d][0] = (int16_t)lrint(-(1 << 14) * sin(angle));
        table->across[d][1] = (int16_t)lrint((1 << 14) * cos(angle));
        for (uint32_t s = 0; s < OC_RING_SAMPLES; s++) {
            const double radius = first_px + (int32_t)s;
            table->at[s][d] =
                (int32_t)lrint(radius * sin(angle)) * (int32_t)width_px + (int32_t)lrint(radius * cos(angle));
        }
    }
}

/* A branch that has not been followed yet. */
static void branch_begin(oc_fit_branch_t *branch, float ux, float uy, float side, float amplitude)
{
    branch->ux = ux;
    branch->uy = uy;
    branch->side = side;
    branch->amplitude = amplitude;
    branch->n = 0.0f;
}

bool oc_judoca_fit_begin(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, float x_px, float y_px,
                         const oc_fit_seed_t seed[], uint32_t n_seeds, oc_fit_t *fit)
{
    OC_ASSERT(gradient && rules && seed && fit);

    fit->x_px = fit->from_x_px = x_px;
    fit->y_px = fit->from_y_px = y_px;
    fit->blur_px2 = rules->sigma_px * rules->sigma_px + 0.9f;
    fit->n = n_seeds < OC_FIT_MAX_BRANCHES ? n_seeds : OC_FIT_MAX_BRANCHES;
    for (uint32_t i = 0; i < fit->n; i++) branch_begin(&fit->branch[i], seed[i].ux, seed[i].uy, seed[i].side, 0.0f);
    memset(&fit->crowd, 0, sizeof fit->crowd);
    const float shortest_px = smaller(rules->lambda_min_px, FIRST_LOOK_PX);
    const fit_reach_t reach = {2, INNER_PX, shortest_px, shortest_px + 1.0f, false};
    return fit_pass(gradient, rules, &reach, fit, &fit->moved_px);
}

/* ---- branches the place did not show ---- */

/* Derivatives across all directions near the apex, or a little further out, and in which of them (bit d) an edge
 * runs; none near the border. */
static uint32_t ring_measure(const oc_gradient_t *gradient, const oc_fit_t *fit, float t_b,
                             const oc_ring_table_t *table, float ring[OC_RAYS])
{
    const int32_t x = (int32_t)floorf(fit->x_px + 0.5f), y = (int32_t)floorf(fit->y_px + 0.5f);
    const int32_t width = (int32_t)gradient->width_px, height = (int32_t)gradient->height_px;
    if (x < RING_REACH || y < RING_REACH || x + RING_REACH >= width || y + RING_REACH >= height) return 0;
    return gradient->kernels->ring(table, gradient->dxdy + 2 * ((ptrdiff_t)y * width + x), 0.4f * t_b,
                                   RING_CONTRAST * t_b, ring);
}

/* Is a direction new? One further out is only when it is near to a branch's, whose ridge hid it near the apex. */
static bool fit_lacks(const oc_fit_t *fit, const oc_fit_branch_t *made, bool is_far)
{
    float nearest = -1.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        const float cosine = fit_cos_between(&fit->branch[i], made);
        if (fit->branch[i].side == made->side && cosine > RING_SAME_COS) return false;
        nearest = larger(nearest, cosine);
    }
    return !is_far || nearest > RING_HIDDEN_COS;
}

/* Seen from where the apex turned out to be, edges may run in directions that
 * the place, a pixel or two aside, did not show: those are added. */
static void fit_look_round(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, bool is_far, oc_fit_t *fit)
{
    float ring[OC_RAYS];
    const float t_b = rules->t_b * (float)OC_GRADIENT_ONE;
    uint32_t rest = ring_measure(gradient, fit, t_b, &rules->ring[is_far], ring);
    for (; rest && fit->n < OC_FIT_MAX_BRANCHES; rest &= rest - 1u) {
        const uint32_t d = (uint32_t)__builtin_ctz(rest);
        oc_fit_branch_t *made = &fit->branch[fit->n];
        branch_begin(made, rules->ring[0].ux[d], rules->ring[0].uy[d], ring[d] > 0.0f ? 1.0f : -1.0f, fabsf(ring[d]));
        if (fit_lacks(fit, made, is_far)) fit->n++;
    }
}

/* ---- the junction ---- */

/* The best pair makes the junction: score and straight-line test look at it. */
static float fit_pair_score(const oc_fit_t *fit, uint32_t i, uint32_t j, float cos_min_bend)
{
    const oc_fit_branch_t *a = &fit->branch[i], *b = &fit->branch[j];
    if (fit_cos_between(a, b) < -cos_min_bend) return 0.0f;

    const float contrast = smaller(a->amplitude, b->amplitude) / (float)OC_GRADIENT_ONE;
    const float share = smaller(a->share, b->share);
    const float length = smaller(a->length_px, b->length_px);
    return contrast / (contrast + HALF_CONTRAST) * share * fit_sin_between(a, b) * sqrtf(length);
}

static float fit_score(const oc_fit_t *fit, float cos_min_bend)
{
    float best = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        for (uint32_t j = i + 1; j < fit->n; j++) best = larger(best, fit_pair_score(fit, i, j, cos_min_bend));
    }
    return best / (1.0f + 4.0f * fit->sigma_px);
}

void oc_judoca_sort_branches(oc_junction_t *junction)
{
    for (uint32_t i = 1; i < junction->n_branches; i++) {
        const oc_branch_t b = junction->branch[i];
        uint32_t at = i;
        for (; at > 0 && junction->branch[at - 1].angle_rad > b.angle_rad; at--) {
            junction->branch[at] = junction->branch[at - 1];
        }
        junction->branch[at] = b;
    }
}

/* In [0, 2 pi). */
static float branch_angle(float ux, float uy)
{
    const float angle = oc_angle_of(uy, ux);
    const float positive = angle < 0.0f ? angle + 2.0f * PI : angle;
    return positive < 2.0f * PI ? positive : 0.0f;
}

static void fit_write(const oc_fit_t *fit, float score, oc_junction_t *junction)
{
    memset(junction, 0, sizeof *junction);
    junction->x_px = fit->x_px;
    junction->y_px = fit->y_px;
    junction->score = score;
    for (uint32_t i = 0; i < fit->n && i < OC_MAX_BRANCHES; i++) {
        const oc_fit_branch_t *b = &fit->branch[i];
        junction->branch[junction->n_branches++] =
            (oc_branch_t){branch_angle(b->ux, b->uy), b->length_px, smaller(b->share, 1.0f)};
    }
    oc_judoca_sort_branches(junction);
    junction->kind = (uint8_t)oc_junction_kind_of(junction->branch, junction->n_branches);
}

bool oc_judoca_fit_finish(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, oc_fit_t *fit,
                          oc_junction_t *junction)
{
    OC_ASSERT(gradient && rules && fit && junction);

    float moved_px = 1.0f, length_px = FIRST_LOOK_PX;
    for (uint32_t pass = 0; pass < PASSES; pass++) {
        if (pass < 2) fit_look_round(gradient, rules, pass == 1, fit);
        const bool is_whole = length_px >= rules->lambda_px;
        length_px = smaller(GROWTH * length_px, rules->lambda_px);
        const int32_t across_px = pass == 0  ? (fit->moved_px > AGAIN_PX || fit->sigma_px > VAGUE_PX ? 2 : 1)
                                  : is_whole ? 0
                                             : 1;
        const fit_reach_t reach = {across_px, MODEL_INNER_PX, smaller(rules->lambda_min_px, length_px), length_px,
                                   true};
        if (!fit_pass(gradient, rules, &reach, fit, &moved_px)) return false;
        if (is_whole && moved_px <= SETTLED_PX) break;
    }
    if (!(fit->sigma_px <= rules->max_apex_sigma_px)) return false;

    const float score = fit_score(fit, rules->cos_min_bend);
    if (!(score > 0.0f)) return false;
    fit_write(fit, score, junction);
    return true;
}
