/* SPDX-License-Identifier: BSD-3-Clause
 * The kernels of every level against the twin, bit for bit, and each against what it is defined to do. */
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "kernel_input.h"

#define N_ROUNDS 400
#define WIDTH 333u
#define ROOM 512 /* of a row: zeros up to a multiple of 64, and a margin before it */
#define MARGIN 64

static const oc_kernels_t *twin;
static char text[96];

void setUp(void)
{
    twin = oc_kernels_get(OC_SIMD_SCALAR);
}

void tearDown(void) {}

/* Every level that this processor has, the twin too. */
static const oc_kernels_t *level_of(int i)
{
    return oc_kernels_get((oc_simd_t)(OC_SIMD_SCALAR + i));
}

#define N_LEVELS 3

/* Says where a failure was. */
static const char *at(const oc_kernels_t *kernels, uint64_t seed)
{
    (void)snprintf(text, sizeof text, "level %d, seed %llu", (int)kernels->level, (unsigned long long)seed);
    return text;
}

static void the_twin_is_the_twin_and_auto_is_the_best(void)
{
    TEST_ASSERT_EQUAL(OC_SIMD_SCALAR, twin->level);
    TEST_ASSERT_EQUAL_PTR(oc_kernels_get(OC_SIMD_AVX2), oc_kernels_get(OC_SIMD_AUTO));
    for (int i = 1; i < N_LEVELS; i++) {
        TEST_ASSERT_TRUE(level_of(i)->level == OC_SIMD_BASE || (int)level_of(i)->level == OC_SIMD_SCALAR + i);
        printf("level %d runs as %d\n", OC_SIMD_SCALAR + i, (int)level_of(i)->level);
    }
}

/* ---- rows of the gradient ---- */

/* A kernel that sums to 256, of any shape but a single weight, which no Gaussian of 0.6 px and more has. */
static int32_t kernel_any(kernel_random_t *random, uint16_t kernel[OC_GRADIENT_MAX_RADIUS + 1])
{
    const int32_t radius = (int32_t)kernel_below(random, OC_GRADIENT_MAX_RADIUS) + 1;
    uint32_t left = 256;
    memset(kernel, 0, (OC_GRADIENT_MAX_RADIUS + 1) * sizeof kernel[0]);
    for (int32_t i = radius; i > 0; i--) {
        kernel[i] = (uint16_t)kernel_below(random, left / 2u / (uint32_t)(i + 1) + 1u);
        left -= 2u * kernel[i];
    }
    if (left == 256) {
        kernel[1] = 1;
        left -= 2;
    }
    kernel[0] = (uint16_t)left;
    return radius;
}

static void filters_down_and_across_are_the_weighted_sums(void)
{
    static uint8_t image[2 * OC_GRADIENT_MAX_RADIUS + 1][WIDTH];
    static uint16_t in[MARGIN + ROOM], down[N_LEVELS][ROOM];
    static int16_t across[N_LEVELS][ROOM];
    const uint8_t *rows[2 * OC_GRADIENT_MAX_RADIUS + 1];
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        uint16_t kernel[OC_GRADIENT_MAX_RADIUS + 1];
        const int32_t radius = kernel_any(&random, kernel);
        const uint32_t width = kernel_below(&random, WIDTH) + 1u;
        const uint32_t style = kernel_below(&random, 3);
        for (int32_t r = 0; r <= 2 * radius; r++) {
            rows[r] = image[r];
            for (uint32_t x = 0; x < width; x++) {
                const uint32_t value = kernel_below(&random, 256);
                image[r][x] = (uint8_t)(style == 0 ? value : style == 1 ? (value & 1u) * 255u : 255u);
            }
        }
        for (uint32_t i = 0; i < MARGIN + ROOM; i++) {
            in[i] = (uint16_t)(style == 2 ? 32640u : kernel_below(&random, 32641)); /* 255 x 128 at most */
        }
        for (int l = 0; l < N_LEVELS; l++) {
            level_of(l)->down(rows, kernel, radius, width, down[l]);
            level_of(l)->across(in + MARGIN, kernel, radius, width, across[l]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(down[0], down[l], width * sizeof down[0][0], at(level_of(l), seed));
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(across[0], across[l], width * sizeof across[0][0], at(level_of(l), seed));
        }
        for (uint32_t x = 0; x < width; x++) {
            uint32_t sum_down = 0;
            double sum_across = 0;
            for (int32_t i = -radius; i <= radius; i++) {
                const uint32_t weight = kernel[i < 0 ? -i : i];
                sum_down += weight * rows[radius + i][x];
                sum_across += weight * (double)in[MARGIN + (int32_t)x + i] / 256.0;
            }
            TEST_ASSERT_EQUAL_UINT16_MESSAGE(sum_down >> 1, down[0][x], at(twin, seed));
            /* Each of radius + 1 products is cut to a whole number. */
            TEST_ASSERT_TRUE_MESSAGE(across[0][x] <= sum_across, at(twin, seed));
            TEST_ASSERT_TRUE_MESSAGE(across[0][x] >= sum_across - radius - 1, at(twin, seed));
        }
    }
}

