/* SPDX-License-Identifier: BSD-3-Clause
 * What the tests of outcropd's configuration share: files made from the table
 * of keys, faults gathered, and stand-ins for what a configuration reads. */
#ifndef OUTCROP_TESTS_DAEMON_CONFIG_FILE_H
#define OUTCROP_TESTS_DAEMON_CONFIG_FILE_H

#include "unity.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration.h"
#include "config.h"
#include "config_schema.h"

/* ---- stand-ins ---- */

/* "bad.yaml" is one; "641x480.yaml" says its size; all others are 640 x 480. */
bool oc_calibration_read(const char *path, oc_calibration_t *calibration, char *error, size_t error_bytes)
{
    unsigned width_px = 640, height_px = 480;
    if (strcmp(path, "bad.yaml") == 0) {
        snprintf(error, error_bytes, "%s:3: camera_matrix is missing", path);
        return false;
    }
    if (sscanf(path, "%ux%u.yaml", &width_px, &height_px) != 2) {
        width_px = 640;
        height_px = 480;
    }
    const oc_intrinsics_t k = {
        .width_px = width_px, .height_px = height_px, .fx_px = 500, .fy_px = 500, .cx_px = 320, .cy_px = 240};
    memset(calibration, 0, sizeof *calibration);
    calibration->lens = oc_lens_pinhole(&k);
    return true;
}

/* What came in, told apart by its place: turns in R, metres in t. */
oc_pose_t oc_mount_from_xyzrpy(const double xyz_m[3], const double rpy_rad[3])
{
    oc_pose_t pose;
    memset(&pose, 0, sizeof pose);
    for (int i = 0; i < 3; i++) {
        pose.t[i] = xyz_m[i];
        pose.R[i] = rpy_rad[i];
    }
    return pose;
}

/* ---- loading ---- */

#define MAX_TOLD 256

static char file_path[64], *told[MAX_TOLD];
static int n_told;

static void forget_told(void)
{
    for (int i = 0; i < n_told; i++) free(told[i]);
    n_told = 0;
}

static void take_told(void *user, const char *line)
{
    TEST_ASSERT_EQUAL_PTR(told, user);
    TEST_ASSERT_TRUE(n_told < MAX_TOLD);
    told[n_told++] = strdup(line);
}

static void write_file(const char *bytes, size_t n_bytes)
{
    snprintf(file_path, sizeof file_path, "/tmp/outcrop_config_%d.yaml", (int)getpid());
    FILE *file = fopen(file_path, "wb");
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_EQUAL(n_bytes, fwrite(bytes, 1, n_bytes, file));
    TEST_ASSERT_EQUAL(0, fclose(file));
}

static inline bool load_bytes(const char *bytes, size_t n_bytes, oc_config_t *config)
{
    write_file(bytes, n_bytes);
    forget_told();
    const bool is_ok = oc_config_load(file_path, config, take_told, told);
    unlink(file_path);
    TEST_ASSERT_EQUAL(is_ok, n_told == 0);
    return is_ok;
}

static inline bool load(const char *text, oc_config_t *config)
{
    return load_bytes(text, strlen(text), config);
}

static inline void load_well(const char *text, oc_config_t *config)
{
    if (!load(text, config)) TEST_FAIL_MESSAGE(told[0]);
}

/* ---- files made from the table ---- */

#define MAX_ITEMS 256

typedef struct file_item {
    char path[OC_YAML_PATH_BYTES], name[40], value[700];
    int indent;
    bool is_first; /* of a camera */
    const oc_yaml_key_t *key;
    const cyaml_schema_value_t *schema;
    int line, section; /* section: index of the item it stands in, -1: the file */
} file_item_t;

typedef struct file_plan {
    file_item_t items[MAX_ITEMS];
    int n;
} file_plan_t;

typedef enum file_kind {
    FILE_SITE = 0,
    FILE_CAMERAS = 1,
    FILE_CHIPS = 2 /* lines by chip and offset */
} file_kind_t;

static inline bool starts_with(const char *text, const char *start)
{
    return strncmp(text, start, strlen(start)) == 0;
}

static inline bool ends_with(const char *text, const char *end)
{
    const size_t n = strlen(text), m = strlen(end);
    return n >= m && strcmp(text + n - m, end) == 0;
}

static inline bool is_leaf(const cyaml_schema_value_t *schema)
{
    return schema->type != CYAML_MAPPING &&
           !(schema->type == CYAML_SEQUENCE && schema->sequence.entry->type == CYAML_MAPPING);
}

