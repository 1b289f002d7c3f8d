/* SPDX-License-Identifier: BSD-3-Clause
 * Sub-pixel step of the junction detector: a line per branch, their common point. */
#include "vehicle/judoca_fit.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979f

/* Edge positions along one branch: one per pixel of its major axis. */
#define MAX_SAMPLES 32u
#define MIN_SAMPLES 3u

/* A line is fitted over at least this length. */
#define SPAN_PX 4.0f

/* The apex is at most the inner radius plus this from the pixel where the
 * junction was seen. */
#define BLUNT_PX 0.5f

/* A third branch whose line misses the apex by more is another edge. */
#define STRAY_PX 0.75f

/* Passes after the first look. */
#define PASSES 2u

/* Inner radius = INNER + ACUTE cot(angle to the nearest branch):
 * nearer to the apex the gradient ridges of an acute pair run into each other
 * and pull the fit inwards. Across a right angle they do not: the derivative
 * along one edge's normal does not see the other edge. */
#define INNER_PX 1.5f
#define ACUTE_PX 5.0f

/* An obtuse pair bends each other's ridge less; what lies within INNER +
 * OBTUSE cot is kept, for short branches need it, but counts little. */
#define OBTUSE_PX 1.25f
#define SOFT_MAX_PX 5.0f
#define SOFT_WEIGHT 0.15f

/* The gradient must be within this of the branch normal. */
#define COS_NORMAL 0.85f

/* Floor of a line's positional sd: what sampling alone leaves. */
#define FLOOR_SIGMA_PX 0.05f

/* A branch is taken beyond its shortest length only while it stays this straight. */
#define GROW_RMS_PX 0.25f

/* Contrast at which the score reaches one half, grey levels per px. */
#define HALF_CONTRAST 6.0f

typedef struct fit_samples {
    uint32_t n, n_tried;
    float along[MAX_SAMPLES];  /* major coordinate */
    float across[MAX_SAMPLES]; /* minor coordinate, sub-pixel */
    float value[MAX_SAMPLES];  /* derivative across the branch */
    float weight[MAX_SAMPLES];
    float t[MAX_SAMPLES];        /* distance from the apex */
    uint32_t tried[MAX_SAMPLES]; /* n_tried when this one was met */
} fit_samples_t;

/* How far a pass looks across and along a branch. */
typedef struct fit_reach {
    int32_t across_px;
    float longest_px;
} fit_reach_t;

/* One branch seen along its major axis, so that x and y share the code. */
typedef struct fit_walk {
    const oc_gradient_t *gradient;
    int32_t step_major, step_minor; /* into the planes */
    int32_t n_major, n_minor;       /* image size along them */
    float a_major, a_minor;         /* apex */
    float slope;                    /* minor per major */
    float t_per_major;              /* px of ray per px of major axis */
    int32_t sign;                   /* of the major axis along the branch */
    float nx, ny;                   /* normal on the side of the gradient */
    float floor;                    /* least derivative of an edge point */
    int32_t reach;                  /* half width of the search across */
    float soft_px;                  /* samples nearer than this count little */
} fit_walk_t;

static float fit_cos_between(const oc_fit_seed_t *a, const oc_fit_seed_t *b)
{
    return a->ux * b->ux + a->uy * b->uy;
}

static float fit_sin_between(const oc_fit_seed_t *a, const oc_fit_seed_t *b)
{
    return fabsf(a->ux * b->uy - a->uy * b->ux);
}

static fit_walk_t fit_walk_begin(const oc_gradient_t *gradient, const oc_fit_seed_t *seed, float x_px, float y_px,
                                 float t_b, int32_t reach)
{
    const float ux = seed->ux;
    const float uy = seed->uy;
    const bool flat = fabsf(ux) >= fabsf(uy);
    const int32_t width = (int32_t)gradient->width_px;
    const int32_t height = (int32_t)gradient->height_px;
    const float major = flat ? ux : uy;
    return (fit_walk_t){
        .gradient = gradient,
        .step_major = flat ? 1 : width,
        .step_minor = flat ? width : 1,
        .n_major = flat ? width : height,
        .n_minor = flat ? height : width,
        .a_major = flat ? x_px : y_px,
        .a_minor = flat ? y_px : x_px,
        .slope = flat ? uy / ux : ux / uy,
        .t_per_major = 1.0f / fabsf(major),
        .sign = major > 0.0f ? 1 : -1,
        .nx = -uy * seed->side,
        .ny = ux * seed->side,
        .floor = 0.5f * t_b * (float)OC_GRADIENT_ONE,
        .reach = reach,
    };
}

