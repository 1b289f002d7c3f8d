/* SPDX-License-Identifier: BSD-3-Clause
 * Packets that carry pixels: patch blocks, overhead tiles, pieces of a whole compressed keyframe. */
#include "core/blocks.h"
#include "core/packet_internal.h"

static_assert(OC_BLOCK_PX * OC_BLOCK_PX == OC_BLOCK_SAMPLES, "oc_patch_t holds blocks of core/blocks.h");

/* Of images with sides of 32 to 4,096 pixels. */
#define MIN_BLOCKS_PER_ROW 4u
#define MAX_BLOCKS_PER_ROW 512u

/* Compressed keyframes of up to 16 MiB. */
#define IMAGE_MAX_BYTES 0xffffffu

/* ---- patch ---- */

/* Mean levels of the blocks coded so far; `above` walks behind them by one row of blocks. */
typedef struct patch_levels {
    uint16_t blocks_per_row;
    uint16_t n, above;
    uint16_t index[OC_MAX_PACKET_BLOCKS];
    int32_t level[OC_MAX_PACKET_BLOCKS];
} patch_levels_t;

/* Mean of the left and upper neighbours that this packet has; else the last block's; else mid grey. */
static int32_t level_predict(patch_levels_t *levels, uint16_t index)
{
    if (levels->n == 0) return 0;
    const int32_t last = levels->level[levels->n - 1u];
    const bool has_left = index % levels->blocks_per_row != 0 && levels->index[levels->n - 1u] == index - 1;
    while (levels->above < levels->n && levels->index[levels->above] + levels->blocks_per_row < index) {
        levels->above++;
    }
    const bool has_above = levels->above < levels->n && levels->index[levels->above] + levels->blocks_per_row == index;
    if (!has_above) return last;
    const int32_t above = levels->level[levels->above];
    return has_left ? (last + above) / 2 : above;
}

static void level_store(patch_levels_t *levels, uint16_t index, int32_t level)
{
    levels->index[levels->n] = index;
    levels->level[levels->n] = level;
    levels->n++;
}

static oc_status_t patch_check(uint8_t quality, const oc_image_t *grey, const uint16_t blocks[], uint16_t n_blocks)
{
    if (!oc_image_is_valid(grey) || grey->channels != 1) return OC_E_ARG;
    if (n_blocks > OC_MAX_PACKET_BLOCKS) return OC_E_LIMIT;
    if (n_blocks == 0 || quality < OC_MIN_BLOCK_QUALITY || quality > OC_MAX_BLOCK_QUALITY) return OC_E_ARG;
    const uint32_t side = OC_BLOCK_PX;
    const uint32_t n = ((grey->width_px + side - 1u) / side) * ((grey->height_px + side - 1u) / side);
    for (uint16_t i = 0; i < n_blocks; i++) {
        if (blocks[i] >= n || (i > 0 && blocks[i] <= blocks[i - 1])) return OC_E_ARG;
    }
    return OC_OK;
}

/* As many as fit from the first on. */
static uint16_t blocks_put(oc_bit_writer_t *writer, unsigned k, uint8_t quality, const oc_image_t *grey,
                           const uint16_t blocks[], uint16_t n_blocks)
{
    patch_levels_t levels = {.blocks_per_row = (uint16_t)((grey->width_px + OC_BLOCK_PX - 1u) / OC_BLOCK_PX)};
    oc_block_coder_t coder;
    oc_block_coder_init(&coder, quality);
    int32_t previous = -1;
    uint16_t taken = 0;
    for (; taken < n_blocks; taken++) {
        const uint16_t index = blocks[taken];
        uint8_t px[OC_BLOCK_SAMPLES];
        int32_t level;
        oc_block_cut(grey, index % levels.blocks_per_row, index / levels.blocks_per_row, px);
        oc_bit_writer_t trial = *writer;
        oc_packet_put_gap(&trial, k, previous, index);
        oc_block_encode(&coder, &trial, px, level_predict(&levels, index), &level);
        if (trial.has_failed) break;
        *writer = trial;
        level_store(&levels, index, level);
        previous = index;
    }
    return taken;
}

