/* SPDX-License-Identifier: BSD-3-Clause
 * Packets that were cut, flipped or forged: refused or decoded, never half, output untouched on refusal. */
#include "core/packet_internal.h"
#include "packet_any.h"
#include "packet_examples.h"
#include "unity.h"

static example_packet_t packets[N_EXAMPLES];
static any_body_t body, pattern;

void setUp(void) {}
void tearDown(void) {}

/* Write the CRC that belongs to the bytes before it. */
static void repair_crc(uint8_t *bytes, size_t n_bytes)
{
    const uint16_t crc = oc_packet_crc(bytes, n_bytes - 2u);
    bytes[n_bytes - 2u] = (uint8_t)(crc >> 8);
    bytes[n_bytes - 1u] = (uint8_t)(crc & 0xffu);
}

static oc_status_t decode_watched(unsigned type, const uint8_t *bytes, size_t n_bytes)
{
    const oc_status_t status = any_decode_as(type, bytes, n_bytes, &body);
    TEST_ASSERT_TRUE(status == OC_OK || status == OC_E_FORMAT);
    if (status != OC_OK) {
        TEST_ASSERT_TRUE_MESSAGE(memcmp(&body, &pattern, sizeof body) == 0, "output touched on failure");
    } else {
        memset(&body, 0xa5, sizeof body);
    }
    return status;
}

static void every_example_decodes_as_its_own_type_only(void)
{
    for (int i = 0; i < N_EXAMPLES; i++) {
        oc_packet_head_t head;
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_head(packets[i].bytes, packets[i].n_bytes, &head));
        TEST_ASSERT_TRUE(head.vehicle == 2 && head.sequence == 0x1234);
        for (unsigned type = 0; type < 32; type++) {
            const oc_status_t expected = type == head.type ? OC_OK : OC_E_FORMAT;
            TEST_ASSERT_EQUAL(expected, decode_watched(type, packets[i].bytes, packets[i].n_bytes));
        }
    }
}

static void every_prefix_is_refused_or_decodes(void)
{
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
    int n_decoded = 0;
    for (int i = 0; i < N_EXAMPLES; i++) {
        const unsigned type = packets[i].bytes[0] & 31u;
        for (size_t n = 0; n < packets[i].n_bytes; n++) {
            memcpy(bytes, packets[i].bytes, n);
            TEST_ASSERT_EQUAL_MESSAGE(OC_E_FORMAT, decode_watched(type, bytes, n), packets[i].name);
            if (n < 6) continue;
            repair_crc(bytes, n);
            n_decoded += decode_watched(type, bytes, n) == OC_OK;
        }
    }
    /* Of all bodies only those of an overhead and a texture tile may end anywhere: 8 prefixes of 9 bytes each. */
    TEST_ASSERT_EQUAL_INT(16, n_decoded);
}

static void every_flipped_bit_is_refused_by_the_crc(void)
{
    for (int i = 0; i < N_EXAMPLES; i++) {
        for (size_t bit = 0; bit < packets[i].n_bytes * 8u; bit++) {
            oc_packet_head_t head;
            packets[i].bytes[bit / 8u] ^= (uint8_t)(128u >> bit % 8u);
            TEST_ASSERT_EQUAL(OC_E_FORMAT, oc_packet_decode_head(packets[i].bytes, packets[i].n_bytes, &head));
            packets[i].bytes[bit / 8u] ^= (uint8_t)(128u >> bit % 8u);
        }
    }
}

static void flipped_bits_behind_a_good_crc_are_refused_or_decode(void)
{
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
    int n_refused = 0, n_decoded = 0;
    for (int i = 0; i < N_EXAMPLES; i++) {
        for (size_t bit = 0; bit < (packets[i].n_bytes - 2u) * 8u; bit++) {
            memcpy(bytes, packets[i].bytes, packets[i].n_bytes);
            bytes[bit / 8u] ^= (uint8_t)(128u >> bit % 8u);
            repair_crc(bytes, packets[i].n_bytes);
            const oc_status_t status = decode_watched(bytes[0] & 31u, bytes, packets[i].n_bytes);
            n_refused += status != OC_OK;
            n_decoded += status == OC_OK;
        }
    }
    TEST_ASSERT_TRUE(n_refused > 1000 && n_decoded > 1000);
}

