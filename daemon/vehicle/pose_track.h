/* SPDX-License-Identifier: BSD-3-Clause
 * The vehicle's body poses over time: a fixed ring, interpolation, never
 * extrapolation. One thread adds, another asks. */
#ifndef OUTCROP_DAEMON_POSE_TRACK_H
#define OUTCROP_DAEMON_POSE_TRACK_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/camera.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Body: x forward, y left, z up. Position and orientation in the world. */
typedef struct oc_body_pose {
    int64_t utime_us;
    double position_m[3]; /* world */
    double q_wxyz[4];     /* world_from_body, unit */
    bool has_covariance;
    double covariance[36]; /* row-major, x y z (m, world), then small rotations about the world's axes x y z (rad) */
} oc_body_pose_t;

typedef enum oc_pose_answer {
    OC_POSE_OK,
    OC_POSE_NOT_YET, /* no pose at or after that time has come */
    OC_POSE_NEVER    /* older than all that is kept, or the two around it are too far apart in time */
} oc_pose_answer_t;

typedef struct oc_pose_track oc_pose_track_t;

/* Room for n poses (2..65536); neighbours more than max_gap_us apart do not bracket. NULL: no memory. */
oc_pose_track_t *oc_pose_track_create(uint32_t n, int64_t max_gap_us);
void oc_pose_track_destroy(oc_pose_track_t *track);

/* Readable (an eventfd) when poses have been added; read it with oc_pose_track_clear. */
int oc_pose_track_fd(const oc_pose_track_t *track);
void oc_pose_track_clear(oc_pose_track_t *track);

/* OC_OK; OC_E_ARG when it is not a pose (not finite, farther than 1e9 m from
 * the origin, not a unit quaternion within 1e-3, covariance not symmetric and
 * positive semidefinite); OC_E_STATE when not newer than the last one. After ten
 * of these in a row, each newer than the one before, the publisher's clock must
 * have been set back: the track begins anew with the next. */
OC_CHECKED oc_status_t oc_pose_track_add(oc_pose_track_t *track, const oc_body_pose_t *pose);

/* The pose at a time: position linear, rotation on the shorter arc, the
 * covariance that of the neighbour with the larger trace (when both have one). */
oc_pose_answer_t oc_pose_track_at(oc_pose_track_t *track, int64_t utime_us, oc_body_pose_t *pose);

/* The newest pose's time, INT64_MIN when there is none. */
int64_t oc_pose_track_newest_us(oc_pose_track_t *track);

/* ---- camera poses ---- */

/* Where a camera sits on the body: body_from_optical from x, y, z in metres
 * and roll, pitch, yaw in radians of its housing (x forward, y left, z up; R =
 * Rz(yaw) Ry(pitch) Rx(roll), so pitch > 0 looks down), REP 103. */
oc_pose_t oc_mount_from_xyzrpy(const double xyz_m[3], const double rpy_rad[3]);

/* cam_from_world of a camera on the body. */
oc_pose_t oc_pose_of_camera(const oc_body_pose_t *body, const oc_pose_t *body_from_optical);

/* Margins of the camera's pose: the body's covariance carried over to the
 * camera's centre (the lever of the mount included) and to omega, phi, kappa,
 * one sigma times sqrt 3 (a uniform error of that half-width has that sigma);
 * not smaller than `least`, which is all there is without a covariance, and
 * angles not larger than 45 degrees: where phi nears 90 degrees (a camera that
 * looks level to the east or west) omega and kappa are hardly to be told apart,
 * and phi gets smaller whichever way the view strays, which is in its margin. */
oc_margin_t oc_margin_of_camera(const oc_body_pose_t *body, const oc_pose_t *body_from_optical,
                                const oc_margin_t *least);

#ifdef __cplusplus
}
#endif
#endif
