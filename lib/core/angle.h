/* SPDX-License-Identifier: BSD-3-Clause
 * Angles with the same bits on every machine: libm's atan2f and cosf differ between processors in the last place. */
#ifndef OUTCROP_CORE_ANGLE_H
#define OUTCROP_CORE_ANGLE_H

#ifdef __cplusplus
extern "C" {
#endif

/* Direction of (x, y) in (-pi, pi], as atan2f to within 1 unit in the last
 * place; 0 for (0, 0), not a number when either is. */
float oc_angle_of(float y, float x);

/* Cosine, |angle_rad| <= 7, to within 1e-7; beyond that not a number. */
float oc_angle_cos(float angle_rad);

#ifdef __cplusplus
}
#endif
#endif
