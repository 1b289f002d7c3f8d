/* SPDX-License-Identifier: BSD-3-Clause
 * The kernels of the fit: samples of one branch and their sums. Part of kernels_body.h.
 *
 * A branch has some eight samples, one vector. It stays in registers from the pixels to the answer, and what follows
 * from a sample is a bit in a mask: branches of code that depend on the picture cost more than the sums do. */
#ifndef OUTCROP_VEHICLE_KERNELS_BRANCH_H
#define OUTCROP_VEHICLE_KERNELS_BRANCH_H

#include <string.h>

#include "vehicle/kernels.h"
#include "vehicle/simd.h"

#define KERNEL_INLINE static inline __attribute__((always_inline))

#define LANES ((int32_t)OC_LANES)

static const oc_ints_t kLaneOrder = {0, 1, 2, 3, 4, 5, 6, 7};
static const oc_ints_t kLaneBit = {1, 2, 4, 8, 16, 32, 64, 128};

KERNEL_INLINE oc_lanes_t lanes_load(const float *from)
{
    oc_lanes_t v;
    memcpy(&v, from, sizeof v);
    return v;
}

KERNEL_INLINE void lanes_store(float *to, oc_lanes_t v)
{
    memcpy(to, &v, sizeof v);
}

KERNEL_INLINE oc_lanes_t lanes_all(float value)
{
    return value - (oc_lanes_t){0};
}

KERNEL_INLINE oc_lanes_t lanes_where(oc_ints_t mask, oc_lanes_t v)
{
    return (oc_lanes_t)(mask & (oc_ints_t)v);
}

KERNEL_INLINE oc_lanes_t lanes_within(oc_lanes_t v, float low, float high)
{
    return oc_lanes_max(oc_lanes_min(v, lanes_all(high)), lanes_all(low));
}

KERNEL_INLINE oc_lanes_t lanes_size(oc_lanes_t v)
{
    return (oc_lanes_t)((oc_ints_t)v & INT32_MAX);
}

/* exp(-x^2 / 2), to 0.002. */
KERNEL_INLINE oc_lanes_t lanes_bell(oc_lanes_t x)
{
    const oc_lanes_t y = oc_lanes_min(x * x, lanes_all(16.0f));
    oc_lanes_t u = 1.0f - y * (1.0f / 64.0f) + y * y * (1.0f / 8192.0f);
    u *= u;
    u *= u;
    u *= u;
    u *= u;
    return u * u;
}

/* Integral of the unit Gaussian up to x, to 0.0014: a least-squares polynomial that reaches 0 and 1 at 3. */
KERNEL_INLINE oc_lanes_t lanes_step(oc_lanes_t x)
{
    x = lanes_within(x, -3.0f, 3.0f);
    const oc_lanes_t y = x * x;
    return 0.5f +
           x * (0.39817785f + y * (-0.064430813f + y * (0.0083782524f + y * (-0.00064844084f + y * 2.1710264e-05f))));
}

/* ---- samples ---- */

#define MAX_TAPS (2 * OC_FIT_MAX_REACH + 3)

/* Eight samples of a branch under work. */
typedef struct kernel_ridge {
    oc_lanes_t major;                 /* from the apex */
    oc_lanes_t centre;                /* middle of the search from the apex, minor */
    oc_lanes_t expected;              /* the line from there */
    oc_ints_t is_inside;              /* all taps are pixels */
    oc_lanes_t before, middle, after; /* derivatives across the branch at the ridge */
    oc_lanes_t along;                 /* and along it */
    oc_lanes_t offset;                /* of the ridge's pixel from the middle of the search */
} kernel_ridge_t;

/* Pairs of derivatives at eight pixels. */
KERNEL_INLINE oc_ints_t pairs_take(const int16_t *const from[LANES], ptrdiff_t step)
{
    int32_t pair[LANES];
    for (int32_t m = 0; m < LANES; m++) memcpy(&pair[m], from[m] + step, sizeof pair[m]);
    return (oc_ints_t){pair[0], pair[1], pair[2], pair[3], pair[4], pair[5], pair[6], pair[7]};
}

KERNEL_INLINE oc_lanes_t pairs_dx(oc_ints_t pair)
{
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    return __builtin_convertvector((oc_ints_t)((oc_uints_t)pair << 16) >> 16, oc_lanes_t);
#else
    return __builtin_convertvector(pair >> 16, oc_lanes_t);
#endif
}

