/* SPDX-License-Identifier: BSD-3-Clause
 * Sub-pixel step of the junction detector: all branches and their common apex in one least-squares fit. */
#include "vehicle/judoca_fit.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979f

/* A branch is fitted over at least this length and this many positions. */
#define SPAN_PX 4.0f
#define MIN_SAMPLES 3u

/* The apex is at most the reach of the blur plus this from the pixel where the
 * junction was seen. */
#define BLUNT_PX 0.5f

/* A third branch whose line misses the apex by more is another edge. */
#define STRAY_PX 0.75f

/* Fits after the first look, at most; another is done while the apex moves by more than SETTLED_PX. */
#define PASSES 4u
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

/* Share of the shortest length at which the last position may lie: noise hides single ones. */
#define LEAST_LENGTH 0.8f

/* Pixels from the apex that a look round the apex takes in, and what counts as a branch that is there already. */
#define RING_FIRST 3
#define RING_LAST 7
#define RING_STEP 3
#define RING_SAME_COS 0.9f

/* With the rivals taken off, positions from here on count. */
#define MODEL_INNER_PX 1.5f

/* Samples beyond this measure the blur. */
#define FAR_PX 3.0f

/* A ridge's variance across and along the edge differ by what the central difference adds across. */
#define DIFFERENCE_PX2 0.25f

/* Variance that optics and pixels add to the Gaussian's, at least and at most. */
#define MIN_BLUR_PX2 0.3f
#define MAX_BLUR_PX2 4.0f

/* Least ridge of a branch and least derivative of one of its positions, in units of t_b: noise lifts a weak edge
 * over the threshold here and there, and the share of such pixels is asked for anyway. */
#define LEAST_CONTRAST 0.7f
#define LEAST_DERIVATIVE 0.5f

/* Floor of a position's sd: what sampling alone leaves. */
#define FLOOR_SIGMA_PX 0.03f

/* A branch is taken beyond its shortest length only while it stays this straight. */
#define GROW_RMS_PX 0.25f

/* Contrast at which the score reaches one half, grey levels per px. */
#define HALF_CONTRAST 6.0f

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

/* ---- one branch ---- */

/* Samples from r0 to longest_px along a branch, cut to the image. */
static oc_fit_walk_t walk_make(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const oc_fit_t *fit,
                               const oc_fit_branch_t *branch, float r0, float longest_px, int32_t reach)
{
    const float ux = branch->ux, uy = branch->uy;
    const bool flat = fabsf(ux) >= fabsf(uy);
    const int32_t width = (int32_t)gradient->width_px, height = (int32_t)gradient->height_px;
    const float major = flat ? ux : uy;
    oc_fit_walk_t walk = {
        .dxdy = gradient->dxdy,
        .step_major = flat ? 1 : width,
        .step_minor = flat ? width : 1,
        .n_minor = flat ? height : width,
        .a_major = flat ? fit->x_px : fit->y_px,
        .a_minor = flat ? fit->y_px : fit->x_px,
        .slope = flat ? uy / ux : ux / uy,
        .sign = major > 0.0f ? 1 : -1,
        .nx = -uy * branch->side,
        .ny = ux * branch->side,
        .own_major = major,
        .own_minor = flat ? uy : ux,
        .floor = LEAST_DERIVATIVE * rules->t_b * (float)OC_GRADIENT_ONE,
        .reach = reach,
    };
    const float from = walk.a_major + r0 * major, to = walk.a_major + longest_px * major;
    const int32_t last_inside = (flat ? width : height) - 2;
    int32_t first = (int32_t)(walk.sign > 0 ? ceilf(from) : floorf(from));
    int32_t last = (int32_t)(walk.sign > 0 ? floorf(to) : ceilf(to));
    if (walk.sign > 0 && last > last_inside) last = last_inside;
    if (walk.sign < 0 && last < 1) last = 1;
    const int32_t n = (last - first) * walk.sign + 1;
    const bool starts_inside = first >= 1 && first <= last_inside;
    walk.first = first;
    walk.n = n > 0 && starts_inside ? (uint32_t)n : 0;
    if (walk.n > OC_FIT_SAMPLES) walk.n = OC_FIT_SAMPLES;
    return walk;
}

