/* SPDX-License-Identifier: BSD-3-Clause
 * Keyframe policy: which frames of a stream are worth becoming views. */
#ifndef OUTCROP_VEHICLE_KEYFRAME_H
#define OUTCROP_VEHICLE_KEYFRAME_H

#include <stdbool.h>

#include "core/camera.h"
#include "core/image.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct oc_keyframe_params {
    double min_move_m;    /* camera centre since the last keyframe, 0..1000; default 0.4 */
    double min_turn_rad;  /* rotation since the last keyframe, 0..pi; default 0.26 */
    float min_sharpness;  /* share of the running mean of sharpness, 0..1; 0 = any; default 0.6 */
    float sharpness_gain; /* weight of the newest frame in the running mean, 0.001..1; default 0.1 */
} oc_keyframe_params_t;

/* State of the policy of one camera. */
typedef struct oc_keyframe {
    oc_keyframe_params_t params;
    bool has_last;
    oc_pose_t last;       /* of the last keyframe */
    float mean_sharpness; /* negative before the first frame */
} oc_keyframe_t;

oc_keyframe_params_t oc_keyframe_defaults(void);

/* Every field in its range. */
bool oc_keyframe_params_are_valid(const oc_keyframe_params_t *params);

void oc_keyframe_init(oc_keyframe_t *policy, const oc_keyframe_params_t *params);

/* Mean squared Laplacian of a grey image, grey levels squared; every second
 * pixel of every second row. Comparable between frames of one camera. */
float oc_keyframe_sharpness(const oc_image_t *grey);

/* Take note of a frame and say whether it becomes a keyframe: the first one,
 * or moved or turned enough and not blurred. A camera that has moved or turned
 * twice the least amount is taken even when blurred, so that a dull stretch of
 * road cannot starve the base. Does not yet make it the last one. */
bool oc_keyframe_wants(oc_keyframe_t *policy, const oc_pose_t *pose, float sharpness);

/* The frame at this pose has become a keyframe (asked for or forced). */
void oc_keyframe_accept(oc_keyframe_t *policy, const oc_pose_t *pose);

#ifdef __cplusplus
}
#endif
#endif