static float fit_derivative(const fit_walk_t *walk, int32_t index)
{
    return (float)walk->gradient->dx[index] * walk->nx + (float)walk->gradient->dy[index] * walk->ny;
}

/* Strongest edge point of one column (row) of the branch; false when there is
 * none that faces the right way. */
static bool fit_walk_sample(const fit_walk_t *walk, int32_t major, float *across, float *value)
{
    const float expected = walk->a_minor + ((float)major - walk->a_major) * walk->slope;
    const int32_t centre = (int32_t)floorf(expected + 0.5f);
    if (centre - walk->reach < 1 || centre + walk->reach + 1 >= walk->n_minor) return false;

    const int32_t base = major * walk->step_major;
    int32_t best = 0;
    float best_value = walk->floor;
    for (int32_t minor = centre - walk->reach; minor <= centre + walk->reach; minor++) {
        const float v = fit_derivative(walk, base + minor * walk->step_minor);
        if (v > best_value) {
            best_value = v;
            best = minor;
        }
    }
    if (best == 0) return false;

    const int32_t at = base + best * walk->step_minor;
    if (best_value < COS_NORMAL * (float)walk->gradient->magnitude[at]) return false;
    const float before = fit_derivative(walk, at - walk->step_minor);
    const float after = fit_derivative(walk, at + walk->step_minor);
    if (before > best_value || after > best_value) return false;

    const float bend = before + after - 2.0f * best_value;
    *across = (float)best + (bend < 0.0f ? 0.5f * (before - after) / bend : 0.0f);
    *value = best_value;
    return true;
}

/* Collect edge points from r0 outwards: all up to the shortest length, then
 * as far as no two in a row are missing. */
static void fit_walk_collect(const fit_walk_t *walk, float shortest_px, float longest_px, float r0,
                             fit_samples_t *samples)
{
    samples->n = 0;
    samples->n_tried = 0;
    const float first = walk->a_major + (float)walk->sign * r0 / walk->t_per_major;
    int32_t major = (int32_t)(walk->sign > 0 ? ceilf(first) : floorf(first));
    uint32_t missing = 0;
    for (; samples->n < MAX_SAMPLES; major += walk->sign) {
        const float t = fabsf((float)major - walk->a_major) * walk->t_per_major;
        if (t > longest_px || major < 1 || major + 1 >= walk->n_major) return;

        float across, value;
        samples->n_tried++;
        if (fit_walk_sample(walk, major, &across, &value)) {
            const uint32_t i = samples->n++;
            samples->along[i] = (float)major;
            samples->across[i] = across;
            samples->value[i] = value;
            samples->weight[i] = t < walk->soft_px ? SOFT_WEIGHT * value : value;
            samples->t[i] = t;
            samples->tried[i] = samples->n_tried;
            missing = 0;
        } else if (++missing >= 2 && t > shortest_px) {
            return;
        }
    }
}

