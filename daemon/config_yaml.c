/* SPDX-License-Identifier: BSD-3-Clause
 * Configuration files in YAML: reading, loading with libcyaml, the list of faults. */
#include "config_yaml.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>

#include "config_yaml_internal.h"

static char *copy_text(const char *text)
{
    const size_t n = strlen(text) + 1;
    char *copy = malloc(n);
    return copy ? memcpy(copy, text, n) : NULL;
}

/* Control characters, C1 ones as well, become \xNN, so that a fault stays one harmless line. */
static void make_printable(const char *text, char *out, size_t out_bytes)
{
    size_t n = 0;
    for (const unsigned char *c = (const unsigned char *)text; *c && n + 5 < out_bytes; c++) {
        const bool is_c1 = c[0] == 0xc2 && c[1] >= 0x80 && c[1] < 0xa0;
        if (*c < 0x20 || *c == 0x7f || is_c1) {
            n += (size_t)snprintf(out + n, out_bytes - n, "\\x%02x", is_c1 ? *++c : *c);
        } else {
            out[n++] = (char)*c;
        }
    }
    out[n] = '\0';
}

void oc_yaml_vfault(oc_yaml_t *yaml, int line, const char *path, const char *format, va_list args)
{
    if (yaml->n_faults == OC_YAML_MAX_FAULTS) {
        yaml->has_more_faults = true;
        return;
    }
    char what[600], place[32] = "", text[1200], printable[1200];
    vsnprintf(what, sizeof what, format, args);
    if (line > 0) snprintf(place, sizeof place, "%d:", line);
    snprintf(text, sizeof text, "%.400s:%s %s%s%s", yaml->path, place, path, path[0] ? ": " : "", what);
    make_printable(text, printable, sizeof printable);
    char *copy = copy_text(printable);
    if (!copy) {
        yaml->is_out_of_memory = true;
        return;
    }
    yaml->faults[yaml->n_faults] = (yaml_fault_t){line, yaml->n_faults, copy};
    yaml->n_faults++;
}

void oc_yaml_fault(oc_yaml_t *yaml, int line, const char *path, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    oc_yaml_vfault(yaml, line, path, format, args);
    va_end(args);
}

static bool read_bytes(oc_yaml_t *yaml)
{
    FILE *file = fopen(yaml->path, "rb");
    if (!file) {
        oc_yaml_fault(yaml, 0, "", "%s", strerror(errno));
        return false;
    }
    yaml->n_bytes = fread(yaml->bytes, 1, OC_YAML_MAX_BYTES + 1, file);
    const int fault = ferror(file) ? errno : 0;
    fclose(file);
    if (fault) oc_yaml_fault(yaml, 0, "", "%s", strerror(fault));
    if (!fault && yaml->n_bytes > OC_YAML_MAX_BYTES)
        oc_yaml_fault(yaml, 0, "", "is larger than %u kB", OC_YAML_MAX_BYTES / 1024u);
    return !fault && yaml->n_bytes <= OC_YAML_MAX_BYTES;
}

static void tell_parser(oc_yaml_t *yaml, const yaml_parser_t *parser)
{
    const int line = (int)parser->problem_mark.line + 1;
    const char *problem = parser->problem ? parser->problem : "is not YAML";
    if (parser->error == YAML_MEMORY_ERROR) {
        yaml->is_out_of_memory = true;
    } else if (parser->error == YAML_READER_ERROR) {
        /* The reader has no line, but the place in bytes. */
        int at = 1;
        for (size_t i = 0; i < parser->problem_offset && i < yaml->n_bytes; i++) at += yaml->bytes[i] == '\n';
        oc_yaml_fault(yaml, at, "", "%s", problem);
    } else if (parser->context) {
        oc_yaml_fault(yaml, line, "", "%s %s", problem, parser->context);
    } else {
        oc_yaml_fault(yaml, line, "", "%s", problem);
    }
}

