/* SPDX-License-Identifier: BSD-3-Clause
 * Angles against the C library's in double precision, and against bits that every machine must give. */
#include "unity.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "core/angle.h"

void setUp(void) {}

void tearDown(void) {}

static uint32_t state = 1u;

/* In (-21.5, 21.5), often small. */
static float next_float(void)
{
    state = state * 1664525u + 1013904223u;
    const float value = (float)(int32_t)state / 1e8f;
    state = state * 1664525u + 1013904223u;
    return state >> 28 == 0u ? value * 1e-6f : value;
}

static void directions_agree_with_atan2(void)
{
    for (int i = 0; i < 300000; i++) {
        const float y = next_float(), x = next_float();
        const double expected = atan2((double)y, (double)x);
        const double step = fmax(fabs(expected), 1e-30) * 1.2e-7; /* one unit in the last place of a float */
        TEST_ASSERT_DOUBLE_WITHIN(step, expected, (double)oc_angle_of(y, x));
    }
}

static void directions_along_the_axes_are_exact(void)
{
    const float pi = 3.14159265358979f;
    TEST_ASSERT_TRUE(oc_angle_of(0.0f, 0.0f) == 0.0f);
    TEST_ASSERT_TRUE(oc_angle_of(0.0f, 3.0f) == 0.0f);
    TEST_ASSERT_TRUE(oc_angle_of(2.0f, 0.0f) == 0.5f * pi);
    TEST_ASSERT_TRUE(oc_angle_of(-2.0f, 0.0f) == -0.5f * pi);
    TEST_ASSERT_TRUE(oc_angle_of(0.0f, -1.0f) == pi);
    TEST_ASSERT_TRUE(oc_angle_of(5.0f, 5.0f) == 0.25f * pi);
    TEST_ASSERT_TRUE(oc_angle_of(-5.0f, -5.0f) == -0.75f * pi);
    TEST_ASSERT_TRUE(oc_angle_of(1e-40f, 1.0f) == 1e-40f);
    TEST_ASSERT_TRUE(isnan(oc_angle_of(NAN, 1.0f)) && isnan(oc_angle_of(1.0f, NAN)));
}

static void cosines_agree_with_cos(void)
{
    for (int i = -70000; i <= 70000; i++) {
        const float a = (float)i * 1e-4f;
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, cos((double)a), (double)oc_angle_cos(a));
    }
    TEST_ASSERT_TRUE(oc_angle_cos(0.0f) == 1.0f);
    TEST_ASSERT_TRUE(isnan(oc_angle_cos(NAN)) && isnan(oc_angle_cos(7.5f)));
}

static uint64_t add(uint64_t digest, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return (digest ^ bits) * 1099511628211u;
}

/* Whatever machine this runs on. */
static void the_bits_are_the_same_everywhere(void)
{
    uint64_t digest = 1u;
    state = 7u;
    for (int i = 0; i < 300000; i++) {
        const float y = next_float(), x = next_float();
        digest = add(digest, oc_angle_of(y, x));
        digest = add(digest, oc_angle_cos(0.3f * x));
    }
    TEST_ASSERT_EQUAL_HEX64(0x2a9721b3d658afeau, digest);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(directions_agree_with_atan2);
    RUN_TEST(directions_along_the_axes_are_exact);
    RUN_TEST(cosines_agree_with_cos);
    RUN_TEST(the_bits_are_the_same_everywhere);
    return UNITY_END();
}
