/* SPDX-License-Identifier: BSD-3-Clause
 * Whole keyframes as pieces: the cut, the resend bits, the store's end. */
#include "unity.h"

#include <string.h>

#include "core/camera.h"
#include "image_sender.h"

#define WIDTH 320u
#define HEIGHT 240u
#define CAP 400u

static uint8_t px[3u * WIDTH * HEIGHT];
static const oc_image_t image = {px, WIDTH, HEIGHT, 3u * WIDTH, 3};
static oc_image_sender_t *sender;
static uint8_t buf[OC_MAX_DATAGRAM_BYTES + 16];

static oc_view_head_t head_of(uint16_t view)
{
    oc_view_head_t head = {.view = view, .utime_us = 1000 + view};
    head.camera.k = (oc_intrinsics_t){
        .width_px = WIDTH, .height_px = HEIGHT, .fx_px = 300, .fy_px = 300, .cx_px = 160, .cy_px = 120};
    for (int i = 0; i < 3; i++) head.camera.pose.R[4 * i] = 1;
    return head;
}

static void push(uint16_t view)
{
    const oc_view_head_t head = head_of(view);
    TEST_ASSERT_TRUE(oc_image_sender_push(sender, &head, &image));
}

void setUp(void)
{
    for (uint32_t i = 0; i < sizeof px; i++) px[i] = (uint8_t)(i / 3 % WIDTH / 7 * 31 + i / 3 / WIDTH / 5 * 17);
    sender = oc_image_sender_create(2, OC_CODEC_JPEG, 20, CAP);
    TEST_ASSERT_NOT_NULL(sender);
}

void tearDown(void)
{
    oc_image_sender_destroy(sender);
}

static bool next(oc_image_piece_t *piece)
{
    const oc_packet_head_t packet = {.vehicle = 1};
    size_t n_bytes = 0;
    memset(buf, 0x5a, sizeof buf);
    if (!oc_image_sender_next(sender, &packet, buf, &n_bytes)) return false;
    TEST_ASSERT_TRUE(n_bytes <= CAP);
    TEST_ASSERT_EACH_EQUAL_UINT8(0x5a, buf + n_bytes, sizeof buf - n_bytes);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_image(buf, n_bytes, piece));
    return true;
}

/* Takes all pieces; they follow on each other, are all of one size but the last, and only the last says so. */
static uint32_t drain(uint16_t view)
{
    oc_image_piece_t piece;
    uint32_t n = 0, at = 0, size = 0;
    bool is_last = false;
    while (oc_image_sender_has_next(sender)) {
        TEST_ASSERT_TRUE(next(&piece));
        TEST_ASSERT_FALSE(is_last);
        TEST_ASSERT_EQUAL(view, piece.head.view);
        TEST_ASSERT_EQUAL(n, piece.head.part);
        TEST_ASSERT_EQUAL(at, piece.offset_bytes);
        if (n == 0) size = piece.n_bytes;
        is_last = piece.head.is_last;
        if (is_last) {
            TEST_ASSERT_TRUE(piece.n_bytes <= size);
        } else {
            TEST_ASSERT_EQUAL(size, piece.n_bytes);
        }
        at += piece.n_bytes;
        n++;
    }
    TEST_ASSERT_TRUE(is_last);
    TEST_ASSERT_FALSE(next(&piece));
    TEST_ASSERT_EQUAL(piece.total_bytes, at);
    return n;
}

static void pieces_cover_the_keyframe(void)
{
    push(5);
    const uint32_t n = drain(5);
    TEST_ASSERT_TRUE(n > 3);
}

static void a_resend_gives_the_same_cut_of_what_was_asked_for(void)
{
    push(5);
    uint8_t first[3][CAP];
    oc_image_piece_t piece;
    for (uint32_t i = 0; i < 3; i++) {
        TEST_ASSERT_TRUE(next(&piece));
        memcpy(first[i], piece.bytes, piece.n_bytes);
    }
    while (next(&piece)) {
    }
    const oc_resend_request_t request = {.view = 5, .parts = 1u << 2 | 1u << 0 | 1u << 30};
    TEST_ASSERT_TRUE(oc_image_sender_resend(sender, &request));
    TEST_ASSERT_TRUE(next(&piece));
    TEST_ASSERT_EQUAL(0, piece.head.part);
    TEST_ASSERT_EQUAL_MEMORY(first[0], piece.bytes, piece.n_bytes);
    TEST_ASSERT_TRUE(next(&piece));
    TEST_ASSERT_EQUAL(2, piece.head.part);
    TEST_ASSERT_EQUAL_MEMORY(first[2], piece.bytes, piece.n_bytes);
    TEST_ASSERT_FALSE(next(&piece)); /* piece 30 never was */
}

static void all_ones_sends_everything_again(void)
{
    push(5);
    const uint32_t n = drain(5);
    const oc_resend_request_t request = {.view = 5, .parts = UINT32_MAX};
    TEST_ASSERT_TRUE(oc_image_sender_resend(sender, &request));
    TEST_ASSERT_EQUAL(n, drain(5));
}

static void the_oldest_leaves_and_the_newest_goes_first(void)
{
    push(1);
    push(2);
    push(3);
    const oc_resend_request_t gone = {.view = 1, .parts = 1}, kept = {.view = 2, .parts = 1};
    TEST_ASSERT_FALSE(oc_image_sender_resend(sender, &gone));
    TEST_ASSERT_TRUE(oc_image_sender_resend(sender, &kept));
    oc_image_piece_t piece;
    TEST_ASSERT_TRUE(next(&piece));
    TEST_ASSERT_EQUAL(3, piece.head.view);
}

static void a_keyframe_of_more_pieces_than_can_be_numbered_is_refused(void)
{
    oc_image_sender_destroy(sender);
    sender = oc_image_sender_create(2, OC_CODEC_JPEG, 100, 200);
    TEST_ASSERT_NOT_NULL(sender);
    for (uint32_t i = 0; i < sizeof px; i++) px[i] = (uint8_t)(i * 2654435761u >> 24);
    const oc_view_head_t head = head_of(1);
    TEST_ASSERT_FALSE(oc_image_sender_push(sender, &head, &image));
    oc_image_piece_t piece;
    TEST_ASSERT_FALSE(next(&piece));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(pieces_cover_the_keyframe);
    RUN_TEST(a_resend_gives_the_same_cut_of_what_was_asked_for);
    RUN_TEST(all_ones_sends_everything_again);
    RUN_TEST(the_oldest_leaves_and_the_newest_goes_first);
    RUN_TEST(a_keyframe_of_more_pieces_than_can_be_numbered_is_refused);
    return UNITY_END();
}
