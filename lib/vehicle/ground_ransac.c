/* SPDX-License-Identifier: BSD-3-Clause
 * RANSAC for the homography that most pins share.
 *
 * The score of a homography is not a count. A pin's error r has a standard
 * deviation that nobody knows; with every value up to some greatest one equally
 * likely, the chance that the pin belongs falls smoothly with r (MAGSAC++,
 * Barath et al. 2020). So no threshold decides between two homographies. */
#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "core/mat3.h"
#include "vehicle/ground_internal.h"

/* ---- fixed pseudo-random numbers ---- */

static uint32_t random_next(uint32_t *state)
{
    uint32_t s = *state;
    s ^= s << 13;
    s ^= s >> 17;
    s ^= s << 5;
    *state = s;
    return s;
}

static uint32_t random_seed(uint16_t a, uint16_t b)
{
    uint32_t s = ((uint32_t)a << 16 | b) * 2654435761u ^ 0x9e3779b9u;
    if (s == 0) s = 1;
    for (int i = 0; i < 4; i++) (void)random_next(&s);
    return s;
}

/* ---- four points ---- */

/* The eight unknowns of H (h33 = 1) by elimination with pivots. */
static bool solve_8(double a[8][9], double x[8])
{
    for (int c = 0; c < 8; c++) {
        int best = c;
        for (int r = c + 1; r < 8; r++) {
            if (fabs(a[r][c]) > fabs(a[best][c])) best = r;
        }
        if (!(fabs(a[best][c]) > 1e-9)) return false;
        for (int k = c; k < 9; k++) {
            const double swap = a[c][k];
            a[c][k] = a[best][k];
            a[best][k] = swap;
        }
        for (int r = 0; r < 8; r++) {
            if (r == c) continue;
            const double f = a[r][c] / a[c][c];
            for (int k = c; k < 9; k++) a[r][k] -= f * a[c][k];
        }
    }
    for (int r = 0; r < 8; r++) x[r] = a[r][8] / a[r][r];
    return true;
}

/* Positions of a pin, left and right, about the middle of all and in units
 * of the image width: keeps the equations well conditioned. */
typedef struct scaled_match {
    double x, y, x2, y2;
} scaled_pin_t;

static bool four_points(const scaled_pin_t m[4], double H[9])
{
    double a[8][9];
    for (int i = 0; i < 4; i++) {
        const double top[9] = {m[i].x, m[i].y, 1, 0, 0, 0, -m[i].x2 * m[i].x, -m[i].x2 * m[i].y, m[i].x2};
        const double low[9] = {0, 0, 0, m[i].x, m[i].y, 1, -m[i].y2 * m[i].x, -m[i].y2 * m[i].y, m[i].y2};
        memcpy(a[2 * i], top, sizeof top);
        memcpy(a[2 * i + 1], low, sizeof low);
    }
    if (!solve_8(a, H)) return false;
    H[8] = 1.0;
    return true;
}

/* ---- scoring ---- */

/* 1 - rho(r) / rho(r_max) at r^2 / r_max^2 = 0, 1/32, ... 1, where r_max = k s, k^2 = 9.21, s the greatest standard
 * deviation, rho(r) the integral of x w(x) from 0 to r, and w(x) = erfc(x / (s sqrt 2)) - erfc(k / sqrt 2) the weight
 * that is left when the standard deviation is integrated out (two degrees of freedom). */
static const float gain_table[34] = {1.0f,    0.787f,  0.6358f, 0.5189f, 0.4261f, 0.3512f, 0.2902f, 0.2401f, 0.1988f,
                                     0.1647f, 0.1363f, 0.1127f, 0.093f,  0.0766f, 0.0629f, 0.0514f, 0.0419f, 0.0339f,
                                     0.0273f, 0.0218f, 0.0172f, 0.0134f, 0.0103f, 0.0078f, 0.0058f, 0.0041f, 0.0029f,
                                     0.0019f, 0.0011f, 0.0006f, 0.0002f, 0.0001f, 0.0f,    0.0f};

double oc_ground_gain(double share)
{
    if (!(share < 1.0)) return 0.0;
    const double x = 32.0 * share;
    const uint32_t i = (uint32_t)x;
    return (double)gain_table[i] + (x - i) * (double)(gain_table[i + 1] - gain_table[i]);
}

static double transfer_error2(const double H[9], double x, double y, double x2, double y2)
{
    double u, v;
    if (oc_homography_apply(H, x, y, &u, &v) == 0.0) return (double)INFINITY;
    return (u - x2) * (u - x2) + (v - y2) * (v - y2);
}

/* The worse of both ways, as a share of r_max^2. */
static double scaled_error(const float d[4], const double H[9], const double inverse[9], double max2)
{
    const double there = transfer_error2(H, (double)d[0], (double)d[1], (double)d[2], (double)d[3]);
    if (!(there < max2)) return 1.0;
    const double back = transfer_error2(inverse, (double)d[2], (double)d[3], (double)d[0], (double)d[1]);
    return (back > there ? back : there) / max2;
}

