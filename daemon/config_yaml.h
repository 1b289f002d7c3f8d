/* SPDX-License-Identifier: BSD-3-Clause
 * What both daemons' configuration readers share: libcyaml's complaints as one line. */
#ifndef OUTCROP_DAEMON_CONFIG_YAML_H
#define OUTCROP_DAEMON_CONFIG_YAML_H

#include <cyaml/cyaml.h>
#include <stdbool.h>
#include <stddef.h>

/* Load `path` against a schema whose root is a mapping behind a pointer. On
 * failure false, *data NULL, and in error "FILE:LINE: key: what is wrong" as
 * far as libcyaml tells. An empty file is a failure. Free *data with oc_yaml_free. */
bool oc_yaml_load(const char *path, const cyaml_schema_value_t *schema, void **data, char *error, size_t error_bytes);
void oc_yaml_free(const cyaml_schema_value_t *schema, void *data);

#endif
