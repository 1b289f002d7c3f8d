/* SPDX-License-Identifier: BSD-3-Clause
 * View packets: a run of a keyframe's junctions in raster order, and its ground ties. */
#include <math.h>
#include <string.h>

#include "core/packet_internal.h"

/* The wire's own limits; a build with larger tables must not send what another refuses. */
static_assert(OC_MAX_JUNCTIONS <= 1024, "first and count have 11 bits, and scores start at 1024");
static_assert(OC_MAX_TIES <= 127, "the count of ties has 7 bits");

#define FIRST_SCORE 1024

/* Quanta per pixel; positions start at -0.5 px. */
#define JUNCTION_PER_PX 8u
#define TIE_PER_PX 16u

#define ANGLES 512u
#define ANGLE_RAD (6.283185307179586476925 / 512.0)

#define MIN_BRANCHES 2u

/* A corner's one direction travels as a pair of two equal ones, which no junction has. */
#define CORNER_BRANCHES 1u

/* No junction is shorter: gap, column, branches, label, two angles. */
#define JUNCTION_MIN_BITS 14u

/* ---- quanta ---- */

static bool position_is_inside(float value_px, uint32_t side_px)
{
    return value_px >= -0.5f && (double)value_px < (double)side_px - 0.5;
}

/* 0 .. side * per_px - 1; value_px is inside. */
static uint32_t position_to_wire(float value_px, uint32_t side_px, uint32_t per_px)
{
    const uint32_t n = side_px * per_px;
    const double scaled = floor(((double)value_px + 0.5) * (double)per_px + 0.5);
    const uint32_t code = (uint32_t)scaled;
    return code < n ? code : n - 1u;
}

static float position_from_wire(uint32_t code, uint32_t per_px)
{
    return (float)((double)code / (double)per_px - 0.5);
}

static uint32_t angle_to_wire(float angle_rad)
{
    return (uint32_t)floor((double)angle_rad / ANGLE_RAD + 0.5) % ANGLES;
}

static float angle_from_wire(uint32_t code)
{
    return (float)((double)code * ANGLE_RAD);
}

/* The angles of a junction in wire units, ascending; order[] says which branch
 * each came from (a direction just below 2 pi rounds to 0 and moves to the front).
 * Two that round to the same are kept apart, as equal ones are a corner. */
static void angles_to_wire(const oc_junction_t *junction, uint32_t angles[OC_MAX_BRANCHES],
                           uint8_t order[OC_MAX_BRANCHES])
{
    for (uint8_t i = 0; i < junction->n_branches; i++) {
        const uint32_t angle = angle_to_wire(junction->branch[i].angle_rad);
        unsigned at = i;
        for (; at > 0 && angles[at - 1u] > angle; at--) {
            angles[at] = angles[at - 1u];
            order[at] = order[at - 1u];
        }
        angles[at] = angle;
        order[at] = i;
    }
    if (junction->n_branches == MIN_BRANCHES && angles[0] == angles[1]) {
        if (angles[1] < ANGLES - 1u) {
            angles[1]++;
        } else {
            angles[0]--;
        }
    }
}

/* ---- checks before encoding ---- */

static bool junction_can_travel(const oc_junction_t *junction, const oc_intrinsics_t *k)
{
    /* 2 pi as a float is a little above 2 pi. */
    const float turn = 6.28318548f;
    if (!position_is_inside(junction->x_px, k->width_px)) return false;
    if (!position_is_inside(junction->y_px, k->height_px)) return false;
    if (junction->n_branches < CORNER_BRANCHES || junction->n_branches > OC_MAX_BRANCHES) return false;
    if (junction->label > OC_LABEL_GROUND) return false;
    for (uint8_t i = 0; i < junction->n_branches; i++) {
        const float angle = junction->branch[i].angle_rad;
        if (!(angle >= 0.0f && angle <= turn)) return false;
    }
    return true;
}

static bool tie_can_travel(const oc_tie_t *tie, uint16_t view, const oc_intrinsics_t *k)
{
    return tie->ref_view != view && position_is_inside(tie->x_px, k->width_px) &&
           position_is_inside(tie->y_px, k->height_px) && position_is_inside(tie->ref_x_px, OC_MAX_IMAGE_SIDE) &&
           position_is_inside(tie->ref_y_px, OC_MAX_IMAGE_SIDE);
}

