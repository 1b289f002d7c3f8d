/* SPDX-License-Identifier: BSD-3-Clause
 * Planes of the world and the homographies they induce.
 */
#include "core/plane.h"

#include <math.h>
#include <string.h>

#include "core/camera_matrix.h"
#include "core/epipolar.h"
#include "core/mat3.h"

/* ---- the ground ---- */

void oc_plane_image_from_ground(const oc_camera_t *camera, double image_from_ground[9])
{
    OC_ASSERT(camera && image_from_ground);

    double P[12];
    oc_camera_matrix(camera, P);
    for (int r = 0; r < 3; r++) {
        image_from_ground[3 * r] = P[4 * r];
        image_from_ground[3 * r + 1] = P[4 * r + 1];
        image_from_ground[3 * r + 2] = P[4 * r + 3];
    }
}

/* A ray C + depth v, v = M^-1 m, meets Z = 0 at depth -C_z / v_z, so
 * (X, Y, 1) / depth = (v_x - v_z C_x / C_z, v_y - v_z C_y / C_z, -v_z / C_z). */
oc_status_t oc_plane_ground_from_image(const oc_camera_t *camera, double ground_from_image[9])
{
    OC_ASSERT(camera && ground_from_image);

    double centre[3], ray[9];
    oc_pose_centre(&camera->pose, centre);
    if (!(fabs(centre[2]) > 1e-9 * oc_vec3_norm(centre))) return OC_E_DEGENERATE;

    oc_camera_M_inverse(camera, ray);
    for (int c = 0; c < 3; c++) {
        const double v_z = ray[6 + c];
        ground_from_image[c] = ray[c] - v_z * centre[0] / centre[2];
        ground_from_image[3 + c] = ray[3 + c] - v_z * centre[1] / centre[2];
        ground_from_image[6 + c] = -v_z / centre[2];
    }
    return OC_OK;
}

void oc_plane_horizon(const double ground_from_image[9], double line[3])
{
    OC_ASSERT(ground_from_image && line);

    memmove(line, ground_from_image + 6, 3 * sizeof line[0]);
}

bool oc_plane_is_ground(const double ground_from_image[9], double x_px, double y_px, double ground_x_px,
                        double ground_y_px)
{
    OC_ASSERT(ground_from_image);

    const double *l = ground_from_image + 6;
    const double here = l[0] * x_px + l[1] * y_px + l[2];
    const double there = l[0] * ground_x_px + l[1] * ground_y_px + l[2];
    return (here > 0.0 && there > 0.0) || (here < 0.0 && there < 0.0);
}

oc_status_t oc_plane_ground_point(const double ground_from_image[9], double x_px, double y_px, double *x_m, double *y_m)
{
    OC_ASSERT(ground_from_image && x_m && y_m);

    double x, y;
    if (!(oc_homography_apply(ground_from_image, x_px, y_px, &x, &y) > 0.0)) return OC_E_DEGENERATE;
    *x_m = x;
    *y_m = y;
    return OC_OK;
}

oc_status_t oc_plane_ground_homography(const oc_camera_t *left, const oc_camera_t *right, double H[9])
{
    OC_ASSERT(left && right && H);

    double ground_from_left[9], ground_from_right[9], right_from_ground[9];
    if (oc_plane_ground_from_image(left, ground_from_left) != OC_OK) return OC_E_DEGENERATE;
    if (oc_plane_ground_from_image(right, ground_from_right) != OC_OK) return OC_E_DEGENERATE;
    oc_plane_image_from_ground(right, right_from_ground);
    oc_mat3_mul(right_from_ground, ground_from_left, H);
    return OC_OK;
}

/* ---- any plane ---- */

/* n . C + d; writes whether it is too near to 0. */
static double plane_distance(const oc_plane_t *plane, const double centre[3], bool *is_zero)
{
    const double distance = oc_vec3_dot(plane->n, centre) + plane->d_m;
    *is_zero = !(fabs(distance) > 1e-9 * (oc_vec3_norm(centre) + fabs(plane->d_m)));
    return distance;
}