static void other_versions_and_reserved_types_are_refused(void)
{
    for (unsigned first = 0; first < 256; first++) {
        uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
        oc_packet_head_t head = {.type = 99};
        memcpy(bytes, packets[9].bytes, packets[9].n_bytes);
        bytes[0] = (uint8_t)first;
        repair_crc(bytes, packets[9].n_bytes);
        const bool is_known = (first >= 1 && first <= 9) || (first >= 16 && first <= 21);
        const oc_status_t status = oc_packet_decode_head(bytes, packets[9].n_bytes, &head);
        TEST_ASSERT_EQUAL(is_known ? OC_OK : OC_E_FORMAT, status);
        TEST_ASSERT_EQUAL_UINT8(is_known ? first : 99, head.type);
    }
}

/* Of the status example: head, numbers, counters (docs/protocol.md, 4.6), two flags and five floats. */
static unsigned status_padding_bits(void)
{
    oc_vehicle_status_t status;
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_status(packets[8].bytes, packets[8].n_bytes, &status));
    unsigned n_bits = 32 + 32 + 16 + 16 + 32 + 1 + 1 + 5 * 32;
    for (int i = 0; i < OC_N_COUNTERS; i++) {
        n_bits += 1;
        if (status.counters[i] == 0) continue;
        n_bits += 5;
        for (uint32_t n = status.counters[i]; n > 1; n >>= 1) n_bits++;
    }
    TEST_ASSERT_EQUAL((n_bits + 7) / 8 + 2, packets[8].n_bytes);
    return (8 - n_bits % 8) % 8;
}

static void trailing_bytes_and_padding_bits_are_refused(void)
{
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
    for (int i = 0; i < N_EXAMPLES; i++) {
        const unsigned type = packets[i].bytes[0] & 31u;
        if (type == OC_PACKET_OVERHEAD || type == OC_PACKET_TEXTURE) continue;
        const size_t n = packets[i].n_bytes;
        if (n == sizeof bytes) continue;
        memcpy(bytes, packets[i].bytes, n);
        bytes[n - 2u] = 0;
        repair_crc(bytes, n + 1u);
        TEST_ASSERT_EQUAL_MESSAGE(OC_E_FORMAT, decode_watched(type, bytes, n + 1u), packets[i].name);
    }
    memcpy(bytes, packets[8].bytes, packets[8].n_bytes);
    const uint8_t last = packets[8].bytes[packets[8].n_bytes - 3u];
    const unsigned n_padding = status_padding_bits();
    TEST_ASSERT_TRUE(n_padding > 0);
    for (unsigned bit = 0; bit < n_padding; bit++) {
        bytes[packets[8].n_bytes - 3u] = (uint8_t)(last | 1u << bit);
        repair_crc(bytes, packets[8].n_bytes);
        TEST_ASSERT_EQUAL(OC_E_FORMAT, decode_watched(OC_PACKET_STATUS, bytes, packets[8].n_bytes));
    }
}

static void oversized_datagrams_are_refused(void)
{
    static uint8_t bytes[OC_MAX_DATAGRAM_BYTES + 1u];
    oc_packet_head_t head;
    bytes[0] = OC_PACKET_STATUS;
    repair_crc(bytes, sizeof bytes);
    TEST_ASSERT_EQUAL(OC_E_FORMAT, oc_packet_decode_head(bytes, sizeof bytes, &head));
    repair_crc(bytes, sizeof bytes - 1u);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_head(bytes, sizeof bytes - 1u, &head));
}

/* Overwrite `width` bits of the empty view (body bit offsets) and decode. */
static oc_status_t forge(size_t body_bit, uint32_t value, unsigned width)
{
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
    const size_t n = packets[2].n_bytes;
    memcpy(bytes, packets[2].bytes, n);
    oc_bit_writer_t writer;
    oc_bit_writer_init(&writer, bytes, n);
    writer.n_bits = 32u + body_bit;
    oc_bits_put(&writer, value, width);
    repair_crc(bytes, n);
    return decode_watched(OC_PACKET_VIEW, bytes, n);
}

