/* SPDX-License-Identifier: BSD-3-Clause
 * Packets: everything that crosses the link, as values, and their wire form.
 *
 * One datagram = one packet: 4-byte head (version and type, vehicle, sequence
 * number), body, CRC-16. Each decodes alone. The wire form bit by bit, the
 * quantisation and the invariants that decoding guarantees: docs/protocol.md.
 *
 * Decoders trust nothing: lengths, counts, ranges, versions and the CRC are
 * checked, and on failure the output is untouched. Decoding what was encoded
 * gives the quantised values back, exactly. */
#ifndef OUTCROP_CORE_PACKET_H
#define OUTCROP_CORE_PACKET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/camera.h"
#include "core/image.h"
#include "core/junction.h"
#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OC_WIRE_VERSION 0u

/* Datagram sizes that a link may be configured to, bytes of packet. */
#define OC_MIN_DATAGRAM_BYTES 200u
#define OC_MAX_DATAGRAM_BYTES 1380u

/* Ground ties one view may carry. */
#define OC_MAX_TIES 96u

/* Side of the pixel blocks of the patch layer. */
#define OC_BLOCK_PX 8u

/* Blocks one patch packet or request may name. */
#define OC_MAX_PACKET_BLOCKS 512u

/* Tiles one overhead request may name. */
#define OC_MAX_REQUEST_TILES 64u

/* Boxes and views one silhouette request may hold. */
#define OC_MAX_SILHOUETTE_BOXES 32u
#define OC_MAX_SILHOUETTE_VIEWS 64u

/* Cells of one silhouette. */
#define OC_MAX_SILHOUETTE_CELLS 262144u

/* Tiles one texture request may name. */
#define OC_MAX_TEXTURE_TILES 256u

typedef enum oc_packet_type {
    /* vehicle to base */
    OC_PACKET_VIEW = 1,
    OC_PACKET_PATCH = 2,
    OC_PACKET_SILHOUETTE = 3,
    OC_PACKET_TEXTURE = 4,
    OC_PACKET_OVERHEAD = 5,
    OC_PACKET_STATUS = 6,
    OC_PACKET_RELABEL = 7,
    OC_PACKET_ANNOUNCE = 8, /* a keyframe that adds no evidence and is not sent */
    OC_PACKET_IMAGE = 9,    /* the null rival: a piece of a whole compressed keyframe */
    /* base to vehicle */
    OC_PACKET_RESEND_REQUEST = 16,
    OC_PACKET_PATCH_REQUEST = 17,
    OC_PACKET_OVERHEAD_REQUEST = 18,
    OC_PACKET_SILHOUETTE_REQUEST = 19,
    OC_PACKET_TEXTURE_REQUEST = 20,
    OC_PACKET_RECALL_REQUEST = 21 /* send what was held back, or once more, of a stretch of time */
} oc_packet_type_t;

typedef struct oc_packet_head {
    uint8_t type; /* oc_packet_type_t */
    uint8_t vehicle;
    uint16_t sequence; /* per direction, wraps */
} oc_packet_head_t;

/* What every part of a view repeats, so that each decodes alone. Wire
 * quantisation: centre 0.1 mm, rotation 2e-6 rad rms, margins half floats (rounded up),
 * intrinsics float32. */
typedef struct oc_view_head {
    uint16_t view; /* id given by the vehicle, ascending in capture order */
    uint8_t camera_index;
    uint8_t part; /* 0.. */
    bool is_last; /* no part follows */
    int64_t utime_us;
    oc_camera_t camera; /* of the rectified image, pose as the sensor reports it */
    oc_margin_t margin;
    bool has_distortion;
    oc_distortion_t distortion; /* what rectification took away; for showing pixels of the raw image */
} oc_view_head_t;

/* One point of the ground seen in this view and in an earlier one. */
typedef struct oc_tie {
    uint16_t ref_view;
    float x_px, y_px;         /* in this view; 1/16 px on the wire */
    float ref_x_px, ref_y_px; /* in ref_view */
} oc_tie_t;

