/* SPDX-License-Identifier: BSD-3-Clause
 * The silhouette layer: boxes and poses up, outlines as row runs down. */
#include <math.h>
#include <string.h>

#include "core/packet_internal.h"

#define PI 3.14159265358979323846

#define LENGTH_QUANTUM_M 1e-4
#define TURN_QUANTUM_RAD 2e-5
#define YAW_CODES 512u

#define CENTRE_BITS 28u
#define SIZE_BITS 20u

/* Runs of one row. */
#define MAX_RUNS 96u

/* ---- request ---- */

static bool is_within(double value, double quantum, double limit)
{
    return fabs(value) <= (limit - 1.0) * quantum; /* false for what is not a number */
}

static bool box_can_travel(const oc_ground_box_t *box)
{
    const double centre_limit = (double)(1u << (CENTRE_BITS - 1u)), size_limit = (double)(1u << SIZE_BITS);
    return is_within(box->x_m, LENGTH_QUANTUM_M, centre_limit) && is_within(box->y_m, LENGTH_QUANTUM_M, centre_limit) &&
           box->length_m > 0.0 && box->width_m > 0.0 && box->height_m > 0.0 &&
           is_within(box->length_m, LENGTH_QUANTUM_M, size_limit) &&
           is_within(box->width_m, LENGTH_QUANTUM_M, size_limit) &&
           is_within(box->height_m, LENGTH_QUANTUM_M, size_limit) && box->yaw_rad >= 0.0 && box->yaw_rad < PI;
}

static bool step_can_travel(const oc_pose_step_t *step)
{
    for (int i = 0; i < 3; i++) {
        if (!is_within(step->move_m[i], LENGTH_QUANTUM_M, 32768.0)) return false;
        if (!is_within(step->turn_rad[i], TURN_QUANTUM_RAD, 32768.0)) return false;
    }
    return true;
}

static bool step_px_is_valid(unsigned step_px, unsigned most)
{
    return step_px != 0 && step_px <= most && (step_px & (step_px - 1u)) == 0;
}

static oc_status_t request_check(const oc_silhouette_request_t *request)
{
    if (request->n_boxes > OC_MAX_SILHOUETTE_BOXES || request->n_views > OC_MAX_SILHOUETTE_VIEWS) return OC_E_LIMIT;
    if (request->n_boxes == 0 || request->n_views == 0) return OC_E_ARG;
    if (!step_px_is_valid(request->step_px, 4) || request->grow_percent > 100) return OC_E_ARG;
    for (unsigned i = 0; i < request->n_boxes; i++) {
        if (!box_can_travel(&request->boxes[i])) return OC_E_ARG;
    }
    for (unsigned i = 0; i < request->n_views; i++) {
        if (!step_can_travel(&request->views[i])) return OC_E_ARG;
        if (i > 0 && request->views[i].view <= request->views[i - 1].view) return OC_E_ARG;
    }
    return OC_OK;
}

static void put_signed(oc_bit_writer_t *writer, double value, double quantum, unsigned width)
{
    const int32_t code = (int32_t)lround(value / quantum);
    oc_bits_put(writer, (uint32_t)code & (uint32_t)(((uint64_t)1 << width) - 1u), width);
}

static double get_signed(oc_bit_reader_t *reader, double quantum, unsigned width)
{
    const uint32_t code = oc_bits_get(reader, width), half = (uint32_t)1 << (width - 1u);
    if (code == half) reader->has_failed = true; /* the one value that has no opposite */
    return ((double)code - (code > half ? 2.0 * (double)half : 0.0)) * quantum;
}

static void box_put(oc_bit_writer_t *writer, const oc_ground_box_t *box)
{
    put_signed(writer, box->x_m, LENGTH_QUANTUM_M, CENTRE_BITS);
    put_signed(writer, box->y_m, LENGTH_QUANTUM_M, CENTRE_BITS);
    const double sizes[3] = {box->length_m, box->width_m, box->height_m};
    for (int i = 0; i < 3; i++) {
        const uint32_t code = (uint32_t)lround(sizes[i] / LENGTH_QUANTUM_M);
        oc_bits_put(writer, code > 0 ? code : 1, SIZE_BITS);
    }
    oc_bits_put(writer, (uint32_t)lround(box->yaw_rad / PI * YAW_CODES) % YAW_CODES, 9);
    oc_bits_put(writer, box->is_subject ? 1 : 0, 1);
}

