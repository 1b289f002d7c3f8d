/* SPDX-License-Identifier: BSD-3-Clause
 * Camera calibration files: ROS camera_info YAML and OpenCV FileStorage YAML, read and written. */
#ifndef OUTCROP_DAEMON_CALIBRATION_H
#define OUTCROP_DAEMON_CALIBRATION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "lens.h"

typedef enum oc_calibration_form { OC_CALIBRATION_ROS, OC_CALIBRATION_OPENCV } oc_calibration_form_t;

typedef struct oc_calibration {
    char camera_name[64]; /* "" = not told */
    oc_lens_t lens;       /* rectified: from ROS' projection_matrix when there is one, else raw without distortion */
} oc_calibration_t;

/* Read a file of either form (told apart by its keys; OpenCV's "%YAML:1.0"
 * head is understood). ROS: image_width, image_height, camera_matrix,
 * distortion_model (plumb_bob, rational_polynomial with k4..k6 = 0, equidistant, fisheye),
 * distortion_coefficients, projection_matrix; rectification_matrix must be the
 * identity. OpenCV: image_width / image_height (or nx, ny ... as its calibration sample writes),
 * camera_matrix or K, distortion_coefficients or D, and fisheye told by `distortion_model`
 * or `fisheye_model`. False and one line "FILE:LINE: ..." in error otherwise. */
bool oc_calibration_read(const char *path, oc_calibration_t *calibration, char *error, size_t error_bytes);

/* Write in the given form; reads back to the same bits. */
bool oc_calibration_write(FILE *out, const oc_calibration_t *calibration, oc_calibration_form_t form);

#endif
