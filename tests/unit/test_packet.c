/* SPDX-License-Identifier: BSD-3-Clause
 * Tests of core/packet.h: what is sent comes back quantised, once and for all, and what does not fit waits. */
#include <stdio.h>

#include "packet_examples.h"
#include "unity.h"

#define SEED 0x9ac4e7u

static const oc_packet_head_t sender = {.vehicle = 3, .sequence = 65535};
static uint8_t buf[OC_MAX_DATAGRAM_BYTES];
static size_t n_bytes;
static oc_junction_t junctions[OC_MAX_JUNCTIONS], original[OC_MAX_JUNCTIONS];
static oc_tie_t ties[OC_MAX_TIES];
static oc_view_part_t part;

void setUp(void) {}
void tearDown(void) {}

static oc_status_t encode_view(const oc_view_head_t *head, uint16_t n, uint16_t first, uint16_t n_ties,
                               uint16_t first_tie, size_t cap, uint16_t *taken, uint16_t *tied)
{
    return oc_packet_encode_view(&sender, head, junctions, n, first, ties, n_ties, first_tie, buf, cap, &n_bytes, taken,
                                 tied);
}

/* ---- view ---- */

static double angle_between(const double A[9], const double B[9])
{
    double sum = 0.0;
    for (int i = 0; i < 9; i++) {
        sum += (A[i] - B[i]) * (A[i] - B[i]);
    }
    return sqrt(sum / 2.0);
}

static void view_heads_come_back_within_their_quanta(void)
{
    uint32_t state = SEED;
    double sum_squares = 0.0;
    for (int trial = 0; trial < 2000; trial++) {
        const oc_view_head_t head = example_view_head(&state);
        uint16_t taken, tied;
        TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 0, 0, 0, 0, sizeof buf, &taken, &tied));
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part));
        TEST_ASSERT_EQUAL_UINT16(head.view, part.head.view);
        TEST_ASSERT_EQUAL_UINT8(head.camera_index, part.head.camera_index);
        TEST_ASSERT_EQUAL_UINT8(head.part, part.head.part);
        TEST_ASSERT_TRUE(part.head.is_last && !part.head.has_distortion);
        TEST_ASSERT_TRUE(head.utime_us == part.head.utime_us);
        double sent[3], got[3];
        oc_pose_centre(&head.camera.pose, sent);
        oc_pose_centre(&part.head.camera.pose, got);
        for (int i = 0; i < 3; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(0.5e-4 + 1e-9, sent[i], got[i]);
        }
        /* Three components err by half a quantum of 1.35e-6, the fourth by at most their sum; an angle is twice that. */
        const double angle = angle_between(head.camera.pose.R, part.head.camera.pose.R);
        TEST_ASSERT_TRUE_MESSAGE(angle < 4.7e-6, "seed 0x9ac4e7");
        sum_squares += angle * angle;
        for (int i = 0; i < 6; i++) {
            TEST_ASSERT_TRUE(part.head.margin.v[i] >= head.margin.v[i]);
            TEST_ASSERT_TRUE(part.head.margin.v[i] <= head.margin.v[i] * (1.0 + 1.0 / 1024.0));
        }
        TEST_ASSERT_EQUAL_DOUBLE((double)(float)head.camera.k.fx_px, part.head.camera.k.fx_px);
        TEST_ASSERT_EQUAL_UINT32(640, part.head.camera.k.width_px);
        TEST_ASSERT_EQUAL_UINT32(480, part.head.camera.k.height_px);
    }
    TEST_ASSERT_TRUE(sqrt(sum_squares / 2000.0) < 2e-6);
}

static void a_decoded_view_head_is_sent_again_unchanged(void)
{
    uint32_t state = SEED;
    uint8_t first_bytes[200];
    for (int trial = 0; trial < 2000; trial++) {
        oc_view_head_t head = example_view_head(&state);
        /* Every fourth rotation has ties for the largest component, where rounding could choose another. */
        const double half[4] = {0.5, trial % 8 < 4 ? 0.5 : -0.5, 0.5, -0.5};
        double centre[3] = {214748.0, -214748.0, 0.00005}, R[9];
        if (trial % 3 == 0) head.margin.v[trial % 6] *= 1.3;
        if (trial % 4 == 0 && oc_rotation_from_quat(half, R) == OC_OK) {
            oc_pose_from_centre(R, centre, &head.camera.pose);
        }
        uint16_t taken, tied;
        TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 0, 0, 0, 0, sizeof first_bytes, &taken, &tied));
        const size_t n_first = n_bytes;
        memcpy(first_bytes, buf, n_bytes);
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part));
        TEST_ASSERT_EQUAL(OC_OK, encode_view(&part.head, 0, 0, 0, 0, sizeof first_bytes, &taken, &tied));
        TEST_ASSERT_EQUAL_size_t(n_first, n_bytes);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(first_bytes, buf, n_bytes);
    }
}