/* Three rows with a margin; adversarial: equal neighbours, extremes, diagonals at the border of a sector. */
typedef struct rows {
    int16_t above[MARGIN + ROOM], here[MARGIN + ROOM], below[MARGIN + ROOM];
    int16_t dx[ROOM], dy[ROOM];
} rows_t;

static void rows_fill(kernel_random_t *random, uint32_t width, int32_t most, rows_t *rows)
{
    memset(rows, 0, sizeof *rows);
    const uint32_t style = kernel_below(random, 3);
    int16_t *const row[3] = {rows->above, rows->here, rows->below};
    for (int r = 0; r < 3; r++) {
        for (uint32_t x = 0; x < width; x++) {
            const int32_t value = (int32_t)kernel_below(random, (uint32_t)most + 1u);
            row[r][MARGIN + x] = (int16_t)(style == 0 ? value : style == 1 ? value % 3 : (value & 1) * most);
        }
    }
    for (uint32_t x = 0; x < width; x++) {
        const int32_t a = (int32_t)kernel_below(random, 65281) - 32640;
        const int32_t b = (int32_t)kernel_below(random, 65281) - 32640;
        rows->dx[x] = (int16_t)(style == 2 ? (a & 1) * 32640 : a);
        rows->dy[x] = (int16_t)(style == 2 ? (b & 1) * -32640 : style == 1 ? a * 53 / 128 + b % 3 : b);
    }
}

static void differences_and_magnitudes_are_the_definition(void)
{
    static rows_t rows;
    static int16_t pairs[N_LEVELS][2 * ROOM], dx[N_LEVELS][ROOM], dy[N_LEVELS][ROOM], magnitude[N_LEVELS][ROOM];
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        const uint32_t width = kernel_below(&random, WIDTH) + 1u;
        rows_fill(&random, width, 32640, &rows);
        rows.here[MARGIN - 1] = (int16_t)kernel_below(&random, 32641);
        rows.here[MARGIN + width] = (int16_t)kernel_below(&random, 32641);
        for (int l = 0; l < N_LEVELS; l++) {
            level_of(l)->differ(rows.above + MARGIN, rows.here + MARGIN, rows.below + MARGIN, width, pairs[l], dx[l],
                                dy[l], magnitude[l]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(pairs[0], pairs[l], 2u * width * 2u, at(level_of(l), seed));
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(dx[0], dx[l], width * 2u, at(level_of(l), seed));
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(dy[0], dy[l], width * 2u, at(level_of(l), seed));
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(magnitude[0], magnitude[l], width * 2u, at(level_of(l), seed));
        }
        for (uint32_t x = 0; x < width; x++) {
            const int32_t gx = rows.here[MARGIN + x + 1] - rows.here[MARGIN + x - 1];
            const int32_t gy = rows.below[MARGIN + x] - rows.above[MARGIN + x];
            TEST_ASSERT_EQUAL_INT_MESSAGE(gx, dx[0][x], at(twin, seed));
            TEST_ASSERT_EQUAL_INT_MESSAGE(gy, dy[0][x], at(twin, seed));
            TEST_ASSERT_EQUAL_INT_MESSAGE(gx, pairs[0][2 * x], at(twin, seed));
            TEST_ASSERT_EQUAL_INT_MESSAGE(gy, pairs[0][2 * x + 1], at(twin, seed));
            const double exact = hypot(gx, gy);
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(0.51, exact < INT16_MAX ? exact : INT16_MAX, magnitude[0][x],
                                              at(twin, seed));
        }
    }
}

/* The neighbour before a pixel along its gradient in one of four directions; the sector's border in 1/128. */
static void neighbours_of(const rows_t *rows, uint32_t x, int16_t *before, int16_t *after)
{
    const int32_t ax = rows->dx[x] < 0 ? -rows->dx[x] : rows->dx[x];
    const int32_t ay = rows->dy[x] < 0 ? -rows->dy[x] : rows->dy[x];
    const int16_t *above = rows->above + MARGIN + x, *here = rows->here + MARGIN + x, *below = rows->below + MARGIN + x;
    const bool same = (rows->dx[x] ^ rows->dy[x]) >= 0;
    if (ay <= ax / 32 * 53 / 4) {
        *before = here[-1];
        *after = here[1];
    } else if (ax <= ay / 32 * 53 / 4) {
        *before = above[0];
        *after = below[0];
    } else {
        *before = same ? above[-1] : above[1];
        *after = same ? below[1] : below[-1];
    }
}

