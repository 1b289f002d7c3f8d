/* SPDX-License-Identifier: BSD-3-Clause
 * Table 6.1: what the other views say about one pixel.
 */
#include "core/silhouette.h"

#include "core/status.h"

oc_label_t oc_silhouette_vote(const oc_votes_t *votes)
{
    OC_ASSERT(votes);

    if (votes->n_obstacle == votes->n_ground) return OC_LABEL_UNKNOWN;
    return votes->n_obstacle > votes->n_ground ? OC_LABEL_OBSTACLE : OC_LABEL_GROUND;
}

oc_label_t oc_silhouette_vote_thesis(const oc_votes_t *votes)
{
    OC_ASSERT(votes);

    return votes->n_obstacle > votes->n_ground ? OC_LABEL_OBSTACLE : OC_LABEL_GROUND;
}
