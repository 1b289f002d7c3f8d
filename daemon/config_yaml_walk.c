/* SPDX-License-Identifier: BSD-3-Clause
 * A YAML document held against libcyaml's schema and the table of keys, to its end. */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "config_yaml_internal.h"

#define MAX_FIELDS 48u

/* Where the walk is. */
typedef struct yaml_place {
    const char *path;
    int line; /* of the key, or of the item in a sequence */
} yaml_place_t;

static int line_of(const yaml_node_t *node)
{
    return (int)node->start_mark.line + 1;
}

static void enter(oc_yaml_t *yaml, const yaml_place_t *place, const char *text, bool is_bad)
{
    if (yaml->n_entries == yaml->max_entries) {
        const uint32_t n = yaml->max_entries ? 2 * yaml->max_entries : 64;
        yaml_entry_t *more = realloc(yaml->entries, n * sizeof *more);
        if (!more) {
            yaml->is_out_of_memory = true;
            return;
        }
        yaml->entries = more;
        yaml->max_entries = n;
    }
    yaml_entry_t *entry = &yaml->entries[yaml->n_entries++];
    *entry = (yaml_entry_t){.line = place->line, .text = text, .is_bad = is_bad};
    snprintf(entry->path, sizeof entry->path, "%s", place->path);
}

/* ---- names that are nearly right ---- */

/* Levenshtein's distance; words longer than any key are far from all. */
static uint32_t edit_distance(const char *a, const char *b)
{
    uint32_t row[33];
    const size_t n_a = strlen(a), n_b = strlen(b);
    if (n_a > 32 || n_b > 32) return UINT32_MAX;
    for (uint32_t j = 0; j <= n_b; j++) row[j] = j;
    for (uint32_t i = 1; i <= n_a; i++) {
        uint32_t diagonal = row[0];
        row[0] = i;
        for (uint32_t j = 1; j <= n_b; j++) {
            const uint32_t above = row[j];
            uint32_t best = diagonal + (a[i - 1] != b[j - 1]);
            if (above + 1 < best) best = above + 1;
            if (row[j - 1] + 1 < best) best = row[j - 1] + 1;
            row[j] = best;
            diagonal = above;
        }
    }
    return row[n_b];
}

/* The key meant, NULL when none is near: a third of its letters may be wrong. */
static const char *nearest_key(const cyaml_schema_field_t *fields, const char *name)
{
    const char *nearest = NULL;
    uint32_t least = UINT32_MAX;
    for (const cyaml_schema_field_t *field = fields; field->key; field++) {
        const uint32_t distance = edit_distance(name, field->key);
        if (distance < least && 3 * (size_t)distance <= strlen(field->key)) {
            least = distance;
            nearest = field->key;
        }
    }
    return nearest;
}

/* ---- values ---- */

static void walk_value(oc_yaml_t *yaml, const cyaml_schema_value_t *schema, const yaml_node_t *node,
                       const yaml_place_t *place);

static void walk_scalar(oc_yaml_t *yaml, const cyaml_schema_value_t *schema, const yaml_node_t *node,
                        const yaml_place_t *place)
{
    char what[400];
    const oc_yaml_key_t *key = oc_yaml_key(yaml->form, place->path);
    const char *fault = "must be one value, not a list or a section";
    if (node->type == YAML_SCALAR_NODE) fault = oc_yaml_scalar_fault(schema, key, node, what, sizeof what);
    const char *text = node->type == YAML_SCALAR_NODE ? (const char *)node->data.scalar.value : NULL;
    enter(yaml, place, text, fault != NULL);
    if (fault) oc_yaml_fault(yaml, place->line, place->path, "%s", fault);
}

static void walk_sequence(oc_yaml_t *yaml, const cyaml_schema_value_t *schema, const yaml_node_t *node,
                          const yaml_place_t *place)
{
    const uint32_t min = schema->sequence.min, max = schema->sequence.max;
    enter(yaml, place, NULL, node->type != YAML_SEQUENCE_NODE);
    if (node->type != YAML_SEQUENCE_NODE) {
        oc_yaml_fault(yaml, place->line, place->path, "must be a list");
        return;
    }
    const size_t n = (size_t)(node->data.sequence.items.top - node->data.sequence.items.start);
    if (min == max && n != min) {
        oc_yaml_fault(yaml, place->line, place->path, "has %zu items, not %u", n, min);
    } else if (n < min || n > max) {
        oc_yaml_fault(yaml, place->line, place->path, "has %zu items, not %u to %u", n, min, max);
    }
    for (size_t i = 0; i < n && i < max; i++) {
        const yaml_node_t *item = yaml_document_get_node(&yaml->document, node->data.sequence.items.start[i]);
        char path[OC_YAML_PATH_BYTES];
        snprintf(path, sizeof path, "%.60s[%zu]", place->path, i);
        const yaml_place_t inner = {path, line_of(item)};
        walk_value(yaml, schema->sequence.entry, item, &inner);
    }
}