/* A part of a view packet: a run of its junctions and ties. Position quantum
 * 1/8 px, angle quantum 2 pi / 512. Length, strength and score do not travel. */
typedef struct oc_view_part {
    oc_view_head_t head;
    uint16_t first_junction; /* index of junctions[0] in the view's transmit order */
    uint16_t n_junctions;
    uint16_t n_ties;
    oc_junction_t junctions[OC_MAX_JUNCTIONS];
    oc_tie_t ties[OC_MAX_TIES];
} oc_view_part_t;

/* New labels for the junctions [first, first + n) of a view already sent. */
typedef struct oc_relabel {
    uint16_t view;
    uint16_t first, n;
    uint8_t labels[OC_MAX_JUNCTIONS]; /* oc_label_t */
} oc_relabel_t;

/* Indices of 8x8 blocks of a view, raster order, ascending:
 * index = by * ceil(width / 8) + bx. */
typedef struct oc_patch_request {
    uint16_t view;
    uint8_t quality; /* 1 (coarse) .. 31 (fine) */
    uint16_t n_blocks;
    uint16_t blocks[OC_MAX_PACKET_BLOCKS];
} oc_patch_request_t;

/* Pixels of blocks of a view's grey rectified image, block-coded (core/blocks.h). */
typedef struct oc_patch {
    uint16_t view;
    uint8_t quality;
    uint16_t blocks_per_row; /* ceil(width / 8) of the image it was cut from */
    uint16_t n_blocks;
    uint16_t blocks[OC_MAX_PACKET_BLOCKS];
    uint8_t px[OC_MAX_PACKET_BLOCKS][OC_BLOCK_PX * OC_BLOCK_PX];
} oc_patch_t;

/* One ground tile seen from one view. Tile (ix, iy) covers
 * x in [ix, ix + 1) * tile_px * metres_per_pixel, y alike, row 0 at the
 * largest y; pixel (c, r) has its centre at
 * ((ix * tile_px + c + 0.5), ((iy + 1) * tile_px - r - 0.5)) * metres_per_pixel. */
typedef struct oc_tile_id {
    int16_t ix, iy;
} oc_tile_id_t;

typedef struct oc_overhead_request {
    uint16_t view;
    double image_from_ground[9]; /* the base's refined planar perspective matrix; float32 on the wire */
    double metres_per_pixel;     /* float32 on the wire */
    uint16_t tile_px;            /* 16..256 */
    uint8_t quality; /* codec quality to start from, 1..100; the vehicle lowers it until the tile fits a datagram */
    uint16_t n_tiles;
    oc_tile_id_t tiles[OC_MAX_REQUEST_TILES];
} oc_overhead_request_t;

typedef enum oc_codec { OC_CODEC_JPEG = 1, OC_CODEC_WEBP = 2, OC_CODEC_AVIF = 3 } oc_codec_t;

typedef struct oc_overhead {
    uint16_t view;
    double metres_per_pixel;
    uint16_t tile_px;
    oc_tile_id_t tile;
    uint8_t codec; /* oc_codec_t */
    uint16_t n_bytes;
    const uint8_t *bytes; /* encode: the caller's; decode: into the datagram */
} oc_overhead_t;

/* A box that stands on the ground, turned about the vertical. On the wire:
 * 0.1 mm, yaw pi / 512. */
typedef struct oc_ground_box {
    double x_m, y_m;                    /* centre */
    double length_m, width_m, height_m; /* length along yaw */
    double yaw_rad;                     /* counter-clockwise from +X, [0, pi) */
    bool is_subject;                    /* its silhouette is asked for; others only stand in the way */
} oc_ground_box_t;

/* The base's pose of a view as a step from the one that the vehicle reported:
 * centre + move_m, exp(turn_rad) R. On the wire: 0.1 mm, 2e-5 rad. */
