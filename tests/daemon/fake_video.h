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

#define FAKE_CAMERAS 3
#define FAKE_BUFFERS 6u
#define FAKE_BYTES (64u * 48u * 3u)
#define FAKE_QUEUE 64u

typedef enum fake_owner { FAKE_DRIVER, FAKE_FILLED, FAKE_SOURCE } fake_owner_t;

/* What take() gives next, when a buffer is free for it. */
typedef struct fake_event {
    oc_video_result_t result;
    uint32_t sequence;
    int64_t mono_ns;
    size_t n_bytes;
    bool is_flagged;
} fake_event_t;

typedef struct fake_device {
    char path[OC_VIDEO_PATH_BYTES];
    bool is_there, is_open, is_giving_back_refused;
    uint32_t n_opened, n_closed, n_controls_refused;
    uint32_t n_discarded; /* frames that came while the device was being closed */
    oc_video_wish_t last_wish;
    char absent_text[64];
    int gate_fd; /* >= 0: open blocks until it is readable */
    int fd;
    fake_event_t events[FAKE_QUEUE];
    uint32_t n_events;
    fake_owner_t owners[FAKE_BUFFERS];
    uint8_t bytes[FAKE_BUFFERS][FAKE_BYTES];
} fake_device_t;

struct oc_video {
    fake_device_t *device;
};

static fake_device_t fake_devices[FAKE_CAMERAS];
static struct oc_video fake_handles[FAKE_CAMERAS];
static pthread_mutex_t fake_lock = PTHREAD_MUTEX_INITIALIZER;
static char fake_account[96]; /* the first thing that was wrong with a buffer */

static inline void fake_blame(const char *what)
{
    if (!fake_account[0]) snprintf(fake_account, sizeof fake_account, "%s", what);
}

static inline void fake_reset(void)
{
    memset(fake_devices, 0, sizeof fake_devices);
    fake_account[0] = '\0';
    for (int i = 0; i < FAKE_CAMERAS; i++) {
        snprintf(fake_devices[i].path, sizeof fake_devices[i].path, "/dev/fake%d", i);
        snprintf(fake_devices[i].absent_text, sizeof fake_devices[i].absent_text, "No such file");
        fake_devices[i].is_there = true;
        fake_devices[i].gate_fd = -1;
        fake_devices[i].fd = -1;
        fake_handles[i].device = &fake_devices[i];
    }
}

static inline oc_video_t *fake_open(const oc_video_wish_t *wish, oc_video_mode_t *mode, char *error, size_t error_bytes)
{
    fake_device_t *device = NULL;
    pthread_mutex_lock(&fake_lock);
    for (int i = 0; i < FAKE_CAMERAS; i++) {
        if (strcmp(fake_devices[i].path, wish->path) == 0) device = &fake_devices[i];
    }
    const int gate_fd = device->gate_fd;
    pthread_mutex_unlock(&fake_lock);
    uint64_t n;
    if (gate_fd >= 0 && read(gate_fd, &n, sizeof n) < 0) fake_blame("the gate broke");
    pthread_mutex_lock(&fake_lock);
    device->last_wish = *wish;
    const bool is_ok = device->is_there;
    if (is_ok) {
        if (device->is_open) fake_blame("opened twice");
        device->is_open = true;
        device->n_opened++;
        device->n_discarded += device->n_events;
        device->n_events = 0;
        device->fd = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
        for (uint32_t i = 0; i < FAKE_BUFFERS; i++) device->owners[i] = FAKE_DRIVER;
        *mode = (oc_video_mode_t){.stride_bytes = wish->format == OC_PIXEL_MJPG ? 0 : wish->width_px * 2,
                                  .buffer_bytes = FAKE_BYTES,
                                  .rate_hz = 30,
                                  .n_buffers = FAKE_BUFFERS,
                                  .n_controls_refused = device->n_controls_refused};
        if (wish->format == OC_PIXEL_GREY || wish->format == OC_PIXEL_NV12) mode->stride_bytes = wish->width_px;
        snprintf(mode->card, sizeof mode->card, "Fake \"cam\\\x01");
        snprintf(mode->bus, sizeof mode->bus, "usb-1");
    } else {
        snprintf(error, error_bytes, "%s: %s", wish->path, device->absent_text);
    }
    pthread_mutex_unlock(&fake_lock);
    return is_ok ? &fake_handles[device - fake_devices] : NULL;
}

