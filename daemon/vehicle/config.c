/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd.yaml into oc_config_t: what is given, else the table's default. */
#include "config.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "config_schema.h"

#define RAD_PER_DEG (M_PI / 180)
/* Least margins of cameras' poses when the file names none. */
#define CAMERA_LEAST_M 0.01
#define CAMERA_LEAST_DEG 0.1

/* ---- given, else the default ---- */

static uint32_t uint_or(const uint32_t *value, const char *path)
{
    return value ? *value : (uint32_t)oc_yaml_default_number(&oc_config_form, path);
}

static int32_t int_or(const int32_t *value, const char *path)
{
    return value ? *value : (int32_t)oc_yaml_default_number(&oc_config_form, path);
}

static double float_or(const double *value, const char *path)
{
    return value ? *value : oc_yaml_default_number(&oc_config_form, path);
}

static double float_or_nan(const double *value)
{
    return value ? *value : (double)NAN;
}

/* Enumerations differ in type, not in how libcyaml stores them. */
#define WORD_OR(type, value, path) ((value) ? *(value) : (type)oc_yaml_default_word(&oc_config_form, path))
#define FLAG_OR(value, path) (WORD_OR(yaml_bool_t, value, path) == YAML_TRUE)

#define COPY_TEXT(out, text) snprintf(out, sizeof(out), "%s", (text) ? (text) : "")

/* ---- sections; a missing one is one without keys ---- */

static void take_link(const yaml_link_t *link, oc_config_t *config)
{
    COPY_TEXT(config->down_url, link->down_url);
    COPY_TEXT(config->up_url, link->up_url);
    config->vehicle.datagram_bytes = uint_or(link->datagram_bytes, "link.datagram_bytes");
    config->rate_kbit_s = uint_or(link->rate_kbit_s, "link.rate_kbit_s");
    config->mode = WORD_OR(oc_link_mode_t, link->send, "link.send");
    config->image_codec = WORD_OR(oc_codec_t, link->codec, "link.codec");
    config->image_quality = (int)uint_or(link->quality, "link.quality");
}

static void take_source(const yaml_source_t *source, oc_config_t *config)
{
    config->source = OC_SOURCE_SITE;
    COPY_TEXT(config->site, source->site);
    config->site_option.period_ms = uint_or(source->period_ms, "source.period_ms");
    config->site_option.repeat = uint_or(source->repeat, "source.repeat");
    config->site_option.is_looped = FLAG_OR(source->loop, "source.loop");
    config->site_option.has_keyframe_policy =
        WORD_OR(yaml_keyframe_use_t, source->keyframes, "source.keyframes") == YAML_KEYFRAME_MOVED;
}

/* "auto", or a number; NULL: left as it is. */
static void take_auto(const char *text, bool *is_set, bool *is_auto, uint32_t *value)
{
    *is_set = text != NULL;
    *is_auto = text && strcmp(text, "auto") == 0;
    *value = text && !*is_auto ? (uint32_t)strtoul(text, NULL, 10) : 0;
}

static void take_controls(const yaml_camera_t *camera, oc_video_controls_t *controls)
{
    take_auto(camera->exposure, &controls->has_exposure, &controls->is_exposure_auto, &controls->exposure_us);
    take_auto(camera->white_balance, &controls->has_white_balance, &controls->is_white_balance_auto,
              &controls->white_balance_k);
    controls->has_gain = camera->gain != NULL;
    controls->gain = camera->gain ? *camera->gain : 0;
}

static void take_camera(const yaml_camera_t *camera, const oc_lens_t *lens, oc_camera_config_t *out)
{
    COPY_TEXT(out->name, camera->name);
    COPY_TEXT(out->wish.path, camera->device);
    out->wish.format = WORD_OR(oc_pixel_format_t, camera->format, "cameras[].format");
    out->wish.width_px = lens->raw.width_px;
    out->wish.height_px = lens->raw.height_px;
    out->wish.rate_hz = float_or(camera->rate_hz, "cameras[].rate_hz");
    out->wish.n_buffers = uint_or(camera->buffers, "cameras[].buffers");
    take_controls(camera, &out->wish.controls);
    out->lens = *lens;
    const yaml_mount_t *m = &camera->mount;
    const double xyz_m[3] = {m->x_m, m->y_m, m->z_m};
    const double rpy_rad[3] = {m->roll_deg * RAD_PER_DEG, m->pitch_deg * RAD_PER_DEG, m->yaw_deg * RAD_PER_DEG};
    out->body_from_optical = oc_mount_from_xyzrpy(xyz_m, rpy_rad);
    out->stall_ms = uint_or(camera->stall_ms, "cameras[].stall_ms");
    out->retry_ms = uint_or(camera->retry_ms, "cameras[].retry_ms");
    out->delay_us = int_or(camera->delay_us, "cameras[].delay_us");
    out->is_hardware_triggered = FLAG_OR(camera->triggered, "cameras[].triggered");
}

