/* SPDX-License-Identifier: BSD-3-Clause
 * The queues of overhead and texture requests. */
#include "picture_tiles.h"

#include <string.h>

/* Room of a datagram that a tile packet's own fields take. */
#define TILE_HEAD_BYTES 32u

/* ---- requests in ---- */

static void overhead_request(oc_picture_tiles_t *tiles, const uint8_t *packet, size_t n_bytes)
{
    if (tiles->n_overheads == OC_MAX_OVERHEAD_REQUESTS) {
        oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_FULL);
        return;
    }
    if (oc_packet_decode_overhead_request(packet, n_bytes, &tiles->overheads[tiles->n_overheads]) != OC_OK) {
        oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_BAD);
        return;
    }
    tiles->n_overheads++;
}

static void texture_drop(oc_picture_tiles_t *tiles, uint32_t index)
{
    if (index == 0) tiles->next_texture = tiles->spent_bytes = 0;
    tiles->n_textures--;
    memmove(&tiles->textures[index], &tiles->textures[index + 1u],
            (tiles->n_textures - index) * sizeof tiles->textures[0]);
}

static void texture_request(oc_picture_tiles_t *tiles, const uint8_t *packet, size_t n_bytes)
{
    oc_texture_request_t request;
    if (oc_packet_decode_texture_request(packet, n_bytes, &request) != OC_OK) {
        oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_BAD);
        return;
    }
    if (request.is_cancelled) {
        for (uint32_t i = tiles->n_textures; i-- > 0;) {
            if (tiles->textures[i].view == request.view) texture_drop(tiles, i);
        }
        return;
    }
    if (tiles->n_textures == OC_MAX_TEXTURE_REQUESTS) {
        oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_FULL);
        return;
    }
    tiles->textures[tiles->n_textures++] = request;
}

void oc_picture_tiles_request(oc_picture_tiles_t *tiles, const uint8_t *packet, size_t n_bytes)
{
    oc_packet_head_t head;
    if (oc_packet_decode_head(packet, n_bytes, &head) != OC_OK) return; /* the receiver has looked */
    if (head.type == OC_PACKET_TEXTURE_REQUEST) {
        texture_request(tiles, packet, n_bytes);
    } else {
        overhead_request(tiles, packet, n_bytes);
    }
}

/* ---- work out ---- */

static void overhead_drop(oc_picture_tiles_t *tiles)
{
    tiles->n_overheads--;
    memmove(&tiles->overheads[0], &tiles->overheads[1], tiles->n_overheads * sizeof tiles->overheads[0]);
    tiles->next_overhead = 0;
}

static bool overhead_fill(oc_picture_tiles_t *tiles, const oc_overhead_request_t *request, oc_tile_id_t tile,
                          oc_tile_job_t *job)
{
    oc_image_mut_t out = {job->px, request->tile_px, request->tile_px, 3u * request->tile_px, 3};
    uint32_t n_seen = 0;
    if (oc_vehicle_tile(tiles->vehicle, request, tile, &out, &n_seen) != OC_OK) return false;
    job->is_texture = false;
    job->view = request->view;
    job->metres_per_pixel = request->metres_per_pixel;
    job->tile = tile;
    job->tile_px = request->tile_px;
    job->quality = request->quality;
    job->max_bytes = tiles->datagram_bytes - TILE_HEAD_BYTES;
    return true;
}

static bool texture_fill(oc_picture_tiles_t *tiles, const oc_texture_request_t *request, uint16_t tile,
                         oc_tile_job_t *job)
{
    oc_image_mut_t out = {job->px, request->tile_px, request->tile_px, 3u * request->tile_px, 3};
    uint32_t n_solid = 0;
    if (oc_vehicle_texture(tiles->vehicle, request, tile, &out, &n_solid) != OC_OK) return false;
    job->is_texture = true;
    job->view = request->view;
    job->step_px = request->step_px;
    job->texture_tile = tile;
    job->tile_px = request->tile_px;
    job->quality = request->quality;
    job->max_bytes = tiles->datagram_bytes - TILE_HEAD_BYTES;
    return true;
}

static void feed_overheads(oc_picture_tiles_t *tiles)
{
    while (tiles->n_overheads > 0) {
        const oc_overhead_request_t *request = &tiles->overheads[0];
        if (tiles->next_overhead == request->n_tiles) {
            overhead_drop(tiles);
            continue;
        }
        oc_tile_job_t *job = oc_tile_worker_next_free(tiles->worker);
        if (!job) return;
        if (overhead_fill(tiles, request, request->tiles[tiles->next_overhead++], job)) {
            oc_tile_worker_post(tiles->worker);
        } else {
            oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_GONE);
        }
    }
}

