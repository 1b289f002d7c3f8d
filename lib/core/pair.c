/* SPDX-License-Identifier: BSD-3-Clause
 * Preparing a pair of views: its matrices and how they change with the poses.
 */
#include "core/pair.h"

#include <math.h>
#include <string.h>

#include "core/camera_matrix.h"
#include "core/epipolar.h"
#include "core/mat3.h"

/* Margins over this are no small errors of an angle. */
#define OC_PAIR_MAX_MARGIN_RAD 0.5

/* What oc_pair_t differentiates. */
typedef struct pair_matrices {
    double F[9], H[9], H_inf[9], B[9];
    double left_height_m;
} pair_matrices_t;

void oc_pair_move_camera(const oc_camera_t *camera, int i, double delta, oc_angle_error_t angles, oc_camera_t *moved)
{
    OC_ASSERT(camera && moved && i >= 0 && i < 6);

    oc_camera_t out = *camera;
    if (i >= 3 && angles == OC_ANGLE_ERROR_LOCAL) {
        double turn[3] = {0.0, 0.0, 0.0}, centre[3], R[9], small[9];
        turn[i - 3] = delta;
        oc_pose_centre(&camera->pose, centre);
        oc_cv_from_thesis(camera->pose.R, R);
        oc_thesis_from_opk(turn[0], turn[1], turn[2], small);
        oc_mat3_mul(small, R, R);
        oc_cv_from_thesis(R, R);
        oc_pose_from_centre(R, centre, &out.pose);
    } else {
        oc_pose6_t six;
        oc_pose_to_6(&camera->pose, &six);
        six.v[i] += delta;
        oc_pose_from_6(&six, &out.pose);
    }
    *moved = out;
}

static bool margin_is_valid(const oc_margin_t *margin)
{
    for (int i = 0; i < 6; i++) {
        if (!(margin->v[i] >= 0.0) || !isfinite(margin->v[i])) return false;
        if (i >= 3 && margin->v[i] > OC_PAIR_MAX_MARGIN_RAD) return false;
    }
    return true;
}

static bool camera_clears_ground(const oc_camera_t *camera, const oc_margin_t *margin)
{
    double centre[3];
    oc_pose_centre(&camera->pose, centre);
    return fabs(centre[2]) > margin->v[2] + 1e-9 * oc_vec3_norm(centre);
}

oc_status_t oc_pair_check(const oc_camera_t *left, const oc_margin_t *left_margin, const oc_camera_t *right,
                          const oc_margin_t *right_margin)
{
    OC_ASSERT(left && left_margin && right && right_margin);

    if (!oc_intrinsics_is_valid(&left->k) || !oc_pose_is_valid(&left->pose)) return OC_E_ARG;
    if (!oc_intrinsics_is_valid(&right->k) || !oc_pose_is_valid(&right->pose)) return OC_E_ARG;
    if (!margin_is_valid(left_margin) || !margin_is_valid(right_margin)) return OC_E_ARG;
    if (!camera_clears_ground(left, left_margin)) return OC_E_DEGENERATE;
    if (!camera_clears_ground(right, right_margin)) return OC_E_DEGENERATE;
    return OC_OK;
}

/* H of the plane Z = z is M' M^-1 - M' (C - C') r^T / (C_z - z), r the third
 * row of M^-1; the second term without its denominator is B. */
static oc_status_t matrices_make(const oc_camera_t *left, const oc_camera_t *right, pair_matrices_t *m)
{
    double left_centre[3], right_centre[3], base[3], M_right[9], ray[9], e_right[3];
    if (oc_epipolar_fundamental(left, right, m->F) != OC_OK) return OC_E_DEGENERATE;
    oc_pose_centre(&left->pose, left_centre);
    oc_pose_centre(&right->pose, right_centre);
    oc_vec3_sub(left_centre, right_centre, base);
    oc_camera_M(right, M_right);
    oc_camera_M_inverse(left, ray);

    oc_mat3_mul(M_right, ray, m->H_inf);
    oc_mat3_mul_vec(M_right, base, e_right);
    oc_mat3_outer(e_right, ray + 6, m->B);
    m->left_height_m = left_centre[2];
    for (int i = 0; i < 9; i++) m->H[i] = m->H_inf[i] - m->B[i] / m->left_height_m;
    return OC_OK;
}

