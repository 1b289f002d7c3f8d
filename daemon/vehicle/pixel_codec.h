/* SPDX-License-Identifier: BSD-3-Clause
 * Colour pictures into bytes: WebP for ground tiles, JPEG or WebP for whole frames.
 * The codecs allocate, and they run in the daemon's one thread: for a tile when no frame and no other packet is due,
 * for a whole frame (the null rival) when it is taken. No call into lib/vehicle is under way then. */
#ifndef OUTCROP_DAEMON_PIXEL_CODEC_H
#define OUTCROP_DAEMON_PIXEL_CODEC_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/image.h"
#include "core/packet.h"

/* Encode at a quality of 1..100. The bytes are malloc'ed; free them with
 * oc_pixel_free. False when the codec fails. */
bool oc_pixel_encode(const oc_image_t *image, oc_codec_t codec, int quality, uint8_t **bytes, size_t *n_bytes);
void oc_pixel_free(oc_codec_t codec, uint8_t *bytes);

/* WebP at the best quality <= `quality` with which the picture takes at most
 * cap bytes (bisection). False when even quality 0 is too big. */
bool oc_pixel_encode_within(const oc_image_t *image, int quality, uint8_t *out, size_t cap, size_t *n_bytes);

#endif