static void feed_texture(oc_picture_tiles_t *tiles)
{
    while (tiles->n_textures > 0 && !tiles->is_texture_underway) {
        const oc_texture_request_t *request = &tiles->textures[0];
        if (tiles->next_texture == request->n_tiles || tiles->spent_bytes >= request->budget_bytes) {
            texture_drop(tiles, 0);
            continue;
        }
        oc_tile_job_t *job = oc_tile_worker_next_free(tiles->worker);
        if (!job) return;
        if (texture_fill(tiles, request, request->tiles[tiles->next_texture++], job)) {
            tiles->is_texture_underway = true;
            oc_tile_worker_post(tiles->worker);
        } else {
            oc_vehicle_count(tiles->vehicle, OC_COUNT_REQUESTS_GONE);
        }
    }
}

void oc_picture_tiles_feed(oc_picture_tiles_t *tiles)
{
    feed_overheads(tiles);
    if (tiles->n_overheads == 0) feed_texture(tiles);
}

/* ---- packets out ---- */

static void release(oc_picture_tiles_t *tiles, const oc_tile_job_t *job)
{
    if (job->is_texture) tiles->is_texture_underway = false;
    oc_tile_worker_release(tiles->worker);
}

bool oc_picture_tiles_has_next(oc_picture_tiles_t *tiles)
{
    const oc_tile_job_t *job;
    while ((job = oc_tile_worker_oldest_done(tiles->worker)) && !job->is_encoded) {
        oc_counters_add(tiles->counters, OC_COUNT_TILES_DROPPED, 1);
        release(tiles, job);
    }
    return job != NULL;
}

static oc_status_t overhead_encode(const oc_picture_tiles_t *tiles, const oc_tile_job_t *job,
                                   const oc_packet_head_t *head, uint8_t *buf, size_t *n_bytes)
{
    const oc_overhead_t overhead = {.view = job->view,
                                    .metres_per_pixel = job->metres_per_pixel,
                                    .tile_px = job->tile_px,
                                    .tile = job->tile,
                                    .codec = OC_CODEC_WEBP,
                                    .n_bytes = (uint16_t)job->n_bytes,
                                    .bytes = job->bytes};
    return oc_packet_encode_overhead(head, &overhead, buf, tiles->datagram_bytes, n_bytes);
}

static oc_status_t texture_encode(const oc_picture_tiles_t *tiles, const oc_tile_job_t *job,
                                  const oc_packet_head_t *head, uint8_t *buf, size_t *n_bytes)
{
    const oc_texture_t texture = {.view = job->view,
                                  .step_px = job->step_px,
                                  .tile_px = (uint8_t)job->tile_px,
                                  .tile = job->texture_tile,
                                  .codec = OC_CODEC_WEBP,
                                  .n_bytes = (uint16_t)job->n_bytes,
                                  .bytes = job->bytes};
    return oc_packet_encode_texture(head, &texture, buf, tiles->datagram_bytes, n_bytes);
}

/* Takes a texture's bytes out of its budget; false when they are over it, and what is left of its request goes too. A
 * job whose request was cancelled meanwhile is sent: it was made. */
static bool texture_pays(oc_picture_tiles_t *tiles, const oc_tile_job_t *job, size_t n_bytes)
{
    if (tiles->n_textures == 0 || tiles->textures[0].view != job->view || tiles->next_texture == 0) return true;
    if (n_bytes > tiles->textures[0].budget_bytes - tiles->spent_bytes) {
        texture_drop(tiles, 0);
        return false;
    }
    tiles->spent_bytes += (uint32_t)n_bytes;
    return true;
}

size_t oc_picture_tiles_next(oc_picture_tiles_t *tiles, const oc_packet_head_t *head, uint8_t *buf)
{
    if (!oc_picture_tiles_has_next(tiles)) return 0;
    const oc_tile_job_t *job = oc_tile_worker_oldest_done(tiles->worker);
    size_t n_bytes = 0;
    const oc_status_t status = job->is_texture ? texture_encode(tiles, job, head, buf, &n_bytes)
                                               : overhead_encode(tiles, job, head, buf, &n_bytes);
    if (status != OC_OK) oc_counters_add(tiles->counters, OC_COUNT_TILES_DROPPED, 1);
    if (status != OC_OK || (job->is_texture && !texture_pays(tiles, job, n_bytes))) n_bytes = 0;
    release(tiles, job);
    return n_bytes;
}
