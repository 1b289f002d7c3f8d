/* SPDX-License-Identifier: BSD-3-Clause
 * outcropd's configuration: what arrives from a file, keys against each other, files that are none. */
#include "config_file.h"

#define LINK                                                                                                           \
    "link:\n"                                                                                                          \
    "  down_url: \"udpm://239.255.76.67:7667?ttl=1\"\n"                                                                \
    "  up_url: \"udpm://239.255.76.68:7668?ttl=1\"\n"
#define SITE "source: {site: depot}\n"
#define MOUNT "    mount: {x_m: 1, y_m: 2, z_m: 3, roll_deg: 0, pitch_deg: 90, yaw_deg: -180}\n"
#define CAMERA(name, device, calibration)                                                                              \
    "  - name: " name "\n    device: " device "\n    calibration: " calibration "\n" MOUNT
#define POSES "poses:\n  url: memq://\n"
#define ONE_CAMERA LINK "cameras:\n" CAMERA("front", "/dev/video0", "c.yaml")

static oc_config_t config;

void setUp(void)
{
    unsetenv("RUNTIME_DIRECTORY");
    memset(&config, 0, sizeof config);
}

void tearDown(void)
{
    forget_told();
}

/* ---- what arrives ---- */

static void the_least_file_gives_the_defaults(void)
{
    load_well(LINK SITE, &config);
    TEST_ASSERT_EQUAL_STRING("udpm://239.255.76.67:7667?ttl=1", config.down_url);
    TEST_ASSERT_EQUAL_STRING("udpm://239.255.76.68:7668?ttl=1", config.up_url);
    TEST_ASSERT_EQUAL(8000, config.rate_kbit_s);
    TEST_ASSERT_EQUAL(OC_LINK_LAYERS, config.mode);
    TEST_ASSERT_EQUAL(OC_CODEC_JPEG, config.image_codec);
    TEST_ASSERT_EQUAL(10, config.image_quality);
    TEST_ASSERT_EQUAL(OC_SOURCE_SITE, config.source);
    TEST_ASSERT_EQUAL_STRING("depot", config.site);
    TEST_ASSERT_EQUAL(1000, config.site_option.period_ms);
    TEST_ASSERT_FALSE(config.site_option.is_looped);
    TEST_ASSERT_FALSE(config.site_option.has_keyframe_policy);
    TEST_ASSERT_TRUE(isnan(config.margin.position_m) && isnan(config.margin.angle_rad));
    TEST_ASSERT_EQUAL(0, config.cameras.n_cameras);
    TEST_ASSERT_FALSE(config.gpio.trigger.is_used || config.gpio.strobe.is_used || config.gpio.heartbeat.is_used ||
                      config.gpio.enable.is_used || config.gpio.mark.is_used);
    TEST_ASSERT_FALSE(config.has_held_views);
    TEST_ASSERT_EQUAL(30, config.pre_event_s);
    TEST_ASSERT_EQUAL_STRING("", config.status_file);
    TEST_ASSERT_EQUAL_STRING("", config.debug_dump);
    TEST_ASSERT_FALSE(config.vehicle.area.is_set);

    /* What the library's own defaults are, the file's are as well. */
    const oc_vehicle_config_t usual = oc_vehicle_defaults();
    const oc_vehicle_config_t *v = &config.vehicle;
    TEST_ASSERT_EQUAL(usual.vehicle, v->vehicle);
    TEST_ASSERT_EQUAL(usual.stored_views, v->stored_views);
    TEST_ASSERT_EQUAL(usual.datagram_bytes, v->datagram_bytes);
    TEST_ASSERT_EQUAL(usual.max_sent_junctions, v->max_sent_junctions);
    TEST_ASSERT_EQUAL_MEMORY(&usual.judoca, &v->judoca, sizeof usual.judoca);
    TEST_ASSERT_EQUAL_MEMORY(&usual.ground, &v->ground, sizeof usual.ground);
    TEST_ASSERT_EQUAL_DOUBLE(usual.keyframe.min_move_m, v->keyframe.min_move_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, usual.keyframe.min_turn_rad, v->keyframe.min_turn_rad);
    TEST_ASSERT_EQUAL_FLOAT(usual.keyframe.min_sharpness, v->keyframe.min_sharpness);
}

