/* SPDX-License-Identifier: BSD-3-Clause
 * One branch of a junction under fit: the samples along it and its line. */
#include "vehicle/judoca_branch.h"

#include <math.h>
#include <string.h>

#define MIN_SAMPLES 3u

/* Samples beyond this measure the blur. */
#define FAR_PX 3.0f

/* Least ridge of a branch and least derivative of one of its positions, in units of t_b: noise lifts a weak edge
 * over the threshold here and there, and the share of such pixels is asked for anyway. */
#define LEAST_CONTRAST 0.7f
#define LEAST_DERIVATIVE 0.5f

/* Share of the shortest length at which the last position may lie: noise hides single ones. */
#define LEAST_LENGTH 0.8f

/* A branch is taken beyond its shortest length only while it stays this straight. */
#define GROW_RMS_PX 0.25f

/* Least integer not below x; without a call and without a branch. */
static inline int32_t ceiling(float x)
{
    const int32_t towards_zero = (int32_t)x;
    return towards_zero + (int32_t)(x > (float)towards_zero);
}

/* Nearest integer of a number above -2^15. */
static inline int32_t nearest(float x)
{
    return (int32_t)(x + 32768.5f) - 32768;
}

static inline int32_t least(int32_t a, int32_t b)
{
    return a < b ? a : b;
}

/* Where the samples of a branch are, cut to the image. Which axis is major and which way it goes is as good as
 * random: values are picked from tables and signs multiplied, so that no branch of code depends on it. */
static void walk_place(const oc_gradient_t *gradient, const oc_fit_t *fit, const oc_fit_branch_t *branch,
                       const oc_fit_span_t *span, oc_fit_walk_t *walk)
{
    const uint32_t axis = walk->axis;
    const int32_t size[2] = {(int32_t)gradient->width_px, (int32_t)gradient->height_px};
    const int32_t step[2] = {1, (int32_t)gradient->width_px};
    const float u[2] = {branch->ux, branch->uy}, apex[2] = {fit->x_px, fit->y_px}, turned[2] = {1.0f, -1.0f};
    walk->own_major = u[axis];
    walk->own_minor = u[axis ^ 1u];
    walk->per_major = 1.0f / walk->own_major;
    walk->to_d = turned[axis] * walk->own_major;
    walk->a_major = apex[axis];
    walk->a_minor = apex[axis ^ 1u];
    walk->step_major = step[axis];
    walk->step_minor = step[axis ^ 1u];
    walk->n_minor = size[axis ^ 1u];
    int32_t bits;
    memcpy(&bits, &walk->own_major, sizeof bits);
    walk->sign = bits >> 31 | 1;

    /* Seen along the branch coordinates rise. */
    const float along = (float)walk->sign, size_major = along * walk->own_major, from = along * walk->a_major;
    const int32_t first = ceiling(from + span->inner_px * size_major);
    const int32_t last = -ceiling(-(from + span->longest_px * size_major));
    const int32_t backwards = walk->sign >> 31, span_inside = (1 - size[axis]) & backwards;
    const int32_t first_inside = 1 + span_inside, last_inside = size[axis] - 2 + span_inside;
    const int32_t n = least(least(last, last_inside) - first + 1, (int32_t)OC_FIT_SAMPLES);
    walk->first = first * walk->sign;
    walk->n = (n > 0) & (first >= first_inside) ? (uint32_t)n : 0;
}

/* Written field by field where it stays: what is copied as soon as it is written waits for the write. */
static void walk_make(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const oc_fit_t *fit, uint32_t self,
                      const oc_fit_span_t *span, oc_fit_walk_t *walk)
{
    const oc_fit_branch_t *branch = &fit->branch[self];
    const float turn = branch->side * (float)(1 << 14);
    walk->dxdy = gradient->dxdy;
    walk->nx = nearest(-branch->uy * turn);
    walk->ny = nearest(branch->ux * turn);
    walk->floor = LEAST_DERIVATIVE * rules->t_b * (float)OC_GRADIENT_ONE;
    walk->crowded_px = span->crowded_px;
    walk->shortest_px = span->shortest_px;
    walk->far_px = FAR_PX;
    walk->has_model = span->has_model;
    walk->self = self;
    walk->axis = fabsf(branch->ux) < fabsf(branch->uy);
    walk->reach = span->across_px;
    walk_place(gradient, fit, branch, span, walk);
}

