/* SPDX-License-Identifier: BSD-3-Clause
 * What a calibration file's values mean, and the files written again. */
#include "calibration.h"

#include <ctype.h>
#include <math.h>
#include <string.h>

#include "calibration_yaml.h"
#include "core/image.h"

/* ---- reading ---- */

/* Off which an entry of a matrix that should be 0 or 1 is something else. */
#define ENTRY_SLACK 1e-6

static const oc_calibration_value_t *find(oc_calibration_file_t *file, oc_calibration_key_t key, const char *name)
{
    const oc_calibration_value_t *value = &file->value[key];
    if (value->line == 0) oc_calibration_refuse(file, 1, "%s: missing", name);
    return value->line == 0 ? NULL : value;
}

static uint32_t take_side(oc_calibration_file_t *file, oc_calibration_key_t key, const char *name)
{
    const oc_calibration_value_t *value = find(file, key, name);
    if (!value) return 0;
    uint32_t side_px = 0;
    const size_t n = strlen(value->text);
    const bool is_whole = n >= 1 && n <= 6 && strspn(value->text, "0123456789") == n;
    for (size_t i = 0; is_whole && i < n; i++) side_px = 10 * side_px + (uint32_t)(value->text[i] - '0');
    if (side_px < OC_MIN_IMAGE_SIDE || side_px > OC_MAX_IMAGE_SIDE)
        oc_calibration_refuse(file, value->line, "%s: \"%s\" is not within %u..%u", value->key, value->text,
                              OC_MIN_IMAGE_SIDE, OC_MAX_IMAGE_SIDE);
    return side_px;
}

static void take_name(oc_calibration_file_t *file, oc_calibration_t *calibration)
{
    const oc_calibration_value_t *value = &file->value[OC_KEY_NAME];
    snprintf(calibration->camera_name, sizeof calibration->camera_name, "%s", value->text);
    for (const char *c = value->text; *c; c++) {
        if (iscntrl((unsigned char)*c)) oc_calibration_refuse(file, value->line, "camera_name: has control characters");
    }
}

static bool is_matrix_like(const double *m, const double *like, const bool *is_free, uint32_t n)
{
    for (uint32_t i = 0; i < n; i++) {
        if (!is_free[i] && !(fabs(m[i] - like[i]) <= ENTRY_SLACK)) return false;
    }
    return true;
}

/* fx 0 cx | 0 fy cy | 0 0 1, with as many columns as given; a fourth may hold anything in its first two rows. */
static void take_pinhole(oc_calibration_file_t *file, const oc_calibration_value_t *value, uint32_t columns,
                         oc_intrinsics_t *k)
{
    static const double like[2][12] = {{0, 0, 0, 0, 0, 0, 0, 0, 1}, {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0}};
    static const bool is_free[2][12] = {{1, 0, 1, 0, 1, 1, 0, 0, 0}, {1, 0, 1, 1, 0, 1, 1, 1, 0, 0, 0, 0}};
    const double *m = value->number;
    if (value->n != 3 * columns) {
        oc_calibration_refuse(file, value->line, "%s: %u numbers, not %u", value->key, value->n, 3 * columns);
        return;
    }
    k->fx_px = m[0];
    k->cx_px = m[2];
    k->fy_px = m[columns + 1];
    k->cy_px = m[columns + 2];
    if (!(k->fx_px > 0 && k->fy_px > 0))
        oc_calibration_refuse(file, value->line, "%s: focal lengths must be positive: is the camera calibrated?",
                              value->key);
    if (!is_matrix_like(m, like[columns - 3], is_free[columns - 3], 3 * columns))
        oc_calibration_refuse(file, value->line, "%s: not of the form fx 0 cx, 0 fy cy, 0 0 1", value->key);
    if (!oc_intrinsics_is_valid(k))
        oc_calibration_refuse(file, value->line, "%s: the principal point %g, %g is far outside of the picture",
                              value->key, k->cx_px, k->cy_px);
}

static bool is_one_of(const char *text, const char *a, const char *b)
{
    return strcmp(text, a) == 0 || strcmp(text, b) == 0;
}

