/* SPDX-License-Identifier: BSD-3-Clause
 * junction_digest [--list] [--frames N] [--method NAME] [--levels] [FILE.pgm...]
 *
 * Prints one line per picture and method: how many junctions the detector finds and a digest over the bits of every
 * number in them. Two machines that print the same found the same, bit for bit. Two pictures made here come first,
 * unless files are given with --frames.
 *
 *   --list         the junctions too, each number as its bits
 *   --method NAME  default, fixed (lambda 10 throughout) or thesis; all three without it
 *   --frames N     detect in every file N times, perhaps 0, and print nothing but their sum: for counting instructions
 *   --levels       hold every instruction set against the twin instead, in many settings; exit 1 when any differs */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "vehicle/judoca.h"

#define N_METHODS 4

static const char *const method_name[N_METHODS] = {"default", "fixed", "thesis", "corners"};

static uint8_t *px;
static uint32_t width_px, height_px;
static oc_junction_t found[OC_MAX_JUNCTIONS];
static int is_listing, is_comparing, only_method = -1, n_frames = -1;

static oc_judoca_params_t params_of(int method)
{
    oc_judoca_params_t params = oc_judoca_defaults();
    if (method == 1 || method == 2) params.lambda_min_px = params.lambda_px = 10;
    if (method == 2) params.method = OC_JUDOCA_THESIS;
    if (method == 3) params.max_corners = 300;
    return params;
}

/* ---- pictures ---- */

static void picture_resize(uint32_t width, uint32_t height)
{
    free(px);
    width_px = width;
    height_px = height;
    px = malloc((size_t)width * height);
    if (!px) abort();
}

static uint32_t hash_of(uint32_t a, uint32_t b)
{
    uint32_t h = a * 0x8da6b343u ^ b * 0xd8163841u;
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    return h ^ h >> 13;
}

/* Slanted tiles of random grey, or nothing but noise; integers only, so alike everywhere. */
static void picture_make(int is_noise)
{
    picture_resize(333, 251);
    for (uint32_t y = 0; y < height_px; y++) {
        for (uint32_t x = 0; x < width_px; x++) {
            const uint32_t tile = hash_of((4 * x + y) / 90u, (4 * y + 1000u - x) / 110u);
            px[y * width_px + x] = (uint8_t)(is_noise ? hash_of(x, y) : 30u + tile % 190u + hash_of(y, x) % 5u);
        }
    }
}

/* A binary PGM of 8 bits, as image_to_pgm writes it. */
static int picture_read(const char *path)
{
    unsigned width, height;
    FILE *file = fopen(path, "rb");
    if (!file) return 0;
    int is_ok = fscanf(file, "P5 %5u %5u 255", &width, &height) == 2 && fgetc(file) == '\n';
    is_ok = is_ok && width >= 1 && height >= 1 && width <= OC_MAX_IMAGE_SIDE && height <= OC_MAX_IMAGE_SIDE;
    if (is_ok) {
        picture_resize(width, height);
        is_ok = fread(px, width, height, file) == height;
    }
    return fclose(file) == 0 && is_ok;
}

/* ---- digests ---- */

