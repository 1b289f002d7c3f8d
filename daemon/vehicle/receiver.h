/* SPDX-License-Identifier: BSD-3-Clause
 * Everything that arrives over LCM, in a thread of its own: liblcm's receiving
 * side allocates, the thread of the frames must not. Packets of the base cross
 * over in a fixed queue; poses go straight to the track. */
#ifndef OUTCROP_DAEMON_RECEIVER_H
#define OUTCROP_DAEMON_RECEIVER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/packet.h"
#include "counters.h"
#include "link_lcm.h"
#include "pose_lcm.h"

/* Packets that may wait for the thread of the frames; newer ones are dropped and counted, the base asks again. */
#define OC_RECEIVER_PACKETS 128u

typedef struct oc_receiver oc_receiver_t;

/* Open the link and, when pose_url is not "", the poses; start the thread.
 * Packets for other vehicles and what is no packet are counted and dropped
 * there. NULL and one line in error otherwise. */
typedef struct oc_receiver_config {
    const char *down_url, *up_url;
    uint8_t vehicle;
    const char *pose_url, *pose_channel;
    oc_pose_type_t pose_type;
} oc_receiver_config_t;

oc_receiver_t *oc_receiver_open(const oc_receiver_config_t *config, oc_pose_track_t *track, oc_counters_t *counters,
                                char *error, size_t error_bytes);
void oc_receiver_close(oc_receiver_t *receiver);

/* For sending, from the thread of the frames only; does not allocate. */
oc_link_t *oc_receiver_link(oc_receiver_t *receiver);

/* Readable when packets wait or the transport has failed. */
int oc_receiver_fd(const oc_receiver_t *receiver);

/* The oldest waiting packet, copied into buf[OC_MAX_DATAGRAM_BYTES]; 0 when there is none. */
size_t oc_receiver_take(oc_receiver_t *receiver, uint8_t *buf);

/* Why the thread has ended, NULL while it runs. */
const char *oc_receiver_fault(const oc_receiver_t *receiver);

#endif
