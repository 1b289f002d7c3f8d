/* SPDX-License-Identifier: BSD-3-Clause
 * Ground tiles of a stored view: the view warped to the map by the base's planar perspective matrix. */
#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "core/plane.h"
#include "vehicle/vehicle_internal.h"

#define GREY 128u

#define MIN_TILE_PX 16u
#define MAX_TILE_PX 256u

/* Samples along one side of a tile pixel, at most. */
#define MAX_SAMPLES 4

static bool tile_request_is_valid(const oc_overhead_request_t *request, const oc_image_mut_t *out)
{
    const uint32_t n = request->tile_px;
    if (n < MIN_TILE_PX || n > MAX_TILE_PX) return false;
    if (!out->px || out->width_px != n || out->height_px != n) return false;
    if (out->channels != 1 && out->channels != 3) return false;
    if (out->stride_bytes < n * out->channels) return false;
    if (!(request->metres_per_pixel > 0.0 && request->metres_per_pixel <= 1000.0)) return false;
    for (int i = 0; i < 9; i++) {
        if (!isfinite(request->image_from_ground[i])) return false;
    }
    return true;
}

/* Which sign the third coordinate of image_from_ground has in front of the
 * camera: that of a pixel far below the horizon of the stored camera. 0 when
 * the camera sees no ground. */
static double front_sign(const stored_view_t *view, const double image_from_ground[9])
{
    double ground_from_image[9], best = 0.0, sign = 0.0;
    if (oc_plane_ground_from_image(&view->head.camera, ground_from_image) != OC_OK) return 0.0;
    for (int corner = 0; corner < 4; corner++) {
        const double x = (corner & 1) ? view->grey.width_px - 1.0 : 0.0;
        const double y = (corner & 2) ? view->grey.height_px - 1.0 : 0.0;
        const double *g = ground_from_image;
        const double inverse_depth = g[6] * x + g[7] * y + g[8];
        double gx, gy, u, v;
        if (!(inverse_depth > best) || oc_plane_ground_point(g, x, y, &gx, &gy) != OC_OK) continue;
        const double w = oc_homography_apply(image_from_ground, gx, gy, &u, &v);
        best = inverse_depth;
        sign = w > 0.0 ? 1.0 : (w < 0.0 ? -1.0 : 0.0);
    }
    return sign;
}

/* Adds a bilinear sample to sum; false outside the image. */
static bool sample_add(const oc_image_t *image, double x, double y, float sum[3])
{
    if (!(x >= 0.0 && y >= 0.0 && x < image->width_px - 1.0 && y < image->height_px - 1.0)) return false;
    const uint32_t ix = (uint32_t)x, iy = (uint32_t)y;
    const float ax = (float)(x - ix), ay = (float)(y - iy);
    const uint32_t n = image->channels;
    const uint8_t *p = image->px + (size_t)iy * image->stride_bytes + (size_t)ix * n;
    const uint8_t *q = p + image->stride_bytes;
    for (uint32_t c = 0; c < n; c++) {
        const float top = (float)p[c] + ax * (float)(p[c + n] - p[c]);
        const float low = (float)q[c] + ax * (float)(q[c + n] - q[c]);
        sum[c] += top + ay * (low - top);
    }
    return true;
}

/* Samples along a side so that they are about a pixel of the image apart. */
static int samples_needed(const double H[9], double x_m, double y_m, double pixel_m)
{
    double J[4];
    if (oc_homography_jacobian(H, x_m, y_m, J) != OC_OK) return 1;
    const double step_px = pixel_m * fmax(hypot(J[0], J[2]), hypot(J[1], J[3]));
    if (!(step_px > 1.0)) return 1;
    return step_px >= MAX_SAMPLES ? MAX_SAMPLES : (int)ceil(step_px);
}

typedef struct tile_source {
    const oc_image_t *image;
    const double *H;
    double sign;
    double pixel_m;
} tile_source_t;

/* Mean colour of one tile pixel with its centre at (x, y); false when that centre is not seen. */
static bool pixel_read(const tile_source_t *s, double x_m, double y_m, float mean[3])
{
    double u, v;
    if (!(s->sign * oc_homography_apply(s->H, x_m, y_m, &u, &v) > 0.0)) return false;
    float centre[3] = {0.0f, 0.0f, 0.0f};
    if (!sample_add(s->image, u, v, centre)) return false;
    const int n = samples_needed(s->H, x_m, y_m, s->pixel_m);
    memcpy(mean, centre, sizeof centre);
    if (n == 1) return true;

    float sum[3] = {0.0f, 0.0f, 0.0f};
    int n_inside = 0;
    for (int r = 0; r < n; r++) {
        for (int c = 0; c < n; c++) {
            const double dx = ((c + 0.5) / n - 0.5) * s->pixel_m, dy = ((r + 0.5) / n - 0.5) * s->pixel_m;
            if (!(s->sign * oc_homography_apply(s->H, x_m + dx, y_m + dy, &u, &v) > 0.0)) continue;
            n_inside += sample_add(s->image, u, v, sum);
        }
    }
    if (n_inside == 0) return true;
    for (int c = 0; c < 3; c++) mean[c] = sum[c] / (float)n_inside;
    return true;
}

/* Colour as stored into grey or colour as asked for. */
static void pixel_write(const float mean[3], uint32_t channels_in, uint32_t channels_out, uint8_t *px)
{
    uint8_t value[3];
    for (uint32_t c = 0; c < 3; c++) value[c] = (uint8_t)(mean[c < channels_in ? c : 0] + 0.5f);
    if (channels_out == 3) {
        memcpy(px, value, 3);
    } else if (channels_in == 3) {
        px[0] = (uint8_t)((77u * value[0] + 150u * value[1] + 29u * value[2] + 128u) / 256u);
    } else {
        px[0] = value[0];
    }
}

oc_status_t oc_vehicle_tile(const oc_vehicle_t *vehicle, const oc_overhead_request_t *request, oc_tile_id_t tile,
                            oc_image_mut_t *out, uint32_t *n_seen)
{
    OC_ASSERT(vehicle && request && out && n_seen);

    const stored_view_t *view = oc_vehicle_find(vehicle, request->view);
    if (!view) return OC_E_STATE;
    if (!tile_request_is_valid(request, out)) return OC_E_ARG;

    const tile_source_t source = {.image = view->colour.channels == 3 ? &view->colour : &view->grey,
                                  .H = request->image_from_ground,
                                  .sign = front_sign(view, request->image_from_ground),
                                  .pixel_m = request->metres_per_pixel};
    const uint32_t n = request->tile_px;
    uint32_t seen = 0;
    for (uint32_t r = 0; r < n; r++) {
        uint8_t *row = out->px + (size_t)r * out->stride_bytes;
        const double y_m = (((double)tile.iy + 1.0) * n - r - 0.5) * source.pixel_m;
        for (uint32_t c = 0; c < n; c++) {
            const double x_m = ((double)tile.ix * n + c + 0.5) * source.pixel_m;
            float mean[3] = {0.0f, 0.0f, 0.0f};
            if (pixel_read(&source, x_m, y_m, mean)) {
                seen++;
                pixel_write(mean, source.image->channels, out->channels, row + (size_t)c * out->channels);
            } else {
                memset(row + (size_t)c * out->channels, (int)GREY, out->channels);
            }
        }
    }
    *n_seen = seen;
    return OC_OK;
}
