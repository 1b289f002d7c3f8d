/* SPDX-License-Identifier: BSD-3-Clause
 * Which places the junction detector fits, and which junctions it reports. */
#ifndef OUTCROP_VEHICLE_JUDOCA_SELECT_H
#define OUTCROP_VEHICLE_JUDOCA_SELECT_H

#include "vehicle/judoca.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Places with a prescore into ws->place, in reading order, at most
 * max_candidates: the best ones. radius > 0 keeps of each neighbourhood of
 * that half width only the middle of its strongest cluster. Fills
 * stats.n_places and stats.n_fitted. */
void oc_judoca_pick(oc_judoca_ws_t *ws, int32_t radius);

/* Of the stats.n_found junctions in ws->found drop those nearer than
 * min_distance_px to a better one, share a limit that binds over the cells of
 * the image, and write the rest to out, best score first. Returns how many;
 * updates stats.n_found and stats.n_dropped. Overwrites the prescore map. */
uint32_t oc_judoca_select(oc_judoca_ws_t *ws, oc_junction_t out[], uint32_t cap);

#ifdef __cplusplus
}
#endif
#endif
