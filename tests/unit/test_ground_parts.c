/* SPDX-License-Identifier: BSD-3-Clause
 * The parts of the ground filter against what they should be: closed forms,
 * plain loops, and pictures whose shift is known. */
#include "unity.h"

#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "core/mat3.h"
#include "core/plane.h"
#include "thesis_tables.h"
#include "vehicle/ground_internal.h"

#define SIDE_PX 200u
#define WINDOW_PX 17u

static uint8_t left_px[SIDE_PX * SIDE_PX], right_px[SIDE_PX * SIDE_PX];
static const oc_image_t left_image = {left_px, SIDE_PX, SIDE_PX, SIDE_PX, 1};
static const oc_image_t right_image = {right_px, SIDE_PX, SIDE_PX, SIDE_PX, 1};
static const double same[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
static const ground_photo_t clean = {.noise_sd = 0.0, .is_smooth = false};

static oc_ground_ws_t ws;
static oc_ground_params_t params;
static oc_test_random_t random_;

/* A picture as a function of the place: waves of random direction, 5 to 20 px long. */
#define N_WAVES 24
static double wave_x[N_WAVES], wave_y[N_WAVES], wave_phase[N_WAVES];

void setUp(void)
{
    params = oc_ground_defaults();
    random_ = oc_test_random_from(470);
    for (int k = 0; k < N_WAVES; k++) {
        const double angle = oc_test_uniform(&random_, 0.0, 6.2831853), length = oc_test_uniform(&random_, 5.0, 20.0);
        wave_x[k] = 6.2831853 / length * cos(angle);
        wave_y[k] = 6.2831853 / length * sin(angle);
        wave_phase[k] = oc_test_uniform(&random_, 0.0, 6.2831853);
    }
}

void tearDown(void) {}

static double texture(double x, double y)
{
    double sum = 0.0;
    for (int k = 0; k < N_WAVES; k++) sum += sin(wave_x[k] * x + wave_y[k] * y + wave_phase[k]);
    return sum; /* standard deviation sqrt(N_WAVES / 2) */
}

static double gaussian(void)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++) sum += oc_test_uniform(&random_, 0.0, 1.0);
    return sum;
}

/* px(x, y) = mean + contrast * texture(H (x, y)) + noise. */
static void render(uint8_t *px, const double H[9], double mean, double contrast, double noise)
{
    for (uint32_t y = 0; y < SIDE_PX; y++) {
        for (uint32_t x = 0; x < SIDE_PX; x++) {
            double u, v;
            TEST_ASSERT_TRUE(oc_homography_apply(H, x, y, &u, &v) > 0.0);
            const double value = mean + contrast * texture(u, v) + (noise > 0.0 ? noise * gaussian() : 0.0);
            px[y * SIDE_PX + x] = (uint8_t)(value < 0.0 ? 0.0 : (value > 255.0 ? 255.0 : value + 0.5));
        }
    }
}

/* ---- windows ---- */

static double bilinear(const oc_image_t *image, double x, double y)
{
    const uint32_t ix = (uint32_t)x, iy = (uint32_t)y;
    const uint8_t *p = image->px + iy * image->stride_bytes + ix;
    const double ax = x - ix, ay = y - iy;
    return (1 - ay) * ((1 - ax) * p[0] + ax * p[1]) +
           ay * ((1 - ax) * p[image->stride_bytes] + ax * p[image->stride_bytes + 1]);
}

