/* SPDX-License-Identifier: BSD-3-Clause
 * What the packet files share: envelope, view head, label and gap codes. Not for users of packet.h. */
#ifndef OUTCROP_CORE_PACKET_INTERNAL_H
#define OUTCROP_CORE_PACKET_INTERNAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/bits.h"
#include "core/packet.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OC_PACKET_HEAD_BYTES 4u
#define OC_PACKET_CRC_BYTES 2u

/* Sides of an overhead tile. */
#define OC_MIN_TILE_PX 16u
#define OC_MAX_TILE_PX 256u

/* Times fit 56 bits: microseconds since 1970 up to the year 4253. */
#define OC_UTIME_LIMIT_US ((int64_t)1 << 56)

/* CRC-16/CCITT-FALSE: polynomial 0x1021, start 0xffff, not reflected. */
uint16_t oc_packet_crc(const uint8_t *bytes, size_t n_bytes);

/* Start a packet in buf: the head, and room for everything but the CRC. */
void oc_packet_begin(oc_bit_writer_t *writer, const oc_packet_head_t *packet, oc_packet_type_t type, uint8_t *buf,
                     size_t cap);
/* Pad, append the CRC, write the length. OC_E_SPACE when anything did not fit. */
OC_CHECKED oc_status_t oc_packet_end(oc_bit_writer_t *writer, size_t *n_bytes);

/* Check the envelope and that the packet is of this type; the reader then
 * stands at the body and ends before the CRC. */
OC_CHECKED oc_status_t oc_packet_open(const uint8_t *buf, size_t n_bytes, oc_packet_type_t type,
                                      oc_bit_reader_t *reader);
/* OC_OK when the body was read to its end: less than a byte of padding, all zero. */
OC_CHECKED oc_status_t oc_packet_close(oc_bit_reader_t *reader);

/* Whole bytes at an aligned place. */
size_t oc_packet_room_bytes(const oc_bit_writer_t *writer);
void oc_packet_put_bytes(oc_bit_writer_t *writer, const uint8_t *bytes, size_t n_bytes);
/* Everything that is left, as a pointer into the datagram. */
const uint8_t *oc_packet_get_rest(oc_bit_reader_t *reader, size_t *n_bytes);

/* Values as float32. A value is sendable when it is finite as a float. */
bool oc_packet_is_float(double value);
void oc_packet_put_float(oc_bit_writer_t *writer, double value);
/* Fails the reader on an infinity or what is not a number. */
double oc_packet_get_float(oc_bit_reader_t *reader);

/* A ground scale that a packet may carry: 1e-5 to 100 metres per pixel as float32. */
bool oc_packet_is_scale(double metres_per_pixel);

bool oc_packet_is_utime(int64_t utime_us);
void oc_packet_put_utime(oc_bit_writer_t *writer, int64_t utime_us);
int64_t oc_packet_get_utime(oc_bit_reader_t *reader);

/* A label in 1 bit when it is the packet's most common one, else in 2. */
void oc_packet_put_label(oc_bit_writer_t *writer, uint8_t label, uint8_t common);
uint8_t oc_packet_get_label(oc_bit_reader_t *reader, uint8_t common);
uint8_t oc_packet_get_common_label(oc_bit_reader_t *reader);

/* Strictly ascending 16-bit indices as Rice-coded gaps. Give the list's length
 * and last index to find the parameter; previous = -1 at first. */
unsigned oc_packet_gap_parameter(const uint16_t indices[], uint16_t n);
void oc_packet_put_gap(oc_bit_writer_t *writer, unsigned k, int32_t previous, uint16_t index);
uint16_t oc_packet_get_gap(oc_bit_reader_t *reader, unsigned k, int32_t previous);

/* A view head in wire units. */
typedef struct oc_wire_head {
    uint16_t view;
    uint8_t camera_index, part;
    bool has_distortion;
    int64_t utime_us;
    int32_t centre[3];   /* 0.1 mm */
    uint32_t largest;    /* index of the quaternion component that does not travel */
    int32_t rotation[3]; /* the other three */
    uint16_t margin[6];  /* half floats */
    double intrinsics[4];
    uint32_t width_px, height_px;
    double distortion[5];
} oc_wire_head_t;

/* OC_E_ARG when a value cannot travel. */
OC_CHECKED oc_status_t oc_wire_head_from(const oc_view_head_t *head, oc_wire_head_t *wire);
/* Always the same number of bits for one wire head. */
void oc_wire_head_put(oc_bit_writer_t *writer, const oc_wire_head_t *wire, bool is_last);
/* OC_E_FORMAT when a value is not allowed; head is then untouched. */
OC_CHECKED oc_status_t oc_wire_head_get(oc_bit_reader_t *reader, oc_view_head_t *head);

#ifdef __cplusplus
}
#endif
#endif
