/* SPDX-License-Identifier: BSD-3-Clause
 * The few vector operations that C has no word for, each with a plain form of the same result. For the kernels only. */
#ifndef OUTCROP_VEHICLE_SIMD_H
#define OUTCROP_VEHICLE_SIMD_H

#include <stdint.h>
#include <string.h>

#if defined(OC_KERNELS_SCALAR)
/* The twin uses none. */
#elif defined(__SSE2__)
#include <immintrin.h>
#elif defined(__ARM_NEON)
#include <arm_neon.h>
#endif

/* Vectors wider than the target's are passed between functions that are inlined, so no calling convention matters. */
#pragma GCC diagnostic ignored "-Wpsabi"

/* Four bitmap words: 64 pixels of four rows. GCC and clang turn the operators
 * into whatever the target has. */
typedef uint64_t oc_words_t __attribute__((vector_size(32)));

/* Eight samples, four bytes each; comparisons give 0 or -1. */
#define OC_LANES 8u
typedef float oc_lanes_t __attribute__((vector_size(4 * OC_LANES)));
typedef int32_t oc_ints_t __attribute__((vector_size(4 * OC_LANES)));
typedef uint32_t oc_uints_t __attribute__((vector_size(4 * OC_LANES)));

/* Where mask is -1 a, where it is 0 b. */
static inline oc_lanes_t oc_lanes_select(oc_ints_t mask, oc_lanes_t a, oc_lanes_t b)
{
#if defined(__AVX2__) && !defined(OC_KERNELS_SCALAR)
    return (oc_lanes_t)_mm256_blendv_ps((__m256)b, (__m256)a, (__m256)mask);
#else
    return (oc_lanes_t)((mask & (oc_ints_t)a) | (~mask & (oc_ints_t)b));
#endif
}

/* a < b ? a : b, and a > b ? a : b. */
static inline oc_lanes_t oc_lanes_min(oc_lanes_t a, oc_lanes_t b)
{
#if defined(__AVX2__) && !defined(OC_KERNELS_SCALAR)
    return (oc_lanes_t)_mm256_min_ps((__m256)a, (__m256)b);
#else
    return oc_lanes_select(a < b, a, b);
#endif
}

static inline oc_lanes_t oc_lanes_max(oc_lanes_t a, oc_lanes_t b)
{
#if defined(__AVX2__) && !defined(OC_KERNELS_SCALAR)
    return (oc_lanes_t)_mm256_max_ps((__m256)a, (__m256)b);
#else
    return oc_lanes_select(a > b, a, b);
#endif
}

/* x times the first of each pair of 16 bits (the low ones where bytes are little-endian) plus y times the second; the
 * sum must fit. */
static inline oc_ints_t oc_lanes_pair_sums(oc_ints_t pair, oc_ints_t by)
{
#if defined(__AVX2__) && !defined(OC_KERNELS_SCALAR)
    return (oc_ints_t)_mm256_madd_epi16((__m256i)pair, (__m256i)by);
#elif defined(__SSE2__) && !defined(OC_KERNELS_SCALAR)
    __m128i a[2], b[2];
    memcpy(a, &pair, sizeof a);
    memcpy(b, &by, sizeof b);
    for (int i = 0; i < 2; i++) a[i] = _mm_madd_epi16(a[i], b[i]);
    memcpy(&pair, a, sizeof a);
    return pair;
#else
    const oc_ints_t low = (oc_ints_t)((oc_uints_t)pair << 16) >> 16, by_low = (oc_ints_t)((oc_uints_t)by << 16) >> 16;
    return low * by_low + (pair >> 16) * (by >> 16);
#endif
}

static inline oc_ints_t oc_lanes_pair_sum(oc_ints_t pair, int32_t x, int32_t y)
{
    const oc_ints_t none = {0};
    return oc_lanes_pair_sums(pair, none + (int32_t)(((uint32_t)x & 0xffffu) | (uint32_t)y << 16));
}

/* The two halves added. */
typedef float oc_quad_t __attribute__((vector_size(16)));
static inline oc_quad_t oc_lanes_fold(oc_lanes_t v)
{
    return __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
}

/* Bit i = mask[i] is not zero. */
static inline uint32_t oc_bits_of_lanes(oc_ints_t mask)
{
#if defined(__AVX2__) && !defined(OC_KERNELS_SCALAR)
    return (uint32_t)_mm256_movemask_ps((__m256)mask);
#elif defined(__SSE2__) && !defined(OC_KERNELS_SCALAR)
    __m128 half[2];
    memcpy(half, &mask, sizeof half);
    return (uint32_t)_mm_movemask_ps(half[0]) | (uint32_t)_mm_movemask_ps(half[1]) << 4;
#else
    static const oc_ints_t weight = {1, 2, 4, 8, 16, 32, 64, 128};
    const oc_ints_t bits = mask & weight;
    return (uint32_t)(((bits[0] | bits[4]) | (bits[2] | bits[6])) | ((bits[1] | bits[5]) | (bits[3] | bits[7])));
#endif
}

static inline int oc_words_any(const oc_words_t *w)
{
#if defined(__AVX2__) && !defined(OC_KERNELS_SCALAR)
    return !_mm256_testz_si256((__m256i)*w, (__m256i)*w);
#else
    return (((*w)[0] | (*w)[1]) | ((*w)[2] | (*w)[3])) != 0;
#endif
}

/* Bit i = mask[i] is not zero; each mask[i] is 0 or -1. */
static inline uint64_t oc_bits_of_masks(const int16_t mask[64])
{
#if defined(__AVX2__) && !defined(OC_KERNELS_SCALAR)
    uint64_t bits = 0;
    for (int half = 0; half < 2; half++) {
        const __m256i a = _mm256_loadu_si256((const __m256i *)(const void *)(mask + 32 * half));
        const __m256i b = _mm256_loadu_si256((const __m256i *)(const void *)(mask + 32 * half + 16));
        const __m256i packed = _mm256_permute4x64_epi64(_mm256_packs_epi16(a, b), 0xd8);
        bits |= (uint64_t)(uint32_t)_mm256_movemask_epi8(packed) << (32 * half);
    }
    return bits;
#elif defined(__SSE2__) && !defined(OC_KERNELS_SCALAR)
    uint64_t bits = 0;
    for (int part = 0; part < 4; part++) {
        const __m128i a = _mm_loadu_si128((const __m128i *)(const void *)(mask + 16 * part));
        const __m128i b = _mm_loadu_si128((const __m128i *)(const void *)(mask + 16 * part + 8));
        bits |= (uint64_t)(uint32_t)_mm_movemask_epi8(_mm_packs_epi16(a, b)) << (16 * part);
    }
    return bits;
#elif defined(__ARM_NEON) && defined(__aarch64__) && !defined(OC_KERNELS_SCALAR)
    static const uint8_t weight[8] = {1, 2, 4, 8, 16, 32, 64, 128};
    const uint8x8_t weights = vld1_u8(weight);
    uint64_t bits = 0;
    for (int part = 0; part < 8; part++) {
        const uint8x8_t bytes = vmovn_u16(vreinterpretq_u16_s16(vld1q_s16(mask + 8 * part)));
        bits |= (uint64_t)vaddv_u8(vand_u8(bytes, weights)) << (8 * part);
    }
    return bits;
#else
    uint64_t bits = 0;
    for (int i = 0; i < 64; i++) bits |= (uint64_t)(mask[i] != 0) << i;
    return bits;
#endif
}

#endif
