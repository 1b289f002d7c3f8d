/* SPDX-License-Identifier: BSD-3-Clause
 * Lenses against closed forms and brute force: projection, and the reach where polynomials turn back. */
#include "unity.h"

#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "lens.h"

static const oc_intrinsics_t k = {
    .width_px = 640, .height_px = 480, .fx_px = 400, .fy_px = 390, .cx_px = 310.5, .cy_px = 245};

static uint64_t state;

/* xorshift64*, in [-1, 1). */
static double draw(void)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return (double)((state * 0x2545f4914f6cdd1du) >> 11) * 0x1p-52 - 1;
}

static void seed(const char *test)
{
    const char *given = getenv("OUTCROP_TEST_SEED");
    state = given ? strtoull(given, NULL, 0) : 0x9e3779b97f4a7c15u;
    printf("%s: OUTCROP_TEST_SEED=%" PRIu64 "\n", test, state);
}

static oc_lens_t plumb_bob(double k1, double k2, double p1, double p2, double k3)
{
    const oc_distortion_t d = {{k1, k2, p1, p2, k3}};
    return oc_lens_plumb_bob(&k, &d);
}

static oc_lens_t fisheye(double k1, double k2, double k3, double k4)
{
    return (oc_lens_t){.model = OC_LENS_FISHEYE, .k = {k1, k2, k3, k4}, .raw = k, .rectified = k};
}

void setUp(void) {}

void tearDown(void) {}

/* ---- projection ---- */

static void an_equidistant_lens_draws_angles(void)
{
    const oc_lens_t lens = fisheye(0, 0, 0, 0);
    for (int deg = 0; deg < 90; deg++) {
        const double angle = deg * M_PI / 180, towards = 1.1;
        const double x = k.cx_px + k.fx_px * tan(angle) * cos(towards);
        const double y = k.cy_px + k.fy_px * tan(angle) * sin(towards);
        double raw_x, raw_y;
        oc_lens_distort(&lens, x, y, &raw_x, &raw_y);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, k.cx_px + k.fx_px * angle * cos(towards), raw_x);
        TEST_ASSERT_DOUBLE_WITHIN(1e-9, k.cy_px + k.fy_px * angle * sin(towards), raw_y);
    }
}

/* Both pictures may have their own size, focal length and centre. */
static void raw_and_rectified_have_their_own_intrinsics(void)
{
    oc_lens_t lens = oc_lens_pinhole(&k);
    lens.rectified =
        (oc_intrinsics_t){.width_px = 320, .height_px = 200, .fx_px = 100, .fy_px = 130, .cx_px = 150, .cy_px = 110};
    TEST_ASSERT_TRUE(oc_lens_is_valid(&lens));
    TEST_ASSERT_FALSE(oc_lens_is_identity(&lens));
    double raw_x, raw_y;
    oc_lens_distort(&lens, 170, 97, &raw_x, &raw_y);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 310.5 + 400 * 0.2, raw_x);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, 245 - 390 * 0.1, raw_y);
}

static void only_a_lens_that_changes_nothing_is_the_identity(void)
{
    oc_lens_t lens = oc_lens_pinhole(&k), bent = plumb_bob(0, 0, 0, 0, 1e-9), round = fisheye(0, 0, 0, 0);
    TEST_ASSERT_TRUE(oc_lens_is_identity(&lens));
    TEST_ASSERT_FALSE(oc_lens_is_identity(&bent));
    TEST_ASSERT_FALSE(oc_lens_is_identity(&round));
    lens.model = OC_LENS_PLUMB_BOB;
    TEST_ASSERT_TRUE(oc_lens_is_identity(&lens));
    lens.rectified.cx_px += 0.5;
    TEST_ASSERT_FALSE(oc_lens_is_identity(&lens));
}

