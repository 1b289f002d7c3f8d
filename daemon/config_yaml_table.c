/* SPDX-License-Identifier: BSD-3-Clause
 * The table of keys: looking up, and printing it as a sample file and as a manual. */
#include <assert.h>
#include <stdlib.h>
#include <string.h>

#include "config_yaml.h"

#define WIDTH 110

/* ---- looking up ---- */

/* "cameras[3].name" is "cameras[].name". */
static bool is_same_path(const char *pattern, const char *path)
{
    while (*pattern && *pattern == *path) {
        const bool is_index = *path == '[';
        pattern++;
        path++;
        if (is_index) path += strspn(path, "0123456789");
    }
    return *pattern == *path;
}

const oc_yaml_key_t *oc_yaml_key(const oc_yaml_form_t *form, const char *path)
{
    for (uint32_t i = 0; i < form->n_keys; i++) {
        if (is_same_path(form->keys[i].path, path)) return &form->keys[i];
    }
    /* An item of a list of numbers has the list's row. */
    const char *bracket = strrchr(path, '[');
    if (!bracket || path[strlen(path) - 1] != ']') return NULL;
    char list[OC_YAML_PATH_BYTES];
    snprintf(list, sizeof list, "%.*s", (int)(bracket - path), path);
    return oc_yaml_key(form, list);
}

const cyaml_schema_value_t *oc_yaml_schema(const oc_yaml_form_t *form, const char *path)
{
    const cyaml_schema_value_t *schema = form->schema;
    while (schema && *path) {
        if (*path == '.') path++;
        if (*path == '[') {
            schema = schema->type == CYAML_SEQUENCE ? schema->sequence.entry : NULL;
            path += strcspn(path, "]");
            if (*path) path++;
            continue;
        }
        const size_t n = strcspn(path, ".[");
        const cyaml_schema_field_t *field = schema->type == CYAML_MAPPING ? schema->mapping.fields : NULL;
        while (field && field->key && (strlen(field->key) != n || memcmp(field->key, path, n) != 0)) field++;
        schema = field && field->key ? &field->value : NULL;
        path += n;
    }
    return schema;
}

double oc_yaml_default_number(const oc_yaml_form_t *form, const char *path)
{
    const oc_yaml_key_t *key = oc_yaml_key(form, path);
    assert(key && key->fallback);
    return strtod(key->fallback, NULL);
}

int64_t oc_yaml_default_word(const oc_yaml_form_t *form, const char *path)
{
    const oc_yaml_key_t *key = oc_yaml_key(form, path);
    const cyaml_schema_value_t *schema = oc_yaml_schema(form, path);
    assert(key && key->fallback && schema && schema->type == CYAML_ENUM);
    for (uint32_t i = 0; i < schema->enumeration.count; i++) {
        if (strcmp(schema->enumeration.strings[i].str, key->fallback) == 0) return schema->enumeration.strings[i].val;
    }
    assert(false);
    return 0;
}

/* ---- facts ---- */

typedef struct text_maker {
    char *text;
    size_t n, size;
} text_maker_t;

__attribute__((format(printf, 2, 3))) static void add(text_maker_t *maker, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    const int n = vsnprintf(maker->text + maker->n, maker->size - maker->n, format, args);
    va_end(args);
    const size_t left = maker->size - maker->n - 1;
    maker->n += n > 0 && (size_t)n < left ? (size_t)n : left;
}

static bool has_range(const oc_yaml_key_t *key)
{
    return key->low != 0 || key->high != 0;
}

static void add_list(text_maker_t *maker, const cyaml_schema_value_t *schema, const oc_yaml_key_t *key)
{
    const bool is_numbers = schema->sequence.entry->type == CYAML_FLOAT;
    if (schema->sequence.min != schema->sequence.max) add(maker, "%u to ", schema->sequence.min);
    add(maker, "%u %s", schema->sequence.max, is_numbers ? "numbers" : "items");
    if (has_range(key)) add(maker, ", %.10g to %.10g", key->low, key->high);
}

static void add_range(text_maker_t *maker, const cyaml_schema_value_t *schema, const oc_yaml_key_t *key)
{
    if (key->unit) add(maker, "%s, ", key->unit);
    if (schema->type == CYAML_SEQUENCE) {
        add_list(maker, schema, key);
    } else if (schema->type == CYAML_ENUM) {
        const uint32_t n = schema->enumeration.count;
        for (uint32_t i = 0; i < n; i++)
            add(maker, "%s%s", i == 0 ? "" : i + 1 == n ? " or " : ", ", schema->enumeration.strings[i].str);
    } else if (has_range(key)) {
        add(maker, "%.10g to %.10g", key->low, key->high);
        if (key->or_zero) add(maker, ", or 0");
        if (key->or_word) add(maker, ", or %s", key->or_word);
    } else if (key->form) {
        add(maker, "%s", key->form);
    }
}

