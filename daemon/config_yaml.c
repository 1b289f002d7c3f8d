/* SPDX-License-Identifier: BSD-3-Clause
 * libcyaml's log: the first line says what is wrong, the first of its backtrace where. */
#include "config_yaml.h"

#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

typedef struct yaml_log {
    char what[200], key[80];
    int line; /* 0 = not told */
} yaml_log_t;

/* "  in mapping field 'rate' (line: 4, column: 6)"; of several such the first, which is the innermost. */
static void log_take_place(yaml_log_t *log, const char *text)
{
    const char *place = strstr(text, "(line: "), *name = strstr(text, "in mapping field '");
    if (log->line == 0 && place && sscanf(place, "(line: %d", &log->line) != 1) log->line = 0;
    if (!log->key[0] && name && sscanf(name, "in mapping field '%79[^']", log->key) != 1) log->key[0] = '\0';
}

__attribute__((format(printf, 3, 0))) static void log_on_line(cyaml_log_t level, void *context, const char *format,
                                                              va_list args)
{
    yaml_log_t *log = context;
    char text[200];
    if (level < CYAML_LOG_ERROR) return;
    vsnprintf(text, sizeof text, format, args);
    text[strcspn(text, "\n")] = '\0';
    if (!log->what[0]) {
        const bool has_lead = strncmp(text, "Load: ", 6) == 0;
        snprintf(log->what, sizeof log->what, "%s", has_lead ? text + 6 : text);
    } else {
        log_take_place(log, text);
    }
}

static cyaml_config_t config_with(yaml_log_t *log)
{
    return (cyaml_config_t){.log_fn = log_on_line, .log_ctx = log, .log_level = CYAML_LOG_ERROR, .mem_fn = cyaml_mem};
}

static void log_tell(const yaml_log_t *log, const char *path, cyaml_err_t fault, char *error, size_t error_bytes)
{
    /* Where the key itself is at fault, the message names it, and the place is that of the key before. */
    const bool names_key = fault == CYAML_ERR_INVALID_KEY || fault == CYAML_ERR_MAPPING_FIELD_MISSING;
    char place[120] = "";
    if (log->line > 0 && !names_key)
        snprintf(place, sizeof place, "%d: %s%s", log->line, log->key, log->key[0] ? ": " : "");
    snprintf(error, error_bytes, "%s:%s%s%s", path, place[0] ? "" : " ", place,
             log->what[0] ? log->what : cyaml_strerror(fault));
}

bool oc_yaml_load(const char *path, const cyaml_schema_value_t *schema, void **data, char *error, size_t error_bytes)
{
    *data = NULL;
    FILE *file = fopen(path, "rb");
    if (!file) {
        snprintf(error, error_bytes, "%s: %s", path, strerror(errno));
        return false;
    }
    fclose(file);
    yaml_log_t log = {"", "", 0};
    const cyaml_config_t config = config_with(&log);
    const cyaml_err_t fault = cyaml_load_file(path, &config, schema, data, NULL);
    if (fault != CYAML_OK) {
        *data = NULL;
        log_tell(&log, path, fault, error, error_bytes);
        return false;
    }
    /* libcyaml takes a file without a document for a success. */
    if (!*data) snprintf(error, error_bytes, "%s: is empty", path);
    return *data != NULL;
}

void oc_yaml_free(const cyaml_schema_value_t *schema, void *data)
{
    yaml_log_t log = {"", "", 0};
    const cyaml_config_t config = config_with(&log);
    cyaml_free(&config, schema, data, 0);
}
