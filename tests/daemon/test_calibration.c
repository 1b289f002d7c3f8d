/* SPDX-License-Identifier: BSD-3-Clause
 * Calibration files: literal samples, every refusal with its line, round trips to the bit, and seeded damage. */
#include "unity.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "calibration.h"

static char path[64];
static char error[400];
static oc_calibration_t calibration;

/* As camera_calibration writes it. */
static const char ros[] = "image_width: 640\n"                                            /* 1 */
                          "image_height: 480\n"                                           /* 2 */
                          "camera_name: narrow_stereo\n"                                  /* 3 */
                          "camera_matrix:\n"                                              /* 4 */
                          "  rows: 3\n"                                                   /* 5 */
                          "  cols: 3\n"                                                   /* 6 */
                          "  data: [438.78354,   0.     , 305.59368,\n"                   /* 7 */
                          "           0.     , 437.30216, 243.73832,\n"                   /* 8 */
                          "           0.     ,   0.     ,   1.     ]\n"                   /* 9 */
                          "distortion_model: plumb_bob\n"                                 /* 10 */
                          "distortion_coefficients:\n"                                    /* 11 */
                          "  rows: 1\n"                                                   /* 12 */
                          "  cols: 5\n"                                                   /* 13 */
                          "  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]\n" /* 14 */
                          "rectification_matrix:\n"                                       /* 15 */
                          "  rows: 3\n"                                                   /* 16 */
                          "  cols: 3\n"                                                   /* 17 */
                          "  data: [1., 0., 0.,\n"                                        /* 18 */
                          "         0., 1., 0.,\n"                                        /* 19 */
                          "         0., 0., 1.]\n"                                        /* 20 */
                          "projection_matrix:\n"                                          /* 21 */
                          "  rows: 3\n"                                                   /* 22 */
                          "  cols: 4\n"                                                   /* 23 */
                          "  data: [393.65375,   0.     , 322.79794,   0.     ,\n"        /* 24 */
                          "           0.     , 395.30606, 241.09095,   0.     ,\n"        /* 25 */
                          "           0.     ,   0.     ,   1.     ,   0.     ]\n";       /* 26 */

static const char opencv[] = "%YAML:1.0\n"
                             "---\n"
                             "calibration_time: \"Wed Nov 25 06:00:04 2026\"\n"
                             "image_width: 1280\n"
                             "image_height: 720\n"
                             "flags: 0\n"
                             "fisheye_model: 1\n"
                             "camera_matrix: !!opencv-matrix\n"
                             "   rows: 3\n"
                             "   cols: 3\n"
                             "   dt: d\n"
                             "   data: [ 5.3591573396163199e+02, 0., 6.4228315473308373e+02, 0.,\n"
                             "       5.3591573396163199e+02, 3.5357082469107734e+02, 0., 0., 1. ]\n"
                             "distortion_coefficients: !!opencv-matrix\n"
                             "   rows: 4\n"
                             "   cols: 1\n"
                             "   dt: d\n"
                             "   data: [ -2.6637260909660682e-02, -3.8588898922304653e-03, 1.7831947042852964e-03,\n"
                             "       -2.8122100441115472e-04 ]\n"
                             "extrinsic_parameters: !!opencv-matrix\n"
                             "   rows: 1\n"
                             "   cols: 6\n"
                             "   dt: d\n"
                             "   data: [ .Nan, 1., 2., 3., 4., 5. ]\n";

static void put(const char *bytes, size_t n_bytes)
{
    FILE *out = fopen(path, "wb");
    TEST_ASSERT_NOT_NULL(out);
    TEST_ASSERT_EQUAL(n_bytes, fwrite(bytes, 1, n_bytes, out));
    TEST_ASSERT_EQUAL(0, fclose(out));
}

static bool read_bytes(const char *bytes, size_t n_bytes)
{
    put(bytes, n_bytes);
    snprintf(error, sizeof error, "untouched");
    return oc_calibration_read(path, &calibration, error, sizeof error);
}

/* The sample with the first `from` replaced by `to`. */
static bool read_changed(const char *sample, const char *from, const char *to)
{
    static char bytes[8192];
    const char *at = strstr(sample, from);
    TEST_ASSERT_NOT_NULL_MESSAGE(at, from);
    const int n = snprintf(bytes, sizeof bytes, "%.*s%s%s", (int)(at - sample), sample, to, at + strlen(from));
    return read_bytes(bytes, (size_t)n);
}

