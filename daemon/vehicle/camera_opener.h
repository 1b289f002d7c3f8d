/* SPDX-License-Identifier: BSD-3-Clause
 * Opening and closing of cameras, in a thread for each: a USB device takes up
 * to half a second for it, a broken one for ever, and the others must not wait. */
#ifndef OUTCROP_DAEMON_CAMERA_OPENER_H
#define OUTCROP_DAEMON_CAMERA_OPENER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "vehicle/vehicle.h"
#include "video_device.h"

#define OC_CAMERA_ERROR_BYTES 320

/* What became of one order. */
typedef struct oc_opened {
    oc_video_t *video; /* NULL: could not be opened, or has been closed */
    oc_video_mode_t mode;
    char error[OC_CAMERA_ERROR_BYTES];
} oc_opened_t;

typedef struct oc_camera_opener oc_camera_opener_t;

/* One order at a time for each of n_cameras (at most OC_MAX_CAMERAS); NULL: no memory or no thread. */
oc_camera_opener_t *oc_camera_opener_create(const oc_video_ops_t *ops, uint32_t n_cameras);
/* Waits for what is under way, and closes what nobody has collected. */
void oc_camera_opener_destroy(oc_camera_opener_t *opener);

/* Close `video` if not NULL, else open by the wish, which stays the caller's and unchanged meanwhile. */
void oc_camera_opener_order(oc_camera_opener_t *opener, uint32_t camera, oc_video_t *video,
                            const oc_video_wish_t *wish);

/* The outcome of the camera's order, once. */
bool oc_camera_opener_collect(oc_camera_opener_t *opener, uint32_t camera, oc_opened_t *opened);

/* Readable when orders have been done; oc_camera_opener_clear before collecting. */
int oc_camera_opener_fd(const oc_camera_opener_t *opener);
void oc_camera_opener_clear(oc_camera_opener_t *opener);

#endif