/* ---- junctions out ---- */

/* What one attempt at a packet needs. Keys sort into raster order: row, then
 * column, then order of worth: 16 bits each, so equal positions stay apart. */
typedef struct view_encoder {
    const oc_intrinsics_t *k;
    const oc_junction_t *junctions; /* the first of the run */
    uint16_t n_keys;
    uint64_t keys[OC_MAX_JUNCTIONS];
} view_encoder_t;

static uint32_t key_y(uint64_t key)
{
    return (uint32_t)(key >> 32) & 0xffffu;
}

static uint32_t key_x(uint64_t key)
{
    return (uint32_t)(key >> 16) & 0xffffu;
}

static const oc_junction_t *key_junction(const view_encoder_t *encoder, uint64_t key)
{
    return &encoder->junctions[key & 0xffffu];
}

static void keys_sort(uint64_t keys[], uint16_t n)
{
    static const uint16_t steps[] = {301, 132, 57, 23, 10, 4, 1};
    for (size_t s = 0; s < sizeof steps / sizeof steps[0]; s++) {
        const uint16_t step = steps[s];
        for (unsigned i = step; i < n; i++) {
            const uint64_t key = keys[i];
            unsigned at = i;
            for (; at >= step && keys[at - step] > key; at -= step) {
                keys[at] = keys[at - step];
            }
            keys[at] = key;
        }
    }
}

static void keys_take(view_encoder_t *encoder, uint16_t n)
{
    for (uint16_t i = 0; i < n; i++) {
        const oc_junction_t *junction = &encoder->junctions[i];
        const uint64_t y = position_to_wire(junction->y_px, encoder->k->height_px, JUNCTION_PER_PX);
        const uint64_t x = position_to_wire(junction->x_px, encoder->k->width_px, JUNCTION_PER_PX);
        encoder->keys[i] = (y << 32) | (x << 16) | i;
    }
    encoder->n_keys = n;
    keys_sort(encoder->keys, n);
}

static unsigned row_parameter(const view_encoder_t *encoder)
{
    unsigned best = 0;
    uint32_t best_length = UINT32_MAX;
    for (unsigned k = 0; k <= OC_MAX_RICE; k++) {
        uint32_t length = 0, y = 0;
        for (uint16_t i = 0; i < encoder->n_keys; i++) {
            length += oc_bits_rice_length(key_y(encoder->keys[i]) - y, k);
            y = key_y(encoder->keys[i]);
        }
        if (length < best_length) {
            best = k;
            best_length = length;
        }
    }
    return best;
}

static uint8_t common_label(const view_encoder_t *encoder)
{
    uint16_t count[3] = {0, 0, 0};
    for (uint16_t i = 0; i < encoder->n_keys; i++) {
        count[encoder->junctions[i].label]++;
    }
    uint8_t best = OC_LABEL_OBSTACLE;
    if (count[OC_LABEL_UNKNOWN] > count[best]) best = OC_LABEL_UNKNOWN;
    if (count[OC_LABEL_GROUND] > count[best]) best = OC_LABEL_GROUND;
    return best;
}

/* Two directions are one of them and the turn to the other, the shorter way round. */
static void pair_put(oc_bit_writer_t *writer, uint32_t low, uint32_t high)
{
    const bool is_forward = high - low <= ANGLES / 2u;
    oc_bits_put(writer, is_forward ? low : high, 9);
    oc_bits_put_uniform(writer, is_forward ? high - low : ANGLES - (high - low), ANGLES / 2u + 1u);
}

static void junction_put_directions(oc_bit_writer_t *writer, const oc_junction_t *junction, uint8_t common)
{
    uint32_t angles[OC_MAX_BRANCHES];
    uint8_t order[OC_MAX_BRANCHES];
    angles_to_wire(junction, angles, order);
    const bool is_corner = junction->n_branches == CORNER_BRANCHES;
    oc_bits_put_unary(writer, is_corner ? 0 : junction->n_branches - MIN_BRANCHES, OC_MAX_BRANCHES - MIN_BRANCHES);
    oc_packet_put_label(writer, junction->label, common);
    if (junction->n_branches <= MIN_BRANCHES) {
        pair_put(writer, angles[0], is_corner ? angles[0] : angles[1]);
        return;
    }
    uint32_t previous = 0;
    for (uint8_t i = 0; i < junction->n_branches; i++) {
        oc_bits_put_uniform(writer, angles[i] - previous, ANGLES - previous);
        previous = angles[i];
    }
}

