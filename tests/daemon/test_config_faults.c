/* SPDX-License-Identifier: BSD-3-Clause
 * Files full of faults: the maker of a file knows where it put them and what
 * must be told. Then files damaged at random, which only must not hurt. */
#include <stdint.h>

#include "config_file.h"

static uint64_t seed = 1, state;

static uint32_t random_below(uint32_t n)
{
    state = state * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((state >> 33) % n);
}

static oc_config_t config;
static file_plan_t plan;
static char text[256 * 1024];
static size_t n_text;

static char *expected[MAX_TOLD];
static int n_expected;

void setUp(void)
{
    state = seed;
}

void tearDown(void)
{
    forget_told();
}

/* ---- faults that are put in ---- */

__attribute__((format(printf, 3, 4))) static void expect(int line, const char *path, const char *format, ...)
{
    char what[700], full[1000];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    snprintf(full, sizeof full, "%s:%d: %s: %s", file_path, line, path, what);
    TEST_ASSERT_TRUE(n_expected < MAX_TOLD);
    expected[n_expected++] = strdup(full);
}

static bool is_number(const cyaml_schema_value_t *schema)
{
    return schema->type == CYAML_INT || schema->type == CYAML_UINT || schema->type == CYAML_FLOAT;
}

static void expect_out_of_range(const file_item_t *item, bool is_high)
{
    const oc_yaml_key_t *key = item->key;
    const double step = item->schema->type == CYAML_FLOAT ? 0.125 : 1;
    char value[40];
    snprintf(value, sizeof value, "%.10g", is_high ? key->high + step : key->low - step);
    set_item(&plan, item->path, value);
    expect(item->line, item->path, "%s is not within %.10g..%.10g%s", value, key->low, key->high,
           key->or_zero ? " or 0" : "");
}

static void expect_not_finite(const file_item_t *item)
{
    static const char *const words[] = {".nan", "NaN", "inf", "-.inf", "+Infinity"};
    const char *word = words[random_below(5)];
    set_item(&plan, item->path, word);
    if (item->key->or_word)
        expect(item->line, item->path, "\"%s\" is neither auto nor a whole number", word);
    else
        expect(item->line, item->path, "\"%s\" is not finite", word);
}

static void expect_junk(const file_item_t *item)
{
    set_item(&plan, item->path, "Pear!");
    const cyaml_schema_value_t *schema = item->schema;
    if (is_number(schema)) {
        expect(item->line, item->path, "\"Pear!\" is not a %snumber", schema->type == CYAML_FLOAT ? "" : "whole ");
    } else if (schema->type == CYAML_ENUM) {
        char list[200] = "";
        for (uint32_t i = 0; i < schema->enumeration.count; i++) {
            if (i > 0) strcat(list, ", ");
            strcat(list, schema->enumeration.strings[i].str);
        }
        expect(item->line, item->path, "\"Pear!\" is not one of %s", list);
    } else if (item->key->or_word) {
        expect(item->line, item->path, "\"Pear!\" is neither auto nor a whole number");
    } else if (ends_with(item->path, "url")) {
        expect(item->line, item->path, "\"Pear!\" is not an LCM URL, as udpm://239.255.76.67:7667?ttl=1");
    } else if (ends_with(item->path, "].name")) {
        expect(item->line, item->path, "\"Pear!\" has other characters than a-z, 0-9, _ and -");
    } else if (ends_with(item->path, "].device")) {
        expect(item->line, item->path, "\"Pear!\" is not an absolute path");
    } else {
        char value[601];
        memset(value, 'x', 600);
        value[600] = '\0';
        set_item(&plan, item->path, value);
        expect(item->line, item->path, "is 600 bytes long, more than %u", schema->string.max);
    }
}

static void expect_in_list(const file_item_t *item, uint32_t kind)
{
    if (kind == 0) {
        set_item(&plan, item->path, "5");
        expect(item->line, item->path, "must be a list");
    } else if (kind == 1) {
        set_item(&plan, item->path, "[1, 2]");
        expect(item->line, item->path, "has 2 items, not 5");
    } else {
        set_item(&plan, item->path, "[-1, red, -1, 1, 200001]");
        char path[OC_YAML_PATH_BYTES + 4];
        snprintf(path, sizeof path, "%s[1]", item->path);
        expect(item->line, path, "\"red\" is not a number");
        snprintf(path, sizeof path, "%s[4]", item->path);
        expect(item->line, path, "200001 is not within -200000..200000");
    }
}

