/* SPDX-License-Identifier: BSD-3-Clause
 * Homographies of pixels: apply, differentiate, anchor, chain.
 */
#include "core/homography.h"

#include <math.h>
#include <stdbool.h>
#include <string.h>

#include "core/mat3.h"

static const double full_turn = 6.283185307179586476925;

/* out = H (x, y, 1); false when the point is at infinity or not a number. */
static bool point_transfer(const double H[9], double x, double y, double out[3])
{
    oc_mat3_mul_point(H, x, y, out);
    const double terms = fabs(H[6] * x) + fabs(H[7] * y) + fabs(H[8]);
    return fabs(out[2]) > 1e-12 * terms && isfinite(out[0] / out[2]) && isfinite(out[1] / out[2]);
}

double oc_homography_apply(const double H[9], double x, double y, double *x2, double *y2)
{
    OC_ASSERT(H && x2 && y2);

    double p[3];
    if (!point_transfer(H, x, y, p)) return 0.0;
    *x2 = p[0] / p[2];
    *y2 = p[1] / p[2];
    return p[2];
}

oc_status_t oc_homography_jacobian(const double H[9], double x, double y, double J[4])
{
    OC_ASSERT(H && J);

    double p[3];
    if (!point_transfer(H, x, y, p)) return OC_E_DEGENERATE;
    const double x2 = p[0] / p[2];
    const double y2 = p[1] / p[2];
    J[0] = (H[0] - x2 * H[6]) / p[2];
    J[1] = (H[1] - x2 * H[7]) / p[2];
    J[2] = (H[3] - y2 * H[6]) / p[2];
    J[3] = (H[4] - y2 * H[7]) / p[2];
    return OC_OK;
}

oc_status_t oc_homography_angle(const double H[9], double x, double y, double angle_rad, double *angle2_rad)
{
    OC_ASSERT(H && angle2_rad);

    double J[4];
    if (oc_homography_jacobian(H, x, y, J) != OC_OK) return OC_E_DEGENERATE;
    const double c = cos(angle_rad);
    const double s = sin(angle_rad);
    const double dx = J[0] * c + J[1] * s;
    const double dy = J[2] * c + J[3] * s;
    const double size = fabs(J[0]) + fabs(J[1]) + fabs(J[2]) + fabs(J[3]);
    if (!(fabs(dx) + fabs(dy) > 1e-12 * size)) return OC_E_DEGENERATE;

    const double a = atan2(dy, dx);
    *angle2_rad = a < 0.0 ? fmod(a + full_turn, full_turn) : a;
    return OC_OK;
}

oc_status_t oc_homography_anchor(const double H[9], double x, double y, double x2, double y2, double anchored[9])
{
    OC_ASSERT(H && anchored);

    double p[3];
    if (!point_transfer(H, x, y, p)) return OC_E_DEGENERATE;
    if (!isfinite(x2) || !isfinite(y2)) return OC_E_DEGENERATE;
    const double tx = x2 - p[0] / p[2];
    const double ty = y2 - p[1] / p[2];

    double out[9];
    memcpy(out, H, sizeof out);
    for (int c = 0; c < 3; c++) {
        out[c] += tx * H[6 + c];
        out[3 + c] += ty * H[6 + c];
    }
    memcpy(anchored, out, sizeof out);
    return OC_OK;
}

void oc_homography_chain(const double steps[][9], uint32_t n, double H[9])
{
    OC_ASSERT(H && (steps || n == 0));

    double product[9];
    oc_mat3_identity(product);
    for (uint32_t i = 0; i < n; i++) oc_mat3_mul(steps[i], product, product);
    memcpy(H, product, sizeof product);
}