static void patches_are_the_image_of_zero_mean_and_unit_length(void)
{
    render(left_px, same, 128, 12, 3);
    for (int draw = 0; draw < 50; draw++) {
        const double at[2] = {oc_test_uniform(&random_, 10, 185), oc_test_uniform(&random_, 10, 185)};
        const uint32_t n = 7u + 2u * (uint32_t)oc_test_uniform(&random_, 0, 5.99);
        ground_patch_t patch;
        TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, at, n, false, &patch));
        double values[OC_MAX_GROUND_WINDOW_PX * OC_MAX_GROUND_WINDOW_PX], mean = 0, length2 = 0;
        for (uint32_t k = 0; k < n * n; k++) {
            values[k] = bilinear(&left_image, at[0] + (double)(k % n) - n / 2u, at[1] + (double)(k / n) - n / 2u);
            mean += values[k] / (n * n);
        }
        for (uint32_t k = 0; k < n * n; k++) length2 += (values[k] - mean) * (values[k] - mean);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, sqrt(length2 / (n * n)), (double)patch.sd);
        for (uint32_t k = 0; k < n * n; k++) {
            const double expected = (values[k] - mean) / sqrt(length2);
            const double found = (double)patch.v[k / n * GROUND_PATCH_STRIDE + k % n];
            TEST_ASSERT_TRUE_MESSAGE(fabs(expected - found) < 1e-5, oc_test_draw(&random_, draw));
        }
        for (uint32_t c = n; c < GROUND_PATCH_STRIDE; c++) TEST_ASSERT_TRUE(patch.v[c] == 0.0f);
    }
}

static void windows_stop_at_the_image(void)
{
    ground_patch_t patch;
    render(left_px, same, 128, 12, 0);
    const double half = WINDOW_PX / 2u, last = SIDE_PX - 1.0; /* NOLINT(bugprone-integer-division) */
    const double good[2][2] = {{half + 0.02, half + 0.02}, {last - half - 0.02, last - half - 0.02}};
    const double bad[5][2] = {
        {half - 0.1, 50}, {50, half - 0.1}, {last - half + 0.1, 50}, {50, last - half + 0.1}, {(double)NAN, 50}};
    for (int i = 0; i < 2; i++) TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, good[i], WINDOW_PX, false, &patch));
    for (int i = 0; i < 5; i++) TEST_ASSERT_FALSE(oc_ground_patch_take(&left_image, bad[i], WINDOW_PX, false, &patch));
    memset(left_px, 77, sizeof left_px);
    const double middle[2] = {100, 100};
    TEST_ASSERT_FALSE(oc_ground_patch_take(&left_image, middle, WINDOW_PX, false, &patch)); /* flat */
}

/* Anchored at a wrong place the correlation must be that of a plain double loop there. */
static void correlation_is_that_of_plain_loops(void)
{
    const double H[9] = {0.95, 0.1, 4.0, -0.08, 1.05, 6.0, 2e-4, -1e-4, 1.0};
    double inverse[9];
    TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(H, inverse));
    render(left_px, same, 128, 12, 0);
    render(right_px, inverse, 128, 12, 0);
    int n_compared = 0;
    for (int draw = 0; draw < 60; draw++) {
        const double at[2] = {oc_test_uniform(&random_, 40, 150), oc_test_uniform(&random_, 40, 150)};
        ground_patch_t patch;
        double to[2], sum_b = 0, sum_bb = 0, sum_ab = 0;
        TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, at, WINDOW_PX, false, &patch));
        TEST_ASSERT_TRUE(oc_homography_apply(H, at[0], at[1], &to[0], &to[1]) > 0.0);
        const double off[2] = {oc_test_uniform(&random_, -1, 1), oc_test_uniform(&random_, -1, 1)};
        const double anchor[2] = {to[0] + off[0], to[1] + off[1]};
        for (uint32_t k = 0; k < WINDOW_PX * WINDOW_PX; k++) {
            const uint32_t r = k / WINDOW_PX, c = k % WINDOW_PX;
            double x, y;
            (void)oc_homography_apply(H, at[0] + c - 8.0, at[1] + r - 8.0, &x, &y);
            const double b = bilinear(&right_image, x + off[0], y + off[1]);
            sum_b += b;
            sum_bb += b * b;
            sum_ab += b * (double)patch.v[r * GROUND_PATCH_STRIDE + c];
        }
        const double n = WINDOW_PX * WINDOW_PX, expected = sum_ab / sqrt(sum_bb - sum_b * sum_b / n);
        const float found = oc_ground_correlate(&patch, at, &right_image, H, anchor);
        if (found < 0.0f) continue; /* hopeless at first sight */
        n_compared++;
        TEST_ASSERT_TRUE_MESSAGE(fabs((double)found - expected) < 1e-3, oc_test_draw(&random_, draw));
    }
    TEST_ASSERT_GREATER_THAN(40, n_compared);
}