static void check_junction(const oc_junction_t *sent, const oc_junction_t *got)
{
    TEST_ASSERT_FLOAT_WITHIN(0.0626f, sent->x_px, got->x_px);
    TEST_ASSERT_FLOAT_WITHIN(0.0626f, sent->y_px, got->y_px);
    TEST_ASSERT_EQUAL_UINT8(sent->label, got->label);
    TEST_ASSERT_EQUAL_UINT8(sent->n_branches, got->n_branches);
    for (unsigned b = 0; b < got->n_branches; b++) {
        TEST_ASSERT_FLOAT_WITHIN(0.00614f, sent->branch[b].angle_rad, got->branch[b].angle_rad);
    }
}

static void junctions_come_back_in_the_transmit_order_of_the_callers_array(void)
{
    uint32_t state = SEED;
    const oc_view_head_t head = example_view_head(&state);
    example_junctions(&state, &head.camera.k, 150, 5, 3, junctions);
    for (int i = 0; i < 150; i++) {
        junctions[i].confidence = (uint8_t)i; /* stays with its junction through sorting */
    }
    memcpy(original, junctions, sizeof original);
    uint16_t taken, tied;
    TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 150, 0, 0, 0, sizeof buf, &taken, &tied));
    TEST_ASSERT_EQUAL_UINT16(150, taken);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part));
    TEST_ASSERT_EQUAL_UINT16(0, part.first_junction);
    TEST_ASSERT_EQUAL_UINT16(150, part.n_junctions);
    bool is_seen[150] = {false};
    for (int i = 0; i < 150; i++) {
        const oc_junction_t *got = &part.junctions[i], *mine = &junctions[i];
        TEST_ASSERT_TRUE(got->x_px == mine->x_px && got->y_px == mine->y_px && got->kind == mine->kind);
        check_junction(&original[mine->confidence], mine);
        check_junction(mine, got);
        TEST_ASSERT_FALSE(is_seen[mine->confidence]);
        is_seen[mine->confidence] = true;
        TEST_ASSERT_TRUE(mine->score == original[mine->confidence].score && mine->branch[0].length_px == 10.0f);
        TEST_ASSERT_TRUE(got->score == 1024.0f - (float)i && got->branch[0].length_px == 0.0f);
        if (i == 0) continue;
        const oc_junction_t *before = &part.junctions[i - 1];
        TEST_ASSERT_TRUE(before->y_px < got->y_px || (before->y_px == got->y_px && before->x_px <= got->x_px));
    }
}

static void a_view_splits_into_parts_that_each_decode_alone(void)
{
    for (size_t cap = OC_MIN_DATAGRAM_BYTES; cap <= OC_MAX_DATAGRAM_BYTES; cap += 295) {
        uint32_t state = SEED;
        oc_view_head_t head = example_view_head(&state);
        example_junctions(&state, &head.camera.k, 400, 4, 3, junctions);
        memcpy(original, junctions, sizeof original);
        example_ties(&state, &head, OC_MAX_TIES, ties);
        uint16_t first = 0, first_tie = 0;
        for (head.part = 0; first < 400 || first_tie < OC_MAX_TIES; head.part++) {
            uint16_t taken, tied;
            TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 400, first, OC_MAX_TIES, first_tie, cap, &taken, &tied));
            TEST_ASSERT_TRUE(n_bytes <= cap && taken + tied > 0);
            if (first_tie < OC_MAX_TIES) TEST_ASSERT_TRUE(tied > 0);
            TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part));
            TEST_ASSERT_EQUAL_UINT16(first, part.first_junction);
            TEST_ASSERT_EQUAL_UINT16(taken, part.n_junctions);
            TEST_ASSERT_EQUAL_UINT16(tied, part.n_ties);
            for (uint16_t i = 0; i < tied; i++) {
                TEST_ASSERT_EQUAL_UINT16(ties[first_tie + i].ref_view, part.ties[i].ref_view);
                TEST_ASSERT_FLOAT_WITHIN(0.03126f, ties[first_tie + i].x_px, part.ties[i].x_px);
                TEST_ASSERT_FLOAT_WITHIN(0.03126f, ties[first_tie + i].ref_y_px, part.ties[i].ref_y_px);
            }
            /* The best come first: a part holds the scores of its own range only. */
            for (uint16_t i = first; i < first + taken; i++) {
                TEST_ASSERT_TRUE(junctions[i].score <= 400.0f - first);
                TEST_ASSERT_TRUE(junctions[i].score > 400.0f - first - taken);
            }
            first = (uint16_t)(first + taken);
            first_tie = (uint16_t)(first_tie + tied);
            TEST_ASSERT_EQUAL(first == 400 && first_tie == OC_MAX_TIES, part.head.is_last);
        }
    }
}

