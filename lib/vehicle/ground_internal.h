/* SPDX-License-Identifier: BSD-3-Clause
 * Parts of the ground filter: the refined homography of a pair, and correlation under a homography. */
#ifndef OUTCROP_VEHICLE_GROUND_INTERNAL_H
#define OUTCROP_VEHICLE_GROUND_INTERNAL_H

#include "core/window.h"
#include "vehicle/ground.h"

#ifdef __cplusplus
extern "C" {
#endif

#define GROUND_PARAMS 12

/* A look-up seeks the junction's patch this far round its place; smoothing needs one more on each side. */
#define GROUND_SEARCH_PX 3
#define GROUND_MAX_WIDE_PX (OC_MAX_GROUND_WINDOW_PX + 2u * GROUND_SEARCH_PX + 2u)

/* ---- the pair's geometry (ground_ransac.c, ground_homography.c) ---- */

/* Two cameras moved inside their margins so that the ground matches agree. */
typedef struct ground_pair {
    oc_camera_t left, right;                  /* refined */
    double H[9], H_inv[9];                    /* ground homography of the refined cameras */
    double u[GROUND_PARAMS];                  /* moves, in standard deviations of the margins */
    double dH[GROUND_PARAMS][9];              /* of H, per unit of u */
    double cov[GROUND_PARAMS][GROUND_PARAMS]; /* of u after the fit */
} ground_pair_t;

/* What an error is worth to a homography's score; share = r^2 / r_max^2. 1 at 0, 0 from 1 on. */
double oc_ground_gain(double share);

/* Find the homography that most pins share and mark ws->is_inlier. Returns their number. */
uint32_t oc_ground_ransac(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                          const oc_ground_view_t *reference);

/* RANSAC over ws->pins, and the pair moved inside the margins to fit. False when
 * no homography has enough pins, or the poses would have to leave their margins for it. */
bool oc_ground_fit(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                   const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *result);

/* Fit the pair again, to the pins that ws has now. False, and pair and
 * result as they were, when too few of them agree. */
bool oc_ground_refit(oc_ground_ws_t *ws, const oc_ground_params_t *params, const oc_ground_view_t *view,
                     const oc_ground_view_t *reference, ground_pair_t *pair, oc_ground_result_t *result);

/* Covariance (xx, xy, yy) of a left pixel's transfer after the fit, right pixels. False when it is at infinity. */
bool oc_ground_transfer_covariance(const ground_pair_t *pair, double x_px, double y_px, double cov_px2[3]);

/* Move of the right pixel, px, when the point seen at a left pixel rises from the ground to
 * height z_m. OC_E_DEGENERATE when there is no such point in front of both. */
OC_CHECKED oc_status_t oc_ground_rise(const ground_pair_t *pair, double x_px, double y_px, double z_m,
                                      double rise_px[2]);

/* ---- correlation (ground_correlate.c) ---- */

/* Floats in a row of a patch, and of the wider window it is sought in: whole
 * lanes, zero behind the samples. */
#define GROUND_PATCH_STRIDE 32u
#define GROUND_WIDE_STRIDE 40u

/* A square window of n x n samples, n odd, of zero mean and unit length. */
typedef struct ground_patch {
    uint32_t n;
    float sd; /* before normalisation, grey levels */
    float v[OC_MAX_GROUND_WINDOW_PX * GROUND_PATCH_STRIDE];
} ground_patch_t;

/* How two pictures are compared. */
typedef struct ground_photo {
    double noise_sd; /* of both together, grey levels, after smoothing */
    bool is_smooth;  /* 3 x 3 binomial first: what blur, noise and codecs do to one picture only then matters less */
} ground_photo_t;

/* The image's own window round a pixel. False when it does not fit inside or is flat. */
bool oc_ground_patch_take(const oc_image_t *grey, const double at[2], uint32_t n, bool is_smooth,
                          ground_patch_t *patch);

/* Correlation of a patch, taken round `at`, with the image that H' leads to
 * from there, H' being H anchored to send `at` to `to` (thesis Eq 4.36-4.40). -1 when the
 * window is not wholly inside, or a quick look at every third sample is hopeless. */
float oc_ground_correlate(const ground_patch_t *patch, const double at[2], const oc_image_t *grey, const double H[9],
                          const double to[2]);

/* Where a patch is best found round the place H sends it to. */
typedef struct ground_lookup {
    bool is_inside;    /* the sought window was wholly inside */
    bool is_at_border; /* the peak is at the end of the search: no shift and no blocks */
    float ncc;         /* at the peak */
    float worst_block; /* agreement of the window's worst ninth with its own contrast, <= 1 */
    float shift_px[2]; /* peak from the expected place, pixels of the patch's own image, sub-pixel */
    float cov_px2[3];  /* of the shift, from the picture alone: xx, xy, yy */
} ground_lookup_t;

/* The patch must have been taken as photo says. The correlation is lifted to what it would be without noise. */
void oc_ground_look_up(const ground_patch_t *patch, const double at[2], const oc_image_t *grey, const double H[9],
                       const ground_photo_t *photo, ground_lookup_t *found);

/* Standard deviation of the noise of an image, grey levels, from its flatter parts. */
double oc_ground_noise_sd(const oc_image_t *grey);

/* ---- judging single junctions (ground_judge.c) ---- */

/* One direction of a refined pair. */
typedef struct sight {
    const oc_ground_view_t *from, *to;
    const ground_pair_t *pair;    /* from -> to */
    const ground_pair_t *forward; /* the pair as it was fitted */
    const double *H, *H_inv;      /* of pair */
    bool is_reverse;              /* forward's own left is `to` */
    ground_photo_t photo;
} sight_t;

/* Look for what is at a pixel of `from` where the ground would be in `to`. False,
 * and look->is_done false, when that cannot be done: outside, too oblique, place not known. */
bool oc_ground_look_at(const sight_t *s, const oc_ground_params_t *params, const double at[2], oc_ground_look_t *look);

/* What a look says, with the pair as it now stands: l, the log-likelihood ratio
 * of ground against the rest, natural logarithm; and where the window was found. False when it says nothing. */
bool oc_ground_weigh(const sight_t *s, const oc_ground_params_t *params, const double at[2],
                     const oc_ground_look_t *look, double *l, oc_ground_pin_t *pin);

#ifdef __cplusplus
}
#endif
#endif
