/* SPDX-License-Identifier: BSD-3-Clause
 * Body poses that another program publishes over LCM. */
#ifndef OUTCROP_DAEMON_POSE_LCM_H
#define OUTCROP_DAEMON_POSE_LCM_H

#include <stdbool.h>
#include <stddef.h>

#include "pose_track.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum oc_pose_type {
    OC_POSE_OUTCROP, /* outcrop.pose_t: body z up, with covariance */
    OC_POSE_BOT_CORE /* bot_core.pose_t: body x forward, y right, z down */
} oc_pose_type_t;

typedef struct oc_counters oc_counters_t; /* counters.h, whose atomics are C */
typedef struct oc_pose_listener oc_pose_listener_t;

/* An LCM payload as a body pose; false when it is not of the type, cut or too long. Its values are not looked at. */
bool oc_pose_decode(oc_pose_type_t type, const void *bytes, size_t n_bytes, oc_body_pose_t *pose);

/* Subscribe, and add every pose that comes to the track, counted in POSES_IN,
 * POSES_BAD, POSES_LATE. NULL and one line in error when the URL cannot be opened. */
oc_pose_listener_t *oc_pose_listener_open(const char *url, const char *channel, oc_pose_type_t type,
                                          oc_pose_track_t *track, oc_counters_t *counters, char *error,
                                          size_t error_bytes);
void oc_pose_listener_close(oc_pose_listener_t *listener);

/* Readable when something has come; then handle it (from one thread, the daemon's receiving one). */
int oc_pose_listener_fd(const oc_pose_listener_t *listener);
bool oc_pose_listener_handle(oc_pose_listener_t *listener); /* false: the transport failed */

#ifdef __cplusplus
}
#endif
#endif