static void a_part_leaves_no_room_that_a_junction_would_fit(void)
{
    uint32_t state = SEED;
    const oc_view_head_t head = example_view_head(&state);
    example_junctions(&state, &head.camera.k, 1000, 2, 3, junctions);
    uint16_t taken, tied;
    TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 1000, 0, 0, 0, sizeof buf, &taken, &tied));
    /* None is longer than 8 bytes. */
    TEST_ASSERT_TRUE(n_bytes > sizeof buf - 8u && taken > 200 && taken < 1000);
}

static void two_hundred_junctions_take_less_than_a_thousand_bytes(void)
{
    uint32_t state = SEED;
    const oc_view_head_t head = example_view_head(&state);
    example_junctions(&state, &head.camera.k, 200, 2, 8, junctions);
    uint16_t taken, tied;
    TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 200, 0, 0, 0, sizeof buf, &taken, &tied));
    TEST_ASSERT_EQUAL_UINT16(200, taken);
    printf("view of 200 junctions with 2 branches, 640x480: %zu bytes\n", n_bytes);
    TEST_ASSERT_TRUE(n_bytes <= 1000);
}

static void places_at_the_borders_stay_inside(void)
{
    uint32_t state = SEED;
    const oc_view_head_t head = example_view_head(&state);
    example_junctions(&state, &head.camera.k, 4, 2, 3, junctions);
    junctions[0].x_px = -0.5f;
    junctions[0].y_px = -0.5f;
    junctions[1].x_px = 639.4999f;
    junctions[1].y_px = 479.4999f;
    junctions[2].x_px = junctions[3].x_px;
    junctions[2].y_px = junctions[3].y_px;
    junctions[2].branch[0].angle_rad = 0.5f;
    junctions[2].branch[1].angle_rad = 6.2831f; /* rounds to a whole turn, which is 0 and comes first */
    uint16_t taken, tied;
    TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 4, 0, 0, 0, sizeof buf, &taken, &tied));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part));
    TEST_ASSERT_TRUE(part.junctions[0].x_px == -0.5f && part.junctions[0].y_px == -0.5f);
    TEST_ASSERT_TRUE(part.junctions[3].x_px == 639.375f && part.junctions[3].y_px == 479.375f);
    bool has_wrapped = false;
    for (int i = 0; i < 4; i++) {
        has_wrapped = has_wrapped || part.junctions[i].branch[0].angle_rad == 0.0f;
    }
    TEST_ASSERT_TRUE(has_wrapped);
}

static void corners_come_back_beside_junctions(void)
{
    uint32_t state = SEED;
    const oc_view_head_t head = example_view_head(&state);
    example_junctions(&state, &head.camera.k, 60, 4, 3, junctions);
    for (int i = 0; i < 60; i++) {
        junctions[i].confidence = (uint8_t)i;
        if (i % 3 == 0) junctions[i].n_branches = 1;
    }
    junctions[0].branch[0].angle_rad = 6.2831f; /* rounds to 0 */
    memcpy(original, junctions, sizeof original);
    uint16_t taken, tied;
    TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 60, 0, 0, 0, sizeof buf, &taken, &tied));
    TEST_ASSERT_EQUAL_UINT16(60, taken);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part));
    int n_corners = 0;
    for (int i = 0; i < 60; i++) {
        const oc_junction_t *got = &part.junctions[i], *mine = &junctions[i];
        check_junction(mine, got);
        TEST_ASSERT_EQUAL_UINT8(original[mine->confidence].n_branches, got->n_branches);
        TEST_ASSERT_TRUE((got->n_branches == 1) == (got->kind == OC_KIND_CORNER));
        TEST_ASSERT_TRUE(got->kind == mine->kind && (got->n_branches > 1 || got->branch[1].angle_rad == 0.0f));
        if (mine->confidence == 0) TEST_ASSERT_TRUE(got->branch[0].angle_rad == 0.0f);
        n_corners += got->n_branches == 1;
    }
    TEST_ASSERT_EQUAL_INT(20, n_corners);
}