static void forged_view_heads_are_refused(void)
{
    enum { CENTRE = 90, ROTATION = 186, MARGIN = 248, FOCAL = 282, PRINCIPAL = 346, WIDTH = 410, FIRST = 434 };
    TEST_ASSERT_EQUAL(OC_OK, forge(CENTRE, 12345, 32));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(CENTRE, 0x80000000u, 32));
    TEST_ASSERT_EQUAL(OC_OK, forge(CENTRE, 0x80000001u, 32));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(ROTATION + 2, 0xfffff, 20)); /* over the range */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(ROTATION + 2, 0xffffe, 20)); /* as large as the one left out */
    TEST_ASSERT_EQUAL(OC_OK, forge(MARGIN + 1, 0x7bff, 16));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(MARGIN + 1, 0x7c00, 16)); /* infinite */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(MARGIN + 1, 0x7e00, 16)); /* not a number */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(MARGIN + 1, 0x8000, 16)); /* minus zero */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(FOCAL, 0x7fc00000, 32));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(FOCAL, 0x7f800000, 32));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(FOCAL, 0, 32));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(FOCAL, 0xc3800000, 32));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(PRINCIPAL, 0x7f7fffff, 32));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(WIDTH, 30, 12));
    TEST_ASSERT_EQUAL(OC_OK, forge(WIDTH, 4095, 12));
    TEST_ASSERT_EQUAL(OC_OK, forge(FIRST, 1024, 11));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(FIRST, 1025, 11));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(FIRST + 11, 1, 11)); /* a junction that is not there */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge(FIRST + 26, 3, 2));  /* no such label */
}

/* ---- forged bodies, field by field ---- */

typedef struct field {
    uint32_t value;
    unsigned width;
} field_t;

static const oc_packet_head_t forger = {.vehicle = 1, .sequence = 1};

static void put_fields(oc_bit_writer_t *writer, const field_t fields[], size_t n)
{
    for (size_t i = 0; i < n; i++) {
        oc_bits_put(writer, fields[i].value, fields[i].width);
    }
}

static oc_status_t forge_body(oc_packet_type_t type, const field_t fields[], size_t n)
{
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes;
    oc_bit_writer_t writer;
    oc_packet_begin(&writer, &forger, type, bytes, sizeof bytes);
    put_fields(&writer, fields, n);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_end(&writer, &n_bytes));
    return decode_watched((unsigned)type, bytes, n_bytes);
}

/* A view of 640 x 480 with id 100, whose distortion is k1 alone, and these fields behind its head. */
static oc_status_t forge_view(bool has_distortion, double k1, const field_t fields[], size_t n)
{
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes;
    uint32_t seed = 1;
    oc_view_head_t head = example_view_head(&seed);
    oc_wire_head_t wire;
    oc_bit_writer_t writer;
    head.view = 100;
    TEST_ASSERT_EQUAL(OC_OK, oc_wire_head_from(&head, &wire));
    wire.has_distortion = has_distortion;
    wire.distortion[0] = k1;
    oc_packet_begin(&writer, &forger, OC_PACKET_VIEW, bytes, sizeof bytes);
    oc_wire_head_put(&writer, &wire, true);
    put_fields(&writer, fields, n);
    TEST_ASSERT_EQUAL(OC_OK, oc_packet_end(&writer, &n_bytes));
    return decode_watched(OC_PACKET_VIEW, bytes, n_bytes);
}

#define FORGE(type, ...)                                                                                               \
    forge_body(type, (const field_t[]){__VA_ARGS__}, sizeof((const field_t[]){__VA_ARGS__}) / sizeof(field_t))
#define FORGE_VIEW(...)                                                                                                \
    forge_view(false, 0.0, (const field_t[]){__VA_ARGS__}, sizeof((const field_t[]){__VA_ARGS__}) / sizeof(field_t))

