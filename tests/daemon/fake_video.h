/* SPDX-License-Identifier: BSD-3-Clause
 * Cameras that a test plays: devices that come and go, frames of any kind, and an account of every buffer. */
#ifndef OUTCROP_TESTS_DAEMON_FAKE_VIDEO_H
#define OUTCROP_TESTS_DAEMON_FAKE_VIDEO_H

#include "unity.h"

#include <pthread.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include "video_device.h"

#define FCAM_CAMERAS 3
#define FCAM_BUFFERS 6u
#define FCAM_BYTES (64u * 48u * 3u)
#define FCAM_QUEUE 64u

typedef enum fcam_owner { FCAM_DRIVER, FCAM_FILLED, FCAM_SOURCE } fcam_owner_t;

/* What take() gives next, when a buffer is free for it. */
typedef struct fcam_event {
    oc_video_result_t result;
    uint32_t sequence;
    int64_t mono_ns;
    size_t n_bytes;
    bool is_flagged;
} fcam_event_t;

typedef struct fcam_device {
    char path[OC_VIDEO_PATH_BYTES];
    bool is_there, is_open, is_giving_back_refused;
    uint32_t n_opened, n_closed, n_controls_refused;
    uint32_t n_discarded; /* frames that came while the device was being closed */
    oc_video_wish_t last_wish;
    char absent_text[64];
    int gate_fd; /* >= 0: open blocks until it is readable */
    int fd;
    fcam_event_t events[FCAM_QUEUE];
    uint32_t n_events;
    fcam_owner_t owners[FCAM_BUFFERS];
    uint8_t bytes[FCAM_BUFFERS][FCAM_BYTES];
} fcam_device_t;

struct oc_video {
    fcam_device_t *device;
};

static fcam_device_t fcam_devices[FCAM_CAMERAS];
static struct oc_video fcam_handles[FCAM_CAMERAS];
static pthread_mutex_t fcam_lock = PTHREAD_MUTEX_INITIALIZER;
static char fcam_account[96]; /* the first thing that was wrong with a buffer */

static inline void fcam_blame(const char *what)
{
    if (!fcam_account[0]) snprintf(fcam_account, sizeof fcam_account, "%s", what);
}

static inline void fcam_reset(void)
{
    memset(fcam_devices, 0, sizeof fcam_devices);
    fcam_account[0] = '\0';
    for (int i = 0; i < FCAM_CAMERAS; i++) {
        snprintf(fcam_devices[i].path, sizeof fcam_devices[i].path, "/dev/fake%d", i);
        snprintf(fcam_devices[i].absent_text, sizeof fcam_devices[i].absent_text, "No such file");
        fcam_devices[i].is_there = true;
        fcam_devices[i].gate_fd = -1;
        fcam_devices[i].fd = -1;
        fcam_handles[i].device = &fcam_devices[i];
    }
}

static inline oc_video_t *fcam_open(const oc_video_wish_t *wish, oc_video_mode_t *mode, char *error, size_t error_bytes)
{
    fcam_device_t *device = NULL;
    pthread_mutex_lock(&fcam_lock);
    for (int i = 0; i < FCAM_CAMERAS; i++) {
        if (strcmp(fcam_devices[i].path, wish->path) == 0) device = &fcam_devices[i];
    }
    const int gate_fd = device->gate_fd;
    pthread_mutex_unlock(&fcam_lock);
    uint64_t n;
    if (gate_fd >= 0 && read(gate_fd, &n, sizeof n) < 0) fcam_blame("the gate broke");
    pthread_mutex_lock(&fcam_lock);
    device->last_wish = *wish;
    const bool is_ok = device->is_there;
    if (is_ok) {
        if (device->is_open) fcam_blame("opened twice");
        device->is_open = true;
        device->n_opened++;
        device->n_discarded += device->n_events;
        device->n_events = 0;
        device->fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
        for (uint32_t i = 0; i < FCAM_BUFFERS; i++) device->owners[i] = FCAM_DRIVER;
        *mode = (oc_video_mode_t){.stride_bytes = wish->format == OC_PIXEL_MJPG ? 0 : wish->width_px * 2,
                                  .buffer_bytes = FCAM_BYTES,
                                  .rate_hz = 30,
                                  .n_buffers = FCAM_BUFFERS,
                                  .n_controls_refused = device->n_controls_refused};
        if (wish->format == OC_PIXEL_GREY || wish->format == OC_PIXEL_NV12) mode->stride_bytes = wish->width_px;
        snprintf(mode->card, sizeof mode->card, "Fake \"cam\\\x01");
        snprintf(mode->bus, sizeof mode->bus, "usb-1");
    } else {
        snprintf(error, error_bytes, "%s: %s", wish->path, device->absent_text);
    }
    pthread_mutex_unlock(&fcam_lock);
    return is_ok ? &fcam_handles[device - fcam_devices] : NULL;
}

