/* SPDX-License-Identifier: BSD-3-Clause
 * The null rival: whole compressed keyframes, cut into datagrams. */
#ifndef OUTCROP_DAEMON_IMAGE_SENDER_H
#define OUTCROP_DAEMON_IMAGE_SENDER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/packet.h"

typedef struct oc_image_sender oc_image_sender_t;

/* Keeps the last `views` encoded keyframes for resending and cuts them into
 * datagrams of at most datagram_bytes. NULL: no memory. */
oc_image_sender_t *oc_image_sender_create(uint32_t views, oc_codec_t codec, int quality, uint32_t datagram_bytes);
void oc_image_sender_destroy(oc_image_sender_t *sender);

/* Encode a raw (not rectified) keyframe and queue it. The oldest leaves when
 * the store is full. False when the codec fails or the keyframe would take more than 256 pieces. */
bool oc_image_sender_push(oc_image_sender_t *sender, const oc_view_head_t *head, const oc_image_t *image);

/* Queue pieces of a stored keyframe again; false when it has gone. */
bool oc_image_sender_resend(oc_image_sender_t *sender, const oc_resend_request_t *request);

/* Whether there may be a next datagram. */
bool oc_image_sender_has_next(const oc_image_sender_t *sender);

/* The next datagram, at most datagram_bytes into buf; false when there is none. */
bool oc_image_sender_next(oc_image_sender_t *sender, const oc_packet_head_t *packet, uint8_t *buf, size_t *n_bytes);

#endif
