/* SPDX-License-Identifier: BSD-3-Clause
 * The table of outcropd's keys against its schema, and the sample file and the manual against the table.
 *
 * test_config_sample --manual prints docs/man/outcropd.yaml.5 anew. */
#include "config_file.h"

#define DOCS OUTCROP_TEST_DATA "/../../docs/"
#define MAX_LINES 800

static oc_config_t config;

static char sample[64 * 1024], *lines[MAX_LINES];
static int n_lines;

static size_t read_text(FILE *file, char *text, size_t text_bytes)
{
    TEST_ASSERT_NOT_NULL(file);
    const size_t n = fread(text, 1, text_bytes - 1, file);
    TEST_ASSERT_TRUE(n < text_bytes - 1);
    text[n] = '\0';
    fclose(file);
    return n;
}

void setUp(void)
{
    unsetenv("RUNTIME_DIRECTORY");
    (void)read_text(fopen(DOCS "outcropd.yaml", "r"), sample, sizeof sample);
    n_lines = 0;
    for (char *line = strtok(sample, "\n"); line; line = strtok(NULL, "\n")) {
        TEST_ASSERT_TRUE(n_lines < MAX_LINES);
        lines[n_lines++] = line;
    }
}

void tearDown(void)
{
    forget_told();
}

/* ---- the files are the table's ---- */

static void check_printed(const char *path, bool (*print)(FILE *))
{
    static char kept[64 * 1024], printed[64 * 1024];
    (void)read_text(fopen(path, "r"), kept, sizeof kept);
    FILE *file = tmpfile();
    TEST_ASSERT_NOT_NULL(file);
    TEST_ASSERT_TRUE(print(file));
    rewind(file);
    (void)read_text(file, printed, sizeof printed);
    TEST_ASSERT_EQUAL_STRING_MESSAGE(printed, kept, path);
}

static void the_files_are_as_printed(void)
{
    check_printed(DOCS "outcropd.yaml", oc_config_print_sample);
    check_printed(DOCS "man/outcropd.yaml.5", oc_config_print_manual);
    FILE *full = fopen("/dev/full", "w");
    TEST_ASSERT_NOT_NULL(full);
    TEST_ASSERT_FALSE(oc_config_print_sample(full));
    fclose(full);
}

/* ---- the table is the schema's ---- */

static int n_schema_keys;

static void check_row(const char *path, const cyaml_schema_value_t *schema)
{
    const oc_yaml_key_t *key = NULL;
    for (uint32_t i = 0; i < oc_config_form.n_keys; i++) {
        if (strcmp(oc_config_form.keys[i].path, path) == 0) key = &oc_config_form.keys[i];
    }
    TEST_ASSERT_NOT_NULL_MESSAGE(key, path);
    TEST_ASSERT_EQUAL_PTR_MESSAGE(schema, oc_yaml_schema(&oc_config_form, path), path);
    TEST_ASSERT_TRUE_MESSAGE(key->meaning && ends_with(key->meaning, "."), path);
    n_schema_keys++;
    if (!is_leaf(schema)) return;
    const bool is_number = schema->type == CYAML_INT || schema->type == CYAML_UINT || schema->type == CYAML_FLOAT ||
                           schema->type == CYAML_SEQUENCE;
    TEST_ASSERT_TRUE_MESSAGE(is_number || schema->type == CYAML_ENUM || schema->type == CYAML_STRING, path);
    TEST_ASSERT_TRUE_MESSAGE((is_number || key->or_word) == (key->low < key->high), path);
    if (schema->type == CYAML_UINT) TEST_ASSERT_TRUE_MESSAGE(key->low >= 0 && key->high <= 4294967295.0, path);
    if (schema->type == CYAML_INT) TEST_ASSERT_TRUE_MESSAGE(fabs(key->low) < 2e9 && fabs(key->high) < 2e9, path);
    if (schema->type == CYAML_STRING) TEST_ASSERT_TRUE_MESSAGE(key->form || key->or_word, path);
    /* One way to say what holds without the key. */
    const bool is_required = !(schema->flags & CYAML_FLAG_OPTIONAL);
    TEST_ASSERT_EQUAL_MESSAGE(1, is_required + (key->fallback != NULL) + (key->without != NULL), path);
    TEST_ASSERT_TRUE_MESSAGE(key->fallback || key->example, path);
}

