/* SPDX-License-Identifier: BSD-3-Clause
 * Row-major 3x3 matrices and 3-vectors of doubles, just what two-view geometry needs.
 *
 * Outputs may be the same array as an input unless said otherwise. Nothing
 * here checks for NaN: it comes out as NaN, and oc_mat3_inverse refuses it. */
#ifndef OUTCROP_CORE_MAT3_H
#define OUTCROP_CORE_MAT3_H

#include <math.h>
#include <string.h>

#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* ---- vectors ---- */

static inline double oc_vec3_dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline double oc_vec3_norm(const double a[3])
{
    return sqrt(oc_vec3_dot(a, a));
}

static inline void oc_vec3_cross(const double a[3], const double b[3], double out[3])
{
    const double x = a[1] * b[2] - a[2] * b[1];
    const double y = a[2] * b[0] - a[0] * b[2];
    const double z = a[0] * b[1] - a[1] * b[0];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

static inline void oc_vec3_sub(const double a[3], const double b[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = a[i] - b[i];
}

/* Scales a to length 1 and returns the length it had; a zero or NaN vector is left as it is. */
static inline double oc_vec3_normalise(double a[3])
{
    const double n = oc_vec3_norm(a);
    if (!(n > 0.0)) return n;
    for (int i = 0; i < 3; i++) a[i] /= n;
    return n;
}

/* ---- matrices ---- */

static inline void oc_mat3_identity(double out[9])
{
    static const double eye[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    memcpy(out, eye, sizeof eye);
}

static inline void oc_mat3_mul(const double a[9], const double b[9], double out[9])
{
    double m[9];
    for (int r = 0; r < 3; r++) {
        for (int c = 0; c < 3; c++) {
            m[3 * r + c] = a[3 * r] * b[c] + a[3 * r + 1] * b[3 + c] + a[3 * r + 2] * b[6 + c];
        }
    }
    memcpy(out, m, sizeof m);
}

static inline void oc_mat3_transpose(const double a[9], double out[9])
{
    const double m[9] = {a[0], a[3], a[6], a[1], a[4], a[7], a[2], a[5], a[8]};
    memcpy(out, m, sizeof m);
}

/* a v. */
static inline void oc_mat3_mul_vec(const double a[9], const double v[3], double out[3])
{
    const double x = oc_vec3_dot(a, v);
    const double y = oc_vec3_dot(a + 3, v);
    const double z = oc_vec3_dot(a + 6, v);
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* a^T v. */
static inline void oc_mat3_mul_vec_t(const double a[9], const double v[3], double out[3])
{
    const double x = a[0] * v[0] + a[3] * v[1] + a[6] * v[2];
    const double y = a[1] * v[0] + a[4] * v[1] + a[7] * v[2];
    const double z = a[2] * v[0] + a[5] * v[1] + a[8] * v[2];
    out[0] = x;
    out[1] = y;
    out[2] = z;
}

/* a (x, y, 1). */
static inline void oc_mat3_mul_point(const double a[9], double x, double y, double out[3])
{
    for (int r = 0; r < 3; r++) out[r] = a[3 * r] * x + a[3 * r + 1] * y + a[3 * r + 2];
}

static inline double oc_mat3_det(const double a[9])
{
    return a[0] * (a[4] * a[8] - a[5] * a[7]) - a[1] * (a[3] * a[8] - a[5] * a[6]) + a[2] * (a[3] * a[7] - a[4] * a[6]);
}

static inline double oc_mat3_norm(const double a[9])
{
    double s = 0.0;
    for (int i = 0; i < 9; i++) s += a[i] * a[i];
    return sqrt(s);
}

/* out = [v]x, so that out w = v x w. */
static inline void oc_mat3_skew(const double v[3], double out[9])
{
    const double m[9] = {0, -v[2], v[1], v[2], 0, -v[0], -v[1], v[0], 0};
    memcpy(out, m, sizeof m);
}

/* out = a b^T. */
static inline void oc_mat3_outer(const double a[3], const double b[3], double out[9])
{
    double m[9];
    for (int i = 0; i < 9; i++) m[i] = a[i / 3] * b[i % 3];
    memcpy(out, m, sizeof m);
}

/* Below this share of the product of its row lengths a determinant counts as
 * 0. Homographies in pixels have rows of very different length, so the share
 * is small. */
#define OC_MAT3_MIN_DET 1e-13

/* OC_E_DEGENERATE when |det| is below OC_MAT3_MIN_DET of the product of the
 * row lengths, or a value is not a number; out is not written then. */
OC_CHECKED static inline oc_status_t oc_mat3_inverse(const double a[9], double out[9])
{
    const double det = oc_mat3_det(a);
    const double rows = oc_vec3_norm(a) * oc_vec3_norm(a + 3) * oc_vec3_norm(a + 6);
    if (!(fabs(det) > OC_MAT3_MIN_DET * rows) || !isfinite(det)) return OC_E_DEGENERATE;

    const double s = 1.0 / det;
    const double m[9] = {
        s * (a[4] * a[8] - a[5] * a[7]), s * (a[2] * a[7] - a[1] * a[8]), s * (a[1] * a[5] - a[2] * a[4]),
        s * (a[5] * a[6] - a[3] * a[8]), s * (a[0] * a[8] - a[2] * a[6]), s * (a[2] * a[3] - a[0] * a[5]),
        s * (a[3] * a[7] - a[4] * a[6]), s * (a[1] * a[6] - a[0] * a[7]), s * (a[0] * a[4] - a[1] * a[3])};
    memcpy(out, m, sizeof m);
    return OC_OK;
}

/* x with a x = b; fails as oc_mat3_inverse does. */
OC_CHECKED static inline oc_status_t oc_mat3_solve(const double a[9], const double b[3], double x[3])
{
    double inv[9];
    if (oc_mat3_inverse(a, inv) != OC_OK) return OC_E_DEGENERATE;
    oc_mat3_mul_vec(inv, b, x);
    return OC_OK;
}

#ifdef __cplusplus
}
#endif
#endif