/* ---- look-ups ---- */

static void known_shifts_are_found_to_hundredths(void)
{
    const double H[9] = {0.9, 0.2, 10.0, -0.15, 1.1, 5.0, 3e-4, 1e-4, 1.0};
    for (int draw = 0; draw < 24; draw++) {
        const double angle = oc_test_uniform(&random_, 0, 6.2831853), far = oc_test_uniform(&random_, 0, 2.2);
        const double shift[2] = {far * cos(angle), far * sin(angle)};
        /* The right picture shows at H (p + shift) what the left shows at p. */
        const double move[9] = {1, 0, shift[0], 0, 1, shift[1], 0, 0, 1};
        double moved[9], inverse[9];
        oc_mat3_mul(H, move, moved);
        TEST_ASSERT_EQUAL(OC_OK, oc_mat3_inverse(moved, inverse));
        render(left_px, same, 128, 12, 0);
        render(right_px, inverse, 90, 8, 0); /* darker and flatter as well */
        const double at[2] = {oc_test_uniform(&random_, 60, 130), oc_test_uniform(&random_, 60, 130)};
        for (int smooth = 0; smooth < 2; smooth++) {
            const ground_photo_t photo = {.noise_sd = 0.0, .is_smooth = smooth == 1};
            ground_patch_t patch;
            ground_lookup_t found;
            TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, at, WINDOW_PX, photo.is_smooth, &patch));
            oc_ground_look_up(&patch, at, &right_image, H, &photo, &found);
            TEST_ASSERT_TRUE_MESSAGE(found.is_inside && !found.is_at_border, oc_test_draw(&random_, draw));
            TEST_ASSERT_TRUE_MESSAGE(found.ncc > 0.97f && found.worst_block > 0.7f, oc_test_draw(&random_, draw));
            const double error = hypot((double)found.shift_px[0] - shift[0], (double)found.shift_px[1] - shift[1]);
            TEST_ASSERT_TRUE_MESSAGE(error < 0.05, oc_test_draw(&random_, draw));
        }
    }
}

static void what_is_farther_than_the_search_is_not_found(void)
{
    const double at[2] = {100, 100}, move[9] = {1, 0, -5.5, 0, 1, 0, 0, 0, 1};
    ground_patch_t patch;
    ground_lookup_t found;
    render(left_px, same, 128, 12, 0);
    render(right_px, move, 128, 12, 0);
    TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, at, WINDOW_PX, false, &patch));
    oc_ground_look_up(&patch, at, &right_image, same, &clean, &found);
    TEST_ASSERT_TRUE(found.is_inside);
    TEST_ASSERT_TRUE(found.is_at_border || found.ncc < 0.7f);
    const double edge[2] = {11.02, 100}; /* the patch fits, the search round it does not */
    TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, edge, WINDOW_PX, false, &patch));
    oc_ground_look_up(&patch, edge, &right_image, same, &clean, &found);
    TEST_ASSERT_TRUE(found.is_inside);
    const double over[2] = {10.98, 100};
    TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, over, WINDOW_PX, false, &patch));
    oc_ground_look_up(&patch, over, &right_image, same, &clean, &found);
    TEST_ASSERT_FALSE(found.is_inside);
}

/* One ninth of the window shows something else: hardly seen in the whole, plain in the worst block. */
static void a_foreign_ninth_is_seen(void)
{
    const double at[2] = {100, 100};
    ground_patch_t patch;
    ground_lookup_t same_everywhere, foreign;
    render(left_px, same, 128, 12, 0);
    memcpy(right_px, left_px, sizeof left_px);
    TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, at, WINDOW_PX, false, &patch));
    oc_ground_look_up(&patch, at, &right_image, same, &clean, &same_everywhere);
    for (uint32_t y = 92; y < 97; y++) {
        for (uint32_t x = 92; x < 97; x++) right_px[y * SIDE_PX + x] = left_px[(y + 57) * SIDE_PX + x + 41];
    }
    oc_ground_look_up(&patch, at, &right_image, same, &clean, &foreign);
    TEST_ASSERT_TRUE(same_everywhere.worst_block > 0.99f && same_everywhere.ncc > 0.999f);
    TEST_ASSERT_TRUE(foreign.ncc > 0.8f);
    TEST_ASSERT_TRUE(foreign.worst_block < 0.3f);
}

