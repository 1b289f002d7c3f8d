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

/* ---- what the interface of a profile is, in one place ---- */

static bool profile_has_place(const oc_fit_profile_t *profile, uint32_t m)
{
    return profile->found[m] == 2;
}

static void profile_set_place(oc_fit_profile_t *profile, uint32_t m, bool is_place)
{
    profile->found[m] = is_place ? 2 : 0;
}

static bool profiles_agree(const oc_fit_profile_t *a, const oc_fit_profile_t *b, uint32_t n)
{
    const size_t n_bytes = n * sizeof(float);
    return memcmp(a->t, b->t, n_bytes) == 0 && memcmp(a->d, b->d, n_bytes) == 0 &&
           memcmp(a->gain, b->gain, n_bytes) == 0 && memcmp(a->value, b->value, n_bytes) == 0 &&
           memcmp(a->bend, b->bend, n_bytes) == 0 && memcmp(a->found, b->found, n_bytes) == 0;
}

static void sums_until(const oc_kernels_t *kernels, const oc_fit_profile_t *profile, uint32_t end, float far_px,
                       oc_fit_sums_t *sums)
{
    kernels->sums(profile, end, far_px, sums);
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
        .is_flat = flat,
        .step_major = flat ? 1 : SIDE,
        .step_minor = flat ? SIDE : 1,
        .n_minor = SIDE,
        .first = (int32_t)(major > 0 ? ceilf(a_major + 1.5f * major) : floorf(a_major + 1.5f * major)),
        .sign = major > 0 ? 1 : -1,
        .n = n,
        .a_major = a_major,
        .a_minor = (float)(flat ? fan->y : fan->x),
        .slope = flat ? uy / ux : ux / uy,
        .nx = -uy * (float)fan->side[j],
        .ny = ux * (float)fan->side[j],
        .own_major = major,
        .own_minor = flat ? uy : ux,
        .has_model = true,
        .floor = 100.0f,
        .reach = reach,
    };
}

static void profile_of(const oc_kernels_t *kernels, const fan_t *fan, int i, const oc_fit_walk_t *walk,
                       oc_fit_profile_t *profile)
{
    oc_fit_rival_t rivals[4];
    uint32_t n = 0;
    for (int j = 0; j < fan->n; j++) {
        if (j == i) continue;
        const double agree = fan->side[i] * fan->side[j] * cos(fan->angle[i] - fan->angle[j]);
        rivals[n++] = (oc_fit_rival_t){(float)cos(fan->angle[j]), (float)sin(fan->angle[j]),
                                       (float)(agree * fan->amplitude[j]), 50.0f};
    }
    const float s2 = (float)fan->s2, inv_st = (float)(1.0 / fan_along_sd(fan));
    memset(profile, 0, sizeof *profile);
    kernels->profile(walk, rivals, n, s2 / (walk->own_major * walk->own_major), 1.0f / sqrtf(s2), inv_st, profile);
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
            profile_of(level_of(0), &fan, i, &walk, &profile);
            const double minor = walk.is_flat ? fabs(cos(fan.angle[i])) : fabs(sin(fan.angle[i]));
            for (uint32_t m = 0; m < n; m++) {
                n_samples++;
                if (!profile_has_place(&profile, m)) continue;
                n_places++;
                const double gain = step((double)profile.t[m] / fan_along_sd(&fan));
                worst_d = fmax(worst_d, fabs((double)profile.d[m]));
                worst_gain = fmax(worst_gain, fabs((double)profile.gain[m] - gain));
                if (walk.reach > 0) continue; /* the tap may be the ridge's other neighbour */
                const double major = walk.first + walk.sign * (double)m;
                const double line = (double)walk.a_minor + (major - (double)walk.a_major) * (double)walk.slope;
                const double tap = floor(line + 0.5), across = (tap - line) * minor;
                const double x = walk.is_flat ? major : tap, y = walk.is_flat ? tap : major;
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
    TEST_ASSERT_TRUE_MESSAGE(worst_d < 0.015 && worst_value < 0.015 && worst_bend < 0.02, text);
}

/* Any derivatives, any branch, also such as leave the picture across. */
static void all_levels_give_the_same_profiles(void)
{
    static oc_fit_profile_t profile[N_LEVELS];
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
            for (int l = 0; l < N_LEVELS; l++) {
                profile_of(level_of(l), &fan, i, &walk, &profile[l]);
                TEST_ASSERT_TRUE_MESSAGE(profiles_agree(&profile[0], &profile[l], walk.n), at(level_of(l), seed));
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
        profile_set_place(profile, m, kernel_below(random, 4) > 0);
    }
}

static void sums_expected(const oc_fit_profile_t *p, uint32_t end, double far_px, double sum[9])
{
    memset(sum, 0, 9 * sizeof sum[0]);
    for (uint32_t m = 0; m < end; m++) {
        if (!profile_has_place(p, m)) continue;
        const double t = (double)p->t[m], d = (double)p->d[m], w = (double)p->gain[m] * (double)p->gain[m];
        const double term[7] = {w, w * t, w * t * t, w * d, w * t * d, w * d * d, (double)(p->value[m] * p->gain[m])};
        for (int i = 0; i < 7; i++) sum[i] += term[i];
        if (t < far_px) continue;
        sum[7] += (double)p->bend[m];
        sum[8] += (double)p->value[m];
    }
}

static void sums_are_those_of_double_precision(void)
{
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        oc_fit_profile_t profile;
        profile_fill(&random, &profile);
        const uint32_t end = 1u + kernel_below(&random, OC_FIT_SAMPLES);
        oc_fit_sums_t sums[N_LEVELS];
        for (int l = 0; l < N_LEVELS; l++) {
            sums_until(level_of(l), &profile, end, 3.0f, &sums[l]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&sums[0], &sums[l], sizeof sums[0], at(level_of(l), seed));
        }
        double expected[9];
        sums_expected(&profile, end, 3.0, expected);
        const oc_fit_sums_t *s = &sums[0];
        const float got[9] = {s->w, s->wt, s->wtt, s->wd, s->wtd, s->wdd, s->value, s->bend, s->level};
        const double size[9] = {32, 500, 11000, 32, 500, 32, 1e6, 3e5, 1e6};
        for (int i = 0; i < 9; i++) {
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(4e-7 * size[i], expected[i], (double)got[i], at(level_of(0), seed));
        }
    }
}

