/* SPDX-License-Identifier: BSD-3-Clause
 * Overhead requests of the base into ground tiles: warped here, encoded by the worker, in the order asked for. */
#ifndef OUTCROP_DAEMON_GROUND_TILES_H
#define OUTCROP_DAEMON_GROUND_TILES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "counters.h"
#include "tile_worker.h"
#include "vehicle/vehicle.h"

/* Overhead requests that may wait. */
#define OC_MAX_OVERHEAD_REQUESTS 16u

typedef struct oc_ground_tiles {
    oc_vehicle_t *vehicle;
    oc_tile_worker_t *worker;
    oc_counters_t *counters;
    uint32_t datagram_bytes;
    oc_overhead_request_t requests[OC_MAX_OVERHEAD_REQUESTS];
    uint32_t n_requests, next_tile; /* tiles are taken from requests[0] */
} oc_ground_tiles_t;

/* Queue an overhead request; one that is ill-formed or one too many is counted. */
void oc_ground_tiles_request(oc_ground_tiles_t *tiles, const uint8_t *packet, size_t n_bytes);

/* Give the worker what it has room for. A tile whose view has left the ring is counted and passed over. */
void oc_ground_tiles_feed(oc_ground_tiles_t *tiles);

/* A tile is ready to be sent. */
bool oc_ground_tiles_has_next(oc_ground_tiles_t *tiles);

/* The next tile as a packet of the given head; 0 when there is none. */
size_t oc_ground_tiles_next(oc_ground_tiles_t *tiles, const oc_packet_head_t *head, uint8_t *buf);

#endif
