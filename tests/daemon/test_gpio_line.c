/* SPDX-License-Identifier: BSD-3-Clause
 * What libgpiod's lines say where there is no such chip or line: one line that names the use and the line. */
#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "gpio_line.h"

/* Bytes behind the message must stay as they were. */
static char error[512];

void setUp(void)
{
    memset(error, '#', sizeof error);
}

void tearDown(void) {}

static void expect_refusal(const oc_gpio_name_t *name, size_t error_bytes, bool is_output)
{
    memset(error, '#', sizeof error);
    const oc_gpio_line_t *line = is_output ? oc_gpio_libgpiod.open_output("strobe", name, false, error, error_bytes)
                                           : oc_gpio_libgpiod.open_input("strobe", name, error, error_bytes);
    TEST_ASSERT_NULL(line);
    TEST_ASSERT_TRUE(strnlen(error, error_bytes) < error_bytes);
    TEST_ASSERT_EQUAL('#', error[error_bytes]);
    TEST_ASSERT_NULL(strchr(error, '\n'));
}

static void a_name_that_no_chip_has(void)
{
    const oc_gpio_name_t name = {.is_used = true, .line = "no-such-line-anywhere"};
    for (int is_output = 0; is_output < 2; is_output++) {
        expect_refusal(&name, 256, is_output);
        TEST_ASSERT_EQUAL_STRING_LEN("gpio strobe: line \"no-such-line-anywhere\": ", error, 43);
        TEST_ASSERT_TRUE(strlen(error) > 50);
    }
}

static void a_chip_that_is_not_there(void)
{
    static const char *const chips[] = {
        "gpiochip250", "/dev/gpiochip250", "no chip has this label", "/dev/null", "/nonexistent/x", "12345", ""};
    for (size_t i = 0; i < sizeof chips / sizeof *chips; i++) {
        oc_gpio_name_t name = {.is_used = true, .offset = 4000000000u};
        snprintf(name.chip, sizeof name.chip, "%s", chips[i]);
        for (int is_output = 0; is_output < 2; is_output++) {
            expect_refusal(&name, 256, is_output);
            char begin[128];
            snprintf(begin, sizeof begin, "gpio strobe: line 4000000000 of %s: ", chips[i]);
            TEST_ASSERT_EQUAL_STRING_LEN(begin, error, strlen(begin));
            TEST_ASSERT_TRUE_MESSAGE(strlen(error) > strlen(begin) + 8, error);
            TEST_ASSERT_NULL_MESSAGE(strstr(error, "Success"), error);
        }
    }
}

static void the_longest_names_and_the_shortest_buffers(void)
{
    oc_gpio_name_t name = {.is_used = true};
    memset(name.chip, 'c', sizeof name.chip - 1);
    for (size_t n = 1; n < 300; n++) expect_refusal(&name, n, n % 2 == 0);
    memset(name.line, 'l', sizeof name.line - 1);
    for (size_t n = 1; n < 300; n++) expect_refusal(&name, n, n % 2 == 0);
    TEST_ASSERT_NOT_NULL(strstr(error, name.line));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_name_that_no_chip_has);
    RUN_TEST(a_chip_that_is_not_there);
    RUN_TEST(the_longest_names_and_the_shortest_buffers);
    return UNITY_END();
}
