/* SPDX-License-Identifier: BSD-3-Clause
 * Texture tiles of a stored view: its own pixels, at a coarser step, without the ground. */
#include <string.h>

#include "vehicle/vehicle_internal.h"

#define BLOCK_PX 8u
#define GREY 128u

static bool is_solid(const stored_view_t *view, uint32_t across, uint32_t x, uint32_t y)
{
    return view->solid[(size_t)(y / BLOCK_PX) * across + x / BLOCK_PX] != 0;
}

/* Sum of the solid pixels of one texture pixel; how many. */
static uint32_t cell_add(const stored_view_t *view, bool is_masked, uint32_t x0, uint32_t y0, uint32_t step,
                         uint32_t sum[3])
{
    const oc_image_t *image = view->colour.channels == 3 ? &view->colour : &view->grey;
    const uint32_t across = (image->width_px + BLOCK_PX - 1u) / BLOCK_PX;
    uint32_t n = 0;
    for (uint32_t y = y0; y < y0 + step && y < image->height_px; y++) {
        for (uint32_t x = x0; x < x0 + step && x < image->width_px; x++) {
            if (is_masked && !is_solid(view, across, x, y)) continue;
            const uint8_t *px = image->px + (size_t)y * image->stride_bytes + (size_t)x * image->channels;
            for (uint32_t c = 0; c < 3; c++) sum[c] += px[image->channels == 3 ? c : 0];
            n++;
        }
    }
    return n;
}

oc_status_t oc_vehicle_texture(const oc_vehicle_t *vehicle, const oc_texture_request_t *request, uint16_t tile,
                               oc_image_mut_t *out, uint32_t *n_solid)
{
    OC_ASSERT(vehicle && request && out && n_solid);

    const stored_view_t *view = oc_vehicle_find(vehicle, request->view);
    if (!view) return OC_E_STATE;
    const uint32_t side = request->tile_px, step = request->step_px;
    if (side == 0 || step == 0 || !out->px || out->width_px != side || out->height_px != side || out->channels != 3 ||
        out->stride_bytes < 3u * side)
        return OC_E_ARG;
    const uint32_t reach = side * step, across = (view->grey.width_px + reach - 1u) / reach;
    const uint32_t down = (view->grey.height_px + reach - 1u) / reach;
    if (tile >= across * down) return OC_E_ARG;

    const bool is_masked = request->is_masked && view->has_solid;
    const uint32_t x0 = tile % across * reach, y0 = tile / across * reach;
    uint32_t total[3] = {0, 0, 0}, n_total = 0;
    /* Twice: the flat rest has the mean colour of what shows, which costs a codec least. */
    for (int pass = 0; pass < 2; pass++) {
        for (uint32_t r = 0; r < side; r++) {
            uint8_t *row = out->px + (size_t)r * out->stride_bytes;
            for (uint32_t c = 0; c < side; c++) {
                uint32_t sum[3] = {0, 0, 0};
                const uint32_t n = cell_add(view, is_masked, x0 + c * step, y0 + r * step, step, sum);
                for (uint32_t k = 0; k < 3; k++) {
                    if (pass == 0) total[k] += sum[k];
                    if (pass == 1 && n > 0) row[3u * c + k] = (uint8_t)((sum[k] + n / 2u) / n);
                    if (pass == 1 && n == 0) row[3u * c + k] = (uint8_t)(n_total > 0 ? total[k] / n_total : GREY);
                }
                if (pass == 0) n_total += n;
            }
        }
    }
    *n_solid = n_total;
    return OC_OK;
}
