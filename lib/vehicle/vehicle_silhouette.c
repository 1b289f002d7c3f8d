/* SPDX-License-Identifier: BSD-3-Clause
 * Silhouettes that the base asks for: made one by one out of the stored views, when their turn comes. */
#include <math.h>
#include <string.h>

#include "core/mat3.h"
#include "vehicle/vehicle_internal.h"

/* Cells are doubled until a silhouette fits its datagram, up to this. */
#define MAX_STEP_PX 16u

#define BLOCK_PX 8u

/* ---- requests in ---- */

static bool is_wanted_at_all(const oc_silhouette_request_t *request)
{
    for (uint32_t i = 0; i < request->n_views; i++) {
        if (request->views[i].is_wanted) return true;
    }
    return false;
}

oc_status_t oc_vehicle_ask_silhouettes(oc_vehicle_t *vehicle, const oc_silhouette_request_t *request)
{
    oc_silhouette_request_t left = *request;
    for (uint32_t i = 0; i < left.n_views; i++) {
        if (!left.views[i].is_wanted || oc_vehicle_find(vehicle, left.views[i].view)) continue;
        left.views[i].is_wanted = false;
        oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_GONE, 1);
    }
    if (!is_wanted_at_all(&left)) return OC_E_STATE;
    for (uint32_t q = 0; q < vehicle->n_silhouettes; q++) {
        oc_silhouette_request_t *waiting = &vehicle->silhouettes[q];
        if (waiting->key != left.key || waiting->n_views != left.n_views) continue;
        for (uint32_t i = 0; i < left.n_views; i++) {
            if (left.views[i].is_wanted) waiting->views[i].is_wanted = true;
        }
        return OC_OK;
    }
    if (vehicle->n_silhouettes == OC_MAX_WAITING_SILHOUETTES) {
        oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_FULL, 1);
        return OC_E_SPACE;
    }
    vehicle->silhouettes[vehicle->n_silhouettes++] = left;
    return OC_OK;
}

/* ---- one silhouette ---- */

/* R = exp(turn) R, Rodrigues. */
static void turned(const double turn[3], const double R[9], double out[9])
{
    const double angle = oc_vec3_norm(turn);
    double by[9];
    oc_mat3_identity(by);
    if (angle > 0.0) {
        const double axis[3] = {turn[0] / angle, turn[1] / angle, turn[2] / angle};
        double skew[9], square[9];
        oc_mat3_skew(axis, skew);
        oc_mat3_mul(skew, skew, square);
        for (int i = 0; i < 9; i++) by[i] += sin(angle) * skew[i] + (1.0 - cos(angle)) * square[i];
    }
    oc_mat3_mul(by, R, out);
}

static void sight_make(const stored_view_t *stored, const oc_pose_step_t *step, oc_sight_t *sight)
{
    const oc_camera_t *reported = &stored->head.camera;
    double centre[3], R[9];
    oc_pose_centre(&reported->pose, centre);
    for (int i = 0; i < 3; i++) centre[i] += step->move_m[i];
    turned(step->turn_rad, reported->pose.R, R);
    sight->camera.k = reported->k;
    oc_pose_from_centre(R, centre, &sight->camera.pose);
    sight->image = stored->colour.channels == 3 ? stored->colour : stored->grey;
}

/* Blocks with a pixel that is not ground may be asked for as texture. */
static void solid_mark(stored_view_t *view, uint16_t key, const oc_pixel_rect_t *rect, const uint8_t *labels)
{
    const uint32_t across = (view->grey.width_px + BLOCK_PX - 1u) / BLOCK_PX;
    if (!view->has_solid || view->solid_key != key) {
        memset(view->solid, 0, (size_t)across * ((view->grey.height_px + BLOCK_PX - 1u) / BLOCK_PX));
        view->has_solid = true;
        view->solid_key = key;
    }
    const uint32_t w = rect->x1 - rect->x0;
    for (uint32_t y = rect->y0; y < rect->y1; y++) {
        for (uint32_t x = rect->x0; x < rect->x1; x++) {
            if (labels[(size_t)(y - rect->y0) * w + (x - rect->x0)] != OC_LABEL_GROUND)
                view->solid[(size_t)(y / BLOCK_PX) * across + x / BLOCK_PX] = 1;
        }
    }
}

