/* SPDX-License-Identifier: BSD-3-Clause
 * The fit's kernels: every level against the twin, bit for bit, and the twin against the same formulas in double
 * precision: blurred half lines, sums, and the look round an apex. */
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "kernel_input.h"
#include "vehicle/judoca_fit.h"

#define SIDE 64
#define N_ROUNDS 2000
#define N_LEVELS 3

static int16_t planes[SIDE * SIDE * 2];
static char text[128];

void setUp(void) {}

void tearDown(void) {}

static const oc_kernels_t *level_of(int i)
{
    return oc_kernels_get((oc_simd_t)(OC_SIMD_SCALAR + i));
}

static const char *at(const oc_kernels_t *kernels, uint64_t seed)
{
    (void)snprintf(text, sizeof text, "level %d, seed %llu", (int)kernels->level, (unsigned long long)seed);
    return text;
}

static bool profile_has_place(const oc_fit_profile_t *profile, uint32_t m)
{
    return profile->place >> m & 1u;
}

static bool profiles_agree(const oc_fit_profile_t *a, const oc_fit_profile_t *b, uint32_t n)
{
    const size_t n_bytes = n * sizeof(float);
    return memcmp(a->t, b->t, n_bytes) == 0 && memcmp(a->d, b->d, n_bytes) == 0 &&
           memcmp(a->gain, b->gain, n_bytes) == 0 && memcmp(a->value, b->value, n_bytes) == 0 &&
           memcmp(a->bend, b->bend, n_bytes) == 0 && a->place == b->place && a->edge == b->edge &&
           a->tried == b->tried && a->n_short == b->n_short;
}

/* ---- profiles ---- */

/* Half lines from one apex: direction, side of the gradient, height of the ridge. */
typedef struct fan {
    double x, y, s2; /* apex, variance across an edge */
    int n;
    double angle[4], side[4], amplitude[4];
} fan_t;

/* Along a ridge the central difference adds nothing. */
static double fan_along_sd(const fan_t *fan)
{
    return sqrt(fan->s2 - (double)OC_FIT_DIFFERENCE_PX2);
}

static double step(double x)
{
    return 0.5 * (1.0 + erf(x / sqrt(2.0)));
}

/* What half line j adds to the derivative at a point, along its own normal. */
static double fan_ridge(const fan_t *fan, int j, double x, double y)
{
    const double ux = cos(fan->angle[j]), uy = sin(fan->angle[j]);
    const double t = (x - fan->x) * ux + (y - fan->y) * uy, d = (y - fan->y) * ux - (x - fan->x) * uy;
    return fan->side[j] * fan->amplitude[j] * exp(-0.5 * d * d / fan->s2) * step(t / fan_along_sd(fan));
}

static void fan_render(const fan_t *fan)
{
    for (int i = 0; i < SIDE * SIDE; i++) {
        double gx = 0, gy = 0;
        for (int j = 0; j < fan->n; j++) {
            const double v = fan_ridge(fan, j, i % SIDE, i / SIDE);
            gx -= v * sin(fan->angle[j]);
            gy += v * cos(fan->angle[j]);
        }
        planes[2 * i] = (int16_t)lrint(gx);
        planes[2 * i + 1] = (int16_t)lrint(gy);
    }
}

static oc_fit_walk_t walk_of(const fan_t *fan, int j, uint32_t n, int32_t reach)
{
    const float ux = (float)cos(fan->angle[j]), uy = (float)sin(fan->angle[j]);
    const bool flat = fabsf(ux) >= fabsf(uy);
    const float major = flat ? ux : uy, a_major = (float)(flat ? fan->x : fan->y);
    return (oc_fit_walk_t){
        .dxdy = planes,
        .step_major = flat ? 1 : SIDE,
        .step_minor = flat ? SIDE : 1,
        .n_minor = SIDE,
        .first = (int32_t)(major > 0 ? ceilf(a_major + 1.5f * major) : floorf(a_major + 1.5f * major)),
        .sign = major > 0 ? 1 : -1,
        .n = n,
        .a_major = a_major,
        .a_minor = (float)(flat ? fan->y : fan->x),
        .nx = (int32_t)lrint(-sin(fan->angle[j]) * fan->side[j] * (1 << 14)),
        .ny = (int32_t)lrint(cos(fan->angle[j]) * fan->side[j] * (1 << 14)),
        .own_major = major,
        .own_minor = flat ? uy : ux,
        .per_major = 1.0f / major,
        .to_d = flat ? major : -major,
        .floor = 100.0f,
        .shortest_px = 50.0f,
        .far_px = 3.0f,
        .self = (uint32_t)j,
        .axis = !flat,
        .reach = reach,
        .has_model = true,
    };
}

