/* SPDX-License-Identifier: BSD-3-Clause
 * The envelope of every packet (head, padding, CRC) and the small codes that several packets share. */
#include <float.h>
#include <math.h>
#include <string.h>

#include "core/packet_internal.h"

#define CRC_POLYNOMIAL 0x1021u

#define METRES_PER_PIXEL_MIN 1e-5
#define METRES_PER_PIXEL_MAX 100.0

/* ---- envelope ---- */

uint16_t oc_packet_crc(const uint8_t *bytes, size_t n_bytes)
{
    uint32_t crc = 0xffffu;
    for (size_t i = 0; i < n_bytes; i++) {
        crc ^= (uint32_t)bytes[i] << 8;
        for (int bit = 0; bit < 8; bit++) {
            crc = (crc & 0x8000u) ? (crc << 1) ^ CRC_POLYNOMIAL : crc << 1;
        }
        crc &= 0xffffu;
    }
    return (uint16_t)crc;
}

void oc_packet_begin(oc_bit_writer_t *writer, const oc_packet_head_t *packet, oc_packet_type_t type, uint8_t *buf,
                     size_t cap)
{
    OC_ASSERT(writer && packet && buf);
    if (cap > OC_MAX_DATAGRAM_BYTES) cap = OC_MAX_DATAGRAM_BYTES;
    oc_bit_writer_init(writer, buf, cap < OC_PACKET_CRC_BYTES ? 0 : cap - OC_PACKET_CRC_BYTES);
    oc_bits_put(writer, OC_WIRE_VERSION, 3);
    oc_bits_put(writer, (uint32_t)type, 5);
    oc_bits_put(writer, packet->vehicle, 8);
    oc_bits_put(writer, packet->sequence, 16);
}

oc_status_t oc_packet_end(oc_bit_writer_t *writer, size_t *n_bytes)
{
    oc_bits_put_align(writer);
    if (writer->has_failed) return OC_E_SPACE;
    const size_t n_covered = writer->n_bits / 8u;
    const uint16_t crc = oc_packet_crc(writer->buf, n_covered);
    writer->buf[n_covered] = (uint8_t)(crc >> 8);
    writer->buf[n_covered + 1u] = (uint8_t)(crc & 0xffu);
    *n_bytes = n_covered + OC_PACKET_CRC_BYTES;
    return OC_OK;
}

static bool type_is_known(uint32_t type)
{
    switch (type) {
    case OC_PACKET_VIEW:
    case OC_PACKET_PATCH:
    case OC_PACKET_SILHOUETTE:
    case OC_PACKET_TEXTURE:
    case OC_PACKET_OVERHEAD:
    case OC_PACKET_STATUS:
    case OC_PACKET_RELABEL:
    case OC_PACKET_ANNOUNCE:
    case OC_PACKET_IMAGE:
    case OC_PACKET_RESEND_REQUEST:
    case OC_PACKET_PATCH_REQUEST:
    case OC_PACKET_OVERHEAD_REQUEST:
    case OC_PACKET_SILHOUETTE_REQUEST:
    case OC_PACKET_TEXTURE_REQUEST:
    case OC_PACKET_RECALL_REQUEST: return true;
    default: return false;
    }
}

oc_status_t oc_packet_decode_head(const uint8_t *buf, size_t n_bytes, oc_packet_head_t *head)
{
    OC_ASSERT((buf || n_bytes == 0) && head);
    if (n_bytes < OC_PACKET_HEAD_BYTES + OC_PACKET_CRC_BYTES || n_bytes > OC_MAX_DATAGRAM_BYTES) return OC_E_FORMAT;

    const size_t n_covered = n_bytes - OC_PACKET_CRC_BYTES;
    const uint32_t crc = ((uint32_t)buf[n_covered] << 8) | buf[n_covered + 1u];
    if (crc != oc_packet_crc(buf, n_covered)) return OC_E_FORMAT;

    const uint32_t type = buf[0] & 31u;
    if (buf[0] >> 5 != OC_WIRE_VERSION || !type_is_known(type)) return OC_E_FORMAT;
    *head = (oc_packet_head_t){
        .type = (uint8_t)type, .vehicle = buf[1], .sequence = (uint16_t)(((uint32_t)buf[2] << 8) | buf[3])};
    return OC_OK;
}

oc_status_t oc_packet_open(const uint8_t *buf, size_t n_bytes, oc_packet_type_t type, oc_bit_reader_t *reader)
{
    oc_packet_head_t head;
    const oc_status_t status = oc_packet_decode_head(buf, n_bytes, &head);
    if (status != OC_OK) return status;
    if (head.type != (uint8_t)type) return OC_E_FORMAT;
    oc_bit_reader_init(reader, buf, n_bytes - OC_PACKET_CRC_BYTES);
    reader->n_bits = OC_PACKET_HEAD_BYTES * 8u;
    return OC_OK;
}

oc_status_t oc_packet_close(oc_bit_reader_t *reader)
{
    oc_bits_get_align(reader);
    return reader->has_failed || reader->n_bits != reader->cap_bits ? OC_E_FORMAT : OC_OK;
}

/* ---- bytes ---- */