/* What the other branches add to this one's derivative. */
static uint32_t rivals_make(const oc_fit_t *fit, uint32_t self, oc_fit_rival_t rivals[OC_FIT_MAX_BRANCHES])
{
    const oc_fit_branch_t *own = &fit->branch[self];
    uint32_t n = 0;
    for (uint32_t j = 0; j < fit->n; j++) {
        const oc_fit_branch_t *other = &fit->branch[j];
        const float agree = own->side * other->side * fit_cos_between(own, other);
        if (j == self || fabsf(agree) < 0.02f) continue;
        rivals[n++] = (oc_fit_rival_t){other->ux, other->uy, agree * other->amplitude};
    }
    return n;
}

/* Sums over the first samples of a branch. */
typedef struct fit_prefix {
    oc_fit_sums_t sums;
    float t;
    float share; /* edges / looked for */
} fit_prefix_t;

/* Share of the full ridge at a distance from the apex: the Gaussian's integral, a cubic is enough for a weight. */
static float fit_gain(float t, float inv_st)
{
    float x = t * inv_st * (1.0f / 2.4f);
    x = x < 1.0f ? x : 1.0f;
    return 0.5f + 0.75f * x - 0.25f * x * x * x;
}

static void prefix_add(oc_fit_sums_t *s, float t, float d, float value, float bend, float gain)
{
    const float w = gain * gain;
    s->w += w;
    s->wt += w * t;
    s->wtt += w * t * t;
    s->wd += w * d;
    s->wtd += w * t * d;
    s->wdd += w * d * d;
    s->value += value * gain;
    s->gain += gain;
    s->gain2 += w;
    if (t < FAR_PX) return;
    s->bend += bend;
    s->level += value;
}

/* Where along a branch positions are asked for. */
typedef struct fit_span {
    float inner_px;    /* first */
    float crowded_px;  /* nearer than this another ridge may hide them: a missing one does not count */
    float shortest_px; /* what must be there */
} fit_span_t;

/* All positions up to the shortest length, then as far as no two in a row are missing. */
static uint32_t prefix_collect(const oc_fit_walk_t *walk, const oc_fit_profile_t *profile,
                               const oc_fit_branch_t *branch, const fit_span_t *span, float inv_st,
                               fit_prefix_t prefix[OC_FIT_SAMPLES])
{
    const bool flat = walk->step_major == 1;
    const float to_d = flat ? branch->ux : -branch->uy; /* minor axis on the normal (-uy, ux) */
    const float to_t = flat ? branch->uy : branch->ux;
    const float per_major = 1.0f / fabsf(flat ? branch->ux : branch->uy);
    oc_fit_sums_t sums;
    memset(&sums, 0, sizeof sums);
    uint32_t n = 0, missing = 0, n_tried = 0, n_edges = 0;
    for (uint32_t m = 0; m < walk->n; m++) {
        const float along = ((float)(walk->first + (int32_t)m * walk->sign) - walk->a_major) * (float)walk->sign;
        float t = along * per_major;
        if (profile->found[m] == 1 && t >= span->crowded_px) {
            n_tried++;
            n_edges++;
            missing = 0;
            continue;
        }
        if (profile->found[m] != 2) {
            n_tried += t >= span->crowded_px;
            if (++missing >= 2 && t > span->shortest_px) break;
            continue;
        }
        n_tried++;
        n_edges++;
        missing = 0;
        const float across = profile->across[m];
        t += across * to_t;
        prefix_add(&sums, t, across * to_d, profile->value[m], profile->bend[m], fit_gain(t, inv_st));
        prefix[n++] = (fit_prefix_t){sums, t, (float)n_edges / (float)n_tried};
    }
    return n;
}

/* The branch's own line from its sums; false when they do not make one. */
static bool branch_solve(oc_fit_branch_t *branch, const fit_prefix_t *prefix, uint32_t n)
{
    const oc_fit_sums_t *s = &prefix->sums;
    const float det = s->w * s->wtt - s->wt * s->wt;
    if (!(det > 1e-3f * s->w * s->w)) return false;

    branch->sums = *s;
    branch->offset_px = (s->wtt * s->wd - s->wt * s->wtd) / det;
    branch->turn_rad = (s->w * s->wtd - s->wt * s->wd) / det;
    const float sse = s->wdd - branch->offset_px * s->wd - branch->turn_rad * s->wtd;
    const float spare = n > 2 ? (float)(n - 2u) : 1.0f;
    branch->rms_px = sqrtf(larger(sse, 0.0f) / s->w * (float)n / spare);
    branch->amplitude = s->value / s->gain2;
    branch->share = prefix->share;
    branch->length_px = prefix->t;
    branch->n = (float)n;
    return true;
}

