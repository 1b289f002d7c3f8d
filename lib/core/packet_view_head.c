/* SPDX-License-Identifier: BSD-3-Clause
 * The view head: time, pose, margins and intrinsics of one keyframe in 54 to 82 bytes. */
#include <math.h>
#include <string.h>

#include "core/packet_internal.h"

#define CENTRE_PER_M 10000.0

/* Components of a quaternion other than the largest lie in [-1/sqrt 2, 1/sqrt 2]. */
#define ROTATION_MAX 524287
#define SQRT_HALF 0.70710678118654752440

#define FOCAL_MIN_PX 1.0
#define FOCAL_MAX_PX 1e6

/* ---- half floats, not negative ---- */

#define HALF_MAX 65504.0
#define HALF_MAX_CODE 0x7bffu

static double half_value(uint32_t code)
{
    const uint32_t exponent = code >> 10, fraction = code & 1023u;
    if (exponent == 0) return ldexp((double)fraction, -24);
    return ldexp((double)(fraction + 1024u), (int)exponent - 25);
}

/* The smallest half that is not below value, so that a margin never shrinks.
 * Codes of halves ascend as the halves do. */
static uint16_t half_not_below(double value)
{
    uint32_t low = 0, high = HALF_MAX_CODE;
    while (low < high) {
        const uint32_t middle = (low + high) / 2u;
        if (half_value(middle) < value) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return (uint16_t)low;
}

/* ---- rotation ---- */

/* The component left out must stay the strictly largest one after rounding;
 * then it, and with it the code, is the same however often it is sent. */
static bool rotation_is_canonical(const int32_t q[3])
{
    int64_t sum = 0, largest = 0;
    for (int i = 0; i < 3; i++) {
        const int64_t square = (int64_t)q[i] * q[i];
        sum += square;
        if (square > largest) largest = square;
    }
    return sum + largest < 2 * (int64_t)ROTATION_MAX * ROTATION_MAX;
}

static void rotation_shrink(int32_t q[3])
{
    int at = 0;
    for (int i = 1; i < 3; i++) {
        if (q[i] * (int64_t)q[i] > q[at] * (int64_t)q[at]) at = i;
    }
    q[at] += q[at] > 0 ? -1 : 1;
}

static void rotation_to_wire(const double R[9], oc_wire_head_t *wire)
{
    double quat[4];
    oc_quat_from_rotation(R, quat);
    uint32_t largest = 0;
    for (uint32_t i = 1; i < 4; i++) {
        if (fabs(quat[i]) > fabs(quat[largest])) largest = i;
    }
    const double sign = quat[largest] < 0.0 ? -1.0 : 1.0;
    int n = 0;
    for (uint32_t i = 0; i < 4; i++) {
        if (i == largest) continue;
        double scaled = floor(sign * quat[i] / SQRT_HALF * ROTATION_MAX + 0.5);
        if (scaled > ROTATION_MAX) scaled = ROTATION_MAX;
        if (scaled < -ROTATION_MAX) scaled = -ROTATION_MAX;
        wire->rotation[n++] = (int32_t)scaled;
    }
    while (!rotation_is_canonical(wire->rotation)) {
        rotation_shrink(wire->rotation);
    }
    wire->largest = largest;
}

static oc_status_t rotation_from_wire(uint32_t largest, const int32_t q[3], double R[9])
{
    double quat[4];
    double rest = 1.0;
    int n = 0;
    for (uint32_t i = 0; i < 4; i++) {
        if (i == largest) continue;
        quat[i] = (double)q[n++] * SQRT_HALF / ROTATION_MAX;
        rest -= quat[i] * quat[i];
    }
    quat[largest] = sqrt(rest);
    return oc_rotation_from_quat(quat, R);
}

/* ---- to the wire ---- */

static bool intrinsics_can_travel(const oc_intrinsics_t *k)
{
    const double values[4] = {k->fx_px, k->fy_px, k->cx_px, k->cy_px};
    for (int i = 0; i < 4; i++) {
        if (!oc_packet_is_float(values[i])) return false;
    }
    const oc_intrinsics_t narrow = {.fx_px = (double)(float)k->fx_px,
                                    .fy_px = (double)(float)k->fy_px,
                                    .cx_px = (double)(float)k->cx_px,
                                    .cy_px = (double)(float)k->cy_px,
                                    .width_px = k->width_px,
                                    .height_px = k->height_px};
    if (!(narrow.fx_px >= FOCAL_MIN_PX && narrow.fx_px <= FOCAL_MAX_PX)) return false;
    if (!(narrow.fy_px >= FOCAL_MIN_PX && narrow.fy_px <= FOCAL_MAX_PX)) return false;
    return oc_intrinsics_is_valid(&narrow);
}

static bool head_can_travel(const oc_view_head_t *head)
{
    if (!oc_packet_is_utime(head->utime_us)) return false;
    if (!intrinsics_can_travel(&head->camera.k) || !oc_pose_is_valid(&head->camera.pose)) return false;
    for (int i = 0; i < 6; i++) {
        if (!(head->margin.v[i] >= 0.0 && head->margin.v[i] <= HALF_MAX)) return false;
    }
    for (int i = 0; i < 5 && head->has_distortion; i++) {
        if (!oc_packet_is_float(head->distortion.k[i])) return false;
    }
    return true;
}

static bool centre_to_wire(const oc_pose_t *pose, int32_t wire[3])
{
    double centre[3];
    oc_pose_centre(pose, centre);
    for (int i = 0; i < 3; i++) {
        const double scaled = floor(centre[i] * CENTRE_PER_M + 0.5);
        if (!(fabs(scaled) <= (double)INT32_MAX)) return false;
        wire[i] = (int32_t)scaled;
    }
    return true;
}

oc_status_t oc_wire_head_from(const oc_view_head_t *head, oc_wire_head_t *wire)
{
    OC_ASSERT(head && wire);
    if (!head_can_travel(head)) return OC_E_ARG;

    oc_wire_head_t result = {.view = head->view,
                             .camera_index = head->camera_index,
                             .part = head->part,
                             .has_distortion = head->has_distortion,
                             .utime_us = head->utime_us,
                             .width_px = head->camera.k.width_px,
                             .height_px = head->camera.k.height_px};
    if (!centre_to_wire(&head->camera.pose, result.centre)) return OC_E_ARG;
    rotation_to_wire(head->camera.pose.R, &result);
    for (int i = 0; i < 6; i++) {
        result.margin[i] = half_not_below(head->margin.v[i]);
    }
    const oc_intrinsics_t *k = &head->camera.k;
    const double intrinsics[4] = {k->fx_px, k->fy_px, k->cx_px, k->cy_px};
    memcpy(result.intrinsics, intrinsics, sizeof intrinsics);
    if (head->has_distortion) memcpy(result.distortion, head->distortion.k, sizeof result.distortion);
    *wire = result;
    return OC_OK;
}

/* The margins of a position, or of an attitude, are mostly one number. */
static void margins_put(oc_bit_writer_t *writer, const uint16_t margins[3])
{
    const bool is_one = margins[0] == margins[1] && margins[0] == margins[2];
    oc_bits_put(writer, is_one ? 1 : 0, 1);
    for (int i = 0; i < (is_one ? 1 : 3); i++) {
        oc_bits_put(writer, margins[i], 16);
    }
}

void oc_wire_head_put(oc_bit_writer_t *writer, const oc_wire_head_t *wire, bool is_last)
{
    oc_bits_put(writer, wire->view, 16);
    oc_bits_put(writer, wire->camera_index, 8);
    oc_bits_put(writer, wire->part, 8);
    oc_bits_put(writer, is_last ? 1 : 0, 1);
    oc_bits_put(writer, wire->has_distortion ? 1 : 0, 1);
    oc_packet_put_utime(writer, wire->utime_us);
    for (int i = 0; i < 3; i++) {
        oc_bits_put(writer, (uint32_t)wire->centre[i], 32);
    }
    oc_bits_put(writer, wire->largest, 2);
    for (int i = 0; i < 3; i++) {
        oc_bits_put(writer, (uint32_t)(wire->rotation[i] + ROTATION_MAX), 20);
    }
    margins_put(writer, &wire->margin[0]);
    margins_put(writer, &wire->margin[3]);
    for (int i = 0; i < 4; i++) {
        oc_packet_put_float(writer, wire->intrinsics[i]);
    }
    oc_bits_put(writer, wire->width_px - 1u, 12);
    oc_bits_put(writer, wire->height_px - 1u, 12);
    for (int i = 0; i < 5 && wire->has_distortion; i++) {
        oc_packet_put_float(writer, wire->distortion[i]);
    }
}

/* ---- from the wire ---- */

static oc_status_t pose_get(oc_bit_reader_t *reader, oc_pose_t *pose)
{
    double centre[3], R[9];
    int32_t rotation[3];
    for (int i = 0; i < 3; i++) {
        const uint32_t bits = oc_bits_get(reader, 32);
        int32_t value;
        memcpy(&value, &bits, sizeof value);
        if (value == INT32_MIN) return OC_E_FORMAT;
        centre[i] = (double)value / CENTRE_PER_M;
    }
    const uint32_t largest = oc_bits_get(reader, 2);
    for (int i = 0; i < 3; i++) {
        const uint32_t code = oc_bits_get(reader, 20);
        if (code > 2u * ROTATION_MAX) return OC_E_FORMAT;
        rotation[i] = (int32_t)code - ROTATION_MAX;
    }
    if (reader->has_failed || !rotation_is_canonical(rotation)) return OC_E_FORMAT;
    if (rotation_from_wire(largest, rotation, R) != OC_OK) return OC_E_FORMAT;
    oc_pose_from_centre(R, centre, pose);
    return OC_OK;
}

static oc_status_t margins_get(oc_bit_reader_t *reader, double margins[3])
{
    const bool is_one = oc_bits_get(reader, 1) == 1;
    for (int i = 0; i < 3; i++) {
        if (i > 0 && is_one) {
            margins[i] = margins[0];
            continue;
        }
        const uint32_t code = oc_bits_get(reader, 16);
        if (code > HALF_MAX_CODE) return OC_E_FORMAT;
        margins[i] = half_value(code);
    }
    return OC_OK;
}

static oc_status_t intrinsics_get(oc_bit_reader_t *reader, oc_intrinsics_t *k)
{
    double values[4];
    for (int i = 0; i < 4; i++) {
        values[i] = oc_packet_get_float(reader);
    }
    *k = (oc_intrinsics_t){.fx_px = values[0], .fy_px = values[1], .cx_px = values[2], .cy_px = values[3]};
    k->width_px = oc_bits_get(reader, 12) + 1u;
    k->height_px = oc_bits_get(reader, 12) + 1u;
    return intrinsics_can_travel(k) ? OC_OK : OC_E_FORMAT;
}

oc_status_t oc_wire_head_get(oc_bit_reader_t *reader, oc_view_head_t *head)
{
    oc_view_head_t result;
    memset(&result, 0, sizeof result);
    result.view = (uint16_t)oc_bits_get(reader, 16);
    result.camera_index = (uint8_t)oc_bits_get(reader, 8);
    result.part = (uint8_t)oc_bits_get(reader, 8);
    result.is_last = oc_bits_get(reader, 1) == 1;
    result.has_distortion = oc_bits_get(reader, 1) == 1;
    result.utime_us = oc_packet_get_utime(reader);
    oc_status_t status = pose_get(reader, &result.camera.pose);
    if (status == OC_OK) status = margins_get(reader, &result.margin.v[0]);
    if (status == OC_OK) status = margins_get(reader, &result.margin.v[3]);
    if (status == OC_OK) status = intrinsics_get(reader, &result.camera.k);
    if (status != OC_OK) return status;
    for (int i = 0; i < 5 && result.has_distortion; i++) {
        result.distortion.k[i] = oc_packet_get_float(reader);
    }
    if (reader->has_failed) return OC_E_FORMAT;
    *head = result;
    return OC_OK;
}
