/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd.yaml as libcyaml loads it, and the table of its keys. */
#ifndef OUTCROP_DAEMON_CONFIG_SCHEMA_H
#define OUTCROP_DAEMON_CONFIG_SCHEMA_H

#include "config.h"
#include "config_yaml.h"

/* Optional scalars and sections are pointers, NULL = not given. */

typedef struct yaml_link {
    char *down_url, *up_url;
    uint32_t *datagram_bytes, *rate_kbit_s, *quality;
    oc_link_mode_t *send;
    oc_codec_t *codec;
} yaml_link_t;

typedef enum yaml_bool { YAML_FALSE, YAML_TRUE } yaml_bool_t;

typedef enum yaml_keyframe_use { YAML_KEYFRAME_ALL, YAML_KEYFRAME_MOVED } yaml_keyframe_use_t;

typedef struct yaml_source {
    char *site;
    uint32_t *period_ms, *repeat;
    yaml_bool_t *loop;
    yaml_keyframe_use_t *keyframes;
} yaml_source_t;

typedef struct yaml_mount {
    double x_m, y_m, z_m, roll_deg, pitch_deg, yaw_deg;
} yaml_mount_t;

typedef struct yaml_camera {
    char *name, *device, *calibration;
    oc_pixel_format_t *format;
    double *rate_hz;
    uint32_t *buffers;
    char *exposure, *white_balance; /* "auto" or a number */
    int32_t *gain;
    yaml_mount_t mount;
    int32_t *delay_us;
    uint32_t *stall_ms, *retry_ms;
    yaml_bool_t *triggered;
} yaml_camera_t;

typedef struct yaml_poses {
    char *url, *channel;
    oc_pose_type_t *type;
    uint32_t *wait_ms, *max_gap_ms;
} yaml_poses_t;

typedef enum yaml_margin_from { YAML_MARGIN_COVARIANCE, YAML_MARGIN_FIXED } yaml_margin_from_t;

typedef struct yaml_margins {
    yaml_margin_from_t *from;
    double *position_m, *angle_deg;
} yaml_margins_t;

typedef struct yaml_keyframes {
    double *min_move_m, *min_turn_deg, *min_sharpness;
} yaml_keyframes_t;

typedef struct yaml_pre_event {
    yaml_bool_t *hold;
    uint32_t *seconds;
} yaml_pre_event_t;

/* One role; each has its own choice of these. */
typedef struct yaml_line {
    char *line, *chip;
    uint32_t *offset;
    yaml_bool_t *active_low;
    oc_gpio_bias_t *bias;
    oc_trigger_mode_t *mode;
    double *rate_hz;
    uint32_t *delay_us, *pulse_us, *period_ms, *debounce_ms;
} yaml_line_t;

typedef struct yaml_gpio {
    yaml_line_t *trigger, *strobe, *heartbeat, *enable, *mark;
} yaml_gpio_t;

typedef struct yaml_junctions {
    double *sigma_px, *t_b, *s_j;
    uint32_t *lambda_px, *lambda_min_px, *max_found, *max_corners, *max_sent;
    oc_judoca_method_t *method;
} yaml_junctions_t;

typedef struct yaml_file {
    uint32_t *vehicle, *stored_views;
    char *status_file, *debug_dump;
    yaml_link_t *link;
    yaml_source_t *source;
    yaml_camera_t *cameras;
    uint32_t n_cameras;
    yaml_poses_t *poses;
    yaml_margins_t *margins;
    yaml_keyframes_t *keyframes;
    yaml_pre_event_t *pre_event;
    yaml_gpio_t *gpio;
    double *area;
    uint32_t n_area;
    yaml_junctions_t *junctions;
} yaml_file_t;

extern const cyaml_schema_value_t oc_config_schema; /* config_schema.c */
extern const oc_yaml_form_t oc_config_form;         /* config_table.c: the schema and every key's row */

/* The keys against each other, and the calibration files they name (lenses go
 * to `lenses`, OC_MAX_CAMERAS of them). Faults are kept in yaml. */
void oc_config_check(oc_yaml_t *yaml, oc_lens_t *lenses);

#endif