/* Follow one branch and fit its line; the longest piece that stays straight wins. */
static bool branch_follow(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const oc_fit_t *fit, uint32_t i,
                          const fit_reach_t *reach, const fit_span_t *span, oc_fit_branch_t *branch)
{
    oc_fit_walk_t walk =
        walk_make(gradient, rules, fit, branch, span->inner_px,
                  larger(reach->longest_px + span->inner_px - reach->inner_px, span->shortest_px), reach->across_px);
    if (walk.n < MIN_SAMPLES) return false;
    walk.has_model = reach->has_model;

    const float major = fabsf(walk.step_major == 1 ? branch->ux : branch->uy);
    const float inv_st = 1.0f / sqrtf(fit->blur_px2 - DIFFERENCE_PX2);
    oc_fit_rival_t rivals[OC_FIT_MAX_BRANCHES];
    oc_fit_profile_t profile;
    gradient->kernels->profile(&walk, rivals, reach->has_model ? rivals_make(fit, i, rivals) : 0,
                               fit->blur_px2 / (major * major), 1.0f / sqrtf(fit->blur_px2), inv_st, &profile);

    fit_prefix_t prefix[OC_FIT_SAMPLES];
    const uint32_t n_all = prefix_collect(&walk, &profile, branch, span, inv_st, prefix);
    uint32_t n_short = 0;
    while (n_short < n_all && prefix[n_short].t <= span->shortest_px + 0.5f) n_short++;
    if (n_short < MIN_SAMPLES) n_short = MIN_SAMPLES;

    for (uint32_t n = n_all; n >= n_short; n = n > n_short + 2 ? (n + n_short) / 2 : n - 1) {
        if (prefix[n - 1].t < smaller(reach->shortest_px - 1.5f, LEAST_LENGTH * reach->shortest_px)) return false;
        if (!branch_solve(branch, &prefix[n - 1], n)) return false;
        const float limit = n > n_short ? GROW_RMS_PX : rules->max_rms_px;
        if (branch->rms_px <= limit && branch->share >= rules->s_j) {
            return branch->amplitude >= LEAST_CONTRAST * rules->t_b * (float)OC_GRADIENT_ONE;
        }
    }
    return false;
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

static float fit_acute_cot(const oc_fit_t *fit, uint32_t self)
{
    float cot = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        if (i == self) continue;
        const float c = fit_cos_between(&fit->branch[i], &fit->branch[self]);
        cot = larger(cot, c / larger(fit_sin_between(&fit->branch[i], &fit->branch[self]), 0.1f));
    }
    return cot;
}

/* Is the apex where a corner seen at the pixel may have it? Blur moves the
 * seen tip of an acute corner inwards. */
static bool fit_is_near(const oc_fit_t *fit)
{
    float limit_px = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        limit_px = larger(limit_px, INNER_PX + 2.0f * ACUTE_PX * fit_acute_cot(fit, i));
    }
    limit_px = smaller(limit_px, 6.0f) + 2.0f + BLUNT_PX;
    const float dx = fit->x_px - fit->from_x_px;
    const float dy = fit->y_px - fit->from_y_px;
    return dx * dx + dy * dy <= limit_px * limit_px;
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

/* Once round: follow all branches from the apex, then move the apex. */
static bool fit_pass(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const fit_reach_t *reach,
                     oc_fit_t *fit, float *moved_px)
{
    oc_fit_t next = *fit;
    next.n = 0;
    for (uint32_t i = 0; i < fit->n; i++) {
        const float acute_px = smaller(ACUTE_PX * fit_acute_cot(fit, i), ACUTE_MAX_PX);
        fit_span_t span = {reach->inner_px, reach->inner_px + acute_px, 0.0f};
        if (reach->across_px > 0) span.inner_px = span.crowded_px;
        span.shortest_px = larger(reach->shortest_px, span.inner_px + SPAN_PX);
        oc_fit_branch_t branch = fit->branch[i];
        bool holds = branch_follow(gradient, rules, fit, i, reach, &span, &branch);
        if (!holds && span.inner_px > reach->inner_px + 0.5f) {
            span = (fit_span_t){reach->inner_px, span.crowded_px, larger(reach->shortest_px, reach->inner_px + SPAN_PX)};
            branch = fit->branch[i];
            holds = branch_follow(gradient, rules, fit, i, reach, &span, &branch);
        }
        if (holds) next.branch[next.n++] = branch;
    }
    fit_merge(&next, rules->cos_min_angle);
    if (next.n < 2) return false;

    float move[2];
    if (!fit_intersect(&next, move)) return false;
    if (fit_drop_stray(&next, move) && !fit_intersect(&next, move)) return false;
    fit_apply(&next, move);
    *moved_px = sqrtf(move[0] * move[0] + move[1] * move[1]);
    *fit = next;
    fit_measure_blur(fit, rules->sigma_px);
    return fit_is_near(fit) && fit_bends(fit, rules->cos_min_angle, reach->has_model ? rules->cos_min_bend : rules->cos_first_bend);
}