static void walk_schema(const char *path, const cyaml_schema_value_t *schema)
{
    if (path[0]) check_row(path, schema);
    char inner[OC_YAML_PATH_BYTES];
    const bool is_list = schema->type == CYAML_SEQUENCE && !is_leaf(schema);
    const cyaml_schema_value_t *mapping = is_list ? schema->sequence.entry : schema;
    if (mapping->type != CYAML_MAPPING) return;
    for (const cyaml_schema_field_t *field = mapping->mapping.fields; field->key; field++) {
        snprintf(inner, sizeof inner, "%.40s%s%s%.40s", path, is_list ? "[]" : "", path[0] ? "." : "", field->key);
        walk_schema(inner, &field->value);
    }
}

static void the_table_has_the_keys_of_the_schema(void)
{
    n_schema_keys = 0;
    walk_schema("", oc_config_form.schema);
    TEST_ASSERT_EQUAL(oc_config_form.n_keys, n_schema_keys);
    TEST_ASSERT_TRUE(n_schema_keys > 90);
}

/* ---- the sample, read as text ---- */

typedef struct sample_line {
    char path[OC_YAML_PATH_BYTES];
    bool is_key, is_held_back;
    const char *value;
} sample_line_t;

/* Follows the indentation: the path of the key of a line, commented out or not. */
static sample_line_t read_line(const char *line, char names[8][40])
{
    sample_line_t out;
    memset(&out, 0, sizeof out);
    const size_t indent = strspn(line, " ");
    const char *rest = line + indent;
    if (rest[0] == '#' && (rest[1] == ' ' || !rest[1])) return out;
    out.is_key = true;
    out.is_held_back = rest[0] == '#';
    if (out.is_held_back) rest++;
    const bool is_item = strncmp(rest, "- ", 2) == 0;
    if (is_item) rest += 2;
    const size_t depth = indent / 2 + is_item, n = strcspn(rest, ":");
    TEST_ASSERT_TRUE_MESSAGE(depth < 8 && rest[n] == ':', line);
    out.value = rest[n + 1] == ' ' ? rest + n + 2 : "";
    snprintf(names[depth], 40, "%.*s", (int)n, rest);
    size_t at = 0;
    for (size_t i = 0; i <= depth; i++) {
        if (strcmp(names[0], "cameras") == 0 && i == 1) continue;
        const char *gap = i == 0 ? "" : strcmp(names[0], "cameras") == 0 && i == 2 ? "[]." : ".";
        at += (size_t)snprintf(out.path + at, sizeof out.path - at, "%s%s", gap, names[i]);
    }
    return out;
}

/* The comment right above a line, as one text. */
static void comment_above(int line, char *text, size_t text_bytes)
{
    int first = line;
    while (first > 0 && strncmp(lines[first - 1] + strspn(lines[first - 1], " "), "# ", 2) == 0) first--;
    text[0] = '\0';
    for (int i = first; i < line; i++) {
        const size_t n = strlen(text);
        snprintf(text + n, text_bytes - n, "%s%s", n > 0 ? " " : "", lines[i] + strspn(lines[i], " ") + 2);
    }
}

static void expect_part(const char *text, const char *format, ...) __attribute__((format(printf, 2, 3)));
static void expect_part(const char *text, const char *format, ...)
{
    char part[400], message[1200];
    va_list args;
    va_start(args, format);
    vsnprintf(part, sizeof part, format, args);
    va_end(args);
    snprintf(message, sizeof message, "\"%s\" is not in \"%.700s\"", part, text);
    if (!strstr(text, part)) TEST_FAIL_MESSAGE(message);
}

