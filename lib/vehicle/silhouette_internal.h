/* SPDX-License-Identifier: BSD-3-Clause
 * Inside of the silhouettes: projections of boxes, and the comparison of two views over the ground. */
#ifndef OUTCROP_VEHICLE_SILHOUETTE_INTERNAL_H
#define OUTCROP_VEHICLE_SILHOUETTE_INTERNAL_H

#include <stdbool.h>

#include "vehicle/silhouette.h"

/* Corners of a box, and so of its projection at most. */
#define OC_BOX_CORNERS 8u

/* Values of ws->mask: what a reference view knows of a pixel's ground point. */
enum { OC_SEES_NOTHING, OC_SEES_A_BOX, OC_SEES_GROUND };

/* Convex, counter-clockwise in y-down pixels, as the edges a x + b y + c >= 0. */
typedef struct oc_hull {
    uint32_t n;
    double x[OC_BOX_CORNERS], y[OC_BOX_CORNERS];
} oc_hull_t;

/* Projection of a box grown by a share of its largest side, on every side but the ground's. False when a corner is nearer than a hundredth of the box's
 * size, or behind. */
bool oc_hull_of_box(const oc_ground_box_t *box, double grow, const oc_camera_t *camera, oc_hull_t *hull);
bool oc_hull_contains(const oc_hull_t *hull, double x_px, double y_px);

/* First and last pixel centre of a row inside the hull; false when there is none. */
bool oc_hull_span(const oc_hull_t *hull, double y_px, double *x_from, double *x_to);

/* Bounding rectangle cut by the image; false when that is empty. */
bool oc_hull_rect(const oc_hull_t *hull, uint32_t width_px, uint32_t height_px, oc_pixel_rect_t *rect);

/* Bit map of width x height: bit x & 7 of byte (y * ((width + 7) / 8) + x / 8). */
void oc_boxes_clear(uint8_t *bits, uint32_t width_px, uint32_t height_px);
void oc_boxes_add(uint8_t *bits, uint32_t width_px, uint32_t height_px, const oc_hull_t *hull);
static inline bool oc_boxes_have(const uint8_t *bits, uint32_t width_px, uint32_t x, uint32_t y)
{
    return ((uint32_t)bits[(size_t)y * ((width_px + 7u) / 8u) + x / 8u] >> (x & 7u) & 1u) != 0;
}

/* One comparison: the rectangle of the view, and a reference. */
typedef struct oc_comparison {
    const oc_sight_t *view, *reference;
    double to_reference[9]; /* ground homography */
    oc_pixel_rect_t rect;
    oc_silhouette_method_t method;
} oc_comparison_t;

/* The view's own pixels of the rectangle, smoothed, and its grey ones; counts, differences and likenesses are emptied. */
void oc_compare_begin(oc_silhouette_ws_t *ws, const oc_sight_t *view, const oc_pixel_rect_t *rect);

/* Take in what one reference says. own_boxes must hold the view's boxes, ref_boxes those of the reference. False when
 * the two views share too little open ground to be evened. */
bool oc_compare_add(oc_silhouette_ws_t *ws, const oc_comparison_t *comparison);

#endif
