/* SPDX-License-Identifier: BSD-3-Clause
 * Frames from cameras, each with the pose of its own time.
 *
 * Every camera is opened, watched, closed and opened again by itself; what
 * goes wrong is counted and told once, and never ends the daemon. A frame
 * waits in the driver's buffer, uncopied, until the poses around its time have
 * come; then it is handed out, oldest first. */
#ifndef OUTCROP_DAEMON_CAMERA_SOURCE_H
#define OUTCROP_DAEMON_CAMERA_SOURCE_H

#include "capture.h"
#include "clock_map.h"
#include "counters.h"
#include "gpio.h"
#include "pose_track.h"
#include "video_device.h"

#define OC_CAMERA_NAME_BYTES 32

typedef struct oc_camera_config {
    char name[OC_CAMERA_NAME_BYTES]; /* for messages and --status */
    oc_video_wish_t wish;
    oc_lens_t lens;
    oc_pose_t body_from_optical;
    uint32_t stall_ms; /* no frame for so long: closed and opened again; 100..600000 */
    uint32_t retry_ms; /* between two tries to open; 10..600000 */
    int32_t delay_us;  /* the middle of the exposure is this long before the driver's timestamp, -1000000..1000000 */
    bool is_hardware_triggered; /* frames are dated by the periodic trigger's pulse */
} oc_camera_config_t;

typedef struct oc_camera_source_config {
    oc_camera_config_t cameras[OC_MAX_CAMERAS];
    uint32_t n_cameras;
    bool has_fixed_margin; /* else the poses' covariance, at least `margin` */
    oc_margin_t margin;
    uint32_t pose_wait_ms; /* how long a frame waits for its pose, 0..10000 */
} oc_camera_source_config_t;

/* What a source is given; all outlive it. gpio may be NULL. */
typedef struct oc_camera_source_parts {
    const oc_video_ops_t *video;
    oc_pose_track_t *poses;
    oc_gpio_t *gpio;
    oc_counters_t *counters;
    oc_clock_read_t read_clock; /* NULL = the system's */
} oc_camera_source_parts_t;

/* Never waits for a device: cameras that are absent are opened when they
 * appear. NULL and one line in error only without memory. */
oc_capture_t *oc_camera_source_open(const oc_camera_source_config_t *config, const oc_camera_source_parts_t *parts,
                                    char *error, size_t error_bytes);

#endif
