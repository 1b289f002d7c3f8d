/* SPDX-License-Identifier: BSD-3-Clause
 * Site folders: a good one frame by frame, the rule of the margins, and every way a folder can be wrong. */
#include "unity.h"

#include <fcntl.h>
#include <jansson.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include "capture.h"
#include "site_maker.h"

static const oc_margin_option_t no_option = {(double)NAN, (double)NAN};
static char folder[64];
static json_t *site; /* what write_site writes */
static oc_margin_t margin;
static char error[1024];

void setUp(void)
{
    strcpy(folder, "/tmp/outcrop_site_XXXXXX");
    TEST_ASSERT_NOT_NULL(mkdtemp(folder));
    for (int i = 0; i < 3; i++) site_maker_png(folder, i, 64, 48);
    site = site_maker_json();
}

void tearDown(void)
{
    json_decref(site);
    site_maker_remove(folder);
}

static const oc_site_option_t at_once;

static oc_capture_t *open_site(const oc_margin_option_t *option)
{
    site_maker_write(folder, site);
    error[0] = '\0';
    memset(&margin, 0, sizeof margin);
    return oc_capture_open_site(folder, &at_once, option, &margin, error, sizeof error);
}

/* The site is refused with one line that names a file of the folder and holds `what`; nothing is put out. */
static void refused(const char *what)
{
    oc_capture_t *capture = open_site(&no_option);
    TEST_ASSERT_NULL_MESSAGE(capture, what);
    TEST_ASSERT_NULL_MESSAGE(strchr(error, '\n'), error);
    TEST_ASSERT_EQUAL_MESSAGE(0, strncmp(error, folder, strlen(folder)), error);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, what), error);
    for (int i = 0; i < 6; i++) TEST_ASSERT_EQUAL_DOUBLE(0, margin.v[i]);
}

static json_t *view(size_t i)
{
    return json_array_get(json_object_get(site, "views"), i);
}

/* One key of view 1 or of the whole file is replaced by what `text` says (NULL: taken out), tried and put back. */
static void refused_with(json_t *object, const char *key, const char *text, const char *what)
{
    json_t *old = json_deep_copy(json_object_get(object, key));
    if (text) {
        json_error_t fault;
        json_t *value = json_loads(text, JSON_DECODE_ANY, &fault);
        TEST_ASSERT_NOT_NULL_MESSAGE(value, text);
        json_object_set_new(object, key, value);
    } else {
        json_object_del(object, key);
    }
    refused(what);
    json_object_del(object, key);
    if (old) json_object_set_new(object, key, old);
}

static void plays_its_views_in_order_with_their_numbers_and_times(void)
{
    json_object_set_new(view(2), "index", json_integer(7));
    json_object_set_new(view(1), "utime", json_integer(1500000000000000));
    oc_capture_t *capture = open_site(&no_option);
    TEST_ASSERT_NOT_NULL_MESSAGE(capture, error);
    TEST_ASSERT_EQUAL(3, capture->n_frames);
    TEST_ASSERT_EQUAL(64, capture->max_width_px);
    TEST_ASSERT_EQUAL(48, capture->max_height_px);
    const int ids[3] = {0, 1, 7};
    oc_captured_t frame;
    for (int i = 0; i < 3; i++) {
        TEST_ASSERT_EQUAL(OC_CAPTURE_FRAME, capture->next(capture, 1, &frame, error, sizeof error));
        TEST_ASSERT_TRUE(frame.has_view_id && frame.is_forced);
        TEST_ASSERT_EQUAL(ids[i], frame.view_id);
        TEST_ASSERT_EQUAL_UINT8(site_maker_pixel(i, 10, 20, 1), frame.raw.px[20 * frame.raw.stride_bytes + 31]);
        double centre[3];
        oc_pose_centre(&frame.camera.pose, centre);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, 1.0 + i, centre[2]); /* millimetres in the file */
        if (i == 1) TEST_ASSERT_EQUAL_INT64(1500000000000000, frame.utime_us);
    }
    TEST_ASSERT_EQUAL_INT64(1072915200000000 + 2000000, frame.utime_us);
    TEST_ASSERT_EQUAL(OC_CAPTURE_DONE, capture->next(capture, 1, &frame, error, sizeof error));
    TEST_ASSERT_EQUAL(OC_CAPTURE_DONE, capture->next(capture, 1, &frame, error, sizeof error));
    capture->close(capture);
}