static inline int fake_fd(const oc_video_t *video)
{
    return video->device->fd;
}

static inline oc_video_result_t fake_take(oc_video_t *video, oc_video_frame_t *frame, char *error, size_t error_bytes)
{
    fake_device_t *device = video->device;
    oc_video_result_t result = OC_VIDEO_NONE;
    pthread_mutex_lock(&fake_lock);
    if (!device->is_open) fake_blame("used after it was closed");
    uint32_t buffer = 0;
    while (buffer < FAKE_BUFFERS && device->owners[buffer] != FAKE_DRIVER) buffer++;
    if (device->n_events > 0 && (device->events[0].result != OC_VIDEO_FRAME || buffer < FAKE_BUFFERS)) {
        const fake_event_t event = device->events[0];
        memmove(&device->events[0], &device->events[1], --device->n_events * sizeof event);
        result = event.result;
        if (result == OC_VIDEO_FRAME) {
            device->owners[buffer] = FAKE_SOURCE;
            memset(device->bytes[buffer], (int)(event.sequence & 255u), FAKE_BYTES);
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
    for (uint32_t i = 0; i < FAKE_BUFFERS; i++) n_with_driver += device->owners[i] == FAKE_DRIVER;
    if (n_with_driver == 0) fake_blame("the driver has no buffer left");
    pthread_mutex_unlock(&fake_lock);
    return result;
}

static inline bool fake_give_back(oc_video_t *video, uint32_t index, char *error, size_t error_bytes)
{
    fake_device_t *device = video->device;
    pthread_mutex_lock(&fake_lock);
    if (!device->is_open) fake_blame("given back after it was closed");
    if (index >= FAKE_BUFFERS || device->owners[index] != FAKE_SOURCE) fake_blame("given back twice");
    const bool is_ok = !device->is_giving_back_refused;
    if (is_ok) device->owners[index] = FAKE_DRIVER;
    if (!is_ok) snprintf(error, error_bytes, "buffer refused by the test");
    pthread_mutex_unlock(&fake_lock);
    return is_ok;
}

static inline void fake_close(oc_video_t *video)
{
    pthread_mutex_lock(&fake_lock);
    if (!video->device->is_open) fake_blame("closed twice");
    video->device->is_open = false;
    video->device->n_closed++;
    close(video->device->fd);
    pthread_mutex_unlock(&fake_lock);
}

static const oc_video_ops_t fake_video = {fake_open, fake_fd, fake_take, fake_give_back, fake_close};

static inline void fake_add(int camera, fake_event_t event)
{
    fake_device_t *device = &fake_devices[camera];
    const uint64_t one = 1;
    pthread_mutex_lock(&fake_lock);
    TEST_ASSERT_TRUE(device->n_events < FAKE_QUEUE);
    device->events[device->n_events++] = event;
    if (device->fd >= 0 && write(device->fd, &one, sizeof one) < 0) fake_blame("cannot signal");
    pthread_mutex_unlock(&fake_lock);
}

/* Open, and nothing waits that the source has not taken. */
static inline bool fake_is_open(int camera, uint32_t n_opened, uint32_t max_events)
{
    pthread_mutex_lock(&fake_lock);
    const fake_device_t *device = &fake_devices[camera];
    const bool is_open = device->is_open && device->n_opened == n_opened && device->n_events <= max_events;
    pthread_mutex_unlock(&fake_lock);
    return is_open;
}

/* Buffers that the source has. */
static inline uint32_t fake_n_held(int camera)
{
    uint32_t n = 0;
    pthread_mutex_lock(&fake_lock);
    for (uint32_t i = 0; i < FAKE_BUFFERS; i++) n += fake_devices[camera].owners[i] == FAKE_SOURCE;
    pthread_mutex_unlock(&fake_lock);
    return n;
}

#endif
