/* SPDX-License-Identifier: BSD-3-Clause
 * What waits to be sent. Nothing is kept as bytes: a packet is encoded into the
 * caller's buffer when its turn comes, and a resend encodes the same bits again. */
#include <string.h>

#include "vehicle/vehicle_internal.h"

/* ---- the parts of a view ---- */

/* The junctions from `first` on as the encoder wants them: best first. The
 * score carries the junction's index through the encoder's reordering. */
static void outgoing_fill(oc_vehicle_t *vehicle, const stored_view_t *view, uint32_t first)
{
    for (uint32_t k = first; k < view->n_sent; k++) {
        vehicle->outgoing[k] = view->junctions[view->order[k]];
        vehicle->outgoing[k].label = view->sent_label[view->order[k]];
        vehicle->outgoing[k].score = (float)view->order[k];
    }
}

/* Encode the part that starts at run->first and run->first_tie; writes how much it took. */
static oc_status_t part_encode(oc_vehicle_t *vehicle, const stored_view_t *view, uint32_t part, uint16_t sequence,
                               view_run_t *run, uint8_t *buf, size_t *n_bytes)
{
    const oc_packet_head_t packet = {.type = OC_PACKET_VIEW, .vehicle = vehicle->config.vehicle, .sequence = sequence};
    oc_view_head_t head = view->head;
    head.part = (uint8_t)part;
    outgoing_fill(vehicle, view, run->first);
    return oc_packet_encode_view(&packet, &head, vehicle->outgoing, view->n_sent, run->first, view->ties, view->n_ties,
                                 run->first_tie, buf, vehicle->config.datagram_bytes, n_bytes, &run->n, &run->n_ties);
}

/* Part boundaries for what the view has to send. Ends early, without error,
 * after OC_MAX_VIEW_PARTS parts. */
static oc_status_t runs_make(oc_vehicle_t *vehicle, stored_view_t *view, view_run_t *end)
{
    *end = (view_run_t){0};
    view->n_parts = 0;
    while (view->n_parts < OC_MAX_VIEW_PARTS && (end->first < view->n_sent || end->first_tie < view->n_ties)) {
        view_run_t run = *end;
        size_t n_bytes;
        const oc_status_t status = part_encode(vehicle, view, view->n_parts, 0, &run, vehicle->datagram, &n_bytes);
        if (status != OC_OK) return status;
        for (uint32_t k = 0; k < run.n; k++) {
            view->transmitted[run.first + k] = (uint16_t)vehicle->outgoing[run.first + k].score;
        }
        view->runs[view->n_parts++] = run;
        end->first = (uint16_t)(run.first + run.n);
        end->first_tie = (uint16_t)(run.first_tie + run.n_ties);
    }
    return OC_OK;
}

/* All of a view's parts, or its announcement. */
static uint32_t all_parts(const stored_view_t *view)
{
    return view->is_announced ? 1u : (uint32_t)(((uint64_t)1 << view->n_parts) - 1u);
}

oc_status_t oc_vehicle_plan(oc_vehicle_t *vehicle, stored_view_t *view, bool is_held)
{
    view->again_parts = 0;
    view->relabel_from = view->relabel_to = 0;
    view->n_parts = 0;
    oc_status_t status = OC_OK;
    for (int attempt = 0; attempt < 3; attempt++) {
        view_run_t end;
        status = runs_make(vehicle, view, &end);
        if (status != OC_OK || (end.first == view->n_sent && end.first_tie == view->n_ties)) break;
        /* The tail does not travel; what is then the last part must say so. */
        oc_vehicle_add(vehicle, OC_COUNT_JUNCTIONS_CAPPED, (uint32_t)(view->n_sent - end.first));
        view->n_sent = end.first;
        view->n_ties = end.first_tie;
        status = OC_E_SPACE;
    }
    if (status != OC_OK) view->n_sent = view->n_ties = view->n_parts = 0;
    view->is_held = is_held && view->n_parts > 0;
    view->is_announced = view->is_held || view->n_parts == 0;
    view->unsent_parts = all_parts(view);
    return status;
}

/* Labels that changed while it was held follow as a relabel. */
static void set_free(oc_vehicle_t *vehicle, stored_view_t *view)
{
    view->is_held = view->is_announced = false;
    view->unsent_parts = all_parts(view);
    view->again_parts = 0;
    oc_vehicle_add(vehicle, OC_COUNT_RECALLED, 1);
}

