/* SPDX-License-Identifier: BSD-3-Clause
 * A base that asks without end: for every view it hears of, pixels, a ground tile and the view once more.
 * outcrop-soak-peer DOWN_URL UP_URL VEHICLE, until SIGTERM; then it prints what it has heard. */
#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/signalfd.h>
#include <unistd.h>

#include "core/packet.h"
#include "core/plane.h"
#include "link_lcm.h"

typedef struct peer {
    oc_link_t *link;
    uint8_t vehicle;
    uint16_t sequence;
    int newest_view; /* -1 = none yet */
    uint64_t n_packets[32], n_sent;
} peer_t;

static void send_packet(peer_t *peer, const uint8_t *packet, size_t n_bytes)
{
    if (oc_link_send(peer->link, packet, n_bytes)) peer->n_sent++;
}

static void ask_for(peer_t *peer, const oc_view_head_t *head)
{
    uint8_t packet[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes;
    uint16_t n_taken;
    const uint32_t per_row = (head->camera.k.width_px + 7u) / 8u;
    static oc_patch_request_t patches;
    patches = (oc_patch_request_t){.view = head->view, .quality = 8, .n_blocks = 100};
    for (uint16_t i = 0; i < patches.n_blocks; i++)
        patches.blocks[i] = (uint16_t)(per_row * (10u + i / 20u) + 5u + i % 20u);
    oc_packet_head_t lead = {.vehicle = peer->vehicle, .sequence = peer->sequence++};
    if (oc_packet_encode_patch_request(&lead, &patches, packet, sizeof packet, &n_bytes, &n_taken) == OC_OK)
        send_packet(peer, packet, n_bytes);

    static oc_overhead_request_t tiles;
    tiles = (oc_overhead_request_t){.view = head->view,
                                    .metres_per_pixel = 0.01,
                                    .tile_px = 64,
                                    .quality = 15,
                                    .n_tiles = 2,
                                    .tiles = {{0, 0}, {-1, -1}}};
    oc_plane_image_from_ground(&head->camera, tiles.image_from_ground);
    lead.sequence = peer->sequence++;
    if (oc_packet_encode_overhead_request(&lead, &tiles, packet, sizeof packet, &n_bytes, &n_taken) == OC_OK)
        send_packet(peer, packet, n_bytes);

    const oc_resend_request_t again = {.view = head->view, .parts = 1};
    lead.sequence = peer->sequence++;
    if (oc_packet_encode_resend(&lead, &again, packet, sizeof packet, &n_bytes) == OC_OK)
        send_packet(peer, packet, n_bytes);
}

static void on_packet(void *user, const uint8_t *packet, size_t n_bytes)
{
    peer_t *peer = user;
    oc_packet_head_t head;
    if (oc_packet_decode_head(packet, n_bytes, &head) != OC_OK) return;
    peer->n_packets[head.type & 31u]++;
    static oc_view_part_t part;
    if (head.type != OC_PACKET_VIEW || oc_packet_decode_view(packet, n_bytes, &part) != OC_OK) return;
    if (part.head.view == peer->newest_view) return;
    peer->newest_view = part.head.view;
    ask_for(peer, &part.head);
}

int main(int argc, char **argv)
{
    if (argc != 4) return 2;
    static peer_t peer = {.newest_view = -1};
    peer.vehicle = (uint8_t)atoi(argv[3]);
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGTERM);
    sigprocmask(SIG_BLOCK, &signals, NULL);
    const int signal_fd = signalfd(-1, &signals, SFD_CLOEXEC);
    char error[256];
    peer.link = oc_link_open(argv[2], OC_CHANNEL_UP, argv[1], OC_CHANNEL_DOWN, on_packet, &peer, error, sizeof error);
    if (!peer.link) {
        fprintf(stderr, "outcrop-soak-peer: %s\n", error);
        return 1;
    }
    for (;;) {
        struct pollfd fds[2] = {{signal_fd, POLLIN, 0}, {oc_link_fd(peer.link), POLLIN, 0}};
        if (poll(fds, 2, -1) < 0 || fds[0].revents) break;
        if (oc_link_handle(peer.link, 0) < 0) break;
    }
    printf("{\"asked\":%" PRIu64 ",\"view\":%" PRIu64 ",\"patch\":%" PRIu64 ",\"overhead\":%" PRIu64
           ",\"status\":%" PRIu64 "}\n",
           peer.n_sent, peer.n_packets[OC_PACKET_VIEW], peer.n_packets[OC_PACKET_PATCH],
           peer.n_packets[OC_PACKET_OVERHEAD], peer.n_packets[OC_PACKET_STATUS]);
    oc_link_close(peer.link);
    return 0;
}
