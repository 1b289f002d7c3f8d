/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd.yaml's schema for libcyaml: types, words, what is required. */
#include "config_schema.h"

#define LONGEST (OC_CONFIG_TEXT_BYTES - 1)
#define OPTIONAL (CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER)
/* May be left empty, with all its keys commented out. */
#define LOOSE (CYAML_FLAG_OPTIONAL | CYAML_FLAG_POINTER_NULL)
#define WORD_FIELD(key, structure, member, list)                                                                       \
    CYAML_FIELD_ENUM_PTR(key, OPTIONAL | CYAML_FLAG_STRICT, structure, member, list, CYAML_ARRAY_LEN(list))

static const cyaml_strval_t bool_words[] = {{"false", YAML_FALSE}, {"true", YAML_TRUE}};

static const cyaml_strval_t send_words[] = {{"layers", OC_LINK_LAYERS}, {"images", OC_LINK_IMAGES}};
static const cyaml_strval_t codec_words[] = {{"jpeg", OC_CODEC_JPEG}, {"webp", OC_CODEC_WEBP}};

static const cyaml_schema_field_t link_fields[] = {
    CYAML_FIELD_STRING_PTR("down_url", CYAML_FLAG_POINTER, yaml_link_t, down_url, 1, LONGEST),
    CYAML_FIELD_STRING_PTR("up_url", CYAML_FLAG_POINTER, yaml_link_t, up_url, 1, LONGEST),
    CYAML_FIELD_UINT_PTR("datagram_bytes", OPTIONAL, yaml_link_t, datagram_bytes),
    CYAML_FIELD_UINT_PTR("rate_kbit_s", OPTIONAL, yaml_link_t, rate_kbit_s),
    WORD_FIELD("send", yaml_link_t, send, send_words),
    WORD_FIELD("codec", yaml_link_t, codec, codec_words),
    CYAML_FIELD_UINT_PTR("quality", OPTIONAL, yaml_link_t, quality),
    CYAML_FIELD_END};

static const cyaml_strval_t keyframe_words[] = {{"all", YAML_KEYFRAME_ALL}, {"moved", YAML_KEYFRAME_MOVED}};

static const cyaml_schema_field_t source_fields[] = {
    CYAML_FIELD_STRING_PTR("site", CYAML_FLAG_POINTER, yaml_source_t, site, 1, LONGEST),
    CYAML_FIELD_UINT_PTR("period_ms", OPTIONAL, yaml_source_t, period_ms),
    CYAML_FIELD_UINT_PTR("repeat", OPTIONAL, yaml_source_t, repeat),
    WORD_FIELD("loop", yaml_source_t, loop, bool_words),
    WORD_FIELD("keyframes", yaml_source_t, keyframes, keyframe_words),
    CYAML_FIELD_END};

static const cyaml_schema_field_t mount_fields[] = {
    CYAML_FIELD_FLOAT("x_m", CYAML_FLAG_DEFAULT, yaml_mount_t, x_m),
    CYAML_FIELD_FLOAT("y_m", CYAML_FLAG_DEFAULT, yaml_mount_t, y_m),
    CYAML_FIELD_FLOAT("z_m", CYAML_FLAG_DEFAULT, yaml_mount_t, z_m),
    CYAML_FIELD_FLOAT("roll_deg", CYAML_FLAG_DEFAULT, yaml_mount_t, roll_deg),
    CYAML_FIELD_FLOAT("pitch_deg", CYAML_FLAG_DEFAULT, yaml_mount_t, pitch_deg),
    CYAML_FIELD_FLOAT("yaw_deg", CYAML_FLAG_DEFAULT, yaml_mount_t, yaw_deg),
    CYAML_FIELD_END};

static const cyaml_strval_t format_words[] = {{"YUYV", OC_PIXEL_YUYV},
                                              {"UYVY", OC_PIXEL_UYVY},
                                              {"NV12", OC_PIXEL_NV12},
                                              {"GREY", OC_PIXEL_GREY},
                                              {"MJPG", OC_PIXEL_MJPG}};

static const cyaml_schema_field_t camera_fields[] = {
    CYAML_FIELD_STRING_PTR("name", CYAML_FLAG_POINTER, yaml_camera_t, name, 1, OC_CAMERA_NAME_BYTES - 1),
    CYAML_FIELD_STRING_PTR("device", CYAML_FLAG_POINTER, yaml_camera_t, device, 1, OC_VIDEO_PATH_BYTES - 1),
    CYAML_FIELD_STRING_PTR("calibration", CYAML_FLAG_POINTER, yaml_camera_t, calibration, 1, LONGEST),
    WORD_FIELD("format", yaml_camera_t, format, format_words),
    CYAML_FIELD_FLOAT_PTR("rate_hz", OPTIONAL, yaml_camera_t, rate_hz),
    CYAML_FIELD_UINT_PTR("buffers", OPTIONAL, yaml_camera_t, buffers),
    CYAML_FIELD_STRING_PTR("exposure", OPTIONAL, yaml_camera_t, exposure, 1, 16),
    CYAML_FIELD_INT_PTR("gain", OPTIONAL, yaml_camera_t, gain),
    CYAML_FIELD_STRING_PTR("white_balance", OPTIONAL, yaml_camera_t, white_balance, 1, 16),
    CYAML_FIELD_MAPPING("mount", CYAML_FLAG_DEFAULT, yaml_camera_t, mount, mount_fields),
    CYAML_FIELD_INT_PTR("delay_us", OPTIONAL, yaml_camera_t, delay_us),
    CYAML_FIELD_UINT_PTR("stall_ms", OPTIONAL, yaml_camera_t, stall_ms),
    CYAML_FIELD_UINT_PTR("retry_ms", OPTIONAL, yaml_camera_t, retry_ms),
    WORD_FIELD("triggered", yaml_camera_t, triggered, bool_words),
    CYAML_FIELD_END};

