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

/* A ridge further off than this many of its widths adds nothing. */
#define RIVAL_WIDTHS 3.0f

/* Share of the shortest length at which the last position may lie: noise hides single ones. */
#define LEAST_LENGTH 0.8f

/* A branch is taken beyond its shortest length only while it stays this straight. */
#define GROW_RMS_PX 0.25f

/* Samples along a branch, cut to the image. */
static oc_fit_walk_t walk_make(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const oc_fit_t *fit,
                               const oc_fit_branch_t *branch, const oc_fit_span_t *span)
{
    const float ux = branch->ux, uy = branch->uy;
    const bool flat = fabsf(ux) >= fabsf(uy);
    const int32_t width = (int32_t)gradient->width_px, height = (int32_t)gradient->height_px;
    const float major = flat ? ux : uy;
    oc_fit_walk_t walk = {
        .dxdy = gradient->dxdy,
        .is_flat = flat,
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
        .has_model = span->has_model,
        .crowded_px = span->crowded_px,
        .shortest_px = span->shortest_px,
        .reach = span->across_px,
    };
    const float from = walk.a_major + span->inner_px * major, to = walk.a_major + span->longest_px * major;
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
static uint32_t rivals_make(const oc_fit_t *fit, uint32_t self, float blur_px,
                            oc_fit_rival_t rivals[OC_FIT_MAX_BRANCHES])
{
    const oc_fit_branch_t *own = &fit->branch[self];
    uint32_t n = 0;
    for (uint32_t j = 0; j < fit->n; j++) {
        const oc_fit_branch_t *other = &fit->branch[j];
        const float agree = own->side * other->side * (own->ux * other->ux + own->uy * other->uy);
        if (j == self || fabsf(agree) < 0.02f) continue;
        const float cosine = own->ux * other->ux + own->uy * other->uy;
        const float sine = fabsf(own->ux * other->uy - own->uy * other->ux);
        const float apart = cosine > 0.0f ? (sine > 0.1f ? sine : 0.1f) : 1.0f;
        rivals[n++] = (oc_fit_rival_t){other->ux, other->uy, agree * other->amplitude, RIVAL_WIDTHS * blur_px / apart};
    }
    return n;
}

static uint32_t last_of(uint32_t places)
{
    return 31u - (uint32_t)__builtin_clz(places);
}

/* The branch's own line through some of its positions; false when they do not make one. */
static bool branch_solve(const oc_kernels_t *kernels, oc_fit_branch_t *branch, const oc_fit_profile_t *profile,
                         uint32_t places, uint32_t n)
{
    kernels->sums(profile, places, FAR_PX, &branch->sums);
    const oc_fit_sums_t *s = &branch->sums;
    const float det = s->w * s->wtt - s->wt * s->wt;
    if (!(det > 1e-3f * s->w * s->w)) return false;

    branch->offset_px = (s->wtt * s->wd - s->wt * s->wtd) / det;
    branch->turn_rad = (s->w * s->wtd - s->wt * s->wd) / det;
    const float sse = s->wdd - branch->offset_px * s->wd - branch->turn_rad * s->wtd;
    const float spare = n > 2 ? (float)(n - 2u) : 1.0f;
    branch->rms_px = sse > 0.0f ? sqrtf(sse / s->w * (float)n / spare) : 0.0f;
    branch->amplitude = s->value / s->w;
    const uint32_t last = last_of(places), upto = UINT32_MAX >> (31u - last);
    branch->share = (float)__builtin_popcount(profile->edge & upto) / (float)__builtin_popcount(profile->tried & upto);
    branch->length_px = profile->t[last];
    branch->n = (float)n;
    return true;
}

bool oc_judoca_branch_follow(const oc_gradient_t *gradient, const oc_fit_rules_t *rules, const oc_fit_t *fit,
                             uint32_t i, const oc_fit_span_t *span, oc_fit_branch_t *branch)
{
    const oc_fit_walk_t walk = walk_make(gradient, rules, fit, branch, span);
    if (walk.n < MIN_SAMPLES) return false;

    const float blur_px = sqrtf(fit->blur_px2);
    const float inv_s = 1.0f / blur_px, inv_st = 1.0f / sqrtf(fit->blur_px2 - OC_FIT_DIFFERENCE_PX2);
    oc_fit_rival_t rivals[OC_FIT_MAX_BRANCHES];
    oc_fit_profile_t profile;
    gradient->kernels->profile(&walk, rivals, span->has_model ? rivals_make(fit, i, blur_px, rivals) : 0,
                               fit->blur_px2 / (walk.own_major * walk.own_major), inv_s, inv_st, &profile);

    const uint32_t n_short = profile.n_short < MIN_SAMPLES ? MIN_SAMPLES : profile.n_short;
    const float tolerant_px = LEAST_LENGTH * span->asked_px, strict_px = span->asked_px - 1.5f;
    uint32_t places = profile.place, left = profile.n;
    for (uint32_t n = left; n >= n_short; n = n > n_short + 2 ? (n + n_short) / 2 : n - 1) {
        for (; left > n; left--) places &= ~(1u << last_of(places));
        const float last_px = profile.t[last_of(places)];
        if (last_px < strict_px && last_px < tolerant_px) return false;
        if (!branch_solve(gradient->kernels, branch, &profile, places, n)) return false;
        const float limit = n > n_short ? GROW_RMS_PX : rules->max_rms_px;
        if (branch->rms_px <= limit && branch->share >= rules->s_j) {
            return branch->amplitude >= LEAST_CONTRAST * rules->t_b * (float)OC_GRADIENT_ONE;
        }
    }
    return false;
}
