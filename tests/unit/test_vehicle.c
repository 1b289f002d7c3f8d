/* SPDX-License-Identifier: BSD-3-Clause
 * The vehicle: its block, its ring, its area, its tiles, and what it does with bad frames. */
#include "vehicle_rig.h"

void setUp(void)
{
    rig_set_up();
}

void tearDown(void)
{
    canaries_check();
}

/* ---- the block ---- */

static void size_grows_with_everything_it_should(void)
{
    const size_t base = oc_vehicle_size(&config);
    oc_vehicle_config_t c;
    c = config, c.with_silhouettes = false;
    TEST_ASSERT_TRUE(oc_vehicle_size(&c) < base);
    c = config, c.stored_views++;
    TEST_ASSERT_TRUE(oc_vehicle_size(&c) > base);
    const size_t per_view = oc_vehicle_size(&c) - base;
    TEST_ASSERT_TRUE(per_view >= 4u * WIDTH * HEIGHT); /* grey and RGB */
    c.stored_views++;
    const size_t more = oc_vehicle_size(&c) - base; /* the views' own structs round up to a cache line */
    TEST_ASSERT_TRUE(more <= 2u * per_view + OC_ARENA_ALIGN && more + OC_ARENA_ALIGN >= 2u * per_view);
    c = config, c.max_width_px += 8;
    TEST_ASSERT_TRUE(oc_vehicle_size(&c) > base);
    c = config, c.max_height_px += 8;
    TEST_ASSERT_TRUE(oc_vehicle_size(&c) > base);
    c = config, c.judoca.max_junctions += 10;
    TEST_ASSERT_TRUE(oc_vehicle_size(&c) > base);
    c = config, c.max_sent_junctions += 100;
    TEST_ASSERT_TRUE(oc_vehicle_size(&c) > base);
    c = config, c.keep_colour = false;
    TEST_ASSERT_EQUAL(base - config.stored_views * 3u * WIDTH * HEIGHT, oc_vehicle_size(&c));
}

static void init_fails_with_one_byte_less(void)
{
    oc_vehicle_t *untouched = NULL;
    TEST_ASSERT_EQUAL(OC_E_SPACE, oc_vehicle_init(&config, block + CANARY_BYTES, block_bytes - 1u, &untouched));
    TEST_ASSERT_NULL(untouched);
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_vehicle_init(&config, block + CANARY_BYTES + 8, block_bytes, &untouched));
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_vehicle_init(&config, NULL, block_bytes, &untouched));
    TEST_ASSERT_NULL(untouched);
}

static void configurations_outside_their_ranges_have_no_size(void)
{
    oc_vehicle_config_t c;
    c = config, c.stored_views = 1;
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.stored_views = 257;
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.max_width_px = OC_MAX_IMAGE_SIDE + 1u;
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.datagram_bytes = OC_MIN_DATAGRAM_BYTES - 1u;
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.max_sent_junctions = 0;
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.ground.t_g = NAN;
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.judoca.s_j = NAN;
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.keyframe.min_move_m = (double)NAN;
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.area = (oc_area_t){true, 0.0, (double)NAN, 0.0, 1.0, 1.0};
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
    c = config, c.area = (oc_area_t){true, 1.0, 0.0, 0.0, 1.0, 1.0};
    TEST_ASSERT_EQUAL(0, oc_vehicle_size(&c));
}

/* ---- the area ---- */

