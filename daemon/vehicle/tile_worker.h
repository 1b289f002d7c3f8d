/* SPDX-License-Identifier: BSD-3-Clause
 * Ground and texture tiles into WebP, in a thread of its own: the codec allocates and takes
 * milliseconds, the thread of the frames must do neither. */
#ifndef OUTCROP_DAEMON_TILE_WORKER_H
#define OUTCROP_DAEMON_TILE_WORKER_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/packet.h"

/* Tiles on their way through; when all are taken the next one waits in its request. */
#define OC_TILE_JOBS 4u

/* Side of the largest tile, px. */
#define OC_TILE_MAX_PX 256u

typedef struct oc_tile_job {
    bool is_texture;
    uint16_t view;
    double metres_per_pixel; /* of an overhead tile */
    oc_tile_id_t tile;
    uint8_t step_px; /* of a texture tile */
    uint16_t texture_tile;
    uint16_t tile_px;
    uint8_t quality; /* to start from */
    uint8_t px[OC_TILE_MAX_PX * OC_TILE_MAX_PX * 3];
    size_t max_bytes; /* of the code; at most OC_MAX_DATAGRAM_BYTES */
    bool is_encoded;  /* false: not even the lowest quality fits */
    size_t n_bytes;
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
} oc_tile_job_t;

typedef struct oc_tile_worker oc_tile_worker_t;

/* Starts the thread; NULL when there is no memory or no thread. */
oc_tile_worker_t *oc_tile_worker_create(void);
void oc_tile_worker_destroy(oc_tile_worker_t *worker);

/* A job to fill and then to post, NULL when all are under way. From one thread. */
oc_tile_job_t *oc_tile_worker_next_free(oc_tile_worker_t *worker);
void oc_tile_worker_post(oc_tile_worker_t *worker);

/* The oldest job, if it is done, and give it back after use. */
const oc_tile_job_t *oc_tile_worker_oldest_done(oc_tile_worker_t *worker);
void oc_tile_worker_release(oc_tile_worker_t *worker);

/* Readable when jobs have been done since the last oc_tile_worker_oldest_done. */
int oc_tile_worker_fd(const oc_tile_worker_t *worker);

#endif