static void expect_refused(const char *sample, const char *from, const char *to, int line, const char *words)
{
    char head[80];
    memset(&calibration, 0x5a, sizeof calibration);
    const oc_calibration_t before = calibration;
    TEST_ASSERT_FALSE_MESSAGE(read_changed(sample, from, to), to);
    snprintf(head, sizeof head, "%s:%d: ", path, line);
    TEST_ASSERT_EQUAL_STRING_LEN_MESSAGE(head, error, strlen(head), error);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, words), error);
    TEST_ASSERT_NULL(strchr(error, '\n'));
    TEST_ASSERT_EQUAL_MEMORY(&before, &calibration, sizeof before);
}

void setUp(void)
{
    snprintf(path, sizeof path, "/tmp/outcrop_calibration_%d.yaml", (int)getpid());
    memset(&calibration, 0, sizeof calibration);
}

void tearDown(void)
{
    (void)remove(path);
}

/* ---- samples ---- */

static void a_ros_file_is_read(void)
{
    TEST_ASSERT_TRUE_MESSAGE(read_bytes(ros, sizeof ros - 1), error);
    const oc_lens_t *lens = &calibration.lens;
    TEST_ASSERT_EQUAL_STRING("narrow_stereo", calibration.camera_name);
    TEST_ASSERT_EQUAL(OC_LENS_PLUMB_BOB, lens->model);
    const double k[5] = {-0.361976, 0.110510, 0.001014, 0.000505, 0};
    for (int i = 0; i < 5; i++) TEST_ASSERT_TRUE(k[i] == lens->k[i]);
    const oc_intrinsics_t raw = {438.78354, 437.30216, 305.59368, 243.73832, 640, 480};
    const oc_intrinsics_t rectified = {393.65375, 395.30606, 322.79794, 241.09095, 640, 480};
    TEST_ASSERT_EQUAL_MEMORY(&raw, &lens->raw, sizeof raw);
    TEST_ASSERT_EQUAL_MEMORY(&rectified, &lens->rectified, sizeof raw);
    TEST_ASSERT_EQUAL_STRING("untouched", error);
}

static void an_opencv_file_is_read(void)
{
    TEST_ASSERT_TRUE_MESSAGE(read_bytes(opencv, sizeof opencv - 1), error);
    const oc_lens_t *lens = &calibration.lens;
    TEST_ASSERT_EQUAL_STRING("", calibration.camera_name);
    TEST_ASSERT_EQUAL(OC_LENS_FISHEYE, lens->model);
    const double k[5] = {-2.6637260909660682e-02, -3.8588898922304653e-03, 1.7831947042852964e-03,
                         -2.8122100441115472e-04, 0};
    for (int i = 0; i < 5; i++) TEST_ASSERT_TRUE(k[i] == lens->k[i]);
    const oc_intrinsics_t raw = {
        5.3591573396163199e+02, 5.3591573396163199e+02, 6.4228315473308373e+02, 3.5357082469107734e+02, 1280, 720};
    TEST_ASSERT_EQUAL_MEMORY(&raw, &lens->raw, sizeof raw);
    TEST_ASSERT_EQUAL_MEMORY(&raw, &lens->rectified, sizeof raw);
    /* Without the separator, as OpenCV 2 wrote. */
    TEST_ASSERT_TRUE_MESSAGE(read_changed(opencv, "---\n", ""), error);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(opencv, "camera_matrix", "Camera_Matrix"), error);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(opencv, "image_width", "image_Width"), error);
}