static void profile_of(const oc_kernels_t *kernels, const fan_t *fan, const oc_fit_walk_t *walk,
                       oc_fit_profile_t *profile, oc_fit_sums_t *sums)
{
    oc_fit_crowd_t crowd = {.n = (uint32_t)fan->n};
    for (int j = 0; j < fan->n; j++) {
        crowd.ux[j] = (float)cos(fan->angle[j]);
        crowd.uy[j] = (float)sin(fan->angle[j]);
        crowd.side[j] = (float)fan->side[j];
        crowd.amplitude[j] = (float)fan->amplitude[j];
    }
    const double sd = sqrt(fan->s2), along = fan_along_sd(fan);
    const oc_fit_blur_t blur = {(float)sd, (float)along, (float)(1 / sd), (float)(1 / along), (float)(1 / fan->s2)};
    static oc_fit_track_t track;
    memset(&track, 0, sizeof track);
    memset(sums, 0, sizeof *sums);
    track.walk = *walk;
    track.sums = sums;
    kernels->follow(&track, 1, &crowd, &blur);
    *profile = track.profile;
}

static fan_t fan_any(kernel_random_t *random)
{
    fan_t fan = {(double)kernel_uniform(random, 30, 34),
                 (double)kernel_uniform(random, 30, 34),
                 (double)kernel_uniform(random, 1.2f, 4.0f),
                 1 + (int)kernel_below(random, 3),
                 {0},
                 {0},
                 {0}};
    for (int j = 0; j < fan.n; j++) {
        const double room = 6.283185307179586 / fan.n;
        fan.angle[j] = room * j + (double)kernel_uniform(random, 0, (float)room - 1.0f);
        fan.side[j] = kernel_below(random, 2) ? 1 : -1;
        fan.amplitude[j] = (double)kernel_uniform(random, 4000, 9000);
    }
    return fan;
}

/* With the rivals' model taken off, what is left is the branch's own ridge: on its line, of its height and bend. */
static void profiles_of_blurred_half_lines_lie_on_them(void)
{
    double worst_d = 0, worst_value = 0, worst_gain = 0, worst_bend = 0;
    uint32_t n_places = 0, n_samples = 0;
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        const fan_t fan = fan_any(&random);
        fan_render(&fan);
        for (int i = 0; i < fan.n; i++) {
            const uint32_t n = 8u + kernel_below(&random, 9);
            /* Farther across, the strongest of the raw derivatives near the apex may be a rival's. */
            const oc_fit_walk_t walk = walk_of(&fan, i, n, fan.n == 1 ? (int32_t)(seed % 3) : 0);
            oc_fit_profile_t profile;
            oc_fit_sums_t sums;
            profile_of(level_of(0), &fan, &walk, &profile, &sums);
            TEST_ASSERT_EQUAL_UINT32((uint32_t)__builtin_popcount(profile.place), sums.n);
            const double minor = fabs((double)walk.own_major), tangent = (double)(walk.own_minor * walk.per_major);
            for (uint32_t m = 0; m < n; m++) {
                n_samples++;
                if (!profile_has_place(&profile, m)) continue;
                n_places++;
                const double gain = step((double)profile.t[m] / fan_along_sd(&fan));
                worst_d = fmax(worst_d, fabs((double)profile.d[m]));
                worst_gain = fmax(worst_gain, fabs((double)profile.gain[m] - gain));
                if (walk.reach > 0) continue; /* the tap may be the ridge's other neighbour */
                const double major = walk.first + walk.sign * (double)m;
                const double line = (double)walk.a_minor + (major - (double)walk.a_major) * tangent;
                const double tap = floor(line + 0.5), across = (tap - line) * minor;
                const double x = walk.axis ? tap : major, y = walk.axis ? major : tap;
                const double own = fabs(fan_ridge(&fan, i, x, y)) / fan.amplitude[i];
                const double beside = exp(-0.5 * minor * (minor + 2 * across) / fan.s2) +
                                      exp(-0.5 * minor * (minor - 2 * across) / fan.s2);
                const double value = (double)profile.value[m] / fan.amplitude[i];
                worst_value = fmax(worst_value, fabs(value - own));
                worst_bend = fmax(worst_bend, fabs((double)profile.bend[m] / fan.amplitude[i] - own * (2 - beside)));
            }
        }
    }
    (void)snprintf(text, sizeof text, "%u of %u placed; d %.4f px, value %.4f, gain %.4f, bend %.4f",
                   (unsigned)n_places, (unsigned)n_samples, worst_d, worst_value, worst_gain, worst_bend);
    printf("%s\n", text);
    TEST_ASSERT_TRUE_MESSAGE(n_places > n_samples * 98 / 100, text);
    TEST_ASSERT_TRUE_MESSAGE(worst_gain < 0.0015, text); /* of the polynomial */
    TEST_ASSERT_TRUE_MESSAGE(worst_d < 0.02 && worst_value < 0.02 && worst_bend < 0.015, text);
}

