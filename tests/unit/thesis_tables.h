/* SPDX-License-Identifier: BSD-3-Clause
 * The cameras, boxes and result tables that the thesis prints, and a random
 * generator with a printed seed, for the tests of core's geometry.
 *
 * Lengths as printed: millimetres and degrees. oc_test_camera gives metres. */
#ifndef OUTCROP_UNIT_THESIS_TABLES_H
#define OUTCROP_UNIT_THESIS_TABLES_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>

#include "core/camera.h"
#include "core/mat3.h"

#define OC_TEST_PI 3.14159265358979323846
#define OC_TEST_RAD(degrees) ((degrees)*OC_TEST_PI / 180.0)
#define OC_TEST_DEG(radians) ((radians)*180.0 / OC_TEST_PI)

/* ---- cameras ---- */

#define OC_TEST_FORMAT_WIDTH_MM 3.5311
#define OC_TEST_FORMAT_HEIGHT_MM 2.7446

typedef enum oc_test_angles { OC_TEST_OPK, OC_TEST_TILT_PAN_SWING } oc_test_angles_t;

/* One row: X Y Z in mm, three angles in degrees. */
typedef struct oc_test_table {
    double focal_mm;
    oc_test_angles_t angles;
    int n;
    double row[8][6];
} oc_test_table_t;

/* Table 5.1, "box". */
static const oc_test_table_t table_5_1 = {4.3,
                                          OC_TEST_OPK,
                                          2,
                                          {{-1535.2119, 1720.8447, 1693.2169, -35.1616, -46.7723, -155.5747},
                                           {-1694.5607, -142.2461, 1585.1900, 25.0285, -55.5578, -47.0806}}};

/* Table 5.2, "cubes". */
static const oc_test_table_t table_5_2 = {6.0,
                                          OC_TEST_OPK,
                                          2,
                                          {{-114.7469, 398.9921, 355.3564, -52.2783, -17.0877, 162.6817},
                                           {-206.6808, 372.5378, 351.6793, -49.5184, -27.0316, -132.0044}}};

/* Table 7.1, "cubes", columns tilt, pan, swing; rows a..h. */
static const oc_test_table_t table_7_1 = {6.0,
                                          OC_TEST_TILT_PAN_SWING,
                                          8,
                                          {{555.2359, -325.3561, 431.4782, 58.4021, -53.0427, 25.941},
                                           {493.0843, 132.5351, 420.7934, 48.8943, -105.8211, -0.3921},
                                           {203.3010, 362.9578, 451.3856, 39.7229, -155.3958, -4.9299},
                                           {-134.3809, 429.7352, 466.3157, 43.145, 156.3501, 0.3174},
                                           {-114.7469, 398.9921, 355.3564, 54.2098, 158.7623, -30.1229},
                                           {-206.6808, 372.5378, 351.6793, 54.6702, 146.1463, 26.7937},
                                           {-334.0451, 220.6162, 461.5761, 43.56479, 122.0288, 9.8471},
                                           {-258.2932, -274.7759, 472.1151, 41.5558, 48.6178, 20.7127}}};

/* Table 7.3, two obstacles; rows a..h. */
static const oc_test_table_t table_7_3 = {3.6,
                                          OC_TEST_OPK,
                                          8,
                                          {{-386.8721, 91.3538, 761.4270, 2.5962, -30.9155, -83.5224},
                                           {83.8084, -317.5293, 763.2127, 30.5821, -0.6745, 0.3239},
                                           {351.8765, -349.7548, 749.8407, 29.6836, 12.3346, 21.0880},
                                           {509.2151, -238.6600, 742.8595, 24.9641, 23.0747, 40.9618},
                                           {620.7139, 77.2922, 742.3834, 7.5144, 32.0715, 82.2833},
                                           {577.4111, 422.3900, 753.2084, -15.2744, 28.9333, 125.6392},
                                           {170.9942, 657.6221, 752.5581, -31.5844, -7.1256, -165.1466},
                                           {-220.2339, 531.4125, 755.2014, -21.5670, -22.6891, -130.9459}}};

