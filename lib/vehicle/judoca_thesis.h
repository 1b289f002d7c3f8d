/* SPDX-License-Identifier: BSD-3-Clause
 * The junction detector as thesis 3.3 words it, for comparison. */
#ifndef OUTCROP_VEHICLE_JUDOCA_THESIS_H
#define OUTCROP_VEHICLE_JUDOCA_THESIS_H

#include "vehicle/judoca.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Bytes that oc_judoca_thesis_init takes from the arena. */
size_t oc_judoca_thesis_size_bytes(uint32_t width_px, uint32_t height_px, const oc_judoca_params_t *params);

/* Tables and maps of this method into ws->thesis; ws->gradient and ws->params are set. */
OC_CHECKED oc_status_t oc_judoca_thesis_init(oc_judoca_ws_t *ws, oc_arena_t *arena);

/* Fill ws->found and stats.n_places, n_fitted, n_found from the edge maps: rays
 * of length lambda_px from every pixel of B to the B+ pixels of the circle,
 * joined by a path of B, strength = share of B+ within one pixel; the apex is
 * the pixel, the angles are those of the chords. Of a cluster of equal
 * strength the place nearest to its centre of mass stays (the thesis leaves
 * that open). */
void oc_judoca_thesis_find(oc_judoca_ws_t *ws);

#ifdef __cplusplus
}
#endif
#endif
