/* SPDX-License-Identifier: BSD-3-Clause
 * Size of the voxel grid of a box.
 */
#ifndef OUTCROP_CORE_GRID_H
#define OUTCROP_CORE_GRID_H

#include <stdint.h>

#include "core/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Voxels one grid may have on a side. */
#define OC_MAX_GRID_SIDE 4096u

/* n[i] = ceil((max - min) / side), the counts of the thesis' section 7.9 (102 x
 * 71 x 95 and 82 x 67 x 54 for Table 7.4 at 2 mm). Lengths in any one unit.
 *
 * total  out, may be NULL
 *
 * OC_E_ARG unless all are finite, side > 0 and min < max on each axis;
 * OC_E_LIMIT over OC_MAX_GRID_SIDE. Nothing is written then. */
OC_CHECKED oc_status_t oc_grid_count(const double min[3], const double max[3], double side, uint32_t n[3],
                                     uint64_t *total);

#ifdef __cplusplus
}
#endif
#endif