static const cyaml_schema_value_t camera_schema = {
    CYAML_VALUE_MAPPING(CYAML_FLAG_DEFAULT, yaml_camera_t, camera_fields)};

static const cyaml_strval_t pose_words[] = {{"outcrop", OC_POSE_OUTCROP}, {"bot_core", OC_POSE_BOT_CORE}};

static const cyaml_schema_field_t pose_fields[] = {
    CYAML_FIELD_STRING_PTR("url", CYAML_FLAG_POINTER, yaml_poses_t, url, 1, LONGEST),
    CYAML_FIELD_STRING_PTR("channel", OPTIONAL, yaml_poses_t, channel, 1, 63),
    WORD_FIELD("type", yaml_poses_t, type, pose_words),
    CYAML_FIELD_UINT_PTR("wait_ms", OPTIONAL, yaml_poses_t, wait_ms),
    CYAML_FIELD_UINT_PTR("max_gap_ms", OPTIONAL, yaml_poses_t, max_gap_ms),
    CYAML_FIELD_END};

static const cyaml_strval_t margin_words[] = {{"covariance", YAML_MARGIN_COVARIANCE}, {"fixed", YAML_MARGIN_FIXED}};

static const cyaml_schema_field_t margin_fields[] = {
    WORD_FIELD("from", yaml_margins_t, from, margin_words),
    CYAML_FIELD_FLOAT_PTR("position_m", OPTIONAL, yaml_margins_t, position_m),
    CYAML_FIELD_FLOAT_PTR("angle_deg", OPTIONAL, yaml_margins_t, angle_deg), CYAML_FIELD_END};

static const cyaml_schema_field_t keyframe_fields[] = {
    CYAML_FIELD_FLOAT_PTR("min_move_m", OPTIONAL, yaml_keyframes_t, min_move_m),
    CYAML_FIELD_FLOAT_PTR("min_turn_deg", OPTIONAL, yaml_keyframes_t, min_turn_deg),
    CYAML_FIELD_FLOAT_PTR("min_sharpness", OPTIONAL, yaml_keyframes_t, min_sharpness), CYAML_FIELD_END};

static const cyaml_schema_field_t pre_event_fields[] = {
    WORD_FIELD("hold", yaml_pre_event_t, hold, bool_words),
    CYAML_FIELD_UINT_PTR("seconds", OPTIONAL, yaml_pre_event_t, seconds), CYAML_FIELD_END};

static const cyaml_strval_t bias_words[] = {
    {"as_is", OC_GPIO_BIAS_AS_IS}, {"off", OC_GPIO_BIAS_OFF}, {"up", OC_GPIO_BIAS_UP}, {"down", OC_GPIO_BIAS_DOWN}};
static const cyaml_strval_t mode_words[] = {{"per_frame", OC_TRIGGER_PER_FRAME}, {"periodic", OC_TRIGGER_PERIODIC}};

/* Which line: the same keys for every role. */
#define LINE_FIELDS                                                                                                    \
    CYAML_FIELD_STRING_PTR("line", OPTIONAL, yaml_line_t, line, 1, OC_GPIO_NAME_BYTES - 1),                            \
        CYAML_FIELD_STRING_PTR("chip", OPTIONAL, yaml_line_t, chip, 1, OC_GPIO_NAME_BYTES - 1),                        \
        CYAML_FIELD_UINT_PTR("offset", OPTIONAL, yaml_line_t, offset),                                                 \
        WORD_FIELD("active_low", yaml_line_t, active_low, bool_words)
#define BIAS_FIELD WORD_FIELD("bias", yaml_line_t, bias, bias_words)

static const cyaml_schema_field_t trigger_fields[] = {LINE_FIELDS, WORD_FIELD("mode", yaml_line_t, mode, mode_words),
                                                      CYAML_FIELD_FLOAT_PTR("rate_hz", OPTIONAL, yaml_line_t, rate_hz),
                                                      CYAML_FIELD_UINT_PTR("pulse_us", OPTIONAL, yaml_line_t, pulse_us),
                                                      CYAML_FIELD_END};
static const cyaml_schema_field_t strobe_fields[] = {
    LINE_FIELDS, CYAML_FIELD_UINT_PTR("delay_us", OPTIONAL, yaml_line_t, delay_us),
    CYAML_FIELD_UINT_PTR("pulse_us", OPTIONAL, yaml_line_t, pulse_us), CYAML_FIELD_END};
