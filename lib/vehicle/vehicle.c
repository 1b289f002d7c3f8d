/* SPDX-License-Identifier: BSD-3-Clause
 * The vehicle: configuration, memory, and the way of a frame from pixels to a stored view. */
#include <math.h>
#include <string.h>

#include "vehicle/vehicle_internal.h"

/* ---- configuration ---- */

oc_vehicle_config_t oc_vehicle_defaults(void)
{
    return (oc_vehicle_config_t){.vehicle = 1,
                                 .max_width_px = 640,
                                 .max_height_px = 480,
                                 .stored_views = 32,
                                 .keep_colour = true,
                                 .with_silhouettes = true,
                                 .datagram_bytes = OC_MAX_DATAGRAM_BYTES,
                                 .max_sent_junctions = 300,
                                 .judoca = oc_judoca_defaults(),
                                 .ground = oc_ground_defaults(),
                                 .keyframe = oc_keyframe_defaults(),
                                 .area = {.is_set = false}};
}

static bool config_is_valid(const oc_vehicle_config_t *c)
{
    return c->max_width_px >= OC_MIN_IMAGE_SIDE && c->max_width_px <= OC_MAX_IMAGE_SIDE &&
           c->max_height_px >= OC_MIN_IMAGE_SIDE && c->max_height_px <= OC_MAX_IMAGE_SIDE && c->stored_views >= 2 &&
           c->stored_views <= OC_MAX_STORED_VIEWS && c->datagram_bytes >= OC_MIN_DATAGRAM_BYTES &&
           c->datagram_bytes <= OC_MAX_DATAGRAM_BYTES && c->max_sent_junctions >= 1 &&
           c->max_sent_junctions <= OC_MAX_JUNCTIONS && oc_judoca_params_are_valid(&c->judoca) &&
           oc_ground_params_are_valid(&c->ground) && oc_keyframe_params_are_valid(&c->keyframe) &&
           oc_area_is_valid(&c->area);
}

/* ---- memory ---- */

/* Bytes of the pieces of a block. */
typedef struct layout {
    size_t vehicle, views, grey, colour, junctions, votes, sent_indices, sent_labels, solid, outgoing, judoca,
        silhouette;
} layout_t;

static layout_t layout_of(const oc_vehicle_config_t *c)
{
    const size_t n_px = (size_t)c->max_width_px * c->max_height_px;
    return (layout_t){
        .vehicle = sizeof(oc_vehicle_t),
        .views = c->stored_views * sizeof(stored_view_t),
        .grey = n_px,
        .colour = c->keep_colour ? 3u * n_px : 0,
        .junctions = c->judoca.max_junctions * sizeof(oc_junction_t),
        .votes = c->judoca.max_junctions * sizeof(oc_ground_votes_t),
        .sent_indices = c->max_sent_junctions * sizeof(uint16_t),
        .sent_labels = c->judoca.max_junctions,
        .solid = c->with_silhouettes ? ((size_t)c->max_width_px + 7u) / 8u * ((c->max_height_px + 7u) / 8u) : 0,
        .silhouette = c->with_silhouettes ? oc_silhouette_size_bytes(c->max_width_px, c->max_height_px) : 0,
        .outgoing = c->max_sent_junctions * sizeof(oc_junction_t),
        .judoca = oc_judoca_size_bytes(c->max_width_px, c->max_height_px, &c->judoca),
    };
}

size_t oc_vehicle_size(const oc_vehicle_config_t *config)
{
    OC_ASSERT(config);
    if (!config_is_valid(config)) return 0;
    const layout_t l = layout_of(config);
    if (l.judoca == 0) return 0;
    const size_t per_view = oc_arena_cost(l.grey) + oc_arena_cost(l.colour) + oc_arena_cost(l.junctions) +
                            oc_arena_cost(l.votes) + 2u * oc_arena_cost(l.sent_indices) + oc_arena_cost(l.sent_labels) +
                            oc_arena_cost(l.solid);
    const size_t scratch =
        oc_arena_cost(l.grey) + oc_arena_cost(l.junctions) + oc_arena_cost(l.outgoing) + oc_arena_cost(l.judoca);
    const size_t fixed = oc_arena_cost(l.vehicle) + oc_arena_cost(l.views) + scratch + l.silhouette;
    if (per_view > (SIZE_MAX - fixed) / config->stored_views) return 0;
    return fixed + config->stored_views * per_view;
}

/* An arena that is known to be large enough. */
static void *piece_of(oc_arena_t *arena, size_t bytes)
{
    void *piece = NULL;
    const oc_status_t status = oc_arena_take(arena, bytes, &piece);
    OC_ASSERT(status == OC_OK);
    (void)status;
    return piece;
}