/* Equal directions mean a corner: a junction's two that round to the same are sent a unit apart. */
static void a_junction_s_two_branches_never_arrive_as_a_corner(void)
{
    uint32_t state = SEED;
    const oc_view_head_t head = example_view_head(&state);
    const float angle_rad[3] = {0.0f, 1.0f, 6.275f}; /* the last unit is 6.2709 */
    for (int i = 0; i < 3; i++) {
        example_junctions(&state, &head.camera.k, 1, 2, 3, junctions);
        junctions[0].branch[0].angle_rad = angle_rad[i];
        junctions[0].branch[1].angle_rad = angle_rad[i] + 0.0001f;
        uint16_t taken, tied;
        TEST_ASSERT_EQUAL(OC_OK, encode_view(&head, 1, 0, 0, 0, sizeof buf, &taken, &tied));
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_view(buf, n_bytes, &part));
        const oc_junction_t *got = &part.junctions[0];
        TEST_ASSERT_TRUE(got->n_branches == 2 && got->kind == OC_KIND_L);
        for (int b = 0; b < 2; b++) {
            TEST_ASSERT_TRUE(got->branch[b].angle_rad == junctions[0].branch[b].angle_rad);
            TEST_ASSERT_FLOAT_WITHIN(0.0185f, angle_rad[i], got->branch[b].angle_rad);
        }
        TEST_ASSERT_TRUE(got->branch[1].angle_rad > got->branch[0].angle_rad);
    }
}

static void kinds_are_told_from_the_directions(void)
{
    oc_branch_t branch[4] = {{.angle_rad = 0.1f}, {.angle_rad = 1.5f}, {.angle_rad = 3.1f}, {.angle_rad = 5.0f}};
    TEST_ASSERT_EQUAL(OC_KIND_OTHER, oc_junction_kind_of(branch, 0));
    TEST_ASSERT_EQUAL(OC_KIND_CORNER, oc_junction_kind_of(branch, 1));
    TEST_ASSERT_EQUAL(OC_KIND_L, oc_junction_kind_of(branch, 2));
    TEST_ASSERT_EQUAL(OC_KIND_T, oc_junction_kind_of(branch, 3)); /* 3.0 rad apart: 8 degrees off straight */
    TEST_ASSERT_EQUAL(OC_KIND_X, oc_junction_kind_of(branch, 4));
    branch[2].angle_rad = 3.0f; /* 2.9 rad: 14 degrees off */
    TEST_ASSERT_EQUAL(OC_KIND_Y, oc_junction_kind_of(branch, 3));
    branch[0].angle_rad = 0.0f;
    branch[2].angle_rad = 1.5f + 3.3f; /* more than half a turn counts alike */
    TEST_ASSERT_EQUAL(OC_KIND_T, oc_junction_kind_of(branch, 3));
}

/* Spoil one thing of a good view and expect refusal with everything untouched. */
static void values_that_cannot_travel_are_refused_untouched(void)
{
    for (int spoil = 0; spoil < 16; spoil++) {
        uint32_t state = SEED;
        oc_view_head_t head = example_view_head(&state);
        example_junctions(&state, &head.camera.k, 10, 3, 3, junctions);
        example_ties(&state, &head, 5, ties);
        uint16_t n = 10, n_ties = 5, first = 0;
        if (spoil == 0) head.margin.v[2] = (double)NAN;
        if (spoil == 1) head.margin.v[2] = -1e-9;
        if (spoil == 2) head.margin.v[5] = 65505.0;
        if (spoil == 3) head.camera.k.fx_px = (double)INFINITY;
        if (spoil == 4) head.camera.k.width_px = 4097;
        if (spoil == 5) head.camera.pose.t[0] = 3e5;
        if (spoil == 6) head.camera.pose.R[0] += 0.01;
        if (spoil == 7) head.utime_us = -1;
        if (spoil == 8) junctions[9].x_px = 639.5f;
        if (spoil == 9) junctions[9].y_px = NAN;
        if (spoil == 10) junctions[9].n_branches = 0;
        if (spoil == 11) junctions[9].branch[1].angle_rad = 6.3f;
        if (spoil == 12) junctions[9].label = 3;
        if (spoil == 13) ties[4].ref_view = head.view;
        if (spoil == 14) ties[4].ref_x_px = 4096.0f;
        if (spoil == 15) first = 11;
        memcpy(original, junctions, sizeof original);
        uint16_t taken = 999, tied = 999;
        n_bytes = 999;
        TEST_ASSERT_EQUAL(OC_E_ARG, encode_view(&head, n, first, n_ties, 0, sizeof buf, &taken, &tied));
        TEST_ASSERT_EQUAL_MEMORY(original, junctions, sizeof original);
        TEST_ASSERT_TRUE(taken == 999 && tied == 999 && n_bytes == 999);
    }
}

