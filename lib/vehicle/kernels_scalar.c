/* SPDX-License-Identifier: BSD-3-Clause
 * The kernels in plain C, compiled without vectors: what the others must equal. */
#define OC_KERNELS_SCALAR 1
#define OC_KERNELS_TABLE oc_kernels_scalar
#define OC_KERNELS_LEVEL OC_SIMD_SCALAR
#include "vehicle/kernels_body.h"