/* Keys that exclude each other are never in one file. */
static inline bool is_of_kind(const oc_yaml_key_t *key, int kind)
{
    const bool needs_cameras = starts_with(key->path, "cameras") ||
                               (key->only_with && strcmp(key->only_with, "cameras") == 0) ||
                               starts_with(key->path, "poses");
    if (needs_cameras && !(kind & FILE_CAMERAS)) return false;
    if (starts_with(key->path, "source") && (kind & FILE_CAMERAS)) return false;
    const bool is_line = starts_with(key->path, "gpio.") && ends_with(key->path, ".line");
    const bool is_chip = ends_with(key->path, ".chip") || ends_with(key->path, ".offset");
    return !(is_line && (kind & FILE_CHIPS)) && !(is_chip && !(kind & FILE_CHIPS));
}

static inline int find_item(const file_plan_t *plan, const char *path)
{
    for (int i = 0; i < plan->n; i++) {
        if (strcmp(plan->items[i].path, path) == 0) return i;
    }
    return -1;
}

static inline void add_item(file_plan_t *plan, const oc_yaml_key_t *key, int camera)
{
    TEST_ASSERT_TRUE(plan->n < MAX_ITEMS);
    file_item_t *item = &plan->items[plan->n];
    memset(item, 0, sizeof *item);
    item->key = key;
    item->schema = oc_yaml_schema(&oc_config_form, key->path);
    TEST_ASSERT_NOT_NULL_MESSAGE(item->schema, key->path);
    const char *bracket = strstr(key->path, "[]");
    char path[OC_YAML_PATH_BYTES];
    if (bracket)
        snprintf(path, sizeof path, "cameras[%d]%.60s", camera, bracket + 2);
    else
        snprintf(path, sizeof path, "%s", key->path);
    memcpy(item->path, path, sizeof path);
    const char *dot = strrchr(path, '.');
    snprintf(item->name, sizeof item->name, "%.39s", dot ? dot + 1 : path);
    item->is_first = strcmp(key->path, "cameras[].name") == 0;
    char section[OC_YAML_PATH_BYTES] = "";
    if (dot) snprintf(section, sizeof section, "%.*s", (int)(dot - path), path);
    item->section = find_item(plan, section);
    /* A camera's own line is that of its first key. */
    if (bracket && item->section < 0) {
        snprintf(section, sizeof section, "cameras[%d].name", camera);
        item->section = item->is_first ? plan->n : find_item(plan, section);
    }
    item->indent = bracket ? 4 : 0;
    for (const char *c = bracket ? bracket + 3 : key->path; *c; c++) item->indent += *c == '.' ? 2 : 0;
    const char *value = key->example ? key->example : key->fallback ? key->fallback : "";
    const bool is_numbered = item->is_first || strcmp(key->path, "cameras[].device") == 0;
    if (is_leaf(item->schema)) snprintf(item->value, sizeof item->value, "%s", value);
    if (is_numbered) snprintf(item->value, sizeof item->value, "%s%d", value, camera);
    plan->n++;
}

/* Every key of a kind of file, at its example or default. */
static inline void plan_file(file_plan_t *plan, int kind, int n_cameras)
{
    plan->n = 0;
    for (uint32_t i = 0; i < oc_config_form.n_keys; i++) {
        const oc_yaml_key_t *key = &oc_config_form.keys[i];
        if (!is_of_kind(key, kind)) continue;
        const bool is_camera = strstr(key->path, "[]") != NULL;
        if (!is_camera) add_item(plan, key, 0);
        if (strcmp(key->path, "cameras[].name") != 0) continue;
        for (int camera = 0; camera < n_cameras; camera++) {
            for (uint32_t k = i; k < oc_config_form.n_keys && strstr(oc_config_form.keys[k].path, "[]"); k++)
                add_item(plan, &oc_config_form.keys[k], camera);
        }
    }
}

static inline size_t print_item(const file_item_t *item, const char *name, char *text, size_t text_bytes)
{
    const int n = snprintf(text, text_bytes, "%*s%s%s:%s%s\n", item->is_first ? item->indent - 2 : item->indent, "",
                           item->is_first ? "- " : "", name, item->value[0] ? " " : "", item->value);
    TEST_ASSERT_TRUE(n > 0 && (size_t)n < text_bytes);
    return (size_t)n;
}

static inline size_t print_plan(const file_plan_t *plan, char *text, size_t text_bytes)
{
    size_t n = 0;
    for (int i = 0; i < plan->n; i++) n += print_item(&plan->items[i], plan->items[i].name, text + n, text_bytes - n);
    return n;
}

static inline void set_item(file_plan_t *plan, const char *path, const char *value)
{
    const int i = find_item(plan, path);
    TEST_ASSERT_TRUE_MESSAGE(i >= 0, path);
    snprintf(plan->items[i].value, sizeof plan->items[i].value, "%s", value);
}

#endif
