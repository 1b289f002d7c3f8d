/* SPDX-License-Identifier: BSD-3-Clause
 * A camera device: a seam between the camera source and V4L2, with a stand-in
 * for tests. One open device per camera; nothing here blocks but open. */
#ifndef OUTCROP_DAEMON_VIDEO_DEVICE_H
#define OUTCROP_DAEMON_VIDEO_DEVICE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "pixel_format.h"

#define OC_VIDEO_PATH_BYTES 256

/* A control that is set at start and after every reconnect; NaN-free. */
typedef struct oc_video_controls {
    bool has_exposure; /* false: left as it is */
    bool is_exposure_auto;
    uint32_t exposure_us; /* manual */
    bool has_gain;
    int32_t gain; /* the driver's unit */
    bool has_white_balance;
    bool is_white_balance_auto;
    uint32_t white_balance_k; /* manual */
} oc_video_controls_t;

typedef struct oc_video_wish {
    char path[OC_VIDEO_PATH_BYTES]; /* /dev/v4l/by-id/..., by-path, or /dev/videoN */
    oc_pixel_format_t format;
    uint32_t width_px, height_px;
    double rate_hz;     /* 0: the driver's default */
    uint32_t n_buffers; /* 4..16 */
    oc_video_controls_t controls;
} oc_video_wish_t;

/* What the driver agreed to. Size and format always as wished: anything else fails. */
typedef struct oc_video_mode {
    uint32_t stride_bytes;
    uint32_t buffer_bytes;
    double rate_hz; /* 0: not told */
    uint32_t n_buffers;
    uint32_t n_controls_refused; /* asked for and not there, or refused */
    char card[32], bus[32];
} oc_video_mode_t;

typedef enum oc_video_clock {
    OC_VIDEO_CLOCK_MONOTONIC, /* the driver's, CLOCK_MONOTONIC */
    OC_VIDEO_CLOCK_ARRIVAL    /* the driver has none: when the frame was taken out */
} oc_video_clock_t;

/* A filled buffer, borrowed until it is given back. */
typedef struct oc_video_frame {
    uint32_t index; /* of the buffer */
    const uint8_t *bytes;
    size_t n_bytes;
    uint32_t sequence; /* the driver's; gaps are frames that were lost */
    int64_t mono_ns;   /* of the exposure as the driver tells it */
    oc_video_clock_t clock;
    bool is_flagged; /* V4L2_BUF_FLAG_ERROR: data may be corrupt */
} oc_video_frame_t;

typedef enum oc_video_result {
    OC_VIDEO_GONE = -2,  /* the device has been unplugged or is beyond repair: close it */
    OC_VIDEO_FAULT = -1, /* one line in error; close it and open it again */
    OC_VIDEO_NONE = 0,
    OC_VIDEO_FRAME = 1
} oc_video_result_t;

typedef struct oc_video oc_video_t;
typedef struct oc_video_ops {
    /* Open, set up and start streaming; NULL and one line in error otherwise.
     * Blocks as long as the driver does (10 to 500 ms for USB). */
    oc_video_t *(*open)(const oc_video_wish_t *wish, oc_video_mode_t *mode, char *error, size_t error_bytes);
    int (*fd)(const oc_video_t *video); /* readable (or in error) when take has something */
    oc_video_result_t (*take)(oc_video_t *video, oc_video_frame_t *frame, char *error, size_t error_bytes);
    /* False: FAULT, as above. */
    bool (*give_back)(oc_video_t *video, uint32_t index, char *error, size_t error_bytes);
    void (*close)(oc_video_t *video);
} oc_video_ops_t;

/* V4L2, mmap streaming. */
extern const oc_video_ops_t oc_video_v4l2;

#endif
