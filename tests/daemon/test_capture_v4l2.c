/* SPDX-License-Identifier: BSD-3-Clause
 * V4L2 without a camera: what is no device is told in one line. Real drivers are in the virtual machine's tests. */
#include "unity.h"

#include <string.h>

#include "video_device.h"

void setUp(void) {}

void tearDown(void) {}

static void refused(const char *path, const char *what)
{
    oc_video_wish_t wish = {.format = OC_PIXEL_YUYV, .width_px = 640, .height_px = 480, .n_buffers = 6};
    strncpy(wish.path, path, sizeof wish.path - 1);
    oc_video_mode_t mode;
    char error[320] = "";
    TEST_ASSERT_NULL(oc_video_v4l2.open(&wish, &mode, error, sizeof error));
    TEST_ASSERT_EQUAL_MESSAGE(0, strncmp(error, path, strlen(path)), error);
    TEST_ASSERT_NOT_NULL_MESSAGE(strstr(error, what), error);
    TEST_ASSERT_NULL_MESSAGE(strchr(error, '\n'), error);
}

static void what_is_no_camera_is_told_in_a_line(void)
{
    refused("/nowhere/at/all", "No such file");
    refused("/dev/null", "is not a V4L2 device");
    refused("/dev/zero", "is not a V4L2 device");
    refused("/tmp", "Is a directory");
    refused("/proc/self/mounts", "");
    refused(OUTCROP_TEST_DATA "/sites/depot/cameras.json", "is not a device");
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(what_is_no_camera_is_told_in_a_line);
    return UNITY_END();
}