static void box_get(oc_bit_reader_t *reader, oc_ground_box_t *box)
{
    box->x_m = get_signed(reader, LENGTH_QUANTUM_M, CENTRE_BITS);
    box->y_m = get_signed(reader, LENGTH_QUANTUM_M, CENTRE_BITS);
    double *sizes[3] = {&box->length_m, &box->width_m, &box->height_m};
    for (int i = 0; i < 3; i++) {
        const uint32_t code = oc_bits_get(reader, SIZE_BITS);
        if (code == 0) reader->has_failed = true;
        *sizes[i] = code * LENGTH_QUANTUM_M;
    }
    box->yaw_rad = oc_bits_get(reader, 9) * (PI / YAW_CODES);
    box->is_subject = oc_bits_get(reader, 1) == 1;
}

/* What the answers depend on, from the first whole byte of the body on. */
static uint16_t key_of(const uint8_t *buf, size_t n_bits)
{
    return oc_packet_crc(buf + OC_PACKET_HEAD_BYTES, n_bits / 8u - OC_PACKET_HEAD_BYTES);
}

oc_status_t oc_packet_encode_silhouette_request(const oc_packet_head_t *packet, const oc_silhouette_request_t *request,
                                                uint8_t *buf, size_t cap, size_t *n_bytes, uint16_t *key)
{
    OC_ASSERT(packet && request && buf && n_bytes && key);
    const oc_status_t status = request_check(request);
    if (status != OC_OK) return status;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_SILHOUETTE_REQUEST, buf, cap);
    oc_bits_put_uniform(&writer, request->step_px / 2u, 3);
    oc_bits_put(&writer, request->grow_percent, 7);
    oc_bits_put(&writer, request->is_thesis ? 1 : 0, 1);
    oc_bits_put(&writer, request->n_boxes, 6);
    for (unsigned i = 0; i < request->n_boxes; i++) box_put(&writer, &request->boxes[i]);
    oc_bits_put(&writer, request->n_views, 7);
    int32_t previous = -1;
    for (unsigned i = 0; i < request->n_views; i++) {
        const oc_pose_step_t *step = &request->views[i];
        oc_bits_put_golomb(&writer, (uint32_t)(step->view - previous - 1), 0);
        for (int k = 0; k < 3; k++) put_signed(&writer, step->move_m[k], LENGTH_QUANTUM_M, 16);
        for (int k = 0; k < 3; k++) put_signed(&writer, step->turn_rad[k], TURN_QUANTUM_RAD, 16);
        previous = step->view;
    }
    oc_bits_put_align(&writer);
    const size_t n_keyed_bits = writer.n_bits;
    for (unsigned i = 0; i < request->n_views; i++) oc_bits_put(&writer, request->views[i].is_wanted ? 1 : 0, 1);
    const oc_status_t ended = oc_packet_end(&writer, n_bytes);
    if (ended == OC_OK) *key = key_of(buf, n_keyed_bits);
    return ended;
}

oc_status_t oc_packet_decode_silhouette_request(const uint8_t *buf, size_t n_bytes, oc_silhouette_request_t *request)
{
    OC_ASSERT(request);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_SILHOUETTE_REQUEST, &reader);
    if (status != OC_OK) return status;

    oc_silhouette_request_t result;
    memset(&result, 0, sizeof result);
    const uint32_t step_code = oc_bits_get_uniform(&reader, 3);
    result.step_px = (uint8_t)(1u << step_code);
    result.grow_percent = (uint8_t)oc_bits_get(&reader, 7);
    result.is_thesis = oc_bits_get(&reader, 1) == 1;
    result.n_boxes = (uint8_t)oc_bits_get(&reader, 6);
    if (result.n_boxes > OC_MAX_SILHOUETTE_BOXES) return OC_E_FORMAT;
    for (unsigned i = 0; i < result.n_boxes; i++) box_get(&reader, &result.boxes[i]);
    result.n_views = (uint8_t)oc_bits_get(&reader, 7);
    if (result.n_views > OC_MAX_SILHOUETTE_VIEWS) return OC_E_FORMAT;
    uint32_t next = 0;
    for (unsigned i = 0; i < result.n_views; i++) {
        oc_pose_step_t *step = &result.views[i];
        const uint32_t gap = oc_bits_get_golomb(&reader, 0);
        if (gap > UINT16_MAX || next + gap > UINT16_MAX) return OC_E_FORMAT;
        step->view = (uint16_t)(next + gap);
        next += gap + 1u;
        for (int k = 0; k < 3; k++) step->move_m[k] = get_signed(&reader, LENGTH_QUANTUM_M, 16);
        for (int k = 0; k < 3; k++) step->turn_rad[k] = get_signed(&reader, TURN_QUANTUM_RAD, 16);
    }
    oc_bits_get_align(&reader);
    if (reader.has_failed) return OC_E_FORMAT;
    result.key = key_of(buf, reader.n_bits);
    for (unsigned i = 0; i < result.n_views; i++) result.views[i].is_wanted = oc_bits_get(&reader, 1) == 1;
    if (oc_packet_close(&reader) != OC_OK || request_check(&result) != OC_OK) return OC_E_FORMAT;
    *request = result;
    return OC_OK;
}