/* The branch's own line through the positions summed; false when they do not make one. */
static bool branch_solve(oc_fit_branch_t *branch)
{
    const oc_fit_sums_t *s = &branch->sums;
    const float det = s->w * s->wtt - s->wt * s->wt, inv = 1.0f / det;
    branch->offset_px = (s->wtt * s->wd - s->wt * s->wtd) * inv;
    branch->turn_rad = (s->w * s->wtd - s->wt * s->wd) * inv;
    const float sse = s->wdd - branch->offset_px * s->wd - branch->turn_rad * s->wtd;
    const float n = (float)s->n, spare = n > 2.0f ? n - 2.0f : 1.0f;
    branch->rms_px = sqrtf((sse > 0.0f ? sse : 0.0f) * n / (s->w * spare));
    branch->amplitude = s->value / s->w;
    branch->share = s->share;
    branch->length_px = s->last_px;
    branch->n = n;
    return det > 1e-3f * s->w * s->w;
}

static bool branch_holds(const oc_fit_branch_t *branch, const oc_fit_rules_t *rules, uint32_t n_short)
{
    const float limit = branch->sums.n > n_short ? GROW_RMS_PX : rules->max_rms_px;
    return (branch->rms_px <= limit) & (branch->share >= rules->s_j);
}

static bool branch_shows(const oc_fit_branch_t *branch, const oc_fit_rules_t *rules)
{
    return branch->amplitude >= LEAST_CONTRAST * rules->t_b * (float)OC_GRADIENT_ONE;
}

static uint32_t without_last(uint32_t places)
{
    return places & ~(UINT32_C(1) << (31u - (uint32_t)__builtin_clz(places)));
}

/* The positions do not make a line: fewer of them may. */
static bool branch_shorten(const oc_kernels_t *kernels, const oc_fit_rules_t *rules, const oc_fit_profile_t *profile,
                           uint32_t n_short, float least_px, oc_fit_branch_t *branch)
{
    uint32_t places = profile->place;
    for (uint32_t left = branch->sums.n, n = left; n > n_short;) {
        n = n > n_short + 2 ? (n + n_short) / 2 : n - 1;
        for (; left > n; left--) places = without_last(places);
        kernels->sums(profile, places, FAR_PX, &branch->sums);
        if (branch->sums.last_px < least_px || !branch_solve(branch)) return false;
        if (branch_holds(branch, rules, n_short)) return branch_shows(branch, rules);
    }
    return false;
}

/* Does a branch hold as it was followed? */
static bool branch_judge(const oc_kernels_t *kernels, const oc_fit_rules_t *rules, const oc_fit_profile_t *profile,
                         float asked_px, oc_fit_branch_t *branch)
{
    const uint32_t n_short = profile->n_short < MIN_SAMPLES ? MIN_SAMPLES : profile->n_short;
    const float tolerant_px = LEAST_LENGTH * asked_px, strict_px = asked_px - 1.5f;
    const float least_px = tolerant_px < strict_px ? tolerant_px : strict_px;
    const bool is_line = branch_solve(branch);
    if (!((branch->sums.n >= n_short) & (branch->sums.last_px >= least_px) & is_line)) return false;
    if (branch_holds(branch, rules, n_short)) return branch_shows(branch, rules);
    return branch_shorten(kernels, rules, profile, n_short, least_px, branch);
}

uint32_t oc_judoca_branches_follow(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, oc_fit_t *fit,
                                   const oc_fit_blur_t *blur, uint32_t which, const oc_fit_span_t span[])
{
    oc_fit_track_t track[OC_FIT_MAX_BRANCHES];
    uint32_t n = 0, branch[OC_FIT_MAX_BRANCHES], holds = 0;
    for (uint32_t rest = which; rest; rest &= rest - 1u) {
        const uint32_t i = (uint32_t)__builtin_ctz(rest);
        walk_make(gradient, rules, fit, i, &span[i], &track[n].walk);
        track[n].sums = &fit->branch[i].sums;
        branch[n] = i;
        n += track[n].walk.n >= MIN_SAMPLES;
    }
    if (n == 0) return 0;
    gradient->kernels->follow(track, n, &fit->crowd, blur);
    for (uint32_t k = 0; k < n; k++) {
        const uint32_t i = branch[k];
        const bool is_held =
            branch_judge(gradient->kernels, rules, &track[k].profile, span[i].asked_px, &fit->branch[i]);
        holds |= (uint32_t)is_held << i;
    }
    return holds;
}