/* One junction at the given row: escape of the Rice code, column 0, two branches, common label, two angles of 0. */
/* clang-format off */
#define ONE_JUNCTION(row) \
    {0, 11}, {1, 11}, {0, 4}, {1, 2}, {0xffffff, 24}, {row, 32}, {0, 12}, {0, 1}, {0, 1}, {0, 9}, {0, 8}
#define NO_JUNCTIONS {0, 11}, {0, 11}, {0, 4}, {1, 2}
/* clang-format on */
/* Four positions of 0 in an image of 640 x 480 and one of its size: 13, 12, 13, 12 bits. */
/* clang-format off */
#define TIE_PLACES {0, 13}, {0, 12}, {0, 13}, {0, 12}
/* clang-format on */

static void forged_junctions_are_refused(void)
{
    TEST_ASSERT_EQUAL(OC_OK, FORGE_VIEW(ONE_JUNCTION(3839), {0, 7}, {1, 1}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE_VIEW(ONE_JUNCTION(3840), {0, 7}, {1, 1}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE_VIEW(ONE_JUNCTION(0xffffffff), {0, 7}, {1, 1}));
}

static void forged_ties_are_refused(void)
{
    TEST_ASSERT_EQUAL(OC_OK, FORGE_VIEW(NO_JUNCTIONS, {1, 7}, {1, 1}, {1, 1}, {0, 1}, TIE_PLACES));
    /* The first tie names no view. */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE_VIEW(NO_JUNCTIONS, {1, 7}, {1, 1}, {0, 1}, TIE_PLACES));
    /* 65,536 views back is the view itself: 65,535 + 1 = 2^16, 16 ones, a zero, 16 bits. */
    TEST_ASSERT_EQUAL(OC_E_FORMAT,
                      FORGE_VIEW(NO_JUNCTIONS, {1, 7}, {1, 1}, {1, 1}, {0xffff, 16}, {0, 1}, {0, 16}, TIE_PLACES));
    /* 97 ties, all there: each 1 bit and 50 of places. */
    field_t fields[7 + 97 * 5] = {NO_JUNCTIONS, {97, 7}, {1, 1}, {2, 2}};
    size_t n = 7;
    for (int i = 0; i < 97; i++) {
        static const field_t tie[5] = {{0, 1}, TIE_PLACES};
        const size_t from = i == 0 ? 1 : 0; /* the first named its view above */
        memcpy(&fields[n], &tie[from], (5u - from) * sizeof tie[0]);
        n += 5u - from;
    }
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_view(false, 0.0, fields, n));
    fields[4].value = 96;
    TEST_ASSERT_EQUAL(OC_OK, forge_view(false, 0.0, fields, n - 5u));
}

static void forged_distortion_is_refused(void)
{
    static const field_t fields[] = {NO_JUNCTIONS, {0, 7}, {1, 1}};
    TEST_ASSERT_EQUAL(OC_OK, forge_view(true, 0.1, fields, 6));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_view(true, (double)NAN, fields, 6));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_view(true, (double)INFINITY, fields, 6));
}

