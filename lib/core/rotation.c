/* SPDX-License-Identifier: BSD-3-Clause
 * Rotations: the thesis' two systems of angles, and quaternions.
 */
#include <math.h>
#include <string.h>

#include "core/camera.h"
#include "core/mat3.h"

/* Thesis Eq 4.12 term by term. */
void oc_thesis_from_opk(double omega, double phi, double kappa, double R_th[9])
{
    OC_ASSERT(R_th);

    const double cw = cos(omega), sw = sin(omega);
    const double cp = cos(phi), sp = sin(phi);
    const double ck = cos(kappa), sk = sin(kappa);
    /* clang-format off */
    const double m[9] = {cp * ck,  sw * sp * ck + cw * sk,  -cw * sp * ck + sw * sk,
                         -cp * sk, -sw * sp * sk + cw * ck, cw * sp * sk + sw * ck,
                         sp,       -sw * cp,                cw * cp};
    /* clang-format on */
    memcpy(R_th, m, sizeof m);
}

/* Thesis Eq 4.13 term by term. */
void oc_thesis_from_pts(double pan, double tilt, double swing, double R_th[9])
{
    OC_ASSERT(R_th);

    const double cp = cos(pan), sp = sin(pan);
    const double ct = cos(tilt), st = sin(tilt);
    const double cy = cos(swing), sy = sin(swing);
    /* clang-format off */
    const double m[9] = {cy * cp + sy * ct * sp,  -cy * sp + sy * ct * cp, sy * st,
                         -sy * cp + cy * ct * sp, sy * sp + cy * ct * cp,  cy * st,
                         -st * sp,                -st * cp,                ct};
    /* clang-format on */
    memcpy(R_th, m, sizeof m);
}

/* The last angle is read from R R_first^T, which holds it in a column of unit
 * length: no attitude is singular, whatever the first angle comes out as. */
void oc_opk_from_thesis(const double R_th[9], double *omega, double *phi, double *kappa)
{
    OC_ASSERT(R_th && omega && phi && kappa);

    const double w = atan2(-R_th[7], R_th[8]);
    const double c = cos(w), s = sin(w);
    *omega = w;
    *phi = atan2(R_th[6], hypot(R_th[7], R_th[8]));
    *kappa = atan2(R_th[1] * c + R_th[2] * s, R_th[4] * c + R_th[5] * s);
}

void oc_pts_from_thesis(const double R_th[9], double *pan, double *tilt, double *swing)
{
    OC_ASSERT(R_th && pan && tilt && swing);

    const double p = atan2(-R_th[6], -R_th[7]);
    const double c = cos(p), s = sin(p);
    *pan = p;
    *tilt = atan2(hypot(R_th[6], R_th[7]), R_th[8]);
    *swing = atan2(R_th[4] * s - R_th[3] * c, R_th[0] * c - R_th[1] * s);
}

void oc_opk_from_pts(double pan, double tilt, double swing, double *omega, double *phi, double *kappa)
{
    double R[9];
    oc_thesis_from_pts(pan, tilt, swing, R);
    oc_opk_from_thesis(R, omega, phi, kappa);
}

void oc_pts_from_opk(double omega, double phi, double kappa, double *pan, double *tilt, double *swing)
{
    double R[9];
    oc_thesis_from_opk(omega, phi, kappa, R);
    oc_pts_from_thesis(R, pan, tilt, swing);
}

void oc_cv_from_thesis(const double R_th[9], double R_cv[9])
{
    OC_ASSERT(R_th && R_cv);

    for (int i = 0; i < 3; i++) R_cv[i] = R_th[i];
    for (int i = 3; i < 9; i++) R_cv[i] = -R_th[i];
}

/* Divides by the largest of the four components, which is at least 1/2; i is
 * its axis, 3 for w. */
void oc_quat_from_rotation(const double R[9], double q_wxyz[4])
{
    OC_ASSERT(R && q_wxyz);

    const double trace = R[0] + R[4] + R[8];
    const double diagonal[4] = {R[0], R[4], R[8], trace};
    int i = 3;
    for (int k = 0; k < 3; k++) {
        if (diagonal[k] > diagonal[i]) i = k;
    }

    double q[4];
    if (i == 3) {
        q[0] = 1.0 + trace;
        q[1] = R[7] - R[5];
        q[2] = R[2] - R[6];
        q[3] = R[3] - R[1];
    } else {
        const int j = (i + 1) % 3;
        const int k = (i + 2) % 3;
        q[0] = R[3 * k + j] - R[3 * j + k];
        q[1 + i] = 1.0 + 2.0 * diagonal[i] - trace;
        q[1 + j] = R[3 * j + i] + R[3 * i + j];
        q[1 + k] = R[3 * k + i] + R[3 * i + k];
    }
    const double length = sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    for (int c = 0; c < 4; c++) q_wxyz[c] = (q[0] < 0.0 ? -q[c] : q[c]) / length;
}

oc_status_t oc_rotation_from_quat(const double q_wxyz[4], double R[9])
{
    OC_ASSERT(q_wxyz && R);

    double norm = 0.0;
    for (int i = 0; i < 4; i++) norm += q_wxyz[i] * q_wxyz[i];
    norm = sqrt(norm);
    if (!(fabs(norm - 1.0) <= 1e-3)) return OC_E_ARG;

    const double w = q_wxyz[0] / norm, x = q_wxyz[1] / norm;
    const double y = q_wxyz[2] / norm, z = q_wxyz[3] / norm;
    const double m[9] = {1 - 2 * (y * y + z * z), 2 * (x * y - w * z),     2 * (x * z + w * y),
                         2 * (x * y + w * z),     1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
                         2 * (x * z - w * y),     2 * (y * z + w * x),     1 - 2 * (x * x + y * y)};
    memcpy(R, m, sizeof m);
    return OC_OK;
}
