/* SPDX-License-Identifier: BSD-3-Clause
 * Size of the voxel grid of a box.
 */
#include "core/grid.h"

#include <math.h>
#include <string.h>

oc_status_t oc_grid_count(const double min[3], const double max[3], double side, uint32_t n[3], uint64_t *total)
{
    OC_ASSERT(min && max && n);

    if (!(side > 0.0) || !isfinite(side)) return OC_E_ARG;
    uint32_t count[3];
    uint64_t product = 1;
    for (int i = 0; i < 3; i++) {
        if (!isfinite(min[i]) || !isfinite(max[i]) || !(min[i] < max[i])) return OC_E_ARG;
    }
    for (int i = 0; i < 3; i++) {
        const double voxels = ceil((max[i] - min[i]) / side);
        if (!(voxels <= (double)OC_MAX_GRID_SIDE)) return OC_E_LIMIT;
        count[i] = (uint32_t)voxels;
        product *= count[i];
    }
    memcpy(n, count, sizeof count);
    if (total != NULL) *total = product;
    return OC_OK;
}
