// SPDX-License-Identifier: BSD-3-Clause
// Boxes of carved volumes.
#include "site/carve_box.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

#include "site/carve_surface.h"

namespace outcrop {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kHalfTurn = 3.14159265358979323846;

void demand(bool is_met, const char *what)
{
    if (!is_met) throw std::invalid_argument(what);
}

// A box upright on the ground in a frame turned by yaw: low and high in that frame.
struct Upright {
    double yaw_rad = 0;
    Vector3d low = Vector3d::Zero(), high = Vector3d::Zero();
};

Vector3d turned(const Vector3d &p, double yaw_rad)
{
    const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
    return {c * p.x() + s * p.y(), -s * p.x() + c * p.y(), p.z()};
}

// Occupied voxels of one column of the grid.
struct Column {
    double x, y, n;
};

std::vector<Column> columns_of(const Voxels &voxels)
{
    const VoxelGrid &g = voxels.grid;
    std::vector<Column> columns;
    for (int j = 0; j < g.ny; ++j)
        for (int i = 0; i < g.nx; ++i) {
            int n = 0;
            for (int k = 0; k < g.nz; ++k) n += voxels.is_occupied(i, j, k);
            const Vector3d at = g.centre(i, j, 0);
            if (n > 0) columns.push_back({at.x(), at.y(), static_cast<double>(n)});
        }
    return columns;
}

// Ends of the weights along a line after `trim` of their sum is given up at each.
std::pair<double, double> trimmed_ends(std::vector<std::pair<double, double>> weights, double trim)
{
    std::sort(weights.begin(), weights.end());
    double sum = 0;
    for (const auto &w : weights) sum += w.second;
    double given = 0;
    std::size_t first = 0, last = weights.size() - 1;
    while (first < last && given + weights[first].second <= trim * sum) given += weights[first++].second;
    given = 0;
    while (last > first && given + weights[last].second <= trim * sum) given += weights[last--].second;
    return {weights[first].first, weights[last].first};
}

std::pair<double, double> trimmed_along(const std::vector<Column> &columns, double yaw_rad, double trim)
{
    std::vector<std::pair<double, double>> weights;
    weights.reserve(columns.size());
    const double c = std::cos(yaw_rad), s = std::sin(yaw_rad);
    for (const Column &column : columns) weights.emplace_back(c * column.x + s * column.y, column.n);
    return trimmed_ends(std::move(weights), trim);
}

double trimmed_top(const Voxels &voxels, double trim)
{
    const VoxelGrid &g = voxels.grid;
    std::vector<std::pair<double, double>> weights;
    for (int k = 0; k < g.nz; ++k) {
        double n = 0;
        for (int j = 0; j < g.ny; ++j)
            for (int i = 0; i < g.nx; ++i) n += voxels.is_occupied(i, j, k);
        if (n > 0) weights.emplace_back(g.centre(0, 0, k).z(), n);
    }
    return trimmed_ends(std::move(weights), trim).second + g.cell_m / 2;
}

Upright upright_of(const std::vector<Column> &columns, double yaw_rad, double top_m, double cell_m, double trim)
{
    // Cells reach beyond their centres by half their width across the turned axis.
    const double reach = cell_m / 2 * (std::abs(std::cos(yaw_rad)) + std::abs(std::sin(yaw_rad)));
    const auto [x0, x1] = trimmed_along(columns, yaw_rad, trim);
    const auto [y0, y1] = trimmed_along(columns, yaw_rad + kHalfTurn / 2, trim);
    return {yaw_rad, {x0 - reach, y0 - reach, 0}, {x1 + reach, y1 + reach, top_m}};
}

// The turn of least ground area, first in steps of three degrees, then finer.
Upright least_upright(const std::vector<Column> &columns, double top_m, double cell_m, double trim)
{
    const auto area = [](const Upright &u) { return (u.high.x() - u.low.x()) * (u.high.y() - u.low.y()); };
    Upright best = upright_of(columns, 0, top_m, cell_m, trim);
    for (double step = kHalfTurn / 60, from = 0, to = kHalfTurn / 2; step > kHalfTurn / 1800; step /= 4) {
        for (double yaw = from; yaw < to; yaw += step) {
            const Upright u = upright_of(columns, yaw, top_m, cell_m, trim);
            if (area(u) < area(best)) best = u;
        }
        from = best.yaw_rad - step, to = best.yaw_rad + step;
    }
    return best;
}

void set_oriented(Upright u, Obstacle *box)
{
    Vector3d size = u.high - u.low;
    box->obb_centre = turned((u.low + u.high) / 2, -u.yaw_rad);
    double yaw = u.yaw_rad;
    if (size.y() > size.x()) std::swap(size.x(), size.y()), yaw += kHalfTurn / 2;
    while (yaw > kHalfTurn / 2) yaw -= kHalfTurn;
    while (yaw <= -kHalfTurn / 2) yaw += kHalfTurn;
    box->obb_size = size;
    box->yaw_rad = yaw;
}

Upright oriented_of(const Obstacle &box)
{
    const Vector3d centre = turned(box.obb_centre, box.yaw_rad);
    return {box.yaw_rad, centre - box.obb_size / 2, centre + box.obb_size / 2};
}

// The way of a pixel's ray through the volume.
struct Chord {
    Vector3d from, to;
};

struct ViewChords {
    std::vector<Chord> chords;
};

// Does the box hold a piece of the chord? Slabs.
bool explains(const Upright &box, const Vector3d &from, const Vector3d &to)
{
    double t0 = 0, t1 = 1;
    for (int axis = 0; axis < 3; ++axis) {
        const double d = to[axis] - from[axis];
        const double a = box.low[axis] - from[axis], b = box.high[axis] - from[axis];
        if (std::abs(d) < 1e-12) {
            if (a > 0 || b < 0) return false;
            continue;
        }
        t0 = std::max(t0, std::min(a / d, b / d));
        t1 = std::min(t1, std::max(a / d, b / d));
    }
    return t0 <= t1;
}

cv::Mat1f farthest_of(const std::vector<SurfaceVoxel> &surface, const GridCamera &camera)
{
    cv::Mat1f depth(camera.image().height, camera.image().width, 0.0F);
    for (const SurfaceVoxel &voxel : surface) {
        const VoxelPixel at = camera.project(voxel.i, voxel.j, voxel.k);
        const cv::Rect splat = splat_of(camera, at, 1e-6);
        const float z = static_cast<float>(at.depth_m);
        for (int y = splat.y; y < splat.y + splat.height; ++y)
            for (int x = splat.x; x < splat.x + splat.width; ++x) depth(y, x) = std::max(depth(y, x), z);
    }
    return depth;
}

Vector3d point_on_ray(const oc_camera_t &camera, double x_px, double y_px, double depth_m)
{
    const oc_pose_t &pose = camera.pose;
    const Vector3d in_camera((x_px - camera.k.cx_px) / camera.k.fx_px * depth_m,
                             (y_px - camera.k.cy_px) / camera.k.fy_px * depth_m, depth_m);
    const Vector3d d = in_camera - Vector3d(pose.t[0], pose.t[1], pose.t[2]);
    return {pose.R[0] * d.x() + pose.R[3] * d.y() + pose.R[6] * d.z(),
            pose.R[1] * d.x() + pose.R[4] * d.y() + pose.R[7] * d.z(),
            pose.R[2] * d.x() + pose.R[5] * d.y() + pose.R[8] * d.z()};
}

ViewChords chords_of(const CarveView &view, const Voxels &voxels, const std::vector<SurfaceVoxel> &surface, int at_most,
                     int rim_px)
{
    ViewChords result;
    const GridCamera camera(view.camera, voxels.grid);
    const cv::Mat1f near = depth_of_surface(surface, camera), far = farthest_of(surface, camera);
    const double slack_m = voxels.grid.cell_m; // splats stand at their centres
    // Along the outline the volume's true edge may be cut off by rounding, and the ray then meets only what lies behind.
    cv::Mat1b inner;
    cv::erode(view.labels == OC_LABEL_OBSTACLE, inner, cv::Mat::ones(2 * rim_px + 1, 2 * rim_px + 1, CV_8U));
    std::vector<cv::Point> pixels;
    for (int y = 0; y < view.labels.rows; ++y)
        for (int x = 0; x < view.labels.cols; ++x)
            if (inner(y, x) && far(y, x) > 0) pixels.emplace_back(x, y);
    const std::size_t step = std::max<std::size_t>(1, pixels.size() / static_cast<std::size_t>(at_most));
    for (std::size_t n = 0; n < pixels.size(); n += step) {
        const cv::Point px = pixels[n];
        const double from_m = static_cast<double>(near(px)) - slack_m, to_m = static_cast<double>(far(px)) + slack_m;
        result.chords.push_back(
            {point_on_ray(view.camera, px.x, px.y, from_m), point_on_ray(view.camera, px.x, px.y, to_m)});
    }
    return result;
}

// Chords in a box's own frame.
std::vector<ViewChords> turned(std::vector<ViewChords> views, double yaw_rad)
{
    for (ViewChords &view : views)
        for (Chord &c : view.chords) c = {turned(c.from, yaw_rad), turned(c.to, yaw_rad)};
    return views;
}

// The chords of each view that the box does not explain, of those in `from`.
std::vector<ViewChords> unexplained(const Upright &box, const std::vector<ViewChords> &from)
{
    std::vector<ViewChords> rest(from.size());
    for (std::size_t v = 0; v < from.size(); ++v)
        std::copy_if(from[v].chords.begin(), from[v].chords.end(), std::back_inserter(rest[v].chords),
                     [&](const Chord &c) { return !explains(box, c.from, c.to); });
    return rest;
}

// Shares of the views' silhouettes that are unexplained beyond what is tolerated, summed.
double missing(const std::vector<ViewChords> &rest, const std::vector<ViewChords> &all, double tolerated)
{
    double sum = 0;
    for (std::size_t v = 0; v < all.size(); ++v)
        if (!all[v].chords.empty())
            sum +=
                std::max(0.0, static_cast<double>(rest[v].chords.size()) / static_cast<double>(all[v].chords.size()) -
                                  tolerated);
    return sum;
}

double volume_of(const Upright &box)
{
    return (box.high - box.low).prod();
}

// One side (low x, low y, high x, high y, high z) farther out, not beyond the limit's.
Upright moved(const Upright &box, const Upright &limit, int side, double by)
{
    Upright result = box;
    const int axis = side < 2 ? side : side - 2;
    if (side < 2)
        result.low[axis] = std::min(box.low[axis], std::max(box.low[axis] - by, limit.low[axis]));
    else
        result.high[axis] = std::max(box.high[axis], std::min(box.high[axis] + by, limit.high[axis]));
    return result;
}

// Outwards in small steps, each the one that explains most per volume added, until the silhouettes are explained.
Upright grown(Upright box, const Upright &limit, const std::vector<ViewChords> &all, const FinalBoxOptions &options)
{
    constexpr int kSides = 5, kLongestStep = 64;
    const Vector3d step = options.step_share * (limit.high - limit.low);
    std::vector<ViewChords> rest = unexplained(box, all);
    double lacking = missing(rest, all, options.max_uncovered);
    while (lacking > 0) {
        Upright best = box;
        double best_worth = 0;
        // Longer steps where no short one reaches anything.
        for (int times = 1; times <= kLongestStep && !(best_worth > 0); times *= 2)
            for (int side = 0; side < kSides; ++side) {
                const Upright tried = moved(box, limit, side, times * step[side < 2 ? side : side - 2]);
                const double added = volume_of(tried) - volume_of(box);
                if (!(added > 0)) continue;
                const double gain = lacking - missing(unexplained(tried, rest), all, options.max_uncovered);
                if (gain / added > best_worth) best = tried, best_worth = gain / added;
            }
        if (!(best_worth > 0)) break;
        box = best;
        rest = unexplained(box, rest);
        lacking = missing(rest, all, options.max_uncovered);
    }
    return box;
}

// The points' box with its sides brought in to the volume's, but not past a point that it holds.
Upright brought_in(const Upright &box, const Upright &volume, const std::vector<SitePoint> &points)
{
    Upright held = box;
    held.low.setConstant(INFINITY), held.high.setConstant(-INFINITY);
    for (const SitePoint &p : points) {
        const Vector3d at = turned(p.position, box.yaw_rad);
        if ((at - box.low).minCoeff() < 0 || (box.high - at).minCoeff() < 0) continue;
        held.low = held.low.cwiseMin(at), held.high = held.high.cwiseMax(at);
    }
    if (!held.low.allFinite()) return box;
    Upright result = box;
    result.low = box.low.cwiseMax(volume.low.cwiseMin(held.low));
    result.high = box.high.cwiseMin(volume.high.cwiseMax(held.high));
    result.low.z() = box.low.z();
    return result;
}

bool is_near_volume(const Voxels &voxels, const Vector3d &p, int slack_cells)
{
    const VoxelGrid &g = voxels.grid;
    const Vector3d at = (p - g.low) / g.cell_m;
    for (int dk = -slack_cells; dk <= slack_cells; ++dk)
        for (int dj = -slack_cells; dj <= slack_cells; ++dj)
            for (int di = -slack_cells; di <= slack_cells; ++di)
                if (voxels.is_occupied(static_cast<int>(std::floor(at.x())) + di,
                                       static_cast<int>(std::floor(at.y())) + dj,
                                       static_cast<int>(std::floor(at.z())) + dk))
                    return true;
    return false;
}

// Does the volume fit what the points say at all?
bool is_supported(const Obstacle &box, const std::vector<SitePoint> &points, const Voxels &voxels,
                  const FinalBoxOptions &options)
{
    const VoxelGrid &g = voxels.grid;
    std::size_t n_cells = 0, n_occupied = 0;
    for (int k = 0; k < g.nz; ++k)
        for (int j = 0; j < g.ny; ++j)
            for (int i = 0; i < g.nx; ++i) {
                const Vector3d at = g.centre(i, j, k);
                if ((at - box.aabb_min).minCoeff() < 0 || (box.aabb_max - at).minCoeff() < 0) continue;
                ++n_cells;
                n_occupied += voxels.is_occupied(i, j, k);
            }
    if (n_cells == 0 || static_cast<double>(n_occupied) < options.min_support * static_cast<double>(n_cells))
        return false;
    std::size_t n_in = 0, n_points = 0;
    for (const SitePoint &p : points) {
        if ((p.position - box.aabb_min).minCoeff() < 0 || (box.aabb_max - p.position).minCoeff() < 0) continue;
        ++n_points;
        n_in += is_near_volume(voxels, p.position, options.slack_cells);
    }
    return static_cast<double>(n_in) >= options.min_points_in * static_cast<double>(n_points);
}

bool is_left_out(const Carved &carved, int id)
{
    return std::find(carved.views_left_out.begin(), carved.views_left_out.end(), id) != carved.views_left_out.end();
}

} // namespace