/* Straight line through the first n samples, least squares across the major axis. */
static bool fit_line_solve(const fit_walk_t *walk, const fit_samples_t *samples, uint32_t n, oc_fit_line_t *line)
{
    float sum = 0, sw = 0, sa = 0, sc = 0;
    for (uint32_t i = 0; i < n; i++) {
        const float w = samples->weight[i];
        sum += samples->value[i];
        sw += w;
        sa += w * samples->along[i];
        sc += w * samples->across[i];
    }
    const float mean_along = sa / sw;
    const float mean_across = sc / sw;

    float saa = 0, sac = 0, plain = 0;
    for (uint32_t i = 0; i < n; i++) {
        const float da = samples->along[i] - mean_along;
        saa += samples->weight[i] * da * da;
        sac += samples->weight[i] * da * (samples->across[i] - mean_across);
        plain += da * da;
    }
    if (!(saa > 0.0f)) return false;

    const float slope = sac / saa;
    float see = 0;
    for (uint32_t i = 0; i < n; i++) {
        const float e = samples->across[i] - mean_across - slope * (samples->along[i] - mean_along);
        see += e * e;
    }
    const float stretch = sqrtf(1.0f + slope * slope);
    const float u_major = (float)walk->sign / stretch;
    const float u_minor = u_major * slope;
    const bool flat = walk->step_major == 1;
    line->px = flat ? mean_along : mean_across;
    line->py = flat ? mean_across : mean_along;
    line->ux = flat ? u_major : u_minor;
    line->uy = flat ? u_minor : u_major;
    line->n = (float)n;
    line->rms_px = sqrtf(see / (float)(n > 2 ? n - 2 : 1)) / stretch;
    line->contrast = sum / (float)n;
    line->spread = plain * stretch * stretch;
    line->length_px = samples->t[n - 1];
    line->share = (float)n / (float)samples->tried[n - 1];
    return true;
}

/* Radius beyond which an obtuse neighbour no longer bends the ridge. */
static float fit_soft_radius(const oc_fit_t *fit, uint32_t self)
{
    float cot = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        if (i == self) continue;
        const float c = fit_cos_between(&fit->seed[i], &fit->seed[self]);
        cot = fmaxf(cot, -c / fmaxf(fit_sin_between(&fit->seed[i], &fit->seed[self]), 0.1f));
    }
    return fminf(INNER_PX + OBTUSE_PX * cot, SOFT_MAX_PX);
}

/* Follow one seed from r0 and fit its line; the longest piece that stays
 * straight wins. */
static bool fit_follow_from(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const oc_fit_t *fit, uint32_t i,
                            float r0, const fit_reach_t *reach, oc_fit_line_t *line)
{
    fit_walk_t walk = fit_walk_begin(gradient, &fit->seed[i], fit->x_px, fit->y_px, rules->t_b, reach->across_px);
    walk.soft_px = fit_soft_radius(fit, i);
    const float shortest = fmaxf(rules->lambda_min_px, r0 + SPAN_PX);
    /* What an acute pair loses at the tip it may take further out. */
    const float longest = fmaxf(reach->longest_px + r0 - INNER_PX, shortest);
    fit_samples_t samples;
    fit_walk_collect(&walk, shortest, longest, r0, &samples);

    uint32_t n_short = 0;
    while (n_short < samples.n && samples.t[n_short] <= shortest + 0.5f) n_short++;
    if (n_short < MIN_SAMPLES) n_short = MIN_SAMPLES;

    for (uint32_t n = samples.n; n >= n_short; n = n > n_short + 2 ? (n + n_short) / 2 : n - 1) {
        if (samples.t[n - 1] < rules->lambda_min_px - 1.5f) return false;
        if (!fit_line_solve(&walk, &samples, n, line)) return false;
        const float limit = n > n_short ? GROW_RMS_PX : rules->max_rms_px;
        if (line->rms_px <= limit && line->share >= rules->s_j) {
            return line->contrast >= rules->t_b * (float)OC_GRADIENT_ONE;
        }
    }
    return false;
}

/* Follow one seed from the radius that clears its neighbours; where the edge
 * does not reach out that far, from near the apex. */
static bool fit_follow(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const oc_fit_t *fit, uint32_t i,
                       float inner_px, const fit_reach_t *reach, oc_fit_line_t *line)
{
    if (fit_follow_from(gradient, rules, fit, i, inner_px, reach, line)) return true;
    return inner_px > INNER_PX + 1.0f && fit_follow_from(gradient, rules, fit, i, INNER_PX, reach, line);
}

/* Move the apex to the weighted least-squares point of all lines. A line
 * counts by how well it is known at the present apex. */
