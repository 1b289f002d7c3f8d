/* SPDX-License-Identifier: BSD-3-Clause
 * The kernels of the fit: samples of one branch and their sums. Part of kernels_body.h.
 *
 * A branch has some eight samples, one vector. It stays in registers from the pixels to the answer, and what follows
 * from a sample is a bit in a mask: branches of code that depend on the picture cost more than the sums do. */
#ifndef OUTCROP_VEHICLE_KERNELS_BRANCH_BODY_H
#define OUTCROP_VEHICLE_KERNELS_BRANCH_BODY_H

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

/* Of pairs (dx, dy) the sum dx x + dy y, x and y in 1/2^14. */
KERNEL_INLINE oc_lanes_t pairs_along(oc_ints_t pair, int32_t x, int32_t y)
{
#if __BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__
    return __builtin_convertvector(oc_lanes_pair_sum(pair, x, y), oc_lanes_t) * (1.0f / (1 << 14));
#else
    return __builtin_convertvector(oc_lanes_pair_sum(pair, y, x), oc_lanes_t) * (1.0f / (1 << 14));
#endif
}

/* The highest of the taps round the expected line, and those beside it. */
KERNEL_INLINE void ridge_find(const oc_fit_walk_t *walk, const int16_t *const from[LANES], kernel_ridge_t *ridge,
                              const int32_t reach)
{
    const int32_t n_taps = 2 * reach + 3, nx = walk->nx, ny = walk->ny;
    oc_ints_t pair[MAX_TAPS];
    oc_lanes_t normal[MAX_TAPS];
    for (int32_t k = 0; k < n_taps; k++) {
        pair[k] = pairs_take(from, 2 * k * (ptrdiff_t)walk->step_minor);
        normal[k] = pairs_along(pair[k], nx, ny);
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
    ridge->along = pairs_along(at_ridge, -ny, nx);
}

/* Samples m .. m + 7; those behind the last repeat it. */
KERNEL_INLINE void ridge_take(const oc_fit_walk_t *walk, int32_t m, kernel_ridge_t *ridge, const int32_t reach)
{
    const int32_t half = reach + 1, last = (int32_t)walk->n - 1;
    const oc_ints_t order = kLaneOrder + m, past = order > last;
    const oc_ints_t major = walk->first + walk->sign * ((past & last) | (~past & order));
    const oc_lanes_t from_apex = __builtin_convertvector(major, oc_lanes_t) - walk->a_major;
    const oc_lanes_t expected = walk->a_minor + from_apex * (walk->own_minor * walk->per_major);
    /* Away from the image by less than the shift, so the cut is a floor. */
    const oc_ints_t nearest = __builtin_convertvector(expected + 64.5f, oc_ints_t) - 64;
    const int32_t highest = walk->n_minor - 1 - half;
    const oc_ints_t is_low = nearest<half, is_high = nearest> highest;
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

/* What another branch adds to this one's derivative near the apex: the Gaussian ridge of a half line from there. */
typedef struct kernel_rivals {
    uint32_t which;                             /* bit per lane of the crowd */
    float t_major[OC_LANES], t_minor[OC_LANES]; /* along the rival, st */
    float d_major[OC_LANES], d_minor[OC_LANES]; /* along the rival, s */
    float amplitude[OC_LANES];                  /* in this branch's derivative, signed */
    float reach[OC_LANES];                      /* further out on this branch it adds nothing */
} kernel_rivals_t;

KERNEL_INLINE void rivals_find(const oc_fit_walk_t *walk, const oc_fit_crowd_t *crowd, const oc_fit_blur_t *blur,
                               kernel_rivals_t *rivals)
{
    const uint32_t self = walk->self;
    const oc_lanes_t ux = lanes_load(crowd->ux), uy = lanes_load(crowd->uy);
    const oc_lanes_t major = lanes_load(walk->axis ? crowd->uy : crowd->ux);
    const oc_lanes_t minor = lanes_load(walk->axis ? crowd->ux : crowd->uy);
    const oc_lanes_t cosine = ux * crowd->ux[self] + uy * crowd->uy[self];
    const oc_lanes_t sine = lanes_size(uy * crowd->ux[self] - ux * crowd->uy[self]);
    const oc_lanes_t agree = cosine * lanes_load(crowd->side) * crowd->side[self];
    /* px between the two per px along this one */
    const oc_lanes_t apart = oc_lanes_select(cosine > 0.0f, oc_lanes_max(sine, lanes_all(0.1f)), lanes_all(1.0f));
    lanes_store(rivals->t_major, major * blur->inv_st);
    lanes_store(rivals->t_minor, minor * blur->inv_st);
    lanes_store(rivals->d_major, major * blur->inv_s);
    lanes_store(rivals->d_minor, minor * blur->inv_s);
    lanes_store(rivals->amplitude, agree * lanes_load(crowd->amplitude));
    lanes_store(rivals->reach, OC_FIT_RIVAL_WIDTHS * blur->s / apart);
    rivals->which = oc_bits_of_lanes(lanes_size(agree) >= 0.02f) & ~(1u << self) & ((1u << crowd->n) - 1u);
}

/* Take off what a rival adds to the three taps. */
KERNEL_INLINE void ridge_clear(const kernel_rivals_t *rivals, uint32_t j, kernel_ridge_t *ridge)
{
    const float amplitude = rivals->amplitude[j], dt = rivals->t_minor[j], dd = rivals->d_major[j];
    const oc_lanes_t minor = ridge->centre + ridge->offset;
    const oc_lanes_t t = ridge->major * rivals->t_major[j] + minor * dt;
    const oc_lanes_t d = minor * dd - ridge->major * rivals->d_minor[j];
    ridge->before -= amplitude * lanes_bell(d - dd) * lanes_step(t - dt);
    ridge->middle -= amplitude * lanes_bell(d) * lanes_step(t);
    ridge->after -= amplitude * lanes_bell(d + dd) * lanes_step(t + dt);
}

/* The branch's own ridge rises along the branch; a profile that is not square
 * to it sees that as slope. */
KERNEL_INLINE void ridge_level(const oc_fit_walk_t *walk, const oc_fit_blur_t *blur, kernel_ridge_t *ridge)
{
    const float u_major = walk->own_major * blur->inv_st, u_minor = walk->own_minor * blur->inv_st;
    const oc_lanes_t minor = ridge->centre + ridge->offset;
    const oc_lanes_t t = ridge->major * u_major + minor * u_minor;
    const oc_lanes_t here = lanes_step(t);
    ridge->before *= here / (lanes_step(t - u_minor) + 0.01f);
    ridge->after *= here / (lanes_step(t + u_minor) + 0.01f);
    ridge->middle *= here / (here + 0.01f);
}

/* Leave of the ridge what the branch would show if it were alone and had no end. */
KERNEL_INLINE void ridge_alone(const oc_fit_walk_t *walk, const kernel_rivals_t *rivals, const oc_fit_blur_t *blur,
                               int32_t m, kernel_ridge_t *ridge)
{
    const float from_px = ((float)(walk->first + walk->sign * m) - walk->a_major) * walk->per_major;
    uint32_t rest = rivals->which & oc_bits_of_lanes(lanes_load(rivals->reach) > from_px);
    for (; rest; rest &= rest - 1u) ridge_clear(rivals, (uint32_t)__builtin_ctz(rest), ridge);
    if (from_px < 3.0f * blur->st + 1.0f) ridge_level(walk, blur, ridge);
}

/* What is known of the samples, bit m = sample m. */
typedef struct kernel_marks {
    uint32_t edge, placed; /* an edge; one that says where */
    uint32_t is_free;      /* no other ridge hides it */
    uint32_t beyond;       /* further out than the shortest length */
    uint32_t near;         /* not further than half a pixel beyond it */
} kernel_marks_t;

/* Vertex of the parabola through the three taps, put right for a Gaussian. */
KERNEL_INLINE void ridge_peak(const oc_fit_walk_t *walk, const kernel_ridge_t *ridge, const oc_fit_blur_t *blur,
                              int32_t m, oc_fit_profile_t *out, kernel_marks_t *marks)
{
    /* Without a search the ridge may be nearer to the next pixel. */
    const float most = walk->reach == 0 ? 1.0f : 0.51f;
    const float inv_s2 = walk->own_major * walk->own_major * blur->inv_s2; /* along the minor axis */
    const float gain = inv_s2 * (0.25f + (1.0f / 24.0f) * inv_s2);
    const oc_lanes_t middle = ridge->middle;
    const oc_lanes_t bend = 2.0f * middle - ridge->before - ridge->after, slope = ridge->after - ridge->before;
    const oc_ints_t is_bent = bend > 0.0f;
    const oc_lanes_t p = 0.5f * slope / oc_lanes_select(is_bent, bend, lanes_all(1.0f));
    const oc_lanes_t near = lanes_within(p, -0.5f, 0.5f);
    const oc_lanes_t across = ridge->offset + p + gain * near * (1.0f - 4.0f * near * near) - ridge->expected;
    const oc_lanes_t t = ridge->major * walk->per_major + across * walk->own_minor;
    lanes_store(out->t + m, t);
    lanes_store(out->d + m, across * walk->to_d);
    lanes_store(out->gain + m, lanes_step(t * blur->inv_st));
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
    out->n_short = (uint32_t)__builtin_popcount(out->place & ((far & (0u - far)) - 1u));
}

/* ---- sums ---- */

/* Lanes are summed apart and added up in one fixed order, four sums at a time. */
KERNEL_INLINE oc_quad_t lanes_sums(oc_lanes_t a, oc_lanes_t b, oc_lanes_t c, oc_lanes_t d)
{
    const oc_quad_t a4 = oc_lanes_fold(a), b4 = oc_lanes_fold(b), c4 = oc_lanes_fold(c), d4 = oc_lanes_fold(d);
    const oc_quad_t ab = __builtin_shufflevector(a4, b4, 0, 1, 4, 5) + __builtin_shufflevector(a4, b4, 2, 3, 6, 7);
    const oc_quad_t cd = __builtin_shufflevector(c4, d4, 0, 1, 4, 5) + __builtin_shufflevector(c4, d4, 2, 3, 6, 7);
    return __builtin_shufflevector(ab, cd, 0, 2, 4, 6) + __builtin_shufflevector(ab, cd, 1, 3, 5, 7);
}

KERNEL_INLINE void sums_take(const oc_fit_profile_t *p, uint32_t places, float far_px, oc_fit_sums_t *sums)
{
    oc_lanes_t w = {0}, wt = w, wtt = w, wd = w, wtd = w, wdd = w, value = w, bend = w, level = w;
    for (uint32_t m = 0; m < OC_FIT_SAMPLES && places >> m != 0; m += OC_LANES) {
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
    }
    const oc_quad_t first = lanes_sums(w, wt, wtt, wd), second = lanes_sums(wtd, wdd, value, bend);
    memcpy(&sums->w, &first, sizeof first);
    memcpy(&sums->wtd, &second, sizeof second);
    sums->level = lanes_sums(level, level, level, level)[0];
    const uint32_t last = 31u - (uint32_t)__builtin_clz(places | 1u), upto = UINT32_MAX >> (31u - last);
    const float tried = (float)__builtin_popcount(p->tried & upto);
    sums->n = (uint32_t)__builtin_popcount(places);
    sums->share = (float)__builtin_popcount(p->edge & upto) / (tried > 0.0f ? tried : 1.0f);
    sums->last_px = p->t[last];
}

static void kernel_sums(const oc_fit_profile_t *profile, uint32_t places, float far_px, oc_fit_sums_t *sums)
{
    sums_take(profile, places, far_px, sums);
}

/* ---- a branch ---- */

/* Samples m .. m + 7 of all branches that have them. */
KERNEL_INLINE void tracks_take(const oc_fit_track_t track[], uint32_t n, int32_t m, kernel_ridge_t ridge[])
{
    for (uint32_t i = 0; i < n; i++) {
        const oc_fit_walk_t *walk = &track[i].walk;
        if ((int32_t)walk->n <= m) continue;
        switch (walk->reach) {
        case 0: ridge_take(walk, m, &ridge[i], 0); break;
        case 1: ridge_take(walk, m, &ridge[i], 1); break;
        default: ridge_take(walk, m, &ridge[i], OC_FIT_MAX_REACH); break;
        }
    }
}

/* Step by step for all branches: they do not depend on each other, so one fills the waits of another. */
static void kernel_follow(oc_fit_track_t track[], uint32_t n, const oc_fit_crowd_t *crowd, const oc_fit_blur_t *blur)
{
    kernel_ridge_t ridge[OC_FIT_MAX_BRANCHES];
    kernel_rivals_t rivals[OC_FIT_MAX_BRANCHES];
    kernel_marks_t marks[OC_FIT_MAX_BRANCHES];
    int32_t most = 0;
    for (uint32_t i = 0; i < n; i++) {
        marks[i] = (kernel_marks_t){0, 0, 0, 0, 0};
        most = most > (int32_t)track[i].walk.n ? most : (int32_t)track[i].walk.n;
    }
    const bool has_model = track[0].walk.has_model;
    for (uint32_t i = 0; i < n && has_model; i++) rivals_find(&track[i].walk, crowd, blur, &rivals[i]);
    for (int32_t m = 0; m < most; m += LANES) {
        tracks_take(track, n, m, ridge);
        for (uint32_t i = 0; i < n && has_model; i++) {
            if ((int32_t)track[i].walk.n > m) ridge_alone(&track[i].walk, &rivals[i], blur, m, &ridge[i]);
        }
        for (uint32_t i = 0; i < n; i++) {
            if ((int32_t)track[i].walk.n > m) {
                ridge_peak(&track[i].walk, &ridge[i], blur, m, &track[i].profile, &marks[i]);
            }
        }
    }
    for (uint32_t i = 0; i < n; i++) {
        profile_pick(&track[i].walk, &marks[i], &track[i].profile);
        sums_take(&track[i].profile, track[i].profile.place, track[i].walk.far_px, track[i].sums);
    }
}

static void kernel_acute(const oc_fit_crowd_t *crowd, float cot[OC_FIT_MAX_BRANCHES])
{
    const oc_lanes_t ux = lanes_load(crowd->ux), uy = lanes_load(crowd->uy);
    oc_lanes_t largest = {0};
    for (uint32_t i = 0; i < crowd->n; i++) {
        const oc_lanes_t sine = lanes_size(uy * crowd->ux[i] - ux * crowd->uy[i]);
        const oc_lanes_t both = (ux * crowd->ux[i] + uy * crowd->uy[i]) / oc_lanes_max(sine, lanes_all(0.1f));
        largest = oc_lanes_max(lanes_where(kLaneOrder != (int32_t)i, both), largest);
    }
    lanes_store(cot, largest);
}

/* ---- round the apex ---- */

/* Eight directions of a ring. */
KERNEL_INLINE oc_lanes_t ring_take(const oc_ring_table_t *table, const int16_t *apex, int32_t floor, uint32_t d)
{
    oc_ints_t across;
    memcpy(&across, table->across + d, sizeof across);
    oc_ints_t sum = {0};
    oc_ints_t n_front = {0}, n_back = {0};
    for (uint32_t s = 0; s < OC_RING_SAMPLES; s++) {
        const int16_t *from[LANES];
        for (uint32_t i = 0; i < OC_LANES; i++) from[i] = apex + 2 * (ptrdiff_t)table->at[s][d + i];
        const oc_ints_t pair = pairs_take(from, 0);
        const oc_ints_t v = oc_lanes_pair_sums(pair, across) >> 14;
        sum += v;
        n_front -= v > floor;
        n_back -= v < -floor;
    }
    const oc_ints_t is_front = sum > 0;
    const oc_ints_t n_steady = (is_front & n_front) | (~is_front & n_back);
    return lanes_where(n_steady >= (int32_t)OC_RING_SAMPLES - 1,
                       __builtin_convertvector(sum, oc_lanes_t) * (1.0f / OC_RING_SAMPLES));
}

static uint32_t kernel_ring(const oc_ring_table_t *table, const int16_t *apex, float floor, float contrast,
                            float ring[OC_RAYS])
{
    float closed[OC_RAYS + 2u]; /* one direction more at either end */
    for (uint32_t d = 0; d < OC_RAYS; d += OC_LANES)
        lanes_store(closed + 1 + d, ring_take(table, apex, (int32_t)floor, d));
    closed[0] = closed[OC_RAYS];
    closed[OC_RAYS + 1u] = closed[1];
    memcpy(ring, closed + 1, OC_RAYS * sizeof ring[0]);
    uint32_t greatest = 0;
    for (uint32_t d = 0; d < OC_RAYS; d += OC_LANES) {
        const oc_lanes_t mean = lanes_load(closed + 1 + d), here = lanes_size(mean);
        const oc_ints_t side = (oc_ints_t)mean & INT32_MIN;
        const oc_lanes_t before = (oc_lanes_t)(side ^ (oc_ints_t)lanes_load(closed + d));
        const oc_lanes_t after = (oc_lanes_t)(side ^ (oc_ints_t)lanes_load(closed + 2 + d));
        greatest |= oc_bits_of_lanes((here >= contrast) & (here > before) & (here >= after)) << d;
    }
    return greatest;
}

#endif
