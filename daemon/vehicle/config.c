/* SPDX-License-Identifier: BSD-3-Clause
 * Reading outcropd.yaml with libcyaml. */
#include "config.h"

#include <cyaml/cyaml.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

#include "config_yaml.h"

/* The file as the schema loads it: optional scalars are pointers, NULL = not given. */
typedef struct yaml_link {
    char *down_url, *up_url, *send, *codec;
    uint32_t *datagram_bytes, *rate_kbit_s, *quality;
} yaml_link_t;

typedef struct yaml_source {
    char *site;
    uint32_t *period_ms;
} yaml_source_t;

typedef struct yaml_margins {
    double *position_m, *angle_deg;
} yaml_margins_t;

typedef struct yaml_junctions {
    double *sigma_px, *t_b, *s_j;
    uint32_t *lambda_px, *lambda_min_px, *max_found, *max_corners, *max_sent;
    char *method;
} yaml_junctions_t;

typedef struct yaml_file {
    uint32_t *vehicle, *stored_views;
    yaml_link_t *link;
    yaml_source_t *source;
    yaml_margins_t *margins;
    yaml_junctions_t *junctions;
    char *debug_dump;
} yaml_file_t;

#define OPTIONAL_POINTER (CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER)

static const cyaml_schema_field_t link_fields[] = {
    CYAML_FIELD_STRING_PTR("down_url", CYAML_FLAG_POINTER, yaml_link_t, down_url, 1, OC_CONFIG_TEXT_BYTES - 1),
    CYAML_FIELD_STRING_PTR("up_url", CYAML_FLAG_POINTER, yaml_link_t, up_url, 1, OC_CONFIG_TEXT_BYTES - 1),
    CYAML_FIELD_UINT_PTR("datagram_bytes", OPTIONAL_POINTER, yaml_link_t, datagram_bytes),
    CYAML_FIELD_UINT_PTR("rate_kbit_s", OPTIONAL_POINTER, yaml_link_t, rate_kbit_s),
    CYAML_FIELD_STRING_PTR("send", OPTIONAL_POINTER, yaml_link_t, send, 1, 16),
    CYAML_FIELD_STRING_PTR("codec", OPTIONAL_POINTER, yaml_link_t, codec, 1, 16),
    CYAML_FIELD_UINT_PTR("quality", OPTIONAL_POINTER, yaml_link_t, quality),
    CYAML_FIELD_END};

static const cyaml_schema_field_t source_fields[] = {
    CYAML_FIELD_STRING_PTR("site", CYAML_FLAG_POINTER, yaml_source_t, site, 1, OC_CONFIG_TEXT_BYTES - 1),
    CYAML_FIELD_UINT_PTR("period_ms", OPTIONAL_POINTER, yaml_source_t, period_ms), CYAML_FIELD_END};

static const cyaml_schema_field_t margin_fields[] = {
    CYAML_FIELD_FLOAT_PTR("position_m", OPTIONAL_POINTER, yaml_margins_t, position_m),
    CYAML_FIELD_FLOAT_PTR("angle_deg", OPTIONAL_POINTER, yaml_margins_t, angle_deg), CYAML_FIELD_END};

static const cyaml_schema_field_t junction_fields[] = {
    CYAML_FIELD_FLOAT_PTR("sigma_px", OPTIONAL_POINTER, yaml_junctions_t, sigma_px),
    CYAML_FIELD_FLOAT_PTR("t_b", OPTIONAL_POINTER, yaml_junctions_t, t_b),
    CYAML_FIELD_FLOAT_PTR("s_j", OPTIONAL_POINTER, yaml_junctions_t, s_j),
    CYAML_FIELD_UINT_PTR("lambda_px", OPTIONAL_POINTER, yaml_junctions_t, lambda_px),
    CYAML_FIELD_UINT_PTR("lambda_min_px", OPTIONAL_POINTER, yaml_junctions_t, lambda_min_px),
    CYAML_FIELD_UINT_PTR("max_found", OPTIONAL_POINTER, yaml_junctions_t, max_found),
    CYAML_FIELD_UINT_PTR("max_corners", OPTIONAL_POINTER, yaml_junctions_t, max_corners),
    CYAML_FIELD_UINT_PTR("max_sent", OPTIONAL_POINTER, yaml_junctions_t, max_sent),
    CYAML_FIELD_STRING_PTR("method", OPTIONAL_POINTER, yaml_junctions_t, method, 1, 16),
    CYAML_FIELD_END};