static void only_what_can_lie_in_the_area_is_sent(void)
{
    config.area = (oc_area_t){true, 0.0, 0.2, -0.2, 0.0, 0.2};
    config.stored_views = 2;
    vehicle_start();
    oc_frame_t frame = frame_of(0);
    memset(&frame.margin, 0, sizeof frame.margin);
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_TRUE(report.n_sent > 0 && report.n_sent < report.n_found);
    /* Oracle: walk along the ray. */
    const oc_junction_t *all;
    uint32_t n, n_inside = 0;
    double centre[3], ray[3];
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_junctions(vehicle, report.view, &all, &n));
    oc_pose_centre(&cameras[0].pose, centre);
    for (uint32_t i = 0; i < n; i++) {
        bool is_inside = false;
        oc_camera_ray(&cameras[0], (double)all[i].x_px, (double)all[i].y_px, ray);
        for (double s = 0.0; s < 3.0 && !is_inside; s += 0.0005) {
            const double x = centre[0] + s * ray[0], y = centre[1] + s * ray[1], z = centre[2] + s * ray[2];
            is_inside = x >= 0.0 && x <= 0.2 && y >= -0.2 && y <= 0.0 && z >= 0.0 && z <= 0.2;
        }
        n_inside += is_inside;
    }
    TEST_ASSERT_UINT32_WITHIN(2, n_inside, report.n_sent); /* steps of half a millimetre */

    /* Wide margins let more through. */
    frame = frame_of(0);
    frame.has_view_id = true;
    frame.view_id = 40;
    oc_push_report_t wider;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &wider));
    TEST_ASSERT_TRUE(wider.n_sent > report.n_sent);
}

static void a_view_beside_the_area_is_announced(void)
{
    config.area = (oc_area_t){true, 50.0, 51.0, 50.0, 51.0, 0.2};
    vehicle_start();
    const oc_push_report_t report = push(0);
    TEST_ASSERT_EQUAL(0, report.n_sent);
    TEST_ASSERT_TRUE(report.n_found > 50);
    TEST_ASSERT_EQUAL(1, drain());
}

/* ---- ring ---- */

static void the_oldest_view_leaves_the_ring(void)
{
    oc_image_t image;
    for (int i = 0; i < 5; i++) (void)push(i);
    TEST_ASSERT_EQUAL(OC_E_STATE, oc_vehicle_stored(vehicle, 0, &image));
    TEST_ASSERT_EQUAL(1, counter(OC_COUNT_VIEWS_DROPPED)); /* nobody had pulled its packets */
    for (uint16_t i = 1; i < 5; i++) {
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_stored(vehicle, i, &image));
        TEST_ASSERT_EQUAL_MEMORY(pixels[i], image.px, WIDTH * HEIGHT);
    }
    TEST_ASSERT_EQUAL(OC_E_STATE, ask_resend(0, 1));
    TEST_ASSERT_EQUAL(OC_E_STATE, ask_patch(0, 10, 0, 4));
    TEST_ASSERT_EQUAL(2, counter(OC_COUNT_REQUESTS_GONE));
    const oc_junction_t *junctions;
    uint32_t n;
    TEST_ASSERT_EQUAL(OC_E_STATE, oc_vehicle_junctions(vehicle, 0, &junctions, &n));
}

static void requests_leave_with_their_view(void)
{
    for (int i = 0; i < 4; i++) (void)push(i);
    (void)drain();
    TEST_ASSERT_EQUAL(OC_OK, ask_patch(0, 10, 0, 4));
    TEST_ASSERT_EQUAL(OC_OK, ask_patch(1, 10, 0, 4));
    TEST_ASSERT_EQUAL(OC_OK, ask_resend(0, UINT32_MAX));
    (void)push(4);
    TEST_ASSERT_EQUAL(1, counter(OC_COUNT_REQUESTS_GONE));
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    oc_patch_t *patch = malloc(sizeof *patch);
    uint32_t n_patches = 0;
    for (size_t n_bytes; (n_bytes = next(buf, &head)) > 0;) {
        if (head.type != OC_PACKET_PATCH) continue;
        TEST_ASSERT_EQUAL(OC_OK, oc_packet_decode_patch(buf, n_bytes, patch));
        TEST_ASSERT_EQUAL(1, patch->view);
        n_patches++;
    }
    free(patch);
    TEST_ASSERT_EQUAL(1, n_patches);
    TEST_ASSERT_EQUAL(0, counter(OC_COUNT_VIEWS_DROPPED));
}

static void colour_is_kept_when_asked_for(void)
{
    oc_image_t image;
    oc_frame_t frame = frame_of(0);
    frame.image = (oc_image_t){colours[0], WIDTH, HEIGHT, 3 * WIDTH, 3};
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_stored(vehicle, report.view, &image));
    TEST_ASSERT_EQUAL(3, image.channels);
    TEST_ASSERT_EQUAL_MEMORY(colours[0], image.px, sizeof colours[0]);
    config.keep_colour = false;
    vehicle_start();
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_stored(vehicle, report.view, &image));
    TEST_ASSERT_EQUAL(1, image.channels);
    TEST_ASSERT_EQUAL_MEMORY(pixels[0], image.px, sizeof pixels[0]);
}

