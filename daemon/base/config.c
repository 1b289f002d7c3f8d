/* SPDX-License-Identifier: BSD-3-Clause
 * outcrop-base.yaml: its schema, the table of its keys, and reading it. C, because libcyaml's schema macros are. */
#include "config.h"

#include <cyaml/cyaml.h>
#include <stdlib.h>
#include <string.h>

#include "config_yaml.h"
#include "core/packet.h"

/* ---- the file as libcyaml loads it: optional keys are pointers, NULL = not given ---- */

typedef enum yaml_bool { YAML_FALSE, YAML_TRUE } yaml_bool_t;

typedef struct yaml_file {
    uint32_t *vehicle, *datagram_bytes, *patch_quality;
    char *down_url, *up_url, *lan_url, *out, *path;
    int *as, *method; /* places in as_words, method_words */
    double *area;
    uint32_t n_area;
    yaml_bool_t *textures, *resume, *exit_when_settled;
} yaml_file_t;

#define OPTIONAL (CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER)
#define LONGEST (OC_BASE_TEXT_BYTES - 1)
#define WORD_FIELD(key, member, list)                                                                                  \
    CYAML_FIELD_ENUM_PTR(key, OPTIONAL | CYAML_FLAG_STRICT, yaml_file_t, member, list, CYAML_ARRAY_LEN(list))

static const cyaml_strval_t bool_words[] = {{"false", YAML_FALSE}, {"true", YAML_TRUE}};
static const cyaml_strval_t as_words[] = {{"boxes", 0}, {"none", 1}, {"voxels", 2}};
static const cyaml_strval_t method_words[] = {{"best", 0}, {"thesis", 1}};

static const cyaml_schema_value_t number_schema = {CYAML_VALUE_FLOAT(CYAML_FLAG_DEFAULT, double)};

static const cyaml_schema_field_t fields[] = {
    CYAML_FIELD_UINT_PTR("vehicle", OPTIONAL, yaml_file_t, vehicle),
    CYAML_FIELD_STRING_PTR("down_url", CYAML_FLAG_POINTER, yaml_file_t, down_url, 1, LONGEST),
    CYAML_FIELD_STRING_PTR("up_url", CYAML_FLAG_POINTER, yaml_file_t, up_url, 1, LONGEST),
    CYAML_FIELD_STRING_PTR("lan_url", OPTIONAL, yaml_file_t, lan_url, 1, LONGEST),
    CYAML_FIELD_UINT_PTR("datagram_bytes", OPTIONAL, yaml_file_t, datagram_bytes),
    CYAML_FIELD_UINT_PTR("patch_quality", OPTIONAL, yaml_file_t, patch_quality),
    CYAML_FIELD_STRING_PTR("out", CYAML_FLAG_POINTER, yaml_file_t, out, 1, LONGEST),
    WORD_FIELD("as", as, as_words),
    WORD_FIELD("textures", textures, bool_words),
    CYAML_FIELD_STRING_PTR("path", OPTIONAL, yaml_file_t, path, 1, LONGEST),
    WORD_FIELD("method", method, method_words),
    CYAML_FIELD_SEQUENCE_COUNT("area", OPTIONAL, yaml_file_t, area, n_area, &number_schema, 5, 5),
    WORD_FIELD("resume", resume, bool_words),
    WORD_FIELD("exit_when_settled", exit_when_settled, bool_words),
    CYAML_FIELD_END};

static const cyaml_schema_value_t schema = {CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, yaml_file_t, fields)};

/* ---- the keys ---- */

#define URL .form = "LCM URL", .check = oc_yaml_url_fault