static void junctions_put(oc_bit_writer_t *writer, const view_encoder_t *encoder)
{
    const uint32_t columns = encoder->k->width_px * JUNCTION_PER_PX;
    const unsigned k = row_parameter(encoder);
    const uint8_t common = common_label(encoder);
    oc_bits_put(writer, encoder->n_keys, 11);
    oc_bits_put(writer, k, 4);
    oc_bits_put(writer, common, 2);
    uint32_t y = 0, x = 0;
    for (uint16_t i = 0; i < encoder->n_keys; i++) {
        const uint64_t key = encoder->keys[i];
        if (key_y(key) != y) x = 0;
        oc_bits_put_rice(writer, key_y(key) - y, k);
        oc_bits_put_uniform(writer, key_x(key) - x, columns - x);
        y = key_y(key);
        x = key_x(key);
        junction_put_directions(writer, key_junction(encoder, key), common);
    }
}

/* The most junctions that fit, by halving: the length grows with the number
 * but for a few bits, and what is kept has been tried. */
static uint16_t junctions_fit(oc_bit_writer_t *writer, view_encoder_t *encoder, uint16_t n_left)
{
    const size_t room = writer->cap_bits > writer->n_bits ? writer->cap_bits - writer->n_bits : 0;
    uint32_t low = 0, high = n_left;
    if (high > room / JUNCTION_MIN_BITS) high = (uint32_t)(room / JUNCTION_MIN_BITS);
    while (low < high) {
        const uint32_t middle = (low + high + 1u) / 2u;
        oc_bit_writer_t trial = *writer;
        keys_take(encoder, (uint16_t)middle);
        junctions_put(&trial, encoder);
        if (trial.has_failed) {
            high = middle - 1u;
        } else {
            low = middle;
        }
    }
    keys_take(encoder, (uint16_t)low);
    junctions_put(writer, encoder);
    return (uint16_t)low;
}

/* ---- junctions in place ---- */

static void junction_quantise(oc_junction_t *junction, const oc_intrinsics_t *k)
{
    uint32_t angles[OC_MAX_BRANCHES];
    uint8_t order[OC_MAX_BRANCHES];
    oc_branch_t branch[OC_MAX_BRANCHES];
    angles_to_wire(junction, angles, order);
    memcpy(branch, junction->branch, sizeof branch);
    for (uint8_t i = 0; i < junction->n_branches; i++) {
        junction->branch[i] = branch[order[i]];
        junction->branch[i].angle_rad = angle_from_wire(angles[i]);
    }
    junction->x_px =
        position_from_wire(position_to_wire(junction->x_px, k->width_px, JUNCTION_PER_PX), JUNCTION_PER_PX);
    junction->y_px =
        position_from_wire(position_to_wire(junction->y_px, k->height_px, JUNCTION_PER_PX), JUNCTION_PER_PX);
    junction->kind = (uint8_t)oc_junction_kind_of(junction->branch, junction->n_branches);
}

/* Follow each cycle of the permutation, so that no second table of junctions is needed. */
static void junctions_reorder(oc_junction_t junctions[], const view_encoder_t *encoder)
{
    bool is_placed[OC_MAX_JUNCTIONS] = {false};
    for (uint16_t start = 0; start < encoder->n_keys; start++) {
        if (is_placed[start]) continue;
        const oc_junction_t first = junctions[start];
        uint16_t to = start;
        for (;;) {
            const uint16_t from = (uint16_t)(encoder->keys[to] & 0xffffu);
            is_placed[to] = true;
            if (from == start) break;
            junctions[to] = junctions[from];
            to = from;
        }
        junctions[to] = first;
    }
}

/* ---- ties out ---- */

