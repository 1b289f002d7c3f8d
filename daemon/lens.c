/* SPDX-License-Identifier: BSD-3-Clause
 * Lens models. */
#include "lens.h"

#include <math.h>
#include <string.h>

oc_lens_t oc_lens_pinhole(const oc_intrinsics_t *k)
{
    return (oc_lens_t){.model = OC_LENS_PINHOLE, .raw = *k, .rectified = *k};
}

oc_lens_t oc_lens_plumb_bob(const oc_intrinsics_t *k, const oc_distortion_t *distortion)
{
    oc_lens_t lens = {.model = OC_LENS_PLUMB_BOB, .raw = *k, .rectified = *k};
    memcpy(lens.k, distortion->k, sizeof lens.k);
    return lens;
}

bool oc_lens_is_valid(const oc_lens_t *lens)
{
    for (int i = 0; i < 5; i++) {
        if (!isfinite(lens->k[i])) return false;
    }
    return oc_intrinsics_is_valid(&lens->raw) && oc_intrinsics_is_valid(&lens->rectified);
}

bool oc_lens_is_identity(const oc_lens_t *lens)
{
    bool is_straight = true;
    for (int i = 0; i < 5; i++) is_straight = is_straight && lens->k[i] == 0;
    if (lens->model == OC_LENS_PINHOLE) is_straight = true;
    if (lens->model == OC_LENS_FISHEYE) is_straight = false; /* equidistant even without coefficients */
    const oc_intrinsics_t *a = &lens->raw, *b = &lens->rectified;
    return is_straight && a->fx_px == b->fx_px && a->fy_px == b->fy_px && a->cx_px == b->cx_px &&
           a->cy_px == b->cy_px && a->width_px == b->width_px && a->height_px == b->height_px;
}

/* Kannala and Brandt: the angle off the axis, stretched by a polynomial, becomes the radius. */
static void bend_fisheye(const double k[5], double x, double y, double *xd, double *yd)
{
    const double r = hypot(x, y), theta = atan(r), t2 = theta * theta;
    const double bent = theta * (1 + t2 * (k[0] + t2 * (k[1] + t2 * (k[2] + t2 * k[3]))));
    const double scale = r > 1e-12 ? bent / r : 1;
    *xd = x * scale;
    *yd = y * scale;
}

void oc_lens_distort(const oc_lens_t *lens, double x_px, double y_px, double *raw_x_px, double *raw_y_px)
{
    const oc_intrinsics_t *to = &lens->raw, *from = &lens->rectified;
    const double x = (x_px - from->cx_px) / from->fx_px, y = (y_px - from->cy_px) / from->fy_px;
    double xd = x, yd = y;
    if (lens->model == OC_LENS_FISHEYE) {
        bend_fisheye(lens->k, x, y, &xd, &yd);
    } else if (lens->model == OC_LENS_PLUMB_BOB) {
        oc_distortion_t d;
        memcpy(d.k, lens->k, sizeof d.k);
        const oc_intrinsics_t unit = {.fx_px = 1, .fy_px = 1};
        oc_distort(&unit, &d, x, y, &xd, &yd);
    }
    *raw_x_px = to->fx_px * xd + to->cx_px;
    *raw_y_px = to->fy_px * yd + to->cy_px;
}