/* Any derivatives, any branch, also such as leave the picture across. */
static void all_levels_give_the_same_profiles(void)
{
    static oc_fit_profile_t profile[N_LEVELS];
    static oc_fit_sums_t sums[N_LEVELS];
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        const uint32_t most = kernel_below(&random, 2) ? 65535 : 5;
        for (int i = 0; i < 2 * SIDE * SIDE; i++) {
            planes[i] = (int16_t)((int32_t)kernel_below(&random, most) - (int32_t)most / 2);
        }
        fan_t fan = fan_any(&random);
        fan.x += (double)kernel_uniform(&random, -12, 12);
        fan.y += (double)kernel_uniform(&random, -12, 12);
        for (int i = 0; i < fan.n; i++) {
            oc_fit_walk_t walk = walk_of(&fan, i, 1u + kernel_below(&random, 16), (int32_t)kernel_below(&random, 3));
            walk.has_model = kernel_below(&random, 2);
            walk.floor = kernel_uniform(&random, 0, 300);
            walk.crowded_px = kernel_uniform(&random, 0, 6);
            walk.shortest_px = kernel_uniform(&random, 2, 12);
            for (int l = 0; l < N_LEVELS; l++) {
                profile_of(level_of(l), &fan, &walk, &profile[l], &sums[l]);
                TEST_ASSERT_TRUE_MESSAGE(profiles_agree(&profile[0], &profile[l], walk.n), at(level_of(l), seed));
                TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&sums[0], &sums[l], sizeof sums[0], at(level_of(l), seed));
            }
        }
    }
}

/* ---- sums ---- */

static void profile_fill(kernel_random_t *random, oc_fit_profile_t *profile)
{
    memset(profile, 0, sizeof *profile);
    for (uint32_t m = 0; m < OC_FIT_SAMPLES; m++) {
        profile->t[m] = 1.5f + (float)m + kernel_uniform(random, -0.5f, 0.5f);
        profile->d[m] = kernel_uniform(random, -1, 1);
        profile->gain[m] = kernel_uniform(random, 0.5f, 1);
        profile->value[m] = kernel_uniform(random, 0, 32767);
        profile->bend[m] = kernel_uniform(random, -100, 9000);
    }
    profile->place = (uint32_t)kernel_word(random, kernel_below(random, 4) + 2u);
    profile->edge = profile->place | (uint32_t)kernel_word(random, 2);
    profile->tried = profile->edge | (uint32_t)kernel_word(random, 2);
}

