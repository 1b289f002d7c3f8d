/* SPDX-License-Identifier: BSD-3-Clause
 * One camera: opened, watched, closed and opened again by itself; its frames
 * wait here, in the driver's buffers, for their poses. For live_camera.c and camera_source.c only. */
#ifndef OUTCROP_DAEMON_LIVE_CAMERA_H
#define OUTCROP_DAEMON_LIVE_CAMERA_H

#include "camera_opener.h"
#include "camera_source.h"
#include "mjpeg.h"

/* Frames that wait: all buffers but the one handed out and two that the driver must have. */
#define OC_MAX_WAITING 13u

/* Marks whose frame has not come. */
#define OC_MAX_PENDING_MARKS 8u

typedef enum oc_camera_state {
    OC_CAMERA_CLOSED,  /* tried again at next_try_ns */
    OC_CAMERA_OPENING, /* with the opener */
    OC_CAMERA_STREAMING,
    OC_CAMERA_CLOSING /* with the opener */
} oc_camera_state_t;

typedef struct oc_waiting_frame {
    oc_video_frame_t frame;
    int64_t exposed_ns; /* monotonic: the driver's time, or the trigger pulse's */
    int64_t utime_us;
    int64_t arrived_ns;
    bool is_forced;
} oc_waiting_frame_t;

typedef struct oc_camera_counts {
    uint64_t frames, lost, flagged, corrupt, stalls, opened;
} oc_camera_counts_t;

typedef struct oc_live_camera {
    const oc_camera_config_t *config;
    const oc_camera_source_parts_t *parts;
    oc_camera_opener_t *opener;
    uint32_t index;

    oc_camera_state_t state;
    oc_video_t *video;
    oc_video_mode_t mode;
    oc_mjpeg_t *mjpeg; /* only for MJPG */
    int64_t next_try_ns, last_frame_ns;
    bool is_fault_counted; /* of this spell without a camera */

    oc_waiting_frame_t waiting[OC_MAX_WAITING]; /* oldest first */
    uint32_t n_waiting;
    bool has_handed_out;
    uint32_t handed_out; /* buffer index */

    bool has_sequence;
    uint32_t last_sequence;
    int64_t last_exposed_ns;                /* INT64_MIN = none */
    int64_t marks_ns[OC_MAX_PENDING_MARKS]; /* no frame at or after these yet */
    uint32_t n_marks;
    oc_camera_counts_t counts;

    char error[OC_CAMERA_ERROR_BYTES];        /* the last one, "" while all is well */
    char message[OC_CAMERA_ERROR_BYTES + 64]; /* to be told, "" = none */
    char later[OC_CAMERA_ERROR_BYTES];        /* the last change that came too soon after another, "" = none */
    int64_t told_ns;
    uint32_t n_untold;
} oc_live_camera_t;

/* Give back what was handed out, collect what the opener did, take what the
 * driver has, look after stalls. */
void oc_live_camera_serve(oc_live_camera_t *camera, int64_t now_ns, const oc_clock_map_t *clock);

/* The first frame exposed at or after mark_ns becomes a keyframe. */
void oc_live_camera_mark(oc_live_camera_t *camera, int64_t mark_ns);

/* Drop the oldest waiting frame, for a reason. */
void oc_live_camera_drop_oldest(oc_live_camera_t *camera, oc_counter_t reason, int64_t now_ns);

/* Hand out the oldest waiting frame's pixels; false when it is corrupt: then it has been dropped and counted. */
bool oc_live_camera_hand_out(oc_live_camera_t *camera, int64_t now_ns, oc_raw_image_t *raw);

/* When it wants to be served at the latest, but for frames. */
int64_t oc_live_camera_wake_ns(const oc_live_camera_t *camera);

/* JSON object; see capture.h. */
size_t oc_live_camera_describe(const oc_live_camera_t *camera, int64_t now_ns, char *text, size_t text_bytes);

#endif
