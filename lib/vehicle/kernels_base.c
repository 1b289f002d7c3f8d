/* SPDX-License-Identifier: BSD-3-Clause
 * The kernels for what every processor of the target has. */
#define OC_KERNELS_TABLE oc_kernels_base
#define OC_KERNELS_LEVEL OC_SIMD_BASE
#include "vehicle/kernels_body.h"
