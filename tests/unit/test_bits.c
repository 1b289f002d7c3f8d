/* SPDX-License-Identifier: BSD-3-Clause
 * Tests of core/bits.h: round trips, exact lengths, and a sticky error at every cut. */
#include <string.h>

#include "core/bits.h"
#include "unity.h"

#define SEED 0x0b175u

void setUp(void) {}
void tearDown(void) {}

static uint32_t next_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 4;
}

static void fixed_width_bits_are_laid_out_most_significant_first(void)
{
    uint8_t buf[4] = {0xff, 0xff, 0xff, 0xff};
    oc_bit_writer_t writer;
    oc_bit_writer_init(&writer, buf, sizeof buf);
    oc_bits_put(&writer, 5, 3);
    oc_bits_put(&writer, 0x155, 9);
    oc_bits_put(&writer, 0, 0);
    oc_bits_put_align(&writer);
    TEST_ASSERT_FALSE(writer.has_failed);
    TEST_ASSERT_EQUAL_size_t(16, writer.n_bits);
    /* 101 1 0101 | 0101 0000, and bytes behind are untouched. */
    const uint8_t expected[4] = {0xb5, 0x50, 0xff, 0xff};
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, buf, 4);
}

static void a_full_writer_fails_and_stays_failed(void)
{
    uint8_t buf[2] = {0, 0};
    oc_bit_writer_t writer;
    oc_bit_writer_init(&writer, buf, 1);
    oc_bits_put(&writer, 0xff, 8);
    TEST_ASSERT_FALSE(writer.has_failed);
    oc_bits_put(&writer, 1, 1);
    TEST_ASSERT_TRUE(writer.has_failed);
    oc_bits_put(&writer, 0, 0);
    TEST_ASSERT_TRUE(writer.has_failed);
    TEST_ASSERT_EQUAL_HEX8(0, buf[1]);
}

static void a_writer_whose_room_was_lowered_below_its_place_fails(void)
{
    uint8_t buf[4];
    oc_bit_writer_t writer;
    oc_bit_writer_init(&writer, buf, sizeof buf);
    oc_bits_put(&writer, 0, 20);
    writer.cap_bits = 10;
    oc_bits_put(&writer, 0, 1);
    TEST_ASSERT_TRUE(writer.has_failed);
}

static void a_reader_past_its_end_returns_zero_and_stays_failed(void)
{
    const uint8_t buf[1] = {0xff};
    oc_bit_reader_t reader;
    oc_bit_reader_init(&reader, buf, 1);
    TEST_ASSERT_EQUAL_UINT32(0x7f, oc_bits_get(&reader, 7));
    TEST_ASSERT_EQUAL_UINT32(0, oc_bits_get(&reader, 2));
    TEST_ASSERT_TRUE(reader.has_failed);
    TEST_ASSERT_EQUAL_UINT32(0, oc_bits_get(&reader, 1));
}

static void padding_that_is_not_zero_fails(void)
{
    const uint8_t buf[2] = {0xe1, 0};
    oc_bit_reader_t reader;
    oc_bit_reader_init(&reader, buf, 2);
    (void)oc_bits_get(&reader, 3);
    oc_bits_get_align(&reader);
    TEST_ASSERT_TRUE(reader.has_failed);
}

static void uniform_codes_are_as_short_as_truncated_binary_allows(void)
{
    for (uint32_t n = 1; n <= 70; n++) {
        unsigned width = 0;
        while (2u << width <= n) {
            width++;
        }
        const uint32_t n_short = (2u << width) - n;
        for (uint32_t value = 0; value < n; value++) {
            uint8_t buf[2];
            oc_bit_writer_t writer;
            oc_bit_writer_init(&writer, buf, sizeof buf);
            oc_bits_put_uniform(&writer, value, n);
            TEST_ASSERT_EQUAL_size_t(value < n_short ? width : width + 1u, writer.n_bits);
            oc_bit_reader_t reader;
            oc_bit_reader_init(&reader, buf, sizeof buf);
            TEST_ASSERT_EQUAL_UINT32(value, oc_bits_get_uniform(&reader, n));
            TEST_ASSERT_EQUAL_size_t(writer.n_bits, reader.n_bits);
        }
    }
}