static const cyaml_schema_field_t heartbeat_fields[] = {
    LINE_FIELDS, CYAML_FIELD_UINT_PTR("period_ms", OPTIONAL, yaml_line_t, period_ms), CYAML_FIELD_END};
static const cyaml_schema_field_t enable_fields[] = {LINE_FIELDS, BIAS_FIELD, CYAML_FIELD_END};
static const cyaml_schema_field_t mark_fields[] = {
    LINE_FIELDS, BIAS_FIELD, CYAML_FIELD_UINT_PTR("debounce_ms", OPTIONAL, yaml_line_t, debounce_ms), CYAML_FIELD_END};

static const cyaml_schema_field_t gpio_fields[] = {
    CYAML_FIELD_MAPPING_PTR("trigger", OPTIONAL, yaml_gpio_t, trigger, trigger_fields),
    CYAML_FIELD_MAPPING_PTR("strobe", OPTIONAL, yaml_gpio_t, strobe, strobe_fields),
    CYAML_FIELD_MAPPING_PTR("heartbeat", OPTIONAL, yaml_gpio_t, heartbeat, heartbeat_fields),
    CYAML_FIELD_MAPPING_PTR("enable", OPTIONAL, yaml_gpio_t, enable, enable_fields),
    CYAML_FIELD_MAPPING_PTR("mark", OPTIONAL, yaml_gpio_t, mark, mark_fields),
    CYAML_FIELD_END};

static const cyaml_strval_t method_words[] = {{"best", OC_JUDOCA_REFINED}, {"thesis", OC_JUDOCA_THESIS}};

static const cyaml_schema_field_t junction_fields[] = {
    CYAML_FIELD_FLOAT_PTR("sigma_px", OPTIONAL, yaml_junctions_t, sigma_px),
    CYAML_FIELD_FLOAT_PTR("t_b", OPTIONAL, yaml_junctions_t, t_b),
    CYAML_FIELD_FLOAT_PTR("s_j", OPTIONAL, yaml_junctions_t, s_j),
    CYAML_FIELD_UINT_PTR("lambda_px", OPTIONAL, yaml_junctions_t, lambda_px),
    CYAML_FIELD_UINT_PTR("lambda_min_px", OPTIONAL, yaml_junctions_t, lambda_min_px),
    CYAML_FIELD_UINT_PTR("max_found", OPTIONAL, yaml_junctions_t, max_found),
    CYAML_FIELD_UINT_PTR("max_corners", OPTIONAL, yaml_junctions_t, max_corners),
    CYAML_FIELD_UINT_PTR("max_sent", OPTIONAL, yaml_junctions_t, max_sent),
    WORD_FIELD("method", yaml_junctions_t, method, method_words),
    CYAML_FIELD_END};

static const cyaml_schema_value_t number_schema = {CYAML_VALUE_FLOAT(CYAML_FLAG_DEFAULT, double)};

static const cyaml_schema_field_t file_fields[] = {
    CYAML_FIELD_UINT_PTR("vehicle", OPTIONAL, yaml_file_t, vehicle),
    CYAML_FIELD_UINT_PTR("stored_views", OPTIONAL, yaml_file_t, stored_views),
    CYAML_FIELD_STRING_PTR("status_file", OPTIONAL, yaml_file_t, status_file, 1, LONGEST),
    CYAML_FIELD_STRING_PTR("debug_dump", OPTIONAL, yaml_file_t, debug_dump, 1, LONGEST),
    CYAML_FIELD_MAPPING_PTR("link", CYAML_FLAG_POINTER, yaml_file_t, link, link_fields),
    CYAML_FIELD_MAPPING_PTR("source", OPTIONAL, yaml_file_t, source, source_fields),
    CYAML_FIELD_SEQUENCE_COUNT("cameras", OPTIONAL, yaml_file_t, cameras, n_cameras, &camera_schema, 1, OC_MAX_CAMERAS),
    CYAML_FIELD_MAPPING_PTR("poses", OPTIONAL, yaml_file_t, poses, pose_fields),
    CYAML_FIELD_MAPPING_PTR("margins", LOOSE, yaml_file_t, margins, margin_fields),
    CYAML_FIELD_MAPPING_PTR("keyframes", LOOSE, yaml_file_t, keyframes, keyframe_fields),
    CYAML_FIELD_MAPPING_PTR("pre_event", LOOSE, yaml_file_t, pre_event, pre_event_fields),
    CYAML_FIELD_MAPPING_PTR("gpio", LOOSE, yaml_file_t, gpio, gpio_fields),
    CYAML_FIELD_SEQUENCE_COUNT("area", OPTIONAL, yaml_file_t, area, n_area, &number_schema, 5, 5),
    CYAML_FIELD_MAPPING_PTR("junctions", LOOSE, yaml_file_t, junctions, junction_fields),
    CYAML_FIELD_END};

const cyaml_schema_value_t oc_config_schema = {CYAML_VALUE_MAPPING(CYAML_FLAG_POINTER, yaml_file_t, file_fields)};