static void view_take(oc_arena_t *arena, const layout_t *l, stored_view_t *view)
{
    view->grey_px = piece_of(arena, l->grey);
    view->colour_px = piece_of(arena, l->colour);
    view->junctions = piece_of(arena, l->junctions);
    view->votes = piece_of(arena, l->votes);
    view->order = piece_of(arena, l->sent_indices);
    view->transmitted = piece_of(arena, l->sent_indices);
    view->sent_label = piece_of(arena, l->sent_labels);
    view->solid = piece_of(arena, l->solid);
}

oc_status_t oc_vehicle_init(const oc_vehicle_config_t *config, void *block, size_t n_bytes, oc_vehicle_t **vehicle)
{
    OC_ASSERT(config && vehicle);

    const size_t needed = oc_vehicle_size(config);
    if (needed == 0 || !block || (uintptr_t)block % OC_ARENA_ALIGN != 0) return OC_E_ARG;
    if (n_bytes < needed) return OC_E_SPACE;

    oc_arena_t arena;
    const oc_status_t status = oc_arena_init(&arena, block, needed);
    if (status != OC_OK) return status;
    const layout_t l = layout_of(config);
    oc_vehicle_t *v = piece_of(&arena, l.vehicle);
    v->config = *config;
    for (uint32_t i = 0; i < OC_MAX_CAMERAS; i++) oc_keyframe_init(&v->policies[i], &config->keyframe);
    v->views = piece_of(&arena, l.views);
    v->grey_px = piece_of(&arena, l.grey);
    v->junctions = piece_of(&arena, l.junctions);
    v->outgoing = piece_of(&arena, l.outgoing);
    v->judoca_block = piece_of(&arena, l.judoca);
    v->judoca_bytes = l.judoca;
    if (config->with_silhouettes) {
        const oc_status_t made =
            oc_silhouette_init(&v->silhouette_ws, &arena, config->max_width_px, config->max_height_px);
        OC_ASSERT(made == OC_OK);
        (void)made;
    }
    for (uint32_t i = 0; i < config->stored_views; i++) view_take(&arena, &l, &v->views[i]);
    *vehicle = v;
    return OC_OK;
}

/* ---- small things ---- */

void oc_vehicle_add(oc_vehicle_t *vehicle, oc_counter_t counter, uint32_t n)
{
    uint32_t *c = &vehicle->counters[counter];
    *c = n > UINT32_MAX - *c ? UINT32_MAX : *c + n;
}

void oc_vehicle_count(oc_vehicle_t *vehicle, oc_counter_t counter)
{
    OC_ASSERT(vehicle && (unsigned)counter < OC_N_COUNTERS);
    oc_vehicle_add(vehicle, counter, 1);
}

uint16_t oc_vehicle_next_sequence(oc_vehicle_t *vehicle)
{
    OC_ASSERT(vehicle);
    return vehicle->sequence++;
}

void oc_vehicle_get_status(const oc_vehicle_t *vehicle, oc_vehicle_status_t *status)
{
    OC_ASSERT(vehicle && status);
    status->n_views = vehicle->n_views;
    status->newest_view = vehicle->newest_view;
    status->area = vehicle->config.area;
    memcpy(status->counters, vehicle->counters, sizeof status->counters);
}

stored_view_t *oc_vehicle_by_age(const oc_vehicle_t *vehicle, uint32_t age)
{
    const uint32_t n = vehicle->config.stored_views;
    return &vehicle->views[(vehicle->next_slot + n - 1u - age) % n];
}

stored_view_t *oc_vehicle_find(const oc_vehicle_t *vehicle, uint16_t view)
{
    for (uint32_t age = 0; age < vehicle->n_stored; age++) {
        stored_view_t *stored = oc_vehicle_by_age(vehicle, age);
        if (stored->head.view == view) return stored;
    }
    return NULL;
}

oc_status_t oc_vehicle_stored(const oc_vehicle_t *vehicle, uint16_t view, oc_image_t *image)
{
    OC_ASSERT(vehicle && image);
    const stored_view_t *stored = oc_vehicle_find(vehicle, view);
    if (!stored) return OC_E_STATE;
    *image = stored->colour.channels == 3 ? stored->colour : stored->grey;
    return OC_OK;
}

oc_status_t oc_vehicle_junctions(const oc_vehicle_t *vehicle, uint16_t view, const oc_junction_t **junctions,
                                 uint32_t *n_junctions)
{
    OC_ASSERT(vehicle && junctions && n_junctions);
    const stored_view_t *stored = oc_vehicle_find(vehicle, view);
    if (!stored) return OC_E_STATE;
    *junctions = stored->junctions;
    *n_junctions = stored->n_junctions;
    return OC_OK;
}

