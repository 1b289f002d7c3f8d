/* SPDX-License-Identifier: BSD-3-Clause
 * Keyframe policy: which frames of a stream are worth becoming views. */
#include "vehicle/keyframe.h"

#include <math.h>

#define PI 3.14159265358979323846

oc_keyframe_params_t oc_keyframe_defaults(void)
{
    return (oc_keyframe_params_t){
        .min_move_m = 0.4, .min_turn_rad = 0.26, .min_sharpness = 0.6f, .sharpness_gain = 0.1f};
}

bool oc_keyframe_params_are_valid(const oc_keyframe_params_t *params)
{
    OC_ASSERT(params);
    return params->min_move_m >= 0.0 && params->min_move_m <= 1000.0 && params->min_turn_rad >= 0.0 &&
           params->min_turn_rad <= PI && params->min_sharpness >= 0.0f && params->min_sharpness <= 1.0f &&
           params->sharpness_gain >= 0.001f && params->sharpness_gain <= 1.0f;
}

void oc_keyframe_init(oc_keyframe_t *policy, const oc_keyframe_params_t *params)
{
    OC_ASSERT(policy && params);
    *policy = (oc_keyframe_t){.params = *params, .has_last = false, .mean_sharpness = -1.0f};
}

float oc_keyframe_sharpness(const oc_image_t *grey)
{
    OC_ASSERT(grey && grey->channels == 1);

    const size_t stride = grey->stride_bytes;
    double sum = 0.0;
    uint32_t n = 0;
    for (uint32_t y = 1; y + 1 < grey->height_px; y += 2) {
        const uint8_t *row = grey->px + (size_t)y * stride;
        int64_t row_sum = 0;
        for (uint32_t x = 1; x + 1 < grey->width_px; x += 2) {
            const int32_t around = row[x - 1] + row[x + 1] + (row - stride)[x] + (row + stride)[x];
            const int32_t laplacian = around - 4 * row[x];
            row_sum += laplacian * laplacian;
            n++;
        }
        sum += (double)row_sum;
    }
    return n == 0 ? 0.0f : (float)(sum / n);
}

static double turn_between(const oc_pose_t *a, const oc_pose_t *b)
{
    /* trace of R_a R_b^T = sum of the products of the elements */
    double trace = 0.0;
    for (int i = 0; i < 9; i++) trace += a->R[i] * b->R[i];
    const double c = 0.5 * (trace - 1.0);
    return acos(c > 1.0 ? 1.0 : (c < -1.0 ? -1.0 : c));
}

static double move_between(const oc_pose_t *a, const oc_pose_t *b)
{
    double ca[3], cb[3];
    oc_pose_centre(a, ca);
    oc_pose_centre(b, cb);
    const double dx = ca[0] - cb[0], dy = ca[1] - cb[1], dz = ca[2] - cb[2];
    return sqrt(dx * dx + dy * dy + dz * dz);
}

bool oc_keyframe_wants(oc_keyframe_t *policy, const oc_pose_t *pose, float sharpness)
{
    OC_ASSERT(policy && pose);

    const oc_keyframe_params_t *p = &policy->params;
    /* Judge against the mean of earlier frames; then let this one into it. */
    const bool is_sharp = policy->mean_sharpness < 0.0f || sharpness >= p->min_sharpness * policy->mean_sharpness;
    if (policy->mean_sharpness < 0.0f) policy->mean_sharpness = sharpness;
    policy->mean_sharpness += p->sharpness_gain * (sharpness - policy->mean_sharpness);

    if (!policy->has_last) return true;
    const double move_m = move_between(pose, &policy->last);
    const double turn_rad = turn_between(pose, &policy->last);
    if (!(move_m >= p->min_move_m || turn_rad >= p->min_turn_rad)) return false;
    return is_sharp || move_m >= 2.0 * p->min_move_m || turn_rad >= 2.0 * p->min_turn_rad;
}

void oc_keyframe_accept(oc_keyframe_t *policy, const oc_pose_t *pose)
{
    OC_ASSERT(policy && pose);
    policy->has_last = true;
    policy->last = *pose;
}
