/* SPDX-License-Identifier: BSD-3-Clause
 * Inside core only: a camera with one parameter moved, for the files that
 * differentiate over margins.
 */
#ifndef OUTCROP_CORE_PAIR_H
#define OUTCROP_CORE_PAIR_H

#include "core/window.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Parameter i (0..2 centre, 3..5 angles) moved by delta. */
void oc_pair_move_camera(const oc_camera_t *camera, int i, double delta, oc_angle_error_t angles, oc_camera_t *moved);

/* Valid cameras, margins in range, no camera that its margin may put into the
 * ground. */
OC_CHECKED oc_status_t oc_pair_check(const oc_camera_t *left, const oc_margin_t *left_margin, const oc_camera_t *right,
                                     const oc_margin_t *right_margin);

#ifdef __cplusplus
}
#endif
#endif