/* A value that will not do. */
static void spoil_value(const file_item_t *item)
{
    if (item->schema->type == CYAML_SEQUENCE) {
        expect_in_list(item, random_below(3));
        return;
    }
    const bool is_ranged = is_number(item->schema) || item->key->or_word;
    const uint32_t kind = random_below(is_ranged ? 6 : 3);
    if (kind == 0) {
        set_item(&plan, item->path, random_below(2) ? "[1]" : "{a: 1}");
        expect(item->line, item->path, "must be one value, not a list or a section");
    } else if (kind == 1) {
        set_item(&plan, item->path, random_below(2) ? "" : "~");
        expect(item->line, item->path, "has no value");
    } else if (kind == 2) {
        expect_junk(item);
    } else if (kind == 3) {
        expect_not_finite(item);
    } else {
        expect_out_of_range(item, kind == 4);
    }
}

/* A name with a wrong last letter, unless its absence would be told in another way. */
static bool can_misspell(const file_item_t *item)
{
    return !ends_with(item->path, ".line") && !ends_with(item->path, ".chip") && !ends_with(item->path, ".offset");
}

static bool is_required(const file_item_t *item)
{
    return !(item->schema->flags & CYAML_FLAG_OPTIONAL);
}

static void expect_misspelt(const file_item_t *item, int section_line)
{
    char path[OC_YAML_PATH_BYTES];
    snprintf(path, sizeof path, "%s", item->path);
    path[strlen(path) - 1] = 'q';
    expect(item->line, path, "is no key here: did you mean %s?", item->name);
    if (is_required(item)) expect(section_line, item->path, "is missing");
}

typedef enum spoiling { SPOIL_NOT, SPOIL_VALUE, SPOIL_NAME, SPOIL_TWICE } spoiling_t;

static int line_of_section(const file_item_t *item)
{
    return item->section >= 0 ? plan.items[item->section].line : plan.items[0].line;
}

/* Lines are dealt out first: blank lines and comments in between, and a second line for what is given twice. */
static void spoil_file(uint32_t share, spoiling_t spoiling[MAX_ITEMS])
{
    int line = 1;
    for (int i = 0; i < plan.n; i++) {
        file_item_t *item = &plan.items[i];
        spoiling[i] = SPOIL_NOT;
        if (is_leaf(item->schema) && random_below(100) < share) spoiling[i] = (spoiling_t)(1 + random_below(3));
        if (spoiling[i] == SPOIL_NAME && !can_misspell(item)) spoiling[i] = SPOIL_VALUE;
        /* A second "- " would be another camera. */
        if (spoiling[i] == SPOIL_TWICE && item->is_first) spoiling[i] = SPOIL_VALUE;
        item->line = line + (int)random_below(3);
        line = item->line + (spoiling[i] == SPOIL_TWICE ? 2 : 1);
    }
    for (int i = 0; i < plan.n; i++) {
        const file_item_t *item = &plan.items[i];
        if (spoiling[i] == SPOIL_VALUE) spoil_value(item);
        if (spoiling[i] == SPOIL_NAME) expect_misspelt(item, line_of_section(item));
        if (spoiling[i] == SPOIL_TWICE)
            expect(item->line + 1, item->path, "is given twice, first in line %d", item->line);
    }
}

static void print_spoilt(const spoiling_t spoiling[MAX_ITEMS])
{
    int line = 1;
    n_text = 0;
    for (int i = 0; i < plan.n; i++) {
        const file_item_t *item = &plan.items[i];
        for (; line < item->line; line++)
            n_text += (size_t)snprintf(text + n_text, sizeof text - n_text, random_below(2) ? "\n" : "  # pear: [\n");
        char name[40];
        snprintf(name, sizeof name, "%s", item->name);
        if (spoiling[i] == SPOIL_NAME) name[strlen(name) - 1] = 'q';
        for (int k = spoiling[i] == SPOIL_TWICE ? 2 : 1; k > 0; k--, line++)
            n_text += print_item(item, name, text + n_text, sizeof text - n_text);
    }
}

static int line_in(const char *fault)
{
    return atoi(fault + strlen(file_path) + 1);
}