/* One event of a first pass, which refuses what a document no longer shows. Positive: go on. */
static int take_event(oc_yaml_t *yaml, const yaml_event_t *event, int *depth, int *n_documents)
{
    const int line = (int)event->start_mark.line + 1;
    switch (event->type) {
    case YAML_STREAM_END_EVENT: return 0;
    case YAML_DOCUMENT_START_EVENT:
        if (++*n_documents == 1) return 1;
        oc_yaml_fault(yaml, line, "", "a second document begins here: a file holds one");
        return -1;
    case YAML_ALIAS_EVENT:
        oc_yaml_fault(yaml, line, "", "an alias (*%.40s): write the value out", (const char *)event->data.alias.anchor);
        return -1;
    case YAML_SEQUENCE_START_EVENT:
    case YAML_MAPPING_START_EVENT:
        if (++*depth <= OC_YAML_MAX_DEPTH) return 1;
        oc_yaml_fault(yaml, line, "", "is nested more than %d deep", OC_YAML_MAX_DEPTH);
        return -1;
    case YAML_SEQUENCE_END_EVENT:
    case YAML_MAPPING_END_EVENT: --*depth; return 1;
    default: return 1;
    }
}

static bool scan(oc_yaml_t *yaml)
{
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser)) {
        yaml->is_out_of_memory = true;
        return false;
    }
    yaml_parser_set_input_string(&parser, (const unsigned char *)yaml->bytes, yaml->n_bytes);
    int depth = 0, n_documents = 0, verdict = 1;
    while (verdict > 0) {
        yaml_event_t event;
        if (!yaml_parser_parse(&parser, &event)) {
            tell_parser(yaml, &parser);
            verdict = -1;
        } else {
            verdict = take_event(yaml, &event, &depth, &n_documents);
            yaml_event_delete(&event);
        }
    }
    yaml_parser_delete(&parser);
    if (verdict == 0 && n_documents == 0) oc_yaml_fault(yaml, 0, "", "is empty");
    return verdict == 0 && n_documents == 1;
}

static void compose(oc_yaml_t *yaml)
{
    yaml_parser_t parser;
    if (!yaml_parser_initialize(&parser)) {
        yaml->is_out_of_memory = true;
        return;
    }
    yaml_parser_set_input_string(&parser, (const unsigned char *)yaml->bytes, yaml->n_bytes);
    yaml->has_document = yaml_parser_load(&parser, &yaml->document) != 0;
    if (!yaml->has_document) tell_parser(yaml, &parser);
    yaml_parser_delete(&parser);
    if (!yaml->has_document) return;
    const yaml_node_t *root = yaml_document_get_root_node(&yaml->document);
    if (root && root->type == YAML_MAPPING_NODE) return;
    const bool is_empty = !root || (root->type == YAML_SCALAR_NODE && root->data.scalar.length == 0);
    oc_yaml_fault(yaml, is_empty ? 0 : (int)root->start_mark.line + 1, "",
                  is_empty ? "is empty" : "must be a mapping: lines of \"key: value\"");
    yaml_document_delete(&yaml->document);
    yaml->has_document = false;
}

oc_yaml_t *oc_yaml_open(const char *path, const oc_yaml_form_t *form)
{
    oc_yaml_t *yaml = calloc(1, sizeof *yaml);
    if (!yaml) return NULL;
    yaml->form = form;
    yaml->path = copy_text(path);
    yaml->bytes = malloc(OC_YAML_MAX_BYTES + 1);
    if (!yaml->path || !yaml->bytes) {
        oc_yaml_close(yaml);
        return NULL;
    }
    if (read_bytes(yaml) && scan(yaml)) compose(yaml);
    if (yaml->has_document) oc_yaml_walk(yaml);
    return yaml;
}

void oc_yaml_close(oc_yaml_t *yaml)
{
    if (!yaml) return;
    for (uint32_t i = 0; i < yaml->n_faults; i++) free(yaml->faults[i].text);
    if (yaml->has_document) yaml_document_delete(&yaml->document);
    free(yaml->entries);
    free(yaml->bytes);
    free(yaml->path);
    free(yaml);
}

bool oc_yaml_is_document(const oc_yaml_t *yaml)
{
    return yaml->has_document;
}

static const yaml_entry_t *find_entry(const oc_yaml_t *yaml, const char *path)
{
    for (uint32_t i = 0; i < yaml->n_entries; i++) {
        if (strcmp(yaml->entries[i].path, path) == 0) return &yaml->entries[i];
    }
    return NULL;
}

bool oc_yaml_has(const oc_yaml_t *yaml, const char *path)
{
    return find_entry(yaml, path) != NULL;
}

