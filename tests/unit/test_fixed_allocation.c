/* SPDX-License-Identifier: BSD-3-Clause
 * The vehicle's memory: one block of the size that docs/design.md (1) says, and a heap that is never asked again,
 * over ten thousand frames. */
#include "unity.h"

#include <stdio.h>
#include <string.h>
#include <sys/wait.h>

#include "allocation_guard.h"
#include "ground_scene.h"
#include "thesis_tables.h"
#include "vehicle/vehicle_internal.h"

#if defined(__SANITIZE_ADDRESS__) || !defined(__x86_64__) /* instrumented or emulated: ten times slower */
#define N_FRAMES 1000
#else
#define N_FRAMES 10000
#endif
#define N_SMALL 40
#define N_LARGE 4
#define LARGE_EVERY 500
#define SMALL_WIDTH 80u
#define SMALL_HEIGHT 60u
#define LARGE_WIDTH 640u
#define LARGE_HEIGHT 480u
#define GUARD_BYTES 4096u
#define MAX_BLOCK_BYTES (16u << 20)

static oc_camera_t cameras[N_SMALL + N_LARGE];
static uint8_t small_px[N_SMALL][SMALL_WIDTH * SMALL_HEIGHT];
static uint8_t large_px[N_LARGE][LARGE_WIDTH * LARGE_HEIGHT];
static _Alignas(64) uint8_t space[MAX_BLOCK_BYTES + 2u * GUARD_BYTES];

void setUp(void) {}

void tearDown(void)
{
    guard_is_armed = false;
}

/* 640x480 with sixteen grey views: the vehicle of the budget. */
static oc_vehicle_config_t budget_config(void)
{
    oc_vehicle_config_t config = oc_vehicle_defaults();
    config.max_width_px = LARGE_WIDTH;
    config.max_height_px = LARGE_HEIGHT;
    config.stored_views = 16;
    config.keep_colour = false;
    return config;
}

/* ---- the block ---- */

static size_t c64(size_t bytes)
{
    return (bytes + 63u) / 64u * 64u;
}

static size_t ceil_of(size_t a, size_t b)
{
    return (a + b - 1u) / b;
}

/* docs/design.md (2), term by term. */
static size_t detector_formula_bytes(size_t w, size_t h, const oc_judoca_params_t *params)
{
    const size_t columns = ceil_of(w, 64), rows = 4u * ceil_of(h, 4) + 32u, map = 8u * (columns + 2u) * rows;
    const size_t cell = params->spread_cell_px;
    const size_t gradient = c64(4u * w * h) + 2u * c64(map) + c64(26u * (64u * columns + 32u)) + c64(16u * columns);
    const size_t search = 2u * c64(768u * rows) + c64(2u * (ceil_of(h, 8) + 2u) * (8u * columns + 16u)) +
                          c64(16u * sizeof(oc_ray_block_t)) + c64((w * h / 16u + 64u) * sizeof(oc_place_t));
    const size_t choice = c64(map) + c64(8192u * sizeof(oc_junction_t)) + c64(8192u * sizeof(oc_judoca_rank_t)) +
                          c64(2u * 8192u) + c64(2u * ceil_of(w, 8) * ceil_of(h, 8)) +
                          c64(2u * ceil_of(w, cell) * ceil_of(h, cell));
    return 64u + gradient + search + choice;
}

static void the_detector_is_as_large_as_the_formula_says(void)
{
    const size_t sizes[][2] = {{32, 32}, {33, 65}, {64, 64}, {127, 130}, {640, 480}, {1920, 1080}, {4096, 4096}};
    for (size_t i = 0; i < sizeof sizes / sizeof sizes[0]; i++) {
        oc_judoca_params_t params = oc_judoca_defaults();
        params.spread_cell_px += (uint32_t)i;
        TEST_ASSERT_EQUAL_size_t(detector_formula_bytes(sizes[i][0], sizes[i][1], &params),
                                 oc_judoca_size_bytes((uint32_t)sizes[i][0], (uint32_t)sizes[i][1], &params));
    }
}

/* docs/design.md (2a), term by term. */
static size_t silhouettes_formula_bytes(size_t w, size_t h)
{
    return c64(3u * w * h) + c64(4u * w * h) + 5u * c64(w * h) + c64(2u * w * h) + 2u * c64(40u * w) +
           2u * c64(h * ceil_of(w, 8)) + c64(24u * OC_SILHOUETTE_SAMPLES);
}