KERNEL_INLINE oc_lanes_t pairs_dy(oc_ints_t pair)
{
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    return __builtin_convertvector(pair >> 16, oc_lanes_t);
#else
    return __builtin_convertvector((oc_ints_t)((oc_uints_t)pair << 16) >> 16, oc_lanes_t);
#endif
}

/* The highest of the taps round the expected line, and those beside it. */
KERNEL_INLINE void ridge_find(const oc_fit_walk_t *walk, const int16_t *const from[LANES], kernel_ridge_t *ridge,
                              const int32_t reach)
{
    const int32_t n_taps = 2 * reach + 3;
    oc_ints_t pair[MAX_TAPS];
    oc_lanes_t normal[MAX_TAPS];
    for (int32_t k = 0; k < n_taps; k++) {
        pair[k] = pairs_take(from, 2 * k * (ptrdiff_t)walk->step_minor);
        normal[k] = pairs_dx(pair[k]) * walk->nx + pairs_dy(pair[k]) * walk->ny;
    }
    oc_ints_t at_ridge = pair[1];
    ridge->before = normal[0];
    ridge->middle = normal[1];
    ridge->after = normal[2];
    ridge->offset = lanes_all((float)-reach);
    for (int32_t k = 2; k <= n_taps - 2; k++) {
        const oc_ints_t is_higher = normal[k] > ridge->middle;
        ridge->before = oc_lanes_select(is_higher, normal[k - 1], ridge->before);
        ridge->after = oc_lanes_select(is_higher, normal[k + 1], ridge->after);
        ridge->offset = oc_lanes_select(is_higher, lanes_all((float)(k - 1 - reach)), ridge->offset);
        at_ridge = (oc_ints_t)oc_lanes_select(is_higher, (oc_lanes_t)pair[k], (oc_lanes_t)at_ridge);
        ridge->middle = oc_lanes_max(normal[k], ridge->middle);
    }
    ridge->along = pairs_dy(at_ridge) * walk->nx - pairs_dx(at_ridge) * walk->ny;
}

/* Samples m .. m + 7; those behind the last repeat it. */
KERNEL_INLINE void ridge_take(const oc_fit_walk_t *walk, int32_t m, kernel_ridge_t *ridge, const int32_t reach)
{
    const int32_t half = reach + 1, last = (int32_t)walk->n - 1;
    const oc_ints_t order = kLaneOrder + m, past = order > last;
    const oc_ints_t major = walk->first + walk->sign * ((past & last) | (~past & order));
    const oc_lanes_t from_apex = __builtin_convertvector(major, oc_lanes_t) - walk->a_major;
    const oc_lanes_t expected = walk->a_minor + from_apex * walk->slope;
    /* Away from the image by less than the shift, so the cut is a floor. */
    const oc_ints_t nearest = __builtin_convertvector(expected + 64.5f, oc_ints_t) - 64;
    const int32_t highest = walk->n_minor - 1 - half;
    const oc_ints_t is_low = nearest < half, is_high = nearest > highest;
    const oc_ints_t centre = (is_low & half) | (is_high & highest) | (~(is_low | is_high) & nearest);
    const oc_lanes_t centre_px = __builtin_convertvector(centre, oc_lanes_t);
    ridge->major = from_apex;
    ridge->centre = centre_px - walk->a_minor;
    ridge->expected = expected - centre_px;
    ridge->is_inside = ~(past | is_low | is_high);

    const oc_ints_t at = major * walk->step_major + (centre - half) * walk->step_minor;
    int32_t pixel[LANES];
    memcpy(pixel, &at, sizeof pixel);
    const int16_t *from[LANES];
    for (int32_t i = 0; i < LANES; i++) from[i] = walk->dxdy + 2 * (ptrdiff_t)pixel[i];
    ridge_find(walk, from, ridge, reach);
}

/* Number of samples up to a distance from the apex. */
KERNEL_INLINE int32_t samples_until(const oc_fit_walk_t *walk, float reach_px)
{
    const float major = walk->own_major < 0.0f ? -walk->own_major : walk->own_major;
    const float first = ((float)walk->first - walk->a_major) * (float)walk->sign;
    const float n = reach_px * major - first + 1.0f;
    return n < (float)OC_FIT_SAMPLES ? (int32_t)n : (int32_t)OC_FIT_SAMPLES;
}