/* Table 7.4, min and max of both boxes, mm. (Box 2's min y, printed 366.2b, is
 * any value in [364.56, 366.56).) */
static const double table_7_4_min_mm[2][3] = {{-24.12, -193.87, 0.00}, {206.97, 366.25, 6.52}};
static const double table_7_4_max_mm[2][3] = {{178.79, -53.21, 189.48}, {369.81, 498.56, 112.90}};

static inline void oc_test_thesis_rotation(const oc_test_table_t *table, int row, double R_th[9])
{
    const double *a = table->row[row] + 3;
    if (table->angles == OC_TEST_OPK) {
        oc_thesis_from_opk(OC_TEST_RAD(a[0]), OC_TEST_RAD(a[1]), OC_TEST_RAD(a[2]), R_th);
    } else {
        oc_thesis_from_pts(OC_TEST_RAD(a[1]), OC_TEST_RAD(a[0]), OC_TEST_RAD(a[2]), R_th);
    }
}

/* Camera of a row, 640x480, metres. */
static inline oc_camera_t oc_test_camera(const oc_test_table_t *table, int row)
{
    oc_camera_t camera;
    double R[9], centre[3];
    oc_test_thesis_rotation(table, row, R);
    oc_cv_from_thesis(R, R);
    for (int i = 0; i < 3; i++) centre[i] = table->row[row][i] / 1000.0;
    camera.k = oc_intrinsics_from_format(table->focal_mm, OC_TEST_FORMAT_WIDTH_MM, OC_TEST_FORMAT_HEIGHT_MM, 640, 480);
    oc_pose_from_centre(R, centre, &camera.pose);
    return camera;
}

/* The five pairs of views that the thesis matches. */
typedef struct oc_test_pair {
    const char *name;
    const oc_test_table_t *table;
    int left, right;
} oc_test_pair_t;

static const oc_test_pair_t thesis_pairs[5] = {{"box a-b", &table_5_1, 0, 1},
                                               {"cubes e-f", &table_7_1, 4, 5},
                                               {"cubes a-b", &table_7_1, 0, 1},
                                               {"two f-g", &table_7_3, 5, 6},
                                               {"two h-a", &table_7_3, 7, 0}};

/* ---- result tables: matches in all, correct, printed percentage ---- */

typedef struct oc_test_share {
    int n, correct;
    double printed_percent;
} oc_test_share_t;

/* Table 4.1, windows 11..25 by 2, thresholds 0.50..0.70 by 0.05. */
static const oc_test_share_t table_4_1[8][5] = {
    {{65, 49, 75.4}, {58, 47, 81.0}, {51, 43, 84.3}, {47, 40, 85.1}, {34, 29, 85.3}},
    {{58, 47, 81.0}, {55, 46, 83.6}, {51, 44, 93.6}, {45, 40, 88.9}, {39, 35, 89.7}},
    {{57, 47, 82.5}, {53, 46, 86.8}, {48, 44, 91.7}, {46, 43, 93.5}, {37, 34, 91.9}},
    {{57, 50, 87.7}, {48, 46, 93.8}, {46, 43, 93.5}, {44, 41, 93.2}, {35, 32, 91.4}},
    {{53, 50, 94.3}, {51, 49, 96.1}, {44, 42, 95.5}, {43, 42, 97.7}, {34, 33, 97.1}},
    {{54, 51, 94.4}, {52, 50, 96.2}, {47, 45, 95.7}, {40, 38, 95.0}, {30, 30, 100.0}},
    {{56, 53, 94.6}, {52, 50, 96.2}, {50, 49, 98.0}, {39, 39, 100.0}, {34, 34, 100.0}},
    {{56, 53, 89.3}, {52, 46, 88.7}, {46, 43, 93.5}, {39, 38, 97.4}, {32, 32, 100.0}}};

