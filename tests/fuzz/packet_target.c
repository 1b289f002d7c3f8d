/* SPDX-License-Identifier: BSD-3-Clause
 * Fuzz target: any bytes into the packet decoders, then the invariants I1 to I14 of docs/protocol.md.
 *
 * The input is a packet without its CRC, which is added here: random bytes
 * would hardly ever get past it. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "core/packet_internal.h"
#include "packet_any.h"
#include "fuzz_target.h"

#define REQUIRE(id, condition)                                                                                         \
    do {                                                                                                               \
        if (!(condition)) broken(id, #condition);                                                                      \
    } while (0)

static void broken(const char *id, const char *condition)
{
    fprintf(stderr, "invariant %s is broken: %s\n", id, condition);
    abort();
}

static any_body_t body, again;
static oc_junction_t junctions[OC_MAX_JUNCTIONS];
static uint8_t out[OC_MAX_DATAGRAM_BYTES];
static size_t n_out;

/* ---- invariants ---- */

static bool is_inside(float value_px, uint32_t side_px)
{
    return value_px >= -0.5f && value_px < (float)side_px - 0.5f;
}

static bool is_multiple(float value_px, float per_px)
{
    return floorf((value_px + 0.5f) * per_px) == (value_px + 0.5f) * per_px;
}

static void check_view_head(const oc_view_head_t *head)
{
    REQUIRE("I3", head->utime_us >= 0 && head->utime_us < (int64_t)1 << 56);
    REQUIRE("I3", oc_intrinsics_is_valid(&head->camera.k) && oc_pose_is_valid(&head->camera.pose));
    REQUIRE("I3", head->camera.k.fx_px >= 1.0 && head->camera.k.fx_px <= 1e6);
    REQUIRE("I3", head->camera.k.fy_px >= 1.0 && head->camera.k.fy_px <= 1e6);
    double centre[3];
    oc_pose_centre(&head->camera.pose, centre);
    for (int i = 0; i < 3; i++) {
        REQUIRE("I3", fabs(centre[i]) <= 214748.3648);
    }
    for (int i = 0; i < 6; i++) {
        REQUIRE("I3", head->margin.v[i] >= 0.0 && head->margin.v[i] <= 65504.0);
    }
    for (int i = 0; i < 5; i++) {
        REQUIRE("I3", isfinite(head->distortion.k[i]) && (head->has_distortion || head->distortion.k[i] == 0.0));
    }
}

static void check_junction(const oc_junction_t *junction, const oc_intrinsics_t *k)
{
    REQUIRE("I5", is_inside(junction->x_px, k->width_px) && is_inside(junction->y_px, k->height_px));
    REQUIRE("I5", is_multiple(junction->x_px, 8.0f) && is_multiple(junction->y_px, 8.0f));
    REQUIRE("I6", junction->n_branches >= 1 && junction->n_branches <= OC_MAX_BRANCHES && junction->label <= 2);
    REQUIRE("I6", junction->kind == oc_junction_kind_of(junction->branch, junction->n_branches));
    REQUIRE("I6", junction->confidence == 0);
    for (unsigned b = 0; b < junction->n_branches; b++) {
        const oc_branch_t *branch = &junction->branch[b];
        REQUIRE("I6", branch->angle_rad >= 0.0f && branch->angle_rad < 6.2831853f);
        REQUIRE("I6", b == 0 || branch->angle_rad >= junction->branch[b - 1].angle_rad);
        REQUIRE("I6", b != 1 || junction->n_branches != 2 || branch->angle_rad > junction->branch[0].angle_rad);
        REQUIRE("I6", branch->length_px == 0.0f && branch->strength == 0.0f);
    }
}