static void sums_expected(const oc_fit_profile_t *p, uint32_t places, double far_px, double sum[9])
{
    memset(sum, 0, 9 * sizeof sum[0]);
    for (uint32_t m = 0; m < OC_FIT_SAMPLES; m++) {
        if (!(places >> m & 1u)) continue;
        const double t = (double)p->t[m], d = (double)p->d[m], w = (double)p->gain[m] * (double)p->gain[m];
        const double term[7] = {w, w * t, w * t * t, w * d, w * t * d, w * d * d, (double)(p->value[m] * p->gain[m])};
        for (int i = 0; i < 7; i++) sum[i] += term[i];
        if (t < far_px) continue;
        sum[7] += (double)p->bend[m];
        sum[8] += (double)p->value[m];
    }
}

/* Share of the samples that count which are edges, up to one. */
static double share_expected(const oc_fit_profile_t *p, uint32_t last)
{
    uint32_t n_edges = 0, n_tried = 0;
    for (uint32_t m = 0; m <= last; m++) {
        n_edges += p->edge >> m & 1u;
        n_tried += p->tried >> m & 1u;
    }
    return n_tried > 0 ? n_edges / (double)n_tried : 0;
}

static void sums_are_those_of_double_precision(void)
{
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        oc_fit_profile_t profile;
        profile_fill(&random, &profile);
        const uint32_t places = profile.place & UINT32_MAX >> kernel_below(&random, OC_FIT_SAMPLES);
        if (places == 0) continue;
        oc_fit_sums_t sums[N_LEVELS];
        memset(sums, 0, sizeof sums);
        for (int l = 0; l < N_LEVELS; l++) {
            level_of(l)->sums(&profile, places, 3.0f, &sums[l]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&sums[0], &sums[l], sizeof sums[0], at(level_of(l), seed));
        }
        double expected[9];
        sums_expected(&profile, places, 3.0, expected);
        const oc_fit_sums_t *s = &sums[0];
        const float got[9] = {s->w, s->wt, s->wtt, s->wd, s->wtd, s->wdd, s->value, s->bend, s->level};
        const double size[9] = {32, 500, 11000, 32, 500, 32, 1e6, 3e5, 1e6};
        for (int i = 0; i < 9; i++) {
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(4e-7 * size[i], expected[i], (double)got[i], at(level_of(0), seed));
        }
        uint32_t last = 0, n = 0;
        for (uint32_t m = 0; m < OC_FIT_SAMPLES; m++) {
            if (!(places >> m & 1u)) continue;
            last = m;
            n++;
        }
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(n, s->n, at(level_of(0), seed));
        TEST_ASSERT_TRUE_MESSAGE(s->last_px == profile.t[last], at(level_of(0), seed));
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-6, share_expected(&profile, last), (double)s->share,
                                          at(level_of(0), seed));
    }
}

/* ---- angles ---- */

static void the_nearest_branch_gives_the_cotangent(void)
{
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        oc_fit_crowd_t crowd = {.n = kernel_below(&random, OC_FIT_MAX_BRANCHES) + 1u};
        double angle[OC_FIT_MAX_BRANCHES];
        for (uint32_t i = 0; i < OC_FIT_MAX_BRANCHES; i++) { /* what is behind the last does not count */
            angle[i] = (double)kernel_uniform(&random, 0, 6.2831853f);
            crowd.ux[i] = (float)cos(angle[i]);
            crowd.uy[i] = (float)sin(angle[i]);
        }
        float cot[N_LEVELS][OC_FIT_MAX_BRANCHES];
        memset(cot, 0, sizeof cot);
        for (int l = 0; l < N_LEVELS; l++) {
            level_of(l)->acute(&crowd, cot[l]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(cot[0], cot[l], crowd.n * sizeof(float), at(level_of(l), seed));
        }
        for (uint32_t i = 0; i < crowd.n; i++) {
            double most = 0;
            for (uint32_t k = 0; k < crowd.n; k++) {
                const double turn = angle[i] - angle[k];
                if (k != i) most = fmax(most, cos(turn) / fmax(fabs(sin(turn)), 0.1));
            }
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1e-4, most, (double)cot[0][i], at(level_of(0), seed));
        }
    }
}