/* ---- frames that are not taken ---- */

static void bad_frames_change_nothing_but_counters(void)
{
    (void)push(0);
    (void)drain();
    oc_vehicle_status_t before = {0}, after = {0};
    oc_vehicle_get_status(vehicle, &before);
    for (int fault = 0; fault < 10; fault++) {
        oc_frame_t frame = frame_of(1);
        oc_status_t expected = OC_E_ARG;
        if (fault == 0) frame.image.px = NULL;
        if (fault == 1) frame.image.channels = 2;
        if (fault == 2) frame.camera.k.fx_px = (double)NAN;
        if (fault == 3) frame.camera.pose.R[4] += 0.5;
        if (fault == 4) frame.margin.v[2] = (double)NAN;
        if (fault == 5) frame.margin.v[5] = -0.1;
        if (fault == 6) frame.camera.k.width_px = WIDTH - 1u;
        if (fault == 7) frame.has_view_id = true, frame.view_id = 0; /* taken */
        if (fault == 8) frame.utime_us = -1;
        if (fault == 9) frame.camera_index = OC_MAX_CAMERAS, expected = OC_E_LIMIT;
        oc_push_report_t report = {.n_found = 777};
        TEST_ASSERT_EQUAL(expected, oc_vehicle_push(vehicle, &frame, &report));
        TEST_ASSERT_EQUAL(777, report.n_found);
    }
    static uint8_t large[(WIDTH + 8) * HEIGHT];
    oc_frame_t frame = frame_of(1);
    frame.image = (oc_image_t){large, WIDTH + 8, HEIGHT, WIDTH + 8, 1};
    frame.camera.k.width_px = WIDTH + 8;
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_E_LIMIT, oc_vehicle_push(vehicle, &frame, &report));
    oc_vehicle_get_status(vehicle, &after);
    TEST_ASSERT_EQUAL(before.n_views, after.n_views);
    TEST_ASSERT_EQUAL(before.counters[OC_COUNT_FRAMES_IN] + 11u, after.counters[OC_COUNT_FRAMES_IN]);
    TEST_ASSERT_EQUAL(0, drain());
    TEST_ASSERT_EQUAL(1, push(1).view);
}

static void frames_between_keyframes_are_passed_over(void)
{
    oc_frame_t frame = frame_of(0);
    frame.is_forced = false;
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_TRUE(report.is_keyframe);
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_FALSE(report.is_keyframe);
    TEST_ASSERT_EQUAL(1, counter(OC_COUNT_FRAMES_NOT_KEY));
    frame.camera_index = 1; /* another camera starts its own count */
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_TRUE(report.is_keyframe);
}

static void smaller_frames_are_taken_too(void)
{
    (void)push(0);
    oc_camera_t small = cameras[1];
    small.k =
        oc_intrinsics_from_format(table_7_3.focal_mm, OC_TEST_FORMAT_WIDTH_MM, OC_TEST_FORMAT_HEIGHT_MM, 200, 150);
    static uint8_t px[200 * 150];
    oc_frame_t frame = frame_of(1);
    frame.image = oc_scene_render(&scene, &small, px);
    frame.camera = small;
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    TEST_ASSERT_TRUE(report.n_found > 20);
    TEST_ASSERT_TRUE(push(2).n_found > 50);
    TEST_ASSERT_TRUE(drain() > 3);
}

/* ---- tiles ---- */

static oc_overhead_request_t tile_request(uint16_t view, int camera, double scale, double metres_per_pixel)
{
    oc_overhead_request_t request = {.view = view, .metres_per_pixel = metres_per_pixel, .tile_px = 64, .quality = 50};
    oc_plane_image_from_ground(&cameras[camera], request.image_from_ground);
    for (int i = 0; i < 9; i++) request.image_from_ground[i] *= scale;
    return request;
}