static void expect_facts(const char *text, const oc_yaml_key_t *key)
{
    const cyaml_schema_value_t *schema = oc_yaml_schema(&oc_config_form, key->path);
    expect_part(text, "%s", key->meaning);
    if (key->unit) expect_part(text, "%s, ", key->unit);
    if (key->low < key->high) expect_part(text, "%.10g to %.10g", key->low, key->high);
    if (key->or_zero) expect_part(text, ", or 0");
    if (key->or_word) expect_part(text, ", or %s", key->or_word);
    if (key->form) expect_part(text, "%s; ", key->form);
    if (schema->type == CYAML_ENUM) {
        const uint32_t n = schema->enumeration.count;
        expect_part(text, "%s or %s; ", schema->enumeration.strings[n - 2].str, schema->enumeration.strings[n - 1].str);
    }
    if (!(schema->flags & CYAML_FLAG_OPTIONAL)) expect_part(text, "required");
    if (key->fallback) expect_part(text, "; default %s", key->fallback);
    if (key->without) expect_part(text, "without it: %s", key->without);
    if (key->only_with) expect_part(text, "; only with %s", key->only_with);
}

static void every_key_is_in_the_sample_with_its_facts(void)
{
    char names[8][40] = {""}, comment[1000];
    uint32_t next = 0;
    for (int i = 0; i < n_lines; i++) {
        const sample_line_t line = read_line(lines[i], names);
        if (!line.is_key) continue;
        TEST_ASSERT_TRUE(next < oc_config_form.n_keys);
        const oc_yaml_key_t *key = &oc_config_form.keys[next++];
        TEST_ASSERT_EQUAL_STRING(key->path, line.path);
        const char *value = key->example ? key->example : key->fallback ? key->fallback : "";
        TEST_ASSERT_EQUAL_STRING_MESSAGE(value, line.value, key->path);
        comment_above(i, comment, sizeof comment);
        expect_facts(comment, key);
    }
    TEST_ASSERT_EQUAL(oc_config_form.n_keys, next);
}

/* ---- the sample, loaded ---- */

static void add_line(char *text, const char *line)
{
    strcat(text, line);
    strcat(text, "\n");
}

/* With all keys of a kind of file that `is_wanted` likes; the others keep their #, or get one. */
static void free_keys(int kind, bool (*is_wanted)(const oc_yaml_key_t *), char *text)
{
    char names[8][40] = {""};
    text[0] = '\0';
    for (int i = 0; i < n_lines; i++) {
        const sample_line_t line = read_line(lines[i], names);
        const oc_yaml_key_t *key = line.is_key ? oc_yaml_key(&oc_config_form, line.path) : NULL;
        const bool is_free = key && is_of_kind(key, kind) && is_wanted(key);
        if (line.is_key && line.is_held_back && is_free) {
            const size_t indent = strspn(lines[i], " ");
            char freed[300];
            snprintf(freed, sizeof freed, "%.*s%s", (int)indent, lines[i], lines[i] + indent + 1);
            add_line(text, freed);
        } else if (!line.is_key || line.is_held_back || is_free) {
            add_line(text, lines[i]);
        } else {
            strcat(text, "# ");
            add_line(text, lines[i]);
        }
    }
}

static bool is_any(const oc_yaml_key_t *key)
{
    (void)key;
    return true;
}

static bool is_needed(const oc_yaml_key_t *key)
{
    const cyaml_schema_value_t *schema = oc_yaml_schema(&oc_config_form, key->path);
    return !starts_with(key->path, "gpio") && (!is_leaf(schema) || !(schema->flags & CYAML_FLAG_OPTIONAL));
}

static bool is_needed_or_has_default(const oc_yaml_key_t *key)
{
    return is_needed(key) || (key->fallback && !starts_with(key->path, "gpio"));
}

static void the_sample_loads_as_it_is(void)
{
    TEST_ASSERT_TRUE(oc_config_load(DOCS "outcropd.yaml", &config, take_told, told));
    TEST_ASSERT_EQUAL_STRING("tests/data/sites/depot", config.site);
}