/* The spread of the found shift over draws of the noise is what the look-up says it is, within a factor of 2. */
static void shifts_scatter_as_their_covariance_says(void)
{
    const double at[2] = {100, 100};
    double sum2 = 0, said2 = 0;
    enum { N = 40 };
    for (int draw = 0; draw < N; draw++) {
        ground_patch_t patch;
        ground_lookup_t found;
        render(left_px, same, 128, 12, 6);
        render(right_px, same, 128, 12, 6);
        TEST_ASSERT_TRUE(oc_ground_patch_take(&left_image, at, WINDOW_PX, false, &patch));
        oc_ground_look_up(&patch, at, &right_image, same, &clean, &found);
        TEST_ASSERT_FALSE(found.is_at_border);
        sum2 += (double)(found.shift_px[0] * found.shift_px[0] + found.shift_px[1] * found.shift_px[1]) / N;
        said2 += (double)(found.cov_px2[0] + found.cov_px2[2]) / N;
    }
    char text[80];
    snprintf(text, sizeof text, "scatter %.4f px, said %.4f px, seed 470", sqrt(sum2), sqrt(said2));
    TEST_ASSERT_TRUE_MESSAGE(sum2 < 4.0 * said2 && said2 < 4.0 * sum2, text);
}

static void noise_is_measured(void)
{
    for (double noise = 1.0; noise <= 12.0; noise *= 1.7) {
        render(left_px, same, 128, 4, noise);
        const double found = oc_ground_noise_sd(&left_image);
        char text[64];
        snprintf(text, sizeof text, "true %.2f, found %.2f", noise, found);
        TEST_ASSERT_TRUE_MESSAGE(fabs(found - noise) < 0.25 * noise + 0.6, text);
    }
    memset(left_px, 9, sizeof left_px);
    TEST_ASSERT_TRUE(oc_ground_noise_sd(&left_image) == 0.0);
    for (uint32_t i = 0; i < SIDE_PX * SIDE_PX; i++) left_px[i] = (i / SIDE_PX + i % SIDE_PX) % 2u ? 255 : 0;
    TEST_ASSERT_TRUE(oc_ground_noise_sd(&left_image) < 300.0);
}

/* ---- the homography ---- */

static void gain_is_the_integral_it_claims_to_be(void)
{
    const double k = sqrt(9.21), tail = erfc(k / sqrt(2.0));
    enum { N = 20000 };
    static double rho[N + 1];
    for (int i = 0; i < N; i++) {
        const double a = k * i / N, b = k * (i + 1) / N;
        rho[i + 1] = rho[i] + 0.5 * (a * (erfc(a / sqrt(2.0)) - tail) + b * (erfc(b / sqrt(2.0)) - tail)) * (b - a);
    }
    double before = 2.0;
    for (int i = 0; i <= 320; i++) {
        const double share = i / 320.0, gain = oc_ground_gain(share);
        const double exact = 1.0 - rho[(int)(N * sqrt(share) + 0.5)] / rho[N];
        TEST_ASSERT_TRUE(fabs(gain - exact) < 0.012); /* straight between 33 points */
        TEST_ASSERT_TRUE(gain <= before);
        before = gain;
    }
    TEST_ASSERT_TRUE(oc_ground_gain(0.0) == 1.0);
    TEST_ASSERT_TRUE(oc_ground_gain(1.0) == 0.0);
    TEST_ASSERT_TRUE(oc_ground_gain((double)INFINITY) == 0.0);
    TEST_ASSERT_TRUE(oc_ground_gain((double)NAN) == 0.0);
}

static oc_ground_view_t view_of(uint16_t id, const oc_camera_t *camera)
{
    oc_ground_view_t view = {.view = id, .grey = {left_px, 640, 480, 640, 1}, .camera = *camera};
    for (int k = 0; k < 3; k++) {
        view.margin.v[k] = 0.01;
        view.margin.v[3 + k] = OC_TEST_RAD(1.0);
    }
    return view;
}