/* ---- a frame ---- */

static oc_view_head_t head_of(const oc_vehicle_t *vehicle, const oc_frame_t *frame)
{
    return (oc_view_head_t){.view = frame->has_view_id ? frame->view_id : vehicle->next_view,
                            .camera_index = frame->camera_index,
                            .utime_us = frame->utime_us,
                            .camera = frame->camera,
                            .margin = frame->margin,
                            .has_distortion = frame->has_distortion,
                            .distortion = frame->distortion};
}

static oc_status_t frame_check(oc_vehicle_t *vehicle, const oc_frame_t *frame)
{
    const oc_image_t *image = &frame->image;
    if (!oc_image_is_valid(image)) return OC_E_ARG;
    if (!oc_intrinsics_is_valid(&frame->camera.k) || !oc_pose_is_valid(&frame->camera.pose)) return OC_E_ARG;
    if (frame->camera.k.width_px != image->width_px || frame->camera.k.height_px != image->height_px) {
        return OC_E_ARG;
    }
    for (int i = 0; i < 6; i++) {
        if (!(frame->margin.v[i] >= 0.0 && isfinite(frame->margin.v[i]))) return OC_E_ARG;
    }
    if (image->width_px > vehicle->config.max_width_px || image->height_px > vehicle->config.max_height_px ||
        frame->camera_index >= OC_MAX_CAMERAS) {
        return OC_E_LIMIT;
    }
    const oc_view_head_t head = head_of(vehicle, frame);
    if (frame->has_view_id && oc_vehicle_find(vehicle, frame->view_id)) return OC_E_ARG;

    /* What the wire cannot carry is found now, not after the view is stored. */
    const oc_packet_head_t packet = {.type = OC_PACKET_VIEW, .vehicle = vehicle->config.vehicle};
    size_t n_bytes;
    uint16_t taken, tied;
    const oc_status_t status = oc_packet_encode_view(&packet, &head, NULL, 0, 0, NULL, 0, 0, vehicle->datagram,
                                                     vehicle->config.datagram_bytes, &n_bytes, &taken, &tied);
    return status == OC_OK ? OC_OK : OC_E_ARG;
}

/* JUDOCA's maps are made for one size; remake them when the frames' size changes. */
static oc_status_t judoca_ready(oc_vehicle_t *vehicle, uint32_t width_px, uint32_t height_px)
{
    if (vehicle->judoca_width_px == width_px && vehicle->judoca_height_px == height_px) return OC_OK;

    oc_arena_t arena;
    vehicle->judoca_width_px = 0;
    oc_status_t status = oc_arena_init(&arena, vehicle->judoca_block, vehicle->judoca_bytes);
    if (status == OC_OK) {
        status = oc_judoca_init(&vehicle->judoca, &arena, width_px, height_px, &vehicle->config.judoca);
    }
    if (status != OC_OK) return OC_E_LIMIT;
    vehicle->judoca_width_px = width_px;
    vehicle->judoca_height_px = height_px;
    return OC_OK;
}

/* The slot of the next view, emptied of the oldest. */
static stored_view_t *slot_claim(oc_vehicle_t *vehicle)
{
    stored_view_t *slot = &vehicle->views[vehicle->next_slot];
    if (slot->is_used) oc_vehicle_forget(vehicle, slot);
    vehicle->next_slot = (vehicle->next_slot + 1u) % vehicle->config.stored_views;
    if (vehicle->n_stored < vehicle->config.stored_views) vehicle->n_stored++;
    slot->is_used = true;
    return slot;
}

static void pixels_store(const oc_vehicle_t *vehicle, const oc_frame_t *frame, stored_view_t *slot)
{
    const oc_image_t *image = &frame->image;
    const uint32_t w = image->width_px, h = image->height_px;
    memcpy(slot->grey_px, vehicle->grey_px, (size_t)w * h);
    slot->grey = (oc_image_t){slot->grey_px, w, h, w, 1};
    slot->colour = (oc_image_t){NULL, w, h, 3u * w, 0};
    if (!vehicle->config.keep_colour || image->channels != 3) return;
    for (uint32_t y = 0; y < h; y++) {
        memcpy(slot->colour_px + (size_t)y * 3u * w, image->px + (size_t)y * image->stride_bytes, 3u * (size_t)w);
    }
    slot->colour.px = slot->colour_px;
    slot->colour.channels = 3;
}