static void matrix_difference(const double plus[9], const double minus[9], double scale, double out[9])
{
    for (int i = 0; i < 9; i++) out[i] = scale * (plus[i] - minus[i]);
}

/* One column: matrices at +- the margin; half their difference is the change
 * for an error of one margin, and the standard deviation is a / sqrt 3. */
static oc_status_t pair_differentiate(oc_pair_t *pair, int column, double margin, oc_angle_error_t angles)
{
    const bool is_left = column < 6;
    pair_matrices_t m[2];
    for (int side = 0; side < 2; side++) {
        const double delta = side == 0 ? -margin : margin;
        oc_camera_t moved;
        oc_pair_move_camera(is_left ? &pair->left : &pair->right, column % 6, delta, angles, &moved);
        const oc_status_t status =
            matrices_make(is_left ? &moved : &pair->left, is_left ? &pair->right : &moved, &m[side]);
        if (status != OC_OK) return status;
    }
    const double scale = 0.5 / sqrt(3.0);
    matrix_difference(m[1].F, m[0].F, scale, pair->dF[column]);
    matrix_difference(m[1].H, m[0].H, scale, pair->dH[column]);
    matrix_difference(m[1].H_inf, m[0].H_inf, scale, pair->dH_inf[column]);
    matrix_difference(m[1].B, m[0].B, scale, pair->dB[column]);
    pair->d_left_height_m[column] = scale * (m[1].left_height_m - m[0].left_height_m);
    return OC_OK;
}

/* The values that are not differentiated. */
static oc_status_t pair_fill(oc_pair_t *pair)
{
    pair_matrices_t m;
    const oc_status_t status = matrices_make(&pair->left, &pair->right, &m);
    if (status != OC_OK) return status;
    memcpy(pair->F, m.F, sizeof pair->F);
    memcpy(pair->H, m.H, sizeof pair->H);
    memcpy(pair->H_inf, m.H_inf, sizeof pair->H_inf);
    memcpy(pair->B, m.B, sizeof pair->B);
    pair->left_height_m = m.left_height_m;

    double right_centre[3], base[3];
    oc_pose_centre(&pair->left.pose, pair->left_centre_m);
    oc_pose_centre(&pair->right.pose, right_centre);
    oc_vec3_sub(pair->left_centre_m, right_centre, base);
    oc_camera_M_inverse(&pair->left, pair->left_ray);
    oc_camera_M(&pair->right, pair->right_M);
    oc_mat3_mul_vec(pair->right_M, base, pair->e_right);
    return OC_OK;
}

oc_status_t oc_pair_prepare(oc_pair_t *pair, const oc_camera_t *left, const oc_margin_t *left_margin,
                            const oc_camera_t *right, const oc_margin_t *right_margin, oc_angle_error_t angles,
                            double sigma_px)
{
    OC_ASSERT(pair);

    if (!(sigma_px > 0.0 && sigma_px <= 100.0)) return OC_E_ARG;
    if (angles != OC_ANGLE_ERROR_OPK && angles != OC_ANGLE_ERROR_LOCAL) return OC_E_ARG;
    oc_status_t status = oc_pair_check(left, left_margin, right, right_margin);
    if (status != OC_OK) return status;

    oc_pair_t out;
    memset(&out, 0, sizeof out);
    out.left = *left;
    out.right = *right;
    out.sigma_px = sigma_px;
    status = pair_fill(&out);
    for (int i = 0; i < OC_PAIR_PARAMS && status == OC_OK; i++) {
        const double margin = i < 6 ? left_margin->v[i] : right_margin->v[i - 6];
        status = pair_differentiate(&out, i, margin, angles);
    }
    if (status != OC_OK) return status;
    *pair = out;
    return OC_OK;
}
