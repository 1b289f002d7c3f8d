/* SPDX-License-Identifier: BSD-3-Clause
 * A ring of poses that two threads share. */
#include "pose_track.h"

#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "doorbell.h"

/* So many poses in a row that are too old, each newer than the one before: the publisher's clock was set back. */
#define MAX_LATE 10u

/* Farther from the origin, or farther off in time, nothing is real and sums could overflow. */
#define MAX_POSITION_M 1e9
#define MAX_UTIME_US (INT64_MAX / 4)
#define MAX_VARIANCE 1e30

/* What may be rounding, for publishers that work in single precision: of a variance, and of correlations. */
#define ROUNDING 1e-7
#define SLACK 1e-6

struct oc_pose_track {
    pthread_mutex_t lock;
    int added_fd;
    int64_t max_gap_us;
    uint32_t capacity, first, n;
    uint32_t n_late; /* in a row */
    int64_t last_late_us;
    oc_body_pose_t *ring;
};

oc_pose_track_t *oc_pose_track_create(uint32_t n, int64_t max_gap_us)
{
    oc_pose_track_t *track = calloc(1, sizeof *track);
    if (!track) return NULL;
    track->capacity = n;
    track->max_gap_us = max_gap_us;
    track->ring = malloc(n * sizeof *track->ring);
    track->added_fd = oc_doorbell_open();
    pthread_mutex_init(&track->lock, NULL);
    if (track->ring && track->added_fd >= 0) {
        memset(track->ring, 0xff, n * sizeof *track->ring); /* so that its pages are there from the start */
        return track;
    }
    oc_pose_track_destroy(track);
    return NULL;
}

void oc_pose_track_destroy(oc_pose_track_t *track)
{
    if (!track) return;
    if (track->added_fd >= 0) close(track->added_fd);
    pthread_mutex_destroy(&track->lock);
    free(track->ring);
    free(track);
}

int oc_pose_track_fd(const oc_pose_track_t *track)
{
    return track->added_fd;
}

void oc_pose_track_clear(oc_pose_track_t *track)
{
    oc_doorbell_clear(track->added_fd);
}

/* ---- adding ---- */

/* Correlations, so that metres and radians are judged alike. A variance that is next to nothing beside the others of its
 * kind may be rounding and is judged as if it were a little more. False when one is negative or too large, or the matrix
 * is not symmetric. */
static bool to_correlations(const double c[36], double r[36])
{
    double sigma[6];
    for (int i = 0; i < 6; i++) {
        const double *kind = i < 3 ? &c[0] : &c[21];
        const double least = ROUNDING * fmax(kind[0], fmax(kind[7], kind[14]));
        if (!(c[7 * i] >= -least && c[7 * i] <= MAX_VARIANCE)) return false;
        sigma[i] = sqrt(fmax(c[7 * i], least));
    }
    for (int i = 0; i < 36; i++) {
        const double scale = sigma[i / 6] * sigma[i % 6];
        if (!(fabs(c[i]) <= 1.001 * scale)) return false;
        r[i] = scale > 0 ? c[i] / scale : 0;
    }
    for (int i = 0; i < 36; i++) {
        if (fabs(r[i] - r[6 * (i % 6) + i / 6]) > SLACK) return false;
    }
    for (int i = 0; i < 6; i++) r[7 * i] = fmax(0, r[7 * i]);
    return true;
}

/* No direction of the remaining rows varies: then none may be negative or correlate. */
static bool is_spent(const double r[36], const bool is_done[6])
{
    for (int i = 0; i < 36; i++) {
        if (is_done[i / 6] || is_done[i % 6]) continue;
        if (i % 7 == 0 ? r[i] < -SLACK : fabs(r[i]) > 4 * SLACK) return false;
    }
    return true;
}

/* Symmetric and without a negative direction: what varies most is taken out, until nothing varies. */
static bool is_covariance(const double c[36])
{
    double r[36];
    bool is_done[6] = {false};
    if (!to_correlations(c, r)) return false;
    for (int step = 0; step < 6; step++) {
        int p = -1;
        for (int i = 0; i < 6; i++) {
            if (!is_done[i] && (p < 0 || r[7 * i] > r[7 * p])) p = i;
        }
        if (r[7 * p] <= SLACK) return is_spent(r, is_done);
        is_done[p] = true;
        for (int i = 0; i < 36; i++) {
            if (!is_done[i / 6] && !is_done[i % 6]) r[i] -= r[6 * (i / 6) + p] * r[6 * p + i % 6] / r[7 * p];
        }
    }
    return true;
}

static bool is_pose(const oc_body_pose_t *pose)
{
    double norm = 0;
    if (pose->utime_us > MAX_UTIME_US || pose->utime_us < -MAX_UTIME_US) return false;
    for (int i = 0; i < 3; i++) {
        if (!(fabs(pose->position_m[i]) <= MAX_POSITION_M)) return false;
    }
    for (int i = 0; i < 4; i++) norm += pose->q_wxyz[i] * pose->q_wxyz[i];
    if (!(fabs(sqrt(norm) - 1) <= 1e-3)) return false;
    return !pose->has_covariance || is_covariance(pose->covariance);
}

