/* SPDX-License-Identifier: BSD-3-Clause
 * Where frames come from: a seam with one implementation per source. */
#ifndef OUTCROP_DAEMON_CAPTURE_H
#define OUTCROP_DAEMON_CAPTURE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "vehicle/vehicle.h"

/* A frame as the source has it, before rectification. */
typedef struct oc_captured {
    oc_image_t image; /* borrowed until the next call */
    oc_camera_t camera;
    oc_margin_t margin;
    oc_distortion_t distortion;
    bool has_distortion;
    int64_t utime_us;
    uint8_t camera_index;
    bool has_view_id;
    uint16_t view_id;
    bool is_forced;
} oc_captured_t;

typedef enum oc_capture_result { OC_CAPTURE_ERROR = -1, OC_CAPTURE_DONE = 0, OC_CAPTURE_FRAME = 1 } oc_capture_result_t;

typedef struct oc_capture oc_capture_t;
struct oc_capture {
    /* The next frame. ERROR writes one line; a source may go on after it. */
    oc_capture_result_t (*next)(oc_capture_t *self, oc_captured_t *frame, char *error, size_t error_bytes);
    void (*close)(oc_capture_t *self);
    uint32_t max_width_px, max_height_px; /* of any frame that will come */
    uint32_t n_frames;                    /* 0: endless */
    oc_area_t area;                       /* is_set when the source knows it */
};

/* Margins from the configuration; NaN = not given. */
typedef struct oc_margin_option {
    double position_m, angle_rad;
} oc_margin_option_t;

/* A site folder, or its cameras file. Checks every view and decodes every
 * picture once before it returns (some 5 ms each at 640 x 480); NULL and one line in error otherwise.
 * Margins: the option before the file before 0.5 % of the median distance from
 * camera to ground along the axis and 1 degree; `margin_used` says which. */
oc_capture_t *oc_capture_open_site(const char *path, const oc_margin_option_t *margin, oc_margin_t *margin_used,
                                   char *error, size_t error_bytes);

#endif
