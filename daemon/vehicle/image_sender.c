/* SPDX-License-Identifier: BSD-3-Clause
 * Whole keyframes as pieces. All pieces but the last of a keyframe have the same size, so a piece number says its
 * offset and a resend gives the same cut again. */
#include "image_sender.h"

#include <stdlib.h>

#include "pixel_codec.h"

/* Pieces of one keyframe that can be asked for one by one; further ones come with a full resend. */
#define RESEND_BITS 32u

/* The number of a piece has 8 bits on the wire. */
#define MAX_PIECES 256u

typedef struct stored_image {
    bool is_used;
    oc_view_head_t head;
    uint8_t *bytes;
    size_t n_bytes;
    size_t piece_bytes;  /* of every piece but the last */
    uint32_t next_piece; /* first pass */
    bool is_sent;        /* first pass done */
    uint32_t resend;     /* bit i: piece i is to go out again */
} stored_image_t;

struct oc_image_sender {
    stored_image_t *images;
    uint32_t n_images, newest, datagram_bytes;
    oc_codec_t codec;
    int quality;
};

oc_image_sender_t *oc_image_sender_create(uint32_t views, oc_codec_t codec, int quality, uint32_t datagram_bytes)
{
    oc_image_sender_t *sender = calloc(1, sizeof *sender);
    if (!sender) return NULL;
    sender->images = calloc(views, sizeof *sender->images);
    sender->n_images = views;
    sender->codec = codec;
    sender->quality = quality;
    sender->datagram_bytes = datagram_bytes;
    if (sender->images) return sender;
    free(sender);
    return NULL;
}

static void stored_release(oc_image_sender_t *sender, stored_image_t *image)
{
    if (image->is_used) oc_pixel_free(sender->codec, image->bytes);
    image->is_used = false;
}

void oc_image_sender_destroy(oc_image_sender_t *sender)
{
    if (!sender) return;
    for (uint32_t i = 0; i < sender->n_images; i++) stored_release(sender, &sender->images[i]);
    free(sender->images);
    free(sender);
}

static bool stored_cut(const oc_image_sender_t *sender, const stored_image_t *image, uint32_t piece,
                       const oc_packet_head_t *packet, uint8_t *buf, size_t *n_bytes, uint16_t *taken)
{
    const size_t offset = piece * image->piece_bytes;
    if (piece >= MAX_PIECES || offset >= image->n_bytes) return false;
    size_t left = image->n_bytes - offset;
    if (image->piece_bytes && left > image->piece_bytes) left = image->piece_bytes;
    if (left > OC_MAX_DATAGRAM_BYTES) left = OC_MAX_DATAGRAM_BYTES;
    oc_image_piece_t cut = {.head = image->head,
                            .codec = (uint8_t)sender->codec,
                            .total_bytes = (uint32_t)image->n_bytes,
                            .offset_bytes = (uint32_t)offset,
                            .n_bytes = (uint16_t)left,
                            .bytes = image->bytes + offset};
    cut.head.part = (uint8_t)piece;
    return oc_packet_encode_image(packet, &cut, buf, sender->datagram_bytes, n_bytes, taken) == OC_OK;
}

bool oc_image_sender_push(oc_image_sender_t *sender, const oc_view_head_t *head, const oc_image_t *image)
{
    stored_image_t fresh = {.is_used = true, .head = *head};
    if (!oc_pixel_encode(image, sender->codec, sender->quality, &fresh.bytes, &fresh.n_bytes)) return false;
    /* The first piece says how much goes into each. */
    const oc_packet_head_t packet = {.type = OC_PACKET_IMAGE};
    uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    size_t n_bytes = 0;
    uint16_t taken = 0;
    if (!stored_cut(sender, &fresh, 0, &packet, buf, &n_bytes, &taken) || fresh.n_bytes > (size_t)taken * MAX_PIECES) {
        stored_release(sender, &fresh);
        return false;
    }
    fresh.piece_bytes = taken;
    sender->newest = (sender->newest + 1) % sender->n_images;
    stored_release(sender, &sender->images[sender->newest]);
    sender->images[sender->newest] = fresh;
    return true;
}

bool oc_image_sender_resend(oc_image_sender_t *sender, const oc_resend_request_t *request)
{
    for (uint32_t i = 0; i < sender->n_images; i++) {
        stored_image_t *image = &sender->images[i];
        if (!image->is_used || image->head.view != request->view) continue;
        if (request->parts == UINT32_MAX) {
            image->is_sent = false;
            image->next_piece = 0;
        } else {
            image->resend |= request->parts;
        }
        return true;
    }
    return false;
}

static bool stored_next(const oc_image_sender_t *sender, stored_image_t *image, const oc_packet_head_t *packet,
                        uint8_t *buf, size_t *n_bytes)
{
    uint16_t taken;
    if (!image->is_sent) {
        if (stored_cut(sender, image, image->next_piece, packet, buf, n_bytes, &taken)) {
            image->next_piece++;
            image->is_sent = image->next_piece * image->piece_bytes >= image->n_bytes;
            return true;
        }
        image->is_sent = true;
    }
    for (uint32_t i = 0; i < RESEND_BITS && image->resend; i++) {
        if (!(image->resend >> i & 1u)) continue;
        image->resend &= ~(1u << i);
        if (stored_cut(sender, image, i, packet, buf, n_bytes, &taken)) return true;
    }
    return false;
}

bool oc_image_sender_has_next(const oc_image_sender_t *sender)
{
    for (uint32_t i = 0; i < sender->n_images; i++) {
        const stored_image_t *image = &sender->images[i];
        if (image->is_used && (!image->is_sent || image->resend != 0)) return true;
    }
    return false;
}

bool oc_image_sender_next(oc_image_sender_t *sender, const oc_packet_head_t *packet, uint8_t *buf, size_t *n_bytes)
{
    for (uint32_t back = 0; back < sender->n_images; back++) {
        const uint32_t slot = (sender->newest + sender->n_images - back) % sender->n_images;
        stored_image_t *image = &sender->images[slot];
        if (image->is_used && stored_next(sender, image, packet, buf, n_bytes)) return true;
    }
    return false;
}
