/* SPDX-License-Identifier: BSD-3-Clause
 * Which branches of a junction are one straight edge, and what that says of its kind. */
#include "unity.h"

#include <stdio.h>

#include "core/junction.h"

#define PI 3.14159265f
#define DEG (PI / 180.0f)

void setUp(void) {}

void tearDown(void) {}

/* Branches at angles in degrees, all the same otherwise. */
static uint8_t straight_of(const float angle_deg[], unsigned n)
{
    oc_branch_t branch[OC_MAX_BRANCHES] = {{0}};
    for (unsigned i = 0; i < n; i++) branch[i] = (oc_branch_t){angle_deg[i] * DEG, 10.0f, 1.0f};
    return oc_junction_straight_branches(branch, n);
}

static void the_bar_of_a_t_is_marked_and_its_stem_is_not(void)
{
    TEST_ASSERT_EQUAL_HEX8(0x05, straight_of((float[]){0, 90, 180}, 3));
    TEST_ASSERT_EQUAL_HEX8(0x06, straight_of((float[]){40, 100, 285}, 3));
    TEST_ASSERT_EQUAL_HEX8(0x03, straight_of((float[]){5, 186, 300}, 3));
    TEST_ASSERT_EQUAL_HEX8(0x05, straight_of((float[]){3, 60, 183}, 3));
}

static void corners_without_a_straight_edge_have_no_mark(void)
{
    TEST_ASSERT_EQUAL_HEX8(0, straight_of(NULL, 0));
    TEST_ASSERT_EQUAL_HEX8(0, straight_of((float[]){10}, 1));
    TEST_ASSERT_EQUAL_HEX8(0, straight_of((float[]){10, 100}, 2));
    TEST_ASSERT_EQUAL_HEX8(0, straight_of((float[]){0, 120, 240}, 3));
    TEST_ASSERT_EQUAL_HEX8(0, straight_of((float[]){1, 2, 3, 359}, 4)); /* near to each other across zero */
}

static void both_pairs_of_an_x_are_marked(void)
{
    TEST_ASSERT_EQUAL_HEX8(0x0f, straight_of((float[]){10, 95, 190, 275}, 4));
    TEST_ASSERT_EQUAL_HEX8(0x05, straight_of((float[]){10, 95, 190, 300}, 4)); /* only one edge goes through */
    TEST_ASSERT_EQUAL_HEX8(0x3f, straight_of((float[]){0, 60, 120, 180, 240, 300}, 6));
}

static void a_branch_may_have_two_partners(void)
{
    TEST_ASSERT_EQUAL_HEX8(0x07, straight_of((float[]){0, 171, 189}, 3));
}

static void the_tolerance_is_twelve_degrees_on_both_sides(void)
{
    for (int first = 0; first < 360; first += 7) {
        for (int off = -20; off <= 20; off++) {
            const float second = (float)((first + 180 + off + 360) % 360);
            const uint8_t expected = off >= -12 && off <= 12 ? 0x03 : 0;
            if (off == 12 || off == -12) continue; /* rounding decides */
            char text[64];
            (void)snprintf(text, sizeof text, "%d and %d degrees off straight", first, off);
            TEST_ASSERT_EQUAL_HEX8_MESSAGE(expected, straight_of((float[]){(float)first, second}, 2), text);
            TEST_ASSERT_EQUAL_HEX8_MESSAGE(expected, straight_of((float[]){second, (float)first}, 2), text);
        }
    }
}

static void a_t_is_what_has_a_mark_and_three_branches(void)
{
    for (int a = 0; a < 360; a += 5) {
        for (int b = a + 5; b < 360; b += 5) {
            const oc_branch_t branch[3] = {
                {.angle_rad = 0.0f}, {.angle_rad = (float)a * DEG}, {.angle_rad = (float)b * DEG}};
            const oc_junction_kind_t expected = oc_junction_straight_branches(branch, 3) ? OC_KIND_T : OC_KIND_Y;
            TEST_ASSERT_EQUAL(expected, oc_junction_kind_of(branch, 3));
        }
    }
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_bar_of_a_t_is_marked_and_its_stem_is_not);
    RUN_TEST(corners_without_a_straight_edge_have_no_mark);
    RUN_TEST(both_pairs_of_an_x_are_marked);
    RUN_TEST(a_branch_may_have_two_partners);
    RUN_TEST(the_tolerance_is_twelve_degrees_on_both_sides);
    RUN_TEST(a_t_is_what_has_a_mark_and_three_branches);
    return UNITY_END();
}
