/* SPDX-License-Identifier: BSD-3-Clause
 * What libgpiod's seam says of lines that cannot be had. Lines that can are in the virtual machine's tests. */
#include "unity.h"

#include <stdio.h>
#include <string.h>

#include "gpio_line.h"

void setUp(void) {}

void tearDown(void) {}

static void refused(const oc_gpio_name_t *name, const char *what)
{
    char error[256] = "";
    TEST_ASSERT_NULL(oc_gpio_libgpiod.open_output("trigger", name, false, error, sizeof error));
    TEST_ASSERT_EQUAL_MESSAGE(0, strncmp(error, "gpio trigger: line ", 19), error);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, what), error);
    TEST_ASSERT_NULL_MESSAGE(strchr(error, '\n'), error);
    TEST_ASSERT_NULL(oc_gpio_libgpiod.open_input("mark", name, error, sizeof error));
    TEST_ASSERT_EQUAL_MESSAGE(0, strncmp(error, "gpio mark: line ", 16), error);
}

static void a_line_that_is_not_there_is_named(void)
{
    refused(&(oc_gpio_name_t){.line = "no-such-line-anywhere"}, "\"no-such-line-anywhere\"");
    refused(&(oc_gpio_name_t){.chip = "no-such-chip", .offset = 7},
            "line 7 of no-such-chip: the chip cannot be opened");
    refused(&(oc_gpio_name_t){.chip = "/dev/null", .offset = 0}, "/dev/null: the chip cannot be opened");
    char longest[OC_GPIO_NAME_BYTES];
    memset(longest, 'x', sizeof longest);
    longest[sizeof longest - 1] = '\0';
    oc_gpio_name_t name = {.is_used = true};
    memcpy(name.line, longest, sizeof longest);
    refused(&name, longest);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_line_that_is_not_there_is_named);
    return UNITY_END();
}