static void anything_read_as_uniform_is_below_its_bound(void)
{
    for (uint32_t n = 1; n <= 300; n++) {
        for (uint32_t bits = 0; bits < 512; bits++) {
            const uint8_t buf[2] = {(uint8_t)(bits >> 1), (uint8_t)(bits << 7)};
            oc_bit_reader_t reader;
            oc_bit_reader_init(&reader, buf, 2);
            TEST_ASSERT_TRUE(oc_bits_get_uniform(&reader, n) < n);
        }
    }
}

static void unary_stops_at_its_maximum(void)
{
    const uint8_t buf[2] = {0xfb, 0xff};
    oc_bit_reader_t reader;
    oc_bit_reader_init(&reader, buf, 2);
    TEST_ASSERT_EQUAL_UINT(4, oc_bits_get_unary(&reader, 4));
    TEST_ASSERT_EQUAL_UINT(1, oc_bits_get_unary(&reader, 4));
    TEST_ASSERT_EQUAL_size_t(6, reader.n_bits);
}

static void rice_length_is_what_is_written(void)
{
    static const uint32_t values[] = {0, 1, 7, 8, 100, 4095, 65535, 1u << 20, INT32_MAX, UINT32_MAX};
    for (unsigned k = 0; k <= OC_MAX_RICE; k++) {
        for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
            uint8_t buf[16];
            oc_bit_writer_t writer;
            oc_bit_writer_init(&writer, buf, sizeof buf);
            oc_bits_put_rice(&writer, values[i], k);
            TEST_ASSERT_EQUAL_size_t(oc_bits_rice_length(values[i], k), writer.n_bits);
            oc_bit_reader_t reader;
            oc_bit_reader_init(&reader, buf, sizeof buf);
            TEST_ASSERT_EQUAL_UINT32(values[i], oc_bits_get_rice(&reader, k));
        }
    }
}

static void golomb_codes_come_back_up_to_their_largest_value(void)
{
    static const uint32_t values[] = {0, 1, 2, 3, 62, 63, 64, 65535, 1u << 30, INT32_MAX};
    for (unsigned k = 0; k <= OC_MAX_RICE; k++) {
        for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
            uint8_t buf[16];
            oc_bit_writer_t writer;
            oc_bit_writer_init(&writer, buf, sizeof buf);
            oc_bits_put_golomb(&writer, values[i], k);
            oc_bit_reader_t reader;
            oc_bit_reader_init(&reader, buf, sizeof buf);
            TEST_ASSERT_EQUAL_UINT32(values[i], oc_bits_get_golomb(&reader, k));
            TEST_ASSERT_FALSE(reader.has_failed);
            TEST_ASSERT_EQUAL_size_t(writer.n_bits, reader.n_bits);
        }
    }
}

static void a_golomb_code_that_is_too_large_fails(void)
{
    uint8_t buf[16];
    memset(buf, 0xff, sizeof buf);
    for (unsigned k = 0; k <= OC_MAX_RICE; k++) {
        oc_bit_reader_t reader;
        oc_bit_reader_init(&reader, buf, sizeof buf);
        TEST_ASSERT_EQUAL_UINT32(0, oc_bits_get_golomb(&reader, k));
        TEST_ASSERT_TRUE(reader.has_failed);
    }
}