static inline int fcam_fd(const oc_video_t *video)
{
    return video->device->fd;
}

static inline oc_video_result_t fcam_take(oc_video_t *video, oc_video_frame_t *frame, char *error, size_t error_bytes)
{
    fcam_device_t *device = video->device;
    oc_video_result_t result = OC_VIDEO_NONE;
    pthread_mutex_lock(&fcam_lock);
    if (!device->is_open) fcam_blame("used after it was closed");
    uint32_t buffer = 0;
    while (buffer < FCAM_BUFFERS && device->owners[buffer] != FCAM_DRIVER) buffer++;
    if (device->n_events > 0 && (device->events[0].result != OC_VIDEO_FRAME || buffer < FCAM_BUFFERS)) {
        const fcam_event_t event = device->events[0];
        memmove(&device->events[0], &device->events[1], --device->n_events * sizeof event);
        result = event.result;
        if (result == OC_VIDEO_FRAME) {
            device->owners[buffer] = FCAM_SOURCE;
            memset(device->bytes[buffer], (int)(event.sequence & 255u), FCAM_BYTES);
            *frame = (oc_video_frame_t){.index = buffer,
                                        .bytes = device->bytes[buffer],
                                        .n_bytes = event.n_bytes,
                                        .sequence = event.sequence,
                                        .mono_ns = event.mono_ns,
                                        .is_flagged = event.is_flagged};
        } else {
            snprintf(error, error_bytes, "broken by the test");
        }
    }
    uint32_t n_with_driver = 0;
    for (uint32_t i = 0; i < FCAM_BUFFERS; i++) n_with_driver += device->owners[i] == FCAM_DRIVER;
    if (n_with_driver == 0) fcam_blame("the driver has no buffer left");
    pthread_mutex_unlock(&fcam_lock);
    return result;
}

static inline bool fcam_give_back(oc_video_t *video, uint32_t index, char *error, size_t error_bytes)
{
    fcam_device_t *device = video->device;
    pthread_mutex_lock(&fcam_lock);
    if (!device->is_open) fcam_blame("given back after it was closed");
    if (index >= FCAM_BUFFERS || device->owners[index] != FCAM_SOURCE) fcam_blame("given back twice");
    const bool is_ok = !device->is_giving_back_refused;
    if (is_ok) device->owners[index] = FCAM_DRIVER;
    if (!is_ok) snprintf(error, error_bytes, "buffer refused by the test");
    pthread_mutex_unlock(&fcam_lock);
    return is_ok;
}

static inline void fcam_close(oc_video_t *video)
{
    pthread_mutex_lock(&fcam_lock);
    if (!video->device->is_open) fcam_blame("closed twice");
    video->device->is_open = false;
    video->device->n_closed++;
    close(video->device->fd);
    pthread_mutex_unlock(&fcam_lock);
}

static const oc_video_ops_t fcam_video = {fcam_open, fcam_fd, fcam_take, fcam_give_back, fcam_close};

static inline void fcam_add(int camera, fcam_event_t event)
{
    fcam_device_t *device = &fcam_devices[camera];
    const uint64_t one = 1;
    pthread_mutex_lock(&fcam_lock);
    TEST_ASSERT_TRUE(device->n_events < FCAM_QUEUE);
    device->events[device->n_events++] = event;
    if (device->fd >= 0 && write(device->fd, &one, sizeof one) < 0) fcam_blame("cannot signal");
    pthread_mutex_unlock(&fcam_lock);
}

/* Open, and nothing waits that the source has not taken. */
static inline bool fcam_is_open(int camera, uint32_t n_opened, uint32_t max_events)
{
    pthread_mutex_lock(&fcam_lock);
    const fcam_device_t *device = &fcam_devices[camera];
    const bool is_open = device->is_open && device->n_opened == n_opened && device->n_events <= max_events;
    pthread_mutex_unlock(&fcam_lock);
    return is_open;
}

/* Buffers that the source has. */
static inline uint32_t fcam_n_held(int camera)
{
    uint32_t n = 0;
    pthread_mutex_lock(&fcam_lock);
    for (uint32_t i = 0; i < FCAM_BUFFERS; i++) n += fcam_devices[camera].owners[i] == FCAM_SOURCE;
    pthread_mutex_unlock(&fcam_lock);
    return n;
}

#endif