static void forged_relabels_are_refused(void)
{
    TEST_ASSERT_EQUAL(OC_OK, FORGE(OC_PACKET_RELABEL, {5, 16}, {1023, 11}, {1, 11}, {0, 2}, {0, 1}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(OC_PACKET_RELABEL, {5, 16}, {0, 11}, {0, 11}, {0, 2}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(OC_PACKET_RELABEL, {5, 16}, {1024, 11}, {1, 11}, {0, 2}, {0, 1}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(OC_PACKET_RELABEL, {5, 16}, {0, 11}, {1, 11}, {3, 2}, {0, 1}));
}

/* The head of a silhouette: view, key, box, step (uniform of 5), col, row, columns - 1, rows - 1. */
#define SILHOUETTE_HEAD(col, cols)                                                                                     \
    {5, 16}, {6, 16}, {3, 5}, {0, 2}, {col, 12}, {0, 12}, {(cols)-1u, 12},                                             \
    {                                                                                                                  \
        0, 12                                                                                                          \
    }

static void forged_silhouettes_and_textures_are_refused(void)
{
    /* Its one row like the ground above it; the last row must not go on beyond the columns. */
    TEST_ASSERT_EQUAL(OC_OK, FORGE(OC_PACKET_SILHOUETTE, SILHOUETTE_HEAD(4092, 4), {1, 1}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(OC_PACKET_SILHOUETTE, SILHOUETTE_HEAD(4093, 4), {1, 1}));
    /* Not the same, one run, yet ground: it could have been the same. */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(OC_PACKET_SILHOUETTE, SILHOUETTE_HEAD(0, 4), {0, 1}, {0, 2}, {3, 2}));
    TEST_ASSERT_EQUAL(OC_OK, FORGE(OC_PACKET_SILHOUETTE, SILHOUETTE_HEAD(0, 4), {0, 1}, {0, 2}, {2, 2}));

    /* A texture request that cancels, and one without tiles, without budget, of tiles of 15 px. */
    TEST_ASSERT_EQUAL(OC_OK, FORGE(OC_PACKET_TEXTURE_REQUEST, {5, 16}, {1, 1}));
    TEST_ASSERT_EQUAL(OC_OK, FORGE(OC_PACKET_TEXTURE_REQUEST, {5, 16}, {0, 1}, {0, 1}, {16, 8}, {40, 7}, {1, 1},
                                   {9, 24}, {0, 4}, {1, 9}, {0, 1}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(OC_PACKET_TEXTURE_REQUEST, {5, 16}, {0, 1}, {0, 1}, {16, 8}, {40, 7}, {1, 1},
                                         {9, 24}, {0, 4}, {0, 9}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(OC_PACKET_TEXTURE_REQUEST, {5, 16}, {0, 1}, {0, 1}, {16, 8}, {40, 7}, {1, 1},
                                         {0, 24}, {0, 4}, {1, 9}, {0, 1}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(OC_PACKET_TEXTURE_REQUEST, {5, 16}, {0, 1}, {0, 1}, {15, 8}, {40, 7}, {1, 1},
                                         {9, 24}, {0, 4}, {1, 9}, {0, 1}));
}

/* A gap of the Rice code with its escape. */
/* clang-format off */
#define GAP(value) {0xffffff, 24}, {value, 32}
/* clang-format on */

static void forged_block_indices_are_refused(void)
{
    const oc_packet_type_t request = OC_PACKET_PATCH_REQUEST;
    TEST_ASSERT_EQUAL(OC_OK, FORGE(request, {5, 16}, {9, 5}, {0, 4}, {1, 10}, GAP(65535)));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(request, {5, 16}, {9, 5}, {0, 4}, {1, 10}, GAP(65536)));
    TEST_ASSERT_EQUAL(OC_OK, FORGE(request, {5, 16}, {9, 5}, {0, 4}, {2, 10}, GAP(65534), GAP(0)));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(request, {5, 16}, {9, 5}, {0, 4}, {2, 10}, GAP(65535), GAP(0)));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(request, {5, 16}, {9, 5}, {0, 4}, {2, 10}, GAP(7), GAP(0xffffffff)));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(request, {5, 16}, {0, 5}, {0, 4}, {1, 10}, GAP(7)));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(request, {5, 16}, {9, 5}, {0, 4}, {0, 10}));
}

/* A grey block: mean difference 0 and no other levels, both of order 2. */
/* clang-format off */
#define GREY_BLOCK {0, 3}, {0, 3}
/* clang-format on */

static void forged_patches_are_refused(void)
{
    const oc_packet_type_t patch = OC_PACKET_PATCH;
    TEST_ASSERT_EQUAL(OC_OK, FORGE(patch, {5, 16}, {9, 5}, {3, 9}, {0, 4}, {1, 10}, GAP(2047), GREY_BLOCK));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(patch, {5, 16}, {9, 5}, {3, 9}, {0, 4}, {1, 10}, GAP(2048), GREY_BLOCK));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(patch, {5, 16}, {9, 5}, {2, 9}, {0, 4}, {1, 10}, GAP(5), GREY_BLOCK));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(patch, {5, 16}, {0, 5}, {3, 9}, {0, 4}, {1, 10}, GAP(5), GREY_BLOCK));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(patch, {5, 16}, {9, 5}, {3, 9}, {0, 4}, {0, 10}));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(patch, {5, 16}, {9, 5}, {3, 9}, {0, 4}, {513, 10}, GAP(5), GREY_BLOCK));
    /* 64 levels besides the mean: 64 + 4 = 68, 4 ones, a zero, 6 bits. */
    TEST_ASSERT_EQUAL(OC_E_FORMAT, FORGE(patch, {5, 16}, {9, 5}, {3, 9}, {0, 4}, {1, 10}, GAP(5), {0, 3}, {15, 4},
                                         {0, 1}, {4, 6}, {0, 32}, {0, 32}, {0, 32}, {0, 32}, {0, 32}, {0, 32}));
}

