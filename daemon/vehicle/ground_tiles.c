/* SPDX-License-Identifier: BSD-3-Clause
 * The queue of overhead requests. */
#include "ground_tiles.h"

#include <string.h>

/* Room of a datagram that an overhead packet's own fields take. */
#define OVERHEAD_HEAD_BYTES 32u

void oc_ground_tiles_request(oc_ground_tiles_t *tiles, const uint8_t *packet, size_t n_bytes)
{
    if (tiles->n_requests == OC_MAX_OVERHEAD_REQUESTS) {
        oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_FULL);
        return;
    }
    if (oc_packet_decode_overhead_request(packet, n_bytes, &tiles->requests[tiles->n_requests]) != OC_OK) {
        oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_BAD);
        return;
    }
    tiles->n_requests++;
}

static void request_drop(oc_ground_tiles_t *tiles)
{
    tiles->n_requests--;
    memmove(&tiles->requests[0], &tiles->requests[1], tiles->n_requests * sizeof tiles->requests[0]);
    tiles->next_tile = 0;
}

static bool job_fill(oc_ground_tiles_t *tiles, const oc_overhead_request_t *request, oc_tile_id_t tile,
                     oc_tile_job_t *job)
{
    oc_image_mut_t out = {job->px, request->tile_px, request->tile_px, 3u * request->tile_px, 3};
    uint32_t n_seen = 0;
    if (oc_vehicle_tile(tiles->vehicle, request, tile, &out, &n_seen) != OC_OK) return false;
    job->view = request->view;
    job->metres_per_pixel = request->metres_per_pixel;
    job->tile = tile;
    job->tile_px = request->tile_px;
    job->quality = request->quality;
    job->max_bytes = tiles->datagram_bytes - OVERHEAD_HEAD_BYTES;
    return true;
}

void oc_ground_tiles_feed(oc_ground_tiles_t *tiles)
{
    while (tiles->n_requests > 0) {
        const oc_overhead_request_t *request = &tiles->requests[0];
        if (tiles->next_tile == request->n_tiles) {
            request_drop(tiles);
            continue;
        }
        oc_tile_job_t *job = oc_tile_worker_next_free(tiles->worker);
        if (!job) return;
        if (job_fill(tiles, request, request->tiles[tiles->next_tile++], job)) {
            oc_tile_worker_post(tiles->worker);
        } else {
            oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_GONE);
        }
    }
}

bool oc_ground_tiles_has_next(oc_ground_tiles_t *tiles)
{
    const oc_tile_job_t *job;
    while ((job = oc_tile_worker_oldest_done(tiles->worker)) && !job->is_encoded) {
        oc_counters_add(tiles->counters, OC_COUNT_TILES_DROPPED, 1);
        oc_tile_worker_release(tiles->worker);
    }
    return job != NULL;
}

size_t oc_ground_tiles_next(oc_ground_tiles_t *tiles, const oc_packet_head_t *head, uint8_t *buf)
{
    if (!oc_ground_tiles_has_next(tiles)) return 0;
    const oc_tile_job_t *job = oc_tile_worker_oldest_done(tiles->worker);
    const oc_overhead_t overhead = {.view = job->view,
                                    .metres_per_pixel = job->metres_per_pixel,
                                    .tile_px = job->tile_px,
                                    .tile = job->tile,
                                    .codec = OC_CODEC_WEBP,
                                    .n_bytes = (uint16_t)job->n_bytes,
                                    .bytes = job->bytes};
    size_t n_bytes = 0;
    if (oc_packet_encode_overhead(head, &overhead, buf, tiles->datagram_bytes, &n_bytes) != OC_OK) {
        oc_counters_add(tiles->counters, OC_COUNT_TILES_DROPPED, 1);
        n_bytes = 0;
    }
    oc_tile_worker_release(tiles->worker);
    return n_bytes;
}