/* The finest cells that fit; one unknown cell when there is nothing to say. */
static oc_status_t silhouette_encode(oc_vehicle_t *vehicle, oc_silhouette_t *out, uint32_t step_px,
                                     const oc_pixel_rect_t *rect, const uint8_t *labels, uint8_t *buf, size_t *n_bytes)
{
    const oc_packet_head_t packet = {
        .type = OC_PACKET_SILHOUETTE, .vehicle = vehicle->config.vehicle, .sequence = vehicle->sequence};
    /* The workspace's maps are free by now; a map of cells is never larger than one of pixels. */
    uint8_t *cells = vehicle->silhouette_ws.mask;
    for (; step_px <= MAX_STEP_PX; step_px *= 2u) {
        oc_silhouette_to_cells(rect, labels, step_px, out, cells);
        if ((uint32_t)out->n_cols * out->n_rows > OC_MAX_SILHOUETTE_CELLS) continue;
        const oc_status_t status =
            oc_packet_encode_silhouette(&packet, out, cells, buf, vehicle->config.datagram_bytes, n_bytes);
        if (status != OC_E_SPACE) return status;
    }
    const uint8_t nothing = OC_LABEL_UNKNOWN;
    out->col = out->row = 0;
    out->n_cols = out->n_rows = 1;
    out->step_px = MAX_STEP_PX;
    return oc_packet_encode_silhouette(&packet, out, &nothing, buf, vehicle->config.datagram_bytes, n_bytes);
}

static oc_status_t silhouette_make(oc_vehicle_t *vehicle, const oc_silhouette_request_t *request, uint32_t view_index,
                                   uint32_t box, uint8_t *buf, size_t *n_bytes)
{
    oc_sight_t view = {.image = {.px = NULL}}, references[OC_MAX_SILHOUETTE_VIEWS];
    uint32_t n = 0;
    for (uint32_t i = 0; i < request->n_views; i++) {
        const stored_view_t *stored = oc_vehicle_find(vehicle, request->views[i].view);
        if (!stored) continue;
        sight_make(stored, &request->views[i], i == view_index ? &view : &references[n++]);
    }
    stored_view_t *own = oc_vehicle_find(vehicle, request->views[view_index].view);
    if (!own) return OC_E_STATE;
    const oc_silhouette_task_t task = {.boxes = request->boxes,
                                       .n_boxes = request->n_boxes,
                                       .subject = box,
                                       .grow = request->grow_percent * 0.01,
                                       .method = request->is_thesis ? OC_SILHOUETTE_THESIS : OC_SILHOUETTE_BEST};
    oc_silhouette_t out = {.view = own->head.view, .key = request->key, .box = (uint8_t)box};
    oc_pixel_rect_t rect = {0, 0, 1, 1};
    const uint8_t unknown = OC_LABEL_UNKNOWN, *labels = &unknown;
    const oc_status_t status = oc_silhouette_find(&vehicle->silhouette_ws, &view, references, n, &task, &rect, &labels);
    if (status == OC_OK) solid_mark(own, request->key, &rect, labels);
    return silhouette_encode(vehicle, &out, status == OC_OK ? request->step_px : MAX_STEP_PX, &rect, labels, buf,
                             n_bytes);
}

/* ---- packets out ---- */

/* Index of the first view that is still wanted; n_views when there is none. */
static uint32_t first_wanted(const oc_silhouette_request_t *request)
{
    uint32_t i = 0;
    while (i < request->n_views && !request->views[i].is_wanted) i++;
    return i;
}

static void request_drop(oc_vehicle_t *vehicle)
{
    vehicle->n_silhouettes--;
    memmove(&vehicle->silhouettes[0], &vehicle->silhouettes[1],
            vehicle->n_silhouettes * sizeof vehicle->silhouettes[0]);
    vehicle->next_box = 0;
}

oc_status_t oc_vehicle_next_silhouette(oc_vehicle_t *vehicle, uint8_t *buf, size_t *n_bytes)
{
    while (vehicle->n_silhouettes > 0) {
        oc_silhouette_request_t *request = &vehicle->silhouettes[0];
        const uint32_t view = first_wanted(request);
        if (view == request->n_views) {
            request_drop(vehicle);
            continue;
        }
        while (vehicle->next_box < request->n_boxes && !request->boxes[vehicle->next_box].is_subject)
            vehicle->next_box++;
        if (vehicle->next_box == request->n_boxes) {
            request->views[view].is_wanted = false;
            vehicle->next_box = 0;
            continue;
        }
        const oc_status_t status = silhouette_make(vehicle, request, view, vehicle->next_box++, buf, n_bytes);
        if (status == OC_E_STATE) { /* the view has left the ring meanwhile */
            request->views[view].is_wanted = false;
            vehicle->next_box = 0;
            oc_vehicle_add(vehicle, OC_COUNT_REQUESTS_GONE, 1);
            continue;
        }
        return status;
    }
    return OC_OK;
}