static void equality_sees_every_field_and_no_padding(void)
{
    const oc_lens_t lens = plumb_bob(1, 2, 3, 4, 5);
    union {
        oc_lens_t lens;
        unsigned char bytes[sizeof(oc_lens_t)];
    } other;
    for (size_t i = 0; i < sizeof other.bytes; i++) other.bytes[i] = 0xa5;
    other.lens.model = lens.model;
    for (int i = 0; i < 5; i++) other.lens.k[i] = lens.k[i];
    other.lens.raw = lens.raw;
    other.lens.rectified = lens.rectified;
    TEST_ASSERT_TRUE(oc_lens_is_equal(&lens, &other.lens));

    oc_lens_t changed[18];
    for (int i = 0; i < 18; i++) changed[i] = lens;
    for (int i = 0; i < 5; i++) changed[i].k[i] += 1e-12;
    changed[5].model = OC_LENS_FISHEYE;
    for (int i = 0; i < 2; i++) {
        oc_intrinsics_t *side[6];
        for (int j = 0; j < 6; j++) side[j] = i ? &changed[6 + 6 * i + j].rectified : &changed[6 + j].raw;
        side[0]->width_px++;
        side[1]->height_px++;
        side[2]->fx_px++;
        side[3]->fy_px++;
        side[4]->cx_px++;
        side[5]->cy_px++;
    }
    for (int i = 0; i < 18; i++) TEST_ASSERT_FALSE(oc_lens_is_equal(&lens, &changed[i]));
}

static void lenses_that_are_not_numbers_are_not_valid(void)
{
    const double bad[] = {(double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 5; j++) {
            oc_lens_t lens = plumb_bob(0, 0, 0, 0, 0);
            lens.k[j] = bad[i];
            TEST_ASSERT_FALSE(oc_lens_is_valid(&lens));
            TEST_ASSERT_EQUAL_DOUBLE(0, oc_lens_reach(&lens));
        }
    }
    oc_lens_t lens = plumb_bob(0, 0, 0, 0, 0);
    TEST_ASSERT_TRUE(oc_lens_is_valid(&lens));
    lens.rectified.fx_px = 0;
    TEST_ASSERT_FALSE(oc_lens_is_valid(&lens));
    lens = plumb_bob(0, 0, 0, 0, 0);
    lens.model = (oc_lens_model_t)3;
    TEST_ASSERT_FALSE(oc_lens_is_valid(&lens));
}

/* ---- reach ---- */

static void reach_is_the_closed_form_where_there_is_one(void)
{
    oc_lens_t lens = plumb_bob(-0.3, 0, 0, 0, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, sqrt(1 / 0.9), oc_lens_reach(&lens));
    /* 1 - 1.5 u + 0.5 u u = (1 - u) (2 - u) / 2: the first of two. */
    lens = plumb_bob(-0.5, 0.1, 0, 0, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, oc_lens_reach(&lens));
    /* (1 - u) (1 - u / 2) (1 - u / 3) = 1 - 11/6 u + u u - u u u / 6 */
    lens = plumb_bob(-11.0 / 18, 0.2, 0, 0, -1.0 / 42);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1, oc_lens_reach(&lens));
    lens = plumb_bob(0.3, 0.1, 0, 0, 0);
    TEST_ASSERT_EQUAL_DOUBLE(OC_MAX_LENS_REACH, oc_lens_reach(&lens));
    /* Only tangential: 1 = 6 p r. */
    lens = plumb_bob(0, 0, 0.03, -0.04, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, 1 / 0.3, oc_lens_reach(&lens));

    lens = fisheye(-1.0 / 3, 0, 0, 0);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, tan(1), oc_lens_reach(&lens));
    /* (1 - u) (1 - u / 2) (1 + u / 3) (1 + u / 4) */
    lens = fisheye(-11.0 / 36, -7.0 / 120, 1.0 / 42, 1.0 / 216);
    TEST_ASSERT_DOUBLE_WITHIN(1e-12, tan(1), oc_lens_reach(&lens));
    lens = fisheye(0.01, 0.002, 0, 0);
    TEST_ASSERT_TRUE(isinf(oc_lens_reach(&lens)));
    lens = oc_lens_pinhole(&k);
    TEST_ASSERT_TRUE(isinf(oc_lens_reach(&lens)));
}

