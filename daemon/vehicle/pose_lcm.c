/* SPDX-License-Identifier: BSD-3-Clause
 * Two LCM types into body poses. */
#include "pose_lcm.h"

#include <lcm/lcm.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bot_core_pose_t.h"
#include "counters.h"
#include "link_lcm.h"
#include "outcrop_pose_t.h"

struct oc_pose_listener {
    lcm_t *lcm;
    oc_pose_type_t type;
    oc_pose_track_t *track;
    oc_counters_t *counters;
};

/* Both types have a fixed size; what is cut or of another type does not decode. */
static bool decode_outcrop(const void *bytes, int n_bytes, oc_body_pose_t *pose)
{
    outcrop_pose_t message;
    if (outcrop_pose_t_decode(bytes, 0, n_bytes, &message) != n_bytes) return false;
    *pose = (oc_body_pose_t){.utime_us = message.utime, .has_covariance = message.has_covariance != 0};
    memcpy(pose->position_m, message.position, sizeof pose->position_m);
    memcpy(pose->q_wxyz, message.orientation, sizeof pose->q_wxyz);
    memcpy(pose->covariance, message.covariance, sizeof pose->covariance);
    return true;
}

/* Half a turn about x makes z-down z-up: q times (0, 1, 0, 0). */
static bool decode_bot_core(const void *bytes, int n_bytes, oc_body_pose_t *pose)
{
    bot_core_pose_t message;
    if (bot_core_pose_t_decode(bytes, 0, n_bytes, &message) != n_bytes) return false;
    const double *q = message.orientation;
    *pose = (oc_body_pose_t){.utime_us = message.utime, .q_wxyz = {-q[1], q[0], q[3], -q[2]}};
    memcpy(pose->position_m, message.pos, sizeof pose->position_m);
    return true;
}

bool oc_pose_decode(oc_pose_type_t type, const void *bytes, size_t n_bytes, oc_body_pose_t *pose)
{
    if (n_bytes > INT_MAX) return false;
    return type == OC_POSE_OUTCROP ? decode_outcrop(bytes, (int)n_bytes, pose)
                                   : decode_bot_core(bytes, (int)n_bytes, pose);
}

static void on_message(const lcm_recv_buf_t *buf, const char *channel, void *user)
{
    (void)channel;
    oc_pose_listener_t *l = user;
    oc_body_pose_t pose;
    const bool is_decoded = oc_pose_decode(l->type, buf->data, buf->data_size, &pose);
    const oc_status_t status = is_decoded ? oc_pose_track_add(l->track, &pose) : OC_E_FORMAT;
    if (status == OC_OK) {
        oc_counters_add(l->counters, OC_COUNT_POSES_IN, 1);
    } else {
        oc_counters_add(l->counters, status == OC_E_STATE ? OC_COUNT_POSES_LATE : OC_COUNT_POSES_BAD, 1);
    }
}

oc_pose_listener_t *oc_pose_listener_open(const char *url, const char *channel, oc_pose_type_t type,
                                          oc_pose_track_t *track, oc_counters_t *counters, char *error,
                                          size_t error_bytes)
{
    if (!oc_link_has_route(url, error, error_bytes)) return NULL;
    oc_pose_listener_t *l = calloc(1, sizeof *l);
    if (!l) {
        snprintf(error, error_bytes, "out of memory");
        return NULL;
    }
    *l = (oc_pose_listener_t){.lcm = lcm_create(url), .type = type, .track = track, .counters = counters};
    if (!l->lcm) {
        snprintf(error, error_bytes, "cannot open %s for poses: is the URL right?", url);
    } else if (!lcm_subscribe(l->lcm, channel, on_message, l)) {
        snprintf(error, error_bytes, "cannot subscribe to poses on channel %s of %s", channel, url);
    } else {
        return l;
    }
    oc_pose_listener_close(l);
    return NULL;
}

void oc_pose_listener_close(oc_pose_listener_t *listener)
{
    if (!listener) return;
    if (listener->lcm) lcm_destroy(listener->lcm);
    free(listener);
}

int oc_pose_listener_fd(const oc_pose_listener_t *listener)
{
    return lcm_get_fileno(listener->lcm);
}

bool oc_pose_listener_handle(oc_pose_listener_t *listener)
{
    for (int i = 0; i < 64; i++) { /* a flood leaves time for the rest */
        const int n = lcm_handle_timeout(listener->lcm, 0);
        if (n <= 0) return n == 0;
    }
    return true;
}