static void a_buffer_too_small_is_refused_untouched(void)
{
    uint32_t state = SEED;
    const oc_view_head_t head = example_view_head(&state);
    example_junctions(&state, &head.camera.k, 10, 3, 3, junctions);
    memcpy(original, junctions, sizeof original);
    uint16_t taken = 999, tied = 999;
    size_t smallest = 0;
    for (size_t cap = 0; cap < OC_MIN_DATAGRAM_BYTES; cap++) {
        const oc_status_t status = encode_view(&head, 10, 0, 0, 0, cap, &taken, &tied);
        if (status == OC_OK) {
            smallest = cap;
            break;
        }
        TEST_ASSERT_EQUAL(OC_E_SPACE, status);
        TEST_ASSERT_EQUAL_MEMORY(original, junctions, sizeof original);
        TEST_ASSERT_TRUE(taken == 999 && tied == 999);
    }
    TEST_ASSERT_TRUE(smallest > 62 && smallest < 77 && taken == 1);
    TEST_ASSERT_EQUAL(OC_E_LIMIT, encode_view(&head, OC_MAX_JUNCTIONS + 1, 0, 0, 0, sizeof buf, &taken, &tied));
}

/* ---- patch ---- */

static void patches_take_what_fits_and_come_back_close(void)
{
    static uint8_t px[203 * 97];
    static uint16_t blocks[OC_MAX_PACKET_BLOCKS];
    static oc_patch_t patch;
    uint32_t state = SEED;
    for (int i = 0; i < 203 * 97; i++) {
        px[i] = (uint8_t)(100 + i % 203 / 3 + (int)(example_random(&state) % 8u));
    }
    const oc_image_t grey = {.px = px, .width_px = 203, .height_px = 97, .stride_bytes = 203, .channels = 1};
    for (uint16_t i = 0; i < 26 * 13; i++) {
        blocks[i] = i;
    }
    uint16_t done = 0;
    while (done < 26 * 13) {
        uint16_t taken;
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_patch(&sender, 4, 24, &grey, &blocks[done],
                                                        (uint16_t)(26 * 13 - done), buf, 500, &n_bytes, &taken));
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_patch(buf, n_bytes, &patch));
        TEST_ASSERT_TRUE(n_bytes <= 500 && patch.n_blocks == taken && patch.blocks_per_row == 26);
        for (uint16_t b = 0; b < taken; b++) {
            TEST_ASSERT_EQUAL_UINT16(blocks[done + b], patch.blocks[b]);
            const int x0 = patch.blocks[b] % 26 * 8, y0 = patch.blocks[b] / 26 * 8;
            for (int i = 0; i < 64; i++) {
                const int x = x0 + i % 8, y = y0 + i / 8;
                if (x < 203 && y < 97) TEST_ASSERT_INT_WITHIN(16, px[y * 203 + x], patch.px[b][i]);
            }
        }
        done = (uint16_t)(done + taken);
    }
}

