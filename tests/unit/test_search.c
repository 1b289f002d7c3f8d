/* SPDX-License-Identifier: BSD-3-Clause
 * The bit-parallel search against a twin that is written from its definition, pixel by pixel: the same places, in the
 * same order, on pictures and on maps of any bits, of sizes round whole words, bands and tiles. */
#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "kernel_input.h"
#include "vehicle/judoca_search.h"

#define MAX_SIDE 200
#define MAX_PLACES 8192

static oc_gradient_t gradient;
static oc_search_t search;
static void *memory;
static uint8_t px[MAX_SIDE * MAX_SIDE];
static uint64_t seed;
static char text[128];

/* The twin's maps: bit d of a pixel is direction d. */
static uint32_t edge[MAX_SIDE][MAX_SIDE], near[MAX_SIDE][MAX_SIDE];
static uint16_t tile[MAX_SIDE / 8 + 1][MAX_SIDE / 8 + 1];
static uint32_t left[MAX_SIDE][MAX_SIDE], right[MAX_SIDE][MAX_SIDE];
static bool weak[MAX_SIDE][MAX_SIDE], strong[MAX_SIDE][MAX_SIDE];
static oc_place_t place[MAX_PLACES];
static uint32_t n_places;
static int width, height;

void setUp(void)
{
    memory = NULL;
}

void tearDown(void)
{
    free(memory);
    memory = NULL;
}

static void make(oc_simd_t level, int32_t radius_px, float s_j)
{
    free(memory);
    const uint32_t w = (uint32_t)width, h = (uint32_t)height;
    const size_t n_bytes = oc_gradient_size_bytes(w, h) + oc_search_size_bytes(w, h) + OC_ARENA_ALIGN;
    memory = malloc(n_bytes);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, memory, n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_gradient_init(&gradient, &arena, w, h, 1.2f, level));
    TEST_ASSERT_EQUAL(OC_OK, oc_search_init(&search, &arena, w, h, radius_px, s_j));
    TEST_ASSERT_TRUE(search.max_places <= MAX_PLACES);
}

/* ---- input ---- */

static bool is_inside(int x, int y)
{
    return x >= 0 && y >= 0 && x < width && y < height;
}

static const int16_t *pair_at(int x, int y)
{
    return gradient.dxdy + 2 * ((size_t)y * (size_t)width + (size_t)x);
}

static bool is_thin(int x, int y)
{
    return gradient.thin[oc_bitmap_at(gradient.pitch, (uint32_t)x / 64u, (uint32_t)y)] >> (x % 64) & 1u;
}

/* Tiles of grey with some noise, or noise alone. */
static void picture_fill(kernel_random_t *random)
{
    const uint32_t style = kernel_below(random, 4), side = kernel_below(random, 20) + 5u;
    const uint32_t slant = kernel_below(random, 3), salt = kernel_below(random, 1000);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            const uint32_t u = (4u * (uint32_t)x + slant * (uint32_t)y) / (4u * side);
            const uint32_t v = (4u * (uint32_t)y + 1000u - slant * (uint32_t)x) / (4u * side);
            const uint32_t grey = style == 0 ? 0 : (u * 7919u + v * 104729u + salt) * 2654435761u >> 24;
            const uint32_t noise = kernel_below(random, style == 0 ? 256u : style == 1 ? 1u : 20u);
            px[y * width + x] = (uint8_t)(grey + noise < 256u ? grey + noise : 255u);
        }
    }
    const oc_image_t image = {px, (uint32_t)width, (uint32_t)height, (uint32_t)width, 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_gradient_compute(&gradient, &image, 3.0f));
}

/* Derivatives and B+ of no picture: any bits, dense or thin, in few directions or many. */
static void maps_fill(kernel_random_t *random)
{
    const uint32_t share = kernel_below(random, 4) + 1u, style = kernel_below(random, 3);
    for (int i = 0; i < width * height; i++) {
        int16_t *pair = gradient.dxdy + 2 * i;
        const int32_t a = (int32_t)kernel_below(random, 65535) - 32767,
                      b = (int32_t)kernel_below(random, 65535) - 32767;
        pair[0] = (int16_t)(style == 0 ? a : a % 4000);
        pair[1] = (int16_t)(style == 0 ? b : style == 1 ? (b & 1) * a % 4000 : b % 64);
    }
    memset(gradient.thin, 0, oc_bitmap_words((uint32_t)width, (uint32_t)height) * sizeof gradient.thin[0]);
    for (int y = 2; y < height - 2; y++) {
        uint64_t word = 0;
        for (int x = 0; x < width; x++) {
            if (x % 64 == 0) word = kernel_word(random, share);
            if (x < 2 || x >= width - 2) continue; /* the outermost two are never set */
            gradient.thin[oc_bitmap_at(gradient.pitch, (uint32_t)x / 64u, (uint32_t)y)] |= (word >> (x % 64) & 1u)
                                                                                           << (x % 64);
        }
    }
}

