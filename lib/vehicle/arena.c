/* SPDX-License-Identifier: BSD-3-Clause
 * Bump allocator over one block that the caller owns. */
#include "vehicle/arena.h"

#include <string.h>

size_t oc_arena_cost(size_t bytes)
{
    const size_t rest = bytes % OC_ARENA_ALIGN;
    if (rest == 0) return bytes;

    const size_t pad = OC_ARENA_ALIGN - rest;
    return bytes > SIZE_MAX - pad ? SIZE_MAX : bytes + pad;
}

oc_status_t oc_arena_init(oc_arena_t *arena, void *block, size_t size_bytes)
{
    OC_ASSERT(arena && (block || size_bytes == 0));

    *arena = (oc_arena_t){NULL, 0, 0};
    if (!block) return OC_E_SPACE;

    const size_t misfit = (size_t)((uintptr_t)block % OC_ARENA_ALIGN);
    const size_t skip = misfit == 0 ? 0 : OC_ARENA_ALIGN - misfit;
    if (size_bytes <= skip) return OC_E_SPACE;

    arena->base = (uint8_t *)block + skip;
    arena->size = size_bytes - skip;
    return OC_OK;
}

oc_status_t oc_arena_take(oc_arena_t *arena, size_t bytes, void **piece)
{
    OC_ASSERT(arena && piece);

    if (!arena->base) return OC_E_SPACE;
    const size_t left = arena->size - arena->used;
    if (bytes > left) return OC_E_SPACE;

    /* The last piece may end the block without its padding. */
    const size_t cost = oc_arena_cost(bytes);
    uint8_t *start = arena->base + arena->used;
    memset(start, 0, bytes);
    arena->used += cost > left ? left : cost;
    *piece = start;
    return OC_OK;
}
