/* SPDX-License-Identifier: BSD-3-Clause
 * Small packets of the vehicle: relabel, announce, status. */
#include "core/packet_internal.h"

/* ---- relabel ---- */

static uint8_t most_common_label(const uint8_t labels[], uint16_t n)
{
    uint16_t count[3] = {0, 0, 0};
    for (uint16_t i = 0; i < n; i++) {
        count[labels[i]]++;
    }
    uint8_t best = 0;
    for (uint8_t label = 1; label < 3; label++) {
        if (count[label] > count[best]) best = label;
    }
    return best;
}

oc_status_t oc_packet_encode_relabel(const oc_packet_head_t *packet, const oc_relabel_t *relabel, uint8_t *buf,
                                     size_t cap, size_t *n_bytes)
{
    OC_ASSERT(packet && relabel && buf && n_bytes);
    if (relabel->first > OC_MAX_JUNCTIONS || relabel->n > OC_MAX_JUNCTIONS - relabel->first) return OC_E_LIMIT;
    if (relabel->n == 0) return OC_E_ARG;
    for (uint16_t i = 0; i < relabel->n; i++) {
        if (relabel->labels[i] > OC_LABEL_GROUND) return OC_E_ARG;
    }

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_RELABEL, buf, cap);
    const uint8_t common = most_common_label(relabel->labels, relabel->n);
    oc_bits_put(&writer, relabel->view, 16);
    oc_bits_put(&writer, relabel->first, 11);
    oc_bits_put(&writer, relabel->n, 11);
    oc_bits_put(&writer, common, 2);
    for (uint16_t i = 0; i < relabel->n; i++) {
        oc_packet_put_label(&writer, relabel->labels[i], common);
    }
    return oc_packet_end(&writer, n_bytes);
}

oc_status_t oc_packet_decode_relabel(const uint8_t *buf, size_t n_bytes, oc_relabel_t *relabel)
{
    OC_ASSERT(relabel);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_RELABEL, &reader);
    if (status != OC_OK) return status;

    oc_relabel_t result = {.view = (uint16_t)oc_bits_get(&reader, 16)};
    result.first = (uint16_t)oc_bits_get(&reader, 11);
    result.n = (uint16_t)oc_bits_get(&reader, 11);
    if (result.n == 0 || result.first > OC_MAX_JUNCTIONS || result.n > OC_MAX_JUNCTIONS - result.first) {
        return OC_E_FORMAT;
    }
    const uint8_t common = oc_packet_get_common_label(&reader);
    for (uint16_t i = 0; i < result.n; i++) {
        result.labels[i] = oc_packet_get_label(&reader, common);
    }
    if (oc_packet_close(&reader) != OC_OK) return OC_E_FORMAT;
    *relabel = result;
    return OC_OK;
}

/* ---- announce ---- */

oc_status_t oc_packet_encode_announce(const oc_packet_head_t *packet, const oc_announce_t *announce, uint8_t *buf,
                                      size_t cap, size_t *n_bytes)
{
    OC_ASSERT(packet && announce && buf && n_bytes);
    if (!oc_packet_is_utime(announce->utime_us)) return OC_E_ARG;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_ANNOUNCE, buf, cap);
    oc_bits_put(&writer, announce->view, 16);
    oc_packet_put_utime(&writer, announce->utime_us);
    return oc_packet_end(&writer, n_bytes);
}

oc_status_t oc_packet_decode_announce(const uint8_t *buf, size_t n_bytes, oc_announce_t *announce)
{
    OC_ASSERT(announce);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_ANNOUNCE, &reader);
    if (status != OC_OK) return status;

    oc_announce_t result = {.view = (uint16_t)oc_bits_get(&reader, 16)};
    result.utime_us = oc_packet_get_utime(&reader);
    if (oc_packet_close(&reader) != OC_OK) return OC_E_FORMAT;
    *announce = result;
    return OC_OK;
}

/* ---- status ---- */

const char *oc_counter_name(oc_counter_t counter)
{
    static const char *const names[OC_N_COUNTERS] = {
        "frames_in",     "frames_no_pose",  "frames_not_key",  "views_sent",       "views_dropped",  "junctions_capped",
        "requests_bad",  "requests_gone",   "requests_full",   "send_failed",      "frames_flagged", "frames_corrupt",
        "frames_lost",   "frames_overrun",  "frames_disabled", "frames_bad_time",  "frames_refused", "camera_lost",
        "camera_stalls", "camera_faults",   "camera_opened",   "controls_refused", "poses_in",       "poses_bad",
        "poses_late",    "clock_steps",     "marks",           "marks_dropped",    "gpio_faults",    "pulses_missed",
        "packets_bad",   "packets_foreign", "packets_full",    "tiles_dropped",    "recalled",
    };
    return (unsigned)counter < OC_N_COUNTERS ? names[counter] : "?";
}