/* ---- silhouette ---- */

/* A row as runs: run i begins at from[i] and has label[i]; from[0] = 0. */
typedef struct row_runs {
    unsigned n;
    uint16_t from[MAX_RUNS];
    uint8_t label[MAX_RUNS];
} row_runs_t;

/* Of the steps of edges from row to row: Golomb order by their running mean. */
typedef struct edge_model {
    uint32_t mean; /* in sixteenths */
} edge_model_t;

static unsigned edge_order(const edge_model_t *model)
{
    unsigned k = 0;
    while (k < 10 && (model->mean >> (4u + k)) > 1u) k++;
    return k;
}

static void edge_learn(edge_model_t *model, uint32_t code)
{
    model->mean = model->mean + code - model->mean / 16u;
}

static bool row_to_runs(const uint8_t *labels, unsigned n_cols, row_runs_t *runs)
{
    runs->n = 0;
    for (unsigned c = 0; c < n_cols; c++) {
        if (labels[c] > OC_LABEL_GROUND) return false;
        if (c > 0 && labels[c] == labels[c - 1]) continue;
        if (runs->n == MAX_RUNS) return false;
        runs->from[runs->n] = (uint16_t)c;
        runs->label[runs->n++] = labels[c];
    }
    return true;
}

static bool is_alike(const row_runs_t *a, const row_runs_t *b)
{
    return a->n == b->n && memcmp(a->label, b->label, a->n) == 0;
}

/* Two labels follow another: 0 the lesser, 1 the greater one. */
static uint8_t label_after(uint8_t label, uint32_t which)
{
    const uint8_t lesser = label == 0 ? 1 : 0, greater = label == 2 ? 1 : 2;
    return which ? greater : lesser;
}

static void row_put(oc_bit_writer_t *writer, const row_runs_t *above, const row_runs_t *row, unsigned n_cols,
                    edge_model_t *model)
{
    const bool is_same = is_alike(above, row);
    oc_bits_put(writer, is_same ? 1 : 0, 1);
    if (!is_same) {
        oc_bits_put_golomb(writer, row->n - 1u, 1);
        oc_bits_put_uniform(writer, row->label[0], 3);
        for (unsigned i = 1; i < row->n; i++) {
            oc_bits_put(writer, row->label[i] == label_after(row->label[i - 1], 1) ? 1 : 0, 1);
            oc_bits_put_uniform(writer, (uint32_t)(row->from[i] - row->from[i - 1] - 1),
                                n_cols - row->from[i - 1] - 1u);
        }
        return;
    }
    for (unsigned i = 1; i < row->n; i++) {
        const uint32_t code = oc_bits_from_signed(row->from[i] - above->from[i]);
        oc_bits_put_golomb(writer, code, edge_order(model));
        edge_learn(model, code);
    }
}

static bool row_get(oc_bit_reader_t *reader, const row_runs_t *above, row_runs_t *row, unsigned n_cols,
                    edge_model_t *model)
{
    const bool is_same = oc_bits_get(reader, 1) == 1;
    row->from[0] = 0;
    if (!is_same) {
        const uint32_t more = oc_bits_get_golomb(reader, 1);
        if (more >= MAX_RUNS || more >= n_cols) return false;
        row->n = more + 1u;
        row->label[0] = (uint8_t)oc_bits_get_uniform(reader, 3);
        for (unsigned i = 1; i < row->n; i++) {
            const unsigned left = n_cols - row->from[i - 1] - 1u;
            row->label[i] = label_after(row->label[i - 1], oc_bits_get(reader, 1));
            if (left == 0) return false;
            row->from[i] = (uint16_t)(row->from[i - 1] + 1u + oc_bits_get_uniform(reader, left));
        }
        return !reader->has_failed && !is_alike(above, row);
    }
    row->n = above->n;
    memcpy(row->label, above->label, above->n);
    for (unsigned i = 1; i < row->n; i++) {
        const uint32_t code = oc_bits_get_golomb(reader, edge_order(model));
        const int64_t from = (int64_t)above->from[i] + oc_bits_to_signed(code);
        if (reader->has_failed || from <= (int64_t)row->from[i - 1] || from >= (int64_t)n_cols) return false;
        row->from[i] = (uint16_t)from;
        edge_learn(model, code);
    }
    return true;
}