static void thick_and_thin_are_the_definition(void)
{
    static rows_t rows;
    static uint64_t thick[N_LEVELS][ROOM / 64], thin[N_LEVELS][ROOM / 64];
    uint32_t n_thin = 0;
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        const uint32_t width = kernel_below(&random, WIDTH) + 1u;
        const int16_t threshold = (int16_t)(1 + kernel_below(&random, seed % 2 ? 3u : 32767u));
        rows_fill(&random, width, seed % 3 ? 32767 : 5000, &rows);
        for (int l = 0; l < N_LEVELS; l++) {
            level_of(l)->thin(rows.above + MARGIN, rows.here + MARGIN, rows.below + MARGIN, rows.dx, rows.dy, width,
                              threshold, thick[l], thin[l]);
            const size_t n_bytes = (width + 63u) / 64u * 8u;
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(thick[0], thick[l], n_bytes, at(level_of(l), seed));
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(thin[0], thin[l], n_bytes, at(level_of(l), seed));
        }
        for (uint32_t x = 0; x < (width + 63u) / 64u * 64u; x++) {
            const int16_t m = rows.here[MARGIN + x];
            int16_t before, after;
            neighbours_of(&rows, x, &before, &after);
            const bool is_thick = m >= threshold, is_thin = is_thick && m > before && m >= after;
            TEST_ASSERT_EQUAL_MESSAGE(is_thick, thick[0][x / 64] >> x % 64 & 1u, at(twin, seed));
            TEST_ASSERT_EQUAL_MESSAGE(is_thin, thin[0][x / 64] >> x % 64 & 1u, at(twin, seed));
            n_thin += is_thin;
        }
    }
    TEST_ASSERT_TRUE(n_thin > N_ROUNDS);
}

/* ---- rays ---- */

static void spreading_takes_in_two_directions_to_each_side(void)
{
    enum { N = 28 };
    static uint64_t from[OC_RAYS][N], to[OC_RAYS][N];
    const uint64_t *from_at[OC_RAYS];
    uint64_t *to_at[OC_RAYS];
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        const uint32_t n = 4u * (kernel_below(&random, N / 4) + 1u);
        for (uint32_t d = 0; d < OC_RAYS; d++) {
            from_at[d] = from[d];
            to_at[d] = to[d];
            for (uint32_t i = 0; i < n; i++) from[d][i] = kernel_word(&random, kernel_below(&random, 5));
        }
        for (int l = 0; l < N_LEVELS; l++) {
            memset(to, 0xa5, sizeof to);
            level_of(l)->spread(from_at, to_at, n);
            for (uint32_t d = 0; d < OC_RAYS; d++) {
                for (uint32_t i = 0; i < n; i++) {
                    uint64_t expected = 0;
                    for (uint32_t k = 0; k < 5; k++) expected |= from[(d + 30u + k) % OC_RAYS][i];
                    TEST_ASSERT_EQUAL_HEX64_MESSAGE(expected, to[d][i], at(level_of(l), seed));
                }
                for (uint32_t i = n; i < N; i++) TEST_ASSERT_EQUAL_HEX64(0xa5a5a5a5a5a5a5a5u, to[d][i]);
            }
        }
    }
}

static void rays_are_the_sets_of_their_definition(void)
{
    static kernel_planes_t planes;
    static oc_ray_block_t block[N_LEVELS], expected;
    uint32_t n_weak = 0, n_strong = 0, n_alive = 0;
    for (uint64_t seed = 1; seed <= N_ROUNDS; seed++) {
        kernel_random_t random = {seed * 0x9e3779b97f4a7c15u};
        oc_ray_table_t table;
        uint64_t wanted[4];
        kernel_table_any(&random, &table);
        kernel_planes_fill(&random, &planes);
        for (int i = 0; i < 4; i++) wanted[i] = kernel_word(&random, kernel_below(&random, 6));
        kernel_rays_expected(&table, &planes, wanted, &expected);
        for (int l = 0; l < N_LEVELS; l++) {
            memset(&block[l], 0xa5, sizeof block[l]);
            level_of(l)->rays(&table, planes.left_at, planes.mid_at, planes.right_at, planes.live, wanted, &block[l]);
            TEST_ASSERT_EQUAL_MEMORY_MESSAGE(&expected, &block[l], sizeof expected, at(level_of(l), seed));
        }
        for (int i = 0; i < 4; i++) {
            n_weak += (uint32_t)__builtin_popcountll(expected.weak[i]);
            n_strong += (uint32_t)__builtin_popcountll(expected.strong[i]);
            for (uint32_t r = 0; r < 2u * OC_RAYS; r++) n_alive += expected.ray[r][i] != 0;
        }
    }
    printf("%u rays held somewhere, %u weak places, %u strong\n", (unsigned)n_alive, (unsigned)n_weak,
           (unsigned)n_strong);
    TEST_ASSERT_TRUE(n_strong > 1000 && n_weak > n_strong + 1000);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_twin_is_the_twin_and_auto_is_the_best);
    RUN_TEST(filters_down_and_across_are_the_weighted_sums);
    RUN_TEST(differences_and_magnitudes_are_the_definition);
    RUN_TEST(thick_and_thin_are_the_definition);
    RUN_TEST(spreading_takes_in_two_directions_to_each_side);
    RUN_TEST(rays_are_the_sets_of_their_definition);
    return UNITY_END();
}