/* docs/design.md (1), term by term. */
static size_t formula_bytes(const oc_vehicle_config_t *c, bool is_printed)
{
    const size_t n_px = (size_t)c->max_width_px * c->max_height_px, v = c->stored_views;
    const size_t j = c->judoca.max_junctions, s = c->max_sent_junctions;
    const size_t state = c64(sizeof(oc_vehicle_t)) + c64(v * sizeof(stored_view_t));
    const size_t scratch = c64(n_px) + c64(j * sizeof(oc_junction_t)) + c64(s * sizeof(oc_junction_t));
    const size_t judoca = c64(oc_judoca_size_bytes(c->max_width_px, c->max_height_px, &c->judoca));
    const size_t pixels = c64(n_px) + (c->keep_colour ? c64(3u * n_px) : 0);
    const size_t lists = c64(j * sizeof(oc_junction_t)) + c64(j * sizeof(oc_ground_votes_t)) + 2u * c64(2u * s) +
                         c64(j) +
                         c64(c->with_silhouettes ? ceil_of(c->max_width_px, 8) * ceil_of(c->max_height_px, 8) : 0);
    const size_t silhouettes = c->with_silhouettes ? silhouettes_formula_bytes(c->max_width_px, c->max_height_px) : 0;
    if (is_printed) {
        printf("state %zu + scratch of a frame %zu + detector %zu + silhouettes %zu + %zu views of %zu pixels and %zu "
               "lists\n",
               state, scratch, judoca, silhouettes, v, pixels, lists);
    }
    return state + scratch + judoca + silhouettes + v * (pixels + lists);
}

static void the_block_is_as_large_as_the_formula_says(void)
{
    oc_vehicle_config_t config = budget_config();
    TEST_ASSERT_EQUAL_size_t(formula_bytes(&config, false), oc_vehicle_size(&config));
    config.keep_colour = true;
    config.max_width_px = 333;
    config.max_height_px = 241;
    config.stored_views = 5;
    config.max_sent_junctions = 77;
    config.judoca.max_junctions = 123;
    TEST_ASSERT_EQUAL_size_t(formula_bytes(&config, false), oc_vehicle_size(&config));
    config.with_silhouettes = false;
    TEST_ASSERT_EQUAL_size_t(formula_bytes(&config, false), oc_vehicle_size(&config));
}

static void sixteen_grey_views_at_640x480_fit_in_16_mb(void)
{
    const oc_vehicle_config_t config = budget_config();
    const size_t n_bytes = oc_vehicle_size(&config);
    printf("oc_vehicle_size, 640x480, 16 grey views: %zu bytes = ", n_bytes);
    TEST_ASSERT_EQUAL_size_t(n_bytes, formula_bytes(&config, true));
    TEST_ASSERT_TRUE(n_bytes <= MAX_BLOCK_BYTES);
}

/* ---- the guard ---- */

/* How a child ends that does this with the guard armed: its signal, or 0. */
static int signal_of_child(void (*act)(void))
{
    (void)fflush(stdout);
    const pid_t child = fork();
    TEST_ASSERT_TRUE(child >= 0);
    if (child == 0) {
        guard_is_armed = true;
        act();
        _exit(0);
    }
    int status = 0;
    TEST_ASSERT_EQUAL(child, waitpid(child, &status, 0));
    return WIFSIGNALED(status) ? WTERMSIG(status) : 0;
}

static void *volatile piece;

static void act_malloc(void)
{
    piece = malloc(100);
}

static void act_free(void)
{
    free(piece);
}

static void act_inside_the_library(void)
{
    char line[8];
    FILE *file = fopen("/dev/null", "r"); /* whose FILE and buffer come from the heap */
    if (file && fgets(line, sizeof line, file)) _exit(1);
}

static void act_nothing(void) {}

static void the_guard_sees_every_use_of_the_heap(void)
{
    piece = malloc(10);
    TEST_ASSERT_EQUAL(6, signal_of_child(act_malloc)); /* SIGABRT */
    TEST_ASSERT_EQUAL(6, signal_of_child(act_free));
    TEST_ASSERT_EQUAL(6, signal_of_child(act_inside_the_library));
    TEST_ASSERT_EQUAL(0, signal_of_child(act_nothing));
    free(piece);
}

/* ---- ten thousand frames ---- */

/* Along a straight line over the ground, past two boxes. */
static void cameras_make(void)
{
    const oc_camera_t start = oc_test_camera(&table_7_3, 2);
    double centre[3];
    oc_pose_centre(&start.pose, centre);
    for (int i = 0; i < N_SMALL + N_LARGE; i++) {
        const bool is_small = i < N_SMALL;
        const double along_m = 0.02 * (is_small ? i : 10 * (i - N_SMALL));
        const double at[3] = {centre[0] + along_m, centre[1] - 0.5 * along_m, centre[2]};
        cameras[i] = start;
        cameras[i].k =
            oc_intrinsics_from_format(table_7_3.focal_mm, OC_TEST_FORMAT_WIDTH_MM, OC_TEST_FORMAT_HEIGHT_MM,
                                      is_small ? SMALL_WIDTH : LARGE_WIDTH, is_small ? SMALL_HEIGHT : LARGE_HEIGHT);
        for (int r = 0; r < 3; r++) {
            const double *row = &start.pose.R[3 * r];
            cameras[i].pose.t[r] = -(row[0] * at[0] + row[1] * at[1] + row[2] * at[2]);
        }
    }
}