static bool ref_is_inside(const oc_tie_t *tie, const oc_intrinsics_t *k)
{
    return position_is_inside(tie->ref_x_px, k->width_px) && position_is_inside(tie->ref_y_px, k->height_px);
}

static void tie_put(oc_bit_writer_t *writer, const oc_tie_t *tie, uint16_t view, uint16_t previous_ref,
                    const oc_intrinsics_t *k, const oc_intrinsics_t *ref_k)
{
    oc_bits_put(writer, tie->ref_view == previous_ref ? 0 : 1, 1);
    if (tie->ref_view != previous_ref) {
        oc_bits_put_golomb(writer, (uint16_t)(view - tie->ref_view) - 1u, 0);
    }
    const float values[4] = {tie->x_px, tie->y_px, tie->ref_x_px, tie->ref_y_px};
    const uint32_t sides[4] = {k->width_px, k->height_px, ref_k->width_px, ref_k->height_px};
    for (int i = 0; i < 4; i++) {
        oc_bits_put_uniform(writer, position_to_wire(values[i], sides[i], TIE_PER_PX), sides[i] * TIE_PER_PX);
    }
}

/* As many as fit, from ties[0] on. */
static uint16_t ties_put(oc_bit_writer_t *writer, const oc_tie_t ties[], uint16_t n_left, uint16_t view,
                         const oc_intrinsics_t *k)
{
    static const oc_intrinsics_t largest = {.width_px = OC_MAX_IMAGE_SIDE, .height_px = OC_MAX_IMAGE_SIDE};
    bool is_same_size = true;
    for (uint16_t i = 0; i < n_left; i++) {
        is_same_size = is_same_size && ref_is_inside(&ties[i], k);
    }
    oc_bit_writer_t count_place = *writer;
    oc_bits_put(writer, 0, 7);
    oc_bits_put(writer, is_same_size ? 1 : 0, 1);
    uint16_t previous_ref = view;
    for (uint16_t taken = 0; taken < n_left; taken++) {
        oc_bit_writer_t trial = *writer;
        tie_put(&trial, &ties[taken], view, previous_ref, k, is_same_size ? k : &largest);
        if (trial.has_failed) {
            n_left = taken;
            break;
        }
        *writer = trial;
        previous_ref = ties[taken].ref_view;
    }
    oc_bits_put(&count_place, n_left, 7);
    return n_left;
}

/* Bits to hold back from the junctions: what the ties take, at most a quarter of the room. */
static size_t tie_reserve(const oc_bit_writer_t *writer, const oc_tie_t ties[], uint16_t n_left, uint16_t view,
                          const oc_intrinsics_t *k)
{
    const size_t quarter = (writer->cap_bits - writer->n_bits) / 4u;
    oc_bit_writer_t trial = *writer;
    trial.cap_bits = writer->n_bits + quarter;
    const uint16_t tied = ties_put(&trial, ties, n_left, view, k);
    return !trial.has_failed && tied == n_left ? trial.n_bits - writer->n_bits : quarter;
}

/* ---- encode ---- */

static oc_status_t view_check(const oc_view_head_t *head, const oc_junction_t junctions[], uint16_t n_junctions,
                              uint16_t first, const oc_tie_t ties[], uint16_t n_ties, uint16_t first_tie)
{
    if (n_junctions > OC_MAX_JUNCTIONS || n_ties > OC_MAX_TIES) return OC_E_LIMIT;
    if (first > n_junctions || first_tie > n_ties) return OC_E_ARG;
    for (uint16_t i = first; i < n_junctions; i++) {
        if (!junction_can_travel(&junctions[i], &head->camera.k)) return OC_E_ARG;
    }
    for (uint16_t i = first_tie; i < n_ties; i++) {
        if (!tie_can_travel(&ties[i], head->view, &head->camera.k)) return OC_E_ARG;
    }
    return OC_OK;
}