static void a_looped_site_goes_on_for_ever_with_times_that_go_on(void)
{
    site_maker_write(folder, site);
    const oc_site_option_t paced = {.period_ms = 40, .repeat = 2, .is_looped = true, .has_keyframe_policy = true};
    oc_capture_t *capture = oc_capture_open_site(folder, &paced, &no_option, &margin, error, sizeof error);
    TEST_ASSERT_NOT_NULL_MESSAGE(capture, error);
    TEST_ASSERT_EQUAL(0, capture->n_frames);
    site_maker_remove(folder); /* it reads no file any more */
    oc_captured_t frame;
    const int64_t start_ns = 5000000000;
    for (int i = 0; i < 20; i++) {
        const int64_t due_ns = start_ns + i * 40000000LL;
        int64_t wake_ns = -1;
        if (i > 0) {
            TEST_ASSERT_EQUAL(OC_CAPTURE_NONE, capture->next(capture, due_ns - 1, &frame, error, sizeof error));
            TEST_ASSERT_EQUAL(0, capture->wait(capture, NULL, &wake_ns));
            TEST_ASSERT_EQUAL_INT64(due_ns, wake_ns);
        }
        /* Asked late, it still gives every frame, dated when it was due. */
        TEST_ASSERT_EQUAL(OC_CAPTURE_FRAME, capture->next(capture, due_ns + (i > 0) * 7, &frame, error, sizeof error));
        TEST_ASSERT_EQUAL_INT64(due_ns, frame.arrived_ns);
        TEST_ASSERT_EQUAL_INT64(1072915200000000 + i * 40000, frame.utime_us);
        TEST_ASSERT_FALSE(frame.has_view_id || frame.is_forced);
        TEST_ASSERT_EQUAL_UINT8(site_maker_pixel(i / 2 % 3, 10, 20, 1), frame.raw.px[20 * frame.raw.stride_bytes + 31]);
    }
    capture->close(capture);
}

static void margins_come_from_the_option_before_the_file_before_the_rule(void)
{
    oc_capture_t *capture = open_site(&no_option);
    TEST_ASSERT_NOT_NULL_MESSAGE(capture, error);
    capture->close(capture);
    /* Cameras 1, 2 and 3 m above the ground look straight down: the median distance is 2 m. */
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.005 * 2, margin.v[0]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 3.14159265358979 / 180, margin.v[5]);

    json_object_set_new(site, "margins", json_pack("{s:f, s:f}", "position", 30.0, "angle_deg", 2.0));
    capture = open_site(&no_option);
    TEST_ASSERT_NOT_NULL_MESSAGE(capture, error);
    capture->close(capture);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 0.03, margin.v[2]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2 * 3.14159265358979 / 180, margin.v[3]);

    const oc_margin_option_t option = {0.2, (double)NAN};
    capture = open_site(&option);
    TEST_ASSERT_NOT_NULL_MESSAGE(capture, error);
    oc_captured_t frame;
    TEST_ASSERT_EQUAL(OC_CAPTURE_FRAME, capture->next(capture, 1, &frame, error, sizeof error));
    TEST_ASSERT_EQUAL_DOUBLE(0.2, frame.margin.v[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 2 * 3.14159265358979 / 180, frame.margin.v[4]);
    capture->close(capture);
}

static void the_area_comes_in_metres(void)
{
    json_object_set_new(site, "area",
                        json_pack("{s:[f,f], s:[f,f], s:f}", "x", -100.0, 200.0, "y", 0.0, 50.0, "z_max", 300.0));
    oc_capture_t *capture = open_site(&no_option);
    TEST_ASSERT_NOT_NULL_MESSAGE(capture, error);
    TEST_ASSERT_TRUE(capture->area.is_set);
    TEST_ASSERT_EQUAL_DOUBLE(-0.1, capture->area.x_min);
    TEST_ASSERT_EQUAL_DOUBLE(0.05, capture->area.y_max);
    TEST_ASSERT_EQUAL_DOUBLE(0.3, capture->area.z_max);
    capture->close(capture);
}

