/* SPDX-License-Identifier: BSD-3-Clause
 * Single values of a configuration file. Stricter than libcyaml, which takes 010 for 8 and "yes, please" for true. */
#include <ctype.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "config_yaml_internal.h"

/* Where a message is put together. */
typedef struct scalar_check {
    const char *text;
    char *what;
    size_t what_bytes;
} scalar_check_t;

/* "TEXT" and what is wrong with it; long texts are cut. */
static const char *quote(const scalar_check_t *check, const char *complaint)
{
    const bool is_long = strlen(check->text) > 60;
    snprintf(check->what, check->what_bytes, "\"%.60s%s\" %s", check->text, is_long ? "..." : "", complaint);
    return check->what;
}

/* A sign or none and digits, without needless zeros: 010 is eight to some and ten to others. */
static bool is_whole_number(const char *text)
{
    if (strcmp(text, "-0") == 0) return false;
    if (*text == '-' || *text == '+') text++;
    if (text[0] == '0' && text[1]) return false;
    const size_t n = strspn(text, "0123456789");
    return n > 0 && !text[n];
}

static bool is_decimal(const char *text)
{
    if (*text == '-' || *text == '+') text++;
    const size_t n_whole = strspn(text, "0123456789");
    text += n_whole;
    size_t n_part = 0;
    if (*text == '.') {
        n_part = strspn(++text, "0123456789");
        text += n_part;
    }
    if (n_whole + n_part == 0) return false;
    if (*text != 'e' && *text != 'E') return !*text;
    text++;
    if (*text == '-' || *text == '+') text++;
    const size_t n_exponent = strspn(text, "0123456789");
    return n_exponent > 0 && !text[n_exponent];
}

static bool is_same_word(const char *a, const char *b)
{
    while (*a && tolower((unsigned char)*a) == tolower((unsigned char)*b)) {
        a++;
        b++;
    }
    return !*a && !*b;
}

static bool is_not_finite_word(const char *text)
{
    static const char *const words[] = {"nan", "inf", "infinity"};
    if (*text == '-' || *text == '+') text++;
    if (*text == '.') text++;
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (is_same_word(text, words[i])) return true;
    }
    return false;
}

static bool has_range(const oc_yaml_key_t *key)
{
    return key && (key->low != 0 || key->high != 0);
}

static void type_limits(const cyaml_schema_value_t *schema, double *low, double *high)
{
    const int bits = 8 * (int)schema->data_size;
    *low = schema->type == CYAML_INT ? -ldexp(1, bits - 1) : 0;
    *high = ldexp(1, schema->type == CYAML_INT ? bits - 1 : bits) - 1;
    if (schema->type != CYAML_FLOAT) return;
    *low = -1e300;
    *high = 1e300;
}

static const char *range_fault(const scalar_check_t *check, const cyaml_schema_value_t *schema,
                               const oc_yaml_key_t *key)
{
    double low, high;
    type_limits(schema, &low, &high);
    if (has_range(key)) {
        low = key->low;
        high = key->high;
    }
    const double value = strtod(check->text, NULL);
    if ((value >= low && value <= high) || (key && key->or_zero && value == 0)) return NULL;
    snprintf(check->what, check->what_bytes, "%.60s is not within %.10g..%.10g%s", check->text, low, high,
             key && key->or_zero ? " or 0" : "");
    return check->what;
}

static const char *number_fault(const scalar_check_t *check, const cyaml_schema_value_t *schema,
                                const oc_yaml_key_t *key)
{
    const bool is_float = schema->type == CYAML_FLOAT;
    if (is_not_finite_word(check->text)) return quote(check, "is not finite");
    if (is_float && !is_decimal(check->text)) return quote(check, "is not a number");
    if (!is_float && !is_whole_number(check->text)) return quote(check, "is not a whole number");
    return range_fault(check, schema, key);
}

static const char *word_fault(const scalar_check_t *check, const cyaml_schema_value_t *schema)
{
    char list[200] = "";
    for (uint32_t i = 0; i < schema->enumeration.count; i++) {
        const char *word = schema->enumeration.strings[i].str;
        if (strcmp(word, check->text) == 0) return NULL;
        const size_t n = strlen(list);
        snprintf(list + n, sizeof list - n, "%s%s", i > 0 ? ", " : "", word);
    }
    char complaint[240];
    snprintf(complaint, sizeof complaint, "is not one of %s", list);
    return quote(check, complaint);
}

static const char *text_fault(const scalar_check_t *check, const cyaml_schema_value_t *schema, const oc_yaml_key_t *key)
{
    if (key && key->or_word) {
        char complaint[80];
        if (strcmp(check->text, key->or_word) == 0) return NULL;
        snprintf(complaint, sizeof complaint, "is neither %s nor a whole number", key->or_word);
        return is_whole_number(check->text) ? range_fault(check, schema, key) : quote(check, complaint);
    }
    const size_t n = strlen(check->text);
    if (n < schema->string.min) return "is empty";
    if (n > schema->string.max) {
        snprintf(check->what, check->what_bytes, "is %zu bytes long, more than %u", n, schema->string.max);
        return check->what;
    }
    const char *complaint = key && key->check ? key->check(check->text) : NULL;
    return complaint ? quote(check, complaint) : NULL;
}

/* Written down, but as nothing: YAML's null. */
static bool is_null(const yaml_node_t *node)
{
    static const char *const words[] = {"", "~", "null", "Null", "NULL"};
    if (node->data.scalar.style != YAML_PLAIN_SCALAR_STYLE) return false;
    for (size_t i = 0; i < sizeof words / sizeof words[0]; i++) {
        if (strcmp((const char *)node->data.scalar.value, words[i]) == 0) return true;
    }
    return false;
}

const char *oc_yaml_scalar_fault(const cyaml_schema_value_t *schema, const oc_yaml_key_t *key, const yaml_node_t *node,
                                 char *what, size_t what_bytes)
{
    const scalar_check_t check = {(const char *)node->data.scalar.value, what, what_bytes};
    for (size_t i = 0; i < node->data.scalar.length; i++) {
        const unsigned char c = node->data.scalar.value[i];
        if (c < 0x20 || c == 0x7f) return "holds a control character";
    }
    if (is_null(node)) return "has no value";
    switch (schema->type) {
    case CYAML_INT:
    case CYAML_UINT:
    case CYAML_FLOAT: return number_fault(&check, schema, key);
    case CYAML_ENUM: return word_fault(&check, schema);
    case CYAML_STRING: return text_fault(&check, schema, key);
    default: return "has a type that is not handled";
    }
}

const char *oc_yaml_url_fault(const char *text)
{
    const size_t n = strspn(text, "abcdefghijklmnopqrstuvwxyz0123456789");
    return n > 0 && strncmp(text + n, "://", 3) == 0 ? NULL : "is not an LCM URL, as udpm://239.255.76.67:7667?ttl=1";
}

void oc_yaml_check_area(oc_yaml_t *yaml, const char *path)
{
    double v[5];
    for (int i = 0; i < 5; i++) {
        char item[OC_YAML_PATH_BYTES];
        snprintf(item, sizeof item, "%.60s[%d]", path, i);
        const char *text = oc_yaml_text(yaml, item);
        if (!text) return;
        v[i] = strtod(text, NULL);
    }
    if (!((float)v[0] < (float)v[1] && (float)v[2] < (float)v[3] && v[4] >= 1e-6))
        oc_yaml_refuse(yaml, path, "must be [x_min, x_max, y_min, y_max, z_max], ascending, z_max above 0");
}
