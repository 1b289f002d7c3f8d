/* SPDX-License-Identifier: BSD-3-Clause
 * What the files behind config_yaml.h share. */
#ifndef OUTCROP_DAEMON_CONFIG_YAML_INTERNAL_H
#define OUTCROP_DAEMON_CONFIG_YAML_INTERNAL_H

#include <stdarg.h>
#include <yaml.h>

#include "config_yaml.h"

typedef struct yaml_fault {
    int line;       /* 0: of the whole file */
    uint32_t order; /* in which they were found, for faults of one line */
    char *text;
} yaml_fault_t;

/* A key that the walk met and the schema knows. */
typedef struct yaml_entry {
    char path[OC_YAML_PATH_BYTES];
    int line;
    const char *text; /* of a scalar, else NULL; the document's */
    bool is_bad;
} yaml_entry_t;

struct oc_yaml {
    const oc_yaml_form_t *form;
    char *path, *bytes;
    size_t n_bytes;
    yaml_document_t document;
    bool has_document;
    yaml_fault_t faults[OC_YAML_MAX_FAULTS];
    uint32_t n_faults;
    bool has_more_faults, is_out_of_memory;
    yaml_entry_t *entries;
    uint32_t n_entries, max_entries;
};

/* line 0: the fault is the whole file's. */
__attribute__((format(printf, 4, 0))) void oc_yaml_vfault(oc_yaml_t *yaml, int line, const char *path,
                                                          const char *format, va_list args);
__attribute__((format(printf, 4, 5))) void oc_yaml_fault(oc_yaml_t *yaml, int line, const char *path,
                                                         const char *format, ...);

/* Hold the document against the form. */
void oc_yaml_walk(oc_yaml_t *yaml);

/* A scalar against its schema and row; NULL when it will do, else what is wrong with it, in `what`. */
const char *oc_yaml_scalar_fault(const cyaml_schema_value_t *schema, const oc_yaml_key_t *key, const yaml_node_t *node,
                                 char *what, size_t what_bytes);

#endif
