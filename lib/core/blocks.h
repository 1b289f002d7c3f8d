/* SPDX-License-Identifier: BSD-3-Clause
 * Codec of 8x8 grey blocks: integer cosine transform, one quality, Golomb codes that adapt within a packet.
 *
 * Everything is integer arithmetic, so every machine decodes the same pixels;
 * they define the block for both ends. Blocks of one packet are coded in
 * ascending order with one oc_block_coder_t, which both ends step alike. The
 * bits: docs/protocol.md. */
#ifndef OUTCROP_CORE_BLOCKS_H
#define OUTCROP_CORE_BLOCKS_H

#include <stdint.h>

#include "core/bits.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OC_BLOCK_SAMPLES 64u

/* Qualities: 1 is coarse (step 128 grey levels), 31 fine (step 2); five make a factor of two. */
#define OC_MIN_BLOCK_QUALITY 1u
#define OC_MAX_BLOCK_QUALITY 31u

/* A symbol whose Exp-Golomb order follows the mean of what came before. */
typedef struct oc_adaptive {
    uint32_t sum; /* 16 times a running mean */
} oc_adaptive_t;

typedef struct oc_block_coder {
    int32_t step[OC_BLOCK_SAMPLES]; /* 1/16 grey level, raster order of the frequencies */
    oc_adaptive_t dc, count, run[2], level[3];
} oc_block_coder_t;

/* quality in OC_MIN_BLOCK_QUALITY..OC_MAX_BLOCK_QUALITY. */
void oc_block_coder_init(oc_block_coder_t *coder, unsigned quality);

/* Code one block of 64 pixels, raster order.
 *
 * dc_predicted  mean level that the neighbours suggest, in the unit of dc_level
 * dc_level      out: this block's own, for predicting the next ones; 0 is mid grey
 *
 * Returns nothing: a full buffer shows in the writer. */
void oc_block_encode(oc_block_coder_t *coder, oc_bit_writer_t *writer, const uint8_t px[OC_BLOCK_SAMPLES],
                     int32_t dc_predicted, int32_t *dc_level);

/* The inverse. Pixels and dc_level mean nothing when the reader has failed,
 * which it also does on levels that no encoder writes. */
void oc_block_decode(oc_block_coder_t *coder, oc_bit_reader_t *reader, uint8_t px[OC_BLOCK_SAMPLES],
                     int32_t dc_predicted, int32_t *dc_level);

/* Pixels of block (bx, by) of a grey image; outside the image its edge is repeated. */
void oc_block_cut(const oc_image_t *grey, uint32_t bx, uint32_t by, uint8_t px[OC_BLOCK_SAMPLES]);

#ifdef __cplusplus
}
#endif
#endif