static void perturb(oc_ground_view_t *view)
{
    oc_pose6_t six;
    oc_pose_to_6(&view->camera.pose, &six);
    for (int k = 0; k < 6; k++) six.v[k] += oc_test_uniform(&random_, -1.0, 1.0) * view->margin.v[k];
    oc_pose_from_6(&six, &view->camera.pose);
}

/* Pins of the true homography with noise; every other one within n_wild anywhere. */
static void pins_make(const double H[9], uint32_t n, uint32_t n_wild, double sigma_px)
{
    ws.n_pins = 0;
    while (ws.n_pins < n) {
        const double x = oc_test_uniform(&random_, 0, 640), y = oc_test_uniform(&random_, 0, 480);
        double x2, y2;
        if (!(oc_homography_apply(H, x, y, &x2, &y2) > 0.0)) continue;
        if (!(x2 >= 0 && y2 >= 0 && x2 < 640 && y2 < 480)) continue;
        x2 += sigma_px * gaussian();
        y2 += sigma_px * gaussian();
        if (ws.n_pins % 2u == 1u && ws.n_pins < 2u * n_wild) {
            x2 = oc_test_uniform(&random_, 0, 640);
            y2 = oc_test_uniform(&random_, 0, 480);
        }
        ws.pins[ws.n_pins++] =
            (oc_ground_pin_t){(float)x, (float)y, (float)x2, (float)y2, (float)(sigma_px * sigma_px)};
    }
}

static void ransac_finds_the_pins_that_agree(void)
{
    const oc_camera_t a = oc_test_camera(&table_7_3, 4), b = oc_test_camera(&table_7_3, 5);
    const oc_ground_view_t left = view_of(1, &a), right = view_of(2, &b);
    double H[9];
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&a, &b, H));
    for (int draw = 0; draw < 10; draw++) {
        pins_make(H, 120, 50, 0.7);
        (void)oc_ground_ransac(&ws, &params, &left, &right);
        int n_good = 0, n_wild = 0;
        for (uint32_t i = 0; i < ws.n_pins; i++) {
            const bool is_wild = i % 2u == 1u && i < 100u;
            n_good += !is_wild && ws.is_inlier[i];
            n_wild += is_wild && ws.is_inlier[i];
        }
        TEST_ASSERT_TRUE_MESSAGE(n_good >= 66, oc_test_draw(&random_, draw)); /* of 70 */
        TEST_ASSERT_TRUE_MESSAGE(n_wild <= 2, oc_test_draw(&random_, draw));
    }
}

static void pins_that_say_nothing_are_survived(void)
{
    const oc_camera_t a = oc_test_camera(&table_7_3, 4), b = oc_test_camera(&table_7_3, 5);
    const oc_ground_view_t left = view_of(1, &a), right = view_of(2, &b);
    ground_pair_t pair;
    oc_ground_result_t result = {.n_inliers = 0};
    for (int fault = 0; fault < 5; fault++) {
        ws.n_pins = fault == 0 ? 0 : (fault == 1 ? 3 : 40);
        for (uint32_t i = 0; i < ws.n_pins; i++) {
            const float t = (float)i;
            ws.pins[i] = (oc_ground_pin_t){t, 2.0f * t, 3.0f * t, t, 1.0f};                         /* on a line */
            if (fault == 3) ws.pins[i] = (oc_ground_pin_t){5.0f, 5.0f, 9.0f, 9.0f, 1.0f};           /* one place */
            if (fault == 4) ws.pins[i].x2_px = ws.pins[i].y2_px = (float)(i % 2u ? NAN : INFINITY); /* no numbers */
        }
        TEST_ASSERT_FALSE(oc_ground_fit(&ws, &params, &left, &right, &pair, &result));
    }
}

