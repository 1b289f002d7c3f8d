/* SPDX-License-Identifier: BSD-3-Clause
 * Pictures from files: PNG and JPEG into a caller's RGB buffer. */
#ifndef OUTCROP_DAEMON_IMAGE_FILE_H
#define OUTCROP_DAEMON_IMAGE_FILE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/image.h"

/* Width and height of a picture without decoding it. False, and one line in
 * error that names the file, when it cannot be read or is neither format. */
bool oc_image_file_size(const char *path, uint32_t *width_px, uint32_t *height_px, char *error, size_t error_bytes);

/* Decode into out, which must have three channels and the picture's own size.
 * Used when playing a site folder; the decoders allocate. */
bool oc_image_file_read(const char *path, oc_image_mut_t *out, char *error, size_t error_bytes);

#endif
