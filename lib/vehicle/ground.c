/* SPDX-License-Identifier: BSD-3-Clause
 * Ground filter: parameters, choice of references, votes and ties. */
#include "vehicle/ground.h"

#include <assert.h>
#include <math.h>
#include <string.h>

#include "core/mat3.h"
#include "core/plane.h"

#define RAD_PER_DEG 0.017453292519943295

/* Cells of the image that overlap is counted in. */
#define CELL_COLS 10u
#define CELL_ROWS 8u
static_assert(CELL_COLS * CELL_ROWS == OC_GROUND_CELLS, "one worth for each cell");

/* Cells of the image that ties are spread over. */
#define TIE_CELLS 8u

oc_ground_params_t oc_ground_defaults(void)
{
    return (oc_ground_params_t){.window_px = 17,
                                .t_g = 0.7f,
                                .t_g_second = 0.85f,
                                .t_ground = 2.5f,
                                .t_obstacle = 1.0f,
                                .t_transfer_px = 2.0f,
                                .t_h_m = 0.02,
                                .window_chi2 = 9.21,
                                .sigma_px = 0.7,
                                .ransac_rounds = 500,
                                .min_inliers = 10,
                                .max_references = 6,
                                .max_ties = 24};
}

bool oc_ground_params_are_valid(const oc_ground_params_t *params)
{
    OC_ASSERT(params);
    const oc_ground_params_t *p = params;
    return p->window_px >= 7 && p->window_px <= OC_MAX_GROUND_WINDOW_PX && p->window_px % 2u == 1u && p->t_g >= 0.3f &&
           p->t_g <= 1.0f && p->t_g_second >= 0.3f && p->t_g_second <= 1.0f && p->t_ground >= 0.5f &&
           p->t_ground <= 10.0f && p->t_obstacle >= 0.1f && p->t_obstacle <= 10.0f && p->t_transfer_px >= 0.5f &&
           p->t_transfer_px <= 10.0f && p->t_h_m > 0.0 && p->t_h_m <= 10.0 && p->window_chi2 >= 1.0 &&
           p->window_chi2 <= 50.0 && p->sigma_px >= 0.05 && p->sigma_px <= 5.0 && p->ransac_rounds >= 10 &&
           p->ransac_rounds <= 5000 && p->min_inliers >= 6 && p->min_inliers <= 1000 && p->max_references >= 1 &&
           p->max_references <= OC_MAX_GROUND_REFERENCES && p->max_ties <= OC_MAX_TIES;
}

/* ---- which views can judge each other ---- */

/* How well an angle between rays tells the ground from what stands on it, and
 * still leaves the same texture to see. */
static double parallax_weight(double angle_rad)
{
    const double deg = angle_rad / RAD_PER_DEG;
    if (deg <= 1.0 || deg >= 80.0) return 0.0;
    if (deg < 8.0) return (deg - 1.0) / 7.0;
    return deg <= 40.0 ? 1.0 : (80.0 - deg) / 40.0;
}

/* Worth of one ground point of the view: is it in the reference, at what angle
 * and scale. */
static double point_weight(const oc_camera_t *view, const oc_camera_t *reference, const double p[3])
{
    double x, y, ca[3], cb[3], a[3], b[3];
    const double depth = oc_camera_project(reference, p, &x, &y);
    if (!(depth > 0.0)) return 0.0;
    if (!(x >= 0.0 && y >= 0.0 && x <= reference->k.width_px - 1.0 && y <= reference->k.height_px - 1.0)) return 0.0;

    oc_pose_centre(&view->pose, ca);
    oc_pose_centre(&reference->pose, cb);
    oc_vec3_sub(p, ca, a);
    oc_vec3_sub(p, cb, b);
    const double near = oc_vec3_normalise(a), far = oc_vec3_normalise(b);
    const double scale = (near / view->k.fx_px) / (far / reference->k.fx_px);
    if (!(scale > 1.0 / 3.0 && scale < 3.0)) return 0.0;
    const double c = oc_vec3_dot(a, b);
    return parallax_weight(acos(c > 1.0 ? 1.0 : (c < -1.0 ? -1.0 : c)));
}

double oc_ground_overlap(const oc_camera_t *view, const oc_camera_t *reference, float worth[OC_GROUND_CELLS])
{
    OC_ASSERT(view && reference && worth);

    double ground_from_image[9];
    memset(worth, 0, OC_GROUND_CELLS * sizeof *worth);
    if (oc_plane_ground_from_image(view, ground_from_image) != OC_OK) return 0.0;
    double sum = 0.0;
    uint32_t n = 0;
    for (uint32_t k = 0; k < OC_GROUND_CELLS; k++) {
        const double x = (k % CELL_COLS + 0.5) / CELL_COLS * view->k.width_px;
        const double y = (k / CELL_COLS + 0.5) / CELL_ROWS * view->k.height_px; /* NOLINT(bugprone-integer-division) */
        double p[3] = {0.0, 0.0, 0.0};
        if (oc_plane_ground_point(ground_from_image, x, y, &p[0], &p[1]) != OC_OK) continue;
        const double w = point_weight(view, reference, p);
        worth[k] = (float)w;
        sum += w;
        n++;
    }
    return n == 0 ? 0.0 : sum / n;
}

