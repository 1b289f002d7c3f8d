/* SPDX-License-Identifier: BSD-3-Clause
 * Motion JPEG frames to RGB with libjpeg-turbo, without the heap. */
#ifndef OUTCROP_DAEMON_MJPEG_H
#define OUTCROP_DAEMON_MJPEG_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/image.h"

typedef struct oc_mjpeg oc_mjpeg_t;

/* A decoder for frames of exactly this size; all memory is taken here. */
oc_mjpeg_t *oc_mjpeg_create(uint32_t width_px, uint32_t height_px);
void oc_mjpeg_destroy(oc_mjpeg_t *mjpeg);

/* Decode one frame to RGB, borrowed until the next call. False, and one line
 * in error, when it is cut, damaged in any way that libjpeg notices, of
 * another size, progressive or otherwise not what a camera sends; bytes after
 * the end-of-image marker are no fault (drivers pad). Frames without Huffman
 * tables get the standard ones. */
bool oc_mjpeg_decode(oc_mjpeg_t *mjpeg, const uint8_t *bytes, size_t n_bytes, oc_image_t *image, char *error,
                     size_t error_bytes);

#endif