/* ---- round an apex ---- */

/* Derivative across one direction; NAN when a sample is too near to the floor for single precision. */
static double ring_expected(const oc_ring_table_t *table, const int16_t *apex, uint32_t d, double floor_of)
{
    const double angle = d * 6.283185307179586 / OC_RAYS;
    double v[OC_RING_SAMPLES], sum = 0;
    for (uint32_t s = 0; s < OC_RING_SAMPLES; s++) {
        const int16_t *pair = apex + 2 * (table->dy[s][d] * SIDE + table->dx[s][d]);
        v[s] = cos(angle) * pair[1] - sin(angle) * pair[0];
        sum += v[s];
        if (fabs(fabs(v[s]) - floor_of) < 0.05) return NAN;
    }
    if (fabs(sum) < 0.05) return NAN;
    uint32_t n = 0;
    for (uint32_t s = 0; s < OC_RING_SAMPLES; s++) n += sum > 0 ? v[s] > floor_of : v[s] < -floor_of;
    return n + 1 >= OC_RING_SAMPLES ? sum / OC_RING_SAMPLES : 0;
}

static void rings_are_the_mean_across_where_all_but_one_agree(void)
{
    uint32_t n_kept = 0, n_refused = 0;
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        oc_ring_table_t table;
        oc_judoca_ring_build(&table, seed % 2 ? 3 : 6);
        fan_t fan = fan_any(&random);
        fan_render(&fan);
        const int32_t noise = (int32_t)kernel_below(&random, 6000);
        for (int i = 0; i < 2 * SIDE * SIDE; i++) {
            planes[i] = (int16_t)(planes[i] + (int32_t)kernel_below(&random, 2u * (uint32_t)noise + 1u) - noise);
        }
        const int16_t *apex = planes + 2 * (32 * SIDE + 32);
        const float floor_of = kernel_uniform(&random, 0, 3000);
        float ring[N_LEVELS][OC_RAYS];
        for (int l = 0; l < N_LEVELS; l++) {
            level_of(l)->ring(&table, apex, SIDE, floor_of, ring[l]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(ring[0], ring[l], sizeof ring[0], at(level_of(l), seed));
        }
        for (uint32_t d = 0; d < OC_RAYS; d++) {
            const double expected = ring_expected(&table, apex, d, (double)floor_of);
            if (isnan(expected)) continue;
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.02, expected, (double)ring[0][d], at(level_of(0), seed));
            n_kept += expected != 0;
            n_refused += expected == 0;
        }
    }
    TEST_ASSERT_TRUE(n_kept > N_ROUNDS && n_refused > N_ROUNDS);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(profiles_of_blurred_half_lines_lie_on_them);
    RUN_TEST(all_levels_give_the_same_profiles);
    RUN_TEST(sums_are_those_of_double_precision);
    RUN_TEST(rings_are_the_mean_across_where_all_but_one_agree);
    return UNITY_END();
}