static bool fit_intersect(oc_fit_t *fit)
{
    float a = 0, b = 0, c = 0, d = 0, e = 0;
    for (uint32_t i = 0; i < fit->n; i++) {
        const oc_fit_line_t *line = &fit->line[i];
        const float rx = line->px - fit->x_px;
        const float ry = line->py - fit->y_px;
        const float gap = rx * line->ux + ry * line->uy;
        const float sigma2 = line->rms_px * line->rms_px + FLOOR_SIGMA_PX * FLOOR_SIGMA_PX;
        const float w = 1.0f / (sigma2 * (1.0f / line->n + gap * gap / line->spread));
        const float nx = -line->uy;
        const float ny = line->ux;
        const float r = nx * rx + ny * ry;
        a += w * nx * nx;
        b += w * nx * ny;
        c += w * ny * ny;
        d += w * nx * r;
        e += w * ny * r;
    }
    const float det = a * c - b * b;
    const float half = 0.5f * (a + c);
    if (!(det > 1e-6f * half * half)) return false;

    fit->x_px += (c * d - b * e) / det;
    fit->y_px += (a * e - b * d) / det;
    /* Smaller eigenvalue of the information, without cancellation. */
    const float root = sqrtf(fmaxf(half * half - det, 0.0f));
    fit->sigma_px = sqrtf((half + root) / det);
    return true;
}

static float fit_inner_radius(const oc_fit_t *fit, uint32_t self, float farthest_px)
{
    float cot = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        if (i == self) continue;
        const float c = fit_cos_between(&fit->seed[i], &fit->seed[self]);
        cot = fmaxf(cot, c / fmaxf(fit_sin_between(&fit->seed[i], &fit->seed[self]), 0.1f));
    }
    return fminf(INNER_PX + ACUTE_PX * cot, farthest_px);
}

static void fit_remove(oc_fit_t *fit, uint32_t i)
{
    const size_t after = fit->n - i - 1u;
    memmove(&fit->seed[i], &fit->seed[i + 1], after * sizeof fit->seed[0]);
    memmove(&fit->line[i], &fit->line[i + 1], after * sizeof fit->line[0]);
    fit->n--;
}

/* Of two branches with nearly one direction (the sides of a thin line) keep
 * the one of higher contrast. */
static void fit_merge(oc_fit_t *fit, float cos_min_angle)
{
    for (uint32_t i = 0; i < fit->n; i++) {
        for (uint32_t j = i + 1; j < fit->n;) {
            if (fit_cos_between(&fit->seed[i], &fit->seed[j]) <= cos_min_angle) {
                j++;
                continue;
            }
            if (fit->line[j].contrast > fit->line[i].contrast) {
                fit->line[i] = fit->line[j];
                fit->seed[i] = fit->seed[j];
            }
            fit_remove(fit, j);
        }
    }
}

/* Drop the branch whose line misses the apex most, if by too much and three
 * or more are left. */
static bool fit_drop_stray(oc_fit_t *fit)
{
    uint32_t worst = 0;
    float most = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        const oc_fit_line_t *line = &fit->line[i];
        const float miss = fabsf((line->px - fit->x_px) * line->uy - (line->py - fit->y_px) * line->ux);
        if (miss > most) {
            most = miss;
            worst = i;
        }
    }
    if (fit->n <= 2 || most <= STRAY_PX) return false;
    fit_remove(fit, worst);
    return true;
}

/* Is the apex where a corner seen at the pixel may have it? Blur moves the
 * seen tip of an acute corner inwards, by no more than the inner radius. */
static bool fit_is_near(const oc_fit_t *fit, float farthest_px)
{
    float limit_px = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        limit_px = fmaxf(limit_px, fit_inner_radius(fit, i, farthest_px));
    }
    limit_px += BLUNT_PX;
    const float dx = fit->x_px - fit->from_x_px;
    const float dy = fit->y_px - fit->from_y_px;
    return dx * dx + dy * dy <= limit_px * limit_px;
}

