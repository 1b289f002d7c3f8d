/* SPDX-License-Identifier: BSD-3-Clause
 * The thesis' window and strip: one parameter at a time, minimum and maximum.
 */
#include <math.h>
#include <string.h>

#include "core/epipolar.h"
#include "core/homography.h"
#include "core/mat3.h"
#include "core/pair.h"
#include "core/plane.h"

/* F and H of a pair with at most one camera moved. */
static oc_status_t matrices_make(const oc_camera_t *left, const oc_camera_t *right, double F[9], double H[9])
{
    const oc_status_t status = oc_epipolar_fundamental(left, right, F);
    if (status != OC_OK) return status;
    return oc_plane_ground_homography(left, right, H);
}

oc_status_t oc_pair_prepare_thesis(oc_pair_thesis_t *pair, const oc_camera_t *left, const oc_margin_t *left_margin,
                                   const oc_camera_t *right, const oc_margin_t *right_margin)
{
    OC_ASSERT(pair);

    oc_status_t status = oc_pair_check(left, left_margin, right, right_margin);
    if (status != OC_OK) return status;
    oc_pair_thesis_t out;
    status = matrices_make(left, right, out.F, out.H);
    for (int i = 0; i < 2 * OC_PAIR_PARAMS && status == OC_OK; i++) {
        const int parameter = (i / 2) % 6;
        const bool is_left = i / 2 < 6;
        const double margin = is_left ? left_margin->v[parameter] : right_margin->v[parameter];
        oc_camera_t moved;
        oc_pair_move_camera(is_left ? left : right, parameter, i % 2 == 0 ? -margin : margin, OC_ANGLE_ERROR_OPK,
                            &moved);
        status = matrices_make(is_left ? &moved : left, is_left ? right : &moved, out.F_moved[i], out.H_moved[i]);
    }
    if (status != OC_OK) return status;
    *pair = out;
    return OC_OK;
}

oc_status_t oc_window_ground_thesis(const oc_pair_thesis_t *pair, double x_px, double y_px, oc_rect_t *window)
{
    OC_ASSERT(pair && window);

    if (!isfinite(x_px) || !isfinite(y_px)) return OC_E_ARG;
    double x, y;
    if (!(oc_homography_apply(pair->H, x_px, y_px, &x, &y) > 0.0)) return OC_E_DEGENERATE;
    oc_rect_t out = {x, y, x, y};
    for (int i = 0; i < 2 * OC_PAIR_PARAMS; i++) {
        if (!(oc_homography_apply(pair->H_moved[i], x_px, y_px, &x, &y) > 0.0)) return OC_E_DEGENERATE;
        out.x_min_px = fmin(out.x_min_px, x);
        out.y_min_px = fmin(out.y_min_px, y);
        out.x_max_px = fmax(out.x_max_px, x);
        out.y_max_px = fmax(out.y_max_px, y);
    }
    *window = out;
    return OC_OK;
}

/* Heights at which the epipolar line crosses both borders, Eq 5.11 and 5.12;
 * false when it is vertical. */
static bool border_crossings(const double F[9], double x_px, double y_px, double width_px, double y[2])
{
    double l[3];
    if (oc_epipolar_line(F, x_px, y_px, l) != OC_OK) return false;
    if (!(fabs(l[1]) > 1e-9)) return false;
    y[0] = -l[2] / l[1];
    y[1] = -(l[2] + l[0] * width_px) / l[1];
    return true;
}

/* Line through (0, y0) and (width, y1). */
static void border_line(double y0, double y1, double width_px, double line[3])
{
    line[0] = y1 - y0;
    line[1] = -width_px;
    line[2] = width_px * y0;
}

oc_status_t oc_strip_prepare_thesis(const oc_pair_thesis_t *pair, double x_px, double y_px, double width_px,
                                    oc_strip_thesis_t *strip)
{
    OC_ASSERT(pair && strip);

    if (!isfinite(x_px) || !isfinite(y_px) || !(width_px > 0.0) || !isfinite(width_px)) return OC_E_ARG;
    double least[2], most[2];
    if (!border_crossings(pair->F, x_px, y_px, width_px, least)) return OC_E_DEGENERATE;
    memcpy(most, least, sizeof most);
    for (int i = 0; i < 2 * OC_PAIR_PARAMS; i++) {
        double y[2];
        if (!border_crossings(pair->F_moved[i], x_px, y_px, width_px, y)) return OC_E_DEGENERATE;
        for (int b = 0; b < 2; b++) {
            least[b] = fmin(least[b], y[b]);
            most[b] = fmax(most[b], y[b]);
        }
    }
    border_line(least[0], least[1], width_px, strip->upper);
    border_line(most[0], most[1], width_px, strip->lower);
    return OC_OK;
}

bool oc_strip_contains_thesis(const oc_strip_thesis_t *strip, double x_px, double y_px)
{
    OC_ASSERT(strip);

    const double u = strip->upper[0] * x_px + strip->upper[1] * y_px + strip->upper[2];
    const double d = strip->lower[0] * x_px + strip->lower[1] * y_px + strip->lower[2];
    return u * d < 0.0;
}