static const oc_yaml_key_t keys[] = {
    {.path = "vehicle",
     .high = 255,
     .without = "the first that is heard",
     .example = "1",
     .in_sample = true,
     .meaning = "Vehicle to listen to."},
    {.path = "down_url",
     URL,
     .example = "\"udpm://239.255.76.67:7667?ttl=1\"",
     .meaning = "LCM group from vehicle to base, the same as in the vehicle's file."},
    {.path = "up_url",
     URL,
     .example = "\"udpm://239.255.76.68:7668?ttl=1\"",
     .meaning = "LCM group from base to vehicle, the same as in the vehicle's file."},
    {.path = "lan_url",
     URL,
     .without = "nowhere",
     .example = "\"udpm://239.255.76.69:7669?ttl=1\"",
     .meaning = "Where views go out again as readable outcrop.view_t on OUTCROP_VIEW, for lcm-spy and others."},
    {.path = "datagram_bytes",
     .unit = "bytes",
     .low = OC_MIN_DATAGRAM_BYTES,
     .high = OC_MAX_DATAGRAM_BYTES,
     .fallback = "1380",
     .meaning = "Largest packet; the same on both ends. Ground tiles are sized to fit it."},
    {.path = "patch_quality",
     .low = 1,
     .high = 31,
     .fallback = "8",
     .meaning = "Quality of the pixels asked for; 31 is finest, each 5 less doubles the step."},
    {.path = "out",
     .form = "folder",
     .example = "out",
     .meaning = "Folder of the run, from the working directory when it is not absolute; its link.lcm is the journal."},
    {.path = "as",
     .fallback = "boxes",
     .meaning = "How obstacles are shown, and so what is asked for: voxels need silhouettes and textures; none: no "
                "sequence."},
    {.path = "textures",
     .fallback = "true",
     .meaning = "Ask for colour where the representation uses it; false: volumes of silhouettes alone."},
    {.path = "path",
     .form = "file",
     .without = "a loop round the obstacles",
     .example = "tests/data/sites/depot/path.json",
     .in_sample = true,
     .meaning = "Path file."},
    {.path = "method", .fallback = "best", .meaning = "thesis: its strip, score and clustering."},
    {.path = "area",
     .unit = "m",
     .low = -1000000,
     .high = 1000000,
     .example = "[-3.5, 3.5, -3.5, 3.5, 1.504]",
     .without = "what the vehicle says, else the ground that two views share",
     .meaning = "Working area [x_min, x_max, y_min, y_max, z_max], ascending, z_max above 0."},
    {.path = "resume",
     .fallback = "true",
     .meaning =
         "Go on from the journal in the folder, if there is one; false: begin anew, the old one is overwritten."},
    {.path = "exit_when_settled",
     .fallback = "false",
     .meaning = "End when everything has come and is written, instead of at a signal."},
};

static const oc_yaml_form_t form = {&schema, keys, sizeof keys / sizeof keys[0]};

/* ---- reading ---- */

static uint32_t uint_or(const uint32_t *value, const char *path)
{
    return value ? *value : (uint32_t)oc_yaml_default_number(&form, path);
}

static const char *word_or(const int *value, const cyaml_strval_t *words, const char *path)
{
    return words[value ? *value : oc_yaml_default_word(&form, path)].str;
}

#define COPY_TEXT(out, text) snprintf(out, sizeof(out), "%s", (text) ? (text) : "")

static void take_file(const yaml_file_t *file, oc_base_config_t *config)
{
    config->vehicle = file->vehicle ? (int)*file->vehicle : -1;
    COPY_TEXT(config->down_url, file->down_url);
    COPY_TEXT(config->up_url, file->up_url);
    COPY_TEXT(config->lan_url, file->lan_url);
    config->datagram_bytes = uint_or(file->datagram_bytes, "datagram_bytes");
    config->patch_quality = uint_or(file->patch_quality, "patch_quality");
    COPY_TEXT(config->out, file->out);
    COPY_TEXT(config->represent, word_or(file->as, as_words, "as"));
    COPY_TEXT(config->path, file->path);
    COPY_TEXT(config->method, word_or(file->method, method_words, "method"));
    config->has_area = file->area != NULL;
    for (int i = 0; i < 5 && file->area; i++) config->area[i] = file->area[i];
    config->with_textures = !file->textures || *file->textures == YAML_TRUE;
    config->resume = !file->resume || *file->resume == YAML_TRUE;
    config->exit_when_settled = file->exit_when_settled && *file->exit_when_settled == YAML_TRUE;
}

bool oc_base_config_load(const char *path, oc_base_config_t *config, oc_config_fault_t on_fault, void *user)
{
    oc_yaml_t *yaml = oc_yaml_open(path, &form);
    if (!yaml) {
        on_fault(user, "out of memory");
        return false;
    }
    oc_yaml_check_area(yaml, "area");
    yaml_file_t *data = oc_yaml_load(yaml);
    const bool is_ok = oc_yaml_tell(yaml, on_fault, user) && data;
    oc_yaml_close(yaml);
    if (is_ok) {
        memset(config, 0, sizeof *config);
        take_file(data, config);
    }
    if (data) oc_yaml_free(&form, data);
    return is_ok;
}

bool oc_base_config_print_sample(FILE *out)
{
    static const char head[] =
        "# outcrop-base live: the operator's end. Every key with unit, range and default;\n"
        "# outcrop-base live --print-config prints this file. A # with no space behind it holds a key back; without\n"
        "# that # the key is at its default, or at an example where it has none. From the project's root:\n"
        "#   build/bin/outcrop-base live --config docs/outcrop-base.yaml\n";
    return oc_yaml_print_sample(&form, head, out);
}