static void patches_outside_the_image_are_refused(void)
{
    static const uint8_t px[64 * 64];
    const oc_image_t grey = {.px = px, .width_px = 64, .height_px = 64, .stride_bytes = 64, .channels = 1};
    const uint16_t outside[1] = {64}, twice[2] = {5, 5}, good[1] = {63};
    uint16_t taken;
    TEST_ASSERT_EQUAL(OC_E_ARG,
                      oc_packet_encode_patch(&sender, 1, 9, &grey, outside, 1, buf, sizeof buf, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(OC_E_ARG,
                      oc_packet_encode_patch(&sender, 1, 9, &grey, twice, 2, buf, sizeof buf, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(OC_E_ARG,
                      oc_packet_encode_patch(&sender, 1, 0, &grey, good, 1, buf, sizeof buf, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(OC_E_ARG,
                      oc_packet_encode_patch(&sender, 1, 32, &grey, good, 1, buf, sizeof buf, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_packet_encode_patch(&sender, 1, 9, &grey, good, 1, buf, 11, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_patch(&sender, 1, 9, &grey, good, 1, buf, sizeof buf, &n_bytes, &taken));
}

/* ---- the others ---- */

static void relabels_come_back(void)
{
    for (int common = 0; common < 3; common++) {
        oc_relabel_t sent = {.view = 9, .first = 824, .n = 200}, got;
        for (uint16_t i = 0; i < sent.n; i++) {
            sent.labels[i] = (uint8_t)(i % 5 == 0 ? i / 5 % 3 : common);
        }
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_relabel(&sender, &sent, buf, sizeof buf, &n_bytes));
        TEST_ASSERT_TRUE(n_bytes <= 11 + 40);
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_relabel(buf, n_bytes, &got));
        TEST_ASSERT_TRUE(got.view == 9 && got.first == 824 && got.n == 200);
        TEST_ASSERT_EQUAL_UINT8_ARRAY(sent.labels, got.labels, 200);
        sent.first = 825;
        TEST_ASSERT_EQUAL(OC_E_LIMIT, oc_packet_encode_relabel(&sender, &sent, buf, sizeof buf, &n_bytes));
    }
}

static void image_pieces_reassemble(void)
{
    static uint8_t image[5000], rebuilt[5000];
    uint32_t state = SEED;
    for (size_t i = 0; i < sizeof image; i++) {
        image[i] = (uint8_t)example_random(&state);
    }
    oc_image_piece_t piece = {.head = example_view_head(&state), .codec = OC_CODEC_AVIF, .total_bytes = 5000}, got;
    piece.head.part = 0;
    for (uint32_t at = 0; at < 5000; piece.head.part++) {
        uint16_t taken;
        piece.offset_bytes = at;
        piece.bytes = image + at;
        piece.n_bytes = (uint16_t)(5000 - at);
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_image(&sender, &piece, buf, 250, &n_bytes, &taken));
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_image(buf, n_bytes, &got));
        TEST_ASSERT_TRUE(got.n_bytes == taken && got.offset_bytes == at && got.codec == OC_CODEC_AVIF);
        TEST_ASSERT_EQUAL(at + taken == 5000, got.head.is_last);
        memcpy(rebuilt + at, got.bytes, taken);
        at += taken;
    }
    TEST_ASSERT_EQUAL_UINT8_ARRAY(image, rebuilt, 5000);
    piece.offset_bytes = 4999;
    piece.n_bytes = 2;
    uint16_t taken;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_image(&sender, &piece, buf, 250, &n_bytes, &taken));
}

static void overhead_tiles_come_back(void)
{
    uint8_t bytes[300];
    memset(bytes, 0x5a, sizeof bytes);
    oc_overhead_t sent = {.view = 2, .metres_per_pixel = 0.005, .tile_px = 256, .tile = {-32768, 32767}}, got;
    sent.codec = OC_CODEC_WEBP;
    sent.n_bytes = sizeof bytes;
    sent.bytes = bytes;
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_packet_encode_overhead(&sender, &sent, buf, 300, &n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_overhead(&sender, &sent, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_overhead(buf, n_bytes, &got));
    TEST_ASSERT_EQUAL_DOUBLE((double)(float)0.005, got.metres_per_pixel);
    TEST_ASSERT_TRUE(got.view == 2 && got.tile_px == 256 && got.tile.ix == -32768 && got.tile.iy == 32767);
    TEST_ASSERT_TRUE(got.codec == OC_CODEC_WEBP && got.n_bytes == 300);
    TEST_ASSERT_EQUAL_UINT8_ARRAY(bytes, got.bytes, 300);
    sent.codec = 0;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_overhead(&sender, &sent, buf, sizeof buf, &n_bytes));
    sent.codec = OC_CODEC_JPEG;
    sent.metres_per_pixel = (double)NAN;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_overhead(&sender, &sent, buf, sizeof buf, &n_bytes));
}

static void requests_come_back(void)
{
    const oc_resend_request_t resend = {.view = 8, .parts = 0x80000001u};
    oc_resend_request_t resend_back;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_resend(&sender, &resend, buf, sizeof buf, &n_bytes));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_resend(buf, n_bytes, &resend_back));
    TEST_ASSERT_TRUE(resend_back.view == 8 && resend_back.parts == 0x80000001u);

    oc_patch_request_t request = {.view = 65535, .quality = 31, .n_blocks = 512}, back;
    for (uint16_t i = 0; i < 512; i++) {
        request.blocks[i] = (uint16_t)(i * 128 + 127);
    }
    uint16_t taken;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_patch_request(&sender, &request, buf, 200, &n_bytes, &taken));
    TEST_ASSERT_TRUE(taken > 100 && taken < 512 && n_bytes > 195 && n_bytes <= 200);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_patch_request(&sender, &request, buf, sizeof buf, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_patch_request(buf, n_bytes, &back));
    TEST_ASSERT_TRUE(taken == 512 && back.n_blocks == 512 && back.quality == 31 && back.view == 65535);
    TEST_ASSERT_EQUAL_UINT16_ARRAY(request.blocks, back.blocks, 512);
    request.blocks[7] = request.blocks[6];
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_packet_encode_patch_request(&sender, &request, buf, sizeof buf, &n_bytes, &taken));
}

