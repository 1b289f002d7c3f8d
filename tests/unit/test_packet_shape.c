/* SPDX-License-Identifier: BSD-3-Clause
 * Silhouettes and textures on the wire: what goes in comes out, at what cost, and what does not fit is refused. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "packet_examples.h"
#include "unity.h"

void setUp(void) {}
void tearDown(void) {}

static const oc_packet_head_t head = {.vehicle = 2, .sequence = 7};
static uint8_t labels[OC_MAX_SILHOUETTE_CELLS], back[OC_MAX_SILHOUETTE_CELLS];
static uint8_t buf[OC_MAX_DATAGRAM_BYTES];

/* Blobs of random size and place, some cut off by the border. */
static void random_labels(uint32_t *state, unsigned n_cols, unsigned n_rows)
{
    memset(labels, OC_LABEL_GROUND, (size_t)n_cols * n_rows);
    const unsigned n_blobs = 1u + example_random(state) % 4u;
    for (unsigned b = 0; b < n_blobs; b++) {
        const double x = example_uniform(state) * n_cols, y = example_uniform(state) * n_rows;
        const double rx = 1.0 + example_uniform(state) * n_cols / 3.0, ry = 1.0 + example_uniform(state) * n_rows / 3.0;
        const uint8_t label = (uint8_t)(example_random(state) % 3u);
        for (unsigned r = 0; r < n_rows; r++) {
            for (unsigned c = 0; c < n_cols; c++) {
                const double u = (c - x) / rx, v = (r - y) / ry;
                if (u * u + v * v < 1.0) labels[r * n_cols + c] = label;
            }
        }
    }
}

static void random_silhouettes_come_back_as_they_were(void)
{
    uint32_t state = 20261125;
    printf("seed %u\n", state);
    for (int i = 0; i < 300; i++) {
        oc_silhouette_t in = {.view = (uint16_t)example_random(&state), .key = (uint16_t)example_random(&state)};
        in.box = (uint8_t)(example_random(&state) % OC_MAX_SILHOUETTE_BOXES);
        in.step_px = (uint8_t)(1u << example_random(&state) % 5u);
        in.n_cols = (uint16_t)(1u + example_random(&state) % 120u);
        in.n_rows = (uint16_t)(1u + example_random(&state) % 120u);
        in.col = (uint16_t)(example_random(&state) % 3900u);
        in.row = (uint16_t)(example_random(&state) % 3900u);
        random_labels(&state, in.n_cols, in.n_rows);
        size_t n_bytes;
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_silhouette(&head, &in, labels, buf, sizeof buf, &n_bytes));
        oc_silhouette_t out;
        memset(&out, 0, sizeof out);
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_silhouette(buf, n_bytes, &out, back, sizeof back));
        TEST_ASSERT_TRUE(out.view == in.view && out.key == in.key && out.box == in.box && out.step_px == in.step_px);
        TEST_ASSERT_TRUE(out.col == in.col && out.row == in.row && out.n_cols == in.n_cols && out.n_rows == in.n_rows);
        TEST_ASSERT_EQUAL_MEMORY(labels, back, (size_t)in.n_cols * in.n_rows);
    }
}

static void noise_that_does_not_fit_is_refused_and_nothing_is_half_read(void)
{
    uint32_t state = 5;
    const oc_silhouette_t in = {.step_px = 1, .n_cols = 300, .n_rows = 300};
    for (unsigned i = 0; i < 300u * 300u; i++) labels[i] = (uint8_t)(example_random(&state) % 3u);
    size_t n_bytes = 77;
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_packet_encode_silhouette(&head, &in, labels, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_EQUAL(77, n_bytes);

    example_packet_t packet;
    TEST_ASSERT_EQUAL(OC_OK, example_silhouette(&head, &packet));
    memset(back, 9, sizeof back);
    oc_silhouette_t out = {.view = 99};
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_packet_decode_silhouette(packet.bytes, packet.n_bytes, &out, back, 90 * 70 - 1));
    TEST_ASSERT_EQUAL(99, out.view);
    TEST_ASSERT_EACH_EQUAL_UINT8(9, back, 90 * 70);
}

/* A round body of 200 x 150 px in cells of 2 px: about 150 bytes are allowed for one. */
static void an_outline_costs_about_a_hundred_bytes(void)
{
    const oc_silhouette_t in = {.step_px = 2, .n_cols = 100, .n_rows = 75};
    example_labels(100, 75, labels);
    size_t n_bytes;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_silhouette(&head, &in, labels, buf, sizeof buf, &n_bytes));
    printf("silhouette of 100 x 75 cells: %zu bytes\n", n_bytes);
    TEST_ASSERT_TRUE(n_bytes <= 130);
}

