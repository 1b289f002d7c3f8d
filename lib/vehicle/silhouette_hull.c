/* SPDX-License-Identifier: BSD-3-Clause
 * Projections of boxes: a ray to the ground meets a box that stands on it exactly when its pixel lies inside. */
#include <math.h>
#include <string.h>

#include "vehicle/silhouette_internal.h"

/* Depth of the nearest corner, of the box's diagonal. */
#define NEAR_SHARE 0.01

static double cross(const double *x, const double *y, uint32_t a, uint32_t b, double px, double py)
{
    return (x[b] - x[a]) * (py - y[a]) - (y[b] - y[a]) * (px - x[a]);
}

/* Andrew's monotone chain on at most eight points. */
static void hull_make(const double px[OC_BOX_CORNERS], const double py[OC_BOX_CORNERS], oc_hull_t *hull)
{
    uint32_t order[OC_BOX_CORNERS];
    for (uint32_t i = 0; i < OC_BOX_CORNERS; i++) {
        uint32_t at = i;
        while (at > 0 && (px[order[at - 1]] > px[i] || (px[order[at - 1]] == px[i] && py[order[at - 1]] > py[i]))) {
            order[at] = order[at - 1];
            at--;
        }
        order[at] = i;
    }
    double x[2 * OC_BOX_CORNERS], y[2 * OC_BOX_CORNERS];
    uint32_t n = 0;
    for (uint32_t i = 0; i < OC_BOX_CORNERS; i++) {
        while (n >= 2 && cross(x, y, n - 2, n - 1, px[order[i]], py[order[i]]) <= 0.0) n--;
        x[n] = px[order[i]];
        y[n++] = py[order[i]];
    }
    const uint32_t lower = n + 1;
    for (uint32_t i = OC_BOX_CORNERS - 1; i-- > 0;) {
        while (n >= lower && cross(x, y, n - 2, n - 1, px[order[i]], py[order[i]]) <= 0.0) n--;
        x[n] = px[order[i]];
        y[n++] = py[order[i]];
    }
    hull->n = n - 1 < OC_BOX_CORNERS ? n - 1 : OC_BOX_CORNERS;
    memcpy(hull->x, x, hull->n * sizeof hull->x[0]);
    memcpy(hull->y, y, hull->n * sizeof hull->y[0]);
}

bool oc_hull_of_box(const oc_ground_box_t *box, double grow, const oc_camera_t *camera, oc_hull_t *hull)
{
    const double c = cos(box->yaw_rad), s = sin(box->yaw_rad);
    const double more = grow * fmax(fmax(box->length_m, box->width_m), box->height_m);
    const double half_length = 0.5 * box->length_m + more, half_width = 0.5 * box->width_m + more;
    const double height = box->height_m + more;
    const double near_m = NEAR_SHARE * sqrt(half_length * half_length + half_width * half_width + height * height);
    double x[OC_BOX_CORNERS], y[OC_BOX_CORNERS];
    for (uint32_t i = 0; i < OC_BOX_CORNERS; i++) {
        const double along = (i & 1u) ? half_length : -half_length, across = (i & 2u) ? half_width : -half_width;
        const double corner[3] = {box->x_m + c * along - s * across, box->y_m + s * along + c * across,
                                  (i & 4u) ? height : 0.0};
        if (!(oc_camera_project(camera, corner, &x[i], &y[i]) > near_m)) return false;
    }
    hull_make(x, y, hull);
    return hull->n >= 3;
}

bool oc_hull_contains(const oc_hull_t *hull, double x_px, double y_px)
{
    for (uint32_t i = 0; i < hull->n; i++) {
        if (cross(hull->x, hull->y, i, (i + 1u) % hull->n, x_px, y_px) < 0.0) return false;
    }
    return true;
}

bool oc_hull_span(const oc_hull_t *hull, double y_px, double *x_from, double *x_to)
{
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (uint32_t i = 0; i < hull->n; i++) {
        const uint32_t j = (i + 1u) % hull->n;
        const double ya = hull->y[i], yb = hull->y[j];
        if ((ya < y_px && yb < y_px) || (ya > y_px && yb > y_px)) continue;
        const double t = ya == yb ? 0.0 : (y_px - ya) / (yb - ya);
        const double x = hull->x[i] + t * (hull->x[j] - hull->x[i]);
        low = fmin(low, ya == yb ? fmin(hull->x[i], hull->x[j]) : x);
        high = fmax(high, ya == yb ? fmax(hull->x[i], hull->x[j]) : x);
    }
    *x_from = ceil(low);
    *x_to = floor(high);
    return *x_from <= *x_to;
}

static uint32_t clamped(double value, uint32_t most)
{
    return value > 0.0 ? (value < most ? (uint32_t)value : most) : 0;
}

bool oc_hull_rect(const oc_hull_t *hull, uint32_t width_px, uint32_t height_px, oc_pixel_rect_t *rect)
{
    double low_x = HUGE_VAL, low_y = HUGE_VAL, high_x = -HUGE_VAL, high_y = -HUGE_VAL;
    for (uint32_t i = 0; i < hull->n; i++) {
        low_x = fmin(low_x, hull->x[i]);
        high_x = fmax(high_x, hull->x[i]);
        low_y = fmin(low_y, hull->y[i]);
        high_y = fmax(high_y, hull->y[i]);
    }
    *rect = (oc_pixel_rect_t){clamped(ceil(low_x), width_px), clamped(ceil(low_y), height_px),
                              clamped(floor(high_x) + 1.0, width_px), clamped(floor(high_y) + 1.0, height_px)};
    return rect->x0 < rect->x1 && rect->y0 < rect->y1;
}

void oc_boxes_clear(uint8_t *bits, uint32_t width_px, uint32_t height_px)
{
    memset(bits, 0, (size_t)height_px * ((width_px + 7u) / 8u));
}

void oc_boxes_add(uint8_t *bits, uint32_t width_px, uint32_t height_px, const oc_hull_t *hull)
{
    oc_pixel_rect_t rect;
    if (!oc_hull_rect(hull, width_px, height_px, &rect)) return;
    const size_t pitch = (width_px + 7u) / 8u;
    for (uint32_t y = rect.y0; y < rect.y1; y++) {
        double from, to;
        if (!oc_hull_span(hull, y, &from, &to)) continue;
        const uint32_t end = clamped(to + 1.0, width_px);
        for (uint32_t x = clamped(from, width_px); x < end; x++) {
            bits[y * pitch + x / 8u] = (uint8_t)(bits[y * pitch + x / 8u] | (1u << (x & 7u)));
        }
    }
}
