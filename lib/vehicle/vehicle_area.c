/* SPDX-License-Identifier: BSD-3-Clause
 * Which pixels can show something that stands in the area of work. */
#include <math.h>

#include "vehicle/vehicle_internal.h"

bool oc_area_is_valid(const oc_area_t *area)
{
    if (!area->is_set) return true;
    const double limit_m = 1e6;
    return area->x_min < area->x_max && area->y_min < area->y_max && area->x_min >= -limit_m &&
           area->y_min >= -limit_m && area->x_max <= limit_m && area->y_max <= limit_m && area->z_max > 0.0 &&
           area->z_max <= limit_m;
}

/* Cut [*from, *to] of the ray c + s d to low <= c + s d <= high. */
static bool slab_cut(double c, double d, double low, double high, double *from, double *to)
{
    if (fabs(d) < 1e-12) return c >= low && c <= high;
    double near = (low - c) / d, far = (high - c) / d;
    if (near > far) {
        const double swap = near;
        near = far;
        far = swap;
    }
    if (near > *from) *from = near;
    if (far < *to) *to = far;
    return *from <= *to;
}

bool oc_area_is_hit(const oc_area_t *area, const oc_camera_t *camera, const oc_margin_t *margin, double x_px,
                    double y_px)
{
    if (!area->is_set) return true;

    double centre[3], ray[3];
    oc_pose_centre(&camera->pose, centre);
    oc_camera_ray(camera, x_px, y_px, ray);

    /* Errors of the pose move the ray by no more than this at the area's far corner. */
    const double dx = fmax(fabs(area->x_min - centre[0]), fabs(area->x_max - centre[0]));
    const double dy = fmax(fabs(area->y_min - centre[1]), fabs(area->y_max - centre[1]));
    const double dz = fmax(fabs(centre[2]), fabs(area->z_max - centre[2]));
    const double reach_m = sqrt(dx * dx + dy * dy + dz * dz);
    const double *m = margin->v;
    const double slack_m =
        sqrt(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]) + reach_m * sqrt(m[3] * m[3] + m[4] * m[4] + m[5] * m[5]);

    double from = 0.0, to = (double)INFINITY;
    return slab_cut(centre[0], ray[0], area->x_min - slack_m, area->x_max + slack_m, &from, &to) &&
           slab_cut(centre[1], ray[1], area->y_min - slack_m, area->y_max + slack_m, &from, &to) &&
           slab_cut(centre[2], ray[2], -slack_m, area->z_max + slack_m, &from, &to);
}
