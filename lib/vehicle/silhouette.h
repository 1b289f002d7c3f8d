/* SPDX-License-Identifier: BSD-3-Clause
 * Silhouettes: which pixels of a view, inside a box's projection, stand out of the ground.
 *
 * A pixel that shows ground looks like the same ground point in other views; one that shows an obstacle does not
 * (thesis 6.3). The other views are warped onto this one by the ground's homography, evened in brightness, and
 * compared in small windows by mean absolute difference and by correlation; the best agreement counts. A view from
 * which a box hides the ground point has no say, except that textured ground which two such views agree on is ground.
 * Where no view has a say the answer is unknown, which carves nothing (the thesis' case 1 does). Agreement is smoothed
 * along the edges of the picture itself (guided filter) before it is judged.
 *
 * Cost: about 60 ns for each pixel and reference view; 21 ms in the mean over the depot's views at 640x480 on a server
 * core (outcrop-bench-carve SITE --speed).
 * Memory: 14 bytes a pixel of the largest image and two bit maps, out of the caller's arena. */
#ifndef OUTCROP_VEHICLE_SILHOUETTE_H
#define OUTCROP_VEHICLE_SILHOUETTE_H

#include <stddef.h>
#include <stdint.h>

#include "core/camera.h"
#include "core/image.h"
#include "core/packet.h"
#include "core/status.h"
#include "vehicle/arena.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Reference views that are compared with; the most telling ones are chosen. */
#define OC_SILHOUETTE_REFERENCES 8u

/* Samples that gain and offset between two views are found from. */
#define OC_SILHOUETTE_SAMPLES 2048u

typedef enum oc_silhouette_method {
    OC_SILHOUETTE_BEST,
    OC_SILHOUETTE_THESIS /* one SAD window of 21 x 21, votes of Table 6.1, no evening of light, no visibility */
} oc_silhouette_method_t;

/* A picture (RGB or grey) and where it was taken from. */
typedef struct oc_sight {
    oc_image_t image;
    oc_camera_t camera;
} oc_sight_t;

/* Which box, of which boxes; how it is looked for. */
typedef struct oc_silhouette_task {
    const oc_ground_box_t *boxes; /* [n_boxes] everything that may stand in the way, the subject too */
    uint32_t n_boxes, subject;    /* n_boxes <= OC_MAX_SILHOUETTE_BOXES */
    double grow;                  /* by which the subject may be larger on each side, of its largest one; 0..1 */
    oc_silhouette_method_t method;
} oc_silhouette_task_t;

/* Pixels x in [x0, x1), y in [y0, y1). */
typedef struct oc_pixel_rect {
    uint32_t x0, y0, x1, y1;
} oc_pixel_rect_t;

/* Room for one silhouette at a time. Fields are for silhouette*.c only. */
typedef struct oc_silhouette_ws {
    uint32_t max_px, max_width_px, max_height_px;
    uint8_t *own, *own_grey, *warped, *warped_grey; /* smoothed; [3 max_px], [max_px]; the last two are one piece */
    uint8_t *mask, *difference, *counts;            /* [max_px] */
    int8_t *likeness;                               /* [max_px], hundredths */
    int16_t *evidence;                              /* [max_px] */
    int32_t *columns;                               /* [10 max_width_px] */
    float *row;                                     /* [10 max_width_px] */
    uint8_t *own_boxes, *ref_boxes;                 /* bit maps of boxes in a view */
    float *samples;                                 /* [6 OC_SILHOUETTE_SAMPLES] */
} oc_silhouette_ws_t;

/* Bytes that oc_silhouette_init takes of an arena for images up to this size. */
size_t oc_silhouette_size_bytes(uint32_t max_width_px, uint32_t max_height_px);
OC_CHECKED oc_status_t oc_silhouette_init(oc_silhouette_ws_t *ws, oc_arena_t *arena, uint32_t max_width_px,
                                          uint32_t max_height_px);

/* Label the pixels of `view` inside the projection of the task's subject.
 *
 * references  [n] other views; those with a camera of the view's own place are passed over
 * rect        out: the labelled rectangle, the box's projection cut by the image
 * labels      out: oc_label_t by rows of the rectangle, in the workspace, until its next use; outside the
 *             projection they continue their row and mean nothing
 *
 * OC_E_DEGENERATE when there is nothing to say: the box is not in the image, or reaches the camera. OC_E_LIMIT for
 * an image larger than the workspace, OC_E_ARG for invalid images or tasks. */
OC_CHECKED oc_status_t oc_silhouette_find(oc_silhouette_ws_t *ws, const oc_sight_t *view, const oc_sight_t references[],
                                          uint32_t n, const oc_silhouette_task_t *task, oc_pixel_rect_t *rect,
                                          const uint8_t **labels);

/* Labels of a rectangle into cells of step x step pixels: what most of its pixels say, obstacle before unknown before
 * ground when they are equal. cells holds n_cols * n_rows as computed by oc_silhouette_cells_of; out's col, row,
 * n_cols, n_rows and step_px are written. In place (cells == labels) is allowed. */
void oc_silhouette_to_cells(const oc_pixel_rect_t *rect, const uint8_t labels[], uint32_t step_px, oc_silhouette_t *out,
                            uint8_t cells[]);

#ifdef __cplusplus
}
#endif
#endif
