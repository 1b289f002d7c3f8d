/* SPDX-License-Identifier: BSD-3-Clause
 * Gaussian derivative of a grey image, its magnitude, and the edge maps B and B+. */
#ifndef OUTCROP_VEHICLE_GRADIENT_H
#define OUTCROP_VEHICLE_GRADIENT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "core/image.h"
#include "core/status.h"
#include "vehicle/arena.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Derivatives and magnitudes are stored in units of 1/256 grey level per
 * pixel of the unit-gain derivative: a ramp of 1 grey level per px reads 256. */
#define OC_GRADIENT_ONE 256

#define OC_GRADIENT_MIN_SIGMA_PX 0.6f
#define OC_GRADIENT_MAX_SIGMA_PX 3.0f

/* Half width of the largest kernel. */
#define OC_GRADIENT_MAX_RADIUS 9

/* Bits of the edge map. */
#define OC_EDGE_THICK 1u /* B: magnitude >= t_b */
#define OC_EDGE_THIN 2u  /* B+: in B and a local maximum along the gradient */

/* Planes are row-major with pitch width_px, no padding. */
typedef struct oc_gradient {
    uint32_t width_px, height_px;
    int32_t radius;                              /* of the kernel in use, px */
    uint16_t kernel[OC_GRADIENT_MAX_RADIUS + 1]; /* centre outwards, all 2 r + 1 sum to 256 */
    int16_t *dx, *dy;                            /* OC_GRADIENT_ONE per grey level/px */
    uint16_t *magnitude;                         /* same unit */
    uint8_t *edge;                               /* OC_EDGE_* */
    uint16_t *row;                               /* scratch: filtered rows */
} oc_gradient_t;

/* Bytes that oc_gradient_init takes, padding included; 0 for sides outside
 * OC_MIN_IMAGE_SIDE..OC_MAX_IMAGE_SIDE. */
size_t oc_gradient_size_bytes(uint32_t width_px, uint32_t height_px);

/* Take the planes for images of this size and build the kernel.
 *
 * sigma_px in OC_GRADIENT_MIN_SIGMA_PX..OC_GRADIENT_MAX_SIGMA_PX, else
 * OC_E_ARG, as for a bad size; OC_E_SPACE when the arena is too small. */
OC_CHECKED oc_status_t oc_gradient_init(oc_gradient_t *gradient, oc_arena_t *arena, uint32_t width_px,
                                        uint32_t height_px, float sigma_px);

/* Fill dx, dy and magnitude (thesis 3.3 step 1).
 *
 * Separable Gaussian in 1/256 steps, then central differences; the border is
 * replicated. Integer only except for the square root, so the result does not
 * depend on the machine. OC_E_ARG unless grey is valid, has one channel and
 * the size given to init; nothing is written then. O(width * height * sigma). */
OC_CHECKED oc_status_t oc_gradient_compute(oc_gradient_t *gradient, const oc_image_t *grey);

/* Noise of one derivative component in grey levels per px: the median
 * magnitude / 1.1774, its value when the image holds nothing but Gaussian
 * noise. Texture raises it, by design. Call after oc_gradient_compute. */
float oc_gradient_noise(const oc_gradient_t *gradient);

/* Fill `edge` from the magnitude (thesis 3.3 step 2); t_b in grey levels per
 * px, clamped to what the planes can hold. Returns the number of B+ pixels.
 *
 * The outermost two pixels are in neither map. Of two equal neighbours the
 * first in reading order is the maximum. */
uint32_t oc_gradient_edges(oc_gradient_t *gradient, float t_b);

/* Sector 0..15 of a direction, 22.5 degrees each, sector 0 centred on +x and
 * growing towards +y (down); (0, 0) gives 0. */
uint32_t oc_gradient_sector(int32_t dx, int32_t dy);

#ifdef __cplusplus
}
#endif
#endif
