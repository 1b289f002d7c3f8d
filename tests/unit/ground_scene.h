/* SPDX-License-Identifier: BSD-3-Clause
 * A scene with known truth for the tests of the ground filter and the vehicle:
 * a textured ground plane and boxes, ray-cast exactly.
 *
 * Textures are a function of the place on the surface, so two renderings of one
 * place agree but for the pixel grid; 3x3 samples a pixel. */
#ifndef OUTCROP_UNIT_GROUND_SCENE_H
#define OUTCROP_UNIT_GROUND_SCENE_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#include "core/camera.h"
#include "core/image.h"
#include "core/junction.h"

#define OC_SCENE_MAX_BOXES 2
#define OC_SCENE_SKY 90.0

typedef struct oc_scene {
    double ground_z_m; /* where the textured plane really is */
    double cell_m;     /* of the texture */
    int n_boxes;
    double box_min_m[OC_SCENE_MAX_BOXES][3], box_max_m[OC_SCENE_MAX_BOXES][3];
} oc_scene_t;

/* Face of the ground, of the sky. Faces of box b are 8 (b + 1) + 2 axis + side. */
#define OC_SCENE_FACE_GROUND 1
#define OC_SCENE_FACE_SKY 0

static inline uint32_t oc_scene_hash(int32_t a, int32_t b, int32_t c)
{
    uint32_t h = (uint32_t)a * 0x8da6b343u ^ (uint32_t)b * 0xd8163841u ^ (uint32_t)c * 0xcb1ab31fu;
    h ^= h >> 15;
    h *= 0x2c1b3c6du;
    h ^= h >> 12;
    h *= 0x297a2d39u;
    return h ^ h >> 15;
}

/* Quadrilaterals of random grey: two grids, turned against each other. */
static inline double oc_scene_texture(int face, double cell, double u, double v)
{
    const double c = cos(0.6), s = sin(0.6), fine = 1.7 / cell;
    const uint32_t coarse = oc_scene_hash((int32_t)floor(u / cell), (int32_t)floor(v / cell), face);
    const uint32_t other =
        oc_scene_hash((int32_t)floor((c * u + s * v) * fine), (int32_t)floor((c * v - s * u) * fine), face + 77);
    return 30.0 + (double)(coarse % 128u) + ((other % 100u) < 35u ? (double)(other / 128u % 90u) : 0.0);
}

/* Nearest box along the ray; its face and where, or 0. */
static inline int oc_scene_box_hit(const oc_scene_t *scene, const double from[3], const double ray[3], double *depth)
{
    int face = OC_SCENE_FACE_SKY;
    for (int b = 0; b < scene->n_boxes; b++) {
        double near = 0.0, far = (double)INFINITY;
        int entered = 0;
        for (int k = 0; k < 3; k++) {
            const double a = (scene->box_min_m[b][k] - from[k]) / ray[k],
                         z = (scene->box_max_m[b][k] - from[k]) / ray[k];
            if (fmin(a, z) > near) {
                near = fmin(a, z);
                entered = 2 * k + (a > z);
            }
            far = fmin(far, fmax(a, z));
        }
        if (near < far && near > 0.0 && near < *depth) {
            *depth = near;
            face = 8 * (b + 1) + entered;
        }
    }
    return face;
}

/* What a pixel's ray hits first: the face, and the point in the world. */
static inline int oc_scene_hit(const oc_scene_t *scene, const oc_camera_t *camera, double x_px, double y_px,
                               double point[3])
{
    double from[3], ray[3], depth = (double)INFINITY;
    oc_pose_centre(&camera->pose, from);
    oc_camera_ray(camera, x_px, y_px, ray);
    int face = OC_SCENE_FACE_SKY;
    if (ray[2] < -1e-9) {
        depth = (scene->ground_z_m - from[2]) / ray[2];
        face = OC_SCENE_FACE_GROUND;
    }
    const int box = oc_scene_box_hit(scene, from, ray, &depth);
    if (box != OC_SCENE_FACE_SKY) face = box;
    for (int k = 0; k < 3; k++) point[k] = from[k] + depth * ray[k];
    return face;
}

static inline double oc_scene_value(const oc_scene_t *scene, const oc_camera_t *camera, double x_px, double y_px)
{
    double p[3];
    const int face = oc_scene_hit(scene, camera, x_px, y_px, p);
    if (face == OC_SCENE_FACE_SKY) return OC_SCENE_SKY;
    if (face == OC_SCENE_FACE_GROUND) return oc_scene_texture(face, scene->cell_m, p[0], p[1]);
    const int axis = (face & 7) / 2;
    return oc_scene_texture(face, scene->cell_m, p[(axis + 1) % 3], p[(axis + 2) % 3]);
}

/* px has width * height bytes, no padding. */
static inline oc_image_t oc_scene_render(const oc_scene_t *scene, const oc_camera_t *camera, uint8_t *px)
{
    const uint32_t w = camera->k.width_px, h = camera->k.height_px;
    for (uint32_t y = 0; y < h; y++) {
        for (uint32_t x = 0; x < w; x++) {
            double sum = 0.0;
            for (int s = 0; s < 9; s++) {
                sum += oc_scene_value(scene, camera, x + (s % 3 - 1) / 3.0, y + (s / 3 - 1) / 3.0);
            }
            px[(size_t)y * w + x] = (uint8_t)(sum / 9.0 + 0.5);
        }
    }
    const oc_image_t image = {px, w, h, w, 1};
    return image;
}

/* OC_LABEL_GROUND when nothing but ground is within 2 px, OC_LABEL_OBSTACLE
 * when a box is, OC_LABEL_UNKNOWN beside the sky. */
static inline oc_label_t oc_scene_truth(const oc_scene_t *scene, const oc_camera_t *camera, const oc_junction_t *j)
{
    oc_label_t label = OC_LABEL_GROUND;
    for (int dy = -2; dy <= 2; dy++) {
        for (int dx = -2; dx <= 2; dx++) {
            double p[3];
            const int face = oc_scene_hit(scene, camera, (double)j->x_px + dx, (double)j->y_px + dy, p);
            if (face >= 8) return OC_LABEL_OBSTACLE;
            if (face == OC_SCENE_FACE_SKY) label = OC_LABEL_UNKNOWN;
        }
    }
    return label;
}

/* Height of the highest box point within 2 px of a junction; 0 when there is none. */
static inline double oc_scene_height_m(const oc_scene_t *scene, const oc_camera_t *camera, const oc_junction_t *j)
{
    double highest = 0.0;
    for (int dy = -2; dy <= 2; dy++) {
        for (int dx = -2; dx <= 2; dx++) {
            double p[3];
            const int face = oc_scene_hit(scene, camera, (double)j->x_px + dx, (double)j->y_px + dy, p);
            if (face >= 8 && p[2] > highest) highest = p[2];
        }
    }
    return highest;
}

#endif