oc_status_t oc_packet_encode_view(const oc_packet_head_t *packet, const oc_view_head_t *head, oc_junction_t junctions[],
                                  uint16_t n_junctions, uint16_t first, const oc_tie_t ties[], uint16_t n_ties,
                                  uint16_t first_tie, uint8_t *buf, size_t cap, size_t *n_bytes,
                                  uint16_t *junctions_taken, uint16_t *ties_taken)
{
    OC_ASSERT(packet && head && buf && n_bytes && junctions_taken && ties_taken);
    OC_ASSERT((junctions || n_junctions == 0) && (ties || n_ties == 0));
    oc_wire_head_t wire;
    oc_status_t status = oc_wire_head_from(head, &wire);
    if (status == OC_OK) status = view_check(head, junctions, n_junctions, first, ties, n_ties, first_tie);
    if (status != OC_OK) return status;

    const oc_intrinsics_t *k = &head->camera.k;
    const uint16_t n_left = (uint16_t)(n_junctions - first), n_ties_left = (uint16_t)(n_ties - first_tie);
    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_VIEW, buf, cap);
    oc_bit_writer_t head_place = writer;
    oc_wire_head_put(&writer, &wire, false);
    oc_bits_put(&writer, first, 11);
    if (writer.has_failed) return OC_E_SPACE;

    const oc_tie_t *ties_left = n_ties_left > 0 ? &ties[first_tie] : NULL;
    const size_t cap_bits = writer.cap_bits;
    writer.cap_bits -= tie_reserve(&writer, ties_left, n_ties_left, head->view, k);
    view_encoder_t encoder = {.k = k, .junctions = n_left > 0 ? &junctions[first] : NULL};
    const uint16_t taken = junctions_fit(&writer, &encoder, n_left);
    writer.cap_bits = cap_bits;
    const uint16_t tied = ties_put(&writer, ties_left, n_ties_left, head->view, k);
    if (taken + tied == 0 && n_left + n_ties_left > 0) return OC_E_SPACE;

    oc_wire_head_put(&head_place, &wire, taken == n_left && tied == n_ties_left);
    status = oc_packet_end(&writer, n_bytes);
    if (status != OC_OK) return status;
    if (taken > 0) junctions_reorder(&junctions[first], &encoder);
    for (uint16_t i = 0; i < taken; i++) {
        junction_quantise(&junctions[first + i], k);
    }
    *junctions_taken = taken;
    *ties_taken = tied;
    return OC_OK;
}

/* ---- decode ----
 * The same code runs twice: first with part == NULL, which checks everything,
 * then to fill a part, which at 90 kB is too large for a copy on the stack. */

/* Returns the number of branches, 1 or 2. */
static unsigned pair_get(oc_bit_reader_t *reader, oc_branch_t branch[2])
{
    const uint32_t start = oc_bits_get(reader, 9);
    const uint32_t end = (start + oc_bits_get_uniform(reader, ANGLES / 2u + 1u)) % ANGLES;
    if (start == end) {
        branch[0].angle_rad = angle_from_wire(start);
        return CORNER_BRANCHES;
    }
    branch[0].angle_rad = angle_from_wire(start < end ? start : end);
    branch[1].angle_rad = angle_from_wire(start < end ? end : start);
    return MIN_BRANCHES;
}

static void fan_get(oc_bit_reader_t *reader, unsigned n, oc_branch_t branch[])
{
    uint32_t angle = 0;
    for (unsigned i = 0; i < n; i++) {
        angle += oc_bits_get_uniform(reader, ANGLES - angle);
        branch[i].angle_rad = angle_from_wire(angle);
    }
}

static void junction_get_directions(oc_bit_reader_t *reader, uint8_t common, oc_junction_t *junction)
{
    const unsigned more = oc_bits_get_unary(reader, OC_MAX_BRANCHES - MIN_BRANCHES);
    junction->n_branches = (uint8_t)(MIN_BRANCHES + more);
    junction->label = oc_packet_get_label(reader, common);
    if (more == 0) {
        junction->n_branches = (uint8_t)pair_get(reader, junction->branch);
    } else {
        fan_get(reader, junction->n_branches, junction->branch);
    }
    junction->kind = (uint8_t)oc_junction_kind_of(junction->branch, junction->n_branches);
}

