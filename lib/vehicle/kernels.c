/* SPDX-License-Identifier: BSD-3-Clause
 * Which kernels this processor runs. */
#include "vehicle/kernels.h"

#include "core/status.h"

const oc_kernels_t *oc_kernels_get(oc_simd_t level)
{
    OC_ASSERT(level <= OC_SIMD_AVX2);

    if (level == OC_SIMD_SCALAR) return &oc_kernels_scalar;
#if defined(__x86_64__)
    if (level != OC_SIMD_BASE && __builtin_cpu_supports("avx2")) return &oc_kernels_avx2;
#endif
    return &oc_kernels_base;
}
