/* SPDX-License-Identifier: BSD-3-Clause
 * Calibration files through libyaml's events: nothing is built that a file could make large or deep. */
#include "calibration_yaml.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <yaml.h>

typedef struct key_name {
    const char *name;
    oc_calibration_key_t key;
} key_name_t;

/* camera_calibration's, OpenCV's, and OpenCV's before 3.0. */
static const key_name_t key_names[] = {
    {"image_width", OC_KEY_WIDTH},
    {"image_Width", OC_KEY_WIDTH},
    {"image_height", OC_KEY_HEIGHT},
    {"image_Height", OC_KEY_HEIGHT},
    {"camera_name", OC_KEY_NAME},
    {"distortion_model", OC_KEY_MODEL},
    {"fisheye_model", OC_KEY_FISHEYE},
    {"camera_matrix", OC_KEY_CAMERA},
    {"Camera_Matrix", OC_KEY_CAMERA},
    {"K", OC_KEY_CAMERA},
    {"distortion_coefficients", OC_KEY_DISTORTION},
    {"Distortion_Coefficients", OC_KEY_DISTORTION},
    {"D", OC_KEY_DISTORTION},
    {"rectification_matrix", OC_KEY_RECTIFICATION},
    {"projection_matrix", OC_KEY_PROJECTION},
};

typedef struct event_reader {
    oc_calibration_file_t *file;
    const char *bytes;
    size_t n_bytes;
    yaml_parser_t parser;
    yaml_event_t event; /* the last; owned until the next */
    bool has_event;
    int depth; /* of lists and mappings */
} event_reader_t;

/* libyaml takes quadratic time to see through deeply nested ones. */
#define MAX_DEPTH 16

void oc_calibration_refuse(oc_calibration_file_t *file, int line, const char *format, ...)
{
    if (file->is_bad) return;
    file->is_bad = true;
    char what[240], place[16] = "";
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    /* Parts of the file may be in it. */
    for (char *c = what; *c; c++) {
        if (iscntrl((unsigned char)*c)) *c = '?';
    }
    if (line > 0) snprintf(place, sizeof place, "%d:", line);
    snprintf(file->error, file->error_bytes, "%s:%s %s", file->path, place, what);
}

/* ---- events ---- */

static int line_of(const event_reader_t *r)
{
    return (int)r->event.start_mark.line + 1;
}

static void refuse_yaml(event_reader_t *r)
{
    const yaml_parser_t *p = &r->parser;
    int line = (int)p->problem_mark.line + 1;
    if (p->error == YAML_READER_ERROR) { /* no mark, but an offset */
        line = 1;
        for (size_t i = 0; i < p->problem_offset && i < r->n_bytes; i++) line += r->bytes[i] == '\n';
    }
    oc_calibration_refuse(r->file, line, "not YAML: %s", p->problem ? p->problem : "cannot be parsed");
}

/* What the event opens, less what it closes. */
static int depth_of(yaml_event_type_t type)
{
    if (type == YAML_SEQUENCE_START_EVENT || type == YAML_MAPPING_START_EVENT) return 1;
    return type == YAML_SEQUENCE_END_EVENT || type == YAML_MAPPING_END_EVENT ? -1 : 0;
}

static bool next_event(event_reader_t *r)
{
    if (r->has_event) yaml_event_delete(&r->event);
    r->has_event = yaml_parser_parse(&r->parser, &r->event) == 1;
    if (!r->has_event) {
        refuse_yaml(r);
        return false;
    }
    if (r->event.type == YAML_ALIAS_EVENT) oc_calibration_refuse(r->file, line_of(r), "aliases are not understood");
    r->depth += depth_of(r->event.type);
    if (r->depth > MAX_DEPTH) oc_calibration_refuse(r->file, line_of(r), "nested more than %d deep", MAX_DEPTH);
    return !r->file->is_bad;
}

static bool expect(event_reader_t *r, yaml_event_type_t type, const char *what)
{
    if (!next_event(r)) return false;
    if (r->event.type != type) oc_calibration_refuse(r->file, line_of(r), "%s", what);
    return !r->file->is_bad;
}

