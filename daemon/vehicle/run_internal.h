/* SPDX-License-Identifier: BSD-3-Clause
 * What the loop and its set-up share. For run*.c only. */
#ifndef OUTCROP_DAEMON_RUN_INTERNAL_H
#define OUTCROP_DAEMON_RUN_INTERNAL_H

#include "picture_tiles.h"
#include "image_sender.h"
#include "latency.h"
#include "receiver.h"
#include "rectify.h"
#include "run.h"

typedef struct vehicle_run {
    const oc_config_t *config;
    oc_counters_t counters;
    oc_capture_t *capture;
    oc_pose_track_t *poses; /* only with cameras */
    oc_gpio_t *gpio;        /* only when a line is wired */
    oc_receiver_t *receiver;
    oc_vehicle_t *vehicle;
    oc_rectify_t *rectify[OC_MAX_CAMERAS];
    oc_tile_worker_t *tile_worker;
    oc_picture_tiles_t tiles;
    oc_image_sender_t *images; /* only in image mode */
    void *block;
    int signal_fd;
    char fault[160]; /* why the loop ended, "" = a signal */

    int64_t start_ns, next_status_ns, next_send_ns /* earlier than now: unused pace */, watchdog_ns, next_alive_ns,
        cpu_at_start_us;
    bool is_source_done, is_stopped, is_hangup_told, is_status_fault_told, is_frame_fault_told;
    uint32_t forced_cameras; /* bit i: the next frame of camera i is marked */
    int64_t newest_utime_us; /* of the frames */
    uint64_t bytes_sent;
    uint16_t n_images, newest_image;
    oc_latency_t frame_latency, view_latency;
    uint8_t packet[OC_MAX_DATAGRAM_BYTES];
} vehicle_run_t;

/* Everything that oc_run needs, or what --check looks at; NULL and one line in error otherwise. */
vehicle_run_t *oc_run_open(const oc_config_t *config, bool is_check, char *error, size_t error_bytes);
void oc_run_close(vehicle_run_t *run);

#endif
