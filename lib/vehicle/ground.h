/* SPDX-License-Identifier: BSD-3-Clause
 * Ground filter: which junctions of two views lie on the plane Z = 0 (thesis chapter 4).
 *
 *   poses -> ground homography H_g and its covariance window
 *   -> junction pairs by anchored correlation, both ways   (first pass)
 *   -> RANSAC homography, checked against the margins, refitted with the poses as prior
 *   -> pairs where the refined homography puts them        (second pass)
 *   -> each junction's own picture looked up in the other view, the pair fitted to
 *      what was found, and what was found weighed: evidence for or against the ground
 *
 * The errors are not symmetric: an obstacle's junction called ground is lost to
 * the base, a ground junction called unknown costs four bytes. So ground needs
 * clear evidence; the rest stays open. docs/design.md, section 4.5. */
#ifndef OUTCROP_VEHICLE_GROUND_H
#define OUTCROP_VEHICLE_GROUND_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/camera.h"
#include "core/image.h"
#include "core/junction.h"
#include "core/packet.h"
#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Stored views one new view is compared with. */
#define OC_MAX_GROUND_REFERENCES 6u

/* Cells of an image that overlap is counted in. */
#define OC_GROUND_CELLS 80u

/* Side of the correlation window. */
#define OC_MAX_GROUND_WINDOW_PX 31u

/* Tunables. Start from oc_ground_defaults() and change what you must. */
typedef struct oc_ground_params {
    uint32_t window_px;      /* N of the N x N window, odd, 7..OC_MAX_GROUND_WINDOW_PX; default 17 */
    float t_g;               /* least correlation of a first-pass match, 0.3..1; default 0.7 */
    float t_g_second;        /* least correlation of a second-pass match, 0.3..1; default 0.85 */
    float t_ground;          /* least evidence of a ground junction, nats, 0.5..10; default 2.5, 12 to 1 */
    float t_obstacle;        /* least evidence against the ground of an obstacle's junction, 0.1..10; default 1 */
    float t_transfer_px;     /* t_H: symmetric transfer error of an inlier, 0.5..10; default 2 */
    double t_h_m;            /* a height that counts as ground, metres, > 0..10; default 0.02 */
    double window_chi2;      /* squared Mahalanobis radius of the first window, 1..50; default 9.21 = 99 % */
    double sigma_px;         /* error of a junction's position, 0.05..5; default 0.7 */
    uint32_t ransac_rounds;  /* at most, 10..5000; default 500 */
    uint32_t min_inliers;    /* a homography with fewer is not believed, 6..1000; default 10 */
    uint32_t max_references; /* stored views per new view, 1..OC_MAX_GROUND_REFERENCES; default 6 */
    uint32_t max_ties;       /* per reference view, 0..OC_MAX_TIES; default 24 */
} oc_ground_params_t;

/* One view as the filter sees it; everything borrowed for the call. */
typedef struct oc_ground_view {
    uint16_t view; /* id; seeds the RANSAC, so that a pair always gives the same answer */
    oc_image_t grey;
    oc_camera_t camera;
    oc_margin_t margin;
    const oc_junction_t *junctions; /* [n_junctions], at most OC_MAX_JUNCTIONS */
    uint32_t n_junctions;
} oc_ground_view_t;

/* What the views compared so far say about one junction: evidence, in 1/256 nat, saturating. */
typedef struct oc_ground_votes {
    uint16_t best, sum; /* for the ground: of the view that says so most clearly; of all that say so */
    uint16_t against;   /* of all that say no */
} oc_ground_votes_t;

/* A pair of junctions on the ground. */
typedef struct oc_ground_match {
    uint16_t left, right; /* junction indices in view and reference */
    float ncc;
} oc_ground_match_t;

/* What one pair of views gave. */
typedef struct oc_ground_result {
    bool is_refined;         /* a homography was found and believed; otherwise no votes were cast */
    uint32_t n_candidates;   /* pairs inside the first window */
    uint32_t n_matches;      /* first-pass matches */
    uint32_t n_inliers;      /* of the refined homography */
    double ref_from_view[9]; /* refined ground homography, h33 = 1 where possible */
    double rms_px;           /* transfer error of the inliers */
} oc_ground_result_t;

/* Two pixels that show the same place if it is on the ground. */
typedef struct oc_ground_pin {
    float x_px, y_px, x2_px, y2_px; /* view, reference */
    float variance_px2;             /* of the reference pixel, each axis */
} oc_ground_pin_t;

