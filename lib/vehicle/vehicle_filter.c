/* SPDX-License-Identifier: BSD-3-Clause
 * The ground filter of a new view against the stored ones. */
#include <string.h>

#include "vehicle/vehicle_internal.h"

/* Views that share less are not worth the time. */
#define MIN_OVERLAP 0.05

/* Stored views that references are chosen from. */
#define MAX_CANDIDATES 16u

/* How much less a cell needs another view when one has it well in sight. */
#define COVERED_SHARE 0.6f

static oc_ground_view_t ground_view_of(const stored_view_t *view)
{
    return (oc_ground_view_t){.view = view->head.view,
                              .grey = view->grey,
                              .camera = view->head.camera,
                              .margin = view->head.margin,
                              .junctions = view->junctions,
                              .n_junctions = view->n_junctions};
}

/* A stored view that may become a reference. */
typedef struct candidate {
    stored_view_t *view;
    double overlap;
    uint8_t worth[OC_GROUND_CELLS]; /* 0..255 for 0..1; sixteen of these are on the stack */
} candidate_t;

/* The stored views of greatest overlap, best first; the newer one of equals. */
static uint32_t candidates_find(const oc_vehicle_t *vehicle, const stored_view_t *fresh,
                                candidate_t candidates[MAX_CANDIDATES])
{
    uint32_t n = 0;
    for (uint32_t age = 0; age < vehicle->n_stored; age++) {
        candidate_t next = {.view = oc_vehicle_by_age(vehicle, age)};
        if (next.view == fresh || next.view->n_junctions == 0) continue;
        float worth[OC_GROUND_CELLS];
        next.overlap = oc_ground_overlap(&fresh->head.camera, &next.view->head.camera, worth);
        if (!(next.overlap >= MIN_OVERLAP)) continue;
        for (uint32_t k = 0; k < OC_GROUND_CELLS; k++) next.worth[k] = (uint8_t)(255.0f * worth[k] + 0.5f);
        if (n == MAX_CANDIDATES && next.overlap <= candidates[n - 1].overlap) continue;
        if (n < MAX_CANDIDATES) n++;
        uint32_t at = n - 1;
        for (; at > 0 && candidates[at - 1].overlap < next.overlap; at--) candidates[at] = candidates[at - 1];
        candidates[at] = next;
    }
    return n;
}

/* What a candidate adds to the cells as far as others have not covered them. */
static double candidate_gain(const candidate_t *candidate, const float open[OC_GROUND_CELLS])
{
    double gain = 0.0;
    for (uint32_t k = 0; k < OC_GROUND_CELLS; k++) gain += (double)((float)candidate->worth[k] * open[k]);
    return gain;
}

/* The stored views that judge this one: one after the other the one that adds
 * most, so that every corner of the image gets its share of them. */
static uint32_t references_choose(const oc_vehicle_t *vehicle, const stored_view_t *fresh,
                                  stored_view_t *chosen[OC_MAX_GROUND_REFERENCES])
{
    candidate_t candidates[MAX_CANDIDATES];
    const uint32_t n_candidates = candidates_find(vehicle, fresh, candidates);
    float open[OC_GROUND_CELLS];
    for (uint32_t k = 0; k < OC_GROUND_CELLS; k++) open[k] = 1.0f;
    uint32_t n = 0;
    while (n < vehicle->config.ground.max_references && n < n_candidates) {
        uint32_t best = 0;
        double best_gain = -1.0;
        for (uint32_t c = 0; c < n_candidates; c++) {
            const double gain = candidates[c].view ? candidate_gain(&candidates[c], open) : -1.0;
            if (gain <= best_gain) continue;
            best = c;
            best_gain = gain;
        }
        chosen[n++] = candidates[best].view;
        candidates[best].view = NULL;
        for (uint32_t k = 0; k < OC_GROUND_CELLS; k++) {
            open[k] *= 1.0f - COVERED_SHARE / 255.0f * (float)candidates[best].worth[k];
        }
    }
    return n;
}

/* Labels that the votes now amount to. A ground junction that was never sent
 * stays ground: the base does without it, whatever is learnt later. */
static void labels_update(const oc_ground_params_t *params, stored_view_t *view)
{
    uint8_t is_sent[OC_MAX_JUNCTIONS] = {0};
    for (uint32_t k = 0; k < view->n_sent; k++) is_sent[view->transmitted[k]] = 1;
    for (uint32_t i = 0; i < view->n_junctions; i++) {
        oc_junction_t *junction = &view->junctions[i];
        if (junction->label == OC_LABEL_GROUND && !is_sent[i]) continue;
        oc_ground_decide(params, &view->votes[i], &junction->label, &junction->confidence);
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
    fresh->n_ties = fresh->n_sent = 0;
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
        labels_update(&vehicle->config.ground, reference[r]);
        relabels_note(reference[r], before);
    }
    labels_update(&vehicle->config.ground, fresh);
}