static const cyaml_schema_field_t file_fields[] = {
    CYAML_FIELD_UINT_PTR("vehicle", OPTIONAL_POINTER, yaml_file_t, vehicle),
    CYAML_FIELD_UINT_PTR("stored_views", OPTIONAL_POINTER, yaml_file_t, stored_views),
    CYAML_FIELD_MAPPING_PTR("link", CYAML_FLAG_POINTER, yaml_file_t, link, link_fields),
    CYAML_FIELD_MAPPING_PTR("source", CYAML_FLAG_POINTER, yaml_file_t, source, source_fields),
    CYAML_FIELD_MAPPING_PTR("margins", OPTIONAL_POINTER, yaml_file_t, margins, margin_fields),
    CYAML_FIELD_MAPPING_PTR("junctions", OPTIONAL_POINTER, yaml_file_t, junctions, junction_fields),
    CYAML_FIELD_STRING_PTR("debug_dump", OPTIONAL_POINTER, yaml_file_t, debug_dump, 1, OC_CONFIG_TEXT_BYTES - 1),
    CYAML_FIELD_END};

static const cyaml_schema_value_t file_schema = {CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, yaml_file_t, file_fields)};

typedef struct config_reader {
    const char *file;
    char *error;
    size_t error_bytes;
    bool is_bad;
} config_reader_t;

/* Only the first fault is told. */
__attribute__((format(printf, 2, 3))) static void refuse(config_reader_t *r, const char *format, ...)
{
    if (r->is_bad) return;
    r->is_bad = true;
    char what[200];
    va_list args;
    va_start(args, format);
    vsnprintf(what, sizeof what, format, args);
    va_end(args);
    snprintf(r->error, r->error_bytes, "%s: %s", r->file, what);
}

static uint32_t pick_uint(config_reader_t *r, const char *key, const uint32_t *value, uint32_t low, uint32_t high,
                          uint32_t fallback)
{
    if (!value) return fallback;
    if (*value < low || *value > high) refuse(r, "%s: %u is not within %u..%u", key, *value, low, high);
    return *value;
}

static double pick_float(config_reader_t *r, const char *key, const double *value, double low, double high,
                         double fallback)
{
    if (!value) return fallback;
    if (!(*value >= low && *value <= high)) refuse(r, "%s: %g is not within %g..%g", key, *value, low, high);
    return *value;
}

static void take_link(config_reader_t *r, const yaml_link_t *link, oc_config_t *config)
{
    snprintf(config->down_url, sizeof config->down_url, "%s", link->down_url);
    snprintf(config->up_url, sizeof config->up_url, "%s", link->up_url);
    config->vehicle.datagram_bytes = pick_uint(r, "link.datagram_bytes", link->datagram_bytes, OC_MIN_DATAGRAM_BYTES,
                                               OC_MAX_DATAGRAM_BYTES, config->vehicle.datagram_bytes);
    config->rate_kbit_s = pick_uint(r, "link.rate_kbit_s", link->rate_kbit_s, 1, 1000000, 8000);
    config->image_quality = (int)pick_uint(r, "link.quality", link->quality, 1, 100, 10);

    const char *send = link->send ? link->send : "layers";
    config->mode = strcmp(send, "images") == 0 ? OC_LINK_IMAGES : OC_LINK_LAYERS;
    if (strcmp(send, "images") != 0 && strcmp(send, "layers") != 0)
        refuse(r, "link.send: \"%s\" is neither layers nor images", send);
    const char *codec = link->codec ? link->codec : "jpeg";
    config->image_codec = strcmp(codec, "webp") == 0 ? OC_CODEC_WEBP : OC_CODEC_JPEG;
    if (strcmp(codec, "jpeg") != 0 && strcmp(codec, "webp") != 0)
        refuse(r, "link.codec: \"%s\" is neither jpeg nor webp", codec);
}