static void refuses_a_bad_file(void)
{
    refused_with(site, "units", "\"cm\"", "\"units\" must be");
    refused_with(site, "units", NULL, "\"units\" must be");
    refused_with(site, "views", NULL, "at least two views, has 0");
    refused_with(site, "views", "[]", "at least two views, has 0");
    refused_with(site, "views", "[{}]", "at least two views, has 1");
    refused_with(site, "views", "7", "at least two views");
    refused_with(site, "views", "[1, 2]", "view 0 is not an object");
    refused_with(site, "margins", "{\"position\": -1, \"angle_deg\": 1}", "not negative");
    refused_with(site, "margins", "{\"position\": 1, \"angle_deg\": -1}", "not negative");
    refused_with(site, "margins", "{\"position\": 1}", "\"margins\" must hold");
    refused_with(site, "margins", "{\"position\": 1e300, \"angle_deg\": 1}", "larger than");
    refused_with(site, "margins", "{\"position\": 1, \"angle_deg\": 90}", "larger than");
    refused_with(site, "margins", "\"wide\"", "\"margins\" must hold");
    refused_with(site, "area", "{\"x\": [2, 1], \"y\": [0, 1], \"z_max\": 1}", "\"x\" must be two ascending");
    refused_with(site, "area", "{\"x\": [0, 1], \"y\": [1, 1], \"z_max\": 1}", "\"y\" must be two ascending");
    refused_with(site, "area", "{\"x\": [0, 1, 2], \"y\": [0, 1], \"z_max\": 1}", "\"x\" must be two ascending");
    refused_with(site, "area", "{\"x\": [0, \"1\"], \"y\": [0, 1], \"z_max\": 1}", "\"x\" must be two ascending");
    refused_with(site, "area", "{\"x\": [0, 1e200], \"y\": [0, 1], \"z_max\": 1}", "farther");
    refused_with(site, "area", "{\"x\": [0, 1], \"y\": [0, 1], \"z_max\": 0}", "\"z_max\"");
    refused_with(site, "area", "{\"x\": [0, 1], \"y\": [0, 1]}", "\"z_max\"");
    refused_with(site, "area", "3", "\"x\" must be");
}

static void refuses_bad_intrinsics(void)
{
    static const char *const keys[] = {"fx", "fy", "cx", "cy", "width", "height"};
    for (size_t i = 0; i < sizeof keys / sizeof *keys; i++) {
        refused_with(view(1), keys[i], NULL, keys[i]);
        refused_with(view(1), keys[i], "\"12\"", keys[i]);
        refused_with(view(1), keys[i], "null", keys[i]);
        refused_with(view(1), keys[i], "[1]", keys[i]);
    }
    refused_with(view(1), "fx", "0", "view 1: focal length is not positive");
    refused_with(view(1), "fy", "-600.5", "view 1: focal length is not positive");
    refused_with(view(1), "fx", "1e12", "focal length is not within");
    refused_with(view(1), "fx", "0.5", "focal length is not within");
    refused_with(view(1), "cx", "1e9", "principal point");
    refused_with(view(1), "width", "64.0", "\"width\" is missing or not an integer");
    refused_with(view(1), "width", "31", "\"width\" is not within");
    refused_with(view(1), "height", "4097", "\"height\" is not within");
    refused_with(view(1), "height", "-48", "\"height\" is not within");
    refused_with(view(1), "width", "65", "is 64x48, the file says 65x48");
    refused_with(view(1), "dist", "[0, 0, 0, 0]", "\"dist\" must be an array of 5");
    refused_with(view(1), "dist", "[0, 0, 0, 0, \"0\"]", "\"dist\" must be an array of 5");
    refused_with(view(1), "dist", "[1e300, 0, 0, 0, 0]", "\"dist\" is larger");
}