static oc_lens_model_t take_model(oc_calibration_file_t *file)
{
    const oc_calibration_value_t *model = &file->value[OC_KEY_MODEL], *flag = &file->value[OC_KEY_FISHEYE];
    const bool is_equidistant = is_one_of(model->text, "equidistant", "fisheye");
    const bool is_polynomial = is_one_of(model->text, "plumb_bob", "rational_polynomial");
    const bool is_fisheye = is_one_of(flag->text, "1", "true");
    if (model->line > 0 && !is_equidistant && !is_polynomial)
        oc_calibration_refuse(file, model->line,
                              "distortion_model: \"%s\" is not plumb_bob, rational_polynomial, equidistant or fisheye",
                              model->text);
    if (flag->line > 0 && !is_fisheye && !is_one_of(flag->text, "0", "false"))
        oc_calibration_refuse(file, flag->line, "fisheye_model: \"%s\" is neither 0 nor 1", flag->text);
    if (model->line > 0 && flag->line > 0 && is_fisheye != is_equidistant)
        oc_calibration_refuse(file, flag->line, "fisheye_model: \"%s\" contradicts distortion_model \"%s\"", flag->text,
                              model->text);
    return is_equidistant || is_fisheye ? OC_LENS_FISHEYE : OC_LENS_PLUMB_BOB;
}

static void take_distortion(oc_calibration_file_t *file, oc_lens_t *lens)
{
    lens->model = take_model(file);
    const oc_calibration_value_t *value = find(file, OC_KEY_DISTORTION, "distortion_coefficients");
    if (!value) return;
    if (lens->model == OC_LENS_FISHEYE) {
        memcpy(lens->k, value->number, 4 * sizeof *lens->k);
        if (value->n != 4)
            oc_calibration_refuse(file, value->line, "%s: a fisheye has 4, not %u", value->key, value->n);
        return;
    }
    memcpy(lens->k, value->number, sizeof lens->k);
    bool is_straight = true;
    for (uint32_t i = 0; i < value->n; i++) {
        is_straight = is_straight && value->number[i] == 0;
        if (i >= 5 && value->number[i] != 0)
            oc_calibration_refuse(file, value->line,
                                  "%s: more than k1 k2 p1 p2 k3: recalibrate with plumb_bob (no rational, thin prism "
                                  "or tilted model)",
                                  value->key);
    }
    if (is_straight) lens->model = OC_LENS_PINHOLE;
}