/* ---- round an apex ---- */

#define APEX (32 * SIDE + 32)

/* Derivative across one direction; NAN when a sample is too near to the floor to tell in whole numbers. */
static double ring_expected(uint32_t d, int first_px, double floor_of)
{
    const double angle = d * 6.283185307179586 / OC_RAYS;
    double v[OC_RING_SAMPLES], sum = 0;
    for (uint32_t s = 0; s < OC_RING_SAMPLES; s++) {
        const long x = lrint((first_px + (int)s) * cos(angle)), y = lrint((first_px + (int)s) * sin(angle));
        const int16_t *pair = planes + 2 * (APEX + y * SIDE + x);
        v[s] = cos(angle) * pair[1] - sin(angle) * pair[0];
        sum += v[s];
        if (fabs(fabs(v[s]) - floor_of) < 4) return NAN;
    }
    if (fabs(sum) < 20) return NAN;
    uint32_t n = 0;
    for (uint32_t s = 0; s < OC_RING_SAMPLES; s++) n += sum > 0 ? v[s] > floor_of : v[s] < -floor_of;
    return n + 1 >= OC_RING_SAMPLES ? sum / OC_RING_SAMPLES : 0;
}

/* A direction of enough contrast, greater than before and not less than after, seen with its own sign. */
static bool ring_is_greatest(const float ring[OC_RAYS], uint32_t d, float contrast)
{
    const float sign = signbit(ring[d]) ? -1.0f : 1.0f, here = sign * ring[d];
    const float before = sign * ring[(d + OC_RAYS - 1u) % OC_RAYS], after = sign * ring[(d + 1u) % OC_RAYS];
    return here >= contrast && here > before && here >= after;
}

static void rings_are_the_mean_across_where_all_but_one_agree(void)
{
    uint32_t n_kept = 0, n_refused = 0, n_greatest = 0;
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        const int first_px = seed % 2 ? 3 : 6;
        oc_ring_table_t table;
        oc_judoca_ring_build(&table, first_px, SIDE);
        const fan_t fan = fan_any(&random);
        fan_render(&fan);
        const int32_t noise = (int32_t)kernel_below(&random, 6000);
        for (int i = 0; i < 2 * SIDE * SIDE; i++) {
            planes[i] = (int16_t)(planes[i] + (int32_t)kernel_below(&random, 2u * (uint32_t)noise + 1u) - noise);
        }
        const float floor_of = kernel_uniform(&random, 0, 3000), contrast = kernel_uniform(&random, 1, 4000);
        float ring[N_LEVELS][OC_RAYS];
        uint32_t greatest[N_LEVELS];
        for (int l = 0; l < N_LEVELS; l++) {
            greatest[l] = level_of(l)->ring(&table, planes + 2 * APEX, floor_of, contrast, ring[l]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(ring[0], ring[l], sizeof ring[0], at(level_of(l), seed));
            TEST_ASSERT_EQUAL_HEX32_MESSAGE(greatest[0], greatest[l], at(level_of(l), seed));
        }
        for (uint32_t d = 0; d < OC_RAYS; d++) {
            TEST_ASSERT_EQUAL_MESSAGE(ring_is_greatest(ring[0], d, contrast), greatest[0] >> d & 1u,
                                      at(level_of(0), seed));
            n_greatest += greatest[0] >> d & 1u;
            const double expected = ring_expected(d, first_px, (double)floor_of);
            if (isnan(expected)) continue;
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(3, expected, (double)ring[0][d], at(level_of(0), seed));
            n_kept += expected != 0;
            n_refused += expected == 0;
        }
    }
    TEST_ASSERT_TRUE(n_kept > N_ROUNDS && n_refused > N_ROUNDS && n_greatest > N_ROUNDS);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(profiles_of_blurred_half_lines_lie_on_them);
    RUN_TEST(all_levels_give_the_same_profiles);
    RUN_TEST(sums_are_those_of_double_precision);
    RUN_TEST(the_nearest_branch_gives_the_cotangent);
    RUN_TEST(rings_are_the_mean_across_where_all_but_one_agree);
    return UNITY_END();
}