static void take_poses(const yaml_poses_t *poses, oc_config_t *config)
{
    static const yaml_poses_t none;
    if (!poses) poses = &none;
    config->pose_type = WORD_OR(oc_pose_type_t, poses->type, "poses.type");
    const char *usual = config->pose_type == OC_POSE_BOT_CORE ? "POSE" : "OUTCROP_POSE";
    COPY_TEXT(config->pose_url, poses->url);
    COPY_TEXT(config->pose_channel, poses->channel ? poses->channel : usual);
    config->pose_max_gap_ms = uint_or(poses->max_gap_ms, "poses.max_gap_ms");
    config->cameras.pose_wait_ms = uint_or(poses->wait_ms, "poses.wait_ms");
}

static void take_margins(const yaml_margins_t *margins, oc_config_t *config)
{
    static const yaml_margins_t none;
    if (!margins) margins = &none;
    config->margin.position_m = float_or_nan(margins->position_m);
    config->margin.angle_rad = float_or_nan(margins->angle_deg) * RAD_PER_DEG;
    oc_camera_source_config_t *cameras = &config->cameras;
    cameras->has_fixed_margin = WORD_OR(yaml_margin_from_t, margins->from, "margins.from") == YAML_MARGIN_FIXED;
    const double position_m = margins->position_m ? *margins->position_m : CAMERA_LEAST_M;
    const double angle_deg = margins->angle_deg ? *margins->angle_deg : CAMERA_LEAST_DEG;
    for (int i = 0; i < 3; i++) {
        cameras->margin.v[i] = position_m;
        cameras->margin.v[3 + i] = angle_deg * RAD_PER_DEG;
    }
}

static void take_keyframes(const yaml_keyframes_t *keyframes, oc_keyframe_params_t *params)
{
    static const yaml_keyframes_t none;
    if (!keyframes) keyframes = &none;
    params->min_move_m = float_or(keyframes->min_move_m, "keyframes.min_move_m");
    params->min_turn_rad = float_or(keyframes->min_turn_deg, "keyframes.min_turn_deg") * RAD_PER_DEG;
    params->min_sharpness = (float)float_or(keyframes->min_sharpness, "keyframes.min_sharpness");
}

static void take_pre_event(const yaml_pre_event_t *pre_event, oc_config_t *config)
{
    static const yaml_pre_event_t none;
    if (!pre_event) pre_event = &none;
    config->has_held_views = FLAG_OR(pre_event->hold, "pre_event.hold");
    config->pre_event_s = uint_or(pre_event->seconds, "pre_event.seconds");
}

static const yaml_line_t no_line;

static const yaml_line_t *take_line(const yaml_line_t *line, oc_gpio_name_t *name)
{
    name->is_used = line != NULL;
    if (!line) return &no_line;
    COPY_TEXT(name->line, line->line);
    COPY_TEXT(name->chip, line->chip);
    name->offset = line->offset ? *line->offset : 0;
    name->is_active_low = line->active_low && *line->active_low == YAML_TRUE;
    name->bias = line->bias ? *line->bias : OC_GPIO_BIAS_AS_IS;
    return line;
}

static void take_gpio(const yaml_gpio_t *gpio, oc_gpio_config_t *out)
{
    static const yaml_gpio_t none;
    if (!gpio) gpio = &none;
    const yaml_line_t *trigger = take_line(gpio->trigger, &out->trigger);
    out->trigger_mode = WORD_OR(oc_trigger_mode_t, trigger->mode, "gpio.trigger.mode");
    out->trigger_rate_hz = float_or(trigger->rate_hz, "gpio.trigger.rate_hz");
    out->trigger_pulse_us = uint_or(trigger->pulse_us, "gpio.trigger.pulse_us");
    const yaml_line_t *strobe = take_line(gpio->strobe, &out->strobe);
    out->strobe_delay_us = uint_or(strobe->delay_us, "gpio.strobe.delay_us");
    out->strobe_pulse_us = uint_or(strobe->pulse_us, "gpio.strobe.pulse_us");
    const yaml_line_t *heartbeat = take_line(gpio->heartbeat, &out->heartbeat);
    out->heartbeat_ms = uint_or(heartbeat->period_ms, "gpio.heartbeat.period_ms") / 2;
    (void)take_line(gpio->enable, &out->enable);
    const yaml_line_t *mark = take_line(gpio->mark, &out->mark);
    out->mark_debounce_ms = uint_or(mark->debounce_ms, "gpio.mark.debounce_ms");
}