bool oc_judoca_fit_begin(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, float x_px, float y_px,
                         const oc_fit_seed_t seed[], uint32_t n_seeds, oc_fit_t *fit)
{
    OC_ASSERT(gradient && rules && seed && fit);

    fit->x_px = fit->from_x_px = x_px;
    fit->y_px = fit->from_y_px = y_px;
    fit->blur_px2 = rules->sigma_px * rules->sigma_px + 0.9f;
    fit->n = n_seeds < OC_FIT_MAX_BRANCHES ? n_seeds : OC_FIT_MAX_BRANCHES;
    for (uint32_t i = 0; i < fit->n; i++) {
        memset(&fit->branch[i], 0, sizeof fit->branch[i]);
        fit->branch[i].ux = seed[i].ux;
        fit->branch[i].uy = seed[i].uy;
        fit->branch[i].side = seed[i].side;
    }
    const float shortest_px = smaller(rules->lambda_min_px, FIRST_LOOK_PX);
    const fit_reach_t reach = {2, INNER_PX, shortest_px, shortest_px + 1.0f, false};
    return fit_pass(gradient, rules, &reach, fit, &fit->moved_px);
}

/* ---- branches the place did not show ---- */

/* cos of i / 32 of a turn, i = 0..8. */
static const float kRing[9] = {1.0f,         0.98078528f,  0.923879533f, 0.831469612f, 0.707106781f,
                               0.555570233f, 0.382683432f, 0.195090322f, 0.0f};

