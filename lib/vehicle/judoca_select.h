/* SPDX-License-Identifier: BSD-3-Clause
 * Which of the junctions found the detector reports. */
#ifndef OUTCROP_VEHICLE_JUDOCA_SELECT_H
#define OUTCROP_VEHICLE_JUDOCA_SELECT_H

#include "vehicle/judoca.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Squares of the owner map, in which junctions near to each other are met. */
size_t oc_judoca_owner_squares(uint32_t width_px, uint32_t height_px);

/* Find corners and add them to ws->found. One that is the same point as a
 * junction, within a pixel, is not added: the junction takes its score if that
 * is better, so that a point that is a junction in one view and a corner in the
 * next has the same rank in both. Of other neighbours the better stays, as
 * among junctions (oc_judoca_select). Sets stats.n_corners. */
void oc_judoca_add_corners(oc_judoca_ws_t *ws);

/* Of the stats.n_found junctions in ws->found drop those nearer than
 * min_distance_px to a better one, share a limit that binds over the cells of
 * the image, and write the rest to out, best score first. Returns how many;
 * updates stats.n_found and stats.n_dropped. */
uint32_t oc_judoca_select(oc_judoca_ws_t *ws, oc_junction_t out[], uint32_t cap);

#ifdef __cplusplus
}
#endif
#endif