oc_status_t oc_vehicle_recall(oc_vehicle_t *vehicle, int64_t from_us, int64_t to_us, uint32_t *n)
{
    OC_ASSERT(vehicle && n);
    if (from_us > to_us) return OC_E_ARG;
    *n = 0;
    for (uint32_t age = 0; age < vehicle->n_stored; age++) {
        stored_view_t *view = oc_vehicle_by_age(vehicle, age);
        if (view->head.utime_us < from_us || view->head.utime_us > to_us) continue;
        if (view->is_held) {
            set_free(vehicle, view);
        } else {
            view->again_parts |= all_parts(view) & ~view->unsent_parts;
        }
        ++*n;
    }
    return OC_OK;
}

void oc_vehicle_forget(oc_vehicle_t *vehicle, stored_view_t *view)
{
    if (view->unsent_parts != 0 && !view->is_held) oc_vehicle_add(vehicle, OC_COUNT_VIEWS_DROPPED, 1);
    uint32_t n = 0;
    for (uint32_t i = 0; i < vehicle->n_patches; i++) {
        if (vehicle->patches[i].view == view->head.view) {
            oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_GONE, 1);
            continue;
        }
        if (n != i) vehicle->patches[n] = vehicle->patches[i];
        n++;
    }
    vehicle->n_patches = n;
    view->is_used = false;
}

void oc_vehicle_relabelled(stored_view_t *view, uint32_t from, uint32_t to)
{
    if (view->relabel_from == view->relabel_to) {
        view->relabel_from = (uint16_t)from;
        view->relabel_to = (uint16_t)to;
        return;
    }
    if (from < view->relabel_from) view->relabel_from = (uint16_t)from;
    if (to > view->relabel_to) view->relabel_to = (uint16_t)to;
}

/* ---- requests in ---- */

static oc_status_t handle_resend(oc_vehicle_t *vehicle, const oc_resend_request_t *request)
{
    stored_view_t *view = oc_vehicle_find(vehicle, request->view);
    if (!view) {
        oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_GONE, 1);
        return OC_E_STATE;
    }
    if (view->is_held) {
        set_free(vehicle, view);
        return OC_OK;
    }
    if (request->parts == 0 && view->n_sent > 0) oc_vehicle_relabelled(view, 0, view->n_sent);
    /* The base cannot know how many parts there are: bits beyond the last mean nothing. */
    view->again_parts |= request->parts & all_parts(view) & ~view->unsent_parts;
    return OC_OK;
}

static bool blocks_contain(const oc_patch_request_t *waiting, uint16_t block)
{
    uint32_t low = 0, high = waiting->n_blocks;
    while (low < high) {
        const uint32_t middle = (low + high) / 2u;
        if (waiting->blocks[middle] < block) {
            low = middle + 1u;
        } else {
            high = middle;
        }
    }
    return low < waiting->n_blocks && waiting->blocks[low] == block;
}

/* Drop from the request what already waits at the same quality or better. */
static void blocks_without_waiting(const oc_vehicle_t *vehicle, oc_patch_request_t *request)
{
    for (uint32_t i = 0; i < vehicle->n_patches; i++) {
        const oc_patch_request_t *waiting = &vehicle->patches[i];
        if (waiting->view != request->view || waiting->quality < request->quality) continue;
        uint16_t n = 0;
        for (uint32_t b = 0; b < request->n_blocks; b++) {
            if (!blocks_contain(waiting, request->blocks[b])) request->blocks[n++] = request->blocks[b];
        }
        request->n_blocks = n;
    }
}

/* Merge two ascending lists without common members, from the back, in place. */
static void blocks_merge(oc_patch_request_t *into, const oc_patch_request_t *from)
{
    uint32_t a = into->n_blocks, b = from->n_blocks, out = a + b;
    into->n_blocks = (uint16_t)out;
    while (b > 0) {
        if (a > 0 && into->blocks[a - 1] > from->blocks[b - 1]) {
            into->blocks[--out] = into->blocks[--a];
        } else {
            into->blocks[--out] = from->blocks[--b];
        }
    }
}

