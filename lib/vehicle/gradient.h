/* SPDX-License-Identifier: BSD-3-Clause
 * Gaussian derivative of a grey image, and the edge maps B and B+. */
#ifndef OUTCROP_VEHICLE_GRADIENT_H
#define OUTCROP_VEHICLE_GRADIENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/image.h"
#include "core/status.h"
#include "vehicle/arena.h"
#include "vehicle/bitmap.h"
#include "vehicle/kernels.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Derivatives are stored in units of 1/256 grey level per pixel of the
 * unit-gain derivative: a ramp of 1 grey level per px reads 256. Magnitudes
 * stop at INT16_MAX, 128 grey levels per px. */
#define OC_GRADIENT_ONE 256

#define OC_GRADIENT_MIN_SIGMA_PX 0.6f
#define OC_GRADIENT_MAX_SIGMA_PX 3.0f

/* Planes and maps for images of one size. */
typedef struct oc_gradient {
    uint32_t width_px, height_px;
    int32_t radius;                              /* of the kernel in use, px */
    uint16_t kernel[OC_GRADIENT_MAX_RADIUS + 1]; /* centre outwards, all 2 r + 1 sum to 256 */
    const oc_kernels_t *kernels;
    int16_t *dxdy;   /* [height][width][2], OC_GRADIENT_ONE per grey level/px */
    uint32_t pitch;  /* words from column to column of the maps (bitmap.h) */
    uint64_t *thick; /* B: magnitude >= t_b */
    uint64_t *thin;  /* B+: in B and a local maximum along the gradient */
    uint32_t n_thin; /* pixels of B+ */
    int16_t *row;    /* scratch: rows on their way */
    uint64_t *word;  /* scratch: a row of B and one of B+ */
} oc_gradient_t;

/* Bytes that oc_gradient_init takes, padding included; 0 for sides outside
 * OC_MIN_IMAGE_SIDE..OC_MAX_IMAGE_SIDE. */
size_t oc_gradient_size_bytes(uint32_t width_px, uint32_t height_px);

/* Take the planes for images of this size and build the kernel.
 *
 * sigma_px in OC_GRADIENT_MIN_SIGMA_PX..OC_GRADIENT_MAX_SIGMA_PX, else
 * OC_E_ARG, as for a bad size; OC_E_SPACE when the arena is too small. */
OC_CHECKED oc_status_t oc_gradient_init(oc_gradient_t *gradient, oc_arena_t *arena, uint32_t width_px,
                                        uint32_t height_px, float sigma_px, oc_simd_t simd);

/* Fill derivatives and maps in one pass over the image (thesis 3.3 steps 1, 2).
 *
 * Separable Gaussian in 1/256 steps, then central differences; the border is
 * replicated. t_b in grey levels per px, clamped to what the planes can hold.
 * The outermost two pixels are in neither map. Of two equal neighbours the
 * first in reading order is the maximum. Integer only except for the square
 * root, so the result does not depend on the machine.
 *
 * OC_E_ARG unless grey is valid, has one channel and the size given to init;
 * nothing is written then. O(width * height * sigma). */
OC_CHECKED oc_status_t oc_gradient_compute(oc_gradient_t *gradient, const oc_image_t *grey, float t_b);

/* Noise of one derivative component in grey levels per px, from every
 * OC_GRADIENT_NOISE_STEP-th row: the median magnitude / 1.1774, its value when
 * the image holds nothing but Gaussian noise. Texture raises it, by design.
 * Leaves planes and maps as they were; OC_E_ARG as for oc_gradient_compute. */
OC_CHECKED oc_status_t oc_gradient_noise(oc_gradient_t *gradient, const oc_image_t *grey, float *noise);
#define OC_GRADIENT_NOISE_STEP 8u

#ifdef __cplusplus
}
#endif
#endif