static void a_site_s_file_arrives(void)
{
    load_well(
        "vehicle: 255\nstored_views: 256\nstatus_file: s.json\ndebug_dump: d\n"
        "link: {down_url: memq://, up_url: \"tcpq://h:1\", datagram_bytes: 200, rate_kbit_s: 1, send: images, "
        "codec: webp, quality: 100}\n"
        "source: {site: s, period_ms: 0, loop: true, keyframes: moved}\n"
        "margins: {position_m: 0.25, angle_deg: 45}\n"
        "keyframes: {min_move_m: 1.5, min_turn_deg: 180, min_sharpness: 0.25}\n"
        "pre_event: {hold: true, seconds: 3600}\n"
        "junctions: {sigma_px: 3, t_b: 0, s_j: 1, lambda_px: 24, lambda_min_px: 24, max_found: 1024, max_corners: 7, "
        "max_sent: 1, method: thesis}\n",
        &config);
    TEST_ASSERT_EQUAL(255, config.vehicle.vehicle);
    TEST_ASSERT_EQUAL(256, config.vehicle.stored_views);
    TEST_ASSERT_EQUAL_STRING("s.json", config.status_file);
    TEST_ASSERT_EQUAL_STRING("d", config.debug_dump);
    TEST_ASSERT_EQUAL_STRING("memq://", config.down_url);
    TEST_ASSERT_EQUAL_STRING("tcpq://h:1", config.up_url);
    TEST_ASSERT_EQUAL(200, config.vehicle.datagram_bytes);
    TEST_ASSERT_EQUAL(1, config.rate_kbit_s);
    TEST_ASSERT_EQUAL(OC_LINK_IMAGES, config.mode);
    TEST_ASSERT_EQUAL(OC_CODEC_WEBP, config.image_codec);
    TEST_ASSERT_EQUAL(100, config.image_quality);
    TEST_ASSERT_EQUAL(0, config.site_option.period_ms);
    TEST_ASSERT_TRUE(config.site_option.is_looped && config.site_option.has_keyframe_policy);
    TEST_ASSERT_EQUAL_DOUBLE(0.25, config.margin.position_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI / 4, config.margin.angle_rad);
    TEST_ASSERT_EQUAL_DOUBLE(1.5, config.vehicle.keyframe.min_move_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI, config.vehicle.keyframe.min_turn_rad);
    TEST_ASSERT_EQUAL_FLOAT(0.25f, config.vehicle.keyframe.min_sharpness);
    TEST_ASSERT_TRUE(config.has_held_views);
    TEST_ASSERT_EQUAL(3600, config.pre_event_s);
    const oc_judoca_params_t *p = &config.vehicle.judoca;
    TEST_ASSERT_EQUAL_FLOAT(3, p->sigma_px);
    TEST_ASSERT_EQUAL_FLOAT(0, p->t_b);
    TEST_ASSERT_EQUAL_FLOAT(1, p->s_j);
    TEST_ASSERT_EQUAL(24, p->lambda_px);
    TEST_ASSERT_EQUAL(24, p->lambda_min_px);
    TEST_ASSERT_EQUAL(1024, p->max_junctions);
    TEST_ASSERT_EQUAL(7, p->max_corners);
    TEST_ASSERT_EQUAL(1, config.vehicle.max_sent_junctions);
    TEST_ASSERT_EQUAL(OC_JUDOCA_THESIS, p->method);
    TEST_ASSERT_TRUE(oc_vehicle_size(&config.vehicle) > 0);
}

