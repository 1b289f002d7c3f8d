/* SPDX-License-Identifier: BSD-3-Clause
 * outcrop-base's configuration: what arrives, all faults with their lines, the sample file. */
#include "unity.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "config.h"

#define SAMPLE OUTCROP_TEST_DATA "/../../docs/outcrop-base.yaml"
#define LEAST "down_url: memq://\nup_url: memq://\nout: o\n"

static oc_base_config_t config;
static char told[4000], path[64];

static void take_told(void *user, const char *line)
{
    TEST_ASSERT_EQUAL_PTR(told, user);
    const size_t n_path = strlen(path), n = strlen(told);
    TEST_ASSERT_EQUAL_STRING_LEN(path, line, n_path);
    snprintf(told + n, sizeof told - n, "%s\n", line + n_path);
}

static bool load(const char *text)
{
    snprintf(path, sizeof path, "/tmp/outcrop_base_config_%d.yaml", (int)getpid());
    FILE *file = fopen(path, "w");
    TEST_ASSERT_NOT_NULL(file);
    fputs(text, file);
    TEST_ASSERT_EQUAL(0, fclose(file));
    told[0] = '\0';
    const bool is_ok = oc_base_config_load(path, &config, take_told, told);
    unlink(path);
    TEST_ASSERT_EQUAL(is_ok, !told[0]);
    return is_ok;
}

void setUp(void)
{
    memset(&config, 0, sizeof config);
}

void tearDown(void) {}

static void the_least_file_gives_the_defaults(void)
{
    TEST_ASSERT_TRUE_MESSAGE(load(LEAST), told);
    TEST_ASSERT_EQUAL(-1, config.vehicle);
    TEST_ASSERT_EQUAL_STRING("memq://", config.down_url);
    TEST_ASSERT_EQUAL_STRING("memq://", config.up_url);
    TEST_ASSERT_EQUAL_STRING("", config.lan_url);
    TEST_ASSERT_EQUAL(1380, config.datagram_bytes);
    TEST_ASSERT_EQUAL(8, config.patch_quality);
    TEST_ASSERT_EQUAL_STRING("o", config.out);
    TEST_ASSERT_EQUAL_STRING("boxes", config.represent);
    TEST_ASSERT_EQUAL_STRING("", config.path);
    TEST_ASSERT_EQUAL_STRING("best", config.method);
    TEST_ASSERT_FALSE(config.has_area || config.exit_when_settled);
}

static void every_key_arrives(void)
{
    TEST_ASSERT_TRUE_MESSAGE(load("vehicle: 0\ndown_url: memq://\nup_url: tcpq://h\nlan_url: udpm://g\n"
                                  "datagram_bytes: 200\npatch_quality: 31\nout: o\nas: none\npath: p\nmethod: thesis\n"
                                  "area: [-1, 2.5, -3, 4, 5e0]\nexit_when_settled: true\n"),
                             told);
    TEST_ASSERT_EQUAL(0, config.vehicle);
    TEST_ASSERT_EQUAL_STRING("tcpq://h", config.up_url);
    TEST_ASSERT_EQUAL_STRING("udpm://g", config.lan_url);
    TEST_ASSERT_EQUAL(200, config.datagram_bytes);
    TEST_ASSERT_EQUAL(31, config.patch_quality);
    TEST_ASSERT_EQUAL_STRING("none", config.represent);
    TEST_ASSERT_EQUAL_STRING("p", config.path);
    TEST_ASSERT_EQUAL_STRING("thesis", config.method);
    const double area[5] = {-1, 2.5, -3, 4, 5};
    TEST_ASSERT_TRUE(config.has_area && config.exit_when_settled);
    TEST_ASSERT_EQUAL_DOUBLE_ARRAY(area, config.area, 5);
}

