/* SPDX-License-Identifier: BSD-3-Clause
 * Small exact scenes of straight edges for the detector's tests: every pixel is a Gaussian-weighted mean of many
 * point samples of the true picture, so that edges are where they are said to be, to a hundredth of a pixel. */
#ifndef OUTCROP_TESTS_EDGE_SCENE_H
#define OUTCROP_TESTS_EDGE_SCENE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>

#define EDGE_PI 3.14159265358979323846

/* Point samples per pixel and direction, pixels of footprint to each side, and the optical blur. */
#define EDGE_SAMPLES 5
#define EDGE_REACH 2
#define EDGE_BLUR_PX 0.75

/* Grey level of the true picture at a point; integers are pixel centres. */
typedef double (*edge_level_t)(const void *scene, double x_px, double y_px);

/* Sectors of constant grey around one point. */
typedef struct edge_fan {
    double x_px, y_px;
    int n;               /* 2..4 */
    double angle_rad[4]; /* ascending in [0, 2 pi): sector i lies from angle i to the next */
    double level[4];
} edge_fan_t;

static inline double edge_fan_level(const void *scene, double x_px, double y_px)
{
    const edge_fan_t *fan = scene;
    double a = atan2(y_px - fan->y_px, x_px - fan->x_px);
    if (a < 0) a += 2 * EDGE_PI;
    int sector = fan->n - 1;
    for (int i = 0; i < fan->n; i++) {
        if (a >= fan->angle_rad[i]) sector = i;
    }
    return fan->level[sector];
}

typedef struct edge_triangle {
    double x_px[3], y_px[3]; /* clockwise as seen, y down */
    double inside, outside;
} edge_triangle_t;

static inline double edge_triangle_level(const void *scene, double x_px, double y_px)
{
    const edge_triangle_t *t = scene;
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3;
        const double cross =
            (t->x_px[j] - t->x_px[i]) * (y_px - t->y_px[i]) - (t->y_px[j] - t->y_px[i]) * (x_px - t->x_px[i]);
        if (cross < 0) return t->outside;
    }
    return t->inside;
}

/* A board of squares of side 1 seen through image -> board homography. */
typedef struct edge_board {
    double board_from_image[9]; /* row-major */
    double dark, bright;
} edge_board_t;

static inline double edge_board_level(const void *scene, double x_px, double y_px)
{
    const edge_board_t *b = scene;
    const double *h = b->board_from_image;
    const double w = h[6] * x_px + h[7] * y_px + h[8];
    const double u = floor((h[0] * x_px + h[1] * y_px + h[2]) / w);
    const double v = floor((h[3] * x_px + h[4] * y_px + h[5]) / w);
    return ((long)u + (long)v) % 2 == 0 ? b->dark : b->bright;
}

/* Weights of the samples across one pixel's footprint. */
#define EDGE_TAPS ((2 * EDGE_REACH + 1) * EDGE_SAMPLES)

/* The picture sampled once on the fine grid, then filtered separably. fine has
 * room for edge_fine_count(width, height) floats. */
static inline size_t edge_fine_count(int width_px, int height_px)
{
    return (size_t)(width_px + 2 * EDGE_REACH) * EDGE_SAMPLES * (size_t)(height_px + 2 * EDGE_REACH) * EDGE_SAMPLES;
}

static inline void edge_render(edge_level_t level, const void *scene, int width_px, int height_px, float *fine,
                               uint8_t *px)
{
    double weight[EDGE_TAPS], sum = 0;
    for (int i = 0; i < EDGE_TAPS; i++) {
        const double d = (i + 0.5) / EDGE_SAMPLES - EDGE_REACH - 0.5;
        weight[i] = exp(-0.5 * d * d / (EDGE_BLUR_PX * EDGE_BLUR_PX));
        sum += weight[i];
    }
    const int wide = (width_px + 2 * EDGE_REACH) * EDGE_SAMPLES;
    const int high = (height_px + 2 * EDGE_REACH) * EDGE_SAMPLES;
    for (int y = 0; y < high; y++) {
        for (int x = 0; x < wide; x++) {
            fine[(size_t)y * (size_t)wide + (size_t)x] = (float)level(
                scene, (x + 0.5) / EDGE_SAMPLES - EDGE_REACH - 0.5, (y + 0.5) / EDGE_SAMPLES - EDGE_REACH - 0.5);
        }
    }
    for (int y = 0; y < height_px; y++) {
        for (int x = 0; x < width_px; x++) {
            double total = 0;
            for (int j = 0; j < EDGE_TAPS; j++) {
                const float *row = fine + (size_t)(y * EDGE_SAMPLES + j) * (size_t)wide + (size_t)(x * EDGE_SAMPLES);
                double line = 0;
                for (int i = 0; i < EDGE_TAPS; i++) line += weight[i] * (double)row[i];
                total += weight[j] * line;
            }
            px[y * width_px + x] = (uint8_t)floor(total / (sum * sum) + 0.5);
        }
    }
}

/* Repeatable random numbers (xorshift); the seed belongs into every failure message. */
typedef struct edge_random {
    uint64_t state;
} edge_random_t;

static inline double edge_uniform(edge_random_t *random, double low, double high)
{
    random->state ^= random->state << 13;
    random->state ^= random->state >> 7;
    random->state ^= random->state << 17;
    return low + (high - low) * (double)(random->state >> 11) / 9007199254740992.0;
}

static inline double edge_normal(edge_random_t *random)
{
    double sum = -6.0;
    for (int i = 0; i < 12; i++) sum += edge_uniform(random, 0, 1);
    return sum;
}

static inline void edge_add_noise(edge_random_t *random, double variance, uint8_t *px, size_t count)
{
    const double sd = sqrt(variance);
    for (size_t i = 0; i < count; i++) {
        const double v = px[i] + sd * edge_normal(random);
        px[i] = (uint8_t)(v < 0 ? 0 : v > 255 ? 255 : floor(v + 0.5));
    }
}

/* Difference of two directions, 0..pi. */
static inline double edge_between(double a, double b)
{
    const double d = fmod(fabs(a - b), 2 * EDGE_PI);
    return d > EDGE_PI ? 2 * EDGE_PI - d : d;
}

#endif