static void what_is_said_otherwise_is_understood(void)
{
    TEST_ASSERT_TRUE_MESSAGE(read_changed(ros, "plumb_bob", "rational_polynomial"), error);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(ros, "distortion_model: plumb_bob\n", ""), error);
    TEST_ASSERT_EQUAL(OC_LENS_PLUMB_BOB, calibration.lens.model);
    /* The right one of a stereo pair, whose baseline is in the fourth column. */
    TEST_ASSERT_TRUE_MESSAGE(read_changed(ros, "322.79794,   0.     ", "322.79794,   -47.25"), error);
    TEST_ASSERT_TRUE(calibration.lens.rectified.cx_px == 322.79794);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(ros, "  data: [1., 0., 0.,", "  data: [1., 9e-7, 0.,"), error);
    static const char none[] = "K: [9, 0, 20, 0, 9, 20, 0, 0, 1]\nD: []\nimage_width: 32\nimage_height: 4096\n";
    TEST_ASSERT_TRUE_MESSAGE(read_bytes(none, sizeof none - 1), error);
    TEST_ASSERT_EQUAL(OC_LENS_PINHOLE, calibration.lens.model);
    TEST_ASSERT_EQUAL(4096, calibration.lens.raw.height_px);
    /* Fewer coefficients: the others are 0. */
    static const char fewer[] = "K: [9, 0, 20, 0, 9, 20, 0, 0, 1]\nD: [0.5, 0.25]\nimage_width: 40\nimage_height: 40\n";
    TEST_ASSERT_TRUE_MESSAGE(read_bytes(fewer, sizeof fewer - 1), error);
    TEST_ASSERT_TRUE(calibration.lens.k[1] == 0.25 && calibration.lens.k[2] == 0 && calibration.lens.k[4] == 0);
    TEST_ASSERT_EQUAL(OC_LENS_PLUMB_BOB, calibration.lens.model);
    /* Keys that are not ours may hold anything. */
    TEST_ASSERT_TRUE_MESSAGE(read_changed(ros, "camera_name: ", "? {a: [b, {c: d}]}\n: [x, {y: 1}]\ncamera_name: "),
                             error);
    TEST_ASSERT_TRUE_MESSAGE(read_changed(ros, "  rows: 3\n", "  ? [rows]\n  : 3\n  note: {rows: 7}\n"), error);
}

/* ---- refusals ---- */

static void sides_and_names_out_of_range_are_refused(void)
{
    expect_refused(ros, "image_width: 640\n", "", 1, "image_width: missing");
    expect_refused(ros, "480", "31", 2, "\"31\" is not within 32..4096");
    expect_refused(ros, "480", "4097", 2, "is not within");
    expect_refused(ros, "480", "18446744073709552096", 2, "is not within");
    expect_refused(ros, "480", "-480", 2, "is not within");
    expect_refused(ros, "480", "480.0", 2, "is not within");
    expect_refused(ros, "480", "''", 2, "is not within");
    expect_refused(ros, "480", "[480]", 2, "a single value expected");
    expect_refused(ros, "narrow_stereo", "\"a\\nb\"", 3, "control characters");
    expect_refused(ros, "narrow_stereo", "\"a\\0b\"", 3, "longer than");
    expect_refused(ros, "narrow_stereo", "0123456789012345678901234567890123456789012345678901234567890123", 3,
                   "longer than 63 bytes");
    expect_refused(ros, "image_height", "image_width", 2, "image_width: given on line 1 already");
    expect_refused(ros, "camera_name: ", "K: [1, 0, 1, 0, 1, 1, 0, 0, 1]\ncamera_name: ", 5,
                   "camera_matrix: given on line 3 already");
}

static void matrices_that_are_none_are_refused(void)
{
    expect_refused(ros, "438.78354", "0", 4, "focal lengths must be positive");
    expect_refused(ros, "437.30216", "-1", 4, "focal lengths must be positive");
    expect_refused(ros, "305.59368", "1e9", 4, "principal point");
    expect_refused(ros, "438.78354,   0. ", "438.78354, 1e-3 ", 4, "not of the form");
    expect_refused(ros, "393.65375", "0", 21, "focal lengths");
    expect_refused(ros, "  data: [1., 0., 0.,", "  data: [0.999, 0.04, 0.,", 15, "not the identity");
    expect_refused(ros, "  rows: 3\n  cols: 3\n  data: [438.78354,   0.     , 305.59368,\n", "  data: [\n", 4,
                   "6 numbers, not 9");
}

