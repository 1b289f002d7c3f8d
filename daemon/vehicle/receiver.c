/* SPDX-License-Identifier: BSD-3-Clause
 * The receiving thread and its queue. */
#include "receiver.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "doorbell.h"

typedef struct waiting_packet {
    size_t n_bytes;
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
} waiting_packet_t;

struct oc_receiver {
    uint8_t vehicle;
    oc_link_t *link;
    oc_pose_listener_t *poses; /* NULL: none wanted */
    oc_counters_t *counters;
    uint64_t n_ill_formed; /* of the link's, already counted */

    pthread_t thread;
    bool has_thread;
    int stop_fd;  /* written to end the thread */
    int ready_fd; /* readable while something is for the other thread */
    _Atomic(const char *) fault;

    pthread_mutex_t lock;
    uint32_t first, n; /* of the ring */
    waiting_packet_t packets[OC_RECEIVER_PACKETS];
};

static void enqueue(oc_receiver_t *r, const uint8_t *packet, size_t n_bytes)
{
    pthread_mutex_lock(&r->lock);
    const bool is_full = r->n == OC_RECEIVER_PACKETS;
    if (!is_full) {
        waiting_packet_t *slot = &r->packets[(r->first + r->n++) % OC_RECEIVER_PACKETS];
        memcpy(slot->bytes, packet, n_bytes);
        slot->n_bytes = n_bytes;
    }
    pthread_mutex_unlock(&r->lock);
    if (is_full) oc_counters_add(r->counters, OC_COUNT_PACKETS_FULL, 1);
    oc_doorbell_ring(r->ready_fd);
}

static void on_packet(void *user, const uint8_t *packet, size_t n_bytes)
{
    oc_receiver_t *r = user;
    oc_packet_head_t head;
    if (oc_packet_decode_head(packet, n_bytes, &head) != OC_OK) {
        oc_counters_add(r->counters, OC_COUNT_PACKETS_BAD, 1);
    } else if (head.vehicle != r->vehicle) {
        oc_counters_add(r->counters, OC_COUNT_PACKETS_FOREIGN, 1);
    } else {
        enqueue(r, packet, n_bytes);
    }
}

static void count_ill_formed(oc_receiver_t *r)
{
    const uint64_t n = oc_link_get_counts(r->link).ill_formed;
    oc_counters_add(r->counters, OC_COUNT_PACKETS_BAD, (uint32_t)(n - r->n_ill_formed));
    r->n_ill_formed = n;
}

static const char *receive(oc_receiver_t *r)
{
    struct pollfd fds[3] = {{r->stop_fd, POLLIN, 0}, {oc_link_fd(r->link), POLLIN, 0}, {-1, POLLIN, 0}};
    if (r->poses) fds[2].fd = oc_pose_listener_fd(r->poses);
    for (;;) {
        if (poll(fds, 3, -1) < 0) {
            if (errno == EINTR) continue;
            return "the receiving thread cannot poll";
        }
        if (fds[0].revents) return NULL;
        if (fds[1].revents) {
            if (oc_link_handle(r->link, 0) < 0) return "the link failed";
            count_ill_formed(r);
        }
        if (fds[2].revents && !oc_pose_listener_handle(r->poses)) return "the poses' transport failed";
    }
}

static void *thread_main(void *user)
{
    oc_receiver_t *r = user;
    const char *fault = receive(r);
    atomic_store(&r->fault, fault);
    if (fault) oc_doorbell_ring(r->ready_fd);
    return NULL;
}

static bool receiver_open(oc_receiver_t *r, const oc_receiver_config_t *config, oc_pose_track_t *track, char *error,
                          size_t error_bytes)
{
    r->stop_fd = oc_doorbell_open();
    r->ready_fd = oc_doorbell_open();
    if (r->stop_fd < 0 || r->ready_fd < 0) {
        snprintf(error, error_bytes, "eventfd: %s", strerror(errno));
        return false;
    }
    r->link = oc_link_open(config->down_url, OC_CHANNEL_DOWN, config->up_url, OC_CHANNEL_UP, on_packet, r, error,
                           error_bytes);
    if (!r->link) return false;
    if (config->pose_url[0]) {
        r->poses = oc_pose_listener_open(config->pose_url, config->pose_channel, config->pose_type, track, r->counters,
                                         error, error_bytes);
        if (!r->poses) return false;
    }
    const int failed = pthread_create(&r->thread, NULL, thread_main, r);
    if (failed) snprintf(error, error_bytes, "cannot start the receiving thread: %s", strerror(failed));
    r->has_thread = failed == 0;
    return r->has_thread;
}

oc_receiver_t *oc_receiver_open(const oc_receiver_config_t *config, oc_pose_track_t *track, oc_counters_t *counters,
                                char *error, size_t error_bytes)
{
    oc_receiver_t *r = calloc(1, sizeof *r);
    if (!r) {
        snprintf(error, error_bytes, "out of memory");
        return NULL;
    }
    memset(r->packets, 0xff, sizeof r->packets); /* so that its pages are there from the start */
    r->vehicle = config->vehicle;
    r->counters = counters;
    r->stop_fd = r->ready_fd = -1;
    pthread_mutex_init(&r->lock, NULL);
    if (receiver_open(r, config, track, error, error_bytes)) return r;
    oc_receiver_close(r);
    return NULL;
}

void oc_receiver_close(oc_receiver_t *r)
{
    if (!r) return;
    if (r->has_thread) {
        oc_doorbell_ring(r->stop_fd);
        pthread_join(r->thread, NULL);
    }
    oc_pose_listener_close(r->poses);
    oc_link_close(r->link);
    if (r->stop_fd >= 0) close(r->stop_fd);
    if (r->ready_fd >= 0) close(r->ready_fd);
    pthread_mutex_destroy(&r->lock);
    free(r);
}

oc_link_t *oc_receiver_link(oc_receiver_t *r)
{
    return r->link;
}

int oc_receiver_fd(const oc_receiver_t *r)
{
    return r->ready_fd;
}

size_t oc_receiver_take(oc_receiver_t *r, uint8_t *buf)
{
    pthread_mutex_lock(&r->lock);
    size_t n_bytes = 0;
    if (r->n > 0) {
        const waiting_packet_t *slot = &r->packets[r->first];
        n_bytes = slot->n_bytes;
        memcpy(buf, slot->bytes, n_bytes);
        r->first = (r->first + 1u) % OC_RECEIVER_PACKETS;
        r->n--;
    }
    /* Under the lock: a signal given before was for what has been taken by now. */
    if (r->n == 0) oc_doorbell_clear(r->ready_fd);
    pthread_mutex_unlock(&r->lock);
    return n_bytes;
}

const char *oc_receiver_fault(const oc_receiver_t *r)
{
    return atomic_load(&((oc_receiver_t *)(uintptr_t)r)->fault);
}