void oc_yaml_facts(const oc_yaml_form_t *form, const oc_yaml_key_t *key, char *text, size_t text_bytes)
{
    const cyaml_schema_value_t *schema = oc_yaml_schema(form, key->path);
    text_maker_t maker = {text, 0, text_bytes};
    text[0] = '\0';
    assert(schema);
    add_range(&maker, schema, key);
    const char *gap = maker.n > 0 ? "; " : "";
    if (!(schema->flags & CYAML_FLAG_OPTIONAL)) {
        add(&maker, "%srequired", gap);
    } else if (key->fallback) {
        add(&maker, "%sdefault %s", gap, key->fallback);
    } else if (key->without) {
        add(&maker, "%swithout it: %s", gap, key->without);
    }
    if (key->only_with) add(&maker, "%sonly with %s", maker.n > 0 ? "; " : "", key->only_with);
}

/* ---- the sample ---- */

static int depth_of(const char *path)
{
    int depth = 0;
    for (; *path; path++) depth += *path == '.' || *path == '[';
    return depth;
}

/* Its section is shown, and so is it: required, or an empty section, or of use in the sample. */
static bool is_shown(const oc_yaml_form_t *form, const oc_yaml_key_t *key)
{
    const cyaml_schema_value_t *schema = oc_yaml_schema(form, key->path);
    const bool is_empty_section = (schema->flags & CYAML_FLAG_POINTER_NULL) == CYAML_FLAG_POINTER_NULL;
    if ((schema->flags & CYAML_FLAG_OPTIONAL) && !is_empty_section && !key->in_sample) return false;
    const char *dot = strrchr(key->path, '.');
    if (!dot) return true;
    const size_t n = (size_t)(dot - key->path) - (dot[-1] == ']' ? 2 : 0);
    char section[OC_YAML_PATH_BYTES];
    snprintf(section, sizeof section, "%.*s", (int)n, key->path);
    return is_shown(form, oc_yaml_key(form, section));
}

static void print_comment(FILE *out, int indent, const char *text)
{
    while (*text) {
        size_t n = strlen(text);
        if (n > (size_t)(WIDTH - indent)) {
            n = (size_t)(WIDTH - indent);
            while (n > 1 && text[n] != ' ') n--;
        }
        fprintf(out, "%*s# %.*s\n", indent, "", (int)n, text);
        text += n;
        while (*text == ' ') text++;
    }
}

static void print_key(const oc_yaml_form_t *form, uint32_t i, FILE *out)
{
    const oc_yaml_key_t *key = &form->keys[i];
    const int indent = 2 * depth_of(key->path);
    const size_t n = strlen(key->path);
    const char *dot = strrchr(key->path, '.'), *name = dot ? dot + 1 : key->path;
    const bool is_first_of_item = dot && dot[-1] == ']' && i > 0 && strlen(form->keys[i - 1].path) < n &&
                                  strchr(form->keys[i - 1].path, '[') == NULL;
    if (indent == 0) fputc('\n', out);
    const int margin = is_first_of_item ? indent - 2 : indent;
    char facts[400];
    oc_yaml_facts(form, key, facts, sizeof facts);
    print_comment(out, margin, key->meaning);
    print_comment(out, margin, facts);
    const char *value = key->example ? key->example : key->fallback ? key->fallback : "";
    fprintf(out, "%*s%s%s%s:%s%s\n", margin, "", is_shown(form, key) ? "" : "#", is_first_of_item ? "- " : "", name,
            value[0] ? " " : "", value);
}

bool oc_yaml_print_sample(const oc_yaml_form_t *form, const char *head, FILE *out)
{
    fputs(head, out);
    for (uint32_t i = 0; i < form->n_keys; i++) print_key(form, i, out);
    return fflush(out) == 0 && !ferror(out);
}

/* ---- the manual ---- */

/* roff takes a backslash, and a dot or quote at a line's start, for itself. */
static void print_roff(FILE *out, const char *text)
{
    if (*text == '.' || *text == '\'') fputs("\\&", out);
    for (; *text; text++) {
        if (*text == '\\') {
            fputs("\\e", out);
        } else {
            fputc(*text, out);
        }
    }
    fputc('\n', out);
}

bool oc_yaml_print_manual(const oc_yaml_form_t *form, FILE *out)
{
    fputs(".Bl -tag -width Ds\n", out);
    for (uint32_t i = 0; i < form->n_keys; i++) {
        const oc_yaml_key_t *key = &form->keys[i];
        char facts[400];
        oc_yaml_facts(form, key, facts, sizeof facts);
        fprintf(out, ".It Cm %s\n", key->path);
        print_roff(out, key->meaning);
        if (facts[0]) fputs(".br\n", out);
        if (facts[0]) print_roff(out, facts);
    }
    fputs(".El\n", out);
    return !ferror(out);
}