static oc_status_t handle_patch(oc_vehicle_t *vehicle, oc_patch_request_t *request)
{
    const stored_view_t *view = oc_vehicle_find(vehicle, request->view);
    if (!view) {
        oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_GONE, 1);
        return OC_E_STATE;
    }
    const uint32_t columns = (view->grey.width_px + OC_BLOCK_PX - 1u) / OC_BLOCK_PX;
    const uint32_t rows = (view->grey.height_px + OC_BLOCK_PX - 1u) / OC_BLOCK_PX;
    if (request->n_blocks == 0 || request->blocks[request->n_blocks - 1u] >= columns * rows) {
        oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_BAD, 1);
        return OC_E_FORMAT;
    }

    blocks_without_waiting(vehicle, request);
    if (request->n_blocks == 0) return OC_OK;
    for (uint32_t i = 0; i < vehicle->n_patches; i++) {
        oc_patch_request_t *waiting = &vehicle->patches[i];
        if (waiting->view != request->view || waiting->quality != request->quality) continue;
        if (request->n_blocks > OC_MAX_PACKET_BLOCKS - waiting->n_blocks) continue;
        blocks_merge(waiting, request);
        return OC_OK;
    }
    if (vehicle->n_patches == OC_MAX_WAITING_PATCHES) {
        oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_FULL, 1);
        return OC_E_SPACE;
    }
    vehicle->patches[vehicle->n_patches++] = *request;
    return OC_OK;
}

oc_status_t oc_vehicle_handle(oc_vehicle_t *vehicle, const uint8_t *packet, size_t n_bytes)
{
    OC_ASSERT(vehicle && (packet || n_bytes == 0));

    oc_packet_head_t head;
    oc_resend_request_t resend;
    oc_patch_request_t patch;
    oc_silhouette_request_t silhouettes;
    oc_status_t status = packet ? oc_packet_decode_head(packet, n_bytes, &head) : OC_E_FORMAT;
    if (status == OC_OK && head.vehicle != vehicle->config.vehicle) return OC_OK; /* for another one on the link */
    if (status == OC_OK && head.type == OC_PACKET_RESEND_REQUEST) {
        status = oc_packet_decode_resend(packet, n_bytes, &resend);
        if (status == OC_OK) return handle_resend(vehicle, &resend);
    } else if (status == OC_OK && head.type == OC_PACKET_PATCH_REQUEST) {
        status = oc_packet_decode_patch_request(packet, n_bytes, &patch);
        if (status == OC_OK) return handle_patch(vehicle, &patch);
    } else if (status == OC_OK && head.type == OC_PACKET_SILHOUETTE_REQUEST && vehicle->config.with_silhouettes) {
        status = oc_packet_decode_silhouette_request(packet, n_bytes, &silhouettes);
        if (status == OC_OK) return oc_vehicle_ask_silhouettes(vehicle, &silhouettes);
    }
    oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_BAD, 1);
    return OC_E_FORMAT;
}

/* ---- packets out ----
 * Each returns OC_OK with *n_bytes = 0 when it has nothing. */

static uint32_t lowest_bit(uint32_t mask)
{
    uint32_t i = 0;
    while (!(mask >> i & 1u)) i++;
    return i;
}

static oc_status_t announce_encode(const oc_vehicle_t *vehicle, const stored_view_t *view, uint8_t *buf,
                                   size_t *n_bytes)
{
    const oc_packet_head_t packet = {
        .type = OC_PACKET_ANNOUNCE, .vehicle = vehicle->config.vehicle, .sequence = vehicle->sequence};
    const oc_announce_t announce = {.view = view->head.view, .utime_us = view->head.utime_us};
    return oc_packet_encode_announce(&packet, &announce, buf, vehicle->config.datagram_bytes, n_bytes);
}

/* A part goes out again as it was; labels that have changed since follow it. */
static void labels_follow(stored_view_t *view, const view_run_t *run)
{
    for (uint32_t k = run->first; k < (uint32_t)run->first + run->n; k++) {
        const uint16_t i = view->transmitted[k];
        if (view->junctions[i].label != view->sent_label[i]) oc_vehicle_relabelled(view, k, k + 1);
    }
}

/* Send the lowest part in *mask and clear its bit. */
static oc_status_t next_part(oc_vehicle_t *vehicle, stored_view_t *view, uint32_t *mask, bool is_again, uint8_t *buf,
                             size_t *n_bytes)
{
    const uint32_t part = lowest_bit(*mask);
    oc_status_t status;
    if (view->is_announced) {
        status = announce_encode(vehicle, view, buf, n_bytes);
    } else {
        view_run_t run = view->runs[part];
        status = part_encode(vehicle, view, part, vehicle->sequence, &run, buf, n_bytes);
        if (is_again) labels_follow(view, &run);
    }
    *mask &= ~(1u << part);
    return status;
}