static void check_view(const oc_view_part_t *part)
{
    const oc_intrinsics_t *k = &part->head.camera.k;
    check_view_head(&part->head);
    REQUIRE("I4", part->first_junction <= OC_MAX_JUNCTIONS && part->n_ties <= OC_MAX_TIES);
    REQUIRE("I4", part->n_junctions <= OC_MAX_JUNCTIONS - part->first_junction);
    for (unsigned i = 0; i < part->n_junctions; i++) {
        const oc_junction_t *junction = &part->junctions[i], *before = junction - 1;
        check_junction(junction, k);
        REQUIRE("I6", junction->score == 1024.0f - (float)(part->first_junction + i));
        REQUIRE("I5", i == 0 || before->y_px < junction->y_px ||
                          (before->y_px == junction->y_px && before->x_px <= junction->x_px));
    }
    for (unsigned i = 0; i < part->n_ties; i++) {
        const oc_tie_t *tie = &part->ties[i];
        REQUIRE("I7", tie->ref_view != part->head.view);
        REQUIRE("I7", is_inside(tie->x_px, k->width_px) && is_inside(tie->y_px, k->height_px));
        REQUIRE("I7", is_inside(tie->ref_x_px, OC_MAX_IMAGE_SIDE) && is_inside(tie->ref_y_px, OC_MAX_IMAGE_SIDE));
        REQUIRE("I7", is_multiple(tie->x_px, 16.0f) && is_multiple(tie->ref_y_px, 16.0f));
    }
}

static void check_relabel(const oc_relabel_t *relabel)
{
    REQUIRE("I8", relabel->n >= 1 && relabel->first <= OC_MAX_JUNCTIONS);
    REQUIRE("I8", relabel->n <= OC_MAX_JUNCTIONS - relabel->first);
    for (unsigned i = 0; i < relabel->n; i++) {
        REQUIRE("I8", relabel->labels[i] <= 2);
    }
}

static void check_blocks(uint8_t quality, const uint16_t blocks[], uint16_t n)
{
    REQUIRE("I9", quality >= 1 && quality <= 31 && n >= 1 && n <= OC_MAX_PACKET_BLOCKS);
    for (unsigned i = 1; i < n; i++) {
        REQUIRE("I9", blocks[i] > blocks[i - 1]);
    }
}

static void check_patch(const oc_patch_t *patch)
{
    check_blocks(patch->quality, patch->blocks, patch->n_blocks);
    REQUIRE("I9", patch->blocks_per_row >= 4 && patch->blocks_per_row <= 512);
    REQUIRE("I9", patch->blocks[patch->n_blocks - 1] / patch->blocks_per_row < 512);
}

static void check_scale(double metres_per_pixel, uint16_t tile_px)
{
    REQUIRE("I10", metres_per_pixel >= 1e-5 && metres_per_pixel <= 100.0 && tile_px >= 16 && tile_px <= 256);
}

static void check_bytes(const uint8_t *bytes, size_t n, const uint8_t *buf, size_t n_bytes)
{
    REQUIRE("I11", n >= 1 && bytes > buf && n <= n_bytes - 2u - (size_t)(bytes - buf));
}

static void check_image(const oc_image_piece_t *piece, const uint8_t *buf, size_t n_bytes)
{
    check_view_head(&piece->head);
    check_bytes(piece->bytes, piece->n_bytes, buf, n_bytes);
    REQUIRE("I11", piece->codec >= 1 && piece->codec <= 3 && piece->total_bytes <= 0xffffff);
    REQUIRE("I11", piece->offset_bytes <= piece->total_bytes);
    REQUIRE("I11", piece->n_bytes <= piece->total_bytes - piece->offset_bytes);
    REQUIRE("I11", piece->head.is_last == (piece->n_bytes == piece->total_bytes - piece->offset_bytes));
}

/* ---- fixed points ---- */