/* The radius in the raw picture at a radius (a tangent) in the plane. */
static double raw_radius(const oc_lens_t *lens, double r, double towards)
{
    double x, y;
    oc_lens_t unit = *lens;
    unit.raw = unit.rectified = (oc_intrinsics_t){.fx_px = 1, .fy_px = 1};
    oc_lens_distort(&unit, r * cos(towards), r * sin(towards), &x, &y);
    return hypot(x, y);
}

/* Grows up to the reach, and no longer just behind it. */
static void check_growth(const oc_lens_t *lens, const char *what)
{
    const double reach = oc_lens_reach(lens), end = fmin(reach, 20);
    TEST_ASSERT_TRUE_MESSAGE(reach > 0, what);
    double last = 0;
    for (int i = 1; i <= 2000; i++) {
        const double radius = raw_radius(lens, end * i / 2000, 0.7);
        TEST_ASSERT_TRUE_MESSAGE(radius >= last * (1 - 1e-12), what);
        last = radius;
    }
    if (reach >= 20) return;
    /* The slope is 0 there: a thousandth further the radius must not be larger by more than a rounding. */
    TEST_ASSERT_TRUE_MESSAGE(raw_radius(lens, reach * 1.001, 0.7) <= last * (1 + 1e-7), what);
}

static void radii_grow_up_to_the_reach_and_not_beyond(void)
{
    seed(__func__);
    int n_ending = 0;
    for (int i = 0; i < 2000; i++) {
        char what[200];
        const oc_lens_t bob = plumb_bob(draw(), draw() * 0.6, 0, 0, draw() * 0.3);
        snprintf(what, sizeof what, "plumb-bob %.17g %.17g %.17g", bob.k[0], bob.k[1], bob.k[4]);
        check_growth(&bob, what);
        const oc_lens_t eye = fisheye(draw() * 0.4, draw() * 0.2, draw() * 0.1, draw() * 0.05);
        snprintf(what, sizeof what, "fisheye %.17g %.17g %.17g %.17g", eye.k[0], eye.k[1], eye.k[2], eye.k[3]);
        check_growth(&eye, what);
        n_ending += (oc_lens_reach(&bob) < 20) + (oc_lens_reach(&eye) < 20);
    }
    TEST_ASSERT_TRUE(n_ending > 1000 && n_ending < 3900);
}

/* det and trace of the Jacobian by central differences. */
static void jacobian(const oc_lens_t *lens, double x, double y, double *det, double *trace)
{
    oc_lens_t unit = *lens;
    unit.raw = unit.rectified = (oc_intrinsics_t){.fx_px = 1, .fy_px = 1};
    const double h = 1e-5;
    double a[2], b[2], c[2], d[2];
    oc_lens_distort(&unit, x + h, y, &a[0], &a[1]);
    oc_lens_distort(&unit, x - h, y, &b[0], &b[1]);
    oc_lens_distort(&unit, x, y + h, &c[0], &c[1]);
    oc_lens_distort(&unit, x, y - h, &d[0], &d[1]);
    const double xx = (a[0] - b[0]) / (2 * h), yx = (a[1] - b[1]) / (2 * h);
    const double xy = (c[0] - d[0]) / (2 * h), yy = (c[1] - d[1]) / (2 * h);
    *det = xx * yy - xy * yx;
    *trace = xx + yy;
}