typedef struct oc_pose_step {
    uint16_t view;
    double move_m[3], turn_rad[3];
    bool is_wanted; /* the silhouettes of this view are to be sent; others only serve as references */
} oc_pose_step_t;

/* What stands out of the ground in these views, inside these boxes? */
typedef struct oc_silhouette_request {
    uint8_t step_px;      /* 1, 2 or 4: cells of the answer; doubled until it fits a datagram */
    uint8_t grow_percent; /* how much larger than its box a subject may be on each side, of its largest one; 0..100 */
    bool is_thesis;       /* by the votes of thesis Table 6.1 */
    uint8_t n_boxes, n_views;
    oc_ground_box_t boxes[OC_MAX_SILHOUETTE_BOXES];
    oc_pose_step_t views[OC_MAX_SILHOUETTE_VIEWS]; /* ids ascending */
    uint16_t key; /* decode: of everything but is_wanted; the answers carry it. Encode: ignored */
} oc_silhouette_request_t;

/* One box in one view: a label for each cell of a rectangle. Cells outside the
 * box's projection mean nothing. */
typedef struct oc_silhouette {
    uint16_t view;
    uint16_t key;            /* of the request */
    uint8_t box;             /* index in the request */
    uint8_t step_px;         /* side of a cell: 1, 2, 4, 8 or 16 */
    uint16_t col, row;       /* of the first cell, in cells from the image's corner */
    uint16_t n_cols, n_rows; /* n_cols * n_rows <= OC_MAX_SILHOUETTE_CELLS */
} oc_silhouette_t;

/* Colour of a view in tiles: tile i of a picture of `across` tiles a row covers
 * tile_px * step_px pixels a side from ((i % across), (i / across)) on. */
typedef struct oc_texture_request {
    uint16_t view;
    bool is_cancelled;     /* what waits for this view is dropped; nothing else of the request counts */
    uint8_t step_px;       /* 1, 2 or 4 pixels of the view to one of the texture */
    uint8_t tile_px;       /* 16..128 */
    uint8_t quality;       /* codec quality to start from, 1..100 */
    bool is_masked;        /* blocks of 8x8 pixels that the last silhouettes call ground are flat */
    uint32_t budget_bytes; /* of packets; tiles over it are not sent. 1..2^24 - 1: the base's estimate, with a margin */
    uint16_t n_tiles;
    uint16_t tiles[OC_MAX_TEXTURE_TILES]; /* ascending */
} oc_texture_request_t;

typedef struct oc_texture {
    uint16_t view;
    uint8_t step_px, tile_px;
    uint16_t tile;
    uint8_t codec; /* oc_codec_t */
    uint16_t n_bytes;
    const uint8_t *bytes; /* encode: the caller's; decode: into the datagram */
} oc_texture_t;

typedef struct oc_image_piece {
    oc_view_head_t head; /* part = index of the piece, is_last on the final one */
    uint8_t codec;
    uint32_t total_bytes, offset_bytes;
    uint16_t n_bytes;
    const uint8_t *bytes;
} oc_image_piece_t;

typedef struct oc_announce {
    uint16_t view;
    int64_t utime_us;
} oc_announce_t;

/* Ask for parts of a view again; bit i of parts = part i; all ones = everything; 0 = its labels as they stand. */
typedef struct oc_resend_request {
    uint16_t view;
    uint32_t parts;
} oc_resend_request_t;

/* Ask for the views of a stretch of time, whether they were held back or have
 * been sent: from utime from_us to to_us, or the last last_ms before the request arrives. */
typedef struct oc_recall_request {
    bool is_relative;
    int64_t from_us, to_us; /* absolute; from <= to */
    uint32_t last_ms;       /* relative */
} oc_recall_request_t;

