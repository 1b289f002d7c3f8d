// SPDX-License-Identifier: BSD-3-Clause
// Silhouettes first, row by row with the projection carried along; then colour, layer by layer from outside.
#include "site/carve.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <string>

#include "core/grid.h"
#include "site/boxes.h"
#include "site/carve_colour.h"
#include "site/triangulate.h"

namespace outcrop {
namespace {

using Eigen::Vector3d;

// A box turned about the vertical, grown, as bounds of the world's axes.
void bounds_of(const Obstacle &box, double grow, Vector3d *low, Vector3d *high)
{
    const double c = std::abs(std::cos(box.yaw_rad)), s = std::abs(std::sin(box.yaw_rad));
    const double more = grow * largest_side(box);
    const double a = box.obb_size.x() / 2 + more, b = box.obb_size.y() / 2 + more;
    const Vector3d half(c * a + s * b, s * a + c * b, 0);
    *low = box.obb_centre - half;
    *high = box.obb_centre + half;
    low->z() = 0;
    high->z() = box.aabb_max.z() + more;
}

// Metres that a pixel covers at the box, of the view that sees it finest.
double finest_pixel(const Obstacle &box, const std::vector<CarveView> &views)
{
    double finest = 0;
    for (const CarveView &view : views) {
        double x, y;
        const double depth = oc_camera_project(&view.camera, box.obb_centre.data(), &x, &y);
        if (!(depth > 0)) continue;
        const double pixel = depth / view.camera.k.fx_px;
        if (finest == 0 || pixel < finest) finest = pixel;
    }
    return finest;
}

VoxelGrid grid_of(const Obstacle &box, const std::vector<CarveView> &views, const CarveOptions &options)
{
    Vector3d low, high;
    bounds_of(box, options.grow_share, &low, &high);
    const double longest = (high - low).maxCoeff();
    if (!(longest > 0) || !std::isfinite(longest)) throw std::invalid_argument("carve: the box has no extent");
    VoxelGrid grid;
    grid.min_m = low;
    grid.size_m = options.voxel_m > 0
                      ? options.voxel_m
                      : std::clamp(finest_pixel(box, views), longest / options.max_side, longest / options.min_side);
    const Vector3d n = ((high - low) / grid.size_m).array().ceil().max(1.0);
    if (!(n.prod() <= static_cast<double>(options.max_voxels)) || !(n.maxCoeff() <= OC_MAX_GRID_SIDE)) {
        char text[200];
        std::snprintf(text, sizeof text,
                      "carve: voxels of %g m would make a grid of %.0f x %.0f x %.0f = %.3g voxels, %.3g MB; at most "
                      "%zu voxels and %u a side are allowed",
                      grid.size_m, n.x(), n.y(), n.z(), n.prod(), n.prod() * 6e-6, options.max_voxels,
                      OC_MAX_GRID_SIDE);
        throw std::runtime_error(text);
    }
    grid.nx = static_cast<int>(n.x()), grid.ny = static_cast<int>(n.y()), grid.nz = static_cast<int>(n.z());
    grid.state.assign(static_cast<std::size_t>(n.prod()), VoxelState::kUnknown);
    return grid;
}

// How many views call a voxel ground and obstacle.
struct Tally {
    std::vector<std::uint8_t> ground, obstacle;
};

void count_view(const CarveView &view, const VoxelGrid &grid, Tally *tally)
{
    double P[12];
    oc_camera_matrix(&view.camera, P);
    const cv::Mat1b &labels = view.labels;
    const float width = static_cast<float>(labels.cols) - 0.5f, height = static_cast<float>(labels.rows) - 0.5f;
    const float du = static_cast<float>(P[0] * grid.size_m), dv = static_cast<float>(P[4] * grid.size_m);
    const float dw = static_cast<float>(P[8] * grid.size_m);
    const std::uint8_t *pixels = labels.ptr<std::uint8_t>(0);
    const auto pitch = static_cast<int>(labels.step[0]);
    for (int k = 0; k < grid.nz; k++) {
        for (int j = 0; j < grid.ny; j++) {
            const Vector3d first = grid.centre(0, j, k);
            const auto at = [&](int row) {
                return static_cast<float>(P[4 * row] * first.x() + P[4 * row + 1] * first.y() +
                                          P[4 * row + 2] * first.z() + P[4 * row + 3]);
            };
            const float u0 = at(0), v0 = at(1), w0 = at(2);
            std::uint8_t *ground = &tally->ground[grid.index(0, j, k)];
            std::uint8_t *obstacle = &tally->obstacle[grid.index(0, j, k)];
            for (int i = 0; i < grid.nx; i++) {
                const float step = static_cast<float>(i), w = w0 + step * dw;
                if (!(w > 1e-6f)) continue;
                const float inverse = 1 / w;
                const float u = (u0 + step * du) * inverse, v = (v0 + step * dv) * inverse;
                if (!(u > -0.5f && v > -0.5f && u < width && v < height)) continue;
                const int x = static_cast<int>(u + 0.5f), y = static_cast<int>(v + 0.5f);
                const std::uint8_t label = pixels[y * pitch + x];
                ground[i] = static_cast<std::uint8_t>(ground[i] + (label == OC_LABEL_GROUND));
                obstacle[i] = static_cast<std::uint8_t>(obstacle[i] + (label == OC_LABEL_OBSTACLE));
            }
        }
    }
}

bool says_anything(const CarveView &view)
{
    return !view.labels.empty() && cv::countNonZero(view.labels != OC_LABEL_UNKNOWN) > 0;
}

// Ground is never inside the grown box's own turned footprint alone: what lies outside that is not looked at.
void cut_to_box(const Obstacle &box, double grow, VoxelGrid *grid)
{
    const double slack = grow * largest_side(box);
    for (int j = 0; j < grid->ny; j++) {
        for (int i = 0; i < grid->nx; i++) {
            const Vector3d at = grid->centre(i, j, 0);
            if (footprint_contains(box, at.x(), at.y(), slack)) continue;
            for (int k = 0; k < grid->nz; k++) grid->state[grid->index(i, j, k)] = VoxelState::kFree;
        }
    }
}

// What is unknown under something occupied holds it up.
void fill_down(VoxelGrid *grid)
{
    for (int j = 0; j < grid->ny; j++) {
        for (int i = 0; i < grid->nx; i++) {
            bool is_under = false;
            for (int k = grid->nz - 1; k >= 0; k--) {
                VoxelState &state = grid->state[grid->index(i, j, k)];
                if (state == VoxelState::kOccupied) is_under = true;
                if (state == VoxelState::kUnknown && is_under) state = VoxelState::kOccupied;
            }
        }
    }
}

// Pieces that hang together across faces, largest kept; small ones are free.
void drop_small_pieces(double min_share, VoxelGrid *grid)
{
    std::vector<std::int32_t> piece(grid->size(), -1);
    std::vector<std::size_t> sizes, stack;
    const auto nx = static_cast<std::size_t>(grid->nx), plane = nx * static_cast<std::size_t>(grid->ny);
    for (std::size_t start = 0; start < grid->size(); start++) {
        if (grid->state[start] != VoxelState::kOccupied || piece[start] >= 0) continue;
        const auto label = static_cast<std::int32_t>(sizes.size());
        sizes.push_back(0);
        stack.assign(1, start);
        piece[start] = label;
        while (!stack.empty()) {
            const std::size_t at = stack.back();
            stack.pop_back();
            sizes.back()++;
            const std::size_t i = at % nx, j = at / nx % static_cast<std::size_t>(grid->ny), k = at / plane;
            const auto visit = [&](bool is_inside, std::size_t next) {
                if (!is_inside || grid->state[next] != VoxelState::kOccupied || piece[next] >= 0) return;
                piece[next] = label;
                stack.push_back(next);
            };
            visit(i > 0, at - 1), visit(i + 1 < nx, at + 1);
            visit(j > 0, at - nx), visit(j + 1 < static_cast<std::size_t>(grid->ny), at + nx);
            visit(k > 0, at - plane), visit(k + 1 < static_cast<std::size_t>(grid->nz), at + plane);
        }
    }
    if (sizes.empty()) return;
    const double least = min_share * static_cast<double>(*std::max_element(sizes.begin(), sizes.end()));
    for (std::size_t v = 0; v < grid->size(); v++)
        if (piece[v] >= 0 && static_cast<double>(sizes[static_cast<std::size_t>(piece[v])]) < least)
            grid->state[v] = VoxelState::kFree;
}

std::size_t count_occupied(const VoxelGrid &grid)
{
    return static_cast<std::size_t>(std::count(grid.state.begin(), grid.state.end(), VoxelState::kOccupied));
}

} // namespace

void CarveOptions::check() const
{
    if (!(voxel_m >= 0) || min_side < 1 || max_side < min_side || max_voxels < 1)
        throw std::invalid_argument("carve: voxel_m >= 0, 1 <= min_side <= max_side, max_voxels >= 1");
    if (!(grow_share >= 0) || misses < 0 || !(min_piece_share >= 0))
        throw std::invalid_argument("carve: grow_share, misses and min_piece_share must be >= 0");
    if (min_colour_views < 2 || !(colour_share > 0 && colour_share <= 1) || colour_tolerance < 0 ||
        colour_reach_px < 0 || colour_sweeps < 0 || thesis_colours < 1)
        throw std::invalid_argument("carve: colours need 2 views, a share in (0, 1], tolerance and reach >= 0");
}

Carved carve(const Obstacle &box, const std::vector<CarveView> &views, const CarveOptions &options)
{
    options.check();
    Carved carved;
    std::vector<CarveView> telling;
    for (const CarveView &view : views)
        if (says_anything(view)) telling.push_back(view);
    carved.n_views = static_cast<int>(telling.size());
    carved.grid = grid_of(box, telling, options);
    VoxelGrid &grid = carved.grid;
    Tally tally;
    tally.ground.assign(grid.size(), 0);
    tally.obstacle.assign(grid.size(), 0);
    for (std::size_t v = 0; v < telling.size() && v < 255; v++) count_view(telling[v], grid, &tally);
    for (std::size_t v = 0; v < grid.size(); v++) {
        if (tally.ground[v] > options.misses)
            grid.state[v] = VoxelState::kFree;
        else if (tally.obstacle[v] > 0)
            grid.state[v] = VoxelState::kOccupied;
    }
    cut_to_box(box, options.grow_share, &grid);
    fill_down(&grid);
    drop_small_pieces(options.min_piece_share, &grid);
    carved.n_hull = count_occupied(grid);
    const bool has_colour =
        std::any_of(telling.begin(), telling.end(), [](const CarveView &v) { return !v.rgb.empty(); });
    if (has_colour && options.with_colour) {
        carved.n_colour = carve_by_colour(telling, options, &grid);
        drop_small_pieces(options.min_piece_share, &grid);
    }
    carved.n_hidden = colour_voxels(telling, &grid);
    return carved;
}

namespace {

struct Side {
    double low = 0, high = 0;
};

// Where the volume lies along an axis, but for the outermost `trim` of it at each end.
Side volume_along(const VoxelGrid &grid, const Vector3d &axis, double trim)
{
    std::vector<double> at;
    for (int k = 0; k < grid.nz; k++)
        for (int j = 0; j < grid.ny; j++)
            for (int i = 0; i < grid.nx; i++)
                if (grid.is_surface(i, j, k)) at.push_back(axis.dot(grid.centre(i, j, k)));
    std::sort(at.begin(), at.end());
    const auto cut = static_cast<std::size_t>(trim * static_cast<double>(at.size()));
    return {at[cut] - grid.size_m / 2, at[at.size() - 1 - cut] + grid.size_m / 2};
}

// One side of the box, outward positive. The volume is the outer bound of the body: where it ends before the points'
// side, that side was widened too far. Where it goes on beyond, it is too large by what views from few sides leave, or
// the points missed an end: only what is more than usual counts.
double side_between(double points, double volume, double size, double dead_share, const FinalBoxOptions &options)
{
    const double beyond = volume - points;
    if (beyond < 0) return points + options.inward_trust * beyond;
    return points + std::max(0.0, beyond - dead_share * size);
}

Side sides_between(const Side &points, const Side &volume, double dead_share, const FinalBoxOptions &options)
{
    const double size = points.high - points.low;
    return {-side_between(-points.low, -volume.low, size, dead_share, options),
            side_between(points.high, volume.high, size, dead_share, options)};
}

} // namespace

Obstacle final_box(const Obstacle &points_box, const Carved &carved, const FinalBoxOptions &options)
{
    Obstacle box = points_box;
    if (carved.is_empty() || count_occupied(carved.grid) == 0) return box;
    const auto along_axis = [&](const Vector3d &axis, double low, double high, double dead_share) {
        return sides_between({low, high}, volume_along(carved.grid, axis, options.trim_share), dead_share, options);
    };
    const Side x = along_axis(Vector3d::UnitX(), box.aabb_min.x(), box.aabb_max.x(), options.side_dead_share);
    const Side y = along_axis(Vector3d::UnitY(), box.aabb_min.y(), box.aabb_max.y(), options.side_dead_share);
    const Side z = along_axis(Vector3d::UnitZ(), 0, box.aabb_max.z(), options.top_dead_share);
    box.aabb_min = Vector3d(x.low, y.low, box.aabb_min.z());
    box.aabb_max = Vector3d(x.high, y.high, z.high);
    const Vector3d along(std::cos(box.yaw_rad), std::sin(box.yaw_rad), 0), across(-along.y(), along.x(), 0);
    const auto turned = [&](const Vector3d &axis, double size) {
        const double middle = axis.dot(points_box.obb_centre);
        return along_axis(axis, middle - size / 2, middle + size / 2, options.side_dead_share);
    };
    const Side u = turned(along, points_box.obb_size.x()), v = turned(across, points_box.obb_size.y());
    const double top = box.aabb_max.z(), floor = box.aabb_min.z();
    const Vector3d centre = (u.low + u.high) / 2 * along + (v.low + v.high) / 2 * across;
    box.obb_centre = Vector3d(centre.x(), centre.y(), (floor + top) / 2);
    box.obb_size = Vector3d(u.high - u.low, v.high - v.low, top - floor);
    return box;
}

} // namespace outcrop
