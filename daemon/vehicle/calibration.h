/* SPDX-License-Identifier: BSD-3-Clause
 * Camera calibration files: ROS camera_info YAML and OpenCV FileStorage YAML, read and written. */
#ifndef OUTCROP_DAEMON_CALIBRATION_H
#define OUTCROP_DAEMON_CALIBRATION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>

#include "lens.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef enum oc_calibration_form { OC_CALIBRATION_ROS, OC_CALIBRATION_OPENCV } oc_calibration_form_t;

typedef struct oc_calibration {
    char camera_name[64]; /* "" = not told */
    oc_lens_t lens;       /* rectified: from the projection_matrix when there is one, else as raw */
} oc_calibration_t;

/* Read a file of either form, at most 64 kB, one document without aliases;
 * OpenCV's "%YAML:1.0" head is understood. Unknown keys are skipped.
 *
 * image_width, image_height; camera_name
 * camera_matrix or K       fx 0 cx, 0 fy cy, 0 0 1; OpenCV 2's Camera_Matrix and the like as well
 * distortion_model         plumb_bob, rational_polynomial, equidistant, fisheye; or fisheye_model 0 or 1
 *                          (OpenCV); plumb_bob when neither is there
 * distortion_coefficients or D
 *                          k1 k2 p1 p2 k3, missing ones 0, and what follows must be 0; a fisheye has 4.
 *                          All zero but for a fisheye: OC_LENS_PINHOLE
 * rectification_matrix     the identity within 1e-6: not that of a stereo pair
 * projection_matrix        gives lens.rectified. Its fourth column, the baseline of a stereo pair, says
 *                          nothing about this camera's picture and is ignored
 *
 * Rectified and raw pictures have the same size. Without a projection_matrix
 * they share focal length and centre, for a fisheye too: its outer parts are
 * then cut off. False and one line "FILE:LINE: ..." in error ("FILE: ..." for
 * what concerns the whole file) otherwise, and *calibration is as before. */
bool oc_calibration_read(const char *path, oc_calibration_t *calibration, char *error, size_t error_bytes);

/* Write in the given form; reads back to the same bits (a plumb-bob of zeros as
 * a pinhole). OpenCV's has a projection_matrix only where rectified differs from
 * raw. False when the lens is not valid, its two sizes differ, which neither
 * form can tell, the name has control characters, or writing failed. In the C locale. */
bool oc_calibration_write(FILE *out, const oc_calibration_t *calibration, oc_calibration_form_t form);

#ifdef __cplusplus
}
#endif
#endif