static void ring_vector(uint32_t direction, float *x, float *y)
{
    const uint32_t part = direction % 8u;
    const float c = kRing[part], s = kRing[8u - part];
    switch (direction / 8u % 4u) {
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

/* Derivative across each direction, mean over a few pixels from the apex
 * outwards; 0 where the sign is not steady. False near the border. */
static bool ring_measure(const oc_gradient_t *gradient, const oc_fit_t *fit, float floor, int32_t first, int32_t last,
                         float ring[OC_RAYS])
{
    const int32_t x = (int32_t)floorf(fit->x_px + 0.5f), y = (int32_t)floorf(fit->y_px + 0.5f);
    const int32_t width = (int32_t)gradient->width_px, height = (int32_t)gradient->height_px;
    if (x < last + 1 || y < last + 1 || x + last + 1 >= width || y + last + 1 >= height) {
        return false;
    }
    for (uint32_t d = 0; d < OC_RAYS; d++) {
        float ux, uy, sum = 0.0f;
        int32_t n_front = 0, n_back = 0;
        ring_vector(d, &ux, &uy);
        for (int32_t t = first; t <= last; t++) {
            const int32_t px = (int32_t)(fit->x_px + ux * (float)t + 0.5f),
                          py = (int32_t)(fit->y_px + uy * (float)t + 0.5f);
            const int16_t *g = gradient->dxdy + 2 * (py * width + px);
            const float v = ux * g[1] - uy * g[0];
            sum += v;
            n_front += v > floor;
            n_back += v < -floor;
        }
        const int32_t n_steady = sum > 0.0f ? n_front : n_back;
        ring[d] = n_steady >= last - first ? sum / (float)(last - first + 1) : 0.0f;
    }
    return true;
}

static bool fit_has_branch(const oc_fit_t *fit, const oc_fit_branch_t *made)
{
    for (uint32_t i = 0; i < fit->n; i++) {
        if (fit->branch[i].side == made->side && fit_cos_between(&fit->branch[i], made) > RING_SAME_COS) return true;
    }
    return false;
}

/* Seen from where the apex turned out to be, edges may run in directions that
 * the place, a pixel or two aside, did not show: those are added. */
static void fit_look_round(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, int32_t first, int32_t last,
                           oc_fit_t *fit)
{
    float ring[OC_RAYS];
    const float t_b = rules->t_b * (float)OC_GRADIENT_ONE;
    if (!ring_measure(gradient, fit, 0.4f * t_b, first, last, ring)) return;
    for (uint32_t d = 0; d < OC_RAYS && fit->n < OC_FIT_MAX_BRANCHES; d++) {
        const float side = ring[d] > 0.0f ? 1.0f : -1.0f, here = side * ring[d];
        const float before = side * ring[(d + OC_RAYS - 1u) % OC_RAYS], after = side * ring[(d + 1u) % OC_RAYS];
        if (!(here >= 0.7f * t_b && here > before && here >= after)) continue;
        oc_fit_branch_t made;
        memset(&made, 0, sizeof made);
        ring_vector(d, &made.ux, &made.uy);
        made.side = side;
        made.amplitude = here;
        if (!fit_has_branch(fit, &made)) fit->branch[fit->n++] = made;
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

void oc_judoca_set_kind(oc_junction_t *junction, float tolerance_rad)
{
    static const uint8_t by_count[5] = {OC_KIND_OTHER, OC_KIND_OTHER, OC_KIND_L, OC_KIND_Y, OC_KIND_X};
    const uint32_t n = junction->n_branches;
    junction->kind = n < 5 ? by_count[n] : OC_KIND_OTHER;
    if (n != 3) return;

    for (uint32_t i = 0; i < 3; i++) {
        float between = fabsf(junction->branch[i].angle_rad - junction->branch[(i + 1) % 3].angle_rad);
        if (fabsf(PI - between) < tolerance_rad) junction->kind = OC_KIND_T;
    }
}

/* Gregory's series of the half angle: z <= tan(22.5 deg), so nine terms leave 1e-8. libm's arctangent may differ in
 * the last bit from machine to machine. */
float oc_judoca_angle(float x, float y)
{
    const double ax = fabs((double)x), ay = fabs((double)y);
    const double high = ax > ay ? ax : ay, low = ax > ay ? ay : ax;
    const double h = high + sqrt(high * high + low * low);
    const double z = h > 0.0 ? low / h : 0.0, z2 = z * z;
    double sum = 1.0 / 17.0;
    for (int k = 15; k >= 1; k -= 2) sum = 1.0 / k - z2 * sum;
    double angle = 2.0 * z * sum;
    if (ay > ax) angle = 1.5707963267948966 - angle;
    if (x < 0.0f) angle = 3.141592653589793 - angle;
    if (y < 0.0f) angle = 6.283185307179586 - angle;
    const float rounded = (float)angle;
    return rounded < 2.0f * PI ? rounded : 0.0f;
}

static void fit_write(const oc_fit_t *fit, float score, float tolerance_rad, oc_junction_t *junction)
{
    memset(junction, 0, sizeof *junction);
    junction->x_px = fit->x_px;
    junction->y_px = fit->y_px;
    junction->score = score;
    for (uint32_t i = 0; i < fit->n && i < OC_MAX_BRANCHES; i++) {
        const oc_fit_branch_t *b = &fit->branch[i];
        junction->branch[junction->n_branches++] =
            (oc_branch_t){oc_judoca_angle(b->ux, b->uy), b->length_px, smaller(b->share, 1.0f)};
    }
    oc_judoca_sort_branches(junction);
    oc_judoca_set_kind(junction, tolerance_rad);
}

bool oc_judoca_fit_finish(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, oc_fit_t *fit,
                          oc_junction_t *junction)
{
    OC_ASSERT(gradient && rules && fit && junction);

    float moved_px = 1.0f, length_px = FIRST_LOOK_PX;
    for (uint32_t pass = 0; pass < PASSES; pass++) {
        if (pass < 2)
            fit_look_round(gradient, rules, RING_FIRST + (int32_t)pass * RING_STEP,
                           RING_LAST + (int32_t)pass * RING_STEP, fit);
        const bool is_whole = length_px >= rules->lambda_px;
        length_px = smaller(GROWTH * length_px, rules->lambda_px);
        const int32_t across_px = pass == 0  ? (fit->moved_px > AGAIN_PX || fit->sigma_px > VAGUE_PX ? 2 : 1)
                                  : is_whole ? 0
                                             : 1;
        const fit_reach_t reach = {across_px, MODEL_INNER_PX, smaller(rules->lambda_min_px, length_px), length_px, true};
        if (!fit_pass(gradient, rules, &reach, fit, &moved_px)) return false;
        if (is_whole && moved_px <= SETTLED_PX) break;
    }
    if (!(fit->sigma_px <= rules->max_apex_sigma_px)) return false;

    const float score = fit_score(fit, rules->cos_min_bend);
    if (!(score > 0.0f)) return false;
    fit_write(fit, score, rules->min_bend_rad, junction);
    return true;
}