/* Once round: follow all branches from the apex, then move the apex. */
static bool fit_pass(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const fit_reach_t *reach,
                     oc_fit_t *fit)
{
    float inner[OC_FIT_MAX_BRANCHES];
    for (uint32_t i = 0; i < fit->n; i++) {
        inner[i] = fit_inner_radius(fit, i, rules->lambda_px - 2.0f);
    }

    uint32_t kept = 0;
    for (uint32_t i = 0; i < fit->n; i++) {
        oc_fit_line_t line;
        if (!fit_follow(gradient, rules, fit, i, inner[i], reach, &line)) continue;
        fit->seed[kept] = fit->seed[i];
        fit->seed[kept].ux = line.ux;
        fit->seed[kept].uy = line.uy;
        fit->line[kept++] = line;
    }
    fit->n = kept;
    fit_merge(fit, rules->cos_min_angle);
    if (fit->n < 2) return false;

    if (!fit_intersect(fit)) return false;
    if (fit_drop_stray(fit) && !fit_intersect(fit)) return false;
    return fit_is_near(fit, rules->lambda_px - 2.0f);
}

bool oc_judoca_fit_begin(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, float x_px, float y_px,
                         const oc_fit_seed_t seed[], uint32_t n_seeds, oc_fit_t *fit)
{
    OC_ASSERT(gradient && rules && seed && fit);

    fit->x_px = fit->from_x_px = x_px;
    fit->y_px = fit->from_y_px = y_px;
    fit->n = n_seeds < OC_FIT_MAX_BRANCHES ? n_seeds : OC_FIT_MAX_BRANCHES;
    for (uint32_t i = 0; i < fit->n; i++) fit->seed[i] = seed[i];

    const fit_reach_t reach = {2, rules->lambda_min_px + 1.0f};
    return fit_pass(gradient, rules, &reach, fit);
}

/* The best pair makes the junction: score and straight-line test look at it. */
static float fit_pair_score(const oc_fit_t *fit, uint32_t i, uint32_t j, float cos_min_bend)
{
    if (fit_cos_between(&fit->seed[i], &fit->seed[j]) < -cos_min_bend) return 0.0f;

    const oc_fit_line_t *a = &fit->line[i];
    const oc_fit_line_t *b = &fit->line[j];
    const float contrast = fminf(a->contrast, b->contrast) / (float)OC_GRADIENT_ONE;
    const float share = fminf(a->share, b->share);
    const float length = fminf(a->length_px, b->length_px);
    return contrast / (contrast + HALF_CONTRAST) * share * fit_sin_between(&fit->seed[i], &fit->seed[j]) *
           sqrtf(length);
}

static float fit_score(const oc_fit_t *fit, float cos_min_bend)
{
    float best = 0.0f;
    for (uint32_t i = 0; i < fit->n; i++) {
        for (uint32_t j = i + 1; j < fit->n; j++) {
            best = fmaxf(best, fit_pair_score(fit, i, j, cos_min_bend));
        }
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

static void fit_write(const oc_fit_t *fit, float score, float tolerance_rad, oc_junction_t *junction)
{
    memset(junction, 0, sizeof *junction);
    junction->x_px = fit->x_px;
    junction->y_px = fit->y_px;
    junction->score = score;
    for (uint32_t i = 0; i < fit->n && i < OC_MAX_BRANCHES; i++) {
        const oc_fit_line_t *line = &fit->line[i];
        float angle = atan2f(line->uy, line->ux);
        if (angle < 0.0f) angle += 2.0f * PI;
        if (angle >= 2.0f * PI) angle = 0.0f;
        junction->branch[junction->n_branches++] = (oc_branch_t){angle, line->length_px, line->share};
    }
    oc_judoca_sort_branches(junction);
    oc_judoca_set_kind(junction, tolerance_rad);
}

bool oc_judoca_fit_finish(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, oc_fit_t *fit,
                          oc_junction_t *junction)
{
    OC_ASSERT(gradient && rules && fit && junction);

    const fit_reach_t reach = {1, rules->lambda_px};
    for (uint32_t pass = 0; pass < PASSES; pass++) {
        if (!fit_pass(gradient, rules, &reach, fit)) return false;
    }
    if (!(fit->sigma_px <= rules->max_apex_sigma_px)) return false;

    const float score = fit_score(fit, cosf(rules->min_bend_rad));
    if (!(score > 0.0f)) return false;
    fit_write(fit, score, rules->min_bend_rad, junction);
    return true;
}