static void take_junctions(const yaml_junctions_t *junctions, oc_vehicle_config_t *vehicle)
{
    static const yaml_junctions_t none;
    if (!junctions) junctions = &none;
    oc_judoca_params_t *p = &vehicle->judoca;
    p->sigma_px = (float)float_or(junctions->sigma_px, "junctions.sigma_px");
    p->t_b = (float)float_or(junctions->t_b, "junctions.t_b");
    p->s_j = (float)float_or(junctions->s_j, "junctions.s_j");
    p->lambda_px = (int32_t)uint_or(junctions->lambda_px, "junctions.lambda_px");
    p->lambda_min_px = (int32_t)uint_or(junctions->lambda_min_px, "junctions.lambda_min_px");
    p->max_junctions = uint_or(junctions->max_found, "junctions.max_found");
    p->max_corners = uint_or(junctions->max_corners, "junctions.max_corners");
    p->method = WORD_OR(oc_judoca_method_t, junctions->method, "junctions.method");
    vehicle->max_sent_junctions = uint_or(junctions->max_sent, "junctions.max_sent");
}

/* In the first of the service's runtime folders, when a service manager made one. */
static void default_status_file(char out[OC_CONFIG_TEXT_BYTES])
{
    const char *folders = getenv("RUNTIME_DIRECTORY");
    const size_t n = folders ? strcspn(folders, ":") : 0;
    static const char name[] = "/outcropd.json";
    if (n > 0 && n + sizeof name <= OC_CONFIG_TEXT_BYTES)
        snprintf(out, OC_CONFIG_TEXT_BYTES, "%.*s%s", (int)n, folders, name);
}

static void take_file(const yaml_file_t *file, const oc_lens_t *lenses, oc_config_t *config)
{
    config->vehicle.vehicle = (uint8_t)uint_or(file->vehicle, "vehicle");
    config->vehicle.stored_views = uint_or(file->stored_views, "stored_views");
    default_status_file(config->status_file);
    if (file->status_file) COPY_TEXT(config->status_file, file->status_file);
    COPY_TEXT(config->debug_dump, file->debug_dump);
    take_link(file->link, config);
    if (file->source) {
        take_source(file->source, config);
    } else {
        config->source = OC_SOURCE_CAMERAS;
        config->cameras.n_cameras = file->n_cameras;
        for (uint32_t i = 0; i < file->n_cameras; i++)
            take_camera(&file->cameras[i], &lenses[i], &config->cameras.cameras[i]);
    }
    take_poses(file->poses, config);
    take_margins(file->margins, config);
    take_keyframes(file->keyframes, &config->vehicle.keyframe);
    take_pre_event(file->pre_event, config);
    take_gpio(file->gpio, &config->gpio);
    if (file->area) {
        const double *a = file->area;
        config->vehicle.area = (oc_area_t){true, a[0], a[1], a[2], a[3], a[4]};
    }
    take_junctions(file->junctions, &config->vehicle);
}

bool oc_config_load(const char *path, oc_config_t *config, oc_config_fault_t on_fault, void *user)
{
    oc_lens_t lenses[OC_MAX_CAMERAS];
    oc_yaml_t *yaml = oc_yaml_open(path, &oc_config_form);
    if (!yaml) {
        on_fault(user, "out of memory");
        return false;
    }
    oc_config_check(yaml, lenses);
    yaml_file_t *data = oc_yaml_load(yaml);
    const bool is_ok = oc_yaml_tell(yaml, on_fault, user) && data;
    oc_yaml_close(yaml);
    if (is_ok) {
        memset(config, 0, sizeof *config);
        config->vehicle = oc_vehicle_defaults();
        take_file(data, lenses, config);
    }
    if (data) oc_yaml_free(&oc_config_form, data);
    return is_ok;
}
