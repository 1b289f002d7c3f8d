/* SPDX-License-Identifier: BSD-3-Clause
 * Bits in and out of the caller's buffer, most significant bit first, with a sticky error.
 *
 * A writer or reader that has run out of room stays failed: every later call
 * does nothing (a get returns 0), so a packet is checked once, at its end.
 * Both are plain values: copying one marks a place to come back to. */
#ifndef OUTCROP_CORE_BITS_H
#define OUTCROP_CORE_BITS_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Largest parameter of a Rice or Exp-Golomb code. */
#define OC_MAX_RICE 15u

/* Ones after which a Rice code gives up counting and writes 32 raw bits. */
#define OC_RICE_ESCAPE 24u

typedef struct oc_bit_writer {
    uint8_t *buf;
    size_t cap_bits; /* room; may be lowered and raised between calls */
    size_t n_bits;   /* written */
    bool has_failed;
} oc_bit_writer_t;

typedef struct oc_bit_reader {
    const uint8_t *buf;
    size_t cap_bits; /* there are */
    size_t n_bits;   /* read */
    bool has_failed;
} oc_bit_reader_t;

void oc_bit_writer_init(oc_bit_writer_t *writer, uint8_t *buf, size_t n_bytes);
void oc_bit_reader_init(oc_bit_reader_t *reader, const uint8_t *buf, size_t n_bytes);

/* The low `width` bits of value, width 0..32; value must fit. */
void oc_bits_put(oc_bit_writer_t *writer, uint32_t value, unsigned width);
uint32_t oc_bits_get(oc_bit_reader_t *reader, unsigned width);

/* Truncated binary code of value in [0, n), n >= 1: floor(log2 n) bits for the
 * first 2^(floor(log2 n) + 1) - n values, one more for the others. What is read
 * is always below n. */
void oc_bits_put_uniform(oc_bit_writer_t *writer, uint32_t value, uint32_t n);
uint32_t oc_bits_get_uniform(oc_bit_reader_t *reader, uint32_t n);

/* value ones and a zero; no zero when value == max. What is read is at most max. */
void oc_bits_put_unary(oc_bit_writer_t *writer, unsigned value, unsigned max);
unsigned oc_bits_get_unary(oc_bit_reader_t *reader, unsigned max);

/* Rice code with parameter k in 0..OC_MAX_RICE: value >> k in unary, then its
 * low k bits; from OC_RICE_ESCAPE ones on, 32 raw bits instead. */
void oc_bits_put_rice(oc_bit_writer_t *writer, uint32_t value, unsigned k);
uint32_t oc_bits_get_rice(oc_bit_reader_t *reader, unsigned k);
/* Its length in bits. */
unsigned oc_bits_rice_length(uint32_t value, unsigned k);

/* Exp-Golomb code of order k in 0..OC_MAX_RICE; value <= 2^31 - 1. A reader
 * fails on anything larger. */
void oc_bits_put_golomb(oc_bit_writer_t *writer, uint32_t value, unsigned k);
uint32_t oc_bits_get_golomb(oc_bit_reader_t *reader, unsigned k);

/* 0, -1, 1, -2, 2 ... <-> 0, 1, 2, 3, 4 ... */
uint32_t oc_bits_from_signed(int32_t value);
int32_t oc_bits_to_signed(uint32_t code);

/* Zeros up to the next whole byte. A reader fails when they are not zero. */
void oc_bits_put_align(oc_bit_writer_t *writer);
void oc_bits_get_align(oc_bit_reader_t *reader);

#ifdef __cplusplus
}
#endif
#endif
