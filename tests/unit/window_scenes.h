/* SPDX-License-Identifier: BSD-3-Clause
 * The three pairs of the thesis on which windows and strips are tested, with
 * its margins: shared by test_window and test_window_coverage.
 */
#ifndef OUTCROP_UNIT_WINDOW_SCENES_H
#define OUTCROP_UNIT_WINDOW_SCENES_H

#include "unity.h"

#include "core/window.h"
#include "thesis_tables.h"

#define SIGMA_PX 0.5

/* The pairs on which coverage is measured: thesis_pairs index, angle margin in
 * degrees, centre and half-width of the scene and its height in metres. */
typedef struct scene {
    int pair;
    double margin_deg, centre_x, centre_y, half, height;
} scene_t;

static const scene_t scenes[3] = {
    {0, 0.8, 0.0, 0.0, 0.6, 0.5}, {1, 0.8, 0.05, 0.0, 0.1, 0.08}, {3, 1.0, 0.17, 0.15, 0.35, 0.19}};

static oc_camera_t left, right;
static oc_margin_t margin;
static oc_pair_t pair;
static oc_pair_thesis_t thesis;

static inline void use_scene(const scene_t *scene)
{
    const oc_test_pair_t *p = &thesis_pairs[scene->pair];
    left = oc_test_camera(p->table, p->left);
    right = oc_test_camera(p->table, p->right);
    for (int i = 0; i < 6; i++) margin.v[i] = i < 3 ? 0.010 : OC_TEST_RAD(scene->margin_deg);
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare(&pair, &left, &margin, &right, &margin, OC_ANGLE_ERROR_OPK, SIGMA_PX));
    TEST_ASSERT_EQUAL(OC_OK, oc_pair_prepare_thesis(&thesis, &left, &margin, &right, &margin));
}

static inline oc_camera_t with_errors(const oc_camera_t *camera, const double error[6])
{
    oc_camera_t out = *camera;
    oc_pose6_t six;
    oc_pose_to_6(&camera->pose, &six);
    for (int i = 0; i < 6; i++) six.v[i] += error[i];
    oc_pose_from_6(&six, &out.pose);
    return out;
}

#endif
