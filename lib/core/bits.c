/* SPDX-License-Identifier: BSD-3-Clause
 * Bits in and out of a buffer: fixed width, truncated binary, unary, Rice and Exp-Golomb codes. */
#include "core/bits.h"

#include "core/status.h"

void oc_bit_writer_init(oc_bit_writer_t *writer, uint8_t *buf, size_t n_bytes)
{
    OC_ASSERT(writer && buf && n_bytes <= SIZE_MAX / 8u);
    *writer = (oc_bit_writer_t){.buf = buf, .cap_bits = n_bytes * 8u};
}

void oc_bit_reader_init(oc_bit_reader_t *reader, const uint8_t *buf, size_t n_bytes)
{
    OC_ASSERT(reader && buf && n_bytes <= SIZE_MAX / 8u);
    *reader = (oc_bit_reader_t){.buf = buf, .cap_bits = n_bytes * 8u};
}

/* cap_bits may have been lowered below n_bits, so compare before subtracting. */
static bool has_room(size_t cap_bits, size_t n_bits, unsigned width)
{
    return n_bits <= cap_bits && width <= cap_bits - n_bits;
}

static unsigned smaller(unsigned a, unsigned b)
{
    return a < b ? a : b;
}

void oc_bits_put(oc_bit_writer_t *writer, uint32_t value, unsigned width)
{
    OC_ASSERT(width <= 32u && (width == 32u || value >> width == 0));

    if (writer->has_failed || !has_room(writer->cap_bits, writer->n_bits, width)) {
        writer->has_failed = true;
        return;
    }
    while (width > 0) {
        const unsigned used = (unsigned)(writer->n_bits % 8u);
        const unsigned n = smaller(8u - used, width);
        const unsigned shift = 8u - used - n;
        const uint32_t mask = (1u << n) - 1u;
        const uint32_t piece = (value >> (width - n)) & mask;
        uint8_t *byte = &writer->buf[writer->n_bits / 8u];
        *byte = (uint8_t)((*byte & ~(mask << shift)) | (piece << shift));
        writer->n_bits += n;
        width -= n;
    }
}

uint32_t oc_bits_get(oc_bit_reader_t *reader, unsigned width)
{
    OC_ASSERT(width <= 32u);

    if (reader->has_failed || !has_room(reader->cap_bits, reader->n_bits, width)) {
        reader->has_failed = true;
        return 0;
    }
    uint32_t value = 0;
    while (width > 0) {
        const unsigned used = (unsigned)(reader->n_bits % 8u);
        const unsigned n = smaller(8u - used, width);
        const uint32_t byte = reader->buf[reader->n_bits / 8u];
        value = (value << n) | ((byte >> (8u - used - n)) & ((1u << n) - 1u));
        reader->n_bits += n;
        width -= n;
    }
    return value;
}

static unsigned floor_log2(uint32_t value)
{
    unsigned log = 0;
    while (value >>= 1) {
        log++;
    }
    return log;
}

void oc_bits_put_uniform(oc_bit_writer_t *writer, uint32_t value, uint32_t n)
{
    OC_ASSERT(n >= 1u && n <= 1u << 30 && value < n);
    const unsigned width = floor_log2(n);
    const uint32_t n_short = (2u << width) - n;
    if (value < n_short) {
        oc_bits_put(writer, value, width);
        return;
    }
    oc_bits_put(writer, value + n_short, width + 1u);
}

uint32_t oc_bits_get_uniform(oc_bit_reader_t *reader, uint32_t n)
{
    OC_ASSERT(n >= 1u && n <= 1u << 30);
    const unsigned width = floor_log2(n);
    const uint32_t n_short = (2u << width) - n;
    const uint32_t value = oc_bits_get(reader, width);
    if (value < n_short) return value;
    return ((value << 1) | oc_bits_get(reader, 1)) - n_short;
}

void oc_bits_put_unary(oc_bit_writer_t *writer, unsigned value, unsigned max)
{
    OC_ASSERT(value <= max);
    for (unsigned i = 0; i < value; i++) {
        oc_bits_put(writer, 1, 1);
    }
    if (value < max) oc_bits_put(writer, 0, 1);
}

unsigned oc_bits_get_unary(oc_bit_reader_t *reader, unsigned max)
{
    unsigned value = 0;
    while (value < max && oc_bits_get(reader, 1) == 1) {
        value++;
    }
    return value;
}

void oc_bits_put_rice(oc_bit_writer_t *writer, uint32_t value, unsigned k)
{
    OC_ASSERT(k <= OC_MAX_RICE);
    if (value >> k >= OC_RICE_ESCAPE) {
        oc_bits_put_unary(writer, OC_RICE_ESCAPE, OC_RICE_ESCAPE);
        oc_bits_put(writer, value, 32);
        return;
    }
    oc_bits_put_unary(writer, value >> k, OC_RICE_ESCAPE);
    oc_bits_put(writer, value & ((1u << k) - 1u), k);
}

uint32_t oc_bits_get_rice(oc_bit_reader_t *reader, unsigned k)
{
    OC_ASSERT(k <= OC_MAX_RICE);
    const uint32_t high = oc_bits_get_unary(reader, OC_RICE_ESCAPE);
    if (high == OC_RICE_ESCAPE) return oc_bits_get(reader, 32);
    return (high << k) | oc_bits_get(reader, k);
}

unsigned oc_bits_rice_length(uint32_t value, unsigned k)
{
    OC_ASSERT(k <= OC_MAX_RICE);
    const uint32_t high = value >> k;
    return high >= OC_RICE_ESCAPE ? OC_RICE_ESCAPE + 32u : (unsigned)high + 1u + k;
}

void oc_bits_put_golomb(oc_bit_writer_t *writer, uint32_t value, unsigned k)
{
    OC_ASSERT(k <= OC_MAX_RICE && value <= INT32_MAX);
    const uint32_t shifted = value + (1u << k);
    const unsigned width = floor_log2(shifted);
    oc_bits_put_unary(writer, width - k, 32);
    oc_bits_put(writer, shifted & ((1u << width) - 1u), width);
}

uint32_t oc_bits_get_golomb(oc_bit_reader_t *reader, unsigned k)
{
    OC_ASSERT(k <= OC_MAX_RICE);
    const unsigned extra = oc_bits_get_unary(reader, 32);
    if (extra > 31u - k) {
        reader->has_failed = true;
        return 0;
    }
    const unsigned width = extra + k;
    const uint32_t value = ((1u << width) | oc_bits_get(reader, width)) - (1u << k);
    if (reader->has_failed || value > INT32_MAX) {
        reader->has_failed = true;
        return 0;
    }
    return value;
}

uint32_t oc_bits_from_signed(int32_t value)
{
    return value >= 0 ? (uint32_t)value << 1 : ((uint32_t) - (value + 1) << 1) | 1u;
}

int32_t oc_bits_to_signed(uint32_t code)
{
    const int32_t half = (int32_t)(code >> 1);
    return (code & 1u) ? -half - 1 : half;
}

void oc_bits_put_align(oc_bit_writer_t *writer)
{
    oc_bits_put(writer, 0, (unsigned)((8u - writer->n_bits % 8u) % 8u));
}

void oc_bits_get_align(oc_bit_reader_t *reader)
{
    if (oc_bits_get(reader, (unsigned)((8u - reader->n_bits % 8u) % 8u)) != 0) reader->has_failed = true;
}