static void values_out_of_range_are_refused(void)
{
    size_t n_bytes;
    oc_silhouette_t s = {.step_px = 2, .n_cols = 4, .n_rows = 4};
    memset(labels, 0, 16);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_silhouette(&head, &s, labels, buf, sizeof buf, &n_bytes));
    s.step_px = 3;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_silhouette(&head, &s, labels, buf, sizeof buf, &n_bytes));
    s.step_px = 2, s.n_cols = 0;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_silhouette(&head, &s, labels, buf, sizeof buf, &n_bytes));
    s.n_cols = 4, s.col = 4093;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_silhouette(&head, &s, labels, buf, sizeof buf, &n_bytes));
    s.col = 0, s.box = OC_MAX_SILHOUETTE_BOXES;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_silhouette(&head, &s, labels, buf, sizeof buf, &n_bytes));

    oc_silhouette_request_t r = {.step_px = 2, .n_boxes = 1, .n_views = 1};
    r.boxes[0] = (oc_ground_box_t){.length_m = 1, .width_m = 1, .height_m = 1};
    uint16_t key;
    const oc_silhouette_request_t good = r;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &key));
    const double bad[] = {NAN, INFINITY, -1.0, 0.0, 200.0};
    for (size_t i = 0; i < sizeof bad / sizeof bad[0]; i++) {
        r = good, r.boxes[0].width_m = bad[i];
        TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &key));
    }
    r = good, r.views[0].move_m[1] = 3.4;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &key));
    r = good, r.views[0].turn_rad[2] = NAN;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &key));
    r = good, r.n_views = 2;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &key));
    r = good, r.n_boxes = OC_MAX_SILHOUETTE_BOXES + 1;
    TEST_ASSERT_EQUAL(OC_E_LIMIT, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &key));
}

static void a_request_comes_back_within_its_quanta(void)
{
    example_packet_t packet;
    oc_silhouette_request_t out;
    TEST_ASSERT_EQUAL(OC_OK, example_silhouette_request(&head, &packet));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_silhouette_request(packet.bytes, packet.n_bytes, &out));
    TEST_ASSERT_TRUE(out.n_boxes == 3 && out.n_views == 14 && out.step_px == 2 && out.grow_percent == 15);
    TEST_ASSERT_DOUBLE_WITHIN(5.1e-5, -2.0 + 2.5, out.boxes[2].x_m);
    TEST_ASSERT_DOUBLE_WITHIN(3.2e-3, 0.6, out.boxes[2].yaw_rad);
    TEST_ASSERT_TRUE(out.boxes[0].is_subject && !out.boxes[1].is_subject);
    for (int i = 0; i < 14; i++) {
        TEST_ASSERT_EQUAL(3 * i, out.views[i].view);
        TEST_ASSERT_EQUAL(i % 3 != 0, out.views[i].is_wanted);
        for (int k = 0; k < 3; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(5.1e-5, 0.01 * (k - 1) * i, out.views[i].move_m[k]);
            TEST_ASSERT_DOUBLE_WITHIN(1.1e-5, 0.002 * (1 - k) * i, out.views[i].turn_rad[k]);
        }
    }
}

/* The key tells questions apart, and is the same whoever is asked. */
static void the_key_is_of_the_question_alone(void)
{
    oc_silhouette_request_t r = {.step_px = 2, .n_boxes = 1, .n_views = 2};
    r.boxes[0] = (oc_ground_box_t){.length_m = 1, .width_m = 1, .height_m = 1, .is_subject = true};
    r.views[1].view = 5;
    uint16_t key, other;
    size_t n_bytes;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &key));
    r.views[0].is_wanted = true;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &other));
    TEST_ASSERT_EQUAL(key, other);
    r.boxes[0].x_m = 0.0001;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_silhouette_request(&head, &r, buf, sizeof buf, &n_bytes, &other));
    TEST_ASSERT_TRUE(key != other);
}

static void as_many_texture_tiles_as_fit_are_named(void)
{
    oc_texture_request_t r = {.view = 1, .step_px = 1, .tile_px = 16, .quality = 1, .budget_bytes = 1};
    r.n_tiles = OC_MAX_TEXTURE_TILES;
    uint32_t state = 3;
    for (uint32_t i = 0, tile = 0; i < OC_MAX_TEXTURE_TILES; i++) {
        r.tiles[i] = (uint16_t)tile;
        tile += 1u + example_random(&state) % 255u;
    }
    uint16_t taken = 0;
    size_t n_bytes;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_texture_request(&head, &r, buf, OC_MIN_DATAGRAM_BYTES, &n_bytes, &taken));
    TEST_ASSERT_TRUE(taken > 100 && taken < OC_MAX_TEXTURE_TILES && n_bytes <= OC_MIN_DATAGRAM_BYTES);
    oc_texture_request_t out;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_texture_request(buf, n_bytes, &out));
    TEST_ASSERT_EQUAL(taken, out.n_tiles);
    TEST_ASSERT_EQUAL_MEMORY(r.tiles, out.tiles, taken * sizeof r.tiles[0]);
    r.tiles[7] = r.tiles[6];
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_texture_request(&head, &r, buf, sizeof buf, &n_bytes, &taken));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(random_silhouettes_come_back_as_they_were);
    RUN_TEST(noise_that_does_not_fit_is_refused_and_nothing_is_half_read);
    RUN_TEST(an_outline_costs_about_a_hundred_bytes);
    RUN_TEST(values_out_of_range_are_refused);
    RUN_TEST(a_request_comes_back_within_its_quanta);
    RUN_TEST(the_key_is_of_the_question_alone);
    RUN_TEST(as_many_texture_tiles_as_fit_are_named);
    return UNITY_END();
}