bool oc_yaml_is_section(const oc_yaml_t *yaml, const char *path)
{
    const yaml_entry_t *entry = find_entry(yaml, path);
    return entry && !entry->text && !entry->is_bad;
}

const char *oc_yaml_text(const oc_yaml_t *yaml, const char *path)
{
    const yaml_entry_t *entry = find_entry(yaml, path);
    return entry && !entry->is_bad ? entry->text : NULL;
}

const char *oc_yaml_text_or_default(const oc_yaml_t *yaml, const char *path)
{
    const oc_yaml_key_t *key = oc_yaml_key(yaml->form, path);
    return oc_yaml_has(yaml, path) || !key ? oc_yaml_text(yaml, path) : key->fallback;
}

/* "a.b[2].c" -> "a.b[2]" -> "a.b" -> "a" -> "". */
static void cut_last(char *path)
{
    size_t n = strlen(path);
    while (n > 0 && path[n - 1] != '.' && path[n - 1] != '[') n--;
    path[n > 0 ? n - 1 : 0] = '\0';
}

void oc_yaml_refuse(oc_yaml_t *yaml, const char *path, const char *format, ...)
{
    char place[OC_YAML_PATH_BYTES];
    snprintf(place, sizeof place, "%s", path);
    const yaml_entry_t *entry = find_entry(yaml, place);
    while (!entry && place[0]) {
        cut_last(place);
        entry = find_entry(yaml, place);
    }
    va_list args;
    va_start(args, format);
    oc_yaml_vfault(yaml, entry ? entry->line : 0, path, format, args);
    va_end(args);
}

/* The walk has told everything; should libcyaml still see a fault, its first line says which. */
__attribute__((format(printf, 3, 0))) static void keep_first_line(cyaml_log_t level, void *context, const char *format,
                                                                  va_list args)
{
    char *first = context;
    if (level < CYAML_LOG_ERROR || first[0]) return;
    vsnprintf(first, 200, format, args);
    first[strcspn(first, "\n")] = '\0';
}

static cyaml_config_t cyaml_config_with(char first[200])
{
    return (cyaml_config_t){.log_fn = keep_first_line,
                            .log_ctx = first,
                            .log_level = CYAML_LOG_ERROR,
                            .mem_fn = cyaml_mem,
                            .flags = CYAML_CFG_NO_ALIAS};
}

void *oc_yaml_load(oc_yaml_t *yaml)
{
    if (!yaml->has_document || yaml->n_faults > 0 || yaml->is_out_of_memory) return NULL;
    char first[200] = "";
    const cyaml_config_t config = cyaml_config_with(first);
    void *data = NULL;
    const cyaml_err_t fault =
        cyaml_load_data((const uint8_t *)yaml->bytes, yaml->n_bytes, &config, yaml->form->schema, &data, NULL);
    if (fault == CYAML_OK && data) return data;
    oc_yaml_fault(yaml, 0, "", "%s", first[0] ? first : cyaml_strerror(fault));
    return NULL;
}

void oc_yaml_free(const oc_yaml_form_t *form, void *data)
{
    char first[200] = "";
    const cyaml_config_t config = cyaml_config_with(first);
    cyaml_free(&config, form->schema, data, 0);
}

static int compare_faults(const void *a, const void *b)
{
    const yaml_fault_t *x = a, *y = b;
    if (x->line != y->line) return x->line < y->line ? -1 : 1;
    return (x->order > y->order) - (x->order < y->order);
}

bool oc_yaml_tell(oc_yaml_t *yaml, oc_config_fault_t on_fault, void *user)
{
    qsort(yaml->faults, yaml->n_faults, sizeof yaml->faults[0], compare_faults);
    for (uint32_t i = 0; i < yaml->n_faults; i++) on_fault(user, yaml->faults[i].text);
    if (yaml->has_more_faults) {
        char line[600];
        snprintf(line, sizeof line, "%.400s: more than %u faults: the rest is not told", yaml->path,
                 OC_YAML_MAX_FAULTS);
        on_fault(user, line);
    }
    if (yaml->is_out_of_memory) on_fault(user, "out of memory");
    return yaml->n_faults == 0 && !yaml->is_out_of_memory;
}
