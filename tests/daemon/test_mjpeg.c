/* SPDX-License-Identifier: BSD-3-Clause
 * Motion JPEG: what libjpeg decodes with its own memory is decoded here without any; what is damaged is refused. */
#include "unity.h"

#include <setjmp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <jpeglib.h>

#include "allocation_guard.h"
#include "mjpeg.h"

#define WIDTH 160u
#define HEIGHT 120u
#define MAX_BYTES (1u << 18)

#define LARGEST_PX (4096u * 32u)

static uint8_t px[LARGEST_PX * 3u], expected[WIDTH * HEIGHT * 3u];
static uint8_t frame[MAX_BYTES], damaged[MAX_BYTES];
static size_t n_frame;
static oc_mjpeg_t *mjpeg;
static char error[256];

typedef struct picture {
    int quality, n_components, restart_rows, sampling;
    bool is_progressive, is_optimised;
} picture_t;

static const picture_t plain = {80, 3, 0, 2, false, false};

void setUp(void)
{
    uint32_t state = 1;
    for (uint32_t y = 0; y < HEIGHT; y++) {
        for (uint32_t x = 0; x < WIDTH; x++) {
            for (uint32_t c = 0; c < 3; c++) {
                state = state * 1664525u + 1013904223u;
                px[3u * (y * WIDTH + x) + c] = (uint8_t)(60u + x / 2u + (y / 20u % 2u) * 60u + c * 20u + (state >> 29));
            }
        }
    }
    mjpeg = oc_mjpeg_create(WIDTH, HEIGHT);
    TEST_ASSERT_NOT_NULL(mjpeg);
}

void tearDown(void)
{
    oc_mjpeg_destroy(mjpeg);
}

/* Compress px into frame[]. */
static void encode(const picture_t *p, uint32_t width_px, uint32_t height_px)
{
    struct jpeg_compress_struct cinfo;
    struct jpeg_error_mgr faults;
    unsigned char *out = NULL;
    unsigned long n_out = 0;
    cinfo.err = jpeg_std_error(&faults);
    jpeg_create_compress(&cinfo);
    jpeg_mem_dest(&cinfo, &out, &n_out);
    cinfo.image_width = width_px;
    cinfo.image_height = height_px;
    cinfo.input_components = p->n_components;
    cinfo.in_color_space = p->n_components == 3 ? JCS_RGB : JCS_GRAYSCALE;
    jpeg_set_defaults(&cinfo);
    jpeg_set_quality(&cinfo, p->quality, TRUE);
    cinfo.restart_in_rows = p->restart_rows;
    cinfo.optimize_coding = p->is_optimised;
    if (p->n_components == 3) {
        cinfo.comp_info[0].h_samp_factor = p->sampling;
        cinfo.comp_info[0].v_samp_factor = p->sampling > 2 ? 1 : p->sampling;
        if (p->sampling > 2) cinfo.comp_info[0].h_samp_factor = 2; /* 4:2:2, as cameras send */
    }
    if (p->is_progressive) jpeg_simple_progression(&cinfo);
    jpeg_start_compress(&cinfo, TRUE);
    while (cinfo.next_scanline < height_px) {
        JSAMPROW row = px + (size_t)cinfo.next_scanline * width_px * (size_t)p->n_components;
        (void)jpeg_write_scanlines(&cinfo, &row, 1);
    }
    jpeg_finish_compress(&cinfo);
    jpeg_destroy_compress(&cinfo);
    TEST_ASSERT_TRUE(n_out <= sizeof frame);
    memcpy(frame, out, n_out);
    n_frame = n_out;
    free(out);
}

