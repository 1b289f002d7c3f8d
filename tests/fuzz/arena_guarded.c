/* SPDX-License-Identifier: BSD-3-Clause
 * lib/vehicle/arena.c for the fuzzers: a red zone after every piece, so that the address sanitizer sees a step out of
 * one, which in the real arena would land in its neighbour. Linked in front of the library. */
#include <string.h>

#include "vehicle/arena.h"

#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define IS_GUARDED 1
#endif
#endif
#ifdef __SANITIZE_ADDRESS__
#define IS_GUARDED 1
#endif

#define RED_ZONE_BYTES 128u

#ifdef IS_GUARDED
extern void __asan_poison_memory_region(void const volatile *start, size_t n_bytes);
extern void __asan_unpoison_memory_region(void const volatile *start, size_t n_bytes);
#else
static void __asan_poison_memory_region(void const volatile *start, size_t n_bytes)
{
    (void)start;
    (void)n_bytes;
}

static void __asan_unpoison_memory_region(void const volatile *start, size_t n_bytes)
{
    (void)start;
    (void)n_bytes;
}
#endif

size_t oc_arena_cost(size_t bytes)
{
    const size_t most = SIZE_MAX - RED_ZONE_BYTES - OC_ARENA_ALIGN;
    return bytes > most ? SIZE_MAX : (bytes + RED_ZONE_BYTES + OC_ARENA_ALIGN - 1u) / OC_ARENA_ALIGN * OC_ARENA_ALIGN;
}

oc_status_t oc_arena_init(oc_arena_t *arena, void *block, size_t size_bytes)
{
    const size_t misfit = (size_t)((uintptr_t)block % OC_ARENA_ALIGN);
    const size_t skip = misfit == 0 ? 0 : OC_ARENA_ALIGN - misfit;
    *arena = (oc_arena_t){NULL, 0, 0};
    if (!block || size_bytes <= skip) return OC_E_SPACE;
    arena->base = (uint8_t *)block + skip;
    arena->size = size_bytes - skip;
    return OC_OK;
}

oc_status_t oc_arena_take(oc_arena_t *arena, size_t bytes, void **piece)
{
    if (!arena->base || bytes > arena->size - arena->used) return OC_E_SPACE;
    const size_t left = arena->size - arena->used, cost = oc_arena_cost(bytes);
    uint8_t *start = arena->base + arena->used;
    const size_t taken = cost > left ? left : cost;
    __asan_unpoison_memory_region(start, taken); /* the block may have served before */
    memset(start, 0, bytes);
    __asan_poison_memory_region(start + bytes, taken - bytes);
    arena->used += taken;
    *piece = start;
    return OC_OK;
}