/* The fit from wrong poses is right to hundredths of a pixel, and as right as its covariance says. */
static void fitted_pairs_err_as_their_covariance_says(void)
{
    const oc_camera_t a = oc_test_camera(&table_7_3, 4), b = oc_test_camera(&table_7_3, 5);
    double H[9], d2 = 0, worst = 0;
    int n = 0;
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&a, &b, H));
    for (int draw = 0; draw < 25; draw++) {
        oc_ground_view_t left = view_of(1, &a), right = view_of(2, &b);
        ground_pair_t pair;
        oc_ground_result_t result;
        perturb(&left);
        perturb(&right);
        pins_make(H, 80, 0, 0.15);
        TEST_ASSERT_TRUE_MESSAGE(oc_ground_fit(&ws, &params, &left, &right, &pair, &result),
                                 oc_test_draw(&random_, draw));
        for (double y = 100; y < 480; y += 120) {
            double x1, y1, x2, y2, cov[3];
            TEST_ASSERT_TRUE(oc_homography_apply(H, 320, y, &x1, &y1) > 0.0);
            TEST_ASSERT_TRUE(oc_homography_apply(pair.H, 320, y, &x2, &y2) > 0.0);
            TEST_ASSERT_TRUE(oc_ground_transfer_covariance(&pair, 320, y, cov));
            const double e[2] = {x2 - x1, y2 - y1}, det = cov[0] * cov[2] - cov[1] * cov[1];
            TEST_ASSERT_TRUE(cov[0] > 0.0 && cov[2] > 0.0 && det > 0.0);
            d2 += (cov[2] * e[0] * e[0] - 2.0 * cov[1] * e[0] * e[1] + cov[0] * e[1] * e[1]) / det;
            worst = fmax(worst, hypot(e[0], e[1]));
            n++;
        }
    }
    char text[80];
    snprintf(text, sizeof text, "d2 %.2f of 2 over %d, worst %.3f px, seed 470", d2 / n, n, worst);
    TEST_ASSERT_TRUE_MESSAGE(d2 / n > 0.7 && d2 / n < 4.0, text);
    TEST_ASSERT_TRUE_MESSAGE(worst < 0.3, text);
}

/* A plane 10 margins above the ground pulls the poses farther than they can be off. */
static void planes_above_the_ground_are_refused_by_the_margins(void)
{
    const oc_camera_t a = oc_test_camera(&table_7_3, 4), b = oc_test_camera(&table_7_3, 5);
    const oc_plane_t table = {.n = {0, 0, 1}, .d_m = -0.1};
    oc_ground_view_t left = view_of(1, &a), right = view_of(2, &b);
    double H[9];
    ground_pair_t pair;
    oc_ground_result_t result;
    for (int k = 3; k < 6; k++) left.margin.v[k] = right.margin.v[k] = OC_TEST_RAD(0.3);
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_homography(&a, &b, &table, H, NULL));
    pins_make(H, 100, 0, 0.3);
    TEST_ASSERT_FALSE(oc_ground_fit(&ws, &params, &left, &right, &pair, &result));
    TEST_ASSERT_EQUAL(OC_OK, oc_plane_ground_homography(&a, &b, H));
    pins_make(H, 100, 0, 0.3);
    TEST_ASSERT_TRUE(oc_ground_fit(&ws, &params, &left, &right, &pair, &result));
}

int main(void)
{
    UNITY_BEGIN();
    RUN_TEST(patches_are_the_image_of_zero_mean_and_unit_length);
    RUN_TEST(windows_stop_at_the_image);
    RUN_TEST(correlation_is_that_of_plain_loops);
    RUN_TEST(known_shifts_are_found_to_hundredths);
    RUN_TEST(what_is_farther_than_the_search_is_not_found);
    RUN_TEST(a_foreign_ninth_is_seen);
    RUN_TEST(shifts_scatter_as_their_covariance_says);
    RUN_TEST(noise_is_measured);
    RUN_TEST(gain_is_the_integral_it_claims_to_be);
    RUN_TEST(ransac_finds_the_pins_that_agree);
    RUN_TEST(pins_that_say_nothing_are_survived);
    RUN_TEST(fitted_pairs_err_as_their_covariance_says);
    RUN_TEST(planes_above_the_ground_are_refused_by_the_margins);
    return UNITY_END();
}