/* What was seen where the ground would be. */
typedef struct oc_ground_look {
    bool is_done, is_lost; /* looked at; nothing found there */
    float ncc, worst_block;
    float mid_px[2], found_px[2]; /* middle of the window, and where it was found in the other view */
    float cov_px2[3];             /* of that, from the pictures alone: xx, xy, yy */
} oc_ground_look_t;

/* Scratch for oc_ground_match_views and its answers; about 100 kB. Placed by the caller. */
typedef struct oc_ground_ws {
    oc_ground_match_t matches[OC_MAX_JUNCTIONS]; /* first pass, then the final pairs */
    uint32_t n_matches;
    oc_ground_pin_t pins[OC_MAX_JUNCTIONS]; /* what the homography is fitted to */
    uint32_t n_pins;
    oc_ground_look_t looks[OC_MAX_JUNCTIONS]; /* from the view's junctions to the reference */
    uint8_t is_inlier[OC_MAX_JUNCTIONS];      /* of pins */
    uint16_t best_right[OC_MAX_JUNCTIONS], best_left[OC_MAX_JUNCTIONS];
    float ncc_right[OC_MAX_JUNCTIONS], ncc_left[OC_MAX_JUNCTIONS];
    uint8_t view_ground[OC_MAX_JUNCTIONS], ref_ground[OC_MAX_JUNCTIONS];
    float design[OC_MAX_JUNCTIONS * 4]; /* positions of the pins, scaled */
} oc_ground_ws_t;

oc_ground_params_t oc_ground_defaults(void);

/* Every field in its range. */
bool oc_ground_params_are_valid(const oc_ground_params_t *params);

/* How well a stored view can serve as reference, from the poses alone: share
 * of this view's ground pixels that the other sees, weighted by the angle
 * between the rays (best from 8 to 40 degrees). 0 = useless, 1 = all of it.
 * worth: the same for each cell of the view's image, row by row. 20 us. */
double oc_ground_overlap(const oc_camera_t *view, const oc_camera_t *reference, float worth[OC_GROUND_CELLS]);

/* Compare a view with a reference and add to the votes of both.
 *
 * votes, ref_votes  [n_junctions of the view], [n_junctions of the reference];
 *                   added to, never reset. Untouched unless result->is_refined.
 * result            what was found; ws->matches[0 .. ws->n_matches) are then the
 *                   ground matches, best correlation first
 *
 * OC_E_ARG for images that are not valid, not grey, not of the cameras' size, a
 * margin that is negative or not a number, OC_E_LIMIT for too many junctions,
 * OC_E_DEGENERATE when a camera centre lies on the ground. Two views that share
 * nothing are OC_OK without refinement.
 *
 * O(candidates * window^2 + junctions * window^2 * search^2); 8..13 ms for 2 x 300 junctions. Stack below 24 kB. */
OC_CHECKED oc_status_t oc_ground_match_views(oc_ground_ws_t *ws, const oc_ground_params_t *params,
                                             const oc_ground_view_t *view, const oc_ground_view_t *reference,
                                             oc_ground_votes_t votes[], oc_ground_votes_t ref_votes[],
                                             oc_ground_result_t *result);

/* Count what one view says: l is its log-likelihood ratio of ground against the rest, nats; not a number counts as 0. */
void oc_ground_vote(oc_ground_votes_t *votes, double l);

/* Evidence for the ground that votes amount to, nats. Not their sum: views are
 * not independent. What looks like ground and is not, the foot of an obstacle,
 * looks so from everywhere; what hides a ground junction hides it from several views. */
double oc_ground_evidence(const oc_ground_votes_t *votes);

/* Label that votes amount to, and the probability that it is right, 0..255 for
 * 0..1 when ground and the rest are equally frequent. Unknown: confidence 0. */
void oc_ground_decide(const oc_ground_params_t *params, const oc_ground_votes_t *votes, uint8_t *label,
                      uint8_t *confidence);

/* Pick at most params->max_ties of ws->matches, best first but spread over the
 * image, and write them as ties. Returns their number. */
uint32_t oc_ground_pick_ties(const oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                             const oc_ground_view_t *reference, oc_tie_t ties[], uint32_t cap);

#ifdef __cplusplus
}
#endif
#endif