static void refuses_bad_poses_numbers_and_times(void)
{
    refused_with(view(1), "R", NULL, "view 1: \"R\" must have three rows");
    refused_with(view(1), "R", "[[1,0,0],[0,1,0]]", "\"R\" must have three rows");
    refused_with(view(1), "R", "[[1,0,0],[0,1,0],[0,0]]", "\"R\" must be an array of 3");
    refused_with(view(1), "R", "[[1,0,0],[0,1,0],[0,0,1.01]]", "view 1: \"R\" is not a rotation");
    refused_with(view(1), "R", "[[1,0,0],[0,1,0],[0,0,-1]]", "\"R\" is not a rotation"); /* a reflection */
    refused_with(view(1), "R", "[[0,0,0],[0,0,0],[0,0,0]]", "\"R\" is not a rotation");
    refused_with(view(1), "R", "[[1e200,0,0],[0,1,0],[0,0,1]]", "\"R\" is not a rotation");
    refused_with(view(1), "t", "[0, 0]", "\"t\" must be an array of 3");
    refused_with(view(1), "t", "[0, 0, \"NaN\"]", "\"t\" must be an array of 3");
    refused_with(view(1), "t", "[1e300, 0, 0]", "km away");
    refused_with(view(1), "index", "0", "view 1: \"index\" does not ascend");
    refused_with(view(1), "index", "-1", "\"index\" is not within");
    refused_with(view(1), "index", "65535", "\"index\" is not within");
    refused_with(view(1), "index", "1.0", "\"index\" is not within");
    refused_with(view(1), "utime", "\"now\"", "\"utime\"");
    refused_with(view(1), "utime", "-1", "\"utime\"");
    refused_with(view(1), "utime", "100000000000000000", "\"utime\"");
}

static void refuses_text_that_is_no_json(void)
{
    static const char *const texts[] = {
        "",
        "{",
        "[]",
        "not json",
        "{\"units\": \"m\", \"views\": [NaN, Infinity]}",
        "{\"units\": \"m\", \"views\": [{\"fx\": 1e999}]}",
        "{\"units\": \"m\", \"views\": [{\"width\": 99999999999999999999999}]}",
        "{\"units\": \"m\", \"units\": \"mm\"}",
        "{\"units\": \"m\", \"views\": [{\"fx\": 1, \"fx\": 2}]}",
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        site_maker_text(folder, texts[i]);
        error[0] = '\0';
        TEST_ASSERT_NULL_MESSAGE(oc_capture_open_site(folder, &at_once, &no_option, &margin, error, sizeof error),
                                 texts[i]);
        TEST_ASSERT_EQUAL_MESSAGE(0, strncmp(error, folder, strlen(folder)), error);
        TEST_ASSERT_NULL_MESSAGE(strchr(error, '\n'), error);
        TEST_ASSERT_TRUE_MESSAGE(strlen(error) > strlen(folder) + 16, error);
    }
}

static void refuses_bad_pictures(void)
{
    refused_with(view(1), "image", NULL, "view 1: \"image\" is missing");
    refused_with(view(1), "image", "3", "view 1: \"image\" is missing");
    refused_with(view(1), "image", "\"none.png\"", "none.png: No such file");
    refused_with(view(1), "image", "\"cameras.json\"", "cameras.json: neither PNG nor JPEG");
    refused_with(view(1), "image", "\".\"", "too short to be a picture");

    /* All of a picture is read before the drive begins, not only its size. */
    char path[128];
    snprintf(path, sizeof path, "%s/view_1.png", folder);
    struct stat info;
    TEST_ASSERT_EQUAL(0, stat(path, &info));
    TEST_ASSERT_EQUAL(0, truncate(path, info.st_size - 20));
    refused("view_1.png: ");
    TEST_ASSERT_EQUAL(0, truncate(path, 4));
    refused("view_1.png: too short");
}

static void names_a_folder_that_is_not_there(void)
{
    TEST_ASSERT_NULL(oc_capture_open_site("/nowhere/at/all", &at_once, &no_option, &margin, error, sizeof error));
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, "/nowhere/at/all"), error);
    TEST_ASSERT_NULL(
        oc_capture_open_site(folder, &at_once, &no_option, &margin, error, sizeof error)); /* no cameras.json yet */
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, "cameras.json"), error);
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(plays_its_views_in_order_with_their_numbers_and_times);
    RUN_TEST(a_looped_site_goes_on_for_ever_with_times_that_go_on);
    RUN_TEST(margins_come_from_the_option_before_the_file_before_the_rule);
    RUN_TEST(the_area_comes_in_metres);
    RUN_TEST(refuses_a_bad_file);
    RUN_TEST(refuses_bad_intrinsics);
    RUN_TEST(refuses_bad_poses_numbers_and_times);
    RUN_TEST(refuses_text_that_is_no_json);
    RUN_TEST(refuses_bad_pictures);
    RUN_TEST(names_a_folder_that_is_not_there);
    return UNITY_END();
}