/* ---- votes ---- */

#define UNITS_PER_NAT 256.0

/* The clearest view counts in full, each other one this much. */
#define OTHERS_SHARE 0.25

/* Views that do not see it count in full up to here, together, nats, and what
 * goes beyond counts this much: what hides a place from one view hides it from the next. */
#define FULL_AGAINST 2.5
#define MORE_AGAINST_SHARE 0.1

/* No view is surer than this, nats. */
#define MAX_FOR 7.0

static uint16_t units_add(uint16_t units, double nats)
{
    const uint32_t sum = units + (uint32_t)(nats * UNITS_PER_NAT + 0.5);
    return sum < UINT16_MAX ? (uint16_t)sum : UINT16_MAX;
}

void oc_ground_vote(oc_ground_votes_t *votes, double l)
{
    OC_ASSERT(votes);

    if (l > 0.0) {
        const double counted = l < MAX_FOR ? l : MAX_FOR;
        const uint16_t alone = units_add(0, counted);
        votes->sum = units_add(votes->sum, counted);
        if (alone > votes->best) votes->best = alone;
    } else if (l < 0.0) {
        votes->against = units_add(votes->against, l > -MAX_FOR ? -l : MAX_FOR);
    }
}

double oc_ground_evidence(const oc_ground_votes_t *votes)
{
    OC_ASSERT(votes);

    const double best = votes->best / UNITS_PER_NAT, others = (votes->sum - votes->best) / UNITS_PER_NAT;
    const double against = votes->against / UNITS_PER_NAT;
    const double more = against > FULL_AGAINST ? against - FULL_AGAINST : 0.0;
    return best + OTHERS_SHARE * others - (against - more) - MORE_AGAINST_SHARE * more;
}

void oc_ground_decide(const oc_ground_params_t *params, const oc_ground_votes_t *votes, uint8_t *label,
                      uint8_t *confidence)
{
    OC_ASSERT(params && votes && label && confidence);

    const double l = oc_ground_evidence(votes);
    *label = OC_LABEL_UNKNOWN;
    *confidence = 0;
    if (l >= (double)params->t_ground) *label = OC_LABEL_GROUND;
    if (l <= -(double)params->t_obstacle) *label = OC_LABEL_OBSTACLE;
    if (*label != OC_LABEL_UNKNOWN) *confidence = (uint8_t)(255.0 / (1.0 + exp(-fabs(l))) + 0.5);
}

/* ---- ties ---- */

uint32_t oc_ground_pick_ties(const oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                             const oc_ground_view_t *reference, oc_tie_t ties[], uint32_t cap)
{
    OC_ASSERT(ws && params && view && reference && (ties || cap == 0));

    const uint32_t limit = params->max_ties < cap ? params->max_ties : cap;
    uint8_t used[TIE_CELLS * TIE_CELLS] = {0};
    uint8_t is_taken[OC_MAX_JUNCTIONS] = {0};
    uint32_t n = 0;
    /* A cell may have its second tie only when every cell has had its first. */
    for (uint32_t turn = 1; n < limit && turn <= params->max_ties; turn++) {
        uint32_t n_before = n;
        for (uint32_t i = 0; n < limit && i < ws->n_matches; i++) {
            if (is_taken[i]) continue;
            const oc_junction_t *a = &view->junctions[ws->matches[i].left];
            const oc_junction_t *b = &reference->junctions[ws->matches[i].right];
            const uint32_t cx = (uint32_t)((double)a->x_px * TIE_CELLS / view->grey.width_px);
            const uint32_t cy = (uint32_t)((double)a->y_px * TIE_CELLS / view->grey.height_px);
            const uint32_t cell =
                (cy < TIE_CELLS ? cy : TIE_CELLS - 1) * TIE_CELLS + (cx < TIE_CELLS ? cx : TIE_CELLS - 1);
            if (used[cell] >= turn) continue;
            used[cell]++;
            is_taken[i] = 1;
            ties[n++] = (oc_tie_t){.ref_view = reference->view,
                                   .x_px = a->x_px,
                                   .y_px = a->y_px,
                                   .ref_x_px = b->x_px,
                                   .ref_y_px = b->y_px};
        }
        if (n == n_before) break;
    }
    return n;
}