static const cyaml_schema_field_t *find_field(const cyaml_schema_field_t *fields, const yaml_node_t *name)
{
    for (const cyaml_schema_field_t *field = fields; field->key; field++) {
        if (strlen(field->key) == name->data.scalar.length &&
            memcmp(field->key, name->data.scalar.value, name->data.scalar.length) == 0)
            return field;
    }
    return NULL;
}

static void join(char path[OC_YAML_PATH_BYTES], const yaml_place_t *place, const char *name)
{
    snprintf(path, OC_YAML_PATH_BYTES, "%.40s%s%.50s", place->path, place->path[0] ? "." : "", name);
}

static void walk_pair(oc_yaml_t *yaml, const cyaml_schema_field_t *fields, const yaml_node_pair_t *pair,
                      int seen[MAX_FIELDS], const yaml_place_t *place)
{
    const yaml_node_t *name = yaml_document_get_node(&yaml->document, pair->key);
    if (name->type != YAML_SCALAR_NODE) {
        oc_yaml_fault(yaml, line_of(name), place->path, "a key must be a word");
        return;
    }
    const char *word = (const char *)name->data.scalar.value;
    char path[OC_YAML_PATH_BYTES];
    join(path, place, word);
    const yaml_place_t inner = {path, line_of(name)};
    const cyaml_schema_field_t *field = find_field(fields, name);
    if (!field) {
        const char *nearest = nearest_key(fields, word);
        oc_yaml_fault(yaml, inner.line, path, "is no key here%s%s%s", nearest ? ": did you mean " : "",
                      nearest ? nearest : "", nearest ? "?" : "");
        return;
    }
    int *first_line = &seen[field - fields];
    if (*first_line) {
        oc_yaml_fault(yaml, inner.line, path, "is given twice, first in line %d", *first_line);
        return;
    }
    *first_line = inner.line;
    walk_value(yaml, &field->value, yaml_document_get_node(&yaml->document, pair->value), &inner);
}

/* A section that is all commented out, where all its keys are optional. */
static bool is_left_empty(const cyaml_schema_value_t *schema, const yaml_node_t *node)
{
    return (schema->flags & CYAML_FLAG_POINTER_NULL) == CYAML_FLAG_POINTER_NULL && node->type == YAML_SCALAR_NODE &&
           node->data.scalar.length == 0 && node->data.scalar.style == YAML_PLAIN_SCALAR_STYLE;
}

static void walk_mapping(oc_yaml_t *yaml, const cyaml_schema_value_t *schema, const yaml_node_t *node,
                         const yaml_place_t *place)
{
    enter(yaml, place, NULL, node->type != YAML_MAPPING_NODE);
    if (is_left_empty(schema, node)) return;
    if (node->type != YAML_MAPPING_NODE) {
        oc_yaml_fault(yaml, place->line, place->path, "must be a section: keys on lines of their own");
        return;
    }
    const cyaml_schema_field_t *fields = schema->mapping.fields;
    int seen[MAX_FIELDS] = {0};
    for (const yaml_node_pair_t *pair = node->data.mapping.pairs.start; pair < node->data.mapping.pairs.top; pair++) {
        if (yaml->has_more_faults) return;
        walk_pair(yaml, fields, pair, seen, place);
    }
    for (uint32_t i = 0; fields[i].key; i++) {
        assert(i < MAX_FIELDS);
        if (seen[i] || (fields[i].value.flags & CYAML_FLAG_OPTIONAL)) continue;
        char path[OC_YAML_PATH_BYTES];
        join(path, place, fields[i].key);
        oc_yaml_fault(yaml, place->line, path, "is missing");
    }
}

static void walk_value(oc_yaml_t *yaml, const cyaml_schema_value_t *schema, const yaml_node_t *node,
                       const yaml_place_t *place)
{
    switch (schema->type) {
    case CYAML_MAPPING: walk_mapping(yaml, schema, node, place); break;
    case CYAML_SEQUENCE:
    case CYAML_SEQUENCE_FIXED: walk_sequence(yaml, schema, node, place); break;
    default: walk_scalar(yaml, schema, node, place); break;
    }
}

void oc_yaml_walk(oc_yaml_t *yaml)
{
    const yaml_node_t *root = yaml_document_get_root_node(&yaml->document);
    const yaml_place_t top = {"", line_of(root)};
    walk_value(yaml, yaml->form->schema, root, &top);
    for (uint32_t i = 0; i < yaml->n_entries; i++) {
        yaml_entry_t *entry = &yaml->entries[i];
        const oc_yaml_key_t *key = oc_yaml_key(yaml->form, entry->path);
        if (!key || !key->only_with || strchr(entry->path, '[') || oc_yaml_has(yaml, key->only_with)) continue;
        oc_yaml_fault(yaml, entry->line, entry->path, "has a meaning only with %s", key->only_with);
    }
}