static bool silhouette_is_valid(const oc_silhouette_t *s)
{
    return s->box < OC_MAX_SILHOUETTE_BOXES && step_px_is_valid(s->step_px, 16) && s->n_cols > 0 && s->n_rows > 0 &&
           (uint32_t)s->n_cols * s->n_rows <= OC_MAX_SILHOUETTE_CELLS && s->n_cols <= 4096 && s->n_rows <= 4096 &&
           s->col <= 4096 - s->n_cols && s->row <= 4096 - s->n_rows;
}

/* What stands above the first row. */
static const row_runs_t OPEN_GROUND = {.n = 1, .from = {0}, .label = {OC_LABEL_GROUND}};

oc_status_t oc_packet_encode_silhouette(const oc_packet_head_t *packet, const oc_silhouette_t *silhouette,
                                        const uint8_t labels[], uint8_t *buf, size_t cap, size_t *n_bytes)
{
    OC_ASSERT(packet && silhouette && labels && buf && n_bytes);
    if (!silhouette_is_valid(silhouette)) return OC_E_ARG;

    oc_bit_writer_t writer;
    oc_packet_begin(&writer, packet, OC_PACKET_SILHOUETTE, buf, cap);
    oc_bits_put(&writer, silhouette->view, 16);
    oc_bits_put(&writer, silhouette->key, 16);
    oc_bits_put(&writer, silhouette->box, 5);
    unsigned step_code = 0;
    while (1u << step_code < silhouette->step_px) step_code++;
    oc_bits_put_uniform(&writer, step_code, 5);
    oc_bits_put(&writer, silhouette->col, 12);
    oc_bits_put(&writer, silhouette->row, 12);
    oc_bits_put(&writer, silhouette->n_cols - 1u, 12);
    oc_bits_put(&writer, silhouette->n_rows - 1u, 12);
    row_runs_t rows[2] = {OPEN_GROUND, OPEN_GROUND};
    edge_model_t model = {.mean = 24};
    for (unsigned r = 0; r < silhouette->n_rows; r++) {
        row_runs_t *row = &rows[r & 1u];
        if (!row_to_runs(labels + (size_t)r * silhouette->n_cols, silhouette->n_cols, row)) return OC_E_SPACE;
        row_put(&writer, &rows[(r + 1u) & 1u], row, silhouette->n_cols, &model);
        if (writer.has_failed) return OC_E_SPACE;
    }
    return oc_packet_end(&writer, n_bytes);
}

/* Read all rows; labels may be NULL. */
static bool rows_get(oc_bit_reader_t *reader, const oc_silhouette_t *silhouette, uint8_t *labels)
{
    row_runs_t rows[2] = {OPEN_GROUND, OPEN_GROUND};
    edge_model_t model = {.mean = 24};
    for (unsigned r = 0; r < silhouette->n_rows; r++) {
        row_runs_t *row = &rows[r & 1u];
        if (!row_get(reader, &rows[(r + 1u) & 1u], row, silhouette->n_cols, &model)) return false;
        if (!labels) continue;
        uint8_t *out = labels + (size_t)r * silhouette->n_cols;
        for (unsigned i = 0; i < row->n; i++) {
            const unsigned end = i + 1u < row->n ? row->from[i + 1u] : silhouette->n_cols;
            memset(out + row->from[i], row->label[i], end - row->from[i]);
        }
    }
    return true;
}

oc_status_t oc_packet_decode_silhouette(const uint8_t *buf, size_t n_bytes, oc_silhouette_t *silhouette,
                                        uint8_t labels[], size_t cap)
{
    OC_ASSERT(silhouette && labels);
    oc_bit_reader_t reader;
    const oc_status_t status = oc_packet_open(buf, n_bytes, OC_PACKET_SILHOUETTE, &reader);
    if (status != OC_OK) return status;

    oc_silhouette_t result = {.view = (uint16_t)oc_bits_get(&reader, 16)};
    result.key = (uint16_t)oc_bits_get(&reader, 16);
    result.box = (uint8_t)oc_bits_get(&reader, 5);
    result.step_px = (uint8_t)(1u << oc_bits_get_uniform(&reader, 5));
    result.col = (uint16_t)oc_bits_get(&reader, 12);
    result.row = (uint16_t)oc_bits_get(&reader, 12);
    result.n_cols = (uint16_t)(oc_bits_get(&reader, 12) + 1u);
    result.n_rows = (uint16_t)(oc_bits_get(&reader, 12) + 1u);
    if (reader.has_failed || !silhouette_is_valid(&result)) return OC_E_FORMAT;
    oc_bit_reader_t first = reader;
    if (!rows_get(&first, &result, NULL) || oc_packet_close(&first) != OC_OK) return OC_E_FORMAT;
    if ((size_t)result.n_cols * result.n_rows > cap) return OC_E_SPACE;
    if (!rows_get(&reader, &result, labels)) return OC_E_FORMAT;
    *silhouette = result;
    return OC_OK;
}