static void tiles_show_the_ground(void)
{
    const uint16_t view = push(3).view;
    uint8_t px[64 * 64];
    oc_image_mut_t out = {px, 64, 64, 64, 1};
    for (int sign = -1; sign <= 1; sign += 2) { /* the matrix has no sign of its own */
        const oc_overhead_request_t request = tile_request(view, 3, sign * 0.001, 0.002);
        const oc_tile_id_t tile = {.ix = 3, .iy = 1}; /* x .384 ..512, y .128 .. .256: clear of the boxes */
        uint32_t n_seen = 0, n = 0;
        double error = 0.0;
        TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_tile(vehicle, &request, tile, &out, &n_seen));
        for (uint32_t i = 0; i < 64 * 64; i++) {
            const double x = (3 * 64 + i % 64 + 0.5) * 0.002, y = (2 * 64 - (double)(i / 64) - 0.5) * 0.002;
            const double p[3] = {x, y, 0.0};
            double u, v;
            if (!(oc_camera_project(&cameras[3], p, &u, &v) > 0.0) ||
                !(u > 0 && v > 0 && u < WIDTH - 1 && v < HEIGHT - 1)) {
                TEST_ASSERT_EQUAL(128, px[i]);
                continue;
            }
            n++;
            error += fabs((double)px[i] - oc_scene_texture(OC_SCENE_FACE_GROUND, scene.cell_m, x, y));
        }
        TEST_ASSERT_EQUAL(n, n_seen);
        TEST_ASSERT_TRUE(n > 2000);
        TEST_ASSERT_TRUE(error / n < 12.0); /* edges are blurred by both pixel grids */
    }
}

/* The level camera sees ground in front only; what lies behind it would be drawn
 * upside down if the sign of the depth were not looked at. */
static void tiles_behind_the_camera_are_not_seen(void)
{
    oc_camera_t level = cameras[0];
    double R[9];
    const double centre[3] = {0.0, 0.0, 0.5};
    oc_thesis_from_pts(0.0, OC_TEST_RAD(85.0), 0.0, R); /* looks along +Y */
    oc_cv_from_thesis(R, R);
    oc_pose_from_centre(R, centre, &level.pose);
    cameras[0] = level;
    oc_frame_t frame = frame_of(0);
    oc_push_report_t report;
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_push(vehicle, &frame, &report));
    const oc_overhead_request_t request = tile_request(report.view, 0, 1.0, 0.1);
    uint8_t px[64 * 64 * 3];
    oc_image_mut_t out = {px, 64, 64, 3 * 64, 3};
    uint32_t n_seen = 0;
    const oc_tile_id_t ahead = {.ix = 0, .iy = 0}, behind = {.ix = 0, .iy = -1};
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_tile(vehicle, &request, ahead, &out, &n_seen));
    TEST_ASSERT_TRUE(n_seen > 100);
    TEST_ASSERT_EQUAL(OC_OK, oc_vehicle_tile(vehicle, &request, behind, &out, &n_seen));
    TEST_ASSERT_EQUAL(0, n_seen);
    for (size_t i = 0; i < sizeof px; i++) TEST_ASSERT_EQUAL(128, px[i]);
    cameras[0] = oc_test_camera(&table_7_3, 2);
    cameras[0].k = level.k;
}

static void bad_tile_requests_are_refused(void)
{
    const uint16_t view = push(0).view;
    uint8_t px[64 * 64];
    oc_image_mut_t out = {px, 64, 64, 64, 1};
    uint32_t n_seen = 77;
    const oc_tile_id_t tile = {0, 0};
    oc_overhead_request_t request = tile_request((uint16_t)(view + 1), 0, 1.0, 0.01);
    TEST_ASSERT_EQUAL(OC_E_STATE, oc_vehicle_tile(vehicle, &request, tile, &out, &n_seen));
    request = tile_request(view, 0, 1.0, 0.01);
    request.tile_px = 32;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_vehicle_tile(vehicle, &request, tile, &out, &n_seen));
    request = tile_request(view, 0, 1.0, (double)NAN);
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_vehicle_tile(vehicle, &request, tile, &out, &n_seen));
    request = tile_request(view, 0, 1.0, 0.01);
    request.image_from_ground[3] = (double)NAN;
    TEST_ASSERT_EQUAL(OC_E_ARG, oc_vehicle_tile(vehicle, &request, tile, &out, &n_seen));
    TEST_ASSERT_EQUAL(77, n_seen);
}

