/* SPDX-License-Identifier: BSD-3-Clause
 * Reading outcrop-base.yaml with libcyaml. C, because libcyaml's schema macros are. */
#include "config.h"

#include <cyaml/cyaml.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "config_yaml.h"
#include "core/packet.h"

typedef struct yaml_file {
    uint32_t *vehicle, *datagram_bytes, *patch_quality;
    char *down_url, *up_url, *lan_url, *out, *represent, *path, *method, *exit_when_settled;
    double *area;
    uint32_t area_count;
} yaml_file_t;

#define OPTIONAL_POINTER (CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER)
#define MAX_TEXT (OC_BASE_TEXT_BYTES - 1)

static const cyaml_schema_value_t number_schema = {CYAML_VALUE_FLOAT(CYAML_FLAG_DEFAULT, double)};

static const cyaml_schema_field_t fields[] = {
    CYAML_FIELD_UINT_PTR("vehicle", OPTIONAL_POINTER, yaml_file_t, vehicle),
    CYAML_FIELD_STRING_PTR("down_url", CYAML_FLAG_POINTER, yaml_file_t, down_url, 1, MAX_TEXT),
    CYAML_FIELD_STRING_PTR("up_url", CYAML_FLAG_POINTER, yaml_file_t, up_url, 1, MAX_TEXT),
    CYAML_FIELD_STRING_PTR("lan_url", OPTIONAL_POINTER, yaml_file_t, lan_url, 1, MAX_TEXT),
    CYAML_FIELD_UINT_PTR("datagram_bytes", OPTIONAL_POINTER, yaml_file_t, datagram_bytes),
    CYAML_FIELD_UINT_PTR("patch_quality", OPTIONAL_POINTER, yaml_file_t, patch_quality),
    CYAML_FIELD_STRING_PTR("out", CYAML_FLAG_POINTER, yaml_file_t, out, 1, MAX_TEXT),
    CYAML_FIELD_STRING_PTR("as", OPTIONAL_POINTER, yaml_file_t, represent, 1, MAX_TEXT),
    CYAML_FIELD_STRING_PTR("path", OPTIONAL_POINTER, yaml_file_t, path, 1, MAX_TEXT),
    CYAML_FIELD_STRING_PTR("method", OPTIONAL_POINTER, yaml_file_t, method, 1, 15),
    CYAML_FIELD_SEQUENCE("area", OPTIONAL_POINTER, yaml_file_t, area, &number_schema, 5, 5),
    /* libcyaml takes every word but "false" and the like for true. */
    CYAML_FIELD_STRING_PTR("exit_when_settled", OPTIONAL_POINTER, yaml_file_t, exit_when_settled, 1, 15),
    CYAML_FIELD_END};

static const cyaml_schema_value_t schema = {CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, yaml_file_t, fields)};

static bool pick(const char *file, const char *key, const uint32_t *value, uint32_t low, uint32_t high, uint32_t *out,
                 char *error, size_t error_bytes)
{
    if (!value) return true;
    if (*value < low || *value > high) {
        snprintf(error, error_bytes, "%s: %s: %u is not within %u..%u", file, key, *value, low, high);
        return false;
    }
    *out = *value;
    return true;
}

static bool pick_word(const char *file, const char *key, const char *value, const char *first, const char *second,
                      char *out, size_t out_bytes, char *error, size_t error_bytes)
{
    const char *word = value ? value : first;
    if (strcmp(word, first) != 0 && strcmp(word, second) != 0) {
        snprintf(error, error_bytes, "%s: %s: \"%s\" is neither %s nor %s", file, key, word, first, second);
        return false;
    }
    snprintf(out, out_bytes, "%s", word);
    return true;
}

static bool take_area(const char *file, const yaml_file_t *yaml, oc_base_config_t *config, char *error,
                      size_t error_bytes)
{
    if (!yaml->area) return true;
    const double *a = yaml->area;
    for (int i = 0; i < 5; i++) config->area[i] = a[i];
    config->has_area = true;
    if (a[0] < a[1] && a[2] < a[3] && a[4] > 0 && fabs(a[0]) < 1e6 && fabs(a[1]) < 1e6 && fabs(a[2]) < 1e6 &&
        fabs(a[3]) < 1e6 && a[4] < 1e6)
        return true;
    snprintf(error, error_bytes, "%s: area: must be [x_min, x_max, y_min, y_max, z_max], ascending, in metres", file);
    return false;
}

static bool take_file(const char *file, const yaml_file_t *yaml, oc_base_config_t *config, char *error,
                      size_t error_bytes)
{
    uint32_t vehicle = 0;
    config->datagram_bytes = OC_MAX_DATAGRAM_BYTES;
    config->patch_quality = 8;
    if (!pick(file, "vehicle", yaml->vehicle, 0, 255, &vehicle, error, error_bytes)) return false;
    if (!pick(file, "datagram_bytes", yaml->datagram_bytes, OC_MIN_DATAGRAM_BYTES, OC_MAX_DATAGRAM_BYTES,
              &config->datagram_bytes, error, error_bytes))
        return false;
    if (!pick(file, "patch_quality", yaml->patch_quality, 1, 31, &config->patch_quality, error, error_bytes))
        return false;
    if (!pick_word(file, "as", yaml->represent, "boxes", "none", config->represent, sizeof config->represent, error,
                   error_bytes))
        return false;
    if (!pick_word(file, "method", yaml->method, "best", "thesis", config->method, sizeof config->method, error,
                   error_bytes))
        return false;
    char exit_when_settled[16];
    if (!pick_word(file, "exit_when_settled", yaml->exit_when_settled, "false", "true", exit_when_settled,
                   sizeof exit_when_settled, error, error_bytes))
        return false;
    config->vehicle = yaml->vehicle ? (int)vehicle : -1;
    snprintf(config->down_url, sizeof config->down_url, "%s", yaml->down_url);
    snprintf(config->up_url, sizeof config->up_url, "%s", yaml->up_url);
    snprintf(config->lan_url, sizeof config->lan_url, "%s", yaml->lan_url ? yaml->lan_url : "");
    snprintf(config->out, sizeof config->out, "%s", yaml->out);
    snprintf(config->path, sizeof config->path, "%s", yaml->path ? yaml->path : "");
    config->exit_when_settled = strcmp(exit_when_settled, "true") == 0;
    return take_area(file, yaml, config, error, error_bytes);
}

bool oc_base_config_load(const char *path, oc_base_config_t *config, char *error, size_t error_bytes)
{
    void *data = NULL;
    if (!oc_yaml_load(path, &schema, &data, error, error_bytes)) return false;
    oc_base_config_t fresh = {.vehicle = -1};
    const bool is_ok = take_file(path, data, &fresh, error, error_bytes);
    oc_yaml_free(&schema, data);
    if (is_ok) *config = fresh;
    return is_ok;
}