/* libjpeg by itself. */
static void decode_plainly(void)
{
    struct jpeg_decompress_struct cinfo;
    struct jpeg_error_mgr faults;
    cinfo.err = jpeg_std_error(&faults);
    jpeg_create_decompress(&cinfo);
    jpeg_mem_src(&cinfo, frame, (unsigned long)n_frame);
    (void)jpeg_read_header(&cinfo, TRUE);
    cinfo.out_color_space = JCS_RGB;
    (void)jpeg_start_decompress(&cinfo);
    while (cinfo.output_scanline < HEIGHT) {
        JSAMPROW row = expected + (size_t)cinfo.output_scanline * WIDTH * 3u;
        (void)jpeg_read_scanlines(&cinfo, &row, 1);
    }
    (void)jpeg_finish_decompress(&cinfo);
    jpeg_destroy_decompress(&cinfo);
}

static bool decode(const uint8_t *bytes, size_t n_bytes, oc_image_t *image)
{
    error[0] = '\0';
    guard_is_armed = true; /* a call of the heap aborts */
    const bool is_ok = oc_mjpeg_decode(mjpeg, bytes, n_bytes, image, error, sizeof error);
    guard_is_armed = false;
    return is_ok;
}

static void check_frame(const char *what)
{
    oc_image_t image;
    decode_plainly();
    TEST_ASSERT_TRUE_MESSAGE(decode(frame, n_frame, &image), error);
    TEST_ASSERT_EQUAL_MESSAGE(WIDTH, image.width_px, what);
    TEST_ASSERT_EQUAL_MESSAGE(3, image.channels, what);
    TEST_ASSERT_EQUAL_MEMORY_MESSAGE(expected, image.px, sizeof expected, what);
}

static void refused(const uint8_t *bytes, size_t n_bytes, const char *what)
{
    oc_image_t image = {NULL, 7, 0, 0, 0};
    TEST_ASSERT_FALSE_MESSAGE(decode(bytes, n_bytes, &image), what);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, what), error);
    TEST_ASSERT_EQUAL(7, image.width_px);
}

static void pixels_are_those_of_libjpeg_and_the_heap_is_left_alone(void)
{
    const picture_t pictures[] = {plain,
                                  {95, 3, 0, 1, false, false},
                                  {50, 3, 0, 3, false, false},
                                  {30, 3, 1, 2, false, false},
                                  {80, 3, 0, 2, false, true},
                                  {80, 1, 0, 1, false, false},
                                  {100, 3, 2, 3, false, true}};
    for (int round = 0; round < 3; round++) {
        for (size_t i = 0; i < sizeof pictures / sizeof *pictures; i++) {
            encode(&pictures[i], WIDTH, HEIGHT);
            check_frame("one of many");
        }
    }
}

/* Take the marker segments of one kind out. */
static void strip(uint8_t marker)
{
    size_t at = 2, to = 2;
    while (frame[at + 1u] != 0xda) {
        const size_t n = 2u + ((size_t)frame[at + 2u] << 8 | frame[at + 3u]);
        if (frame[at + 1u] != marker) {
            memmove(frame + to, frame + at, n);
            to += n;
        }
        at += n;
    }
    memmove(frame + to, frame + at, n_frame - at);
    n_frame -= at - to;
}

static void frames_without_huffman_tables_get_the_standard_ones(void)
{
    encode(&(picture_t){80, 3, 0, 2, false, true}, WIDTH, HEIGHT);
    check_frame("tables of its own"); /* must not be used for the next */
    encode(&plain, WIDTH, HEIGHT);
    const size_t with_tables = n_frame;
    strip(0xc4);
    TEST_ASSERT_TRUE(n_frame < with_tables);
    check_frame("without tables");
}

static void bytes_after_the_end_are_no_fault(void)
{
    encode(&plain, WIDTH, HEIGHT);
    oc_image_t image;
    memset(frame + n_frame, 0, 4096);
    TEST_ASSERT_TRUE_MESSAGE(decode(frame, n_frame + 4096u, &image), error);
    memset(frame + n_frame, 0xd8, 4096);
    TEST_ASSERT_TRUE_MESSAGE(decode(frame, n_frame + 4096u, &image), error);
}