static void no_fold_is_within_the_reach_of_a_decentred_lens(void)
{
    seed(__func__);
    int n_near = 0;
    for (int i = 0; i < 300; i++) {
        const oc_lens_t lens = plumb_bob(draw() * 0.5, draw() * 0.3, draw() * 0.1, draw() * 0.1, draw() * 0.1);
        const double reach = oc_lens_reach(&lens), end = fmin(reach, 5) * (1 - 1e-4);
        double least = 1;
        for (int j = 0; j < 400; j++) {
            const double r = end * (j / 20 + 1) / 20, towards = (j % 20) * M_PI / 10;
            double det, trace;
            jacobian(&lens, r * cos(towards), r * sin(towards), &det, &trace);
            TEST_ASSERT_TRUE(det > 0 && trace > 0);
            if (j >= 380) least = fmin(least, det / (trace * trace));
        }
        n_near += least < 0.02;
    }
    /* The bound is no excuse: for most lenses the edge of the disc is near the fold. */
    TEST_ASSERT_TRUE(n_near > 150);
}

static void beyond_the_reach_nothing_is_found(void)
{
    oc_lens_t lens = plumb_bob(-0.5, 0, 0, 0, 0); /* reach sqrt(2/3), back at the centre at sqrt(2) */
    lens.rectified.fx_px = lens.rectified.fy_px = 100;
    const double reach = oc_lens_reach(&lens);
    double raw_x = -7, raw_y = -7, x, y;
    const double back_at = k.cx_px + 100 * sqrt(2);
    oc_lens_distort(&lens, back_at, k.cy_px, &x, &y);
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, k.cx_px, x); /* the trap */
    TEST_ASSERT_FALSE(oc_lens_find(&lens, reach, back_at, k.cy_px, &raw_x, &raw_y));
    TEST_ASSERT_FALSE(oc_lens_find(&lens, reach, k.cx_px + 100 * reach + 1e-6, k.cy_px, &raw_x, &raw_y));
    TEST_ASSERT_EQUAL_DOUBLE(-7, raw_x);
    TEST_ASSERT_TRUE(oc_lens_find(&lens, reach, k.cx_px + 100 * reach - 1e-6, k.cy_px, &raw_x, &raw_y));
    TEST_ASSERT_DOUBLE_WITHIN(1e-9, k.cy_px, raw_y);
}

static void the_border_is_the_outermost_centre(void)
{
    oc_lens_t lens = oc_lens_pinhole(&k);
    double raw_x, raw_y;
    const double reach = oc_lens_reach(&lens);
    TEST_ASSERT_TRUE(oc_lens_find(&lens, reach, 639.001, -0.001, &raw_x, &raw_y));
    TEST_ASSERT_EQUAL_DOUBLE(639, raw_x);
    TEST_ASSERT_EQUAL_DOUBLE(0, raw_y);
    TEST_ASSERT_FALSE(oc_lens_find(&lens, reach, 639.003, 5, &raw_x, &raw_y));
    TEST_ASSERT_FALSE(oc_lens_find(&lens, reach, 5, -0.003, &raw_x, &raw_y));
    TEST_ASSERT_FALSE(oc_lens_find(&lens, reach, (double)NAN, 5, &raw_x, &raw_y));
    TEST_ASSERT_FALSE(oc_lens_find(&lens, reach, 5, (double)INFINITY, &raw_x, &raw_y));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(an_equidistant_lens_draws_angles);
    RUN_TEST(raw_and_rectified_have_their_own_intrinsics);
    RUN_TEST(only_a_lens_that_changes_nothing_is_the_identity);
    RUN_TEST(equality_sees_every_field_and_no_padding);
    RUN_TEST(lenses_that_are_not_numbers_are_not_valid);
    RUN_TEST(reach_is_the_closed_form_where_there_is_one);
    RUN_TEST(radii_grow_up_to_the_reach_and_not_beyond);
    RUN_TEST(no_fold_is_within_the_reach_of_a_decentred_lens);
    RUN_TEST(beyond_the_reach_nothing_is_found);
    RUN_TEST(the_border_is_the_outermost_centre);
    return UNITY_END();
}
