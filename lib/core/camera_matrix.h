/* SPDX-License-Identifier: BSD-3-Clause
 * M = K R of a camera and its inverse, for the geometry files of core.
 */
#ifndef OUTCROP_CORE_CAMERA_MATRIX_H
#define OUTCROP_CORE_CAMERA_MATRIX_H

#include "core/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/* M = K R: pixel ~ M (X - C). */
static inline void oc_camera_M(const oc_camera_t *camera, double M[9])
{
    const oc_intrinsics_t *k = &camera->k;
    const double *R = camera->pose.R;
    for (int c = 0; c < 3; c++) {
        M[c] = k->fx_px * R[c] + k->cx_px * R[6 + c];
        M[3 + c] = k->fy_px * R[3 + c] + k->cy_px * R[6 + c];
        M[6 + c] = R[6 + c];
    }
}

/* M^-1 = R^T K^-1: M^-1 (x, y, 1) is the world direction with depth 1. */
static inline void oc_camera_M_inverse(const oc_camera_t *camera, double M_inv[9])
{
    const oc_intrinsics_t *k = &camera->k;
    const double *R = camera->pose.R;
    for (int r = 0; r < 3; r++) {
        M_inv[3 * r] = R[r] / k->fx_px;
        M_inv[3 * r + 1] = R[3 + r] / k->fy_px;
        M_inv[3 * r + 2] = R[6 + r] - M_inv[3 * r] * k->cx_px - M_inv[3 * r + 1] * k->cy_px;
    }
}

#ifdef __cplusplus
}
#endif
#endif