static void frames_render(void)
{
    oc_scene_t scene = {.cell_m = 0.15, .n_boxes = 2};
    for (int b = 0; b < 2; b++) {
        for (int k = 0; k < 3; k++) {
            scene.box_min_m[b][k] = table_7_4_min_mm[b][k] / 1000.0;
            scene.box_max_m[b][k] = table_7_4_max_mm[b][k] / 1000.0;
        }
        scene.box_min_m[b][2] = 0.0;
    }
    cameras_make();
    for (int i = 0; i < N_SMALL; i++) (void)oc_scene_render(&scene, &cameras[i], small_px[i]);
    for (int i = 0; i < N_LARGE; i++) (void)oc_scene_render(&scene, &cameras[N_SMALL + i], large_px[i]);
}

static oc_frame_t frame_of(int i)
{
    const bool is_large = i % LARGE_EVERY == LARGE_EVERY - 1;
    const int k = is_large ? i / LARGE_EVERY % N_LARGE : i % N_SMALL;
    const oc_image_t small = {small_px[k], SMALL_WIDTH, SMALL_HEIGHT, SMALL_WIDTH, 1};
    oc_frame_t frame = {.image = small, .camera = cameras[k], .utime_us = 1000000 + 40000 * (int64_t)i};
    if (is_large) {
        frame.image = (oc_image_t){large_px[k], LARGE_WIDTH, LARGE_HEIGHT, LARGE_WIDTH, 1};
        frame.camera = cameras[N_SMALL + k];
    }
    for (int m = 0; m < 3; m++) {
        frame.margin.v[m] = 0.01;
        frame.margin.v[3 + m] = OC_TEST_RAD(1.0);
    }
    frame.is_forced = i % 4 != 0; /* the rest is the policy's to decide */
    return frame;
}

/* What the base asks for now and then. */
static void ask(oc_vehicle_t *vehicle, uint16_t view)
{
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes;
    uint16_t taken;
    const oc_packet_head_t resend = {.type = OC_PACKET_RESEND_REQUEST, .vehicle = 1};
    const oc_resend_request_t parts = {.view = view, .parts = 1};
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_resend(&resend, &parts, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_handle(vehicle, buf, n_bytes));
    const oc_packet_head_t patch = {.type = OC_PACKET_PATCH_REQUEST, .vehicle = 1};
    const oc_patch_request_t blocks = {.view = view, .quality = 8, .n_blocks = 3, .blocks = {1, 2, 9}};
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_patch_request(&patch, &blocks, buf, sizeof buf, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_handle(vehicle, buf, n_bytes));
}

static uint32_t drain(oc_vehicle_t *vehicle)
{
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    uint32_t n_packets = 0;
    for (size_t n_bytes = 1;; n_packets++) {
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_next(vehicle, buf, sizeof buf, &n_bytes));
        if (n_bytes == 0) return n_packets;
    }
}

static void ten_thousand_frames_never_ask_the_heap(void)
{
    oc_vehicle_config_t config = budget_config();
    config.ground.window_px = 11; /* the same code on less: about 16 s in all, not 60 */
    config.ground.max_references = 1;
    const size_t n_bytes = oc_vehicle_size(&config);
    uint32_t n_keyframes = 0, n_packets = 0, n_junctions = 0, n_ground = 0;
    oc_vehicle_t *vehicle;
    memset(space, 0xa5, sizeof space);
    frames_render();

    guard_is_armed = true;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_init(&config, space + GUARD_BYTES, n_bytes, &vehicle));
    for (int i = 0; i < N_FRAMES; i++) {
        const oc_frame_t frame = frame_of(i);
        oc_push_report_t report;
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
        if (report.is_keyframe) {
            n_keyframes++;
            n_junctions += report.n_found;
            n_ground += report.n_ground;
            if (i % 16 == 1) ask(vehicle, report.view);
        }
        n_packets += drain(vehicle);
    }
    guard_is_armed = false;

    printf("%u frames, %u keyframes, %u junctions of which %u are ground, %u packets, no allocation\n",
           (unsigned)N_FRAMES, (unsigned)n_keyframes, (unsigned)n_junctions, (unsigned)n_ground, (unsigned)n_packets);
    TEST_ASSERT_TRUE(n_keyframes >= N_FRAMES / 2 && n_packets >= n_keyframes);
    TEST_ASSERT_TRUE(n_junctions > n_keyframes && n_ground > n_junctions / 20);
    for (size_t i = 0; i < GUARD_BYTES; i++) {
        TEST_ASSERT_EQUAL_HEX8(0xa5, space[i]);
        TEST_ASSERT_EQUAL_HEX8(0xa5, space[GUARD_BYTES + n_bytes + i]);
    }
}

int main(void)
{
    guard_install();
    UNITY_BEGIN();
    RUN_TEST(the_detector_is_as_large_as_the_formula_says);
    RUN_TEST(the_block_is_as_large_as_the_formula_says);
    RUN_TEST(sixteen_grey_views_at_640x480_fit_in_16_mb);
    RUN_TEST(the_guard_sees_every_use_of_the_heap);
    RUN_TEST(ten_thousand_frames_never_ask_the_heap);
    return UNITY_END();
}
