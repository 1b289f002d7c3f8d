/* SPDX-License-Identifier: BSD-3-Clause
 * Where frames come from: a seam with one implementation per source (site
 * folder, cameras). A source never blocks: the loop waits for its descriptors
 * and its time, then asks for frames until there is none. */
#ifndef OUTCROP_DAEMON_CAPTURE_H
#define OUTCROP_DAEMON_CAPTURE_H

#include <poll.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "lens.h"
#include "pixel_format.h"
#include "vehicle/vehicle.h"

/* A frame as the source has it, before rectification. */
typedef struct oc_captured {
    oc_raw_image_t raw; /* borrowed until the next call */
    oc_lens_t lens;
    oc_camera_t camera; /* lens.rectified, and the pose at utime_us */
    oc_margin_t margin;
    bool has_distortion;        /* plumb-bob with raw = rectified intrinsics: travels to the base, */
    oc_distortion_t distortion; /* which then knows the raw pixels as well */
    int64_t utime_us;
    int64_t arrived_ns; /* monotonic, when the source had the whole frame; for latencies */
    uint8_t camera_index;
    bool has_view_id;
    uint16_t view_id;
    bool is_forced; /* keyframe whatever the policy says: the source's wish, or a mark */
} oc_captured_t;

typedef enum oc_capture_result {
    OC_CAPTURE_ERROR = -1, /* one line in error; the source goes on */
    OC_CAPTURE_DONE = 0,   /* no frame will come any more */
    OC_CAPTURE_FRAME = 1,
    OC_CAPTURE_NONE = 2 /* not now */
} oc_capture_result_t;

/* Descriptors that one source may want to be woken by. */
#define OC_MAX_CAPTURE_FDS 12u

typedef struct oc_capture oc_capture_t;
struct oc_capture {
    /* The next frame at monotonic time now_ns. */
    oc_capture_result_t (*next)(oc_capture_t *self, int64_t now_ns, oc_captured_t *frame, char *error,
                                size_t error_bytes);
    /* Fill at most OC_MAX_CAPTURE_FDS descriptors to poll and return how many;
     * *wake_ns: when to ask at the latest, INT64_MAX = only on a descriptor. */
    uint32_t (*wait)(oc_capture_t *self, struct pollfd *fds, int64_t *wake_ns);
    void (*close)(oc_capture_t *self);
    /* One JSON object per camera into text, for --status; NULL: nothing to tell. Does not allocate. */
    size_t (*describe)(const oc_capture_t *self, char *text, size_t text_bytes);
    uint32_t max_width_px, max_height_px; /* of any frame that will come, raw and rectified */
    uint32_t n_frames;                    /* 0: endless */
    oc_area_t area;                       /* is_set when the source knows it */
};

/* Margins from the configuration; NaN = not given. */
typedef struct oc_margin_option {
    double position_m, angle_rad;
} oc_margin_option_t;

/* How a site folder is played. Zero: every view once, at once, each a keyframe. */
typedef struct oc_site_option {
    uint32_t period_ms;       /* between two frames */
    uint32_t repeat;          /* frames of one view before the next, as of a vehicle that stands; 0 means 1 */
    bool is_looped;           /* begin anew at the end; times go on, period_ms apart from the first view's */
    bool has_keyframe_policy; /* false: every frame becomes a keyframe */
} oc_site_option_t;

/* A site folder, or its cameras file. Checks every view and decodes every
 * picture once before it returns (some 5 ms each at 640 x 480); NULL and one line in error otherwise.
 * A picture that is shown again (looped, repeated) is kept decoded, 3 bytes a
 * pixel: playing then reads no file and allocates nothing. More than 1 GiB of them are refused.
 * Margins: the option before the file before 0.5 % of the median distance from
 * camera to ground along the axis and 1 degree; `margin_used` says which. */
oc_capture_t *oc_capture_open_site(const char *path, const oc_site_option_t *option, const oc_margin_option_t *margin,
                                   oc_margin_t *margin_used, char *error, size_t error_bytes);

#endif