static void same_view_again(const oc_packet_head_t *packet, const oc_view_part_t *part)
{
    uint16_t taken, tied;
    memcpy(junctions, part->junctions, part->n_junctions * sizeof junctions[0]);
    const oc_status_t status = oc_packet_encode_view(packet, &part->head, junctions, part->n_junctions, 0, part->ties,
                                                     part->n_ties, 0, out, sizeof out, &n_out, &taken, &tied);
    REQUIRE("I12", status == OC_OK && oc_packet_decode_view(out, n_out, &again.view) == OC_OK);
    const oc_view_part_t *other = &again.view;
    REQUIRE("I12", other->n_junctions == taken && other->n_ties == tied);
    oc_view_head_t head = other->head;
    REQUIRE("I12", head.is_last == (taken == part->n_junctions && tied == part->n_ties));
    head.is_last = part->head.is_last;
    REQUIRE("I12", memcmp(&head.camera.k, &part->head.camera.k, sizeof head.camera.k) == 0);
    REQUIRE("I12", memcmp(&head.margin, &part->head.margin, sizeof head.margin) == 0);
    REQUIRE("I12", memcmp(&head.distortion, &part->head.distortion, sizeof head.distortion) == 0);
    REQUIRE("I12", memcmp(head.camera.pose.R, part->head.camera.pose.R, sizeof head.camera.pose.R) == 0);
    REQUIRE("I12", memcmp(head.camera.pose.t, part->head.camera.pose.t, sizeof head.camera.pose.t) == 0);
    REQUIRE("I12", head.view == part->head.view && head.part == part->head.part);
    REQUIRE("I12", memcmp(part->ties, other->ties, tied * sizeof part->ties[0]) == 0);
    for (unsigned i = 0; i < taken; i++) {
        oc_junction_t junction = other->junctions[i];
        junction.score -= (float)part->first_junction;
        REQUIRE("I12", memcmp(&junction, &part->junctions[i], sizeof junction) == 0);
    }
}

static void same_patch_request_again(const oc_packet_head_t *packet, const oc_patch_request_t *request)
{
    uint16_t taken;
    const oc_status_t status = oc_packet_encode_patch_request(packet, request, out, sizeof out, &n_out, &taken);
    REQUIRE("I12", status == OC_OK && taken == request->n_blocks);
    REQUIRE("I12", oc_packet_decode_patch_request(out, n_out, &again.patch_request) == OC_OK);
    REQUIRE("I12", again.patch_request.view == request->view && again.patch_request.quality == request->quality);
    REQUIRE("I12", memcmp(again.patch_request.blocks, request->blocks, taken * sizeof request->blocks[0]) == 0);
}

static void same_overhead_request_again(const oc_packet_head_t *packet, const oc_overhead_request_t *request)
{
    uint16_t taken;
    const oc_status_t status = oc_packet_encode_overhead_request(packet, request, out, sizeof out, &n_out, &taken);
    REQUIRE("I12", status == OC_OK && taken == request->n_tiles);
    REQUIRE("I12", oc_packet_decode_overhead_request(out, n_out, &again.overhead_request) == OC_OK);
    REQUIRE("I12", memcmp(again.overhead_request.tiles, request->tiles, taken * sizeof request->tiles[0]) == 0);
    REQUIRE("I12", memcmp(again.overhead_request.image_from_ground, request->image_from_ground,
                          sizeof request->image_from_ground) == 0);
}

static void check_silhouette(const any_silhouette_t *s)
{
    const uint32_t n_cells = (uint32_t)s->head.n_cols * s->head.n_rows;
    REQUIRE("I13", n_cells >= 1 && n_cells <= ANY_CELLS && s->head.box < OC_MAX_SILHOUETTE_BOXES);
    REQUIRE("I13", s->head.col + s->head.n_cols <= 4096 && s->head.row + s->head.n_rows <= 4096);
    REQUIRE("I13", s->head.step_px == 1 || s->head.step_px == 2 || s->head.step_px == 4 || s->head.step_px == 8 ||
                       s->head.step_px == 16);
    for (uint32_t i = 0; i < n_cells; i++) {
        REQUIRE("I13", s->labels[i] <= 2);
    }
}