static void the_sample_loads_with_every_key(void)
{
    static char text[64 * 1024];
    for (int kind = 0; kind < 4; kind++) {
        free_keys(kind, is_any, text);
        load_well(text, &config);
        TEST_ASSERT_EQUAL((kind & FILE_CAMERAS) ? OC_SOURCE_CAMERAS : OC_SOURCE_SITE, config.source);
        TEST_ASSERT_EQUAL((kind & FILE_CAMERAS) ? 1 : 0, config.cameras.n_cameras);
        TEST_ASSERT_EQUAL_STRING((kind & FILE_CHIPS) ? "" : "mark", config.gpio.mark.line);
        TEST_ASSERT_EQUAL((kind & FILE_CHIPS) ? 4 : 0, config.gpio.mark.offset);
        TEST_ASSERT_EQUAL_STRING("/run/outcrop/outcropd.json", config.status_file);
        TEST_ASSERT_EQUAL_DOUBLE(0.05, config.margin.position_m);
        TEST_ASSERT_EQUAL(kind & FILE_CAMERAS, config.vehicle.area.is_set);
    }
}

/* Keys at their defaults change nothing, to the last bit. */
static void the_defaults_of_the_sample_are_the_defaults(void)
{
    static char text[64 * 1024];
    static oc_config_t least, written;
    for (int kind = 0; kind < 2; kind++) {
        free_keys(kind, is_needed, text);
        load_well(text, &least);
        const size_t n_least = strlen(text);
        free_keys(kind, is_needed_or_has_default, text);
        TEST_ASSERT_TRUE(strlen(text) != n_least);
        load_well(text, &written);
        TEST_ASSERT_EQUAL_MEMORY(&least, &written, sizeof least);
    }
    /* A line's own defaults need the line. */
    load_well(
        "link: {down_url: memq://, up_url: memq://}\nsource: {site: s}\n"
        "gpio: {trigger: {line: a}, strobe: {line: b}, heartbeat: {line: c}, enable: {line: d}, mark: {line: e}}\n",
        &least);
    load_well("link: {down_url: memq://, up_url: memq://}\nsource: {site: s}\ngpio:\n"
              "  trigger: {line: a, active_low: false, mode: per_frame, rate_hz: 10, pulse_us: 1000}\n"
              "  strobe: {line: b, active_low: false, delay_us: 0, pulse_us: 1000}\n"
              "  heartbeat: {line: c, active_low: false, period_ms: 1000}\n"
              "  enable: {line: d, active_low: false, bias: as_is}\n"
              "  mark: {line: e, active_low: false, bias: as_is, debounce_ms: 50}\n",
              &written);
    TEST_ASSERT_EQUAL_MEMORY(&least, &written, sizeof least);
}

/* ---- the manual ---- */

static void every_key_is_in_the_manual_with_its_facts(void)
{
    static char manual[64 * 1024];
    (void)read_text(fopen(DOCS "man/outcropd.yaml.5", "r"), manual, sizeof manual);
    for (uint32_t i = 0; i < oc_config_form.n_keys; i++) {
        char head[OC_YAML_PATH_BYTES + 16], entry[1000];
        snprintf(head, sizeof head, "\n.It Cm %s\n", oc_config_form.keys[i].path);
        const char *start = strstr(manual, head);
        TEST_ASSERT_NOT_NULL_MESSAGE(start, oc_config_form.keys[i].path);
        start += strlen(head);
        const char *end = strstr(start, "\n.It");
        if (!end) end = strstr(start, "\n.El");
        TEST_ASSERT_NOT_NULL(end);
        snprintf(entry, sizeof entry, "%.*s", (int)(end - start), start);
        expect_facts(entry, &oc_config_form.keys[i]);
    }
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "--manual") == 0) return oc_config_print_manual(stdout) ? 0 : 1;
    UNITY_BEGIN();
    RUN_TEST(the_files_are_as_printed);
    RUN_TEST(the_table_has_the_keys_of_the_schema);
    RUN_TEST(every_key_is_in_the_sample_with_its_facts);
    RUN_TEST(the_sample_loads_as_it_is);
    RUN_TEST(the_sample_loads_with_every_key);
    RUN_TEST(the_defaults_of_the_sample_are_the_defaults);
    RUN_TEST(every_key_is_in_the_manual_with_its_facts);
    return UNITY_END();
}