/* Counters stop here, so that a status fits the smallest datagram whatever they are; a year of frames at 30 Hz does too. */
#define COUNTER_BITS 30u
#define COUNTER_MAX ((1u << COUNTER_BITS) - 1u)

/* 1 bit for 0; else the number of significant bits less one in 5, and all but the highest of them. */
static void counter_put(oc_bit_writer_t *writer, uint32_t count)
{
    if (count > COUNTER_MAX) count = COUNTER_MAX;
    oc_bits_put(writer, count > 0 ? 1 : 0, 1);
    if (count == 0) return;
    unsigned n = 0;
    while (count >> n > 1) n++;
    oc_bits_put(writer, n, 5);
    oc_bits_put(writer, count - (1u << n), n);
}

/* False when the number of bits is one that nobody writes. */
static bool counter_get(oc_bit_reader_t *reader, uint32_t *count)
{
    *count = 0;
    if (oc_bits_get(reader, 1) == 0) return true;
    const unsigned n = (unsigned)oc_bits_get(reader, 5);
    if (n >= COUNTER_BITS) return false;
    *count = 1u << n | oc_bits_get(reader, n);
    return true;
}

static bool area_is_sendable(const oc_area_t *area)
{
    const double v[5] = {area->x_min, area->x_max, area->y_min, area->y_max, area->z_max};
    for (int i = 0; i < 5; i++) {
        if (!oc_packet_is_float(v[i])) return false;
    }
    return (float)v[0] < (float)v[1] && (float)v[2] < (float)v[3] && (float)v[4] > 0;
}

static void area_put(oc_bit_writer_t *writer, const oc_area_t *area)
{
    oc_bits_put(writer, area->is_set ? 1 : 0, 1);
    if (!area->is_set) return;
    oc_packet_put_float(writer, area->x_min);
    oc_packet_put_float(writer, area->x_max);
    oc_packet_put_float(writer, area->y_min);
    oc_packet_put_float(writer, area->y_max);
    oc_packet_put_float(writer, area->z_max);
}

static oc_status_t area_get(oc_bit_reader_t *reader, oc_area_t *area)
{
    oc_area_t result = {.is_set = oc_bits_get(reader, 1) == 1};
    if (result.is_set) {
        result.x_min = oc_packet_get_float(reader);
        result.x_max = oc_packet_get_float(reader);
        result.y_min = oc_packet_get_float(reader);
        result.y_max = oc_packet_get_float(reader);
        result.z_max = oc_packet_get_float(reader);
        if (!area_is_sendable(&result)) return OC_E_FORMAT;
    }
    *area = result;
    return OC_OK;
}

oc_status_t oc_packet_encode_status(const oc_packet_head_t *packet, const oc_vehicle_status_t *status, uint8_t *buf,
                                    size_t cap, size_t *n_bytes)
{
    OC_ASSERT(packet && status && buf && n_bytes);
    if (status->area.is_set && !area_is_sendable(&status->area)) return OC_E_ARG;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_STATUS, buf, cap);
    oc_bits_put(&writer, status->uptime_s, 32);
    oc_bits_put(&writer, status->n_views, 16);
    oc_bits_put(&writer, status->newest_view, 16);
    oc_bits_put(&writer, status->bytes_sent, 32);
    for (int i = 0; i < OC_N_COUNTERS; i++) {
        counter_put(&writer, status->counters[i]);
    }
    oc_bits_put(&writer, status->is_source_done ? 1 : 0, 1);
    area_put(&writer, &status->area);
    return oc_packet_end(&writer, n_bytes);
}

oc_status_t oc_packet_decode_status(const uint8_t *buf, size_t n_bytes, oc_vehicle_status_t *status)
{
    OC_ASSERT(status);
    oc_bit_reader_t reader;
    const oc_status_t opened = oc_packet_open(buf, n_bytes, OC_PACKET_STATUS, &reader);
    if (opened != OC_OK) return opened;

    oc_vehicle_status_t result = {.uptime_s = oc_bits_get(&reader, 32)};
    result.n_views = (uint16_t)oc_bits_get(&reader, 16);
    result.newest_view = (uint16_t)oc_bits_get(&reader, 16);
    result.bytes_sent = oc_bits_get(&reader, 32);
    for (int i = 0; i < OC_N_COUNTERS; i++) {
        if (!counter_get(&reader, &result.counters[i])) return OC_E_FORMAT;
    }
    result.is_source_done = oc_bits_get(&reader, 1) == 1;
    if (area_get(&reader, &result.area) != OC_OK) return OC_E_FORMAT;
    if (oc_packet_close(&reader) != OC_OK) return OC_E_FORMAT;
    *status = result;
    return OC_OK;
}