static void numbers_that_are_none_are_refused(void)
{
    static const char *const words[] = {".Nan",  ".nan", "nan", ".Inf",  "-.Inf", "inf", "0x10",      "1e999",
                                        "1_000", "''",   "1;5", "1.2.3", "~",     "e",   "\"\\x01\"", "\xc3\xa9"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++) {
        expect_refused(ros, "438.78354", words[i], 7, "is not a finite number");
        expect_refused(ros, "0.001014", words[i], 14, "is not a finite number");
    }
    expect_refused(ros, "438.78354", "[1]", 7, "is not a finite number");
    expect_refused(ros, "[-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]", "5", 14, "a list of numbers expected");
    expect_refused(ros, "[-0.361976", "[1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17", 14, "more than 16 numbers");
    expect_refused(ros, "0.110510, ", "", 11, "1 x 5, but 4 numbers");
    expect_refused(ros, "rows: 3", "rows: 1e300", 5, "one small number");
    expect_refused(ros, "rows: 3", "rows: -1", 5, "one small number");
    expect_refused(ros, "rows: 3", "rows: 3\n  rows: 3", 6, "one small number");
    expect_refused(ros, "rows: 3", "data: [1]\n  rows: 3", 8, "data given twice");
    expect_refused(ros, "  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]\n", "", 11, "no data");
}

static void models_that_are_not_ours_are_refused(void)
{
    expect_refused(ros, "plumb_bob", "omni", 10, "\"omni\" is not plumb_bob");
    expect_refused(ros, "plumb_bob", "\"plumb_bob\\n\"", 10, "is not plumb_bob");
    expect_refused(ros, "plumb_bob", "equidistant", 11, "a fisheye has 4, not 5");
    expect_refused(ros, "cols: 5\n  data: [-0.361976, ", "cols: 8\n  data: [0, 0, 0, -0.361976, ", 11,
                   "recalibrate with plumb_bob");
    expect_refused(ros, "cols: 5\n  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]",
                   "cols: 6\n  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000, 1e-300]", 11,
                   "recalibrate with plumb_bob");
    expect_refused(opencv, "fisheye_model: 1", "fisheye_model: 2", 7, "neither 0 nor 1");
    expect_refused(opencv, "flags: 0", "distortion_model: plumb_bob", 7, "contradicts");
    expect_refused(ros, "distortion_coefficients", "distortion", 1, "distortion_coefficients: missing");
}

static void files_that_are_none_are_refused(void)
{
    expect_refused("x", "x", "", 1, "the file is empty");
    expect_refused("x", "x", "- 1\n- 2\n", 1, "keys and values expected");
    expect_refused("x", "x", "\n\n\ta: [", 3, "not YAML");
    expect_refused("x", "x", "a: 1\n\n\xff\xfe: 2\n", 3, "not YAML");
    expect_refused(ros, "camera_name", "---\ncamera_name", 3, "more than one document");
    expect_refused(ros, "camera_name: ", "a: &a [1]\nb: *a\ncamera_name: ", 4, "aliases");
}

static void bombs_and_large_files_are_refused(void)
{
    expect_refused("x", "x", "a: &a [x,x]\nb: &b [*a,*a]\nc: &c [*b,*b]\nimage_width: 640\n", 2, "aliases");
    static char large[70000];
    memset(large, '#', sizeof large);
    TEST_ASSERT_FALSE(read_bytes(large, 65537));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, "larger than 65536 bytes"), error);
    memcpy(large, ros, sizeof ros - 1);
    TEST_ASSERT_TRUE_MESSAGE(read_bytes(large, 65536), error);
    memset(large, '[', sizeof large);
    TEST_ASSERT_FALSE(read_bytes(large, 65536));
    /* Which libyaml would take seconds over. */
    memset(large, '{', sizeof large);
    TEST_ASSERT_FALSE(read_bytes(large, 65536));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, ":1: nested more than 16 deep"), error);
    expect_refused("x", "x", "a: 1\nb: [[[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]]", 2, "nested more than 16 deep");
    TEST_ASSERT_TRUE_MESSAGE(read_changed(ros, "camera_name", "b: [[[[[[[[[[[[[[[1]]]]]]]]]]]]]]]\ncamera_name"),
                             error);
    TEST_ASSERT_FALSE(oc_calibration_read("/nowhere/at/all", &calibration, error, sizeof error));
    TEST_ASSERT_EQUAL_STRING("/nowhere/at/all: cannot be read: No such file or directory", error);
    TEST_ASSERT_FALSE(oc_calibration_read("/", &calibration, error, sizeof error));
    TEST_ASSERT_FALSE(oc_calibration_read("/nowhere/at/all", &calibration, error, 5));
    TEST_ASSERT_EQUAL_STRING("/now", error);
}

/* ---- round trips ---- */

static uint64_t state;

static uint64_t draw_bits(void)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return state * 0x2545f4914f6cdd1du;
}

static double draw(double low, double high)
{
    return low + (high - low) * (double)(draw_bits() >> 11) * 0x1p-53;
}