static int compare_texts(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

static void compare_told(const char *what)
{
    for (int i = 1; i < n_told; i++)
        TEST_ASSERT_TRUE_MESSAGE(line_in(told[i - 1]) <= line_in(told[i]), "not in the order of lines");
    qsort(told, (size_t)n_told, sizeof told[0], compare_texts);
    qsort(expected, (size_t)n_expected, sizeof expected[0], compare_texts);
    for (int i = 0; i < n_told && i < n_expected; i++) TEST_ASSERT_EQUAL_STRING_MESSAGE(expected[i], told[i], what);
    TEST_ASSERT_EQUAL_INT_MESSAGE(n_expected, n_told, what);
}

static void forget_expected(void)
{
    for (int i = 0; i < n_expected; i++) free(expected[i]);
    n_expected = 0;
}

static void every_fault_is_told_with_its_line(void)
{
    static spoiling_t spoiling[MAX_ITEMS];
    int most = 0;
    write_file("", 0); /* makes the path, which the expectations need */
    for (int round = 0; round < 400; round++) {
        const int kind = (int)random_below(4);
        plan_file(&plan, kind, 1 + (int)random_below(2));
        spoil_file(round % 8 == 0 ? 0 : 5 + random_below(75), spoiling);
        print_spoilt(spoiling);
        char what[80];
        snprintf(what, sizeof what, "seed %llu, round %d, kind %d", (unsigned long long)seed, round, kind);
        (void)load_bytes(text, n_text, &config);
        compare_told(what);
        if (n_expected > most) most = n_expected;
        forget_expected();
    }
    TEST_ASSERT_TRUE(most >= 15);
    printf("seed %llu: at most %d faults in one file\n", (unsigned long long)seed, most);
}

/* Each key alone with each fault: the file has exactly those lines. */
static void every_key_has_every_fault(void)
{
    static spoiling_t spoiling[MAX_ITEMS];
    int n_files = 0;
    for (int kind = 0; kind < 4; kind++) {
        plan_file(&plan, kind, 1);
        for (int target = 0; target < plan.n; target++) {
            if (!is_leaf(plan.items[target].schema)) continue;
            for (int round = 0; round < 12; round++, n_files++) {
                plan_file(&plan, kind, 1);
                spoil_file(0, spoiling);
                spoil_value(&plan.items[target]);
                print_spoilt(spoiling);
                TEST_ASSERT_FALSE_MESSAGE(load_bytes(text, n_text, &config), plan.items[target].path);
                compare_told(plan.items[target].path);
                forget_expected();
            }
        }
    }
    TEST_ASSERT_TRUE(n_files > 2000);
}

/* ---- what is taken is within what the vehicle takes ---- */

static void the_ends_of_every_range_are_taken(void)
{
    for (int kind = 0; kind < 4; kind++) {
        plan_file(&plan, kind, 1);
        for (int target = 0; target < plan.n; target++) {
            const file_item_t *item = &plan.items[target];
            if (!is_leaf(item->schema) || !(is_number(item->schema) || item->key->or_word)) continue;
            for (int end = 0; end < 2; end++) {
                char value[40];
                plan_file(&plan, kind, 1);
                snprintf(value, sizeof value, "%.10g", end ? item->key->high : item->key->low);
                set_item(&plan, item->path, value);
                if (ends_with(item->path, ".offset")) set_item(&plan, plan.items[target - 1].path, "another_chip");
                /* The one pair of keys whose ranges depend on each other. */
                if (strcmp(item->path, "junctions.lambda_min_px") == 0) set_item(&plan, "junctions.lambda_px", "24");
                n_text = print_plan(&plan, text, sizeof text);
                if (!load_bytes(text, n_text, &config)) TEST_FAIL_MESSAGE(told[0]);
                TEST_ASSERT_TRUE_MESSAGE(oc_vehicle_size(&config.vehicle) > 0, item->path);
            }
        }
    }
}

/* ---- damage ---- */

static void damage_bytes(void)
{
    static const char *const pieces[] = {"\xff",         "[",  "{",    "- ",  "\n",    "\t", ": ",    "*a",
                                         "&a ",          "\"", "'",    "|\n", "!!",    "%",  "---\n", "\xc2\x85",
                                         "\xef\xbb\xbf", "? ", "<<: ", "~",   "1e999", "#",  "\\x00"};
    const uint32_t at = random_below((uint32_t)n_text);
    switch (random_below(6)) {
    case 0: text[at] = (char)random_below(256); break;
    case 1: text[at] = '\0'; break;
    case 2: text[at] = (char)(text[at] ^ (1 << random_below(8))); break;
    case 3: {
        const uint32_t n = random_below(40) < n_text - at ? random_below((uint32_t)n_text - at) : 1;
        memmove(text + at, text + at + n, n_text - at - n);
        n_text -= n;
        break;
    }
    case 4: {
        const char *piece = pieces[random_below(sizeof pieces / sizeof pieces[0])];
        const size_t n = strlen(piece);
        memmove(text + at + n, text + at, n_text - at);
        memcpy(text + at, piece, n);
        n_text += n;
        break;
    }
    default: { /* a part again, somewhere else */
        const uint32_t from = random_below((uint32_t)n_text);
        uint32_t n = random_below(200);
        if (n > n_text - from) n = (uint32_t)n_text - from;
        char part[200];
        memcpy(part, text + from, n);
        memmove(text + at + n, text + at, n_text - at);
        memcpy(text + at, part, n);
        n_text += n;
    }
    }
    if (n_text == 0) text[n_text++] = '\n';
}

static void check_told_lines(void)
{
    for (int i = 0; i < n_told; i++) {
        TEST_ASSERT_EQUAL_STRING_LEN(file_path, told[i], strlen(file_path));
        TEST_ASSERT_TRUE(strlen(told[i]) < 1200);
        /* Without a line are only faults of the whole file; what libcyaml alone would find is not among them. */
        const char *rest = told[i] + strlen(file_path) + 1;
        TEST_ASSERT_TRUE_MESSAGE(atoi(rest) > 0 || strcmp(rest, " is empty") == 0 || starts_with(rest, " more than"),
                                 told[i]);
        for (const unsigned char *c = (const unsigned char *)told[i]; *c; c++)
            TEST_ASSERT_TRUE_MESSAGE(*c >= 0x20 && *c != 0x7f, "a control character is told");
    }
}

static void damaged_files_do_no_harm(void)
{
    int n_taken = 0, n_refused = 0;
    for (int round = 0; round < 6000; round++) {
        plan_file(&plan, (int)random_below(4), 1 + (int)random_below(2));
        n_text = print_plan(&plan, text, sizeof text);
        for (uint32_t i = random_below(random_below(2) ? 1 : 20) + 1; i > 0; i--) damage_bytes();
        if (load_bytes(text, n_text, &config)) {
            TEST_ASSERT_TRUE(oc_vehicle_size(&config.vehicle) > 0);
            n_taken++;
        } else {
            check_told_lines();
            n_refused++;
        }
    }
    printf("seed %llu: %d damaged files taken, %d refused\n", (unsigned long long)seed, n_taken, n_refused);
    TEST_ASSERT_TRUE(n_taken > 20 && n_refused > 1000);
}

/* ---- numbers, however they are written ---- */

/* Random texts of the letters of numbers: what is taken is what strtod makes of all of it, and libcyaml agrees. */
static void numbers_are_what_they_say(void)
{
    static const char letters[] = "0011259+-..eEx_nai ";
    int n_taken = 0, n_told_in_all = 0;
    for (int round = 0; round < 20000; round++) {
        const bool is_whole = random_below(2);
        char number[12], file[300], *end;
        const uint32_t n = 1 + random_below(6);
        for (uint32_t i = 0; i < n; i++) number[i] = letters[random_below(sizeof letters - 1)];
        number[n] = '\0';
        snprintf(file, sizeof file, "link: {down_url: memq://, up_url: memq://}\nsource: {site: s}\n%s: \"%s\"\n",
                 is_whole ? "stored_views" : "margins:\n  position_m", number);
        const double value = strtod(number, &end);
        if (!load(file, &config)) {
            n_told_in_all += n_told;
            TEST_ASSERT_EQUAL_INT_MESSAGE(1, n_told, number);
            TEST_ASSERT_EQUAL_INT_MESSAGE(is_whole ? 3 : 4, line_in(told[0]), told[0]);
            continue;
        }
        n_taken++;
        TEST_ASSERT_EQUAL_MESSAGE('\0', *end, number);
        TEST_ASSERT_FALSE_MESSAGE(strpbrk(number, " xn_"), number);
        if (is_whole)
            TEST_ASSERT_EQUAL_DOUBLE(value, config.vehicle.stored_views);
        else
            TEST_ASSERT_EQUAL_DOUBLE(value, config.margin.position_m);
    }
    TEST_ASSERT_TRUE(n_taken > 500 && n_told_in_all > 5000);
}

int main(int argc, char **argv)
{
    if (argc > 1) seed = strtoull(argv[1], NULL, 10);
    UNITY_BEGIN();
    RUN_TEST(every_fault_is_told_with_its_line);
    RUN_TEST(every_key_has_every_fault);
    RUN_TEST(the_ends_of_every_range_are_taken);
    RUN_TEST(numbers_are_what_they_say);
    RUN_TEST(damaged_files_do_no_harm);
    return UNITY_END();
}