/* Junctions that travel: not ground, inside the area, best score first. */
static void sending_choose(oc_vehicle_t *vehicle, stored_view_t *view)
{
    const uint32_t limit = vehicle->config.max_sent_junctions;
    uint32_t n = 0, n_capped = 0;
    for (uint32_t i = 0; i < view->n_junctions; i++) { /* detection gives them best first */
        const oc_junction_t *junction = &view->junctions[i];
        if (junction->label == OC_LABEL_GROUND) continue;
        if (!oc_area_is_hit(&vehicle->config.area, &view->head.camera, &view->head.margin, (double)junction->x_px,
                            (double)junction->y_px)) {
            continue;
        }
        if (n == limit) {
            n_capped++;
            continue;
        }
        view->sent_label[i] = junction->label;
        view->order[n++] = (uint16_t)i;
    }
    view->n_sent = (uint16_t)n;
    oc_vehicle_add(vehicle, OC_COUNT_JUNCTIONS_CAPPED, n_capped);
}

static void report_fill(const stored_view_t *view, oc_push_report_t *report)
{
    *report = (oc_push_report_t){.is_keyframe = true,
                                 .view = view->head.view,
                                 .n_found = view->n_junctions,
                                 .n_sent = view->n_sent,
                                 .n_ties = view->n_ties};
    for (uint32_t i = 0; i < view->n_junctions; i++) {
        const uint8_t label = view->junctions[i].label;
        if (label == OC_LABEL_GROUND) report->n_ground++;
        if (label == OC_LABEL_OBSTACLE) report->n_obstacle++;
        if (label == OC_LABEL_UNKNOWN) report->n_unknown++;
    }
}

/* Everything can only succeed from here on. */
static void view_add(oc_vehicle_t *vehicle, const oc_frame_t *frame, uint32_t n_junctions, oc_push_report_t *report)
{
    const oc_view_head_t head = head_of(vehicle, frame);
    stored_view_t *view = slot_claim(vehicle);
    view->head = head;
    pixels_store(vehicle, frame, view);
    view->has_solid = false;
    view->n_junctions = n_junctions;
    memcpy(view->junctions, vehicle->junctions, n_junctions * sizeof *view->junctions);
    memset(view->votes, 0, n_junctions * sizeof *view->votes);

    oc_vehicle_filter(vehicle, view);
    sending_choose(vehicle, view);
    const bool is_held = vehicle->config.hold_views && !frame->is_forced;
    if (oc_vehicle_plan(vehicle, view, is_held) != OC_OK) oc_vehicle_add(vehicle, OC_COUNT_SEND_FAILED, 1);

    vehicle->next_view = (uint16_t)(head.view + 1u);
    vehicle->newest_view = head.view;
    if (vehicle->n_views < UINT16_MAX) vehicle->n_views++;
    report_fill(view, report);
}

oc_status_t oc_vehicle_push(oc_vehicle_t *vehicle, const oc_frame_t *frame, oc_push_report_t *report)
{
    OC_ASSERT(vehicle && frame && report);

    oc_vehicle_add(vehicle, OC_COUNT_FRAMES_IN, 1);
    oc_status_t status = frame_check(vehicle, frame);
    if (status != OC_OK) return status;
    const uint32_t w = frame->image.width_px, h = frame->image.height_px;
    oc_image_mut_t grey_out = {vehicle->grey_px, w, h, w, 1};
    const oc_image_t grey = {vehicle->grey_px, w, h, w, 1};
    status = oc_image_to_grey(&frame->image, &grey_out);
    if (status == OC_OK) status = judoca_ready(vehicle, w, h);
    if (status != OC_OK) return status;

    oc_keyframe_t *policy = &vehicle->policies[frame->camera_index];
    const oc_pose_t *pose = &frame->camera.pose;
    const bool is_wanted = oc_keyframe_wants(policy, pose, oc_keyframe_sharpness(&grey));
    if (!is_wanted && !frame->is_forced) {
        oc_vehicle_add(vehicle, OC_COUNT_FRAMES_NOT_KEY, 1);
        *report = (oc_push_report_t){.is_keyframe = false};
        return OC_OK;
    }

    uint32_t n_junctions;
    status = oc_judoca_detect(&vehicle->judoca, &grey, vehicle->junctions, vehicle->config.judoca.max_junctions,
                              &n_junctions);
    if (status != OC_OK) return status;
    oc_vehicle_add(vehicle, OC_COUNT_JUNCTIONS_CAPPED, vehicle->judoca.stats.n_dropped);
    oc_keyframe_accept(policy, pose);
    view_add(vehicle, frame, n_junctions, report);
    return OC_OK;
}