static void seed(const char *test)
{
    const char *given = getenv("OUTCROP_TEST_SEED");
    state = given ? strtoull(given, NULL, 0) : 0x9e3779b97f4a7c15u;
    printf("%s: OUTCROP_TEST_SEED=%" PRIu64 "\n", test, state);
}

static void draw_calibration(oc_calibration_t *c)
{
    static const char *const names[] = {"", "front", "it's", "- {#: \"", "\xc3\xa4 b ", "123", "null", "  x"};
    memset(c, 0, sizeof *c);
    snprintf(c->camera_name, sizeof c->camera_name, "%s", names[draw_bits() % 8]);
    oc_lens_t *lens = &c->lens;
    lens->model = (oc_lens_model_t)(draw_bits() % 3);
    for (int i = 0; i < (lens->model == OC_LENS_FISHEYE ? 4 : 5) && lens->model != OC_LENS_PINHOLE; i++)
        lens->k[i] = draw(-1, 1) * pow(10, draw(-40, 2));
    lens->raw = (oc_intrinsics_t){draw(1, 5000),
                                  pow(10, draw(-300, 300)),
                                  draw(-100, 800),
                                  draw(0, 500),
                                  32 + (uint32_t)(draw_bits() % 4065),
                                  400};
    lens->raw.cx_px = fmin(lens->raw.cx_px, 4.0 * lens->raw.width_px);
    lens->raw.cx_px = fmax(lens->raw.cx_px, -3.0 * lens->raw.width_px);
    lens->rectified = lens->raw;
    if (draw_bits() % 2) lens->rectified.fy_px = draw(1, 1000);
    if (draw_bits() % 2) lens->rectified.cx_px = draw(0, 100);
}

static void write_file(const oc_calibration_t *c, oc_calibration_form_t form, bool expected)
{
    FILE *out = fopen(path, "wb");
    TEST_ASSERT_NOT_NULL(out);
    TEST_ASSERT_EQUAL(expected, oc_calibration_write(out, c, form));
    TEST_ASSERT_EQUAL(0, fclose(out));
}

static void what_is_written_reads_back_to_the_bit(void)
{
    seed(__func__);
    for (int i = 0; i < 600; i++) {
        oc_calibration_t c;
        draw_calibration(&c);
        for (int form = 0; form < 2; form++) {
            write_file(&c, (oc_calibration_form_t)form, true);
            TEST_ASSERT_TRUE_MESSAGE(oc_calibration_read(path, &calibration, error, sizeof error), error);
            TEST_ASSERT_EQUAL_STRING(c.camera_name, calibration.camera_name);
            TEST_ASSERT_EQUAL(c.lens.model, calibration.lens.model);
            TEST_ASSERT_EQUAL_MEMORY(c.lens.k, calibration.lens.k, sizeof c.lens.k);
            TEST_ASSERT_EQUAL_MEMORY(&c.lens.raw, &calibration.lens.raw, sizeof c.lens.raw);
            TEST_ASSERT_EQUAL_MEMORY(&c.lens.rectified, &calibration.lens.rectified, sizeof c.lens.raw);
        }
    }
}

/* A YAML 1.1 reader would take "1e+22" for a word, and "500" for a whole number. */
static void each_number_is_written_with_a_point(void)
{
    TEST_ASSERT_TRUE(read_bytes(ros, sizeof ros - 1));
    calibration.lens.raw.fx_px = 1e22;
    calibration.lens.raw.fy_px = 500;
    calibration.lens.k[2] = -1e-300;
    write_file(&calibration, OC_CALIBRATION_ROS, true);
    char text[2048] = "";
    FILE *in = fopen(path, "rb");
    TEST_ASSERT_NOT_NULL(in);
    TEST_ASSERT_TRUE(fread(text, 1, sizeof text - 1, in) > 0);
    TEST_ASSERT_EQUAL(0, fclose(in));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "data: [1.0e+22, 0.0, 305.59368"), text);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(text, "0.0, 500.0, 243.7383"), text);
    int n_points = 0, n_commas = 0;
    for (const char *c = text; *c; c++) {
        n_points += *c == '.';
        n_commas += *c == ',';
    }
    TEST_ASSERT_EQUAL(9 + 5 + 9 + 12, n_points);
    TEST_ASSERT_EQUAL(8 + 4 + 8 + 11, n_commas);
}

