/* SPDX-License-Identifier: BSD-3-Clause
 * Fuzz target: pictures, sizes, strides and parameters of the input's choice into the detector and into a vehicle.
 *
 *   J1  a picture or parameters out of range are refused and nothing is written, anything else is taken
 *   J2  no more junctions than the cap and max_junctions
 *   J3  every junction is inside the picture, its numbers finite, its branches in order, the best score first
 *   J4  the same picture gives the same bits again
 *   J5  the picture and what lies between its rows stay as they were
 *   J6  what a vehicle sends is within a datagram and can be decoded
 *
 * Linked with arena_guarded.c, the sanitizer also sees a step from one map of the detector into the next. */
#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fuzz_target.h"
#include "packet_any.h"
#include "vehicle/vehicle.h"

#define REQUIRE(id, condition)                                                                                         \
    do {                                                                                                               \
        if (!(condition)) broken(id, #condition);                                                                      \
    } while (0)

#define MAX_SIDE 112u
#define CAP 300u

static void broken(const char *id, const char *condition)
{
    fprintf(stderr, "invariant %s is broken: %s\n", id, condition);
    abort();
}

/* ---- the input, byte by byte; zeros once it is used up ---- */

static const uint8_t *input;
static size_t n_left;

static uint8_t take(void)
{
    if (n_left == 0) return 0;
    n_left--;
    return *input++;
}

/* Mostly within low..high, sometimes just outside or not a number. */
static float take_float(float low, float high)
{
    const uint8_t byte = take();
    if (byte == 255) return NAN;
    if (byte == 254) return high + 1e-3f * (high - low) + 1e-6f;
    if (byte == 253) return low - 1e-3f * (high - low) - 1e-6f;
    return low + (high - low) * (float)byte / 252.0f;
}

static uint32_t take_count(uint32_t low, uint32_t high)
{
    const uint8_t byte = take();
    if (byte == 255) return UINT32_MAX;
    if (byte == 254) return high + 1u;
    if (byte == 253) return low - 1u;
    return low + (high - low) * byte / 252u;
}

/* Half of all inputs keep the defaults: they then say more about pictures. */
static oc_judoca_params_t take_params(void)
{
    oc_judoca_params_t p = oc_judoca_defaults();
    const uint8_t which = take();
    if (which & 8u) p.method = OC_JUDOCA_THESIS;
    if (which & 16u) p.t_b = 0.0f;
    if (!(which & 1u)) return p;

    p.sigma_px = take_float(OC_GRADIENT_MIN_SIGMA_PX, OC_GRADIENT_MAX_SIGMA_PX);
    p.t_b = which & 16u ? 0.0f : take_float(0.5f, 100.0f);
    p.t_b_noise_k = take_float(1.0f, 20.0f);
    p.s_j = take_float(0.3f, 1.0f);
    p.lambda_px = (int32_t)take_count(6, OC_JUDOCA_MAX_LAMBDA_PX);
    p.lambda_min_px = (int32_t)take_count(4, which & 2u ? 6 : OC_JUDOCA_MAX_LAMBDA_PX);
    p.min_angle_rad = take_float(0.1f, 1.0f);
    p.min_bend_rad = take_float(0.05f, 1.0f);
    p.max_rms_px = take_float(0.1f, 2.0f);
    p.max_apex_sigma_px = take_float(0.1f, 3.0f);
    p.min_distance_px = take_float(1.0f, 20.0f);
    p.max_junctions = take_count(1, which & 4u ? 20 : OC_MAX_JUNCTIONS);
    p.max_candidates = take_count(16, which & 4u ? 64 : OC_JUDOCA_MAX_CANDIDATES);
    p.spread_cell_px = take_count(8, 200);
    return p;
}

/* ---- pictures ---- */

/* Pixels in a block of their own, which ends with the last pixel. */
typedef struct picture {
    oc_image_t image;
    uint8_t *px;
    size_t n_bytes;
} picture_t;

typedef enum fill { FILL_RAW, FILL_TILES, FILL_NOISE, FILL_EDGES, N_FILLS } fill_t;

/* Each edge changes the grey on one side of a line. */
static void fill_edges(picture_t *p)
{
    for (unsigned n = 1u + take() % 8u; n > 0; n--) {
        const int a = (int8_t)take(), b = (int8_t)take(), x0 = take() % MAX_SIDE, y0 = take() % MAX_SIDE;
        const uint8_t change = take();
        for (size_t i = 0; i < p->n_bytes; i++) {
            const int x = (int)(i % p->image.stride_bytes), y = (int)(i / p->image.stride_bytes);
            if (a * (x - x0) + b * (y - y0) > 0) p->px[i] = (uint8_t)(p->px[i] + change);
        }
    }
}

static void picture_fill(picture_t *p)
{
    const fill_t fill = (fill_t)(take() % N_FILLS);
    const uint8_t tile = (uint8_t)(3u + take() % 20u);
    uint32_t noise = 1u + take();
    const uint8_t *bytes = input;
    const size_t n = n_left;
    for (size_t i = 0; i < p->n_bytes; i++) {
        noise = noise * 1664525u + 1013904223u;
        const size_t x = i % p->image.stride_bytes, y = i / p->image.stride_bytes;
        const size_t at = fill == FILL_TILES ? x / tile + 16u * (y / tile) : i;
        p->px[i] = fill == FILL_NOISE ? (uint8_t)(noise >> 24) : fill == FILL_EDGES || n == 0 ? 90 : bytes[at % n];
    }
    if (fill == FILL_EDGES) fill_edges(p);
}

/* Any size from a little below the least one; a stride that is too small now and then. */
static bool picture_take(picture_t *p)
{
    const uint8_t shape = take();
    p->image.channels = shape % 4u == 3u ? 3 : 1;
    p->image.width_px = OC_MIN_IMAGE_SIDE - 2u + take() % (MAX_SIDE - OC_MIN_IMAGE_SIDE);
    p->image.height_px = OC_MIN_IMAGE_SIDE - 2u + take() % (MAX_SIDE - OC_MIN_IMAGE_SIDE);
    const uint32_t row_bytes = p->image.width_px * p->image.channels;
    p->image.stride_bytes = shape >= 250 ? row_bytes - 1u : row_bytes + shape / 4u % 8u;
    const uint32_t last = p->image.stride_bytes < row_bytes ? p->image.stride_bytes : row_bytes;
    p->n_bytes = (size_t)(p->image.height_px - 1u) * p->image.stride_bytes + last;
    p->px = malloc(p->n_bytes);
    p->image.px = p->px;
    if (!p->px) return false;
    picture_fill(p);
    return true;
}

static uint64_t sum_of(const void *bytes, size_t n)
{
    uint64_t sum = 14695981039346656037u;
    for (size_t i = 0; i < n; i++) sum = (sum ^ ((const uint8_t *)bytes)[i]) * 1099511628211u;
    return sum;
}

/* ---- the detector ---- */

/* T or Y is for the parameters to say. */
static bool kind_fits(const oc_junction_t *j)
{
    if (j->n_branches == 3) return j->kind == OC_KIND_T || j->kind == OC_KIND_Y;
    return j->kind == (j->n_branches == 2 ? OC_KIND_L : j->n_branches == 4 ? OC_KIND_X : OC_KIND_OTHER);
}

static void check_junction(const oc_junction_t *j, const oc_image_t *image)
{
    REQUIRE("J3", j->x_px >= -0.5f && j->x_px <= (float)image->width_px - 0.5f);
    REQUIRE("J3", j->y_px >= -0.5f && j->y_px <= (float)image->height_px - 0.5f);
    REQUIRE("J3", j->n_branches >= 2 && j->n_branches <= OC_MAX_BRANCHES && isfinite(j->score));
    REQUIRE("J3", kind_fits(j) && j->label == OC_LABEL_UNKNOWN);
    for (unsigned b = 0; b < j->n_branches; b++) {
        const oc_branch_t *branch = &j->branch[b];
        REQUIRE("J3", branch->angle_rad >= 0.0f && branch->angle_rad < 6.2831860f);
        REQUIRE("J3", b == 0 || branch->angle_rad >= j->branch[b - 1u].angle_rad);
        REQUIRE("J3", branch->length_px >= 0.0f && isfinite(branch->length_px));
        REQUIRE("J3", branch->strength >= 0.0f && branch->strength <= 1.0f);
    }
}

static void detect(oc_judoca_ws_t *ws, const picture_t *p, const oc_judoca_params_t *params)
{
    const uint32_t cap = take() % CAP;
    oc_junction_t *found = malloc((cap + 1u) * sizeof *found);
    if (!found) return;
    const uint64_t before = sum_of(p->px, p->n_bytes);
    uint32_t n = 12345, again = 12345;
    const oc_status_t status = oc_judoca_detect(ws, &p->image, found, cap, &n);
    const bool is_right = p->image.channels == 1 && oc_image_is_valid(&p->image);
    REQUIRE("J1", status == (is_right ? OC_OK : OC_E_ARG) && (is_right || n == 12345));
    if (is_right) {
        REQUIRE("J2", n <= cap && n <= params->max_junctions);
        for (uint32_t i = 0; i < n; i++) {
            REQUIRE("J3", i == 0 || found[i].score <= found[i - 1u].score);
            check_junction(&found[i], &p->image);
        }
        const uint64_t first = sum_of(found, n * sizeof *found);
        REQUIRE("J4", oc_judoca_detect(ws, &p->image, found, cap, &again) == OC_OK && again == n);
        REQUIRE("J4", sum_of(found, n * sizeof *found) == first);
    }
    REQUIRE("J5", sum_of(p->px, p->n_bytes) == before);
    free(found);
}

static void try_detector(void)
{
    static oc_judoca_ws_t ws;
    const oc_judoca_params_t params = take_params();
    picture_t p;
    if (!picture_take(&p)) return;
    const size_t n_bytes = oc_judoca_size_bytes(p.image.width_px, p.image.height_px, &params);
    const bool is_right = oc_judoca_params_are_valid(&params) && p.image.width_px >= OC_MIN_IMAGE_SIDE &&
                          p.image.height_px >= OC_MIN_IMAGE_SIDE;
    REQUIRE("J1", (n_bytes > 0) == is_right);
    uint8_t *block = malloc(n_bytes + 1u);
    oc_arena_t arena;
    if (block && n_bytes > 0) {
        REQUIRE("J1", oc_arena_init(&arena, block, n_bytes) == OC_OK);
        REQUIRE("J1", oc_judoca_init(&ws, &arena, p.image.width_px, p.image.height_px, &params) == OC_OK);
        detect(&ws, &p, &params);
    }
    free(block);
    free(p.px);
}

/* ---- the vehicle ---- */

/* A camera a few metres over the ground, further along with each frame. */
static oc_frame_t frame_of(const oc_image_t *image, int i)
{
    const double f = 60.0 + take();
    oc_frame_t frame = {
        .image = *image,
        .camera = {.k = {.width_px = image->width_px,
                         .height_px = image->height_px,
                         .fx_px = f,
                         .fy_px = f,
                         .cx_px = 0.5 * image->width_px,
                         .cy_px = 0.5 * image->height_px},
                   .pose = {.R = {1, 0, 0, 0, -1, 0, 0, 0, -1}, .t = {-0.01 * take() * i, 0.0, 1.0 + 0.05 * take()}}},
        .utime_us = 1000000 * (1 + i),
        .is_forced = true,
    };
    for (int m = 0; m < 6; m++) frame.margin.v[m] = 1e-3 * take();
    return frame;
}

static void drain(oc_vehicle_t *vehicle)
{
    static any_body_t body;
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    for (size_t n_bytes = 1; n_bytes > 0;) {
        REQUIRE("J6", oc_vehicle_next(vehicle, buf, sizeof buf, &n_bytes) == OC_OK && n_bytes <= sizeof buf);
        if (n_bytes == 0) return;
        REQUIRE("J6", oc_packet_decode_head(buf, n_bytes, &head) == OC_OK);
        REQUIRE("J6", any_decode_as(head.type, buf, n_bytes, &body) == OC_OK);
    }
}

static void push_frames(oc_vehicle_t *vehicle)
{
    const int n_frames = 1 + take() % 2;
    picture_t p;
    if (!picture_take(&p)) return;
    for (int i = 0; i < n_frames; i++) {
        const oc_frame_t frame = frame_of(&p.image, i);
        const uint64_t before = sum_of(p.px, p.n_bytes);
        oc_push_report_t report;
        const oc_status_t status = oc_vehicle_push(vehicle, &frame, &report);
        REQUIRE("J1", oc_image_is_valid(&p.image) || status != OC_OK);
        REQUIRE("J5", sum_of(p.px, p.n_bytes) == before);
        drain(vehicle);
        /* The next frame: the same ground moved on by some pixels, so that there is something to match. */
        const size_t step = 1u + take() % 5u;
        memmove(p.px, p.px + step, p.n_bytes - step);
    }
    free(p.px);
}

static void try_vehicle(void)
{
    oc_vehicle_config_t config = oc_vehicle_defaults();
    config.judoca = take_params();
    config.max_width_px = config.max_height_px = MAX_SIDE - 20u;
    config.stored_views = 2u + take() % 3u;
    config.keep_colour = take() % 2u;
    config.ground.window_px = 7; /* the time of a push grows with its square, and with that of the junctions */
    if (config.judoca.max_junctions > 60u && config.judoca.max_junctions <= OC_MAX_JUNCTIONS) {
        config.judoca.max_junctions = 60;
    }
    const size_t n_bytes = oc_vehicle_size(&config);
    REQUIRE("J1", (n_bytes > 0) == oc_judoca_params_are_valid(&config.judoca));
    if (n_bytes == 0) return;

    void *block = aligned_alloc(64, (n_bytes + 63u) / 64u * 64u);
    oc_vehicle_t *vehicle;
    if (!block) return;
    REQUIRE("J1", oc_vehicle_init(&config, block, n_bytes, &vehicle) == OC_OK);
    push_frames(vehicle);
    const oc_status_t status = oc_vehicle_handle(vehicle, input, n_left < OC_MAX_DATAGRAM_BYTES ? n_left : 0);
    (void)status;
    push_frames(vehicle);
    free(block);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input = data;
    n_left = size;
    if (take() % 8u == 7u)
        try_vehicle();
    else
        try_detector();
    return 0;
}
