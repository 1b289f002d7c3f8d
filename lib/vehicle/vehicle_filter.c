/* SPDX-License-Identifier: BSD-3-Clause
 * The ground filter of a new view against the stored ones. */
#include <string.h>

#include "vehicle/vehicle_internal.h"

/* Views that share less are not worth the time. */
#define MIN_OVERLAP 0.05

static oc_ground_view_t ground_view_of(const stored_view_t *view)
{
    return (oc_ground_view_t){.view = view->head.view,
                              .grey = view->grey,
                              .camera = view->head.camera,
                              .margin = view->head.margin,
                              .junctions = view->junctions,
                              .n_junctions = view->n_junctions};
}

/* The stored views that can judge this one, best first; the newer one of equals. */
static uint32_t references_choose(const oc_vehicle_t *vehicle, const stored_view_t *fresh,
                                  stored_view_t *chosen[OC_MAX_GROUND_REFERENCES])
{
    double worth[OC_MAX_GROUND_REFERENCES];
    const uint32_t limit = vehicle->config.ground.max_references;
    uint32_t n = 0;
    for (uint32_t age = 0; age < vehicle->n_stored; age++) {
        stored_view_t *view = oc_vehicle_by_age(vehicle, age);
        if (view == fresh || view->n_junctions == 0) continue;
        const double overlap = oc_ground_overlap(&fresh->head.camera, &view->head.camera);
        if (!(overlap >= MIN_OVERLAP)) continue;
        if (n == limit && overlap <= worth[n - 1]) continue;
        if (n < limit) n++;
        uint32_t at = n - 1;
        for (; at > 0 && worth[at - 1] < overlap; at--) {
            worth[at] = worth[at - 1];
            chosen[at] = chosen[at - 1];
        }
        worth[at] = overlap;
        chosen[at] = view;
    }
    return n;
}

/* Labels that the votes now decide; only an open one may change. */
static void labels_update(stored_view_t *view)
{
    for (uint32_t i = 0; i < view->n_junctions; i++) {
        oc_junction_t *junction = &view->junctions[i];
        if (junction->label != OC_LABEL_UNKNOWN) continue;
        oc_ground_decide(&view->votes[i], &junction->label, &junction->confidence);
    }
}

/* Note which junctions that have been sent as unknown are decided now. */
static void relabels_note(stored_view_t *view, const uint8_t label_before[])
{
    for (uint32_t k = 0; k < view->n_sent; k++) {
        const uint16_t i = view->transmitted[k];
        if (view->junctions[i].label != label_before[i]) oc_vehicle_relabelled(view, k, k + 1);
    }
}

void oc_vehicle_filter(oc_vehicle_t *vehicle, stored_view_t *fresh)
{
    stored_view_t *reference[OC_MAX_GROUND_REFERENCES];
    const uint32_t n = references_choose(vehicle, fresh, reference);
    const oc_ground_view_t left = ground_view_of(fresh);
    fresh->n_ties = 0;
    for (uint32_t r = 0; r < n; r++) {
        const oc_ground_view_t right = ground_view_of(reference[r]);
        oc_ground_result_t result;
        const oc_status_t status = oc_ground_match_views(&vehicle->ground, &vehicle->config.ground, &left, &right,
                                                         fresh->votes, reference[r]->votes, &result);
        if (status != OC_OK || !result.is_refined) continue; /* nothing learnt from this pair */

        fresh->n_ties =
            (uint16_t)(fresh->n_ties + oc_ground_pick_ties(&vehicle->ground, &vehicle->config.ground, &left, &right,
                                                           fresh->ties + fresh->n_ties, OC_MAX_TIES - fresh->n_ties));
        uint8_t before[OC_MAX_JUNCTIONS];
        for (uint32_t i = 0; i < reference[r]->n_junctions; i++) before[i] = reference[r]->junctions[i].label;
        labels_update(reference[r]);
        relabels_note(reference[r], before);
    }
    labels_update(fresh);
}
