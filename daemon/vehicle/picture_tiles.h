/* SPDX-License-Identifier: BSD-3-Clause
 * Overhead and texture requests of the base into tiles: cut out here, encoded by the worker, in the order asked for,
 * ground before textures. */
#ifndef OUTCROP_DAEMON_PICTURE_TILES_H
#define OUTCROP_DAEMON_PICTURE_TILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "counters.h"
#include "tile_worker.h"
#include "vehicle/vehicle.h"

/* Requests of each kind that may wait. */
#define OC_MAX_OVERHEAD_REQUESTS 16u
#define OC_MAX_TEXTURE_REQUESTS 32u

typedef struct oc_picture_tiles {
    oc_vehicle_t *vehicle;
    oc_tile_worker_t *worker;
    oc_counters_t *counters;
    uint32_t datagram_bytes;
    oc_overhead_request_t overheads[OC_MAX_OVERHEAD_REQUESTS];
    uint32_t n_overheads, next_overhead; /* tiles are taken from overheads[0] */
    oc_texture_request_t textures[OC_MAX_TEXTURE_REQUESTS];
    uint32_t n_textures, next_texture;
    uint32_t spent_bytes;     /* of textures[0]'s budget */
    bool is_texture_underway; /* one at a time, so that a budget is never passed */
} oc_picture_tiles_t;

/* Queue an overhead or texture request, or cancel what waits for a view; one that is ill-formed or one too many is
 * counted. */
void oc_picture_tiles_request(oc_picture_tiles_t *tiles, const uint8_t *packet, size_t n_bytes);

/* Give the worker what it has room for. A tile whose view has left the ring is counted and passed over. */
void oc_picture_tiles_feed(oc_picture_tiles_t *tiles);

/* A tile is ready to be sent. */
bool oc_picture_tiles_has_next(oc_picture_tiles_t *tiles);

/* The next tile as a packet of the given head; 0 when there is none. */
size_t oc_picture_tiles_next(oc_picture_tiles_t *tiles, const oc_packet_head_t *head, uint8_t *buf);

#endif
