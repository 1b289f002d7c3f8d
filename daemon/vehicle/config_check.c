/* SPDX-License-Identifier: BSD-3-Clause
 * What keys of outcropd.yaml mean for each other. Works on the file as it is
 * written, so that it finds its faults beside those of single keys. */
#include <stdlib.h>
#include <string.h>

#include "calibration.h"
#include "config_schema.h"

/* A number that passed its own checks, or its default; false when it has a fault. */
static bool number_of(const oc_yaml_t *yaml, const char *path, double *value)
{
    const char *text = oc_yaml_text_or_default(yaml, path);
    if (text) *value = strtod(text, NULL);
    return text != NULL;
}

static bool is_word(const oc_yaml_t *yaml, const char *path, const char *word)
{
    const char *text = oc_yaml_text_or_default(yaml, path);
    return text && strcmp(text, word) == 0;
}

static void check_source(oc_yaml_t *yaml)
{
    const bool has_source = oc_yaml_has(yaml, "source"), has_cameras = oc_yaml_has(yaml, "cameras");
    if (has_source && has_cameras) oc_yaml_refuse(yaml, "cameras", "is given beside source: only one can be");
    if (!has_source && !has_cameras) oc_yaml_refuse(yaml, "source", "is missing, and so is cameras: one must be given");
    if (has_cameras && !oc_yaml_has(yaml, "poses")) oc_yaml_refuse(yaml, "poses", "is missing: cameras need it");
}

/* ---- cameras ---- */

static const char *camera_path(uint32_t camera, const char *key, char path[OC_YAML_PATH_BYTES])
{
    snprintf(path, OC_YAML_PATH_BYTES, "cameras[%u]%s%s", camera, key[0] ? "." : "", key);
    return path;
}

/* The same text in an earlier camera is a fault of the later one. */
static void check_unique(oc_yaml_t *yaml, uint32_t camera, const char *key)
{
    char path[OC_YAML_PATH_BYTES], other_path[OC_YAML_PATH_BYTES];
    const char *text = oc_yaml_text(yaml, camera_path(camera, key, path));
    for (uint32_t other = 0; text && other < camera; other++) {
        const char *other_text = oc_yaml_text(yaml, camera_path(other, key, other_path));
        if (!other_text || strcmp(text, other_text) != 0) continue;
        oc_yaml_refuse(yaml, path, "\"%.60s\" is that of %s as well", text, other_path);
        return;
    }
}

static void check_frame_size(oc_yaml_t *yaml, uint32_t camera, const oc_lens_t *lens)
{
    char path[OC_YAML_PATH_BYTES];
    const char *name = oc_yaml_text_or_default(yaml, camera_path(camera, "format", path));
    oc_pixel_format_t format;
    if (!name || !oc_pixel_format_from_name(name, &format)) return;
    const bool is_halved_across = format == OC_PIXEL_YUYV || format == OC_PIXEL_UYVY || format == OC_PIXEL_NV12;
    const uint32_t width_px = lens->raw.width_px, height_px = lens->raw.height_px;
    if (is_halved_across && width_px % 2 != 0)
        oc_yaml_refuse(yaml, path, "%s needs an even width, the calibration says %ux%u", name, width_px, height_px);
    else if (format == OC_PIXEL_NV12 && height_px % 2 != 0)
        oc_yaml_refuse(yaml, path, "%s needs an even height, the calibration says %ux%u", name, width_px, height_px);
}

static void check_calibration(oc_yaml_t *yaml, uint32_t camera, oc_lens_t *lens)
{
    char path[OC_YAML_PATH_BYTES], error[512];
    const char *file = oc_yaml_text(yaml, camera_path(camera, "calibration", path));
    oc_calibration_t calibration;
    if (!file) return;
    if (!oc_calibration_read(file, &calibration, error, sizeof error)) {
        oc_yaml_refuse(yaml, path, "%s", error);
        return;
    }
    *lens = calibration.lens;
    check_frame_size(yaml, camera, lens);
}

static void check_cameras(oc_yaml_t *yaml, oc_lens_t *lenses)
{
    char path[OC_YAML_PATH_BYTES];
    for (uint32_t i = 0; i < OC_MAX_CAMERAS; i++) {
        if (!oc_yaml_has(yaml, camera_path(i, "", path))) continue;
        check_unique(yaml, i, "name");
        check_unique(yaml, i, "device");
        check_calibration(yaml, i, &lenses[i]);
        const bool is_clocked = oc_yaml_has(yaml, "gpio.trigger") && !is_word(yaml, "gpio.trigger.mode", "per_frame");
        if (is_word(yaml, camera_path(i, "triggered", path), "true") && !is_clocked)
            oc_yaml_refuse(yaml, path, "needs gpio.trigger with mode: periodic");
    }
}

static void check_margins(oc_yaml_t *yaml)
{
    static const char *const widths[] = {"margins.position_m", "margins.angle_deg"};
    if (!oc_yaml_has(yaml, "cameras")) return;
    const bool is_fixed = is_word(yaml, "margins.from", "fixed");
    for (size_t i = 0; i < 2 && is_fixed; i++) {
        if (!oc_yaml_has(yaml, widths[i])) oc_yaml_refuse(yaml, widths[i], "is missing: from: fixed needs it");
    }
    if (is_word(yaml, "margins.from", "covariance") && is_word(yaml, "poses.type", "bot_core"))
        oc_yaml_refuse(yaml, "poses.type", "bot_core poses have no covariance: margins.from must be fixed");
}

