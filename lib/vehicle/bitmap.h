/* SPDX-License-Identifier: BSD-3-Clause
 * One bit per pixel in columns of 64-bit words: the words of one column lie below each other, so that four rows are
 * one vector, and a zero border all round makes bounds tests needless. */
#ifndef OUTCROP_VEHICLE_BITMAP_H
#define OUTCROP_VEHICLE_BITMAP_H

#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Zero rows above and below; one zero column to each side. */
#define OC_BITMAP_BORDER 16u

static inline uint32_t oc_bitmap_columns(uint32_t width_px)
{
    return (width_px + 63u) / 64u;
}

/* Words from one column to the next: rows in steps of four, and the border. */
static inline uint32_t oc_bitmap_pitch(uint32_t height_px)
{
    return (height_px + 3u) / 4u * 4u + 2u * OC_BITMAP_BORDER;
}

static inline size_t oc_bitmap_words(uint32_t width_px, uint32_t height_px)
{
    return (size_t)(oc_bitmap_columns(width_px) + 2u) * oc_bitmap_pitch(height_px);
}

/* Index of the word that holds pixel (64 column .. 64 column + 63, y). */
static inline size_t oc_bitmap_at(uint32_t pitch, uint32_t column, uint32_t y)
{
    return (size_t)(column + 1u) * pitch + OC_BITMAP_BORDER + y;
}

#ifdef __cplusplus
}
#endif
#endif
