/* SPDX-License-Identifier: BSD-3-Clause
 * The vehicle: one struct that owns the way of a frame, from rectified pixels to packets.
 *
 * Fixed allocation: the caller hands in one block at start, sized by
 * oc_vehicle_size(); nothing is allocated afterwards. No clock, no I/O: frames
 * come in with their time and pose, packets are pulled out one by one.
 *
 *   push frame -> keyframe? -> junctions -> ground filter against stored views
 *   -> view packet(s), relabels of earlier views -> stored for later requests
 *
 * Not reentrant: one thread owns a vehicle. */
#ifndef OUTCROP_VEHICLE_VEHICLE_H
#define OUTCROP_VEHICLE_VEHICLE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/camera.h"
#include "core/image.h"
#include "core/packet.h"
#include "core/status.h"
#include "vehicle/ground.h"
#include "vehicle/judoca.h"
#include "vehicle/keyframe.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Cameras on one vehicle; each has its own keyframe policy. */
#define OC_MAX_CAMERAS 8u

typedef struct oc_vehicle_config {
    uint8_t vehicle;       /* id on the link */
    uint32_t max_width_px; /* largest frame that will come */
    uint32_t max_height_px;
    uint32_t stored_views;       /* 2..256; each costs width * height * (channels stored) bytes */
    bool hold_views;             /* announce views and keep them until they are recalled; forced ones go at once */
    bool keep_colour;            /* store RGB as well as grey, for the overhead and texture layers */
    bool with_silhouettes;       /* take part in the silhouette layer; costs about 15 bytes a pixel once */
    uint32_t datagram_bytes;     /* OC_MIN_DATAGRAM_BYTES..OC_MAX_DATAGRAM_BYTES */
    uint32_t max_sent_junctions; /* per view, 1..OC_MAX_JUNCTIONS */
    oc_judoca_params_t judoca;
    oc_ground_params_t ground;
    oc_keyframe_params_t keyframe;
    oc_area_t area;
} oc_vehicle_config_t;

/* One rectified frame. Pixels are borrowed for the call only. */
typedef struct oc_frame {
    oc_image_t image; /* 1 or 3 channels */
    oc_camera_t camera;
    oc_margin_t margin;
    bool has_distortion;
    oc_distortion_t distortion; /* what was removed; passed on to the base */
    int64_t utime_us;
    uint8_t camera_index;
    bool has_view_id; /* the source numbers its views (site folder) */
    uint16_t view_id;
    bool is_forced; /* keyframe whatever the policy says */
} oc_frame_t;

typedef struct oc_push_report {
    bool is_keyframe;
    uint16_t view;
    uint32_t n_found, n_ground, n_obstacle, n_unknown, n_sent, n_ties;
} oc_push_report_t;

typedef struct oc_vehicle oc_vehicle_t; /* lives at the start of the block */

oc_vehicle_config_t oc_vehicle_defaults(void);

/* Bytes of the block that oc_vehicle_init needs; 0 when the configuration is
 * out of range. The formula is in docs/design.md. */
size_t oc_vehicle_size(const oc_vehicle_config_t *config);

/* block must be aligned to 64 bytes. */
OC_CHECKED oc_status_t oc_vehicle_init(const oc_vehicle_config_t *config, void *block, size_t n_bytes,
                                       oc_vehicle_t **vehicle);

/* Take a frame. OC_OK and report->is_keyframe false when the policy passes it
 * over. OC_E_ARG for an invalid image, camera or margin, OC_E_LIMIT when it is
 * larger than configured or camera_index is not below OC_MAX_CAMERAS; then nothing has changed but the counters. */
OC_CHECKED oc_status_t oc_vehicle_push(oc_vehicle_t *vehicle, const oc_frame_t *frame, oc_push_report_t *report);

/* Set the stored views from from_us to to_us free: held ones are sent for the
 * first time, others once more, newest first. *n: how many there are. OC_E_ARG
 * when from_us > to_us. */
OC_CHECKED oc_status_t oc_vehicle_recall(oc_vehicle_t *vehicle, int64_t from_us, int64_t to_us, uint32_t *n);

/* Take a packet of the base. Resend, patch and silhouette requests are queued; to ask for
 * parts of a held view sets it free. OC_E_STATE when what they ask for has left
 * the ring, OC_E_SPACE when the queue is full, OC_E_FORMAT when ill-formed (all
 * counted). Not for overhead and texture requests (decode them and use
 * oc_vehicle_tile, oc_vehicle_texture) nor for recall requests, which may mean "until now" (decode, and oc_vehicle_recall). */
OC_CHECKED oc_status_t oc_vehicle_handle(oc_vehicle_t *vehicle, const uint8_t *packet, size_t n_bytes);

/* The next datagram to send, or n_bytes = 0 when there is none. Order: view
 * parts (newest view first), relabels, resends, patches, silhouettes. One of
 * the last takes 5 to 30 ms, one box in one view; all others well under one. */
OC_CHECKED oc_status_t oc_vehicle_next(oc_vehicle_t *vehicle, uint8_t *buf, size_t cap, size_t *n_bytes);

/* Warp one ground tile of a stored view (RGB or grey, as stored) into out
 * (tile_px x tile_px). Pixels outside the image or above the horizon become
 * mid-grey; n_seen says how many were inside. OC_E_STATE when the view has left the ring. */
OC_CHECKED oc_status_t oc_vehicle_tile(const oc_vehicle_t *vehicle, const oc_overhead_request_t *request,
                                       oc_tile_id_t tile, oc_image_mut_t *out, uint32_t *n_seen);

/* One tile of a stored view's colours (RGB or grey, as stored) into out (tile_px x tile_px), each pixel the mean of
 * step_px x step_px. With is_masked, blocks of 8x8 pixels of the view that its last silhouettes call ground, or that
 * no box reaches, become flat; all of it shows when there are none. n_solid: pixels of the view that show. OC_E_STATE
 * when the view has left the ring, OC_E_ARG when the tile lies outside it. */
OC_CHECKED oc_status_t oc_vehicle_texture(const oc_vehicle_t *vehicle, const oc_texture_request_t *request,
                                          uint16_t tile, oc_image_mut_t *out, uint32_t *n_solid);

/* The stored rectified image of a view (borrowed until the next push), or OC_E_STATE. */
OC_CHECKED oc_status_t oc_vehicle_stored(const oc_vehicle_t *vehicle, uint16_t view, oc_image_t *image);

/* Junctions of a stored view with labels and confidences as they stand now,
 * all that were found, not only what was sent. For debugging dumps and tests. */
OC_CHECKED oc_status_t oc_vehicle_junctions(const oc_vehicle_t *vehicle, uint16_t view, const oc_junction_t **junctions,
                                            uint32_t *n_junctions);

/* Sequence number for a packet that the caller encodes itself (tiles, status). */
uint16_t oc_vehicle_next_sequence(oc_vehicle_t *vehicle);

/* Counters, view numbers and area; uptime_s, is_source_done and bytes_sent are the caller's to fill. */
void oc_vehicle_get_status(const oc_vehicle_t *vehicle, oc_vehicle_status_t *status);
void oc_vehicle_count(oc_vehicle_t *vehicle, oc_counter_t counter);

#ifdef __cplusplus
}
#endif
#endif
