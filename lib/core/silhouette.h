/* SPDX-License-Identifier: BSD-3-Clause
 * Table 6.1: what the other views say about one pixel.
 */
#ifndef OUTCROP_CORE_SILHOUETTE_H
#define OUTCROP_CORE_SILHOUETTE_H

#include <stdint.h>

#include "core/junction.h"

#ifdef __cplusplus
extern "C" {
#endif

/* How many other views see the pixel's ground point outside their image, as
 * different (obstacle), as the same (ground); the three sum to the views. */
typedef struct oc_votes {
    uint32_t n_out, n_obstacle, n_ground;
} oc_votes_t;

/* Obstacle when more views say obstacle, ground when more say ground; unknown
 * for a tie and when no view sees it (cases 4 and 1), which the thesis calls
 * ground and which then carves away real voxels. */
oc_label_t oc_silhouette_vote(const oc_votes_t *votes);

/* The thesis' rule: cases 1 and 4 are ground, so obstacle exactly when
 * n_obstacle > n_ground. */
oc_label_t oc_silhouette_vote_thesis(const oc_votes_t *votes);

#ifdef __cplusplus
}
#endif
#endif