/* Table 5.3, windows 11..17 by 2, thresholds 0.50..0.75 by 0.05. */
static const oc_test_share_t table_5_3[4][6] = {
    {{44, 40, 90.9}, {40, 37, 92.5}, {35, 33, 94.3}, {27, 25, 92.6}, {23, 21, 91.3}, {16, 16, 100.0}},
    {{42, 36, 85.7}, {38, 34, 89.5}, {35, 32, 91.4}, {28, 27, 96.4}, {23, 22, 91.7}, {17, 17, 100.0}},
    {{40, 36, 90.0}, {34, 33, 97.1}, {33, 33, 100.0}, {28, 28, 100.0}, {20, 20, 100.0}, {18, 18, 100.0}},
    {{38, 36, 94.7}, {35, 35, 100.0}, {33, 33, 100.0}, {26, 26, 100.0}, {20, 20, 100.0}, {18, 18, 100.0}}};

/* Table 7.2: pans of the cameras a..h in the map, of the frames i..xii, and the
 * cameras the thesis chose. The angle of the map, to more digits than printed. */
#define OC_TEST_THETA_7_2_DEG (-43.5498)
static const double table_7_2_pan_deg[8] = {350.5071, 297.7287, 248.1540, 199.8999,
                                            202.3121, 189.6961, 165.5786, 92.1676};
static const double table_7_2_frame_deg[12] = {230, 230, 240, 200, 200, 195, 205, 210, 210, 185, 185, 180};
static const char table_7_2_chosen[13] = "cccdddeeefff";

/* ---- random numbers ---- */

/* splitmix64; the tests set the seed in setUp and print it when they fail. */
typedef struct oc_test_random {
    uint64_t seed, state;
} oc_test_random_t;

static inline oc_test_random_t oc_test_random_from(uint64_t seed)
{
    const oc_test_random_t r = {seed, seed};
    return r;
}

/* Uniform in [low, high). */
static inline double oc_test_uniform(oc_test_random_t *r, double low, double high)
{
    uint64_t z = (r->state += 0x9E3779B97F4A7C15u);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    z ^= z >> 31;
    return low + (high - low) * (double)(z >> 11) / 9007199254740992.0;
}

static inline double oc_test_normal(oc_test_random_t *r)
{
    const double u = 1.0 - oc_test_uniform(r, 0.0, 1.0);
    return sqrt(-2.0 * log(u)) * cos(2.0 * OC_TEST_PI * oc_test_uniform(r, 0.0, 1.0));
}

/* For TEST_ASSERT_..._MESSAGE: which draw failed. Static buffer, one at a time. */
static inline const char *oc_test_draw(const oc_test_random_t *r, int draw)
{
    static char text[64];
    snprintf(text, sizeof text, "seed %llu, draw %d", (unsigned long long)r->seed, draw);
    return text;
}

/* ---- comparisons ---- */

/* Largest difference of two 3x3 matrices that are each only known up to scale
 * and sign: both brought to unit norm with a positive largest element. */
static inline double oc_test_scaled_difference(const double a[9], const double b[9])
{
    int largest = 0;
    for (int i = 1; i < 9; i++) {
        if (fabs(a[i]) > fabs(a[largest])) largest = i;
    }
    const double sa = oc_mat3_norm(a) * (a[largest] < 0.0 ? -1.0 : 1.0);
    const double sb = oc_mat3_norm(b) * (b[largest] < 0.0 ? -1.0 : 1.0);
    double worst = 0.0;
    for (int i = 0; i < 9; i++) worst = fmax(worst, fabs(a[i] / sa - b[i] / sb));
    return worst;
}

static inline double oc_test_difference(const double *a, const double *b, int n)
{
    double worst = 0.0;
    for (int i = 0; i < n; i++) worst = fmax(worst, fabs(a[i] - b[i]));
    return worst;
}

#endif
