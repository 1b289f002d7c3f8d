/* SPDX-License-Identifier: BSD-3-Clause
 * What meets at a junction, from the directions of its branches. */
#include "core/junction.h"

#include <math.h>
#include <stdbool.h>

#include "core/status.h"

/* Rays that point away from each other within 12 degrees are one straight edge. */
static bool is_straight(float a_rad, float b_rad)
{
    const float pi = 3.14159265f;
    const float tolerance_rad = 0.20943951f;
    const float turn = fabsf(a_rad - b_rad);
    return fabsf(turn - pi) <= tolerance_rad;
}

oc_junction_kind_t oc_junction_kind_of(const oc_branch_t branch[], unsigned n_branches)
{
    OC_ASSERT(branch || n_branches == 0);
    if (n_branches == 1) return OC_KIND_CORNER;
    if (n_branches == 2) return OC_KIND_L;
    if (n_branches == 4) return OC_KIND_X;
    if (n_branches != 3) return OC_KIND_OTHER;

    const bool has_straight = is_straight(branch[0].angle_rad, branch[1].angle_rad) ||
                              is_straight(branch[0].angle_rad, branch[2].angle_rad) ||
                              is_straight(branch[1].angle_rad, branch[2].angle_rad);
    return has_straight ? OC_KIND_T : OC_KIND_Y;
}