static void check_rectification(oc_calibration_file_t *file)
{
    static const double eye[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const bool none[9] = {0};
    const oc_calibration_value_t *value = &file->value[OC_KEY_RECTIFICATION];
    if (value->line == 0) return;
    if (value->n != 9 || !is_matrix_like(value->number, eye, none, 9))
        oc_calibration_refuse(file, value->line,
                              "%s: not the identity: a camera of a stereo pair needs its own, monocular calibration",
                              value->key);
}

static void take_values(oc_calibration_file_t *file, oc_calibration_t *calibration)
{
    oc_lens_t *lens = &calibration->lens;
    lens->raw.width_px = take_side(file, OC_KEY_WIDTH, "image_width");
    lens->raw.height_px = take_side(file, OC_KEY_HEIGHT, "image_height");
    take_name(file, calibration);
    const oc_calibration_value_t *camera = find(file, OC_KEY_CAMERA, "camera_matrix");
    if (file->is_bad) return;
    take_pinhole(file, camera, 3, &lens->raw);
    take_distortion(file, lens);
    check_rectification(file);
    lens->rectified = lens->raw;
    const oc_calibration_value_t *projection = &file->value[OC_KEY_PROJECTION];
    if (projection->line > 0) take_pinhole(file, projection, 4, &lens->rectified);
}

bool oc_calibration_read(const char *path, oc_calibration_t *calibration, char *error, size_t error_bytes)
{
    oc_calibration_file_t file = {.path = path, .error = error, .error_bytes = error_bytes};
    oc_calibration_t fresh = {.camera_name = ""};
    if (!oc_calibration_file_read(&file)) return false;
    take_values(&file, &fresh);
    if (file.is_bad) return false;
    *calibration = fresh;
    return true;
}

/* ---- writing ---- */

/* All 17 digits, and a point in any case: YAML 1.1 readers take "1e+22" for a word. */
static void write_number(FILE *out, double number)
{
    char text[40];
    snprintf(text, sizeof text, "%.17g", number);
    const size_t n_digits = strcspn(text, "e");
    fprintf(out, "%.*s%s%s", (int)n_digits, text, strchr(text, '.') ? "" : ".0", text + n_digits);
}

static void write_matrix(FILE *out, oc_calibration_form_t form, const char *key, uint32_t rows, uint32_t cols,
                         const double *m)
{
    const bool is_opencv = form == OC_CALIBRATION_OPENCV;
    const char *indent = is_opencv ? "   " : "  ";
    fprintf(out, "%s:%s\n%srows: %u\n%scols: %u\n", key, is_opencv ? " !!opencv-matrix" : "", indent, rows, indent,
            cols);
    if (is_opencv) fprintf(out, "%sdt: d\n", indent);
    fprintf(out, "%sdata: [", indent);
    for (uint32_t i = 0; i < rows * cols; i++) {
        if (i > 0) fprintf(out, i % cols == 0 && cols > 1 ? ",\n%s    " : ", ", indent);
        write_number(out, m[i]);
    }
    fprintf(out, "]\n");
}

/* In single quotes only the single quote itself is special, and doubled. */
static void write_name(FILE *out, const char *name)
{
    if (!*name) return;
    fprintf(out, "camera_name: '");
    for (; *name; name++) fprintf(out, *name == '\'' ? "''" : "%c", *name);
    fprintf(out, "'\n");
}

static void write_distortion(FILE *out, oc_calibration_form_t form, const oc_lens_t *lens)
{
    static const double none[5] = {0, 0, 0, 0, 0};
    const bool is_fisheye = lens->model == OC_LENS_FISHEYE, is_opencv = form == OC_CALIBRATION_OPENCV;
    const uint32_t n = is_fisheye ? 4 : 5;
    if (is_opencv)
        fprintf(out, "fisheye_model: %d\n", is_fisheye);
    else
        fprintf(out, "distortion_model: %s\n", is_fisheye ? "equidistant" : "plumb_bob");
    write_matrix(out, form, "distortion_coefficients", is_opencv ? n : 1, is_opencv ? 1 : n,
                 lens->model == OC_LENS_PINHOLE ? none : lens->k);
}

static void write_projection(FILE *out, oc_calibration_form_t form, const oc_intrinsics_t *k)
{
    const double P[12] = {k->fx_px, 0, k->cx_px, 0, 0, k->fy_px, k->cy_px, 0, 0, 0, 1, 0};
    write_matrix(out, form, "projection_matrix", 3, 4, P);
}

static bool is_writable(const oc_calibration_t *calibration)
{
    const oc_lens_t *lens = &calibration->lens;
    for (const char *c = calibration->camera_name; *c; c++) {
        if (iscntrl((unsigned char)*c)) return false;
    }
    return oc_lens_is_valid(lens) && lens->raw.width_px == lens->rectified.width_px &&
           lens->raw.height_px == lens->rectified.height_px;
}

bool oc_calibration_write(FILE *out, const oc_calibration_t *calibration, oc_calibration_form_t form)
{
    if (!is_writable(calibration)) return false;
    static const double eye[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    const oc_lens_t *lens = &calibration->lens;
    const oc_intrinsics_t *k = &lens->raw, *to = &lens->rectified;
    const double K[9] = {k->fx_px, 0, k->cx_px, 0, k->fy_px, k->cy_px, 0, 0, 1};
    const bool is_moved =
        k->fx_px != to->fx_px || k->fy_px != to->fy_px || k->cx_px != to->cx_px || k->cy_px != to->cy_px;
    if (form == OC_CALIBRATION_OPENCV) fprintf(out, "%%YAML:1.0\n---\n");
    fprintf(out, "image_width: %u\nimage_height: %u\n", k->width_px, k->height_px);
    write_name(out, calibration->camera_name);
    write_matrix(out, form, "camera_matrix", 3, 3, K);
    write_distortion(out, form, lens);
    if (form == OC_CALIBRATION_ROS) write_matrix(out, form, "rectification_matrix", 3, 3, eye);
    if (form == OC_CALIBRATION_ROS || is_moved) write_projection(out, form, to);
    return fflush(out) == 0 && !ferror(out);
}
