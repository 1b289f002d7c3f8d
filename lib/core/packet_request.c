/* SPDX-License-Identifier: BSD-3-Clause
 * What the base asks for: parts again, patch blocks, overhead tiles. */
#include "core/packet_internal.h"

/* Exp-Golomb order of the steps between tiles: neighbours mostly. */
#define TILE_STEP_ORDER 1u

/* ---- resend ---- */

oc_status_t oc_packet_encode_resend(const oc_packet_head_t *packet, const oc_resend_request_t *request, uint8_t *buf,
                                    size_t cap, size_t *n_bytes)
{
    OC_ASSERT(packet && request && buf && n_bytes);

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_RESEND_REQUEST, buf, cap);
    oc_bits_put(&writer, request->view, 16);
    oc_bits_put(&writer, request->parts, 32);
    return oc_packet_end(&writer, n_bytes);
}

oc_status_t oc_packet_decode_resend(const uint8_t *buf, size_t n_bytes, oc_resend_request_t *request)
{
    OC_ASSERT(request);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_RESEND_REQUEST, &reader);
    if (status != OC_OK) return status;

    oc_resend_request_t result = {.view = (uint16_t)oc_bits_get(&reader, 16)};
    result.parts = oc_bits_get(&reader, 32);
    if (oc_packet_close(&reader) != OC_OK) return OC_E_FORMAT;
    *request = result;
    return OC_OK;
}

/* ---- patch request ---- */

static oc_status_t patch_request_check(const oc_patch_request_t *request)
{
    if (request->n_blocks > OC_MAX_PACKET_BLOCKS) return OC_E_LIMIT;
    if (request->n_blocks == 0 || request->quality < 1 || request->quality > 31) return OC_E_ARG;
    for (uint16_t i = 1; i < request->n_blocks; i++) {
        if (request->blocks[i] <= request->blocks[i - 1]) return OC_E_ARG;
    }
    return OC_OK;
}

oc_status_t oc_packet_encode_patch_request(const oc_packet_head_t *packet, const oc_patch_request_t *request,
                                           uint8_t *buf, size_t cap, size_t *n_bytes, uint16_t *blocks_taken)
{
    OC_ASSERT(packet && request && buf && n_bytes && blocks_taken);
    const oc_status_t status = patch_request_check(request);
    if (status != OC_OK) return status;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_PATCH_REQUEST, buf, cap);
    const unsigned k = oc_packet_gap_parameter(request->blocks, request->n_blocks);
    oc_bits_put(&writer, request->view, 16);
    oc_bits_put(&writer, request->quality, 5);
    oc_bits_put(&writer, k, 4);
    oc_bit_writer_t count_place = writer;
    oc_bits_put(&writer, 0, 10);
    uint16_t taken = 0;
    for (int32_t previous = -1; taken < request->n_blocks; taken++) {
        oc_bit_writer_t trial = writer;
        oc_packet_put_gap(&trial, k, previous, request->blocks[taken]);
        if (trial.has_failed) break;
        writer = trial;
        previous = request->blocks[taken];
    }
    if (taken == 0) return OC_E_SPACE;
    oc_bits_put(&count_place, taken, 10);
    const oc_status_t ended = oc_packet_end(&writer, n_bytes);
    if (ended == OC_OK) *blocks_taken = taken;
    return ended;
}

oc_status_t oc_packet_decode_patch_request(const uint8_t *buf, size_t n_bytes, oc_patch_request_t *request)
{
    OC_ASSERT(request);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_PATCH_REQUEST, &reader);
    if (status != OC_OK) return status;

    oc_patch_request_t result = {.view = (uint16_t)oc_bits_get(&reader, 16)};
    result.quality = (uint8_t)oc_bits_get(&reader, 5);
    const unsigned k = oc_bits_get(&reader, 4);
    result.n_blocks = (uint16_t)oc_bits_get(&reader, 10);
    if (result.quality == 0 || result.n_blocks == 0 || result.n_blocks > OC_MAX_PACKET_BLOCKS) return OC_E_FORMAT;
    int32_t previous = -1;
    for (uint16_t i = 0; i < result.n_blocks; i++) {
        result.blocks[i] = oc_packet_get_gap(&reader, k, previous);
        previous = result.blocks[i];
    }
    if (oc_packet_close(&reader) != OC_OK) return OC_E_FORMAT;
    *request = result;
    return OC_OK;
}

/* ---- overhead request ---- */

/* As it will be after narrowing, so that what passes here passes there. */
static bool overhead_request_can_travel(const oc_overhead_request_t *request)
{
    if (!oc_packet_is_scale(request->metres_per_pixel)) return false;
    if (request->tile_px < OC_MIN_TILE_PX || request->tile_px > OC_MAX_TILE_PX) return false;
    if (request->quality < 1 || request->quality > 100 || request->n_tiles == 0) return false;
    for (int i = 0; i < 9; i++) {
        if (!oc_packet_is_float(request->image_from_ground[i])) return false;
    }
    return true;
}

static void tile_put(oc_bit_writer_t *writer, oc_tile_id_t previous, oc_tile_id_t tile)
{
    oc_bits_put_golomb(writer, oc_bits_from_signed(tile.ix - previous.ix), TILE_STEP_ORDER);
    oc_bits_put_golomb(writer, oc_bits_from_signed(tile.iy - previous.iy), TILE_STEP_ORDER);
}