/* ---- the twin ---- */

static void twin_insert(void)
{
    memset(edge, 0, sizeof edge);
    memset(tile, 0, sizeof tile);
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            if (!is_thin(x, y)) continue;
            const int16_t *g = pair_at(x, y);
            const uint32_t d = oc_search_direction(g[0], g[1]);
            const bool is_upright = abs(g[0]) > abs(g[1]);
            tile[y / 8][x / 8] |= (uint16_t)(1u << d % 16u);
            for (int i = -1; i <= 1; i++) edge[is_upright ? y : y + i][is_upright ? x + i : x] |= 1u << d;
        }
    }
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            near[y][x] = 0;
            for (uint32_t d = 0; d < OC_RAYS; d++) {
                for (uint32_t k = 30; k <= 34; k++) near[y][x] |= (edge[y][x] >> (d + k) % OC_RAYS & 1u) << d;
            }
        }
    }
}

/* Do the edges of the 3 x 3 tiles round a pixel's differ by more than one 16th of a half turn? */
static bool twin_is_active(int x, int y)
{
    uint32_t met = 0;
    for (int v = y / 8 - 1; v <= y / 8 + 1; v++) {
        for (int u = x / 8 - 1; u <= x / 8 + 1; u++) {
            if (u >= 0 && v >= 0 && u < MAX_SIDE / 8 + 1 && v < MAX_SIDE / 8 + 1) met |= tile[v][u];
        }
    }
    for (uint32_t d = 0; d < 16; d++) {
        const uint32_t two = 1u << d | 1u << (d + 1u) % 16u;
        if ((met & ~two) == 0) return false;
    }
    return true;
}

static void twin_look_at(int x, int y)
{
    const oc_ray_table_t *table = &search.table;
    uint32_t holds = 0, is_whole = 0;
    for (uint32_t side = 0; side < 2; side++) {
        for (uint32_t d = 0; d < OC_RAYS; d++) {
            const uint32_t facing = (d + (side ? 24u : 8u)) % OC_RAYS;
            uint32_t n_set = 0;
            bool on_circle = false;
            for (uint32_t s = 0; s < table->n_samples; s++) {
                const int u = x + table->dx[d][s], v = y + table->dy[d][s];
                const bool is_set = is_inside(u, v) && (near[v][u] >> facing & 1u);
                n_set += is_set;
                if (s == 0) on_circle = is_set;
            }
            if (!on_circle || n_set + table->n_spare < table->n_samples) continue;
            *(side ? &right[y][x] : &left[y][x]) |= 1u << d;
            holds |= 1u << d;
            if (n_set == table->n_samples) is_whole |= 1u << d;
        }
    }
    weak[y][x] = kernel_has_pair(holds);
    strong[y][x] = kernel_has_pair(is_whole);
}

/* Mean derivative across the rays that hold, four pixels out. */
static float twin_contrast(int x, int y, uint32_t at_left, uint32_t at_right)
{
    float sum = 0, n = 0;
    for (int side = 0; side < 2; side++) {
        for (uint32_t d = 0; d < OC_RAYS; d++) {
            if (!((side == 0 ? at_left : at_right) >> d & 1u)) continue;
            const double angle = d * 6.283185307179586 / OC_RAYS;
            const int16_t *g = pair_at(x + (int)lrint(4 * cos(angle)), y + (int)lrint(4 * sin(angle)));
            const float across = (float)cos(angle) * (float)g[1] - (float)sin(angle) * (float)g[0];
            sum += side == 0 ? across : -across;
            n += 1;
        }
    }
    return sum > 0 ? sum / (n * (float)OC_GRADIENT_ONE) : 0.0f;
}

