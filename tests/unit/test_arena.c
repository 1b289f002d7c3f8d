/* SPDX-License-Identifier: BSD-3-Clause
 * The arena hands out aligned, cleared, disjoint pieces and never more than it has. */
#include "unity.h"

#include <stdint.h>
#include <string.h>

#include "vehicle/arena.h"

static _Alignas(OC_ARENA_ALIGN) uint8_t block[1024];

void setUp(void)
{
    memset(block, 0xA5, sizeof block);
}

void tearDown(void) {}

static void pieces_are_aligned_cleared_and_disjoint(void)
{
    for (size_t skew = 0; skew < OC_ARENA_ALIGN; skew += 7) {
        memset(block, 0xA5, sizeof block);
        oc_arena_t arena;
        TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, block + skew, sizeof block - skew));
        void *a = NULL, *b = NULL;
        TEST_ASSERT_EQUAL(OC_OK, oc_arena_take(&arena, 65, &a));
        TEST_ASSERT_EQUAL(OC_OK, oc_arena_take(&arena, 1, &b));
        TEST_ASSERT_EQUAL_UINT(0, (uintptr_t)a % OC_ARENA_ALIGN);
        TEST_ASSERT_EQUAL_UINT(0, (uintptr_t)b % OC_ARENA_ALIGN);
        TEST_ASSERT_EQUAL_PTR((uint8_t *)a + 128, b);
        TEST_ASSERT_EACH_EQUAL_UINT8(0, a, 65);
        TEST_ASSERT_EQUAL_UINT8(0xA5, ((uint8_t *)a)[65]);
    }
}

static void a_sum_of_costs_is_exactly_enough(void)
{
    const size_t need = oc_arena_cost(1) + oc_arena_cost(64) + oc_arena_cost(100);
    TEST_ASSERT_EQUAL_size_t(64 + 64 + 128, need);
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, block, need));
    void *piece;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_take(&arena, 1, &piece));
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_take(&arena, 64, &piece));
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_take(&arena, 100, &piece));
    TEST_ASSERT_EQUAL_size_t(need, arena.used);
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_arena_take(&arena, 1, &piece));
}

static void too_much_is_refused_and_changes_nothing(void)
{
    oc_arena_t arena;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, block, 256));
    void *piece = block;
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_arena_take(&arena, 257, &piece));
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_arena_take(&arena, SIZE_MAX, &piece));
    TEST_ASSERT_EQUAL_PTR(block, piece);
    TEST_ASSERT_EQUAL_size_t(0, arena.used);
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_take(&arena, 256, &piece));
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_arena_take(&arena, 1, &piece));
}

static void the_last_piece_may_end_without_padding(void)
{
    oc_arena_t arena;
    void *piece;
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_init(&arena, block, 70));
    TEST_ASSERT_EQUAL(OC_OK, oc_arena_take(&arena, 70, &piece));
    TEST_ASSERT_EQUAL_size_t(70, arena.used);
    TEST_ASSERT_EQUAL_UINT8(0xA5, block[70]);
}

static void no_block_or_a_tiny_one_gives_an_empty_arena(void)
{
    oc_arena_t arena;
    void *piece = NULL;
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_arena_init(&arena, NULL, 0));
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_arena_take(&arena, 0, &piece));
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_arena_init(&arena, block + 1, OC_ARENA_ALIGN - 1));
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_arena_take(&arena, 1, &piece));
    TEST_ASSERT_NULL(piece);
}

static void costs_saturate_instead_of_wrapping(void)
{
    TEST_ASSERT_EQUAL_size_t(0, oc_arena_cost(0));
    TEST_ASSERT_EQUAL_size_t(SIZE_MAX, oc_arena_cost(SIZE_MAX));
    TEST_ASSERT_EQUAL_size_t(SIZE_MAX, oc_arena_cost(SIZE_MAX - 1));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(pieces_are_aligned_cleared_and_disjoint);
    RUN_TEST(a_sum_of_costs_is_exactly_enough);
    RUN_TEST(too_much_is_refused_and_changes_nothing);
    RUN_TEST(the_last_piece_may_end_without_padding);
    RUN_TEST(no_block_or_a_tiny_one_gives_an_empty_arena);
    RUN_TEST(costs_saturate_instead_of_wrapping);
    return UNITY_END();
}