static void all_faults_are_told_together(void)
{
    oc_base_config_t before;
    memset(&config, 0x5a, sizeof config);
    memset(&before, 0x5a, sizeof before);
    TEST_ASSERT_FALSE(load("vehicle: 256\n"
                           "up_url: []\n"
                           "\n"
                           "lan_url: lo\n"
                           "datagram_bytes: 199\n"
                           "patch_quality: 0\n"
                           "as: clouds\n"
                           "as: boxes\n"
                           "methot: best\n"
                           "area: [1, 0, 0, nan, 1e7]\n"
                           "exit_when_settled: perhaps\n"
                           "out:\n"));
    TEST_ASSERT_EQUAL_STRING(":1: vehicle: 256 is not within 0..255\n"
                             ":1: down_url: is missing\n"
                             ":2: up_url: must be one value, not a list or a section\n"
                             ":4: lan_url: \"lo\" is not an LCM URL, as udpm://239.255.76.67:7667?ttl=1\n"
                             ":5: datagram_bytes: 199 is not within 200..1380\n"
                             ":6: patch_quality: 0 is not within 1..31\n"
                             ":7: as: \"clouds\" is not one of boxes, none, voxels\n"
                             ":8: as: is given twice, first in line 7\n"
                             ":9: methot: is no key here: did you mean method?\n"
                             ":10: area[3]: \"nan\" is not finite\n"
                             ":10: area[4]: 1e7 is not within -1000000..1000000\n"
                             ":11: exit_when_settled: \"perhaps\" is not one of false, true\n"
                             ":12: out: has no value\n",
                             told);
    TEST_ASSERT_EQUAL_MEMORY(&before, &config, sizeof config);

    TEST_ASSERT_FALSE(load(LEAST "area: [0, 1, 1, 0, 1]\n"));
    TEST_ASSERT_EQUAL_STRING(":4: area: must be [x_min, x_max, y_min, y_max, z_max], ascending, z_max above 0\n", told);
    TEST_ASSERT_FALSE(load(LEAST "area: [0, 1, 0, 1]\n"));
    TEST_ASSERT_EQUAL_STRING(":4: area: has 4 items, not 5\n", told);
    TEST_ASSERT_FALSE(load(""));
    TEST_ASSERT_EQUAL_STRING(": is empty\n", told);
}

/* ---- the sample ---- */

static void read_sample(FILE *file, char *text, size_t text_bytes)
{
    TEST_ASSERT_NOT_NULL(file);
    const size_t n = fread(text, 1, text_bytes - 1, file);
    TEST_ASSERT_TRUE(n > 0 && n < text_bytes - 1);
    text[n] = '\0';
    fclose(file);
}

static void the_sample_is_as_printed(void)
{
    static char kept[16384], printed[16384];
    read_sample(fopen(SAMPLE, "r"), kept, sizeof kept);
    FILE *file = tmpfile();
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_TRUE(oc_base_config_print_sample(file));
    rewind(file);
    read_sample(file, printed, sizeof printed);
    TEST_ASSERT_EQUAL_STRING(printed, kept);
}

/* With every # gone that holds a key back, it loads, and what has a default has it. */
static void the_sample_loads_with_every_key(void)
{
    static char kept[16384], freed[16384];
    read_sample(fopen(SAMPLE, "r"), kept, sizeof kept);
    TEST_ASSERT_TRUE_MESSAGE(load(kept), told);
    size_t n = 0;
    int n_freed = 0;
    for (const char *c = kept; *c; c++) {
        const bool is_held_back = *c == '#' && (c == kept || c[-1] == '\n') && c[1] != ' ';
        n_freed += is_held_back;
        if (!is_held_back) freed[n++] = *c;
    }
    freed[n] = '\0';
    TEST_ASSERT_EQUAL(9, n_freed);
    TEST_ASSERT_TRUE_MESSAGE(load(freed), told);
    TEST_ASSERT_EQUAL(1, config.vehicle);
    TEST_ASSERT_EQUAL(1380, config.datagram_bytes);
    TEST_ASSERT_EQUAL(8, config.patch_quality);
    TEST_ASSERT_EQUAL_STRING("boxes", config.represent);
    TEST_ASSERT_EQUAL_STRING("best", config.method);
    TEST_ASSERT_TRUE(config.has_area && !config.exit_when_settled && config.with_textures && config.resume);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_least_file_gives_the_defaults);
    RUN_TEST(every_key_arrives);
    RUN_TEST(all_faults_are_told_together);
    RUN_TEST(the_sample_is_as_printed);
    RUN_TEST(the_sample_loads_with_every_key);
    return UNITY_END();
}