static oc_status_t forge_tiles(uint32_t matrix_bits, uint32_t scale_bits, uint32_t tile_px, uint32_t quality,
                               const field_t tiles[], size_t n)
{
    field_t fields[20] = {{5, 16}};
    for (int i = 1; i <= 9; i++) {
        fields[i] = (field_t){matrix_bits, 32};
    }
    fields[10] = (field_t){scale_bits, 32};
    fields[11] = (field_t){tile_px, 9};
    fields[12] = (field_t){quality, 7};
    memcpy(&fields[13], tiles, n * sizeof tiles[0]);
    return forge_body(OC_PACKET_OVERHEAD_REQUEST, fields, 13u + n);
}

static void forged_overhead_requests_are_refused(void)
{
    enum { ONE = 0x3f800000, HUNDRED = 0x42c80000 };
    /* golomb(1) of 2 n and of 0: 65,534 + 2 = 2^16 is 15 ones, a zero and 16 bits. */
    static const field_t far[] = {{1, 7}, {0x7fff, 15}, {0, 1}, {0, 16}, {0, 2}};
    static const field_t too_far[] = {{1, 7}, {0x7fff, 15}, {0, 1}, {2, 16}, {0, 2}};
    static const field_t none[] = {{0, 7}};
    TEST_ASSERT_EQUAL(OC_OK, forge_tiles(ONE, HUNDRED, 256, 100, far, 5));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(ONE, HUNDRED, 256, 100, too_far, 5));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(ONE, HUNDRED, 256, 100, none, 1));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(0x7fc00000, HUNDRED, 256, 100, far, 5));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(ONE, HUNDRED + 1, 256, 100, far, 5));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(ONE, 0, 256, 100, far, 5));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(ONE, HUNDRED, 257, 100, far, 5));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(ONE, HUNDRED, 15, 100, far, 5));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(ONE, HUNDRED, 256, 101, far, 5));
    TEST_ASSERT_EQUAL(OC_E_FORMAT, forge_tiles(ONE, HUNDRED, 256, 0, far, 5));
}

int main(void)
{
    if (example_packets(packets) != N_EXAMPLES) return 1;
    memset(&pattern, 0xa5, sizeof pattern);
    memset(&body, 0xa5, sizeof body);
    UNITY_BEGIN();
    RUN_TEST(every_example_decodes_as_its_own_type_only);
    RUN_TEST(every_prefix_is_refused_or_decodes);
    RUN_TEST(every_flipped_bit_is_refused_by_the_crc);
    RUN_TEST(flipped_bits_behind_a_good_crc_are_refused_or_decode);
    RUN_TEST(other_versions_and_reserved_types_are_refused);
    RUN_TEST(trailing_bytes_and_padding_bits_are_refused);
    RUN_TEST(oversized_datagrams_are_refused);
    RUN_TEST(forged_view_heads_are_refused);
    RUN_TEST(forged_junctions_are_refused);
    RUN_TEST(forged_ties_are_refused);
    RUN_TEST(forged_distortion_is_refused);
    RUN_TEST(forged_relabels_are_refused);
    RUN_TEST(forged_silhouettes_and_textures_are_refused);
    RUN_TEST(forged_block_indices_are_refused);
    RUN_TEST(forged_patches_are_refused);
    RUN_TEST(forged_overhead_requests_are_refused);
    return UNITY_END();
}