static void take_junctions(config_reader_t *r, const yaml_junctions_t *junctions, oc_config_t *config)
{
    if (!junctions) return;
    oc_judoca_params_t *p = &config->vehicle.judoca;
    p->sigma_px = (float)pick_float(r, "junctions.sigma_px", junctions->sigma_px, 0.6, 3, (double)p->sigma_px);
    p->t_b = (float)pick_float(r, "junctions.t_b", junctions->t_b, 0, 100, (double)p->t_b);
    p->s_j = (float)pick_float(r, "junctions.s_j", junctions->s_j, 0.3, 1, (double)p->s_j);
    p->lambda_px = (int32_t)pick_uint(r, "junctions.lambda_px", junctions->lambda_px, 6, OC_JUDOCA_MAX_LAMBDA_PX,
                                      (uint32_t)p->lambda_px);
    const uint32_t shortest = p->lambda_min_px < p->lambda_px ? (uint32_t)p->lambda_min_px : (uint32_t)p->lambda_px;
    p->lambda_min_px =
        (int32_t)pick_uint(r, "junctions.lambda_min_px", junctions->lambda_min_px, 4, (uint32_t)p->lambda_px, shortest);
    p->max_junctions = pick_uint(r, "junctions.max_found", junctions->max_found, 1, OC_MAX_JUNCTIONS, p->max_junctions);
    p->max_corners = pick_uint(r, "junctions.max_corners", junctions->max_corners, 0, OC_MAX_JUNCTIONS, p->max_corners);
    config->vehicle.max_sent_junctions = pick_uint(r, "junctions.max_sent", junctions->max_sent, 1, OC_MAX_JUNCTIONS,
                                                   config->vehicle.max_sent_junctions);
    const char *method = junctions->method ? junctions->method : "best";
    p->method = strcmp(method, "thesis") == 0 ? OC_JUDOCA_THESIS : OC_JUDOCA_REFINED;
    if (strcmp(method, "best") != 0 && strcmp(method, "thesis") != 0)
        refuse(r, "junctions.method: \"%s\" is neither best nor thesis", method);
}

static void take_file(config_reader_t *r, const yaml_file_t *file, oc_config_t *config)
{
    config->vehicle.vehicle = (uint8_t)pick_uint(r, "vehicle", file->vehicle, 0, 255, 1);
    config->vehicle.stored_views =
        pick_uint(r, "stored_views", file->stored_views, 2, 256, config->vehicle.stored_views);
    take_link(r, file->link, config);
    snprintf(config->site, sizeof config->site, "%s", file->source->site);
    config->site_option.period_ms = pick_uint(r, "source.period_ms", file->source->period_ms, 0, 3600000, 1000);
    const yaml_margins_t none = {NULL, NULL}, *margins = file->margins ? file->margins : &none;
    config->margin.position_m = pick_float(r, "margins.position_m", margins->position_m, 0, 1e4, (double)NAN);
    const double angle_deg = pick_float(r, "margins.angle_deg", margins->angle_deg, 0, 45, (double)NAN);
    config->margin.angle_rad = angle_deg * M_PI / 180;
    take_junctions(r, file->junctions, config);
    snprintf(config->debug_dump, sizeof config->debug_dump, "%s", file->debug_dump ? file->debug_dump : "");
}

bool oc_config_load(const char *path, oc_config_t *config, oc_config_fault_t on_fault, void *user)
{
    void *data = NULL;
    char error[1024];
    if (!oc_yaml_load(path, &file_schema, &data, error, sizeof error)) {
        on_fault(user, error);
        return false;
    }
    oc_config_t fresh = {.vehicle = oc_vehicle_defaults()};
    config_reader_t reader = {path, error, sizeof error, false};
    take_file(&reader, data, &fresh);
    oc_yaml_free(&file_schema, data);
    if (reader.is_bad) {
        on_fault(user, error);
        return false;
    }
    *config = fresh;
    return true;
}