/* The middle of the cluster that begins at a pixel, in its 64 x 64 pixels; clears the cluster. */
static void twin_emit(int x, int y)
{
    const int x_first = x / 64 * 64, y_first = y / 64 * 64;
    const int x0 = x - 2 < x_first ? x_first : x - 2, x1 = x + 2 > x_first + 63 ? x_first + 63 : x + 2;
    const int y1 = y + 3 > y_first + 63 ? y_first + 63 : y + 3;
    bool is_strong = false;
    for (int v = y; v <= y1 && v < height; v++) {
        for (int u = x0; u <= x1 && u < width; u++) is_strong |= strong[v][u];
    }
    int n = 0;
    double sum_x = 0, sum_y = 0;
    for (int v = y; v <= y1 && v < height; v++) {
        for (int u = x0; u <= x1 && u < width; u++) {
            if (!(is_strong ? strong[v][u] : weak[v][u])) continue;
            n++;
            sum_x += u;
            sum_y += v;
        }
    }
    double least = 1e9;
    int best_x = x, best_y = y;
    for (int v = y; v <= y1 && v < height; v++) {
        for (int u = x0; u <= x1 && u < width; u++) {
            if (!(is_strong ? strong[v][u] : weak[v][u])) continue;
            const double ex = n * u - sum_x, ey = n * v - sum_y; /* whole numbers */
            if (ex * ex + ey * ey >= least) continue;
            least = ex * ex + ey * ey;
            best_x = u;
            best_y = v;
        }
    }
    const float contrast = twin_contrast(best_x, best_y, left[best_y][best_x], right[best_y][best_x]);
    const float score = contrast / (contrast + 10.0f) * (is_strong ? 1.0f : 0.7f);
    TEST_ASSERT_TRUE(n_places < MAX_PLACES);
    place[n_places++] = (oc_place_t){(uint16_t)best_x, (uint16_t)best_y, (uint16_t)(score * 65535.0f),
                                     left[best_y][best_x], right[best_y][best_x]};
    for (int v = y; v <= y1 && v < height; v++) {
        for (int u = x0; u <= x1 && u < width; u++) weak[v][u] = strong[v][u] = false;
    }
}

/* Behind 16 better ones of its 64 x 64 pixels a place counts half; better by a 64th of the scale. Those that there was
 * no room for do not count. */
static void twin_crowd(uint32_t first)
{
    uint32_t n_better[MAX_PLACES] = {0};
    const uint32_t end = n_places < search.max_places ? n_places : search.max_places;
    for (uint32_t i = first; i < end; i++) {
        for (uint32_t k = first; k < end; k++) n_better[i] += place[k].prescore / 1024u > place[i].prescore / 1024u;
    }
    for (uint32_t i = first; i < end; i++) {
        place[i].prescore = (uint16_t)(place[i].prescore * 16u / (16u + n_better[i]));
    }
}

static void twin_run(void)
{
    n_places = 0;
    memset(left, 0, sizeof left);
    memset(right, 0, sizeof right);
    memset(weak, 0, sizeof weak);
    memset(strong, 0, sizeof strong);
    twin_insert();
    for (int y = 0; y < height; y++) {
        for (int x = 0; x < width; x++) {
            if (is_thin(x, y) && twin_is_active(x, y)) twin_look_at(x, y);
        }
    }
    for (int x_first = 0; x_first < width; x_first += 64) {
        for (int y_first = 0; y_first < height; y_first += 64) {
            const uint32_t first = n_places;
            for (int y = y_first; y < y_first + 64 && y < height; y++) {
                for (int x = x_first; x < x_first + 64 && x < width; x++) {
                    if (weak[y][x]) twin_emit(x, y);
                }
            }
            twin_crowd(first);
        }
    }
}

/* ---- tests ---- */

static void compare(oc_simd_t level)
{
    (void)snprintf(text, sizeof text, "seed %llu, %d x %d, level %d, radius %d, %u of %u may miss",
                   (unsigned long long)seed, width, height, (int)level, (int)search.table.dx[0][0],
                   (unsigned)search.table.n_spare, (unsigned)search.table.n_samples);
    oc_search_run(&search, &gradient);
    TEST_ASSERT_EQUAL_UINT32_MESSAGE(n_places, search.n_places, text);
    const uint32_t n = n_places < search.max_places ? n_places : search.max_places;
    for (uint32_t i = 0; i < n; i++) {
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(place[i].x, search.place[i].x, text);
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(place[i].y, search.place[i].y, text);
        TEST_ASSERT_EQUAL_HEX32_MESSAGE(place[i].left, search.place[i].left, text);
        TEST_ASSERT_EQUAL_HEX32_MESSAGE(place[i].right, search.place[i].right, text);
        TEST_ASSERT_EQUAL_UINT16_MESSAGE(place[i].prescore, search.place[i].prescore, text);
    }
}