/* Counters of what came, what was dropped and why, in the order of docs/operating.md. */
typedef enum oc_counter {
    OC_COUNT_FRAMES_IN,        /* handed to the vehicle */
    OC_COUNT_FRAMES_NO_POSE,   /* no poses around the frame's time */
    OC_COUNT_FRAMES_NOT_KEY,   /* passed over by the keyframe policy */
    OC_COUNT_VIEWS_SENT,       /* left whole */
    OC_COUNT_VIEWS_DROPPED,    /* left the ring unsent */
    OC_COUNT_JUNCTIONS_CAPPED, /* over a limit */
    OC_COUNT_REQUESTS_BAD,     /* ill-formed or impossible */
    OC_COUNT_REQUESTS_GONE,    /* for what has left the ring */
    OC_COUNT_REQUESTS_FULL,    /* no room to queue them */
    OC_COUNT_SEND_FAILED,      /* packets that the transport refused */
    OC_COUNT_FRAMES_FLAGGED,   /* the driver says that the buffer is damaged */
    OC_COUNT_FRAMES_CORRUPT,   /* short, or a JPEG that does not decode */
    OC_COUNT_FRAMES_LOST,      /* gaps in the driver's sequence */
    OC_COUNT_FRAMES_OVERRUN,   /* waited for a pose until newer ones needed the buffer */
    OC_COUNT_FRAMES_DISABLED,  /* the capture-enable input was off */
    OC_COUNT_FRAMES_BAD_TIME,  /* not later than the one before, or in the future */
    OC_COUNT_FRAMES_REFUSED,   /* size, pose or margin that the vehicle cannot take */
    OC_COUNT_CAMERA_LOST,      /* unplugged, or failed while streaming */
    OC_COUNT_CAMERA_STALLS,    /* sent nothing for too long */
    OC_COUNT_CAMERA_FAULTS,    /* could not be opened or set up, once per spell */
    OC_COUNT_CAMERA_OPENED,    /* started to stream; the first time as well */
    OC_COUNT_CONTROLS_REFUSED, /* exposure, gain or white balance not set */
    OC_COUNT_POSES_IN,
    OC_COUNT_POSES_BAD,       /* ill-formed */
    OC_COUNT_POSES_LATE,      /* not newer than the last */
    OC_COUNT_CLOCK_STEPS,     /* UTC jumped */
    OC_COUNT_MARKS,           /* mark inputs taken */
    OC_COUNT_MARKS_DROPPED,   /* came faster than they were taken */
    OC_COUNT_GPIO_FAULTS,     /* a line could not be set or read */
    OC_COUNT_PULSES_MISSED,   /* trigger or strobe pulses: too late, or while the one before lasted */
    OC_COUNT_PACKETS_BAD,     /* received, no packet of ours */
    OC_COUNT_PACKETS_FOREIGN, /* received, for another vehicle */
    OC_COUNT_PACKETS_FULL,    /* received, no room to queue them */
    OC_COUNT_TILES_DROPPED,   /* ground tiles that could not be encoded or queued */
    OC_COUNT_RECALLED,        /* held views that a mark or a request set free */
    OC_N_COUNTERS
} oc_counter_t;

/* Snake case, "frames_in"; static storage. */
const char *oc_counter_name(oc_counter_t counter);

/* Where the operator works, metres. Junctions that cannot lie in it stay off the link. */
typedef struct oc_area {
    bool is_set;
    double x_min, x_max, y_min, y_max, z_max;
} oc_area_t;

typedef struct oc_vehicle_status {
    uint32_t uptime_s;
    uint16_t n_views;                 /* views and announcements given out so far */
    uint16_t newest_view;             /* valid when n_views > 0 */
    bool is_source_done;              /* a site folder has been played to its end */
    uint32_t bytes_sent;              /* packets, without LCM's overhead */
    oc_area_t area;                   /* float32 on the wire; the base falls back on it */
    uint32_t counters[OC_N_COUNTERS]; /* stop at 2^30 - 1 on the wire */
} oc_vehicle_status_t;