static void cameras_arrive(void)
{
    load_well(
        LINK "cameras:\n" CAMERA(
            "left", "/dev/video0",
            "1280x720.yaml") "    format: MJPG\n    rate_hz: 29.5\n    buffers: 16\n    exposure: 20000\n    gain: -3\n"
                             "    white_balance: 6500\n    delay_us: -1000000\n    stall_ms: 100\n    retry_ms: 10\n    triggered: true\n" CAMERA(
                                 "right", "/dev/video1",
                                 "c.yaml") "    exposure: auto\n    white_balance: auto\n"
                                           "poses: {url: \"udpm://239.0.0.1:1\", type: bot_core, wait_ms: 1, max_gap_ms: 2}\n"
                                           "margins: {from: fixed, position_m: 0.5, angle_deg: 9}\narea: [-1, 2, -3, 4, 5]\n"
                                           "gpio:\n  trigger: {line: cam, mode: periodic, rate_hz: 0.1, pulse_us: 10}\n"
                                           "  strobe: {chip: /dev/gpiochip1, offset: 7, active_low: true, delay_us: 3, pulse_us: 11}\n"
                                           "  heartbeat: {chip: a, offset: 0, period_ms: 300}\n  enable: {line: en, bias: up}\n"
                                           "  mark: {line: mark, bias: down, debounce_ms: 10000}\n",
        &config);
    TEST_ASSERT_EQUAL(OC_SOURCE_CAMERAS, config.source);
    TEST_ASSERT_EQUAL(2, config.cameras.n_cameras);
    const oc_camera_config_t *left = &config.cameras.cameras[0], *right = &config.cameras.cameras[1];
    TEST_ASSERT_EQUAL_STRING("left", left->name);
    TEST_ASSERT_EQUAL_STRING("/dev/video0", left->wish.path);
    TEST_ASSERT_EQUAL(OC_PIXEL_MJPG, left->wish.format);
    TEST_ASSERT_EQUAL(1280, left->wish.width_px);
    TEST_ASSERT_EQUAL(720, left->wish.height_px);
    TEST_ASSERT_EQUAL(1280, left->lens.raw.width_px);
    TEST_ASSERT_EQUAL_DOUBLE(29.5, left->wish.rate_hz);
    TEST_ASSERT_EQUAL(16, left->wish.n_buffers);
    const oc_video_controls_t *c = &left->wish.controls;
    TEST_ASSERT_TRUE(c->has_exposure && !c->is_exposure_auto && c->exposure_us == 20000);
    TEST_ASSERT_TRUE(c->has_gain && c->gain == -3);
    TEST_ASSERT_TRUE(c->has_white_balance && !c->is_white_balance_auto && c->white_balance_k == 6500);
    TEST_ASSERT_EQUAL_DOUBLE(1, left->body_from_optical.t[0]);
    TEST_ASSERT_EQUAL_DOUBLE(3, left->body_from_optical.t[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI / 2, left->body_from_optical.R[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, -M_PI, left->body_from_optical.R[2]);
    TEST_ASSERT_EQUAL(100, left->stall_ms);
    TEST_ASSERT_EQUAL(10, left->retry_ms);
    TEST_ASSERT_EQUAL(-1000000, left->delay_us);
    TEST_ASSERT_TRUE(left->is_hardware_triggered && !right->is_hardware_triggered);
    c = &right->wish.controls;
    TEST_ASSERT_TRUE(c->has_exposure && c->is_exposure_auto && c->has_white_balance && c->is_white_balance_auto);
    TEST_ASSERT_FALSE(c->has_gain);
    TEST_ASSERT_EQUAL(OC_PIXEL_YUYV, right->wish.format);
    TEST_ASSERT_EQUAL_DOUBLE(0, right->wish.rate_hz);
    TEST_ASSERT_TRUE(right->wish.n_buffers == 6 && right->stall_ms == 2000 && right->retry_ms == 500);
    TEST_ASSERT_EQUAL_STRING("udpm://239.0.0.1:1", config.pose_url);
    TEST_ASSERT_EQUAL_STRING("POSE", config.pose_channel);
    TEST_ASSERT_EQUAL(OC_POSE_BOT_CORE, config.pose_type);
    TEST_ASSERT_EQUAL(1, config.cameras.pose_wait_ms);
    TEST_ASSERT_EQUAL(2, config.pose_max_gap_ms);
    TEST_ASSERT_TRUE(config.cameras.has_fixed_margin);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, config.cameras.margin.v[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, M_PI / 20, config.cameras.margin.v[5]);
    TEST_ASSERT_TRUE(config.vehicle.area.is_set);
    TEST_ASSERT_EQUAL_DOUBLE(-3, config.vehicle.area.y_min);
    TEST_ASSERT_EQUAL_DOUBLE(5, config.vehicle.area.z_max);
    const oc_gpio_config_t *g = &config.gpio;
    TEST_ASSERT_TRUE(g->trigger.is_used && g->trigger_mode == OC_TRIGGER_PERIODIC && g->trigger_pulse_us == 10);
    TEST_ASSERT_EQUAL_STRING("cam", g->trigger.line);
    TEST_ASSERT_EQUAL_DOUBLE(0.1, g->trigger_rate_hz);
    TEST_ASSERT_EQUAL_STRING("", g->strobe.line);
    TEST_ASSERT_EQUAL_STRING("/dev/gpiochip1", g->strobe.chip);
    TEST_ASSERT_TRUE(g->strobe.offset == 7 && g->strobe.is_active_low && !g->trigger.is_active_low);
    TEST_ASSERT_TRUE(g->strobe_delay_us == 3 && g->strobe_pulse_us == 11);
    TEST_ASSERT_EQUAL(150, g->heartbeat_ms);
    TEST_ASSERT_TRUE(g->enable.bias == OC_GPIO_BIAS_UP && g->mark.bias == OC_GPIO_BIAS_DOWN);
    TEST_ASSERT_EQUAL(10000, g->mark_debounce_ms);
}

static void cameras_have_defaults_of_their_own(void)
{
    load_well(ONE_CAMERA POSES, &config);
    TEST_ASSERT_EQUAL_STRING("OUTCROP_POSE", config.pose_channel);
    TEST_ASSERT_EQUAL(300, config.cameras.pose_wait_ms);
    TEST_ASSERT_EQUAL(250, config.pose_max_gap_ms);
    TEST_ASSERT_FALSE(config.cameras.has_fixed_margin);
    TEST_ASSERT_EQUAL_DOUBLE(0.01, config.cameras.margin.v[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 0.1 * M_PI / 180, config.cameras.margin.v[3]);
    TEST_ASSERT_EQUAL_STRING("", config.site);
}

static void the_status_file_is_in_the_runtime_folder(void)
{
    setenv("RUNTIME_DIRECTORY", "/run/outcrop:/run/other", 1);
    load_well(LINK SITE, &config);
    TEST_ASSERT_EQUAL_STRING("/run/outcrop/outcropd.json", config.status_file);
    load_well("status_file: here.json\n" LINK SITE, &config);
    TEST_ASSERT_EQUAL_STRING("here.json", config.status_file);
    char longest[OC_CONFIG_TEXT_BYTES];
    memset(longest, 'x', sizeof longest);
    longest[sizeof longest - 1] = '\0';
    setenv("RUNTIME_DIRECTORY", longest, 1);
    load_well(LINK SITE, &config);
    TEST_ASSERT_EQUAL_STRING("", config.status_file);
}

/* ---- faults ---- */

typedef struct fault_case {
    const char *text, *told; /* without the file's name */
} fault_case_t;

static void check_cases(const fault_case_t *cases, size_t n)
{
    for (size_t i = 0; i < n; i++) {
        TEST_ASSERT_FALSE_MESSAGE(load(cases[i].text, &config), cases[i].text);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, n_told, cases[i].text);
        char expected[700];
        snprintf(expected, sizeof expected, "%s:%s", file_path, cases[i].told);
        TEST_ASSERT_EQUAL_STRING(expected, told[0]);
    }
}

static void keys_are_held_against_each_other(void)
{
    static const fault_case_t cases[] = {
        {LINK, "1: source: is missing, and so is cameras: one must be given"},
        {ONE_CAMERA POSES SITE, "4: cameras: is given beside source: only one can be"},
        {ONE_CAMERA, "1: poses: is missing: cameras need it"},
        {LINK SITE POSES, "5: poses: has a meaning only with cameras"},
        {LINK SITE "area: [0, 1, 0, 1, 1]\n", "5: area: has a meaning only with cameras"},
        {LINK SITE "margins: {from: fixed}\n", "5: margins.from: has a meaning only with cameras"},
        {ONE_CAMERA CAMERA("front", "/dev/video1", "c.yaml") POSES,
         "9: cameras[1].name: \"front\" is that of cameras[0].name as well"},
        {ONE_CAMERA CAMERA("rear", "/dev/video0", "c.yaml") POSES,
         "10: cameras[1].device: \"/dev/video0\" is that of cameras[0].device as well"},
        {LINK "cameras:\n" CAMERA("a", "/dev/video0", "bad.yaml") POSES,
         "7: cameras[0].calibration: bad.yaml:3: camera_matrix is missing"},
        {LINK "cameras:\n" CAMERA("a", "/dev/video0", "641x480.yaml") POSES,
         "5: cameras[0].format: YUYV needs an even width, the calibration says 641x480"},
        {LINK "cameras:\n" CAMERA("a", "/dev/video0", "640x481.yaml") "    format: NV12\n" POSES,
         "9: cameras[0].format: NV12 needs an even height, the calibration says 640x481"},
        {ONE_CAMERA "    triggered: true\n" POSES, "9: cameras[0].triggered: needs gpio.trigger with mode: periodic"},
        {ONE_CAMERA "    triggered: true\n" POSES "gpio: {trigger: {line: x}}\n",
         "9: cameras[0].triggered: needs gpio.trigger with mode: periodic"},
        {ONE_CAMERA POSES "margins:\n  from: fixed\n  angle_deg: 1\n",
         "11: margins.position_m: is missing: from: fixed needs it"},
        {ONE_CAMERA POSES "  type: bot_core\n",
         "11: poses.type: bot_core poses have no covariance: margins.from must be fixed"},
        {LINK SITE "gpio:\n  mark: {active_low: true}\n",
         "6: gpio.mark: does not say which line: line, or chip and offset"},
        {LINK SITE "gpio:\n  mark: {line: x, offset: 1}\n",
         "6: gpio.mark.line: is given beside offset: only one can be"},
        {LINK SITE "gpio:\n  mark: {offset: 1}\n", "6: gpio.mark.chip: is missing: offset needs it"},
        {LINK SITE "gpio:\n  mark: {chip: c}\n", "6: gpio.mark.offset: is missing: chip needs it"},
        {LINK SITE "gpio:\n  strobe: {line: x}\n  mark: {line: x}\n", "7: gpio.mark: has the line of gpio.strobe"},
        {LINK SITE "gpio:\n  strobe: {chip: gpiochip0, offset: 3}\n  mark: {chip: /dev/gpiochip0, offset: 3}\n",
         "7: gpio.mark: has the line of gpio.strobe"},
        {LINK SITE "gpio:\n  trigger:\n    line: x\n    mode: periodic\n    rate_hz: 240\n    pulse_us: 4167\n",
         "10: gpio.trigger.pulse_us: 4167 us are no shorter than a period of 240 Hz"},
        {LINK SITE "gpio:\n  trigger: {line: x, mode: periodic, rate_hz: 100}\n  strobe: {line: y, delay_us: 9000}\n",
         "7: gpio.strobe: delay and pulse, 10000 us, are no shorter than a period of 100 Hz"},
        {LINK SITE "junctions: {lambda_px: 8, lambda_min_px: 9}\n",
         "5: junctions.lambda_min_px: 9 is more than lambda_px, 8"},
        {ONE_CAMERA POSES "area: [0, 1, 2, 2, 1]\n",
         "11: area: must be [x_min, x_max, y_min, y_max, z_max], ascending, z_max above 0"},
        {ONE_CAMERA POSES "area: [0, 1, 2, 3, 0]\n",
         "11: area: must be [x_min, x_max, y_min, y_max, z_max], ascending, z_max above 0"},
    };
    check_cases(cases, sizeof cases / sizeof cases[0]);
}

static void what_goes_together_is_taken(void)
{
    load_well(ONE_CAMERA
              "    triggered: true\n" POSES
              "gpio: {trigger: {line: x, mode: periodic, rate_hz: 239, pulse_us: 4167}, strobe: {line: y}}\n",
              &config);
    load_well(LINK "cameras:\n" CAMERA("a", "/dev/video0", "641x481.yaml") "    format: GREY\n" POSES, &config);
    load_well(LINK SITE "gpio: {trigger: {line: x, pulse_us: 100000, rate_hz: 240}, mark: {chip: x, offset: 1}}\n",
              &config);
    load_well(LINK SITE "margins:\nkeyframes:\npre_event:\ngpio:\njunctions:\n", &config);
    load_well("--- # one document\n" LINK SITE "vehicle: \"7\"\n...\n", &config);
    TEST_ASSERT_EQUAL(7, config.vehicle.vehicle);
}

static void values_are_taken_strictly(void)
{
    static const fault_case_t cases[] = {
        {"vehicle: 010\n" LINK SITE, "1: vehicle: \"010\" is not a whole number"},
        {"vehicle: 0x10\n" LINK SITE, "1: vehicle: \"0x10\" is not a whole number"},
        {"vehicle: -0\n" LINK SITE, "1: vehicle: \"-0\" is not a whole number"},
        {"vehicle: 1.0\n" LINK SITE, "1: vehicle: \"1.0\" is not a whole number"},
        {"vehicle: 99999999999999999999\n" LINK SITE, "1: vehicle: 99999999999999999999 is not within 0..255"},
        {"vehicle: -1\n" LINK SITE, "1: vehicle: -1 is not within 0..255"},
        {"vehicle: ~\n" LINK SITE, "1: vehicle: has no value"},
        {"vehicle: \"\"\n" LINK SITE, "1: vehicle: \"\" is not a whole number"},
        {"debug_dump: null\n" LINK SITE, "1: debug_dump: has no value"},
        {"debug_dump: ''\n" LINK SITE, "1: debug_dump: is empty"},
        {"debug_dump: \"a\\0b\"\n" LINK SITE, "1: debug_dump: holds a control character"},
        {"debug_dump: \"a\\x1b[31m\"\n" LINK SITE, "1: debug_dump: holds a control character"},
        {LINK "source: {site: s, loop: yes}\n", "4: source.loop: \"yes\" is not one of false, true"},
        {LINK "source: {site: s, keyframes: 1}\n", "4: source.keyframes: \"1\" is not one of all, moved"},
        {LINK SITE "junctions: {t_b: 0.4}\n", "5: junctions.t_b: 0.4 is not within 0.5..100 or 0"},
        {LINK SITE "junctions: {t_b: 0x1p3}\n", "5: junctions.t_b: \"0x1p3\" is not a number"},
        {LINK SITE "junctions: {t_b: -.INF}\n", "5: junctions.t_b: \"-.INF\" is not finite"},
        {LINK SITE "margins: 3\n", "5: margins: must be a section: keys on lines of their own"},
        {LINK SITE "[a]: 3\n", "5: a key must be a word"},
        {LINK SITE "vehicel: 3\n", "5: vehicel: is no key here: did you mean vehicle?"},
        {LINK SITE "\"vehicle\\0\": 3\n", "5: vehicle: is no key here: did you mean vehicle?"},
        {LINK SITE "kumquat: 3\n", "5: kumquat: is no key here"},
        {LINK SITE "<<: {vehicle: 3}\n", "5: <<: is no key here"},
        {LINK SITE "\"a\\e\\n\\u0085b\": 3\n", "5: a\\x1b\\x0a\\x85b: is no key here"},
        {ONE_CAMERA "    exposure: Auto\n" POSES,
         "9: cameras[0].exposure: \"Auto\" is neither auto nor a whole number"},
        {ONE_CAMERA "    exposure: 0\n" POSES, "9: cameras[0].exposure: 0 is not within 1..1000000"},
        {LINK "cameras: []\nposes: {url: memq://}\n", "4: cameras: has 0 items, not 1 to 8"},
        {LINK "cameras:\n  - front\n" POSES, "5: cameras[0]: must be a section: keys on lines of their own"},
    };
    check_cases(cases, sizeof cases / sizeof cases[0]);
}

/* ---- files that are none ---- */

static void expect_one_line(const char *what, const char *part)
{
    TEST_ASSERT_EQUAL_INT_MESSAGE(1, n_told, what);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(told[0], part), told[0]);
}

static void what_is_no_configuration_is_one_line(void)
{
    static const struct {
        const char *text, *part;
    } cases[] = {
        {"", ": is empty"},
        {"# nothing\n\n", ": is empty"},
        {"---\n", ": is empty"},
        {"- a\n", ":1: must be a mapping"},
        {"word\n", ":1: must be a mapping"},
        {"vehicle: 1\na: [\n", ":3: did not find expected node content while parsing a flow node"},
        {"vehicle: 1\n\tlink:\n", ":2: found a tab character that violates indentation while scanning a plain scalar"},
        {"\n\n\xff\xfe\n", ":3: "},
        {"a: \"\\q\"\n", ":1: found unknown escape character while parsing a quoted scalar"},
        {LINK SITE "---\nvehicle: 2\n", ":5: a second document begins here: a file holds one"},
        {"link: &l {a: 1}\nsource: *l\n", ":2: an alias (*l): write the value out"},
        {"a: &a [*a]\n", ":1: an alias (*a): write the value out"},
        {"a: &a [x,x]\nb: &b [*a,*a]\nc: &c [*b,*b]\n", ":2: an alias (*a)"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        TEST_ASSERT_FALSE(load(cases[i].text, &config));
        expect_one_line(cases[i].text, cases[i].part);
        TEST_ASSERT_EQUAL_STRING_LEN(file_path, told[0], strlen(file_path));
    }
    TEST_ASSERT_FALSE(load_bytes("vehicle: 1\0\n", 12, &config));
    expect_one_line("a NUL", ":1: control characters are not allowed");

    forget_told();
    TEST_ASSERT_FALSE(oc_config_load("/nowhere/x.yaml", &config, take_told, told));
    expect_one_line("no file", "/nowhere/x.yaml: No such file or directory");
    forget_told();
    TEST_ASSERT_FALSE(oc_config_load("/", &config, take_told, told));
    expect_one_line("a folder", "/: Is a directory");
    forget_told();
    TEST_ASSERT_FALSE(oc_config_load("/dev/zero", &config, take_told, told));
    expect_one_line("endless", "/dev/zero: is larger than 256 kB");
}

static void large_files_end(void)
{
    static char text[OC_YAML_MAX_BYTES + 2];
    memset(text, '[', sizeof text);
    TEST_ASSERT_FALSE(load_bytes(text, OC_YAML_MAX_BYTES, &config));
    expect_one_line("brackets", "is nested more than 32 deep");
    memset(text, 'x', sizeof text);
    TEST_ASSERT_FALSE(load_bytes(text, OC_YAML_MAX_BYTES, &config));
    expect_one_line("a word", ":1: must be a mapping");
    TEST_ASSERT_FALSE(load_bytes(text, sizeof text, &config));
    expect_one_line("too large", ": is larger than 256 kB");

    /* A configuration padded to the very limit is still one. */
    memset(text, '\n', sizeof text);
    memcpy(text, LINK SITE, strlen(LINK SITE));
    TEST_ASSERT_TRUE(load_bytes(text, OC_YAML_MAX_BYTES, &config));

    size_t n = strlen(LINK SITE);
    for (int i = 0; i < 300; i++) n += (size_t)snprintf(text + n, sizeof text - n, "kumquat%d: 1\n", i);
    TEST_ASSERT_FALSE(load_bytes(text, n, &config));
    TEST_ASSERT_EQUAL(OC_YAML_MAX_FAULTS + 1, n_told);
    TEST_ASSERT_TRUE(ends_with(told[n_told - 1], ": more than 200 faults: the rest is not told"));
}

/* Of too long a list only as many items are looked at as it may have. */
static void long_lists_are_cut(void)
{
    char text[4000] = LINK "poses: {url: memq://}\ncameras:\n";
    for (int i = 0; i < 300; i++) strcat(text, "  - x\n");
    TEST_ASSERT_FALSE(load(text, &config));
    TEST_ASSERT_EQUAL(9, n_told);
    TEST_ASSERT_TRUE(ends_with(told[0], ":5: cameras: has 300 items, not 1 to 8"));
    TEST_ASSERT_TRUE(ends_with(told[8], ":13: cameras[7]: must be a section: keys on lines of their own"));
}

static void a_faulty_file_leaves_the_configuration_alone(void)
{
    oc_config_t before;
    memset(&config, 0x5a, sizeof config);
    memset(&before, 0x5a, sizeof before);
    TEST_ASSERT_FALSE(load("vehicle: 3\n" LINK, &config));
    TEST_ASSERT_EQUAL_MEMORY(&before, &config, sizeof config);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(the_least_file_gives_the_defaults);
    RUN_TEST(a_site_s_file_arrives);
    RUN_TEST(cameras_arrive);
    RUN_TEST(cameras_have_defaults_of_their_own);
    RUN_TEST(the_status_file_is_in_the_runtime_folder);
    RUN_TEST(keys_are_held_against_each_other);
    RUN_TEST(what_goes_together_is_taken);
    RUN_TEST(values_are_taken_strictly);
    RUN_TEST(what_is_no_configuration_is_one_line);
    RUN_TEST(large_files_end);
    RUN_TEST(long_lists_are_cut);
    RUN_TEST(a_faulty_file_leaves_the_configuration_alone);
    return UNITY_END();
}
