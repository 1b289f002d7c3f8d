/* SPDX-License-Identifier: BSD-3-Clause
 * Ground filter: what one look at another view says about one junction.
 *
 * The junction's own picture is sought round the place where the ground would
 * be. What is found there is weighed as a log-likelihood ratio L of "on the
 * ground" against "anything else" (docs/design.md, section 4.5):
 *
 *   appearance   how well the window agrees, as a whole and in its worst ninth
 *   place        how far from where the ground would be, in standard deviations
 *   resolution   a look that would find a raised point at the same place says little */
#include <math.h>
#include <string.h>

#include "core/homography.h"
#include "vehicle/ground_internal.h"

/* Areas that differ by more are not the same texture any more. */
#define MAX_AREA_RATIO 9.0

/* A junction stays at least this far inside a window that was moved away from a border. */
#define MIN_INSIDE_PX 2.0

/* Windows are moved to this much more than they need from a border, for a step is only nearly right. */
#define BORDER_SLACK_PX 0.9

/* Error of a shift between two pictures beyond what their noise explains, px:
 * resampling, and windows that are not quite flat. */
#define SHIFT_FLOOR_PX 0.1

/* Unevenness of a floor, one standard deviation: this share of t_h, and at
 * most this share of the cameras' height. Who looks from nearby means it. */
#define UNEVEN_SHARE 0.15
#define UNEVEN_SLOPE 0.0015

/* Half of what stands on the ground is higher than this many t_h. */
#define TYPICAL_HEIGHT 10.0

/* Found, and well, but elsewhere: the surface is raised, or it repeats. */
#define L_ELSEWHERE (-3.0)

/* The window is not where the ground would be: another surface, or one in front. */
#define L_LOST (-1.5)

/* ---- where to look ---- */

static double clamp(double x, double low, double high)
{
    return x < low ? low : (x > high ? high : x);
}

/* How far the corners of the sought window stick out of the other image, the
 * worst of them on each axis, px of that image. */
static bool window_overshoot(const sight_t *s, const double mid[2], double half_px, double over[2])
{
    const double max_x = s->to->grey.width_px - 2.0, max_y = s->to->grey.height_px - 2.0;
    over[0] = over[1] = 0.0;
    for (int k = 0; k < 4; k++) {
        double x, y;
        const double cx = mid[0] + (k % 2 ? half_px : -half_px), cy = mid[1] + (k / 2 ? half_px : -half_px);
        if (!(oc_homography_apply(s->H, cx, cy, &x, &y) > 0.0)) return false;
        const double dx = clamp(x, 1.0, max_x) - x, dy = clamp(y, 1.0, max_y) - y;
        if (fabs(dx) > fabs(over[0])) over[0] = dx;
        if (fabs(dy) > fabs(over[1])) over[1] = dy;
    }
    return true;
}

/* Middle of a window with the junction in it that, with the search round it,
 * lies inside both images. The ground is flat: what is round a junction near
 * the border moves as the junction does. */
static bool window_place(const sight_t *s, uint32_t n_px, const double at[2], double mid[2])
{
    const double reach = n_px / 2u - MIN_INSIDE_PX; /* NOLINT(bugprone-integer-division) */
    const double half = n_px / 2u + (s->photo.is_smooth ? 1.0 : 0.0);
    const double max_x = s->from->grey.width_px - 2.0 - half, max_y = s->from->grey.height_px - 2.0 - half;
    memcpy(mid, at, 2 * sizeof *mid);
    for (int round = 0; round < 3; round++) {
        double over[2], J[4];
        mid[0] = clamp(mid[0], half + 1.0, max_x);
        mid[1] = clamp(mid[1], half + 1.0, max_y);
        if (!(fabs(mid[0] - at[0]) <= reach && fabs(mid[1] - at[1]) <= reach)) return false;
        if (!window_overshoot(s, mid, half + GROUND_SEARCH_PX, over)) return false;
        if (fabs(over[0]) <= BORDER_SLACK_PX && fabs(over[1]) <= BORDER_SLACK_PX) return true;
        if (oc_homography_jacobian(s->H, mid[0], mid[1], J) != OC_OK) return false;
        const double det = J[0] * J[3] - J[1] * J[2];
        if (!(fabs(det) > 1e-6)) return false;
        mid[0] += (J[3] * over[0] - J[1] * over[1]) / det;
        mid[1] += (J[0] * over[1] - J[2] * over[0]) / det;
    }
    return false;
}

/* ---- how well the place is known ---- */