oc_status_t oc_plane_homography(const oc_camera_t *left, const oc_camera_t *right, const oc_plane_t *plane, double H[9],
                                bool *same_side)
{
    OC_ASSERT(left && right && plane && H);

    const double n2 = oc_vec3_dot(plane->n, plane->n);
    if (!(fabs(n2 - 1.0) <= 1e-6) || !isfinite(plane->d_m)) return OC_E_ARG;

    double left_centre[3], right_centre[3], base[3];
    bool left_in, right_in;
    oc_pose_centre(&left->pose, left_centre);
    oc_pose_centre(&right->pose, right_centre);
    const double left_distance = plane_distance(plane, left_centre, &left_in);
    const double right_distance = plane_distance(plane, right_centre, &right_in);
    if (left_in || right_in) return OC_E_DEGENERATE;

    double core[9], M_right[9], ray[9];
    oc_vec3_sub(left_centre, right_centre, base);
    oc_mat3_outer(base, plane->n, core);
    for (int i = 0; i < 9; i++) core[i] = (i % 4 == 0 ? 1.0 : 0.0) - core[i] / left_distance;
    oc_camera_M(right, M_right);
    oc_camera_M_inverse(left, ray);
    oc_mat3_mul(M_right, core, core);
    oc_mat3_mul(core, ray, H);
    if (same_side != NULL) *same_side = (left_distance > 0.0) == (right_distance > 0.0);
    return OC_OK;
}

/* ---- the plane of a junction ---- */

void oc_edge_line(const oc_edge2_t *edge, double line[3])
{
    OC_ASSERT(edge && line);

    const double s = sin(edge->angle_rad);
    const double c = cos(edge->angle_rad);
    line[0] = s;
    line[1] = -c;
    line[2] = edge->y_px * c - edge->x_px * s;
}

void oc_edge_prepare(const oc_camera_t *camera, const oc_edge2_t *edge, oc_edge3_t *out)
{
    OC_ASSERT(camera && edge && out);

    double line[3], M[9], ray[3];
    oc_edge_line(edge, line);
    oc_camera_M(camera, M);
    oc_mat3_mul_vec_t(M, line, out->n);
    oc_vec3_normalise(out->n);
    oc_camera_ray(camera, edge->x_px, edge->y_px, ray);
    /* The line is positive to the left of the branch as seen with y down, so
     * ray x n points the way the branch goes. */
    oc_vec3_cross(ray, out->n, out->along);
}

oc_status_t oc_edge_direction(const oc_edge3_t *left, const oc_edge3_t *right, oc_edge_direction_t *out)
{
    OC_ASSERT(left && right && out);

    double d[3];
    oc_vec3_cross(left->n, right->n, d);
    const double sine = oc_vec3_normalise(d);
    if (!(sine >= OC_EDGE_MIN_SINE)) return OC_E_DEGENERATE;

    if (oc_vec3_dot(d, left->along) < 0.0) {
        for (int i = 0; i < 3; i++) d[i] = -d[i];
    }
    memcpy(out->d, d, sizeof d);
    out->sine = sine;
    out->agrees = oc_vec3_dot(d, right->along) > 0.0;
    return OC_OK;
}

oc_status_t oc_plane_from_directions(const double d1[3], const double d2[3], const double point_m[3], oc_plane_t *plane)
{
    OC_ASSERT(d1 && d2 && point_m && plane);

    double n[3];
    oc_vec3_cross(d1, d2, n);
    const double lengths = oc_vec3_norm(d1) * oc_vec3_norm(d2);
    if (!(oc_vec3_normalise(n) > OC_EDGE_MIN_SINE * lengths)) return OC_E_DEGENERATE;
    memcpy(plane->n, n, sizeof n);
    plane->d_m = -oc_vec3_dot(n, point_m);
    return OC_OK;
}

oc_status_t oc_plane_from_junction(const oc_camera_t *left_camera, const oc_edge2_t left[2],
                                   const oc_camera_t *right_camera, const oc_edge2_t right[2], oc_plane_t *plane,
                                   double point_m[3])
{
    OC_ASSERT(left_camera && left && right_camera && right && plane);

    oc_midpoint_t mid;
    oc_status_t status =
        oc_epipolar_midpoint(left_camera, left[0].x_px, left[0].y_px, right_camera, right[0].x_px, right[0].y_px, &mid);
    if (status != OC_OK) return status;

    oc_edge_direction_t direction[2];
    for (int i = 0; i < 2; i++) {
        oc_edge3_t in_left, in_right;
        oc_edge_prepare(left_camera, &left[i], &in_left);
        oc_edge_prepare(right_camera, &right[i], &in_right);
        status = oc_edge_direction(&in_left, &in_right, &direction[i]);
        if (status != OC_OK) return status;
    }
    status = oc_plane_from_directions(direction[0].d, direction[1].d, mid.p_in_world, plane);
    if (status != OC_OK) return status;
    if (point_m != NULL) memcpy(point_m, mid.p_in_world, sizeof mid.p_in_world);
    return OC_OK;
}