static void check_silhouette_request(const oc_silhouette_request_t *r)
{
    REQUIRE("I13", r->n_boxes >= 1 && r->n_boxes <= OC_MAX_SILHOUETTE_BOXES);
    REQUIRE("I13", r->n_views >= 1 && r->n_views <= OC_MAX_SILHOUETTE_VIEWS);
    REQUIRE("I13", (r->step_px == 1 || r->step_px == 2 || r->step_px == 4) && r->grow_percent <= 100);
    for (unsigned i = 0; i < r->n_boxes; i++) {
        const oc_ground_box_t *box = &r->boxes[i];
        REQUIRE("I13", box->length_m > 0.0 && box->width_m > 0.0 && box->height_m > 0.0 && box->height_m < 105.0);
        REQUIRE("I13", fabs(box->x_m) < 13422.0 && fabs(box->y_m) < 13422.0);
        REQUIRE("I13", box->yaw_rad >= 0.0 && box->yaw_rad < 3.1415927);
    }
    for (unsigned i = 0; i < r->n_views; i++) {
        REQUIRE("I13", i == 0 || r->views[i].view > r->views[i - 1].view);
        for (int k = 0; k < 3; k++) {
            REQUIRE("I13", fabs(r->views[i].move_m[k]) < 3.28 && fabs(r->views[i].turn_rad[k]) < 0.66);
        }
    }
}

static void check_texture_request(const oc_packet_head_t *packet, const oc_texture_request_t *r)
{
    uint16_t taken;
    REQUIRE("I14", r->is_cancelled || (r->n_tiles >= 1 && r->n_tiles <= OC_MAX_TEXTURE_TILES));
    REQUIRE("I14", r->is_cancelled || (r->tile_px >= 16 && r->tile_px <= 128 && r->budget_bytes >= 1));
    REQUIRE("I14", r->is_cancelled || (r->quality >= 1 && r->quality <= 100));
    for (unsigned i = 1; i < r->n_tiles; i++) {
        REQUIRE("I14", r->tiles[i] > r->tiles[i - 1]);
    }
    const oc_status_t status = oc_packet_encode_texture_request(packet, r, out, sizeof out, &n_out, &taken);
    REQUIRE("I12", status == OC_OK && taken == r->n_tiles);
    REQUIRE("I12", oc_packet_decode_texture_request(out, n_out, &again.texture_request) == OC_OK);
    REQUIRE("I12", memcmp(&again.texture_request, r, sizeof *r) == 0);
}

/* Those whose every value has one code only: the same bytes must come out. */
static void same_bytes_again(const oc_packet_head_t *packet, const uint8_t *buf, size_t n_bytes)
{
    uint16_t taken;
    oc_status_t status = OC_E_FORMAT;
    if (packet->type == OC_PACKET_OVERHEAD) {
        status = oc_packet_encode_overhead(packet, &body.overhead, out, sizeof out, &n_out);
    } else if (packet->type == OC_PACKET_ANNOUNCE) {
        status = oc_packet_encode_announce(packet, &body.announce, out, sizeof out, &n_out);
    } else if (packet->type == OC_PACKET_STATUS) {
        status = oc_packet_encode_status(packet, &body.status, out, sizeof out, &n_out);
    } else if (packet->type == OC_PACKET_RESEND_REQUEST) {
        status = oc_packet_encode_resend(packet, &body.resend, out, sizeof out, &n_out);
    } else if (packet->type == OC_PACKET_RECALL_REQUEST) {
        status = oc_packet_encode_recall(packet, &body.recall, out, sizeof out, &n_out);
    } else if (packet->type == OC_PACKET_TEXTURE) {
        status = oc_packet_encode_texture(packet, &body.texture, out, sizeof out, &n_out);
    } else if (packet->type == OC_PACKET_SILHOUETTE) {
        status =
            oc_packet_encode_silhouette(packet, &body.silhouette.head, body.silhouette.labels, out, sizeof out, &n_out);
    } else if (packet->type == OC_PACKET_SILHOUETTE_REQUEST) {
        status = oc_packet_encode_silhouette_request(packet, &body.silhouette_request, out, sizeof out, &n_out, &taken);
        REQUIRE("I13", taken == body.silhouette_request.key);
    } else if (packet->type == OC_PACKET_IMAGE) {
        status = oc_packet_encode_image(packet, &body.image, out, sizeof out, &n_out, &taken);
        /* Margins alike may come as one or as three. */
        REQUIRE("I12", status == OC_OK && taken == body.image.n_bytes);
        return;
    }
    REQUIRE("I12", status == OC_OK && n_out == n_bytes && memcmp(out, buf, n_bytes) == 0);
}

