/* SPDX-License-Identifier: BSD-3-Clause
 * The kernels for x86 with AVX2; compiled with -mavx2, called only where the processor has it. */
#define OC_KERNELS_TABLE oc_kernels_avx2
#define OC_KERNELS_LEVEL OC_SIMD_AVX2
#include "vehicle/kernels_body.h"