static void what_cannot_be_told_is_not_written(void)
{
    oc_calibration_t good;
    TEST_ASSERT_TRUE(read_bytes(ros, sizeof ros - 1));
    good = calibration;
    for (int form = 0; form < 2; form++) {
        oc_calibration_t bad = good;
        bad.lens.rectified.width_px++;
        write_file(&bad, (oc_calibration_form_t)form, false);
        bad = good;
        bad.lens.k[3] = (double)NAN;
        write_file(&bad, (oc_calibration_form_t)form, false);
        bad = good;
        bad.camera_name[2] = '\n';
        write_file(&bad, (oc_calibration_form_t)form, false);
        FILE *full = fopen("/dev/full", "wb");
        TEST_ASSERT_NOT_NULL(full);
        TEST_ASSERT_FALSE(oc_calibration_write(full, &good, (oc_calibration_form_t)form));
        (void)fclose(full);
    }
}

/* ---- damage ---- */

static void check_whatever_is_read(void)
{
    if (!oc_calibration_read(path, &calibration, error, sizeof error)) {
        TEST_ASSERT_EQUAL_STRING_LEN(path, error, strlen(path));
        TEST_ASSERT_EQUAL(':', error[strlen(path)]);
        for (const char *c = error; *c; c++) TEST_ASSERT_TRUE((unsigned char)*c >= 32 && *c != 127);
        return;
    }
    TEST_ASSERT_TRUE(oc_lens_is_valid(&calibration.lens));
    TEST_ASSERT_NOT_NULL(memchr(calibration.camera_name, '\0', sizeof calibration.camera_name));
    const oc_calibration_t first = calibration;
    write_file(&first, OC_CALIBRATION_OPENCV, true);
    TEST_ASSERT_TRUE_MESSAGE(oc_calibration_read(path, &calibration, error, sizeof error), error);
    TEST_ASSERT_TRUE(oc_lens_is_equal(&first.lens, &calibration.lens));
}

static void damaged_files_are_refused_or_make_a_valid_lens(void)
{
    seed(__func__);
    static const char *const bits[] = {"[", "]",  "{",    "}", ":", "\n",  "&a ",   "*a", "!!x ", "\"", "'", "#",  "-",
                                       "|", "\t", "\xff", "%", "?", "...", "---\n", "9",  "e",    ".",  ",", "  ", "0"};
    int n_read = 0;
    for (int i = 0; i < 6000; i++) {
        static char bytes[4096];
        const char *sample = i % 2 ? ros : opencv;
        size_t n = strlen(sample);
        memcpy(bytes, sample, n);
        for (uint64_t changes = 1 + draw_bits() % 3; changes > 0; changes--) {
            const size_t at = draw_bits() % n, kind = draw_bits() % 4;
            const char *bit = bits[draw_bits() % (sizeof bits / sizeof *bits)];
            if (kind == 0) bytes[at] = (char)draw_bits();
            if (kind == 1) memcpy(bytes + at, bit, strlen(bit) < n - at ? strlen(bit) : n - at);
            if (kind == 2 && n > 200) memmove(bytes + at, bytes + at + 1, --n - at);
            if (kind == 3 && draw_bits() % 8 == 0 && at > 100) n = at;
        }
        put(bytes, n);
        const oc_calibration_t before = calibration;
        check_whatever_is_read();
        n_read += memcmp(&before, &calibration, sizeof before) != 0;
    }
    TEST_ASSERT_TRUE(n_read > 600 && n_read < 5900);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(a_ros_file_is_read);
    RUN_TEST(an_opencv_file_is_read);
    RUN_TEST(what_is_said_otherwise_is_understood);
    RUN_TEST(sides_and_names_out_of_range_are_refused);
    RUN_TEST(matrices_that_are_none_are_refused);
    RUN_TEST(numbers_that_are_none_are_refused);
    RUN_TEST(models_that_are_not_ours_are_refused);
    RUN_TEST(files_that_are_none_are_refused);
    RUN_TEST(bombs_and_large_files_are_refused);
    RUN_TEST(what_is_written_reads_back_to_the_bit);
    RUN_TEST(each_number_is_written_with_a_point);
    RUN_TEST(what_cannot_be_told_is_not_written);
    RUN_TEST(damaged_files_are_refused_or_make_a_valid_lens);
    return UNITY_END();
}