static void signed_values_map_to_small_codes_and_back(void)
{
    TEST_ASSERT_EQUAL_UINT32(0, oc_bits_from_signed(0));
    TEST_ASSERT_EQUAL_UINT32(1, oc_bits_from_signed(-1));
    TEST_ASSERT_EQUAL_UINT32(2, oc_bits_from_signed(1));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, oc_bits_from_signed(INT32_MIN));
    static const int32_t values[] = {0, 1, -1, 2, 1000, -1000, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < sizeof values / sizeof values[0]; i++) {
        TEST_ASSERT_EQUAL_INT32(values[i], oc_bits_to_signed(oc_bits_from_signed(values[i])));
    }
}

static void put_any(oc_bit_writer_t *writer, uint32_t kind, uint32_t value)
{
    const unsigned k = kind / 4u % (OC_MAX_RICE + 1u);
    if (kind % 4u == 0) oc_bits_put(writer, value & 0xffffu, 16);
    if (kind % 4u == 1) oc_bits_put_rice(writer, value, k);
    if (kind % 4u == 2) oc_bits_put_golomb(writer, value, k);
    if (kind % 4u == 3) oc_bits_put_uniform(writer, value % (k + 1u), k + 1u);
}

static uint32_t get_any(oc_bit_reader_t *reader, uint32_t kind, uint32_t value, uint32_t *expected)
{
    const unsigned k = kind / 4u % (OC_MAX_RICE + 1u);
    *expected = kind % 4u == 0 ? (value & 0xffffu) : kind % 4u == 3 ? value % (k + 1u) : value;
    if (kind % 4u == 0) return oc_bits_get(reader, 16);
    if (kind % 4u == 1) return oc_bits_get_rice(reader, k);
    if (kind % 4u == 2) return oc_bits_get_golomb(reader, k);
    return oc_bits_get_uniform(reader, k + 1u);
}

static void mixed_codes_come_back_and_every_cut_fails(void)
{
    uint8_t buf[2048];
    oc_bit_writer_t writer;
    oc_bit_writer_init(&writer, buf, sizeof buf);
    uint32_t state = SEED;
    for (int i = 0; i < 200; i++) {
        const uint32_t kind = next_random(&state);
        put_any(&writer, kind, next_random(&state) >> (kind >> 8) % 28u);
    }
    TEST_ASSERT_FALSE(writer.has_failed);
    for (size_t cut = 0; cut <= writer.n_bits; cut += cut + 64u < writer.n_bits ? 37u : 1u) {
        oc_bit_reader_t reader;
        oc_bit_reader_init(&reader, buf, sizeof buf);
        reader.cap_bits = cut;
        state = SEED;
        for (int i = 0; i < 200; i++) {
            const uint32_t kind = next_random(&state);
            uint32_t expected;
            const uint32_t value = get_any(&reader, kind, next_random(&state) >> (kind >> 8) % 28u, &expected);
            if (!reader.has_failed) TEST_ASSERT_EQUAL_UINT32_MESSAGE(expected, value, "seed 0x0b175");
        }
        TEST_ASSERT_EQUAL(cut < writer.n_bits, reader.has_failed);
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(fixed_width_bits_are_laid_out_most_significant_first);
    RUN_TEST(a_full_writer_fails_and_stays_failed);
    RUN_TEST(a_writer_whose_room_was_lowered_below_its_place_fails);
    RUN_TEST(a_reader_past_its_end_returns_zero_and_stays_failed);
    RUN_TEST(padding_that_is_not_zero_fails);
    RUN_TEST(uniform_codes_are_as_short_as_truncated_binary_allows);
    RUN_TEST(anything_read_as_uniform_is_below_its_bound);
    RUN_TEST(unary_stops_at_its_maximum);
    RUN_TEST(rice_length_is_what_is_written);
    RUN_TEST(golomb_codes_come_back_up_to_their_largest_value);
    RUN_TEST(a_golomb_code_that_is_too_large_fails);
    RUN_TEST(signed_values_map_to_small_codes_and_back);
    RUN_TEST(mixed_codes_come_back_and_every_cut_fails);
    return UNITY_END();
}