static const char *scalar_of(const event_reader_t *r)
{
    return r->event.type == YAML_SCALAR_EVENT ? (const char *)r->event.data.scalar.value : NULL;
}

/* The value that the last event begins, and all that is in it. */
static void skip_value(event_reader_t *r)
{
    const int outside = r->depth - (depth_of(r->event.type) > 0);
    while (r->depth > outside && next_event(r)) {
    }
}

/* ---- values ---- */

/* Decimal only: strtod alone would take "0x1p3", "nan" and leading blanks. */
static bool parse_number(const char *text, double *number)
{
    if (!text || !*text || text[strspn(text, "0123456789+-.eE")]) return false;
    char *end;
    *number = strtod(text, &end);
    return *end == '\0' && isfinite(*number);
}

static void read_numbers(event_reader_t *r, oc_calibration_value_t *value)
{
    if (r->event.type != YAML_SEQUENCE_START_EVENT) {
        oc_calibration_refuse(r->file, line_of(r), "%s: a list of numbers expected", value->key);
        return;
    }
    while (next_event(r) && r->event.type != YAML_SEQUENCE_END_EVENT) {
        double number;
        if (!parse_number(scalar_of(r), &number)) {
            oc_calibration_refuse(r->file, line_of(r), "%s: \"%.40s\" is not a finite number", value->key,
                                  scalar_of(r) ? scalar_of(r) : "[");
        } else if (value->n == OC_MAX_CALIBRATION_NUMBERS) {
            oc_calibration_refuse(r->file, line_of(r), "%s: more than %u numbers", value->key,
                                  OC_MAX_CALIBRATION_NUMBERS);
        } else {
            value->number[value->n++] = number;
        }
        if (r->file->is_bad) return;
    }
}

/* Rows or columns: *count, which must not be there yet. */
static void read_count(event_reader_t *r, const oc_calibration_value_t *value, int *count)
{
    double number;
    if (*count >= 0 || !parse_number(scalar_of(r), &number) || !(number >= 0 && number <= OC_MAX_CALIBRATION_NUMBERS))
        oc_calibration_refuse(r->file, line_of(r), "%s: rows and cols are one small number each", value->key);
    else
        *count = (int)number;
}

/* {rows, cols, data}; "dt" and others do not matter: data are decimal. */
static void read_matrix(event_reader_t *r, oc_calibration_value_t *value)
{
    int rows = -1, cols = -1;
    bool has_data = false;
    while (next_event(r) && r->event.type != YAML_MAPPING_END_EVENT) {
        char name[8] = "";
        if (scalar_of(r)) snprintf(name, sizeof name, "%s", scalar_of(r));
        if (!scalar_of(r)) skip_value(r);
        if (r->file->is_bad || !next_event(r)) return;
        if (strcmp(name, "rows") == 0) {
            read_count(r, value, &rows);
        } else if (strcmp(name, "cols") == 0) {
            read_count(r, value, &cols);
        } else if (strcmp(name, "data") != 0) {
            skip_value(r);
        } else if (has_data) {
            oc_calibration_refuse(r->file, line_of(r), "%s: data given twice", value->key);
        } else {
            has_data = true;
            read_numbers(r, value);
        }
        if (r->file->is_bad) return;
    }
    if (r->file->is_bad) return;
    if (!has_data) oc_calibration_refuse(r->file, value->line, "%s: no data", value->key);
    if (rows >= 0 && cols >= 0 && (uint32_t)(rows * cols) != value->n)
        oc_calibration_refuse(r->file, value->line, "%s: %d x %d, but %u numbers", value->key, rows, cols, value->n);
}

static void read_text(event_reader_t *r, oc_calibration_value_t *value)
{
    const char *text = scalar_of(r);
    if (!text)
        oc_calibration_refuse(r->file, line_of(r), "%s: a single value expected", value->key);
    else if (strlen(text) != r->event.data.scalar.length || strlen(text) >= sizeof value->text)
        oc_calibration_refuse(r->file, line_of(r), "%s: longer than %zu bytes", value->key, sizeof value->text - 1);
    else
        snprintf(value->text, sizeof value->text, "%s", text);
}