/* ---- endurance ---- */

/* A thousand frames of changing size, place and content, with requests of all
 * kinds between them and packets pulled at random. tearDown looks at the canaries. */
static void a_thousand_frames_stay_inside_the_block(void)
{
    enum { W = 96, H = 72 };
    static uint8_t px[3 * W * H];
    oc_test_random_t random = oc_test_random_from(1000);
    config.max_width_px = W;
    config.max_height_px = H;
    config.stored_views = 3;
    config.datagram_bytes = OC_MIN_DATAGRAM_BYTES;
    config.ground.window_px = 9;
    vehicle_start();
    for (int n = 0; n < 1000; n++) {
        oc_camera_t camera = cameras[n % N_VIEWS];
        const uint32_t w = n % 5 == 4 ? 64 : W, h = n % 7 == 6 ? 40 : H, channels = n % 3 == 0 ? 3 : 1;
        camera.k = oc_intrinsics_from_format(3.6, OC_TEST_FORMAT_WIDTH_MM, OC_TEST_FORMAT_HEIGHT_MM, w, h);
        const int x0 = (int)oc_test_uniform(&random, 0, WIDTH - W), y0 = (int)oc_test_uniform(&random, 0, HEIGHT - H);
        for (uint32_t i = 0; i < w * h * channels; i++) {
            const uint32_t x = i / channels % w, y = i / channels / w;
            px[i] = pixels[n % N_VIEWS][((uint32_t)y0 + y) * WIDTH + (uint32_t)x0 + x];
        }
        oc_frame_t frame = frame_of(n % N_VIEWS);
        frame.image = (oc_image_t){px, w, h, w * channels, channels};
        frame.camera = camera;
        frame.is_forced = n % 11 != 0;
        oc_push_report_t report;
        TEST_ASSERT_EQUAL_MESSAGE(OC_OK, oc_vehicle_push(vehicle, &frame, &report), oc_test_draw(&random, n));
        const uint16_t view = (uint16_t)oc_test_uniform(&random, n > 4 ? n - 4 : 0, n + 2);
        (void)ask_resend(view, (uint32_t)oc_test_uniform(&random, 1, 4e9));
        (void)ask_patch(view, (uint8_t)oc_test_uniform(&random, 1, 32), (uint16_t)oc_test_uniform(&random, 0, 100), 30);
        uint8_t buf[OC_MAX_DATAGRAM_BYTES];
        oc_packet_head_t head;
        for (int pulls = (int)oc_test_uniform(&random, 0, 20); pulls > 0 && next(buf, &head) > 0; pulls--) {
        }
    }
    (void)drain();
    TEST_ASSERT_EQUAL(0, counter(OC_COUNT_SEND_FAILED));
    TEST_ASSERT_EQUAL(1000, counter(OC_COUNT_FRAMES_IN));
}

int main(void)
{
    UNITY_BEGIN();
    scene_make();
    RUN_TEST(size_grows_with_everything_it_should);
    RUN_TEST(init_fails_with_one_byte_less);
    RUN_TEST(configurations_outside_their_ranges_have_no_size);
    RUN_TEST(only_what_can_lie_in_the_area_is_sent);
    RUN_TEST(a_view_beside_the_area_is_announced);
    RUN_TEST(the_oldest_view_leaves_the_ring);
    RUN_TEST(requests_leave_with_their_view);
    RUN_TEST(colour_is_kept_when_asked_for);
    RUN_TEST(bad_frames_change_nothing_but_counters);
    RUN_TEST(frames_between_keyframes_are_passed_over);
    RUN_TEST(smaller_frames_are_taken_too);
    RUN_TEST(tiles_show_the_ground);
    RUN_TEST(tiles_behind_the_camera_are_not_seen);
    RUN_TEST(bad_tile_requests_are_refused);
    RUN_TEST(a_thousand_frames_stay_inside_the_block);
    free(block);
    return UNITY_END();
}