static uint32_t bits_of(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

/* FNV-1a over one 32-bit word. */
static uint64_t add(uint64_t digest, uint32_t word)
{
    for (int i = 0; i < 4; i++) {
        digest = (digest ^ (word >> 8 * i & 0xffu)) * 1099511628211u;
    }
    if (is_listing) printf(" %08" PRIx32, word);
    return digest;
}

static uint64_t add_junction(uint64_t digest, const oc_junction_t *j)
{
    digest = add(digest, bits_of(j->x_px));
    digest = add(digest, bits_of(j->y_px));
    digest = add(digest, bits_of(j->score));
    digest = add(digest, (uint32_t)j->n_branches | (uint32_t)j->kind << 8 | (uint32_t)j->label << 16);
    for (unsigned b = 0; b < j->n_branches; b++) {
        digest = add(digest, bits_of(j->branch[b].angle_rad));
        digest = add(digest, bits_of(j->branch[b].length_px));
        digest = add(digest, bits_of(j->branch[b].strength));
    }
    if (is_listing) printf("\n");
    return digest;
}

static uint32_t detect(const oc_judoca_params_t *chosen, uint32_t times)
{
    static oc_judoca_ws_t ws;
    const oc_judoca_params_t params = *chosen;
    const oc_image_t image = {px, width_px, height_px, width_px, 1};
    const size_t n_bytes = oc_judoca_size_bytes(width_px, height_px, &params);
    void *block = malloc(n_bytes + 1u);
    oc_arena_t arena;
    uint32_t n = 0;
    if (!block || oc_arena_init(&arena, block, n_bytes) != OC_OK ||
        oc_judoca_init(&ws, &arena, width_px, height_px, &params) != OC_OK) {
        abort();
    }
    for (uint32_t i = 0; i < times; i++) {
        if (oc_judoca_detect(&ws, &image, found, OC_MAX_JUNCTIONS, &n) != OC_OK) abort();
    }
    free(block);
    return n;
}

static void digest_picture(const char *name)
{
    for (int method = 0; method < N_METHODS; method++) {
        if (only_method >= 0 && method != only_method) continue;
        const oc_judoca_params_t params = params_of(method);
        const uint32_t n = detect(&params, 1);
        uint64_t digest = 14695981039346656037u;
        for (uint32_t i = 0; i < n; i++) digest = add_junction(digest, &found[i]);
        printf("%s %s %" PRIu32 " %016" PRIx64 "\n", name, method_name[method], n, digest);
    }
}

/* ---- levels ---- */

#define N_SETTINGS 6

static const char *const setting_name[N_SETTINGS] = {"default",   "lambda 10",        "lambda 15",
                                                     "lambda 20", "t_b of the noise", "noise added"};

static oc_judoca_params_t params_of_setting(int setting)
{
    static const int32_t lambda_px[N_SETTINGS] = {0, 10, 15, 20, 0, 0};
    oc_judoca_params_t params = oc_judoca_defaults();
    if (lambda_px[setting] > 0) params.lambda_min_px = params.lambda_px = lambda_px[setting];
    if (setting == 4) params.t_b = 0.0f;
    return params;
}

/* Up to 20 grey levels either way. */
static void picture_add_noise(void)
{
    for (uint32_t i = 0; i < width_px * height_px; i++) {
        const int32_t level = px[i] + (int32_t)(hash_of(i, 7u) % 41u) - 20;
        px[i] = (uint8_t)(level < 0 ? 0 : level > 255 ? 255 : level);
    }
}

/* Does every level find what the twin finds, bit for bit? The picture is noisy afterwards. */
static int compare_levels(const char *name)
{
    static oc_junction_t of_twin[OC_MAX_JUNCTIONS];
    uint32_t n_all = 0;
    int is_same = 1;
    for (int setting = 0; setting < N_SETTINGS; setting++) {
        if (setting == N_SETTINGS - 1) picture_add_noise();
        oc_judoca_params_t params = params_of_setting(setting);
        params.simd = OC_SIMD_SCALAR;
        const uint32_t n_twin = detect(&params, 1);
        memcpy(of_twin, found, sizeof of_twin);
        n_all += n_twin;
        for (int level = OC_SIMD_BASE; level <= OC_SIMD_AVX2; level++) {
            params.simd = (oc_simd_t)level;
            const uint32_t n = detect(&params, 1);
            if (n == n_twin && memcmp(of_twin, found, n * sizeof found[0]) == 0) continue;
            printf("%s, %s: level %d differs from the twin\n", name, setting_name[setting], level);
            is_same = 0;
        }
    }
    printf("%s: %" PRIu32 " junctions in %d settings\n", name, n_all, N_SETTINGS);
    return is_same;
}

/* ---- the program ---- */

/* The file's own name, without its folder. */
static const char *short_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static int usage(void)
{
    fprintf(
        stderr,
        "usage: junction_digest [--list] [--frames N] [--method default|fixed|thesis|corners] [--levels] [FILE.pgm...]\n");
    return 2;
}

static int find_method(const char *name)
{
    for (int method = 0; method < N_METHODS; method++) {
        if (strcmp(name, method_name[method]) == 0) return method;
    }
    return -1;
}

int main(int argc, char **argv)
{
    int arg = 1, is_same = 1;
    uint32_t sum = 0;
    for (; arg < argc && argv[arg][0] == '-'; arg++) {
        if (strcmp(argv[arg], "--list") == 0) {
            is_listing = 1;
        } else if (strcmp(argv[arg], "--levels") == 0) {
            is_comparing = 1;
        } else if (strcmp(argv[arg], "--frames") == 0 && arg + 1 < argc) {
            n_frames = (int)strtol(argv[++arg], NULL, 10);
            if (n_frames < 0) return usage();
        } else if (strcmp(argv[arg], "--method") == 0 && arg + 1 < argc) {
            only_method = find_method(argv[++arg]);
            if (only_method < 0) return usage();
        } else {
            return usage();
        }
    }
    for (int is_noise = 0; is_noise < 2 && n_frames < 0; is_noise++) {
        picture_make(is_noise);
        if (is_comparing) {
            is_same &= compare_levels(is_noise ? "noise" : "tiles");
        } else {
            digest_picture(is_noise ? "noise" : "tiles");
        }
    }
    for (; arg < argc; arg++) {
        if (!picture_read(argv[arg])) {
            fprintf(stderr, "junction_digest: %s is no PGM of 8 bits\n", argv[arg]);
            return 1;
        }
        if (is_comparing) {
            is_same &= compare_levels(short_name(argv[arg]));
        } else if (n_frames < 0) {
            digest_picture(short_name(argv[arg]));
        } else {
            const oc_judoca_params_t params = params_of(only_method > 0 ? only_method : 0);
            sum += detect(&params, (uint32_t)n_frames);
        }
    }
    if (n_frames >= 0) printf("%" PRIu32 "\n", sum);
    free(px);
    return is_same ? 0 : 1;
}
