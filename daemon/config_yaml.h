/* SPDX-License-Identifier: BSD-3-Clause
 * YAML files of both daemons, held against libcyaml's schema and a table of
 * keys. libcyaml loads, but stops at the first fault; so the document is first
 * walked along the same schema, and all its faults are told together.
 *
 *   open -> the caller's own checks of keys against each other -> load -> tell -> close
 */
#ifndef OUTCROP_DAEMON_CONFIG_YAML_H
#define OUTCROP_DAEMON_CONFIG_YAML_H

#include <cyaml/cyaml.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>

#include "config_fault.h"

/* What a file may hold. */
#define OC_YAML_MAX_BYTES (256u * 1024u)
#define OC_YAML_MAX_DEPTH 32
#define OC_YAML_MAX_FAULTS 200u
#define OC_YAML_PATH_BYTES 96u

/* One key or section. Which type it has and whether it is required is in the
 * schema; here is the rest, once for the checks, the sample file and the manual. */
typedef struct oc_yaml_key {
    const char *path;    /* "link.quality"; items of a sequence are "cameras[].name" */
    const char *meaning; /* one sentence */
    const char *unit;    /* NULL: none */
    double low, high;    /* numbers, also those in a sequence; low = high = 0: not a number */
    bool or_zero;        /* 0 as well */
    const char *or_word; /* a text that is this word, or a whole number within low..high */
    const char *form;    /* what a text is: "LCM URL" */
    /* NULL when the text will do, else what is wrong, as "is not an LCM URL"; may be NULL itself. */
    const char *(*check)(const char *text);
    const char *fallback;  /* the default as written in a file; NULL: none */
    const char *without;   /* optional without default: what holds then */
    const char *example;   /* the sample's value where it is not the default */
    const char *only_with; /* refused unless this section is there */
    bool in_sample;        /* optional, but not commented out in the sample */
} oc_yaml_key_t;

typedef struct oc_yaml_form {
    const cyaml_schema_value_t *schema; /* root: a mapping behind a pointer */
    const oc_yaml_key_t *keys;          /* in the order of the sample, sections before their keys */
    uint32_t n_keys;
} oc_yaml_form_t;

/* ---- reading ---- */

typedef struct oc_yaml oc_yaml_t;

/* Read a file and hold it against the form; faults are kept. NULL: no memory. */
oc_yaml_t *oc_yaml_open(const char *path, const oc_yaml_form_t *form);
void oc_yaml_close(oc_yaml_t *yaml);

/* It is a YAML mapping, so that its keys can be asked for. */
bool oc_yaml_is_document(const oc_yaml_t *yaml);

/* Is the key given ("cameras[1].mount")? */
bool oc_yaml_has(const oc_yaml_t *yaml, const char *path);

/* Is it given as a section or list, not as a single value where one of these should be? */
bool oc_yaml_is_section(const oc_yaml_t *yaml, const char *path);

/* A key's text, NULL when it is not given or has a fault of its own. */
const char *oc_yaml_text(const oc_yaml_t *yaml, const char *path);

/* Its text, the default when it is not given, NULL when it has a fault. */
const char *oc_yaml_text_or_default(const oc_yaml_t *yaml, const char *path);

/* Keep a fault, at the line of the key or of what it would stand in. path "" = the file's top. */
__attribute__((format(printf, 3, 4))) void oc_yaml_refuse(oc_yaml_t *yaml, const char *path, const char *format, ...);

/* For a row's check: NULL, or why a text is no LCM URL. */
const char *oc_yaml_url_fault(const char *text);

/* A list [x_min, x_max, y_min, y_max, z_max] of metres, if it is given and its numbers are: refused unless it ascends
 * as float32, as which it travels, and z_max is above 0. */
void oc_yaml_check_area(oc_yaml_t *yaml, const char *path);

/* The file as the schema's structure, NULL while there are faults (one more if libcyaml finds one). */
void *oc_yaml_load(oc_yaml_t *yaml);
void oc_yaml_free(const oc_yaml_form_t *form, void *data);

/* All faults, in the order of lines. True when there is none. */
bool oc_yaml_tell(oc_yaml_t *yaml, oc_config_fault_t on_fault, void *user);

/* ---- the table ---- */

/* Row of a path, whose indices do not matter: "cameras[3].name" or "cameras[].name". NULL: none. */
const oc_yaml_key_t *oc_yaml_key(const oc_yaml_form_t *form, const char *path);

/* Schema of a path; required where it stands unless CYAML_FLAG_OPTIONAL. NULL: none. */
const cyaml_schema_value_t *oc_yaml_schema(const oc_yaml_form_t *form, const char *path);

/* The default as a number; the row must have one. */
double oc_yaml_default_number(const oc_yaml_form_t *form, const char *path);
/* The default's place in an enumeration; the row must have one. */
int64_t oc_yaml_default_word(const oc_yaml_form_t *form, const char *path);

/* "kbit/s, 1 to 1000000; default 8000". Empty for a section without conditions. */
void oc_yaml_facts(const oc_yaml_form_t *form, const oc_yaml_key_t *key, char *text, size_t text_bytes);

/* The sample file: `head`, then every key with its meaning and facts above it.
 * A key whose # has no space behind it is commented out; without the # it is as the default. */
bool oc_yaml_print_sample(const oc_yaml_form_t *form, const char *head, FILE *out);

/* The keys as an mdoc list. */
bool oc_yaml_print_manual(const oc_yaml_form_t *form, FILE *out);

#endif
