/* SPDX-License-Identifier: BSD-3-Clause
 * Angles by series in double precision: additions, multiplications and divisions only, which IEEE 754 defines to the
 * last bit. */
#include "core/angle.h"

#include <math.h>

#define PI 3.14159265358979323846

/* tan(pi / 8): up to here the series converges fast. */
#define TAN_22_5 0.41421356237309503

/* atan for 0 <= t <= 1. Above tan(pi / 8): atan t = pi / 4 + atan((t - 1) / (t + 1)). The first term left out is below
 * 0.4143^23 / 23 = 7e-11, a thousandth of what a float near there can tell. */
static double atan_of(double t)
{
    const double from = t > TAN_22_5 ? 0.25 * PI : 0.0;
    const double u = t > TAN_22_5 ? (t - 1.0) / (t + 1.0) : t;
    const double v = u * u;
    double sum = 0.0;
    for (int n = 21; n >= 1; n -= 2) sum = 1.0 / n - v * sum;
    return from + u * sum;
}

float oc_angle_of(float y, float x)
{
    const double a = fabs((double)y), b = fabs((double)x);
    if (a == 0.0 && b == 0.0) return 0.0f;

    /* Infinity over infinity is not a number, as it should be: such a direction means nothing. */
    double angle = a <= b ? atan_of(a / b) : 0.5 * PI - atan_of(b / a);
    if (x < 0.0f) angle = PI - angle;
    return (float)(y < 0.0f ? -angle : angle);
}

float oc_angle_cos(float angle_rad)
{
    double a = fabs((double)angle_rad);
    if (!(a <= 7.0)) return NAN;

    a = fabs(a > PI ? a - 2.0 * PI : a); /* 0..pi */
    const double sign = a > 0.5 * PI ? -1.0 : 1.0;
    a = a > 0.5 * PI ? PI - a : a; /* 0..pi/2; the first term left out is below 1.6^18 / 18! = 7e-13 */
    const double v = a * a;
    double sum = 1.0;
    for (int n = 16; n >= 2; n -= 2) sum = 1.0 - v * sum / (double)(n * (n - 1));
    return (float)(sign * sum);
}
