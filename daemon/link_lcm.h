/* SPDX-License-Identifier: BSD-3-Clause
 * The narrow link: packets out on one LCM channel, packets in from another.
 *
 * Used by both ends; they differ in which channel is which. One LCM group per
 * direction, so that no end hears its own packets. Sending encodes into a
 * static buffer and does not allocate; liblcm's receive side does (its own
 * thread and ring), which is why the frame path never waits for it.
 *
 * Nothing that arrives is trusted: the LCM payload is checked here against the
 * type's fingerprint and its stated length; what the packet says is checked by
 * core/packet.h. */
#ifndef OUTCROP_DAEMON_LINK_LCM_H
#define OUTCROP_DAEMON_LINK_LCM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/packet.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Vehicle to base, base to vehicle. */
#define OC_CHANNEL_DOWN "OCD"
#define OC_CHANNEL_UP "OCU"

/* Bytes of an LCM payload round a packet: fingerprint and n. */
#define OC_LCM_PAYLOAD_BYTES 10u

/* Bytes that one packet costs on the link: payload, channel and its NUL, LCM's short header. */
#define OC_LCM_WIRE_BYTES(packet_bytes, channel) ((packet_bytes) + OC_LCM_PAYLOAD_BYTES + sizeof(channel) + 8u)

typedef struct oc_link oc_link_t;

typedef struct oc_link_counts {
    uint64_t sent, send_failed, received, ill_formed;
} oc_link_counts_t;

/* Called once per well-framed packet; bytes are valid during the call only. */
typedef void (*oc_link_receive_t)(void *user, const uint8_t *packet, size_t n_bytes);

/* Whether a udpm:// URL's group can be reached from here; other URLs always
 * can. liblcm would print a page about it; here it is one line in error. */
bool oc_link_has_route(const char *url, char *error, size_t error_bytes);

/* Open both directions. send_url carries send_channel, receive_url is where
 * receive_channel is heard; the same URL serves both when it is "memq://". On
 * failure NULL, and one line in error. */
oc_link_t *oc_link_open(const char *send_url, const char *send_channel, const char *receive_url,
                        const char *receive_channel, oc_link_receive_t receive, void *user, char *error,
                        size_t error_bytes);
void oc_link_close(oc_link_t *link);

/* File descriptor that becomes readable when something has arrived. */
int oc_link_fd(const oc_link_t *link);

/* Deliver what has arrived, waiting at most timeout_ms. Returns packets and
 * non-packets handled, 0 when none came, -1 when the transport failed. */
int oc_link_handle(oc_link_t *link, int timeout_ms);

/* Send one packet of at most OC_MAX_DATAGRAM_BYTES; false (and counted) when the transport refuses it. */
bool oc_link_send(oc_link_t *link, const uint8_t *packet, size_t n_bytes);

oc_link_counts_t oc_link_get_counts(const oc_link_t *link);

/* The LCM payload of a packet: fingerprint, n, bytes. out has room for
 * n_bytes + OC_LCM_PAYLOAD_BYTES. Returns the payload's length. */
size_t oc_link_wrap(const uint8_t *packet, size_t n_bytes, uint8_t *out);

/* The packet inside an LCM payload, or NULL when the payload is not a packet_t. */
const uint8_t *oc_link_unwrap(const uint8_t *payload, size_t payload_bytes, size_t *n_bytes);

#ifdef __cplusplus
}
#endif
#endif