size_t oc_packet_room_bytes(const oc_bit_writer_t *writer)
{
    return writer->has_failed ? 0 : (writer->cap_bits - writer->n_bits) / 8u;
}

void oc_packet_put_bytes(oc_bit_writer_t *writer, const uint8_t *bytes, size_t n_bytes)
{
    OC_ASSERT(writer->n_bits % 8u == 0);
    if (n_bytes > oc_packet_room_bytes(writer)) writer->has_failed = true;
    if (writer->has_failed) return;
    memcpy(writer->buf + writer->n_bits / 8u, bytes, n_bytes);
    writer->n_bits += n_bytes * 8u;
}

const uint8_t *oc_packet_get_rest(oc_bit_reader_t *reader, size_t *n_bytes)
{
    OC_ASSERT(reader->n_bits % 8u == 0);
    const uint8_t *rest = reader->buf + reader->n_bits / 8u;
    *n_bytes = reader->has_failed ? 0 : (reader->cap_bits - reader->n_bits) / 8u;
    reader->n_bits = reader->cap_bits;
    return rest;
}

/* ---- numbers ---- */

bool oc_packet_is_float(double value)
{
    return fabs(value) <= (double)FLT_MAX;
}

void oc_packet_put_float(oc_bit_writer_t *writer, double value)
{
    const float narrow = (float)value;
    uint32_t bits;
    memcpy(&bits, &narrow, sizeof bits);
    oc_bits_put(writer, bits, 32);
}

double oc_packet_get_float(oc_bit_reader_t *reader)
{
    const uint32_t bits = oc_bits_get(reader, 32);
    float value;
    memcpy(&value, &bits, sizeof value);
    if (!isfinite(value)) reader->has_failed = true;
    return reader->has_failed ? 0.0 : (double)value;
}

/* As it will be after narrowing, so that what passes at one end passes at the other. */
bool oc_packet_is_scale(double metres_per_pixel)
{
    if (!oc_packet_is_float(metres_per_pixel)) return false;
    const double narrow = (double)(float)metres_per_pixel;
    return narrow >= METRES_PER_PIXEL_MIN && narrow <= METRES_PER_PIXEL_MAX;
}

bool oc_packet_is_utime(int64_t utime_us)
{
    return utime_us >= 0 && utime_us < OC_UTIME_LIMIT_US;
}

void oc_packet_put_utime(oc_bit_writer_t *writer, int64_t utime_us)
{
    oc_bits_put(writer, (uint32_t)(utime_us >> 32), 24);
    oc_bits_put(writer, (uint32_t)(utime_us & 0xffffffff), 32);
}

int64_t oc_packet_get_utime(oc_bit_reader_t *reader)
{
    const int64_t high = (int64_t)oc_bits_get(reader, 24);
    return (high << 32) | (int64_t)oc_bits_get(reader, 32);
}

/* ---- labels ---- */

void oc_packet_put_label(oc_bit_writer_t *writer, uint8_t label, uint8_t common)
{
    if (label == common) {
        oc_bits_put(writer, 0, 1);
        return;
    }
    const uint8_t first_other = common == 0 ? 1 : 0;
    oc_bits_put(writer, label == first_other ? 2u : 3u, 2);
}

uint8_t oc_packet_get_label(oc_bit_reader_t *reader, uint8_t common)
{
    if (oc_bits_get(reader, 1) == 0) return common;
    const uint8_t first_other = common == 0 ? 1 : 0;
    const uint8_t second_other = common == 2 ? 1 : 2;
    return oc_bits_get(reader, 1) == 0 ? first_other : second_other;
}

uint8_t oc_packet_get_common_label(oc_bit_reader_t *reader)
{
    const uint32_t common = oc_bits_get(reader, 2);
    if (common > OC_LABEL_GROUND) reader->has_failed = true;
    return reader->has_failed ? 0 : (uint8_t)common;
}

/* ---- ascending indices ---- */

unsigned oc_packet_gap_parameter(const uint16_t indices[], uint16_t n)
{
    unsigned best = 0;
    uint32_t best_length = UINT32_MAX;
    for (unsigned k = 0; k <= OC_MAX_RICE; k++) {
        uint32_t length = 0;
        int32_t previous = -1;
        for (uint16_t i = 0; i < n; i++) {
            length += oc_bits_rice_length((uint32_t)(indices[i] - previous - 1), k);
            previous = indices[i];
        }
        if (length < best_length) {
            best = k;
            best_length = length;
        }
    }
    return best;
}

void oc_packet_put_gap(oc_bit_writer_t *writer, unsigned k, int32_t previous, uint16_t index)
{
    oc_bits_put_rice(writer, (uint32_t)(index - previous - 1), k);
}

uint16_t oc_packet_get_gap(oc_bit_reader_t *reader, unsigned k, int32_t previous)
{
    const uint32_t gap = oc_bits_get_rice(reader, k);
    const uint32_t first = (uint32_t)(previous + 1);
    if (first > UINT16_MAX || gap > UINT16_MAX - first) reader->has_failed = true;
    return reader->has_failed ? 0 : (uint16_t)(first + gap);
}