/* The value of a key that the last event names. */
static void read_pair(event_reader_t *r)
{
    const char *name = scalar_of(r);
    const key_name_t *known = NULL;
    for (size_t i = 0; name && i < sizeof key_names / sizeof *key_names; i++) {
        if (strcmp(name, key_names[i].name) == 0) known = &key_names[i];
    }
    const int line = line_of(r);
    if (!name) skip_value(r);
    if (r->file->is_bad || !next_event(r)) return;
    if (!known) {
        skip_value(r);
        return;
    }
    oc_calibration_value_t *value = &r->file->value[known->key];
    if (value->line > 0) {
        oc_calibration_refuse(r->file, line, "%s: given on line %d already", known->name, value->line);
        return;
    }
    value->line = line;
    value->key = known->name;
    if (known->key < OC_KEY_CAMERA)
        read_text(r, value);
    else if (r->event.type == YAML_MAPPING_START_EVENT)
        read_matrix(r, value);
    else
        read_numbers(r, value);
}

static void read_document(event_reader_t *r)
{
    if (!expect(r, YAML_STREAM_START_EVENT, "not YAML")) return;
    if (!expect(r, YAML_DOCUMENT_START_EVENT, "the file is empty")) return;
    if (!expect(r, YAML_MAPPING_START_EVENT, "keys and values expected")) return;
    while (next_event(r) && r->event.type != YAML_MAPPING_END_EVENT) {
        read_pair(r);
        if (r->file->is_bad) return;
    }
    if (r->file->is_bad || !expect(r, YAML_DOCUMENT_END_EVENT, "not YAML")) return;
    (void)expect(r, YAML_STREAM_END_EVENT, "more than one document");
}

/* ---- files ---- */

/* OpenCV's first line is a directive that no YAML parser knows: made a comment. */
static void hide_head(char *bytes, size_t n_bytes)
{
    static const char head[] = "%YAML:";
    if (n_bytes >= sizeof head - 1 && memcmp(bytes, head, sizeof head - 1) == 0) bytes[0] = '#';
}

static char *load_bytes(oc_calibration_file_t *file, size_t *n_bytes)
{
    FILE *in = fopen(file->path, "rb");
    char *bytes = in ? malloc(OC_MAX_CALIBRATION_BYTES + 1) : NULL;
    if (!bytes) {
        oc_calibration_refuse(file, 0, "cannot be read: %s", strerror(errno));
        if (in) fclose(in);
        return NULL;
    }
    *n_bytes = fread(bytes, 1, OC_MAX_CALIBRATION_BYTES + 1, in);
    if (ferror(in)) oc_calibration_refuse(file, 0, "cannot be read: %s", strerror(errno));
    if (*n_bytes > OC_MAX_CALIBRATION_BYTES)
        oc_calibration_refuse(file, 0, "larger than %u bytes", OC_MAX_CALIBRATION_BYTES);
    fclose(in);
    if (!file->is_bad) return bytes;
    free(bytes);
    return NULL;
}

bool oc_calibration_file_read(oc_calibration_file_t *file)
{
    file->is_bad = false;
    memset(file->value, 0, sizeof file->value);
    event_reader_t r = {.file = file};
    char *bytes = load_bytes(file, &r.n_bytes);
    if (!bytes) return false;
    hide_head(bytes, r.n_bytes);
    r.bytes = bytes;
    if (yaml_parser_initialize(&r.parser) == 1) {
        yaml_parser_set_input_string(&r.parser, (const unsigned char *)bytes, r.n_bytes);
        read_document(&r);
        if (r.has_event) yaml_event_delete(&r.event);
        yaml_parser_delete(&r.parser);
    } else {
        oc_calibration_refuse(file, 0, "no memory");
    }
    free(bytes);
    return !file->is_bad;
}