/* ---- encoding: vehicle ----
 * Each writes one datagram of at most cap bytes to buf and its length to
 * n_bytes. OC_E_SPACE when not even the smallest useful packet fits,
 * OC_E_ARG when a value is out of the wire's range or not a number. */

/* Encode the part that starts with junction `first` and tie `first_tie`.
 * junctions [first, n_junctions) must be in order of worth, best first; the
 * ones taken (and only these) are sorted in place into raster order and
 * replaced by their quantised selves, so the caller's array ends up in the
 * transmit order that the base sees. Ties are taken after junctions fill, but
 * at least a quarter of the room is kept for them while any are left.
 * Sets part->is_last by itself; head->part is the caller's. */
OC_CHECKED oc_status_t oc_packet_encode_view(const oc_packet_head_t *packet, const oc_view_head_t *head,
                                             oc_junction_t junctions[], uint16_t n_junctions, uint16_t first,
                                             const oc_tie_t ties[], uint16_t n_ties, uint16_t first_tie, uint8_t *buf,
                                             size_t cap, size_t *n_bytes, uint16_t *junctions_taken,
                                             uint16_t *ties_taken);
OC_CHECKED oc_status_t oc_packet_encode_relabel(const oc_packet_head_t *packet, const oc_relabel_t *relabel,
                                                uint8_t *buf, size_t cap, size_t *n_bytes);
/* As many of the n_blocks as fit, from the first on; grey is the view's image. */
OC_CHECKED oc_status_t oc_packet_encode_patch(const oc_packet_head_t *packet, uint16_t view, uint8_t quality,
                                              const oc_image_t *grey, const uint16_t blocks[], uint16_t n_blocks,
                                              uint8_t *buf, size_t cap, size_t *n_bytes, uint16_t *blocks_taken);
OC_CHECKED oc_status_t oc_packet_encode_overhead(const oc_packet_head_t *packet, const oc_overhead_t *overhead,
                                                 uint8_t *buf, size_t cap, size_t *n_bytes);
/* As many of piece->n_bytes as fit; writes how many. is_last is set when they reach total_bytes. */
OC_CHECKED oc_status_t oc_packet_encode_image(const oc_packet_head_t *packet, const oc_image_piece_t *piece,
                                              uint8_t *buf, size_t cap, size_t *n_bytes, uint16_t *bytes_taken);
/* One packet, or OC_E_SPACE. labels: n_cols * n_rows of oc_label_t, by rows. */
OC_CHECKED oc_status_t oc_packet_encode_silhouette(const oc_packet_head_t *packet, const oc_silhouette_t *silhouette,
                                                   const uint8_t labels[], uint8_t *buf, size_t cap, size_t *n_bytes);
OC_CHECKED oc_status_t oc_packet_encode_texture(const oc_packet_head_t *packet, const oc_texture_t *texture,
                                                uint8_t *buf, size_t cap, size_t *n_bytes);
OC_CHECKED oc_status_t oc_packet_encode_announce(const oc_packet_head_t *packet, const oc_announce_t *announce,
                                                 uint8_t *buf, size_t cap, size_t *n_bytes);
OC_CHECKED oc_status_t oc_packet_encode_status(const oc_packet_head_t *packet, const oc_vehicle_status_t *status,
                                               uint8_t *buf, size_t cap, size_t *n_bytes);

/* ---- encoding: base ---- */
OC_CHECKED oc_status_t oc_packet_encode_resend(const oc_packet_head_t *packet, const oc_resend_request_t *request,
                                               uint8_t *buf, size_t cap, size_t *n_bytes);
/* As many blocks as fit. */
OC_CHECKED oc_status_t oc_packet_encode_patch_request(const oc_packet_head_t *packet, const oc_patch_request_t *request,
                                                      uint8_t *buf, size_t cap, size_t *n_bytes,
                                                      uint16_t *blocks_taken);
