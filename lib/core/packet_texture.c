/* SPDX-License-Identifier: BSD-3-Clause
 * The texture layer: tiles of a view's colour, each an image of its own. */
#include <string.h>

#include "core/packet_internal.h"

#define MIN_TEXTURE_PX 16u
#define MAX_TEXTURE_PX 128u

static bool step_is_valid(unsigned step_px)
{
    return step_px == 1 || step_px == 2 || step_px == 4;
}

static bool request_is_valid(const oc_texture_request_t *request)
{
    if (request->is_cancelled) return true;
    if (!step_is_valid(request->step_px) || request->tile_px < MIN_TEXTURE_PX || request->tile_px > MAX_TEXTURE_PX)
        return false;
    if (request->quality < 1 || request->quality > 100 || request->n_tiles == 0) return false;
    if (request->budget_bytes == 0 || request->budget_bytes >= 1u << 24) return false;
    for (unsigned i = 1; i < request->n_tiles; i++) {
        if (request->tiles[i] <= request->tiles[i - 1]) return false;
    }
    return true;
}

oc_status_t oc_packet_encode_texture_request(const oc_packet_head_t *packet, const oc_texture_request_t *request,
                                             uint8_t *buf, size_t cap, size_t *n_bytes, uint16_t *tiles_taken)
{
    OC_ASSERT(packet && request && buf && n_bytes && tiles_taken);
    if (!request->is_cancelled && request->n_tiles > OC_MAX_TEXTURE_TILES) return OC_E_LIMIT;
    if (!request_is_valid(request)) return OC_E_ARG;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_TEXTURE_REQUEST, buf, cap);
    oc_bits_put(&writer, request->view, 16);
    oc_bits_put(&writer, request->is_cancelled ? 1 : 0, 1);
    uint16_t taken = 0;
    if (!request->is_cancelled) {
        const unsigned k = oc_packet_gap_parameter(request->tiles, request->n_tiles);
        oc_bits_put_uniform(&writer, request->step_px / 2u, 3);
        oc_bits_put(&writer, request->tile_px, 8);
        oc_bits_put(&writer, request->quality, 7);
        oc_bits_put(&writer, request->is_masked ? 1 : 0, 1);
        oc_bits_put(&writer, request->budget_bytes, 24);
        oc_bits_put(&writer, k, 4);
        oc_bit_writer_t count_place = writer;
        oc_bits_put(&writer, 0, 9);
        for (int32_t previous = -1; taken < request->n_tiles; taken++) {
            oc_bit_writer_t trial = writer;
            oc_packet_put_gap(&trial, k, previous, request->tiles[taken]);
            if (trial.has_failed) break;
            writer = trial;
            previous = request->tiles[taken];
        }
        if (taken == 0) return OC_E_SPACE;
        oc_bits_put(&count_place, taken, 9);
    }
    const oc_status_t ended = oc_packet_end(&writer, n_bytes);
    if (ended == OC_OK) *tiles_taken = taken;
    return ended;
}

oc_status_t oc_packet_decode_texture_request(const uint8_t *buf, size_t n_bytes, oc_texture_request_t *request)
{
    OC_ASSERT(request);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_TEXTURE_REQUEST, &reader);
    if (status != OC_OK) return status;

    oc_texture_request_t result;
    memset(&result, 0, sizeof result);
    result.view = (uint16_t)oc_bits_get(&reader, 16);
    result.is_cancelled = oc_bits_get(&reader, 1) == 1;
    if (!result.is_cancelled) {
        result.step_px = (uint8_t)(1u << oc_bits_get_uniform(&reader, 3));
        result.tile_px = (uint8_t)oc_bits_get(&reader, 8);
        result.quality = (uint8_t)oc_bits_get(&reader, 7);
        result.is_masked = oc_bits_get(&reader, 1) == 1;
        result.budget_bytes = oc_bits_get(&reader, 24);
        const unsigned k = oc_bits_get(&reader, 4);
        result.n_tiles = (uint16_t)oc_bits_get(&reader, 9);
        if (result.n_tiles > OC_MAX_TEXTURE_TILES) return OC_E_FORMAT;
        int32_t previous = -1;
        for (unsigned i = 0; i < result.n_tiles; i++) {
            result.tiles[i] = oc_packet_get_gap(&reader, k, previous);
            previous = result.tiles[i];
        }
    }
    if (oc_packet_close(&reader) != OC_OK || !request_is_valid(&result)) return OC_E_FORMAT;
    *request = result;
    return OC_OK;
}

oc_status_t oc_packet_encode_texture(const oc_packet_head_t *packet, const oc_texture_t *texture, uint8_t *buf,
                                     size_t cap, size_t *n_bytes)
{
    OC_ASSERT(packet && texture && buf && n_bytes);
    const bool is_codec = texture->codec >= OC_CODEC_JPEG && texture->codec <= OC_CODEC_AVIF;
    if (!is_codec || !texture->bytes || texture->n_bytes == 0 || !step_is_valid(texture->step_px) ||
        texture->tile_px < MIN_TEXTURE_PX || texture->tile_px > MAX_TEXTURE_PX)
        return OC_E_ARG;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_TEXTURE, buf, cap);
    oc_bits_put(&writer, texture->view, 16);
    oc_bits_put_uniform(&writer, texture->step_px / 2u, 3);
    oc_bits_put(&writer, texture->tile_px, 8);
    oc_bits_put(&writer, texture->tile, 16);
    oc_bits_put(&writer, texture->codec, 2);
    oc_bits_put_align(&writer);
    oc_packet_put_bytes(&writer, texture->bytes, texture->n_bytes);
    return oc_packet_end(&writer, n_bytes);
}

oc_status_t oc_packet_decode_texture(const uint8_t *buf, size_t n_bytes, oc_texture_t *texture)
{
    OC_ASSERT(texture);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_TEXTURE, &reader);
    if (status != OC_OK) return status;

    oc_texture_t result = {.view = (uint16_t)oc_bits_get(&reader, 16)};
    result.step_px = (uint8_t)(1u << oc_bits_get_uniform(&reader, 3));
    result.tile_px = (uint8_t)oc_bits_get(&reader, 8);
    result.tile = (uint16_t)oc_bits_get(&reader, 16);
    result.codec = (uint8_t)oc_bits_get(&reader, 2);
    oc_bits_get_align(&reader);
    if (reader.has_failed || result.codec < OC_CODEC_JPEG || result.codec > OC_CODEC_AVIF) return OC_E_FORMAT;
    if (result.tile_px < MIN_TEXTURE_PX || result.tile_px > MAX_TEXTURE_PX) return OC_E_FORMAT;
    size_t n_rest;
    result.bytes = oc_packet_get_rest(&reader, &n_rest);
    if (n_rest == 0 || oc_packet_close(&reader) != OC_OK) return OC_E_FORMAT;
    result.n_bytes = (uint16_t)n_rest;
    *texture = result;
    return OC_OK;
}