/* J C J^T of a symmetric 2 x 2 (xx, xy, yy). */
static void cov_carry(const double J[4], const double cov[3], double out[3])
{
    const double a = J[0] * cov[0] + J[1] * cov[1], b = J[0] * cov[1] + J[1] * cov[2];
    const double c = J[2] * cov[0] + J[3] * cov[1], d = J[2] * cov[1] + J[3] * cov[2];
    out[0] = a * J[0] + b * J[1];
    out[1] = a * J[2] + b * J[3];
    out[2] = c * J[2] + d * J[3];
}

static double cov_largest(const double cov[3])
{
    const double half = 0.5 * (cov[0] + cov[2]);
    return half + sqrt(0.25 * (cov[0] - cov[2]) * (cov[0] - cov[2]) + cov[1] * cov[1]);
}

/* Covariance of the place in `to` that the ground point at `at` is expected at. */
static bool place_covariance(const sight_t *s, const double at[2], const double to[2], const double J[4], double cov[3])
{
    if (!s->is_reverse) return oc_ground_transfer_covariance(s->forward, at[0], at[1], cov);
    /* The fit says where left pixels go; seen backwards that error comes back through J. */
    double forward[3];
    if (!oc_ground_transfer_covariance(s->forward, to[0], to[1], forward)) return false;
    cov_carry(J, forward, cov);
    return true;
}

/* Unevenness in t_h. */
static double uneven_share(const sight_t *s, double t_h_m)
{
    double a[3], b[3];
    oc_pose_centre(&s->from->camera.pose, a);
    oc_pose_centre(&s->to->camera.pose, b);
    const double lower_m = fabs(a[2]) < fabs(b[2]) ? fabs(a[2]) : fabs(b[2]);
    const double slope = UNEVEN_SLOPE * lower_m / t_h_m;
    return slope < UNEVEN_SHARE ? slope : UNEVEN_SHARE;
}

/* Squared Mahalanobis length of v. */
static double cov_distance2(const double cov[3], const double v[2])
{
    const double det = cov[0] * cov[2] - cov[1] * cov[1];
    if (!(det > 0.0)) return (double)INFINITY;
    return (cov[2] * v[0] * v[0] - 2.0 * cov[1] * v[0] * v[1] + cov[0] * v[1] * v[1]) / det;
}

/* ---- weighing ---- */

/* Piecewise linear, constant outside. */
static double curve(double x, const double xs[], const double ys[], int n)
{
    if (!(x > xs[0])) return ys[0];
    for (int i = 1; i < n; i++) {
        if (x < xs[i]) return ys[i - 1] + (ys[i] - ys[i - 1]) * (x - xs[i - 1]) / (xs[i] - xs[i - 1]);
    }
    return ys[n - 1];
}

/* Of the window's agreement alone. The two curves are what ground and other
 * junctions of rendered and photographed scenes score, straightened. */
static double appearance(double ncc, double worst_block)
{
    static const double ncc_at[] = {0.3, 0.85, 0.95, 1.0}, ncc_l[] = {-1.8, -0.3, 1.3, 2.5};
    static const double block_at[] = {-0.2, 1.0}, block_l[] = {0.0, 5.0};
    const double whole = curve(ncc, ncc_at, ncc_l, 4);
    return ncc > 0.7 ? whole + curve(worst_block, block_at, block_l, 2) : whole;
}

/* Share of what stands on the ground that lies so low that the look would have
 * found it in the same place: below three standard deviations of the height. */
static double unresolved_share(double sigma_along_px, double rise_px)
{
    if (!(rise_px > 0.0)) return 1.0;
    const double height = 3.0 * sigma_along_px / rise_px; /* in t_h */
    const double share = height / (height + TYPICAL_HEIGHT);
    return share * share;
}

/* off_px from the place of the ground to where the window was found, with its
 * covariance; rise_px the way it goes for a height of t_h. */
static double weigh(const oc_ground_look_t *look, const double off_px[2], const double cov_px2[3],
                    const double rise_px[2], double uneven_share)
{
    const double seen = appearance((double)look->ncc, (double)look->worst_block);
    if (look->is_lost) return seen < L_LOST ? seen : L_LOST;
    if (seen <= 0.0) return seen;

    const double uneven[2] = {uneven_share * rise_px[0], uneven_share * rise_px[1]};
    const double cov[3] = {cov_px2[0] + uneven[0] * uneven[0], cov_px2[1] + uneven[0] * uneven[1],
                           cov_px2[2] + uneven[1] * uneven[1]};
    const double l = seen - 0.5 * cov_distance2(cov, off_px);
    if (!(l > L_ELSEWHERE)) return L_ELSEWHERE;
    if (l <= 0.0) return l;

    const double rise = hypot(rise_px[0], rise_px[1]);
    double along = 0.0;
    if (rise > 0.0) {
        const double ux = rise_px[0] / rise, uy = rise_px[1] / rise;
        along = sqrt(ux * ux * cov[0] + 2.0 * ux * uy * cov[1] + uy * uy * cov[2]);
    }
    const double blind = unresolved_share(along, rise);
    return -log(blind + (1.0 - blind) * exp(-l));
}

