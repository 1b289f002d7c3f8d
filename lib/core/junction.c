/* SPDX-License-Identifier: BSD-3-Clause
 * What meets at a junction, from the directions of its branches. */
#include "core/junction.h"

#include <math.h>

#include "core/status.h"

#define PI 3.14159265f

/* 12 degrees. */
#define STRAIGHT_RAD 0.20943951f

bool oc_junction_is_straight(const oc_branch_t *a, const oc_branch_t *b)
{
    OC_ASSERT(a && b);
    const float turn_rad = fabsf(a->angle_rad - b->angle_rad);
    return fabsf(turn_rad - PI) <= STRAIGHT_RAD;
}

uint8_t oc_junction_straight_branches(const oc_branch_t branch[], unsigned n_branches)
{
    OC_ASSERT((branch || n_branches == 0) && n_branches <= OC_MAX_BRANCHES);
    unsigned straight = 0;
    for (unsigned i = 1; i < n_branches; i++) {
        for (unsigned j = 0; j < i; j++) {
            if (oc_junction_is_straight(&branch[i], &branch[j])) straight |= 1u << i | 1u << j;
        }
    }
    return (uint8_t)straight;
}

oc_junction_kind_t oc_junction_kind_of(const oc_branch_t branch[], unsigned n_branches)
{
    OC_ASSERT(branch || n_branches == 0);
    if (n_branches == 1) return OC_KIND_CORNER;
    if (n_branches == 2) return OC_KIND_L;
    if (n_branches == 4) return OC_KIND_X;
    if (n_branches != 3) return OC_KIND_OTHER;
    return oc_junction_straight_branches(branch, n_branches) ? OC_KIND_T : OC_KIND_Y;
}