oc_status_t oc_packet_encode_patch(const oc_packet_head_t *packet, uint16_t view, uint8_t quality,
                                   const oc_image_t *grey, const uint16_t blocks[], uint16_t n_blocks, uint8_t *buf,
                                   size_t cap, size_t *n_bytes, uint16_t *blocks_taken)
{
    OC_ASSERT(packet && grey && (blocks || n_blocks == 0) && buf && n_bytes && blocks_taken);
    const oc_status_t status = patch_check(quality, grey, blocks, n_blocks);
    if (status != OC_OK) return status;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_PATCH, buf, cap);
    const unsigned k = oc_packet_gap_parameter(blocks, n_blocks);
    oc_bits_put(&writer, view, 16);
    oc_bits_put(&writer, quality, 5);
    oc_bits_put(&writer, (grey->width_px - 1u) / OC_BLOCK_PX, 9);
    oc_bits_put(&writer, k, 4);
    oc_bit_writer_t count_place = writer;
    oc_bits_put(&writer, 0, 10);
    const uint16_t taken = blocks_put(&writer, k, quality, grey, blocks, n_blocks);
    if (taken == 0) return OC_E_SPACE;
    oc_bits_put(&count_place, taken, 10);
    const oc_status_t ended = oc_packet_end(&writer, n_bytes);
    if (ended == OC_OK) *blocks_taken = taken;
    return ended;
}

/* Runs twice: with patch == NULL to check, then to fill. */
static oc_status_t patch_get(oc_bit_reader_t reader, oc_patch_t *patch)
{
    const uint16_t view = (uint16_t)oc_bits_get(&reader, 16);
    const uint8_t quality = (uint8_t)oc_bits_get(&reader, 5);
    patch_levels_t levels = {.blocks_per_row = (uint16_t)(oc_bits_get(&reader, 9) + 1u)};
    const unsigned k = oc_bits_get(&reader, 4);
    const uint16_t n_blocks = (uint16_t)oc_bits_get(&reader, 10);
    if (quality == 0 || n_blocks == 0 || n_blocks > OC_MAX_PACKET_BLOCKS) return OC_E_FORMAT;
    if (levels.blocks_per_row < MIN_BLOCKS_PER_ROW) return OC_E_FORMAT;

    oc_block_coder_t coder;
    oc_block_coder_init(&coder, quality);
    int32_t previous = -1;
    for (uint16_t i = 0; i < n_blocks; i++) {
        uint8_t px[OC_BLOCK_SAMPLES];
        int32_t level = 0;
        const uint16_t index = oc_packet_get_gap(&reader, k, previous);
        if (reader.has_failed) return OC_E_FORMAT;
        oc_block_decode(&coder, &reader, patch ? patch->px[i] : px, level_predict(&levels, index), &level);
        if (reader.has_failed || index / levels.blocks_per_row >= MAX_BLOCKS_PER_ROW) return OC_E_FORMAT;
        level_store(&levels, index, level);
        previous = index;
        if (patch) patch->blocks[i] = index;
    }
    if (patch) patch->view = view;
    if (patch) patch->quality = quality;
    if (patch) patch->blocks_per_row = levels.blocks_per_row;
    if (patch) patch->n_blocks = n_blocks;
    return oc_packet_close(&reader);
}

oc_status_t oc_packet_decode_patch(const uint8_t *buf, size_t n_bytes, oc_patch_t *patch)
{
    OC_ASSERT(patch);
    oc_bit_reader_t reader;
    oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_PATCH, &reader);
    if (status == OC_OK) status = patch_get(reader, NULL);
    if (status == OC_OK) status = patch_get(reader, patch);
    return status;
}

/* ---- overhead ---- */

static bool codec_is_known(uint32_t codec)
{
    return codec == OC_CODEC_JPEG || codec == OC_CODEC_WEBP || codec == OC_CODEC_AVIF;
}

static bool overhead_can_travel(const oc_overhead_t *overhead)
{
    return oc_packet_is_scale(overhead->metres_per_pixel) && overhead->tile_px >= OC_MIN_TILE_PX &&
           overhead->tile_px <= OC_MAX_TILE_PX && codec_is_known(overhead->codec) && overhead->n_bytes > 0;
}

oc_status_t oc_packet_encode_overhead(const oc_packet_head_t *packet, const oc_overhead_t *overhead, uint8_t *buf,
                                      size_t cap, size_t *n_bytes)
{
    OC_ASSERT(packet && overhead && buf && n_bytes);
    if (!overhead_can_travel(overhead) || !overhead->bytes) return OC_E_ARG;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_OVERHEAD, buf, cap);
    oc_bits_put(&writer, overhead->view, 16);
    oc_packet_put_float(&writer, overhead->metres_per_pixel);
    oc_bits_put(&writer, overhead->tile_px, 9);
    oc_bits_put(&writer, (uint16_t)overhead->tile.ix, 16);
    oc_bits_put(&writer, (uint16_t)overhead->tile.iy, 16);
    oc_bits_put(&writer, overhead->codec, 2);
    oc_bits_put_align(&writer);
    oc_packet_put_bytes(&writer, overhead->bytes, overhead->n_bytes);
    return oc_packet_end(&writer, n_bytes);
}