/* ---- lines ---- */

#define N_ROLES 5
static const char *const roles[N_ROLES] = {"trigger", "strobe", "heartbeat", "enable", "mark"};

static const char *role_path(int role, const char *key, char path[OC_YAML_PATH_BYTES])
{
    snprintf(path, OC_YAML_PATH_BYTES, "gpio.%s%s%s", roles[role], key[0] ? "." : "", key);
    return path;
}

/* Named, or by chip and offset, and not both. */
static void check_line(oc_yaml_t *yaml, int role)
{
    char line[OC_YAML_PATH_BYTES], chip[OC_YAML_PATH_BYTES], offset[OC_YAML_PATH_BYTES], section[OC_YAML_PATH_BYTES];
    const bool has_line = oc_yaml_has(yaml, role_path(role, "line", line));
    const bool has_chip = oc_yaml_has(yaml, role_path(role, "chip", chip));
    const bool has_offset = oc_yaml_has(yaml, role_path(role, "offset", offset));
    role_path(role, "", section);
    if (has_line && (has_chip || has_offset))
        oc_yaml_refuse(yaml, line, "is given beside %s: only one can be", has_chip ? "chip" : "offset");
    else if (!has_line && !has_chip && !has_offset)
        oc_yaml_refuse(yaml, section, "does not say which line: line, or chip and offset");
    else if (!has_line && !has_chip)
        oc_yaml_refuse(yaml, chip, "is missing: offset needs it");
    else if (!has_line && !has_offset)
        oc_yaml_refuse(yaml, offset, "is missing: chip needs it");
}

/* "/dev/gpiochip0" is gpiochip0. */
static const char *chip_name(const char *chip)
{
    return strncmp(chip, "/dev/", 5) == 0 ? chip + 5 : chip;
}

static bool is_same_line(const oc_yaml_t *yaml, int a, int b)
{
    char path[OC_YAML_PATH_BYTES];
    const char *line_a = oc_yaml_text(yaml, role_path(a, "line", path));
    const char *line_b = oc_yaml_text(yaml, role_path(b, "line", path));
    if (line_a && line_b) return strcmp(line_a, line_b) == 0;
    const char *chip_a = oc_yaml_text(yaml, role_path(a, "chip", path));
    const char *chip_b = oc_yaml_text(yaml, role_path(b, "chip", path));
    const char *offset_a = oc_yaml_text(yaml, role_path(a, "offset", path));
    const char *offset_b = oc_yaml_text(yaml, role_path(b, "offset", path));
    return chip_a && chip_b && offset_a && offset_b && strcmp(chip_name(chip_a), chip_name(chip_b)) == 0 &&
           strtoul(offset_a, NULL, 10) == strtoul(offset_b, NULL, 10);
}

/* A pulse must have ended before the next one begins. */
static void check_pulses(oc_yaml_t *yaml)
{
    double rate_hz, pulse_us, delay_us, flash_us;
    if (!oc_yaml_has(yaml, "gpio.trigger") || !is_word(yaml, "gpio.trigger.mode", "periodic")) return;
    if (!number_of(yaml, "gpio.trigger.rate_hz", &rate_hz)) return;
    if (number_of(yaml, "gpio.trigger.pulse_us", &pulse_us) && pulse_us * rate_hz >= 1e6)
        oc_yaml_refuse(yaml, "gpio.trigger.pulse_us", "%.0f us are no shorter than a period of %g Hz", pulse_us,
                       rate_hz);
    if (!oc_yaml_has(yaml, "gpio.strobe")) return;
    if (number_of(yaml, "gpio.strobe.delay_us", &delay_us) && number_of(yaml, "gpio.strobe.pulse_us", &flash_us) &&
        (delay_us + flash_us) * rate_hz >= 1e6)
        oc_yaml_refuse(yaml, "gpio.strobe", "delay and pulse, %.0f us, are no shorter than a period of %g Hz",
                       delay_us + flash_us, rate_hz);
}

static void check_gpio(oc_yaml_t *yaml)
{
    char path[OC_YAML_PATH_BYTES];
    for (int i = 0; i < N_ROLES; i++) {
        if (!oc_yaml_is_section(yaml, role_path(i, "", path))) continue;
        check_line(yaml, i);
        for (int k = 0; k < i; k++) {
            if (is_same_line(yaml, i, k)) oc_yaml_refuse(yaml, path, "has the line of gpio.%s", roles[k]);
        }
    }
    check_pulses(yaml);
}

/* ---- the rest ---- */

static void check_junctions(oc_yaml_t *yaml)
{
    double least, most;
    if (number_of(yaml, "junctions.lambda_px", &most) && number_of(yaml, "junctions.lambda_min_px", &least) &&
        least > most && oc_yaml_has(yaml, "junctions.lambda_min_px"))
        oc_yaml_refuse(yaml, "junctions.lambda_min_px", "%g is more than lambda_px, %g", least, most);
}

void oc_config_check(oc_yaml_t *yaml, oc_lens_t *lenses)
{
    if (!oc_yaml_is_document(yaml)) return;
    check_source(yaml);
    check_cameras(yaml, lenses);
    check_margins(yaml);
    check_gpio(yaml);
    oc_yaml_check_area(yaml, "area");
    check_junctions(yaml);
}