/* Take off what a rival branch adds to the three taps. */
KERNEL_INLINE void ridge_clear(const oc_fit_walk_t *walk, const oc_fit_rival_t *rival, float inv_s, float inv_st,
                               kernel_ridge_t *ridge)
{
    const bool flat = walk->is_flat;
    const float u_major = flat ? rival->ux : rival->uy, u_minor = flat ? rival->uy : rival->ux;
    const float amplitude = rival->amplitude;
    const oc_lanes_t minor = ridge->centre + ridge->offset;
    const oc_lanes_t t = (ridge->major * u_major + minor * u_minor) * inv_st;
    const oc_lanes_t d = (minor * u_major - ridge->major * u_minor) * inv_s;
    const float dt = u_minor * inv_st, dd = u_major * inv_s;
    ridge->before -= amplitude * lanes_bell(d - dd) * lanes_step(t - dt);
    ridge->middle -= amplitude * lanes_bell(d) * lanes_step(t);
    ridge->after -= amplitude * lanes_bell(d + dd) * lanes_step(t + dt);
}

/* The branch's own ridge rises along the branch; a profile that is not square
 * to it sees that as slope. */
KERNEL_INLINE void ridge_level(const oc_fit_walk_t *walk, float inv_st, kernel_ridge_t *ridge)
{
    const float u_major = walk->own_major * inv_st, u_minor = walk->own_minor * inv_st;
    const oc_lanes_t minor = ridge->centre + ridge->offset;
    const oc_lanes_t t = ridge->major * u_major + minor * u_minor;
    const oc_lanes_t here = lanes_step(t);
    ridge->before *= here / (lanes_step(t - u_minor) + 0.01f);
    ridge->after *= here / (lanes_step(t + u_minor) + 0.01f);
    ridge->middle *= here / (here + 0.01f);
}

/* What is known of the samples, bit m = sample m. */
typedef struct kernel_marks {
    uint32_t edge, placed; /* an edge; one that says where */
    uint32_t is_free;      /* no other ridge hides it */
    uint32_t beyond;       /* further out than the shortest length */
    uint32_t near;         /* not further than half a pixel beyond it */
} kernel_marks_t;

/* Vertex of the parabola through the three taps, put right for a Gaussian. */
KERNEL_INLINE void ridge_peak(const oc_fit_walk_t *walk, const kernel_ridge_t *ridge, float s2, float inv_st,
                              const float most, int32_t m, oc_fit_profile_t *out, kernel_marks_t *marks)
{
    /* The minor axis on the normal and along the branch. */
    const float to_d = walk->is_flat ? walk->own_major : -walk->own_major, to_t = walk->own_minor;
    const float per_major = 1.0f / walk->own_major;
    const float gain = 0.25f / s2 + (1.0f / 24.0f) / (s2 * s2);
    const oc_lanes_t middle = ridge->middle;
    const oc_lanes_t bend = 2.0f * middle - ridge->before - ridge->after, slope = ridge->after - ridge->before;
    const oc_ints_t is_bent = bend > 0.0f;
    const oc_lanes_t p = 0.5f * slope / oc_lanes_select(is_bent, bend, lanes_all(1.0f));
    const oc_lanes_t near = lanes_within(p, -0.5f, 0.5f);
    const oc_lanes_t across = ridge->offset + p + gain * near * (1.0f - 4.0f * near * near) - ridge->expected;
    const oc_lanes_t t = ridge->major * per_major + across * to_t;
    lanes_store(out->t + m, t);
    lanes_store(out->d + m, across * to_d);
    lanes_store(out->gain + m, lanes_step(t * inv_st));
    lanes_store(out->value + m, middle);
    lanes_store(out->bend + m, bend);
    const oc_ints_t is_edge = (middle > walk->floor) & (lanes_size(ridge->along) <= 0.62f * middle) & ridge->is_inside;
    marks->edge |= oc_bits_of_lanes(is_edge) << m;
    marks->placed |= oc_bits_of_lanes(is_edge & is_bent & (p <= most) & (p >= -most)) << m;
    marks->is_free |= oc_bits_of_lanes(t >= walk->crowded_px) << m;
    marks->beyond |= oc_bits_of_lanes(t > walk->shortest_px) << m;
    marks->near |= oc_bits_of_lanes(t <= walk->shortest_px + 0.5f) << m;
}

