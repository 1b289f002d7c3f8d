/* SPDX-License-Identifier: BSD-3-Clause
 * Bump allocator over one block that the caller owns; nothing is ever freed. */
#ifndef OUTCROP_VEHICLE_ARENA_H
#define OUTCROP_VEHICLE_ARENA_H

#include <stddef.h>
#include <stdint.h>

#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Every piece starts on a multiple of this many bytes (a cache line). */
#define OC_ARENA_ALIGN 64u

/* Set up by oc_arena_init; read `used` to see how much of a block was needed. */
typedef struct oc_arena {
    uint8_t *base; /* aligned start inside the caller's block */
    size_t size;   /* bytes from base to the end of the block */
    size_t used;   /* bytes taken so far, padding included; <= size */
} oc_arena_t;

/* Bytes that one oc_arena_take(bytes) consumes; add these up to size a block,
 * and add OC_ARENA_ALIGN once for a block of unknown alignment. Saturates at
 * SIZE_MAX, so an absurd request stays absurd. */
size_t oc_arena_cost(size_t bytes);

/* Let the arena hand out pieces of block[0 .. size_bytes).
 *
 * The block is not touched and must outlive every piece. Returns OC_E_SPACE
 * when it is too small to hold one aligned byte; the arena is then empty and
 * every take fails. */
OC_CHECKED oc_status_t oc_arena_init(oc_arena_t *arena, void *block, size_t size_bytes);

/* Take `bytes` bytes, aligned to OC_ARENA_ALIGN and set to zero.
 *
 * *piece is set on success only. bytes = 0 is legal and yields a valid
 * pointer that must not be read. OC_E_SPACE when the rest is too small; the
 * arena is then unchanged. */
OC_CHECKED oc_status_t oc_arena_take(oc_arena_t *arena, size_t bytes, void **piece);

#ifdef __cplusplus
}
#endif
#endif