static oc_status_t next_view(oc_vehicle_t *vehicle, bool is_again, uint8_t *buf, size_t *n_bytes)
{
    for (uint32_t age = 0; age < vehicle->n_stored; age++) {
        stored_view_t *view = oc_vehicle_by_age(vehicle, age);
        uint32_t *mask = is_again ? &view->again_parts : &view->unsent_parts;
        if (*mask == 0) continue;
        const oc_status_t status = next_part(vehicle, view, mask, is_again, buf, n_bytes);
        if (!is_again && *mask == 0 && !view->is_held) oc_vehicle_add(vehicle, OC_COUNT_VIEWS_SENT, 1);
        return status;
    }
    return OC_OK;
}

/* One relabel packet: as much of the view's changed range as fits. */
static oc_status_t next_relabel_of(const oc_vehicle_t *vehicle, stored_view_t *view, uint8_t *buf, size_t *n_bytes)
{
    const oc_packet_head_t packet = {
        .type = OC_PACKET_RELABEL, .vehicle = vehicle->config.vehicle, .sequence = vehicle->sequence};
    oc_relabel_t relabel = {.view = view->head.view, .first = view->relabel_from};
    const uint32_t n = (uint32_t)(view->relabel_to - view->relabel_from);
    for (uint32_t k = 0; k < n; k++) {
        relabel.labels[k] = view->junctions[view->transmitted[view->relabel_from + k]].label;
    }
    oc_status_t status = OC_E_SPACE;
    for (relabel.n = (uint16_t)n; relabel.n > 0; relabel.n = (uint16_t)(relabel.n / 2u)) {
        status = oc_packet_encode_relabel(&packet, &relabel, buf, vehicle->config.datagram_bytes, n_bytes);
        if (status != OC_E_SPACE) break;
    }
    view->relabel_from = (uint16_t)(view->relabel_from + (status == OC_OK ? relabel.n : n));
    return status;
}

static oc_status_t next_relabel(oc_vehicle_t *vehicle, uint8_t *buf, size_t *n_bytes)
{
    for (uint32_t age = 0; age < vehicle->n_stored; age++) {
        stored_view_t *view = oc_vehicle_by_age(vehicle, age);
        if (view->is_held || view->relabel_from == view->relabel_to) continue;
        return next_relabel_of(vehicle, view, buf, n_bytes);
    }
    return OC_OK;
}

static oc_status_t next_patch(oc_vehicle_t *vehicle, uint8_t *buf, size_t *n_bytes)
{
    if (vehicle->n_patches == 0) return OC_OK;

    oc_patch_request_t *waiting = &vehicle->patches[0];
    const oc_packet_head_t packet = {
        .type = OC_PACKET_PATCH, .vehicle = vehicle->config.vehicle, .sequence = vehicle->sequence};
    const stored_view_t *view = oc_vehicle_find(vehicle, waiting->view);
    uint16_t taken = 0;
    oc_status_t status = OC_E_STATE;
    if (view) {
        status = oc_packet_encode_patch(&packet, waiting->view, waiting->quality, &view->grey, waiting->blocks,
                                        waiting->n_blocks, buf, vehicle->config.datagram_bytes, n_bytes, &taken);
    }
    /* A block that fits no datagram would block all others: let the request go. */
    const bool is_done = status != OC_OK || taken == 0 || taken == waiting->n_blocks;
    if (is_done) {
        vehicle->n_patches--;
        memmove(&vehicle->patches[0], &vehicle->patches[1], vehicle->n_patches * sizeof vehicle->patches[0]);
        return status;
    }
    waiting->n_blocks = (uint16_t)(waiting->n_blocks - taken);
    memmove(waiting->blocks, waiting->blocks + taken, waiting->n_blocks * sizeof waiting->blocks[0]);
    return OC_OK;
}

oc_status_t oc_vehicle_next(oc_vehicle_t *vehicle, uint8_t *buf, size_t cap, size_t *n_bytes)
{
    OC_ASSERT(vehicle && buf && n_bytes);
    if (cap < vehicle->config.datagram_bytes) return OC_E_SPACE;

    for (;;) {
        size_t n = 0;
        oc_status_t status = next_view(vehicle, false, buf, &n);
        if (status == OC_OK && n == 0) status = next_relabel(vehicle, buf, &n);
        if (status == OC_OK && n == 0) status = next_view(vehicle, true, buf, &n);
        if (status == OC_OK && n == 0) status = next_patch(vehicle, buf, &n);
        if (status == OC_OK && n == 0) status = oc_vehicle_next_silhouette(vehicle, buf, &n);
        if (status == OC_OK) {
            if (n > 0) vehicle->sequence++;
            *n_bytes = n;
            return OC_OK;
        }
        /* What could not be encoded has been taken off the queue; go on with the rest. */
        oc_vehicle_add(vehicle, OC_COUNT_SEND_FAILED, 1);
    }
}
