/* SPDX-License-Identifier: BSD-3-Clause
 * One packet of every type with plausible contents, for the unit tests and the fuzzer's seeds. */
#ifndef OUTCROP_TESTS_PACKET_EXAMPLES_H
#define OUTCROP_TESTS_PACKET_EXAMPLES_H

#include <math.h>
#include <string.h>

#include "core/packet.h"

#define N_EXAMPLES 20

typedef struct example_packet {
    const char *name;
    size_t n_bytes;
    uint8_t bytes[OC_MAX_DATAGRAM_BYTES];
} example_packet_t;

static inline uint32_t example_random(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

/* In [0, 1). */
static inline double example_uniform(uint32_t *state)
{
    return (double)example_random(state) / 16777216.0;
}

static inline oc_view_head_t example_view_head(uint32_t *state)
{
    oc_view_head_t head;
    memset(&head, 0, sizeof head);
    head.view = (uint16_t)(100u + example_random(state) % 60000u);
    head.camera_index = 1;
    head.part = (uint8_t)(example_random(state) % 40u);
    head.utime_us = 1700000000000000 + (int64_t)example_random(state) * 1000 + 7;
    head.camera.k = (oc_intrinsics_t){.fx_px = 532.5026195803008,
                                      .fy_px = 513.8235079793047,
                                      .cx_px = 320.25,
                                      .cy_px = 239.75,
                                      .width_px = 640,
                                      .height_px = 480};
    double quat[4], norm = 0.0, centre[3], R[9];
    for (int i = 0; i < 4; i++) {
        quat[i] = example_uniform(state) - 0.5;
        norm += quat[i] * quat[i];
    }
    for (int i = 0; i < 4; i++) {
        quat[i] /= sqrt(norm);
    }
    for (int i = 0; i < 3; i++) {
        centre[i] = 100.0 * (example_uniform(state) - 0.5);
    }
    if (oc_rotation_from_quat(quat, R) == OC_OK) oc_pose_from_centre(R, centre, &head.camera.pose);
    for (int i = 0; i < 6; i++) {
        head.margin.v[i] = i < 3 ? 0.05 : 0.0174532925;
    }
    return head;
}

/* n junctions at random; every `label_period`th has another label than obstacle. */
static inline void example_junctions(uint32_t *state, const oc_intrinsics_t *k, unsigned n, unsigned max_branches,
                                     unsigned label_period, oc_junction_t junctions[])
{
    memset(junctions, 0, n * sizeof junctions[0]);
    for (unsigned i = 0; i < n; i++) {
        oc_junction_t *junction = &junctions[i];
        junction->x_px = (float)(example_uniform(state) * (k->width_px - 1.0));
        junction->y_px = (float)(example_uniform(state) * (k->height_px - 1.0));
        junction->score = (float)(n - i);
        junction->label = i % label_period == 0 ? (uint8_t)(example_random(state) % 3u) : (uint8_t)OC_LABEL_OBSTACLE;
        junction->n_branches = (uint8_t)(2u + example_random(state) % (max_branches - 1u));
        double angle = example_uniform(state) * 6.28 / junction->n_branches;
        for (unsigned b = 0; b < junction->n_branches; b++) {
            junction->branch[b].angle_rad = (float)angle;
            junction->branch[b].length_px = 10.0f + (float)b;
            junction->branch[b].strength = 0.5f;
            angle += example_uniform(state) * (6.28 - angle) / 1.5;
        }
    }
}

static inline void example_ties(uint32_t *state, const oc_view_head_t *head, unsigned n, oc_tie_t ties[])
{
    for (unsigned i = 0; i < n; i++) {
        ties[i].ref_view = (uint16_t)(head->view - 1u - i / 8u);
        ties[i].x_px = (float)(example_uniform(state) * (head->camera.k.width_px - 1.0));
        ties[i].y_px = (float)(example_uniform(state) * (head->camera.k.height_px - 1.0));
        ties[i].ref_x_px = ties[i].x_px * 0.9f;
        ties[i].ref_y_px = ties[i].y_px * 0.9f;
    }
}

static inline oc_status_t example_view(const oc_packet_head_t *packet, uint32_t seed, unsigned n_junctions,
                                       unsigned max_branches, unsigned n_ties, bool has_distortion,
                                       example_packet_t *out)
{
    static oc_junction_t junctions[OC_MAX_JUNCTIONS];
    static oc_tie_t ties[OC_MAX_TIES];
    oc_view_head_t head = example_view_head(&seed);
    head.has_distortion = has_distortion;
    for (int i = 0; i < 5; i++) {
        head.distortion.k[i] = 0.1 / (i + 1);
    }
    example_junctions(&seed, &head.camera.k, n_junctions, max_branches, 4, junctions);
    example_ties(&seed, &head, n_ties, ties);
    uint16_t taken, tied;
    return oc_packet_encode_view(packet, &head, junctions, (uint16_t)n_junctions, 0, ties, (uint16_t)n_ties, 0,
                                 out->bytes, sizeof out->bytes, &out->n_bytes, &taken, &tied);
}

static inline oc_status_t example_patch(const oc_packet_head_t *packet, uint8_t quality, uint16_t n_blocks,
                                        example_packet_t *out)
{
    static uint8_t px[160 * 120];
    static uint16_t blocks[OC_MAX_PACKET_BLOCKS];
    for (int i = 0; i < 160 * 120; i++) {
        px[i] = (uint8_t)(128.0 + 60.0 * sin(i % 160 * 0.21) * cos(i / 160 * 0.17) + (i % 160 > 80 ? 40 : -40));
    }
    const oc_image_t grey = {.px = px, .width_px = 160, .height_px = 120, .stride_bytes = 160, .channels = 1};
    for (uint16_t i = 0; i < n_blocks; i++) {
        blocks[i] = (uint16_t)(i * 299u / n_blocks);
    }
    uint16_t taken;
    return oc_packet_encode_patch(packet, 7, quality, &grey, blocks, n_blocks, out->bytes, sizeof out->bytes,
                                  &out->n_bytes, &taken);
}

static inline oc_status_t example_relabel(const oc_packet_head_t *packet, example_packet_t *out)
{
    oc_relabel_t relabel = {.view = 77, .first = 20, .n = 150};
    for (uint16_t i = 0; i < relabel.n; i++) {
        relabel.labels[i] = i % 7 == 0 ? OC_LABEL_GROUND : i % 11 == 0 ? OC_LABEL_UNKNOWN : OC_LABEL_OBSTACLE;
    }
    return oc_packet_encode_relabel(packet, &relabel, out->bytes, sizeof out->bytes, &out->n_bytes);
}

static inline oc_status_t example_overhead(const oc_packet_head_t *packet, example_packet_t *out)
{
    static const uint8_t bytes[] = {0xff, 0xd8, 1, 2, 3, 4, 5, 0xff, 0xd9};
    const oc_overhead_t overhead = {.view = 3,
                                    .metres_per_pixel = 0.01,
                                    .tile_px = 64,
                                    .tile = {-3, 12},
                                    .codec = OC_CODEC_JPEG,
                                    .n_bytes = sizeof bytes,
                                    .bytes = bytes};
    return oc_packet_encode_overhead(packet, &overhead, out->bytes, sizeof out->bytes, &out->n_bytes);
}

static inline oc_status_t example_status(const oc_packet_head_t *packet, example_packet_t *out)
{
    oc_vehicle_status_t status = {.uptime_s = 3600, .n_views = 14, .newest_view = 13, .bytes_sent = 123456};
    status.is_source_done = true;
    status.area = (oc_area_t){true, -3.5, 3.5, -3.25, 3.5, 1.5};
    for (uint32_t i = 0; i < OC_N_COUNTERS; i++) {
        status.counters[i] = i * 3u;
    }
    return oc_packet_encode_status(packet, &status, out->bytes, sizeof out->bytes, &out->n_bytes);
}

static inline oc_status_t example_image(const oc_packet_head_t *packet, uint32_t seed, example_packet_t *out)
{
    static const uint8_t bytes[] = {10, 20, 30, 40, 50};
    oc_image_piece_t piece = {.head = example_view_head(&seed),
                              .codec = OC_CODEC_WEBP,
                              .total_bytes = 5000,
                              .offset_bytes = 4995,
                              .n_bytes = sizeof bytes,
                              .bytes = bytes};
    uint16_t taken;
    return oc_packet_encode_image(packet, &piece, out->bytes, sizeof out->bytes, &out->n_bytes, &taken);
}

static inline oc_status_t example_patch_request(const oc_packet_head_t *packet, example_packet_t *out)
{
    oc_patch_request_t request = {.view = 9, .quality = 16, .n_blocks = 40};
    for (uint16_t i = 0; i < request.n_blocks; i++) {
        request.blocks[i] = (uint16_t)(100 + i * i * 3);
    }
    uint16_t taken;
    return oc_packet_encode_patch_request(packet, &request, out->bytes, sizeof out->bytes, &out->n_bytes, &taken);
}

static inline oc_status_t example_overhead_request(const oc_packet_head_t *packet, example_packet_t *out)
{
    oc_overhead_request_t request = {.view = 5, .metres_per_pixel = 0.02, .tile_px = 128, .quality = 40, .n_tiles = 9};
    for (int i = 0; i < 9; i++) {
        request.image_from_ground[i] = 1.5 * i - 3.25;
        request.tiles[i] = (oc_tile_id_t){(int16_t)(i % 3 - 20), (int16_t)(i / 3 + 300)};
    }
    uint16_t taken;
    return oc_packet_encode_overhead_request(packet, &request, out->bytes, sizeof out->bytes, &out->n_bytes, &taken);
}

/* A disc of obstacle with a hole of unknown, and a crumb, on ground. */
static inline void example_labels(unsigned n_cols, unsigned n_rows, uint8_t labels[])
{
    for (unsigned r = 0; r < n_rows; r++) {
        for (unsigned c = 0; c < n_cols; c++) {
            const double x = (c + 0.5) / n_cols * 2.0 - 1.0, y = (r + 0.5) / n_rows * 2.0 - 1.0;
            const double d = x * x + y * y;
            uint8_t label = d < 0.7 ? (uint8_t)OC_LABEL_OBSTACLE : (uint8_t)OC_LABEL_GROUND;
            if (d < 0.7 && y > 0.3) label = OC_LABEL_UNKNOWN;
            if (r == 2 && c > 3 && c < 6) label = OC_LABEL_OBSTACLE;
            labels[r * n_cols + c] = label;
        }
    }
}

static inline oc_status_t example_silhouette(const oc_packet_head_t *packet, example_packet_t *out)
{
    static uint8_t labels[90 * 70];
    const oc_silhouette_t silhouette = {
        .view = 6, .key = 0xbeef, .box = 3, .step_px = 2, .col = 30, .row = 11, .n_cols = 90, .n_rows = 70};
    example_labels(90, 70, labels);
    return oc_packet_encode_silhouette(packet, &silhouette, labels, out->bytes, sizeof out->bytes, &out->n_bytes);
}

static inline oc_status_t example_silhouette_request(const oc_packet_head_t *packet, example_packet_t *out)
{
    oc_silhouette_request_t request = {.step_px = 2, .grow_percent = 15, .n_boxes = 3, .n_views = 14};
    for (int i = 0; i < request.n_boxes; i++) {
        request.boxes[i] = (oc_ground_box_t){.x_m = 1.25 * i - 2.0,
                                             .y_m = 0.5 - i,
                                             .length_m = 0.8 + 0.1 * i,
                                             .width_m = 0.4,
                                             .height_m = 0.65,
                                             .yaw_rad = 0.3 * i,
                                             .is_subject = i != 1};
    }
    for (int i = 0; i < request.n_views; i++) {
        request.views[i].view = (uint16_t)(3 * i);
        request.views[i].is_wanted = i % 3 != 0;
        for (int k = 0; k < 3; k++) {
            request.views[i].move_m[k] = 0.01 * (k - 1) * i;
            request.views[i].turn_rad[k] = 0.002 * (1 - k) * i;
        }
    }
    uint16_t key;
    return oc_packet_encode_silhouette_request(packet, &request, out->bytes, sizeof out->bytes, &out->n_bytes, &key);
}

static inline oc_status_t example_texture(const oc_packet_head_t *packet, example_packet_t *out)
{
    static const uint8_t bytes[] = {'R', 'I', 'F', 'F', 1, 2, 3, 4, 5};
    const oc_texture_t texture = {.view = 3,
                                  .step_px = 2,
                                  .tile_px = 64,
                                  .tile = 17,
                                  .codec = OC_CODEC_WEBP,
                                  .n_bytes = sizeof bytes,
                                  .bytes = bytes};
    return oc_packet_encode_texture(packet, &texture, out->bytes, sizeof out->bytes, &out->n_bytes);
}

static inline oc_status_t example_texture_request(const oc_packet_head_t *packet, bool is_cancelled,
                                                  example_packet_t *out)
{
    oc_texture_request_t request = {.view = 5,
                                    .is_cancelled = is_cancelled,
                                    .step_px = 2,
                                    .tile_px = 64,
                                    .quality = 40,
                                    .is_masked = true,
                                    .budget_bytes = 5000,
                                    .n_tiles = 9};
    for (int i = 0; i < 9; i++) request.tiles[i] = (uint16_t)(4 + i * 2);
    uint16_t taken;
    return oc_packet_encode_texture_request(packet, &request, out->bytes, sizeof out->bytes, &out->n_bytes, &taken);
}

/* Returns how many were made: N_EXAMPLES when all went well. */
static inline int example_packets(example_packet_t packets[N_EXAMPLES])
{
    const oc_packet_head_t head = {.vehicle = 2, .sequence = 0x1234};
    const oc_announce_t announce = {.view = 8, .utime_us = 1700000000000001};
    const oc_resend_request_t resend = {.view = 8, .parts = 5};
    const oc_recall_request_t recall = {.from_us = 1700000000000001, .to_us = 1700000030000000};
    static const char *const names[N_EXAMPLES] = {"view_200",
                                                  "view_mixed",
                                                  "view_empty",
                                                  "view_ties",
                                                  "patch_coarse",
                                                  "patch_fine",
                                                  "relabel",
                                                  "overhead",
                                                  "status",
                                                  "announce",
                                                  "image",
                                                  "resend",
                                                  "patch_request",
                                                  "overhead_request",
                                                  "recall",
                                                  "silhouette",
                                                  "silhouette_request",
                                                  "texture",
                                                  "texture_request",
                                                  "texture_cancel"};
    int n = 0;
    n += example_view(&head, 1, 200, 2, 0, false, &packets[0]) == OC_OK;
    n += example_view(&head, 2, 60, 6, 12, true, &packets[1]) == OC_OK;
    n += example_view(&head, 3, 0, 2, 0, false, &packets[2]) == OC_OK;
    n += example_view(&head, 4, 3, 3, 24, false, &packets[3]) == OC_OK;
    n += example_patch(&head, 6, 200, &packets[4]) == OC_OK;
    n += example_patch(&head, 26, 30, &packets[5]) == OC_OK;
    n += example_relabel(&head, &packets[6]) == OC_OK;
    n += example_overhead(&head, &packets[7]) == OC_OK;
    n += example_status(&head, &packets[8]) == OC_OK;
    n += oc_packet_encode_announce(&head, &announce, packets[9].bytes, OC_MAX_DATAGRAM_BYTES, &packets[9].n_bytes) ==
         OC_OK;
    n += example_image(&head, 5, &packets[10]) == OC_OK;
    n += oc_packet_encode_resend(&head, &resend, packets[11].bytes, OC_MAX_DATAGRAM_BYTES, &packets[11].n_bytes) ==
         OC_OK;
    n += example_patch_request(&head, &packets[12]) == OC_OK;
    n += example_overhead_request(&head, &packets[13]) == OC_OK;
    n += oc_packet_encode_recall(&head, &recall, packets[14].bytes, OC_MAX_DATAGRAM_BYTES, &packets[14].n_bytes) ==
         OC_OK;
    n += example_silhouette(&head, &packets[15]) == OC_OK;
    n += example_silhouette_request(&head, &packets[16]) == OC_OK;
    n += example_texture(&head, &packets[17]) == OC_OK;
    n += example_texture_request(&head, false, &packets[18]) == OC_OK;
    n += example_texture_request(&head, true, &packets[19]) == OC_OK;
    for (int i = 0; i < N_EXAMPLES; i++) {
        packets[i].name = names[i];
    }
    return n;
}

#endif