static oc_body_pose_t *nth(const oc_pose_track_t *track, uint32_t i)
{
    return &track->ring[(track->first + i) % track->capacity];
}

/* Single late ones are dropped; but a clock that was set back must not silence the publisher until it has caught up. */
static bool clock_was_set_back(oc_pose_track_t *track, int64_t utime_us)
{
    if (track->n == 0 || utime_us > nth(track, track->n - 1u)->utime_us) return false;
    track->n_late = track->n_late == 0 || utime_us > track->last_late_us ? track->n_late + 1u : 1u;
    track->last_late_us = utime_us;
    return track->n_late > MAX_LATE;
}

oc_status_t oc_pose_track_add(oc_pose_track_t *track, const oc_body_pose_t *pose)
{
    if (!is_pose(pose)) return OC_E_ARG;
    pthread_mutex_lock(&track->lock);
    if (clock_was_set_back(track, pose->utime_us)) track->n = 0;
    const bool is_newer = track->n == 0 || pose->utime_us > nth(track, track->n - 1u)->utime_us;
    if (is_newer) {
        track->n_late = 0;
        if (track->n == track->capacity) {
            track->first = (track->first + 1u) % track->capacity;
            track->n--;
        }
        *nth(track, track->n++) = *pose;
    }
    pthread_mutex_unlock(&track->lock);
    if (is_newer) oc_doorbell_ring(track->added_fd);
    return is_newer ? OC_OK : OC_E_STATE;
}

/* ---- asking ---- */

static void slerp(const double a[4], const double b[4], double share, double out[4])
{
    double dot = 0, norm = 0;
    for (int i = 0; i < 4; i++) dot += a[i] * b[i];
    const double sign = dot < 0 ? -1 : 1, angle = acos(fmin(1, fabs(dot)));
    double wa = 1 - share, wb = share;
    if (angle > 1e-4) {
        wa = sin((1 - share) * angle) / sin(angle);
        wb = sin(share * angle) / sin(angle);
    }
    for (int i = 0; i < 4; i++) {
        out[i] = wa * a[i] + sign * wb * b[i];
        norm += out[i] * out[i];
    }
    for (int i = 0; i < 4; i++) out[i] /= sqrt(norm);
}

static double trace_of(const double c[36])
{
    double sum = 0;
    for (int i = 0; i < 6; i++) sum += c[7 * i];
    return sum;
}

static void interpolate(const oc_body_pose_t *a, const oc_body_pose_t *b, int64_t utime_us, oc_body_pose_t *out)
{
    const double share = (double)(utime_us - a->utime_us) / (double)(b->utime_us - a->utime_us);
    *out = a->has_covariance && b->has_covariance && trace_of(b->covariance) > trace_of(a->covariance) ? *b : *a;
    out->utime_us = utime_us;
    out->has_covariance = a->has_covariance && b->has_covariance;
    for (int i = 0; i < 3; i++) out->position_m[i] = a->position_m[i] + share * (b->position_m[i] - a->position_m[i]);
    slerp(a->q_wxyz, b->q_wxyz, share, out->q_wxyz);
}

static oc_pose_answer_t answer(const oc_pose_track_t *track, int64_t utime_us, oc_body_pose_t *pose)
{
    if (track->n == 0 || utime_us > nth(track, track->n - 1u)->utime_us) return OC_POSE_NOT_YET;
    if (utime_us < nth(track, 0)->utime_us) return OC_POSE_NEVER;
    /* The last pose that is not later: low is not later, high is later or past the end. */
    uint32_t low = 0, high = track->n;
    while (high - low > 1) {
        const uint32_t middle = low + (high - low) / 2u;
        *(nth(track, middle)->utime_us <= utime_us ? &low : &high) = middle;
    }
    const oc_body_pose_t *a = nth(track, low);
    if (a->utime_us == utime_us) {
        *pose = *a;
        return OC_POSE_OK;
    }
    const oc_body_pose_t *b = nth(track, high);
    if (b->utime_us - a->utime_us > track->max_gap_us) return OC_POSE_NEVER;
    interpolate(a, b, utime_us, pose);
    return OC_POSE_OK;
}

oc_pose_answer_t oc_pose_track_at(oc_pose_track_t *track, int64_t utime_us, oc_body_pose_t *pose)
{
    pthread_mutex_lock(&track->lock);
    const oc_pose_answer_t result = answer(track, utime_us, pose);
    pthread_mutex_unlock(&track->lock);
    return result;
}

int64_t oc_pose_track_newest_us(oc_pose_track_t *track)
{
    pthread_mutex_lock(&track->lock);
    const int64_t newest_us = track->n > 0 ? nth(track, track->n - 1u)->utime_us : INT64_MIN;
    pthread_mutex_unlock(&track->lock);
    return newest_us;
}