static int16_t tile_coordinate_get(oc_bit_reader_t *reader, int16_t previous)
{
    const int64_t value = (int64_t)previous + oc_bits_to_signed(oc_bits_get_golomb(reader, TILE_STEP_ORDER));
    if (value < INT16_MIN || value > INT16_MAX) reader->has_failed = true;
    return reader->has_failed ? 0 : (int16_t)value;
}

oc_status_t oc_packet_encode_overhead_request(const oc_packet_head_t *packet, const oc_overhead_request_t *request,
                                              uint8_t *buf, size_t cap, size_t *n_bytes, uint16_t *tiles_taken)
{
    OC_ASSERT(packet && request && buf && n_bytes && tiles_taken);
    if (request->n_tiles > OC_MAX_REQUEST_TILES) return OC_E_LIMIT;
    if (!overhead_request_can_travel(request)) return OC_E_ARG;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_OVERHEAD_REQUEST, buf, cap);
    oc_bits_put(&writer, request->view, 16);
    for (int i = 0; i < 9; i++) {
        oc_packet_put_float(&writer, request->image_from_ground[i]);
    }
    oc_packet_put_float(&writer, request->metres_per_pixel);
    oc_bits_put(&writer, request->tile_px, 9);
    oc_bits_put(&writer, request->quality, 7);
    oc_bit_writer_t count_place = writer;
    oc_bits_put(&writer, 0, 7);
    oc_tile_id_t previous = {0, 0};
    uint16_t taken = 0;
    for (; taken < request->n_tiles; taken++) {
        oc_bit_writer_t trial = writer;
        tile_put(&trial, previous, request->tiles[taken]);
        if (trial.has_failed) break;
        writer = trial;
        previous = request->tiles[taken];
    }
    if (taken == 0) return OC_E_SPACE;
    oc_bits_put(&count_place, taken, 7);
    const oc_status_t ended = oc_packet_end(&writer, n_bytes);
    if (ended == OC_OK) *tiles_taken = taken;
    return ended;
}

oc_status_t oc_packet_decode_overhead_request(const uint8_t *buf, size_t n_bytes, oc_overhead_request_t *request)
{
    OC_ASSERT(request);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_OVERHEAD_REQUEST, &reader);
    if (status != OC_OK) return status;

    oc_overhead_request_t result = {.view = (uint16_t)oc_bits_get(&reader, 16)};
    for (int i = 0; i < 9; i++) {
        result.image_from_ground[i] = oc_packet_get_float(&reader);
    }
    result.metres_per_pixel = oc_packet_get_float(&reader);
    result.tile_px = (uint16_t)oc_bits_get(&reader, 9);
    result.quality = (uint8_t)oc_bits_get(&reader, 7);
    result.n_tiles = (uint16_t)oc_bits_get(&reader, 7);
    if (result.n_tiles > OC_MAX_REQUEST_TILES || !overhead_request_can_travel(&result)) return OC_E_FORMAT;
    oc_tile_id_t previous = {0, 0};
    for (uint16_t i = 0; i < result.n_tiles; i++) {
        result.tiles[i].ix = tile_coordinate_get(&reader, previous.ix);
        result.tiles[i].iy = tile_coordinate_get(&reader, previous.iy);
        previous = result.tiles[i];
    }
    if (oc_packet_close(&reader) != OC_OK) return OC_E_FORMAT;
    *request = result;
    return OC_OK;
}

/* ---- recall request ---- */

oc_status_t oc_packet_encode_recall(const oc_packet_head_t *packet, const oc_recall_request_t *request, uint8_t *buf,
                                    size_t cap, size_t *n_bytes)
{
    OC_ASSERT(packet && request && buf && n_bytes);
    if (!request->is_relative && (!oc_packet_is_utime(request->from_us) || !oc_packet_is_utime(request->to_us) ||
                                  request->from_us > request->to_us))
        return OC_E_ARG;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_RECALL_REQUEST, buf, cap);
    oc_bits_put(&writer, request->is_relative ? 1 : 0, 1);
    if (request->is_relative) {
        oc_bits_put(&writer, request->last_ms, 32);
    } else {
        oc_packet_put_utime(&writer, request->from_us);
        oc_packet_put_utime(&writer, request->to_us);
    }
    return oc_packet_end(&writer, n_bytes);
}

oc_status_t oc_packet_decode_recall(const uint8_t *buf, size_t n_bytes, oc_recall_request_t *request)
{
    OC_ASSERT(request);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_RECALL_REQUEST, &reader);
    if (status != OC_OK) return status;

    oc_recall_request_t result = {.is_relative = oc_bits_get(&reader, 1) == 1};
    if (result.is_relative) {
        result.last_ms = oc_bits_get(&reader, 32);
    } else {
        result.from_us = oc_packet_get_utime(&reader);
        result.to_us = oc_packet_get_utime(&reader);
    }
    if (oc_packet_close(&reader) != OC_OK || result.from_us > result.to_us) return OC_E_FORMAT;
    *request = result;
    return OC_OK;
}