/* All positions up to the shortest length, then as far as no two samples in a row are missing. */
KERNEL_INLINE void profile_pick(const oc_fit_walk_t *walk, const kernel_marks_t *marks, oc_fit_profile_t *out)
{
    const uint32_t all = UINT32_MAX >> (OC_FIT_SAMPLES - walk->n);
    const uint32_t seen = marks->placed | (marks->edge & marks->is_free), missing = ~seen & all;
    const uint32_t stop = missing & missing << 1 & marks->beyond;
    const uint32_t before_stop = all & ((stop & (0u - stop)) - 1u);
    out->place = marks->placed & before_stop;
    out->edge = seen;
    out->tried = marks->placed | marks->is_free;
    const uint32_t far = out->place & ~marks->near;
    out->n = (uint32_t)__builtin_popcount(out->place);
    out->n_short = (uint32_t)__builtin_popcount(out->place & ((far & (0u - far)) - 1u));
}

/* ---- sums ---- */

/* Lanes are summed apart and added up in one fixed order. */
KERNEL_INLINE float lanes_sum(oc_lanes_t v)
{
    return ((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7]));
}

static void kernel_sums(const oc_fit_profile_t *p, uint32_t places, float far_px, oc_fit_sums_t *sums)
{
    oc_lanes_t w = {0}, wt = w, wtt = w, wd = w, wtd = w, wdd = w, value = w, bend = w, level = w;
    for (uint32_t m = 0; places >> m != 0; m += OC_LANES) {
        const oc_ints_t counts = ((int32_t)(places >> m & 0xffu) & kLaneBit) != 0;
        const oc_lanes_t t = lanes_where(counts, lanes_load(p->t + m)), d = lanes_where(counts, lanes_load(p->d + m));
        const oc_lanes_t gain = lanes_where(counts, lanes_load(p->gain + m));
        const oc_lanes_t v = lanes_where(counts, lanes_load(p->value + m));
        const oc_ints_t is_far = counts & (t >= far_px);
        const oc_lanes_t weight = gain * gain, weight_t = weight * t, weight_d = weight * d;
        w += weight;
        wt += weight_t;
        wtt += weight_t * t;
        wd += weight_d;
        wtd += weight_t * d;
        wdd += weight_d * d;
        value += v * gain;
        bend += lanes_where(is_far, lanes_load(p->bend + m));
        level += lanes_where(is_far, v);
        if (m + OC_LANES >= OC_FIT_SAMPLES) break;
    }
    *sums = (oc_fit_sums_t){lanes_sum(w),   lanes_sum(wt),    lanes_sum(wtt),  lanes_sum(wd),   lanes_sum(wtd),
                            lanes_sum(wdd), lanes_sum(value), lanes_sum(bend), lanes_sum(level)};
}

KERNEL_INLINE void profile_reach(const oc_fit_walk_t *walk, const oc_fit_rival_t rivals[], uint32_t n_rivals, float s2,
                                 float inv_s, float inv_st, oc_fit_profile_t *out, const int32_t reach)
{
    kernel_marks_t marks = {0};
    const int32_t n = (int32_t)walk->n;
    const int32_t n_level = walk->has_model ? samples_until(walk, 3.0f / inv_st + 1.0f) : 0;
    for (int32_t m = 0; m < n; m += LANES) {
        kernel_ridge_t ridge;
        ridge_take(walk, m, &ridge, reach);
        for (uint32_t j = 0; j < n_rivals; j++) {
            if (samples_until(walk, rivals[j].reach_px) > m) ridge_clear(walk, &rivals[j], inv_s, inv_st, &ridge);
        }
        if (n_level > m) ridge_level(walk, inv_st, &ridge);
        /* Without a search the ridge may be nearer to the next pixel. */
        ridge_peak(walk, &ridge, s2, inv_st, reach == 0 ? 1.0f : 0.51f, m, out, &marks);
    }
    profile_pick(walk, &marks, out);
}

static void kernel_profile(const oc_fit_walk_t *walk, const oc_fit_rival_t rivals[], uint32_t n_rivals, float s2,
                           float inv_s, float inv_st, oc_fit_profile_t *out)
{
    switch (walk->reach) {
    case 0: profile_reach(walk, rivals, n_rivals, s2, inv_s, inv_st, out, 0); break;
    case 1: profile_reach(walk, rivals, n_rivals, s2, inv_s, inv_st, out, 1); break;
    default: profile_reach(walk, rivals, n_rivals, s2, inv_s, inv_st, out, 2); break;
    }
}

#endif
