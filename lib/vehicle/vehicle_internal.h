/* SPDX-License-Identifier: BSD-3-Clause
 * Inside of a vehicle: the ring of stored views and what waits to be sent. For vehicle*.c only. */
#ifndef OUTCROP_VEHICLE_VEHICLE_INTERNAL_H
#define OUTCROP_VEHICLE_VEHICLE_INTERNAL_H

#include <assert.h>

#include "vehicle/arena.h"
#include "vehicle/silhouette.h"
#include "vehicle/vehicle.h"

#define OC_MAX_STORED_VIEWS 256u

/* Parts of one view: as many as a resend request has bits for. */
#define OC_MAX_VIEW_PARTS 32u

/* Patch requests that wait; 1 kB each. */
#define OC_MAX_WAITING_PATCHES 64u

/* Silhouette requests that wait; 7 kB each. */
#define OC_MAX_WAITING_SILHOUETTES 4u

/* A run of junctions and ties that travels as one packet. */
typedef struct view_run {
    uint16_t first, n;
    uint16_t first_tie, n_ties;
} view_run_t;

/* One stored view. What the queue holds of it are flags: packets are made when
 * they are asked for, from the order fixed at the push. */
typedef struct stored_view {
    bool is_used;
    oc_view_head_t head;     /* part and is_last unused */
    oc_image_t grey, colour; /* in the arena; colour.channels = 0 when not kept */
    uint8_t *grey_px, *colour_px;

    oc_junction_t *junctions; /* all found, labels as they stand */
    oc_ground_votes_t *votes; /* of each */
    uint32_t n_junctions;

    uint16_t *order;       /* [n_sent] junction indices, best first: what the encoder is given */
    uint16_t *transmitted; /* [n_sent] junction indices in the order the base has them */
    uint8_t *sent_label;   /* [n_junctions] as they were at the push: a resend gives the same bits */
    uint16_t n_sent;
    oc_tie_t ties[OC_MAX_TIES];
    uint16_t n_ties;
    view_run_t runs[OC_MAX_VIEW_PARTS];
    uint8_t n_parts;

    uint8_t *solid; /* [blocks of 8x8 px] 1: the last silhouettes do not call it ground */
    bool has_solid;
    uint16_t solid_key;

    bool is_held;                      /* its parts wait for a recall; it is announced meanwhile */
    bool is_announced;                 /* nothing to send, or nothing yet, but that it exists */
    uint32_t unsent_parts;             /* bit i: part i has never left; bit 0 for an announcement */
    uint32_t again_parts;              /* asked for again */
    uint16_t relabel_from, relabel_to; /* transmit order; empty when equal */
} stored_view_t;

static_assert(OC_MAX_VIEW_PARTS <= 32, "the bit masks have 32 bits");

struct oc_vehicle {
    oc_vehicle_config_t config;
    uint16_t sequence;
    uint16_t next_view;
    uint16_t n_views;
    uint16_t newest_view;
    uint32_t counters[OC_N_COUNTERS];
    oc_keyframe_t policies[OC_MAX_CAMERAS];

    stored_view_t *views; /* [config.stored_views], a ring */
    uint32_t n_stored;
    uint32_t next_slot;

    /* Scratch of one push. */
    uint8_t *grey_px;
    oc_junction_t *junctions; /* [judoca.max_junctions] */
    oc_junction_t *outgoing;  /* [max_sent_junctions] a copy that the encoder may reorder */
    void *judoca_block;       /* re-used whenever the frame size changes */
    size_t judoca_bytes;
    oc_judoca_ws_t judoca;
    uint32_t judoca_width_px, judoca_height_px; /* 0 = not ready */
    oc_ground_ws_t ground;
    uint8_t datagram[OC_MAX_DATAGRAM_BYTES];

    oc_patch_request_t patches[OC_MAX_WAITING_PATCHES]; /* oldest first; blocks still to be sent */
    uint32_t n_patches;

    oc_silhouette_ws_t silhouette_ws;
    oc_silhouette_request_t silhouettes[OC_MAX_WAITING_SILHOUETTES]; /* oldest first; views still wanted */
    uint32_t n_silhouettes, next_box;                                /* of the first wanted view of silhouettes[0] */
};

/* ---- shared by vehicle*.c ---- */

void oc_vehicle_add(oc_vehicle_t *vehicle, oc_counter_t counter, uint32_t n);

/* Stored view of this id, or NULL. */
stored_view_t *oc_vehicle_find(const oc_vehicle_t *vehicle, uint16_t view);

/* age 0 = newest; age < n_stored. */
stored_view_t *oc_vehicle_by_age(const oc_vehicle_t *vehicle, uint32_t age);

/* Can the ray through a pixel meet the area, the margins granted? True when no area is set. */
bool oc_area_is_hit(const oc_area_t *area, const oc_camera_t *camera, const oc_margin_t *margin, double x_px,
                    double y_px);
bool oc_area_is_valid(const oc_area_t *area);

/* Fill the view's runs and its transmit order from order, sent_label and ties; held when asked for.
 * Drops from the tail what OC_MAX_VIEW_PARTS packets do not hold. */
OC_CHECKED oc_status_t oc_vehicle_plan(oc_vehicle_t *vehicle, stored_view_t *view, bool is_held);

/* Forget everything that waits on behalf of a view that leaves the ring. */
void oc_vehicle_forget(oc_vehicle_t *vehicle, stored_view_t *view);

/* The junctions [from, to) of the transmit order have new labels. */
void oc_vehicle_relabelled(stored_view_t *view, uint32_t from, uint32_t to);

/* Queue a silhouette request; OC_E_SPACE when there is no room, OC_E_STATE when none of its views is stored. */
OC_CHECKED oc_status_t oc_vehicle_ask_silhouettes(oc_vehicle_t *vehicle, const oc_silhouette_request_t *request);

/* The next silhouette as a packet; OC_OK with *n_bytes = 0 when none is asked for. */
OC_CHECKED oc_status_t oc_vehicle_next_silhouette(oc_vehicle_t *vehicle, uint8_t *buf, size_t *n_bytes);

/* Compare the new view with the best stored ones: labels of both, ties, relabels. */
void oc_vehicle_filter(oc_vehicle_t *vehicle, stored_view_t *fresh);

#endif