/* ---- the two halves of a judgement ---- */

/* Geometry of a look at one point with the pair as it stands. */
typedef struct place {
    double to[2], J[4]; /* where the ground would be, and the transfer's Jacobian there */
    double cov[3];      /* of that place */
} place_t;

static bool place_find(const sight_t *s, const double at[2], place_t *place)
{
    if (!(oc_homography_apply(s->H, at[0], at[1], &place->to[0], &place->to[1]) > 0.0)) return false;
    if (oc_homography_jacobian(s->H, at[0], at[1], place->J) != OC_OK) return false;
    const double area = place->J[0] * place->J[3] - place->J[1] * place->J[2];
    if (!(area < MAX_AREA_RATIO && area > 1.0 / MAX_AREA_RATIO)) return false;
    return place_covariance(s, at, place->to, place->J, place->cov);
}

bool oc_ground_look_at(const sight_t *s, const oc_ground_params_t *params, const double at[2], oc_ground_look_t *look)
{
    place_t place;
    double mid[2], x, y;
    ground_patch_t patch;
    ground_lookup_t found;
    look->is_done = false;
    if (!place_find(s, at, &place)) return false;
    const double reach2 = (double)(params->t_transfer_px * params->t_transfer_px);
    if (!(2.58 * 2.58 * cov_largest(place.cov) <= reach2)) return false;
    if (!window_place(s, params->window_px, at, mid)) return false;
    if (!oc_ground_patch_take(&s->from->grey, mid, params->window_px, s->photo.is_smooth, &patch)) return false;
    oc_ground_look_up(&patch, mid, &s->to->grey, s->H, &s->photo, &found);
    if (!found.is_inside) return false;

    const double there[2] = {mid[0] + (double)found.shift_px[0], mid[1] + (double)found.shift_px[1]};
    const double cov[3] = {(double)found.cov_px2[0], (double)found.cov_px2[1], (double)found.cov_px2[2]};
    double cov_there[3];
    if (oc_homography_apply(s->H, there[0], there[1], &x, &y) == 0.0) return false;
    cov_carry(place.J, cov, cov_there);
    const double floor2 = SHIFT_FLOOR_PX * SHIFT_FLOOR_PX;
    *look = (oc_ground_look_t){
        .is_done = true,
        .is_lost = found.is_at_border,
        .ncc = found.ncc,
        .worst_block = found.worst_block,
        .mid_px = {(float)mid[0], (float)mid[1]},
        .found_px = {(float)x, (float)y},
        .cov_px2 = {(float)(cov_there[0] + floor2), (float)cov_there[1], (float)(cov_there[2] + floor2)}};
    return true;
}

bool oc_ground_weigh(const sight_t *s, const oc_ground_params_t *params, const double at[2],
                     const oc_ground_look_t *look, double *l, oc_ground_pin_t *pin)
{
    place_t place;
    double x, y, rise_px[2];
    const double mid[2] = {(double)look->mid_px[0], (double)look->mid_px[1]};
    if (!look->is_done || !place_find(s, at, &place)) return false;
    if (oc_ground_rise(s->pair, at[0], at[1], params->t_h_m, rise_px) != OC_OK) return false;
    if (oc_homography_apply(s->H, mid[0], mid[1], &x, &y) == 0.0) return false;

    const double off_px[2] = {(double)look->found_px[0] - x, (double)look->found_px[1] - y};
    double cov[3];
    for (int k = 0; k < 3; k++) cov[k] = place.cov[k] + (double)look->cov_px2[k];
    const double uneven = uneven_share(s, params->t_h_m);
    *l = weigh(look, off_px, cov, rise_px, uneven);

    /* As a pin: uneven ground counts as noise on both axes. */
    const double uneven2 = uneven * uneven * (rise_px[0] * rise_px[0] + rise_px[1] * rise_px[1]);
    *pin = (oc_ground_pin_t){.x_px = look->mid_px[0],
                             .y_px = look->mid_px[1],
                             .x2_px = look->found_px[0],
                             .y2_px = look->found_px[1],
                             .variance_px2 = (float)(0.5 * ((double)(look->cov_px2[0] + look->cov_px2[2]) + uneven2))};
    return true;
}