static void overhead_requests_come_back(void)
{
    oc_overhead_request_t request = {.view = 1, .metres_per_pixel = 0.25, .tile_px = 16, .quality = 100}, back;
    request.n_tiles = 64;
    for (int i = 0; i < 9; i++) {
        request.image_from_ground[i] = ldexp(1.0, 8 * i - 32);
    }
    for (int i = 0; i < 64; i++) {
        request.tiles[i] = (oc_tile_id_t){(int16_t)(i % 2 ? 32767 : -32768), (int16_t)(i - 40)};
    }
    uint16_t taken;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_overhead_request(&sender, &request, buf, 200, &n_bytes, &taken));
    TEST_ASSERT_TRUE(taken > 10 && taken < 64);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_encode_overhead_request(&sender, &request, buf, sizeof buf, &n_bytes, &taken));
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_overhead_request(buf, n_bytes, &back));
    TEST_ASSERT_TRUE(taken == 64 && back.n_tiles == 64 && back.tile_px == 16 && back.quality == 100);
    for (int i = 0; i < 64; i++) {
        TEST_ASSERT_TRUE(back.tiles[i].ix == request.tiles[i].ix && back.tiles[i].iy == request.tiles[i].iy);
    }
    for (int i = 0; i < 9; i++) {
        TEST_ASSERT_EQUAL_DOUBLE(request.image_from_ground[i], back.image_from_ground[i]);
    }
    request.image_from_ground[4] = 1e39;
    TEST_ASSERT_EQUAL(OC_E_ARG,
                      oc_packet_encode_overhead_request(&sender, &request, buf, sizeof buf, &n_bytes, &taken));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(view_heads_come_back_within_their_quanta);
    RUN_TEST(a_decoded_view_head_is_sent_again_unchanged);
    RUN_TEST(junctions_come_back_in_the_transmit_order_of_the_callers_array);
    RUN_TEST(a_view_splits_into_parts_that_each_decode_alone);
    RUN_TEST(a_part_leaves_no_room_that_a_junction_would_fit);
    RUN_TEST(two_hundred_junctions_take_less_than_a_thousand_bytes);
    RUN_TEST(places_at_the_borders_stay_inside);
    RUN_TEST(corners_come_back_beside_junctions);
    RUN_TEST(a_junction_s_two_branches_never_arrive_as_a_corner);
    RUN_TEST(kinds_are_told_from_the_directions);
    RUN_TEST(values_that_cannot_travel_are_refused_untouched);
    RUN_TEST(a_buffer_too_small_is_refused_untouched);
    RUN_TEST(patches_take_what_fits_and_come_back_close);
    RUN_TEST(patches_outside_the_image_are_refused);
    RUN_TEST(relabels_come_back);
    RUN_TEST(image_pieces_reassemble);
    RUN_TEST(overhead_tiles_come_back);
    RUN_TEST(requests_come_back);
    RUN_TEST(overhead_requests_come_back);
    return UNITY_END();
}