/* As many tiles as fit. */
OC_CHECKED oc_status_t oc_packet_encode_overhead_request(const oc_packet_head_t *packet,
                                                         const oc_overhead_request_t *request, uint8_t *buf, size_t cap,
                                                         size_t *n_bytes, uint16_t *tiles_taken);

/* All of it or OC_E_SPACE; *key is that which the answers will carry. */
OC_CHECKED oc_status_t oc_packet_encode_silhouette_request(const oc_packet_head_t *packet,
                                                           const oc_silhouette_request_t *request, uint8_t *buf,
                                                           size_t cap, size_t *n_bytes, uint16_t *key);
/* As many tiles as fit. */
OC_CHECKED oc_status_t oc_packet_encode_texture_request(const oc_packet_head_t *packet,
                                                        const oc_texture_request_t *request, uint8_t *buf, size_t cap,
                                                        size_t *n_bytes, uint16_t *tiles_taken);
OC_CHECKED oc_status_t oc_packet_encode_recall(const oc_packet_head_t *packet, const oc_recall_request_t *request,
                                               uint8_t *buf, size_t cap, size_t *n_bytes);

/* ---- decoding ----
 * head first (checks length, version, type, CRC), then the body by its type.
 * OC_E_FORMAT for anything that docs/protocol.md does not allow. */
OC_CHECKED oc_status_t oc_packet_decode_head(const uint8_t *buf, size_t n_bytes, oc_packet_head_t *head);
OC_CHECKED oc_status_t oc_packet_decode_view(const uint8_t *buf, size_t n_bytes, oc_view_part_t *part);
OC_CHECKED oc_status_t oc_packet_decode_relabel(const uint8_t *buf, size_t n_bytes, oc_relabel_t *relabel);
OC_CHECKED oc_status_t oc_packet_decode_patch(const uint8_t *buf, size_t n_bytes, oc_patch_t *patch);
OC_CHECKED oc_status_t oc_packet_decode_overhead(const uint8_t *buf, size_t n_bytes, oc_overhead_t *overhead);
OC_CHECKED oc_status_t oc_packet_decode_image(const uint8_t *buf, size_t n_bytes, oc_image_piece_t *piece);
/* labels: room for `cap` cells; OC_E_SPACE when there are more. Nothing is written on failure. */
OC_CHECKED oc_status_t oc_packet_decode_silhouette(const uint8_t *buf, size_t n_bytes, oc_silhouette_t *silhouette,
                                                   uint8_t labels[], size_t cap);
OC_CHECKED oc_status_t oc_packet_decode_texture(const uint8_t *buf, size_t n_bytes, oc_texture_t *texture);
OC_CHECKED oc_status_t oc_packet_decode_silhouette_request(const uint8_t *buf, size_t n_bytes,
                                                           oc_silhouette_request_t *request);
OC_CHECKED oc_status_t oc_packet_decode_texture_request(const uint8_t *buf, size_t n_bytes,
                                                        oc_texture_request_t *request);
OC_CHECKED oc_status_t oc_packet_decode_announce(const uint8_t *buf, size_t n_bytes, oc_announce_t *announce);
OC_CHECKED oc_status_t oc_packet_decode_status(const uint8_t *buf, size_t n_bytes, oc_vehicle_status_t *status);
OC_CHECKED oc_status_t oc_packet_decode_resend(const uint8_t *buf, size_t n_bytes, oc_resend_request_t *request);
OC_CHECKED oc_status_t oc_packet_decode_patch_request(const uint8_t *buf, size_t n_bytes, oc_patch_request_t *request);
OC_CHECKED oc_status_t oc_packet_decode_overhead_request(const uint8_t *buf, size_t n_bytes,
                                                         oc_overhead_request_t *request);
OC_CHECKED oc_status_t oc_packet_decode_recall(const uint8_t *buf, size_t n_bytes, oc_recall_request_t *request);

#ifdef __cplusplus
}
#endif
#endif
