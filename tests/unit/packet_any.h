/* SPDX-License-Identifier: BSD-3-Clause
 * Any packet decoded by its type, into static storage. */
#ifndef OUTCROP_TESTS_PACKET_ANY_H
#define OUTCROP_TESTS_PACKET_ANY_H

#include "core/packet.h"

/* Room for the labels of the tests' silhouettes; larger ones count as ill-formed here. */
#define ANY_CELLS 16384u

typedef struct any_silhouette {
    oc_silhouette_t head;
    uint8_t labels[ANY_CELLS];
} any_silhouette_t;

typedef union any_body {
    oc_view_part_t view;
    oc_patch_t patch;
    oc_relabel_t relabel;
    oc_overhead_t overhead;
    oc_image_piece_t image;
    oc_announce_t announce;
    oc_vehicle_status_t status;
    oc_resend_request_t resend;
    oc_patch_request_t patch_request;
    oc_overhead_request_t overhead_request;
    oc_recall_request_t recall;
    any_silhouette_t silhouette;
    oc_texture_t texture;
    oc_silhouette_request_t silhouette_request;
    oc_texture_request_t texture_request;
} any_body_t;

static inline oc_status_t any_decode_silhouette(const uint8_t *buf, size_t n_bytes, any_silhouette_t *out)
{
    const oc_status_t status = oc_packet_decode_silhouette(buf, n_bytes, &out->head, out->labels, ANY_CELLS);
    return status == OC_E_SPACE ? OC_E_FORMAT : status;
}

static inline oc_status_t any_decode_as(unsigned type, const uint8_t *buf, size_t n_bytes, any_body_t *body)
{
    switch (type) {
    case OC_PACKET_VIEW: return oc_packet_decode_view(buf, n_bytes, &body->view);
    case OC_PACKET_PATCH: return oc_packet_decode_patch(buf, n_bytes, &body->patch);
    case OC_PACKET_RELABEL: return oc_packet_decode_relabel(buf, n_bytes, &body->relabel);
    case OC_PACKET_OVERHEAD: return oc_packet_decode_overhead(buf, n_bytes, &body->overhead);
    case OC_PACKET_IMAGE: return oc_packet_decode_image(buf, n_bytes, &body->image);
    case OC_PACKET_ANNOUNCE: return oc_packet_decode_announce(buf, n_bytes, &body->announce);
    case OC_PACKET_STATUS: return oc_packet_decode_status(buf, n_bytes, &body->status);
    case OC_PACKET_RESEND_REQUEST: return oc_packet_decode_resend(buf, n_bytes, &body->resend);
    case OC_PACKET_PATCH_REQUEST: return oc_packet_decode_patch_request(buf, n_bytes, &body->patch_request);
    case OC_PACKET_OVERHEAD_REQUEST: return oc_packet_decode_overhead_request(buf, n_bytes, &body->overhead_request);
    case OC_PACKET_RECALL_REQUEST: return oc_packet_decode_recall(buf, n_bytes, &body->recall);
    case OC_PACKET_SILHOUETTE: return any_decode_silhouette(buf, n_bytes, &body->silhouette);
    case OC_PACKET_TEXTURE: return oc_packet_decode_texture(buf, n_bytes, &body->texture);
    case OC_PACKET_SILHOUETTE_REQUEST:
        return oc_packet_decode_silhouette_request(buf, n_bytes, &body->silhouette_request);
    case OC_PACKET_TEXTURE_REQUEST: return oc_packet_decode_texture_request(buf, n_bytes, &body->texture_request);
    default: return OC_E_FORMAT;
    }
}

#endif