static oc_status_t junctions_get(oc_bit_reader_t *reader, const oc_intrinsics_t *k, oc_view_part_t *part)
{
    const uint32_t rows = k->height_px * JUNCTION_PER_PX, columns = k->width_px * JUNCTION_PER_PX;
    const uint32_t first = oc_bits_get(reader, 11), n = oc_bits_get(reader, 11);
    const unsigned parameter = oc_bits_get(reader, 4);
    const uint8_t common = oc_packet_get_common_label(reader);
    if (reader->has_failed || first > OC_MAX_JUNCTIONS || n > OC_MAX_JUNCTIONS - first) return OC_E_FORMAT;

    uint32_t y = 0, x = 0;
    for (uint32_t i = 0; i < n; i++) {
        const uint32_t gap = oc_bits_get_rice(reader, parameter);
        if (gap >= rows - y) return OC_E_FORMAT;
        if (gap > 0) x = 0;
        y += gap;
        x += oc_bits_get_uniform(reader, columns - x);
        oc_junction_t junction;
        memset(&junction, 0, sizeof junction);
        junction_get_directions(reader, common, &junction);
        if (reader->has_failed) return OC_E_FORMAT;
        junction.x_px = position_from_wire(x, JUNCTION_PER_PX);
        junction.y_px = position_from_wire(y, JUNCTION_PER_PX);
        junction.score = (float)(FIRST_SCORE - (int)(first + i));
        if (part) part->junctions[i] = junction;
    }
    if (part) part->first_junction = (uint16_t)first;
    if (part) part->n_junctions = (uint16_t)n;
    return OC_OK;
}

static void tie_get(oc_bit_reader_t *reader, uint16_t view, uint16_t previous_ref, const uint32_t sides[4],
                    oc_tie_t *tie)
{
    tie->ref_view = previous_ref;
    if (oc_bits_get(reader, 1) == 1) {
        const uint32_t back = oc_bits_get_golomb(reader, 0);
        if (back >= UINT16_MAX) reader->has_failed = true;
        tie->ref_view = (uint16_t)(view - back - 1u);
    }
    if (tie->ref_view == view) reader->has_failed = true;
    float values[4];
    for (int i = 0; i < 4; i++) {
        values[i] = position_from_wire(oc_bits_get_uniform(reader, sides[i] * TIE_PER_PX), TIE_PER_PX);
    }
    tie->x_px = values[0];
    tie->y_px = values[1];
    tie->ref_x_px = values[2];
    tie->ref_y_px = values[3];
}

static oc_status_t ties_get(oc_bit_reader_t *reader, const oc_view_head_t *head, oc_view_part_t *part)
{
    const oc_intrinsics_t *k = &head->camera.k;
    const uint32_t n = oc_bits_get(reader, 7);
    const bool is_same_size = oc_bits_get(reader, 1) == 1;
    if (n > OC_MAX_TIES) return OC_E_FORMAT;
    const uint32_t sides[4] = {k->width_px, k->height_px, is_same_size ? k->width_px : OC_MAX_IMAGE_SIDE,
                               is_same_size ? k->height_px : OC_MAX_IMAGE_SIDE};
    uint16_t previous_ref = head->view;
    for (uint32_t i = 0; i < n; i++) {
        oc_tie_t tie;
        memset(&tie, 0, sizeof tie);
        tie_get(reader, head->view, previous_ref, sides, &tie);
        if (reader->has_failed) return OC_E_FORMAT;
        previous_ref = tie.ref_view;
        if (part) part->ties[i] = tie;
    }
    if (part) part->n_ties = (uint16_t)n;
    return OC_OK;
}

static oc_status_t view_get(oc_bit_reader_t reader, oc_view_part_t *part)
{
    oc_view_head_t head;
    oc_status_t status = oc_wire_head_get(&reader, &head);
    if (status == OC_OK) status = junctions_get(&reader, &head.camera.k, part);
    if (status == OC_OK) status = ties_get(&reader, &head, part);
    if (status == OC_OK) status = oc_packet_close(&reader);
    if (status == OC_OK && part) part->head = head;
    return status;
}

oc_status_t oc_packet_decode_view(const uint8_t *buf, size_t n_bytes, oc_view_part_t *part)
{
    OC_ASSERT(part);
    oc_bit_reader_t reader;
    oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_VIEW, &reader);
    if (status == OC_OK) status = view_get(reader, NULL);
    if (status == OC_OK) status = view_get(reader, part);
    return status;
}