static void a_cut_frame_is_refused_wherever_it_is_cut(void)
{
    encode(&plain, WIDTH, HEIGHT);
    oc_image_t image;
    for (size_t n = 0; n < n_frame; n++) {
        uint8_t *exact = malloc(n + 1u); /* so that a sanitizer sees what is read beyond */
        memcpy(exact, frame, n);
        TEST_ASSERT_FALSE(decode(exact, n, &image));
        free(exact);
    }
    check_frame("after all that");
}

static void what_no_camera_sends_is_refused_by_name(void)
{
    encode(&(picture_t){80, 3, 0, 2, true, false}, WIDTH, HEIGHT);
    refused(frame, n_frame, "baseline");
    encode(&plain, WIDTH / 2u, HEIGHT);
    refused(frame, n_frame, "size");
    encode(&plain, WIDTH, HEIGHT / 2u);
    refused(frame, n_frame, "size");
    encode(&plain, WIDTH, HEIGHT);
    frame[0] = 0;
    refused(frame, n_frame, "");
    memset(frame, 0, sizeof frame);
    refused(frame, 1000, "");
    encode(&plain, WIDTH, HEIGHT);
    check_frame("after all that");
}

static void its_memory_is_enough_for_every_width(void)
{
    static const uint32_t widths[] = {32, 33, 640, 1919, 1920, 4096};
    static const int samplings[] = {1, 2, 3};
    for (size_t w = 0; w < sizeof widths / sizeof *widths; w++) {
        oc_mjpeg_destroy(mjpeg);
        mjpeg = oc_mjpeg_create(widths[w], 32);
        for (size_t s = 0; s < sizeof samplings / sizeof *samplings; s++) {
            encode(&(picture_t){90, 3, 0, samplings[s], false, false}, widths[w], 32);
            oc_image_t image;
            TEST_ASSERT_TRUE_MESSAGE(decode(frame, n_frame, &image), error);
            TEST_ASSERT_EQUAL(widths[w], image.width_px);
        }
    }
}

static void damage_is_mostly_seen_and_never_does_harm(void)
{
    const unsigned seed = 20261125;
    printf("seed %u\n", seed);
    srand(seed);
    encode(&plain, WIDTH, HEIGHT);
    int n_refused = 0, n_lost = 0;
    enum { N = 3000 };
    for (int i = 0; i < N; i++) {
        memcpy(damaged, frame, n_frame);
        const int kind = rand() % 3;
        const size_t at = 2u + (size_t)rand() % (n_frame - 2u), n = 1u + (size_t)rand() % 64u;
        for (size_t k = at; k < at + n && k < n_frame; k++) {
            const unsigned flipped = damaged[k] ^ 1u << rand() % 8;
            damaged[k] = (uint8_t)(kind == 0 ? (unsigned)rand() : kind == 1 ? 0 : flipped);
        }
        oc_image_t image;
        const bool is_ok = decode(damaged, n_frame, &image);
        n_refused += !is_ok;
        if (kind != 1 || n < 8 || at < 700) continue;
        n_lost += is_ok; /* a hole in the picture's data that nobody noticed */
    }
    printf("%d of %d refused, %d holes not seen\n", n_refused, N, n_lost);
    TEST_ASSERT_TRUE(n_refused > N / 2);
    check_frame("after all that");
}

int main(void)
{
    guard_install();
    UNITY_BEGIN();
    RUN_TEST(pixels_are_those_of_libjpeg_and_the_heap_is_left_alone);
    RUN_TEST(frames_without_huffman_tables_get_the_standard_ones);
    RUN_TEST(bytes_after_the_end_are_no_fault);
    RUN_TEST(a_cut_frame_is_refused_wherever_it_is_cut);
    RUN_TEST(what_no_camera_sends_is_refused_by_name);
    RUN_TEST(its_memory_is_enough_for_every_width);
    RUN_TEST(damage_is_mostly_seen_and_never_does_harm);
    return UNITY_END();
}