/* One input of each kind at one size, all levels; the workspace is used twice. */
static uint32_t check_size(int w, int h, bool is_picture)
{
    uint32_t n = 0;
    width = w;
    height = h;
    for (int l = OC_SIMD_SCALAR; l <= OC_SIMD_AVX2; l++) {
        kernel_random_t random = {++seed * 0x9e3779b97f4a7c15u};
        make((oc_simd_t)l, (int32_t)kernel_below(&random, 7) + 4, kernel_uniform(&random, 0.3f, 1.0f));
        for (int round = 0; round < 2; round++) {
            if (is_picture) {
                picture_fill(&random);
            } else {
                maps_fill(&random);
            }
            twin_run();
            compare((oc_simd_t)l);
            n += n_places;
        }
    }
    return n;
}

static const int sides[] = {32, 33, 35, 36, 60, 61, 63, 64, 65, 66, 67, 68, 127, 128, 129, 130, 191, 192, 193};
#define N_SIDES (int)(sizeof sides / sizeof sides[0])

static void pictures_of_every_size_give_the_twin_s_places(void)
{
    uint32_t n = 0;
    seed = 1000;
    for (int w = 0; w < N_SIDES; w++) {
        for (int k = 0; k < 4; k++) n += check_size(sides[w], sides[(5 * w + 3 * k) % N_SIDES], true);
    }
    printf("%u places\n", (unsigned)n);
    TEST_ASSERT_TRUE(n > 10000);
}

static void maps_of_any_bits_give_the_twin_s_places(void)
{
    uint32_t n = 0;
    seed = 2000;
    for (int w = 0; w < N_SIDES; w++) {
        for (int k = 0; k < 4; k++) n += check_size(sides[w], sides[(7 * w + 4 * k) % N_SIDES], false);
    }
    printf("%u places\n", (unsigned)n);
    TEST_ASSERT_TRUE(n > 10000);
}

/* Corners at every place of a word, a band and the border. */
static void one_corner_is_seen_wherever_it_is(void)
{
    uint32_t n_seen = 0, n = 0;
    seed = 3000;
    width = 140;
    height = 136;
    make(OC_SIMD_AUTO, 6, 0.6f);
    for (int y = 1; y < height; y += 5) {
        for (int x = 1; x < width; x += 3) {
            for (int i = 0; i < width * height; i++) {
                px[i] = (uint8_t)(i % width >= x && i / width >= y ? 200 : 60);
            }
            const oc_image_t image = {px, (uint32_t)width, (uint32_t)height, (uint32_t)width, 1};
            TEST_ASSERT_EQUAL(OC_OK, oc_gradient_compute(&gradient, &image, 6.0f));
            seed++;
            twin_run();
            compare(OC_SIMD_AUTO);
            if (x < 12 || y < 12 || x >= width - 12 || y >= height - 12) continue;
            n++;
            for (uint32_t i = 0; i < search.n_places; i++) {
                if (abs(search.place[i].x - x) > 3 || abs(search.place[i].y - y) > 3) continue;
                n_seen++;
                break;
            }
        }
    }
    TEST_ASSERT_EQUAL_UINT32(n, n_seen);
}

/* Borders of the 32 sectors lie halfway between their middles, to a tenth of a degree. */
static void directions_are_32nds_of_a_turn(void)
{
    for (int i = 0; i < 3600; i++) {
        const double turn = (i + 0.5) / 3600.0 * 32.0, rest = turn + 0.5 - floor(turn + 0.5);
        if (rest < 0.02 || rest > 0.98) continue;
        const double angle = turn * 6.283185307179586 / 32.0;
        const uint32_t expected = (uint32_t)floor(turn + 0.5) % OC_RAYS;
        TEST_ASSERT_EQUAL_UINT32(expected,
                                 oc_search_direction((int)lrint(30000 * cos(angle)), (int)lrint(30000 * sin(angle))));
    }
    TEST_ASSERT_EQUAL_UINT32(0, oc_search_direction(0, 0));
    TEST_ASSERT_EQUAL_UINT32(8, oc_search_direction(0, 1));
    TEST_ASSERT_EQUAL_UINT32(16, oc_search_direction(-32640, 0));
    TEST_ASSERT_EQUAL_UINT32(24, oc_search_direction(0, -32640));
    TEST_ASSERT_EQUAL_UINT32(28, oc_search_direction(1, -1));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(directions_are_32nds_of_a_turn);
    RUN_TEST(pictures_of_every_size_give_the_twin_s_places);
    RUN_TEST(maps_of_any_bits_give_the_twin_s_places);
    RUN_TEST(one_corner_is_seen_wherever_it_is);
    return UNITY_END();
}
