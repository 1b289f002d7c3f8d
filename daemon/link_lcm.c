/* SPDX-License-Identifier: BSD-3-Clause
 * The narrow link over LCM. */
#include "link_lcm.h"

#include <arpa/inet.h>
#include <errno.h>
#include <lcm/lcm.h>
#include <netinet/in.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include "outcrop_packet_t.h"

/* liblcm's own default. */
#define LCM_DEFAULT_GROUP "239.255.76.67"

struct oc_link {
    lcm_t *send;
    lcm_t *receive; /* the same object as send for memq */
    const char *send_channel;
    oc_link_receive_t on_packet;
    void *user;
    oc_link_counts_t counts;
    uint8_t payload[OC_MAX_DATAGRAM_BYTES + OC_LCM_PAYLOAD_BYTES];
};

static void put_be64(uint8_t *out, uint64_t value)
{
    for (int i = 0; i < 8; i++) out[i] = (uint8_t)(value >> (56 - 8 * i));
}

static uint64_t get_be64(const uint8_t *in)
{
    uint64_t value = 0;
    for (int i = 0; i < 8; i++) value = value << 8 | in[i];
    return value;
}

size_t oc_link_wrap(const uint8_t *packet, size_t n_bytes, uint8_t *out)
{
    put_be64(out, (uint64_t)__outcrop_packet_t_get_hash());
    out[8] = (uint8_t)(n_bytes >> 8);
    out[9] = (uint8_t)n_bytes;
    memcpy(out + OC_LCM_PAYLOAD_BYTES, packet, n_bytes);
    return n_bytes + OC_LCM_PAYLOAD_BYTES;
}

const uint8_t *oc_link_unwrap(const uint8_t *payload, size_t payload_bytes, size_t *n_bytes)
{
    if (payload_bytes <= OC_LCM_PAYLOAD_BYTES) return NULL;
    if (payload_bytes > OC_MAX_DATAGRAM_BYTES + OC_LCM_PAYLOAD_BYTES) return NULL;
    if (get_be64(payload) != (uint64_t)__outcrop_packet_t_get_hash()) return NULL;
    const size_t n = (size_t)payload[8] << 8 | payload[9];
    if (n != payload_bytes - OC_LCM_PAYLOAD_BYTES) return NULL;
    *n_bytes = n;
    return payload + OC_LCM_PAYLOAD_BYTES;
}

static void link_on_message(const lcm_recv_buf_t *buf, const char *channel, void *user)
{
    (void)channel;
    oc_link_t *link = user;
    size_t n_bytes = 0;
    const uint8_t *packet = oc_link_unwrap(buf->data, buf->data_size, &n_bytes);
    if (!packet) {
        link->counts.ill_formed++;
        return;
    }
    link->counts.received++;
    link->on_packet(link->user, packet, n_bytes);
}

bool oc_link_has_route(const char *url, char *error, size_t error_bytes)
{
    if (strncmp(url, "udpm://", 7) != 0) return true;
    char host[16] = LCM_DEFAULT_GROUP;
    unsigned port = 7667;
    if (url[7] != '\0' && url[7] != '?' && sscanf(url + 7, "%15[0-9.]:%u", host, &port) < 1) host[0] = '\0';
    struct sockaddr_in group = {.sin_family = AF_INET, .sin_port = htons((uint16_t)port)};
    if (inet_pton(AF_INET, host, &group.sin_addr) != 1 || port == 0 || port > UINT16_MAX) {
        snprintf(error, error_bytes, "%s: must be udpm://GROUP:PORT?ttl=N with an IPv4 multicast group", url);
        return false;
    }
    const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const bool is_ok = fd >= 0 && connect(fd, (const struct sockaddr *)&group, sizeof group) == 0;
    if (!is_ok)
        snprintf(error, error_bytes, "%s: %s: is there a multicast route (ip route add 239.0.0.0/8 dev IFACE)?", url,
                 strerror(errno));
    if (fd >= 0) close(fd);
    return is_ok;
}

static lcm_t *link_create(const char *url, char *error, size_t error_bytes)
{
    if (!oc_link_has_route(url, error, error_bytes)) return NULL;
    lcm_t *lcm = lcm_create(url);
    if (!lcm) snprintf(error, error_bytes, "cannot open %s: is the URL right?", url);
    return lcm;
}

oc_link_t *oc_link_open(const char *send_url, const char *send_channel, const char *receive_url,
                        const char *receive_channel, oc_link_receive_t receive, void *user, char *error,
                        size_t error_bytes)
{
    oc_link_t *link = calloc(1, sizeof *link);
    if (!link) {
        snprintf(error, error_bytes, "out of memory");
        return NULL;
    }
    link->send_channel = send_channel;
    link->on_packet = receive;
    link->user = user;
    link->send = link_create(send_url, error, error_bytes);
    if (!link->send) goto fail;
    link->receive = strcmp(send_url, receive_url) == 0 ? link->send : link_create(receive_url, error, error_bytes);
    if (!link->receive) goto fail;
    lcm_subscription_t *subscription = lcm_subscribe(link->receive, receive_channel, link_on_message, link);
    if (!subscription) {
        snprintf(error, error_bytes, "cannot subscribe to %s on %s", receive_channel, receive_url);
        goto fail;
    }
    /* A burst of a whole drive fits; past that liblcm drops the newest and the ends ask again. */
    lcm_subscription_set_queue_capacity(subscription, 4096);
    return link;

fail:
    oc_link_close(link);
    return NULL;
}

void oc_link_close(oc_link_t *link)
{
    if (!link) return;
    if (link->receive && link->receive != link->send) lcm_destroy(link->receive);
    if (link->send) lcm_destroy(link->send);
    free(link);
}

int oc_link_fd(const oc_link_t *link)
{
    return lcm_get_fileno(link->receive);
}

int oc_link_handle(oc_link_t *link, int timeout_ms)
{
    int handled = 0;
    for (;;) {
        errno = 0;
        const int n = lcm_handle_timeout(link->receive, handled == 0 ? timeout_ms : 0);
        if (n < 0) return errno == EINTR ? handled : -1; /* a signal is no fault of the transport */
        if (n == 0) return handled;
        handled++;
    }
}

bool oc_link_send(oc_link_t *link, const uint8_t *packet, size_t n_bytes)
{
    if (n_bytes == 0 || n_bytes > OC_MAX_DATAGRAM_BYTES) {
        link->counts.send_failed++;
        return false;
    }
    const size_t payload_bytes = oc_link_wrap(packet, n_bytes, link->payload);
    if (lcm_publish(link->send, link->send_channel, link->payload, (unsigned)payload_bytes) != 0) {
        link->counts.send_failed++;
        return false;
    }
    link->counts.sent++;
    return true;
}

oc_link_counts_t oc_link_get_counts(const oc_link_t *link)
{
    return link->counts;
}
