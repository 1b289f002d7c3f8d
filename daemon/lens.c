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
    if (lens->model != OC_LENS_PINHOLE && lens->model != OC_LENS_PLUMB_BOB && lens->model != OC_LENS_FISHEYE)
        return false;
    return oc_intrinsics_is_valid(&lens->raw) && oc_intrinsics_is_valid(&lens->rectified);
}

static bool is_same_camera(const oc_intrinsics_t *a, const oc_intrinsics_t *b)
{
    return a->fx_px == b->fx_px && a->fy_px == b->fy_px && a->cx_px == b->cx_px && a->cy_px == b->cy_px &&
           a->width_px == b->width_px && a->height_px == b->height_px;
}

bool oc_lens_is_identity(const oc_lens_t *lens)
{
    bool is_straight = true;
    for (int i = 0; i < 5; i++) is_straight = is_straight && lens->k[i] == 0;
    if (lens->model == OC_LENS_PINHOLE) is_straight = true;
    if (lens->model == OC_LENS_FISHEYE) is_straight = false; /* equidistant even without coefficients */
    return is_straight && is_same_camera(&lens->raw, &lens->rectified);
}

bool oc_lens_is_equal(const oc_lens_t *a, const oc_lens_t *b)
{
    for (int i = 0; i < 5; i++) {
        if (!(a->k[i] == b->k[i])) return false;
    }
    return a->model == b->model && is_same_camera(&a->raw, &b->raw) && is_same_camera(&a->rectified, &b->rectified);
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

/* ---- where the polynomials turn back ---- */

#define MAX_DEGREE 6

static double value_at(const double c[], int degree, double x)
{
    double sum = c[degree];
    for (int i = degree - 1; i >= 0; i--) sum = sum * x + c[i];
    return sum;
}

/* Between low, where the polynomial is positive (or negative for sign -1), and high, where it is not. */
static double bisect(const double c[], int degree, double low, double high, double sign)
{
    for (int i = 0; i < 100; i++) {
        const double middle = low + (high - low) / 2;
        if (sign * value_at(c, degree, middle) > 0)
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* Where in (0, end) the polynomial changes its sign, given its extrema; `at` is in and out, n inner points. */
static int sign_changes(const double c[], int degree, double end, double at[], int n)
{
    double found[MAX_DEGREE], low = 0;
    int n_found = 0;
    for (int i = 0; i <= n; i++) {
        const double high = i < n ? at[i] : end;
        const double sign = value_at(c, degree, low) > 0 ? 1 : -1;
        if (!(sign * value_at(c, degree, high) > 0) && n_found < degree)
            found[n_found++] = bisect(c, degree, low, high, sign);
        low = high;
    }
    memcpy(at, found, (size_t)n_found * sizeof *at);
    return n_found;
}

/* The largest x <= end so that the polynomial is positive in [0, x). Its extrema are the sign changes of
 * its derivative, whose extrema are those of the next, and so on up to the constant one. */
static double positive_until(const double c[], int degree, double end)
{
    double at[MAX_DEGREE], derivative[MAX_DEGREE + 1];
    int n = 0;
    for (int order = degree - 1; order >= 1; order--) {
        for (int i = 0; i <= degree - order; i++) {
            derivative[i] = c[i + order];
            for (int j = 0; j < order; j++) derivative[i] *= i + order - j;
        }
        n = sign_changes(derivative, degree - order, end, at, n);
    }
    double low = 0;
    if (!(c[0] > 0)) return 0;
    for (int i = 0; i <= n; i++) {
        const double high = i < n ? at[i] : end;
        if (!(value_at(c, degree, high) > 0)) return bisect(c, degree, low, high, 1);
        low = high;
    }
    return end;
}

/* d radius / d angle over the square of the angle. */
static double reach_of_fisheye(const double k[5])
{
    const double slope[5] = {1, 3 * k[0], 5 * k[1], 7 * k[2], 9 * k[3]};
    const double right_angle = 2 * atan(1), end = right_angle * right_angle, until = positive_until(slope, 4, end);
    return until < end ? tan(sqrt(until)) : (double)INFINITY;
}

/* The Jacobian's eigenvalues are at least those of its radial part, the radial factor (across) and the
 * slope of the radius (along), less the largest that the tangential part can take away. */
static double reach_of_plumb_bob(const double k[5])
{
    const double away = -6 * hypot(k[2], k[3]);
    const double across[7] = {1, away, k[0], 0, k[1], 0, k[4]};
    const double along[7] = {1, away, 3 * k[0], 0, 5 * k[1], 0, 7 * k[4]};
    return positive_until(across, 6, positive_until(along, 6, OC_MAX_LENS_REACH));
}

double oc_lens_reach(const oc_lens_t *lens)
{
    for (int i = 0; i < 5; i++) {
        if (lens->model != OC_LENS_PINHOLE && !isfinite(lens->k[i])) return 0;
    }
    if (lens->model == OC_LENS_FISHEYE) return reach_of_fisheye(lens->k);
    return lens->model == OC_LENS_PLUMB_BOB ? reach_of_plumb_bob(lens->k) : (double)INFINITY;
}

/* Rounding alone shall not put the outermost pixels outside. False for NaN. */
static bool clamp_to_side(double *v_px, uint32_t side_px)
{
    const double slack = 1.0 / 512, last = side_px - 1.0;
    if (!(*v_px >= -slack && *v_px <= last + slack)) return false;
    *v_px = fmin(fmax(*v_px, 0), last);
    return true;
}

bool oc_lens_find(const oc_lens_t *lens, double reach, double x_px, double y_px, double *raw_x_px, double *raw_y_px)
{
    const oc_intrinsics_t *k = &lens->rectified;
    const double r = hypot((x_px - k->cx_px) / k->fx_px, (y_px - k->cy_px) / k->fy_px);
    if (!(r < reach)) return false;
    double x, y;
    oc_lens_distort(lens, x_px, y_px, &x, &y);
    if (!clamp_to_side(&x, lens->raw.width_px) || !clamp_to_side(&y, lens->raw.height_px)) return false;
    *raw_x_px = x;
    *raw_y_px = y;
    return true;
}