/* ---- sampling ---- */

typedef struct ransac_frame {
    double middle[4]; /* x, y, x2, y2 */
    double scale;
} ransac_frame_t;

static void ransac_scale(oc_ground_ws_t *ws, double width_px, ransac_frame_t *frame)
{
    memset(frame->middle, 0, sizeof frame->middle);
    for (uint32_t i = 0; i < ws->n_pins; i++) {
        const oc_ground_pin_t *p = &ws->pins[i];
        const double v[4] = {(double)p->x_px, (double)p->y_px, (double)p->x2_px, (double)p->y2_px};
        for (int k = 0; k < 4; k++) frame->middle[k] += v[k] / ws->n_pins;
    }
    frame->scale = 1.0 / width_px;
    for (uint32_t i = 0; i < ws->n_pins; i++) {
        const oc_ground_pin_t *p = &ws->pins[i];
        const double v[4] = {(double)p->x_px, (double)p->y_px, (double)p->x2_px, (double)p->y2_px};
        for (uint32_t k = 0; k < 4; k++) ws->design[4u * i + k] = (float)((v[k] - frame->middle[k]) * frame->scale);
    }
}

/* Four different pins, no three of the left points near a line. */
static bool ransac_sample(const oc_ground_ws_t *ws, uint32_t *state, scaled_pin_t sample[4])
{
    uint32_t index[4];
    for (uint32_t k = 0; k < 4; k++) {
        index[k] = random_next(state) % ws->n_pins;
        for (uint32_t j = 0; j < k; j++) {
            if (index[j] == index[k]) return false;
        }
        const float *d = &ws->design[4 * index[k]];
        sample[k] = (scaled_pin_t){(double)d[0], (double)d[1], (double)d[2], (double)d[3]};
    }
    for (int skip = 0; skip < 4; skip++) {
        const scaled_pin_t *a = &sample[(skip + 1) % 4], *b = &sample[(skip + 2) % 4], *c = &sample[(skip + 3) % 4];
        const double area = (b->x - a->x) * (c->y - a->y) - (c->x - a->x) * (b->y - a->y);
        if (fabs(area) < 1e-3) return false;
    }
    return true;
}

/* Gain of all pins under a homography in scaled coordinates. */
static double ransac_score(const oc_ground_ws_t *ws, const double H[9], double max2)
{
    double inverse[9], sum = 0.0;
    if (oc_mat3_inverse(H, inverse) != OC_OK) return 0.0;
    for (uint32_t i = 0; i < ws->n_pins; i++)
        sum += oc_ground_gain(scaled_error(&ws->design[4u * i], H, inverse, max2));
    return sum;
}

/* Rounds after which a better sample is unlikely (1 %) to have been missed. */
static uint32_t ransac_enough(double n_good, uint32_t n, uint32_t limit)
{
    const double share = n_good / n;
    const double good = share * share * share * share;
    if (good > 0.999) return 1;
    if (good < 1e-6) return limit;
    const double rounds = ceil(log(0.01) / log(1.0 - good));
    return rounds < (double)limit ? (uint32_t)rounds : limit;
}

/* Best homography from four pins, scaled coordinates. Returns its score. */
static double ransac_run(const oc_ground_ws_t *ws, uint32_t max_rounds, uint32_t seed, double max2, double best_H[9])
{
    uint32_t state = seed, limit = max_rounds;
    double best = 0.0;
    for (uint32_t round = 0; round < limit; round++) {
        scaled_pin_t sample[4];
        double H[9];
        if (!ransac_sample(ws, &state, sample) || !four_points(sample, H)) continue;
        const double score = ransac_score(ws, H, max2);
        if (score <= best) continue;
        best = score;
        memcpy(best_H, H, 9 * sizeof *H);
        limit = ransac_enough(score, ws->n_pins, max_rounds);
        if (limit < round + 1) limit = round + 1;
    }
    return best;
}

uint32_t oc_ground_ransac(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                          const oc_ground_view_t *reference)
{
    if (ws->n_pins < 4) return 0;
    ransac_frame_t frame;
    ransac_scale(ws, view->grey.width_px, &frame);
    /* Four noisy points miss others by more than a fit does: twice as much is still worth something. */
    const double max_error = 2.0 * (double)params->t_transfer_px * frame.scale;
    double H[9], inverse[9];
    const double score =
        ransac_run(ws, params->ransac_rounds, random_seed(view->view, reference->view), max_error * max_error, H);
    if (!(score > 0.0) || oc_mat3_inverse(H, inverse) != OC_OK) return 0;
    uint32_t n = 0;
    for (uint32_t i = 0; i < ws->n_pins; i++) {
        ws->is_inlier[i] = scaled_error(&ws->design[4u * i], H, inverse, max_error * max_error) < 0.75 * 0.75;
        n += ws->is_inlier[i];
    }
    return n;
}