static void check_body(const oc_packet_head_t *packet, const uint8_t *buf, size_t n_bytes)
{
    switch (packet->type) {
    case OC_PACKET_VIEW:
        check_view(&body.view);
        same_view_again(packet, &body.view);
        return;
    case OC_PACKET_PATCH: check_patch(&body.patch); return;
    case OC_PACKET_RELABEL:
        check_relabel(&body.relabel);
        REQUIRE("I12", oc_packet_encode_relabel(packet, &body.relabel, out, sizeof out, &n_out) == OC_OK);
        REQUIRE("I12", oc_packet_decode_relabel(out, n_out, &again.relabel) == OC_OK);
        REQUIRE("I12", memcmp(&again.relabel, &body.relabel, sizeof again.relabel) == 0);
        return;
    case OC_PACKET_PATCH_REQUEST:
        check_blocks(body.patch_request.quality, body.patch_request.blocks, body.patch_request.n_blocks);
        same_patch_request_again(packet, &body.patch_request);
        return;
    case OC_PACKET_OVERHEAD_REQUEST:
        check_scale(body.overhead_request.metres_per_pixel, body.overhead_request.tile_px);
        REQUIRE("I10", body.overhead_request.n_tiles >= 1 && body.overhead_request.n_tiles <= OC_MAX_REQUEST_TILES);
        same_overhead_request_again(packet, &body.overhead_request);
        return;
    case OC_PACKET_OVERHEAD:
        check_scale(body.overhead.metres_per_pixel, body.overhead.tile_px);
        check_bytes(body.overhead.bytes, body.overhead.n_bytes, buf, n_bytes);
        break;
    case OC_PACKET_IMAGE: check_image(&body.image, buf, n_bytes); break;
    case OC_PACKET_SILHOUETTE: check_silhouette(&body.silhouette); break;
    case OC_PACKET_SILHOUETTE_REQUEST: check_silhouette_request(&body.silhouette_request); break;
    case OC_PACKET_TEXTURE:
        REQUIRE("I14", body.texture.tile_px >= 16 && body.texture.tile_px <= 128);
        check_bytes(body.texture.bytes, body.texture.n_bytes, buf, n_bytes);
        break;
    case OC_PACKET_TEXTURE_REQUEST: check_texture_request(packet, &body.texture_request); return;
    default: break;
    }
    same_bytes_again(packet, buf, n_bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static uint8_t buf[OC_MAX_DATAGRAM_BYTES];
    oc_packet_head_t head;
    if (oc_packet_decode_head(data, size, &head) == OC_OK) REQUIRE("I1", size >= 6 && size <= OC_MAX_DATAGRAM_BYTES);
    if (size > sizeof buf - 2u) return 0;

    if (size > 0) memcpy(buf, data, size);
    const uint16_t crc = oc_packet_crc(buf, size);
    buf[size] = (uint8_t)(crc >> 8);
    buf[size + 1u] = (uint8_t)(crc & 0xffu);
    /* An exact copy, so that the sanitizer sees a read past its end. */
    uint8_t *exact = malloc(size + 2u);
    if (!exact) return 0;
    memcpy(exact, buf, size + 2u);
    if (oc_packet_decode_head(exact, size + 2u, &head) == OC_OK) {
        REQUIRE("I1", exact[0] >> 5 == OC_WIRE_VERSION && size >= 4);
        if (any_decode_as(head.type, exact, size + 2u, &body) == OC_OK) check_body(&head, exact, size + 2u);
    }
    free(exact);
    return 0;
}