static int16_t int16_get(oc_bit_reader_t *reader)
{
    const int32_t code = (int32_t)oc_bits_get(reader, 16);
    return (int16_t)(code > INT16_MAX ? code - 65536 : code);
}

oc_status_t oc_packet_decode_overhead(const uint8_t *buf, size_t n_bytes, oc_overhead_t *overhead)
{
    OC_ASSERT(overhead);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_OVERHEAD, &reader);
    if (status != OC_OK) return status;

    oc_overhead_t result = {.view = (uint16_t)oc_bits_get(&reader, 16)};
    result.metres_per_pixel = oc_packet_get_float(&reader);
    result.tile_px = (uint16_t)oc_bits_get(&reader, 9);
    result.tile.ix = int16_get(&reader);
    result.tile.iy = int16_get(&reader);
    result.codec = (uint8_t)oc_bits_get(&reader, 2);
    oc_bits_get_align(&reader);
    if (reader.has_failed) return OC_E_FORMAT;
    size_t n_rest;
    result.bytes = oc_packet_get_rest(&reader, &n_rest);
    result.n_bytes = (uint16_t)n_rest;
    if (!overhead_can_travel(&result)) return OC_E_FORMAT;
    *overhead = result;
    return OC_OK;
}

/* ---- whole images in pieces ---- */

static oc_status_t piece_check(const oc_image_piece_t *piece)
{
    if (piece->total_bytes > IMAGE_MAX_BYTES) return OC_E_LIMIT;
    if (!codec_is_known(piece->codec) || !piece->bytes || piece->n_bytes == 0) return OC_E_ARG;
    if (piece->offset_bytes > piece->total_bytes) return OC_E_ARG;
    return piece->n_bytes <= piece->total_bytes - piece->offset_bytes ? OC_OK : OC_E_ARG;
}

oc_status_t oc_packet_encode_image(const oc_packet_head_t *packet, const oc_image_piece_t *piece, uint8_t *buf,
                                   size_t cap, size_t *n_bytes, uint16_t *bytes_taken)
{
    OC_ASSERT(packet && piece && buf && n_bytes && bytes_taken);
    oc_wire_head_t wire;
    oc_status_t status = piece_check(piece);
    if (status == OC_OK) status = oc_wire_head_from(&piece->head, &wire);
    if (status != OC_OK) return status;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_IMAGE, buf, cap);
    oc_bit_writer_t head_place = writer;
    oc_wire_head_put(&writer, &wire, false);
    oc_bits_put(&writer, piece->codec, 2);
    oc_bits_put(&writer, piece->total_bytes, 24);
    oc_bits_put(&writer, piece->offset_bytes, 24);
    oc_bits_put_align(&writer);
    const size_t room = oc_packet_room_bytes(&writer);
    const uint16_t taken = room < piece->n_bytes ? (uint16_t)room : piece->n_bytes;
    if (taken == 0) return OC_E_SPACE;
    oc_packet_put_bytes(&writer, piece->bytes, taken);
    oc_wire_head_put(&head_place, &wire, taken == piece->total_bytes - piece->offset_bytes);
    status = oc_packet_end(&writer, n_bytes);
    if (status == OC_OK) *bytes_taken = taken;
    return status;
}

oc_status_t oc_packet_decode_image(const uint8_t *buf, size_t n_bytes, oc_image_piece_t *piece)
{
    OC_ASSERT(piece);
    oc_bit_reader_t reader;
    oc_image_piece_t result;
    oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_IMAGE, &reader);
    if (status == OC_OK) status = oc_wire_head_get(&reader, &result.head);
    if (status != OC_OK) return status;

    result.codec = (uint8_t)oc_bits_get(&reader, 2);
    result.total_bytes = oc_bits_get(&reader, 24);
    result.offset_bytes = oc_bits_get(&reader, 24);
    oc_bits_get_align(&reader);
    if (reader.has_failed) return OC_E_FORMAT;
    size_t n_rest;
    result.bytes = oc_packet_get_rest(&reader, &n_rest);
    result.n_bytes = (uint16_t)n_rest;
    if (piece_check(&result) != OC_OK) return OC_E_FORMAT;
    if (result.head.is_last != (n_rest == result.total_bytes - result.offset_bytes)) return OC_E_FORMAT;
    *piece = result;
    return OC_OK;
}