void FinalBoxOptions::check() const
{
    demand(max_uncovered >= 0 && max_uncovered < 1, "final box: max_uncovered");
    demand(min_support >= 0 && min_support <= 1 && min_points_in >= 0 && min_points_in <= 1, "final box: support");
    demand(slack_cells >= 0 && slack_cells <= 64, "final box: slack_cells");
    demand(step_share >= 1e-4 && step_share <= 1 && rays_per_view >= 1, "final box: step_share, rays_per_view");
    demand(rim_px >= 0 && rim_px <= 64, "final box: rim_px");
}

Obstacle box_of_voxels(const Voxels &voxels, double share)
{
    demand(share > 0 && share <= 1, "box of voxels: share");
    const std::vector<Column> columns = columns_of(voxels);
    demand(!columns.empty(), "box of voxels: nothing is occupied");
    const double trim = (1 - share) / 5, cell_m = voxels.grid.cell_m;
    const double top_m = trimmed_top(voxels, trim);
    const Upright straight = upright_of(columns, 0, top_m, cell_m, trim);
    Obstacle box;
    box.aabb_min = straight.low;
    box.aabb_max = straight.high;
    set_oriented(least_upright(columns, top_m, cell_m, trim), &box);
    return box;
}

FinalBox final_box(const Obstacle &from_points, const std::vector<SitePoint> &points, const Carved &carved,
                   const std::vector<CarveView> &views, const FinalBoxOptions &options)
{
    options.check();
    FinalBox result;
    result.box = result.from_points = result.from_voxels = from_points;
    const Voxels &voxels = carved.voxels;
    if (!carved.is_usable()) return result;
    result.from_voxels = box_of_voxels(voxels);
    if (!is_supported(from_points, points, voxels, options)) return result;
    result.has_volume = true;

    std::vector<const CarveView *> in_order;
    for (const CarveView &view : views)
        if (!view.labels.empty() && !is_left_out(carved, view.id)) in_order.push_back(&view);
    std::sort(in_order.begin(), in_order.end(), [](const CarveView *a, const CarveView *b) { return a->id < b->id; });
    // Rays leave the volume through its bottom too.
    const std::vector<SurfaceVoxel> surface = surface_of(voxels, true);
    std::vector<ViewChords> chords;
    for (const CarveView *view : in_order)
        chords.push_back(chords_of(*view, voxels, surface, options.rays_per_view, options.rim_px));

    const std::vector<Column> columns = columns_of(voxels);
    const double top_m = trimmed_top(voxels, 0);
    const auto fit = [&](const Upright &box) {
        const Upright volume = upright_of(columns, box.yaw_rad, top_m, voxels.grid.cell_m, 0);
        return grown(brought_in(box, volume, points), volume, turned(chords, box.yaw_rad), options);
    };
    const Upright straight = fit({0, from_points.aabb_min, from_points.aabb_max});
    result.box.aabb_min = straight.low;
    result.box.aabb_max = straight.high;
    if (from_points.obb_size.minCoeff() > 0) set_oriented(fit(oriented_of(from_points)), &result.box);
    return result;
}

CarvedBox carve_with_box(const Obstacle &from_points, const std::vector<SitePoint> &points,
                         const std::vector<CarveView> &views, CarveOptions carve, const FinalBoxOptions &options,
                         int max_more)
{
    CarvedBox result;
    for (int more = 0;; ++more, ++carve.tolerated_misses) {
        result.carved = carve_obstacle(from_points, views, carve);
        result.final = final_box(from_points, points, result.carved, views, options);
        result.tolerated_misses = carve.tolerated_misses;
        if (result.final.has_volume || more >= max_more || result.carved.n_views == 0) return result;
    }
}

} // namespace outcrop
