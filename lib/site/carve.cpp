// SPDX-License-Identifier: BSD-3-Clause
// The way from silhouettes and colours to voxels.
#include "site/carve.h"

#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

#include "site/carve_colour.h"
#include "site/carve_hull.h"
#include "site/carve_shape.h"

namespace outcrop {
namespace {

void demand(bool is_met, const char *what)
{
    if (!is_met) throw std::invalid_argument(what);
}

bool has_size(const cv::Mat &image, const oc_intrinsics_t &k)
{
    return image.cols == static_cast<int>(k.width_px) && image.rows == static_cast<int>(k.height_px);
}

void check_view(const CarveView &view)
{
    demand(oc_intrinsics_is_valid(&view.camera.k) && oc_pose_is_valid(&view.camera.pose), "carve: invalid camera");
    demand(view.labels.empty() || has_size(view.labels, view.camera.k), "carve: labels have not the camera's size");
    demand(view.rgb.empty() == view.known.empty(), "carve: colours without the mask of what is known, or reverse");
    demand(view.rgb.empty() || (has_size(view.rgb, view.camera.k) && has_size(view.known, view.camera.k)),
           "carve: colours have not the camera's size");
}

// Ascending ids, so that the order in which views came is of no account.
std::vector<const CarveView *> sorted(const std::vector<CarveView> &views)
{
    std::vector<const CarveView *> out;
    for (const CarveView &view : views) {
        check_view(view);
        out.push_back(&view);
    }
    std::sort(out.begin(), out.end(), [](const CarveView *a, const CarveView *b) { return a->id < b->id; });
    for (std::size_t i = 1; i < out.size(); ++i) demand(out[i - 1]->id != out[i]->id, "carve: a view appears twice");
    return out;
}

struct Extent {
    Eigen::Vector3d low, high;
};

// Axis-aligned round both forms of the box, grown on every side but the ground's.
Extent grown_extent(const Obstacle &box, const CarveOptions &options)
{
    const double c = std::abs(std::cos(box.yaw_rad)), s = std::abs(std::sin(box.yaw_rad));
    const Eigen::Vector3d half = box.obb_size / 2;
    const Eigen::Vector3d reach(c * half.x() + s * half.y(), s * half.x() + c * half.y(), half.z());
    Extent e{box.aabb_min, box.aabb_max};
    if (box.obb_size.minCoeff() > 0) {
        e.low = e.low.cwiseMin(box.obb_centre - reach);
        e.high = e.high.cwiseMax(box.obb_centre + reach);
    }
    demand(e.low.allFinite() && e.high.allFinite() && (e.high - e.low).minCoeff() > 0 && e.high.z() > 0,
           "carve: a box without extent above the ground");
    const Eigen::Vector3d margin = (options.grow_share * (e.high - e.low)).array() + options.grow_m;
    e.low -= margin;
    e.high += margin;
    e.low.z() = 0;
    return e;
}

// Metres that a pixel of the middling view spans at the box; 0 when no view has it in front.
double pixel_footprint(const Eigen::Vector3d &at, const std::vector<CarveView> &views)
{
    std::vector<double> footprints;
    for (const CarveView &view : views) {
        double x, y;
        const double depth = oc_camera_project(&view.camera, at.data(), &x, &y);
        if (depth > 0) footprints.push_back(depth / std::max(view.camera.k.fx_px, view.camera.k.fy_px));
    }
    if (footprints.empty()) return 0;
    const auto middle = footprints.begin() + static_cast<std::ptrdiff_t>(footprints.size() / 2);
    std::nth_element(footprints.begin(), middle, footprints.end());
    return *middle;
}

double cell_size(const Extent &e, const std::vector<CarveView> &views, const CarveOptions &options)
{
    if (options.voxel_m > 0) return options.voxel_m;
    const Eigen::Vector3d size = e.high - e.low;
    constexpr double kLeastCells = 12; // along the shortest side
    const double at_most = size.minCoeff() / kLeastCells;
    // Sides are rounded up to whole cells: (s / c + 1) summed out stays below auto_voxels for c from here on.
    double at_least = std::cbrt(size.prod() / options.auto_voxels);
    while ((size / at_least).array().ceil().prod() > options.auto_voxels) at_least *= 1.01;
    const double footprint = pixel_footprint((e.low + e.high) / 2, views);
    return std::max(at_least, footprint > 0 ? std::min(footprint, at_most) : at_most);
}

VoxelGrid grid_of(const Extent &e, double cell_m, const CarveOptions &options)
{
    VoxelGrid grid;
    grid.cell_m = cell_m;
    const Eigen::Vector3d counts = ((e.high - e.low) / cell_m).array().ceil().cwiseMax(1.0);
    if (!(counts.prod() <= options.max_voxels)) {
        std::ostringstream text;
        text << "carve: a grid of " << counts.x() << " x " << counts.y() << " x " << counts.z() << " = "
             << counts.prod() << " voxels would take " << carving_bytes(counts.prod()) << " bytes; at most "
             << options.max_voxels << " voxels are allowed";
        throw std::length_error(text.str());
    }
    grid.nx = static_cast<int>(counts.x());
    grid.ny = static_cast<int>(counts.y());
    grid.nz = static_cast<int>(counts.z());
    grid.low = (e.low + e.high) / 2 - counts * (cell_m / 2);
    grid.low.z() = 0;
    return grid;
}

void count_states(Carved *carved)
{
    const Voxels &v = carved->voxels;
    carved->n_occupied = carved->n_free = carved->n_unknown = carved->n_surface = 0;
    for (int k = 0; k < v.grid.nz; ++k)
        for (int j = 0; j < v.grid.ny; ++j)
            for (int i = 0; i < v.grid.nx; ++i) {
                const VoxelState state = v.states[v.grid.at(i, j, k)];
                carved->n_occupied += state == VoxelState::kOccupied;
                carved->n_free += state == VoxelState::kFree;
                carved->n_unknown += state == VoxelState::kUnknown;
                carved->n_surface += state == VoxelState::kOccupied && v.is_surface(i, j, k);
            }
}

// Sides of the grid (low x, high x, low y, high y, low z, high z) that the volume meets.
std::array<bool, 6> met_sides(const VoxelGrid &g, const std::vector<VoxelState> &states)
{
    std::array<bool, 6> met{};
    for (int k = 0; k < g.nz; ++k)
        for (int j = 0; j < g.ny; ++j)
            for (int i = 0; i < g.nx; ++i) {
                if (states[g.at(i, j, k)] != VoxelState::kOccupied) continue;
                met[0] |= i == 0, met[1] |= i == g.nx - 1, met[2] |= j == 0;
                met[3] |= j == g.ny - 1, met[5] |= k == g.nz - 1;
            }
    return met;
}

struct Silhouettes {
    std::vector<LabelView> views;
    std::vector<int> left_out;
};

Silhouettes silhouettes_of(const std::vector<const CarveView *> &views)
{
    Silhouettes result;
    for (const CarveView *view : views) {
        if (view->labels.empty()) continue;
        LabelView label(*view);
        if (label.says_anything()) result.views.push_back(std::move(label));
    }
    return result;
}

void leave_out_contradicting(const VoxelGrid &grid, const CarveOptions &options, Silhouettes *silhouettes)
{
    if (options.method == CarveMethod::kThesis) return;
    const std::vector<int> wrong = contradicting_views(grid, silhouettes->views, options);
    for (auto v = wrong.rbegin(); v != wrong.rend(); ++v) {
        const auto at = silhouettes->views.begin() + *v;
        silhouettes->left_out.push_back(at->id());
        silhouettes->views.erase(at);
    }
    std::sort(silhouettes->left_out.begin(), silhouettes->left_out.end());
}

// Where a rough carving says that the volume goes on, the extent follows it.
Extent follow_volume(Extent e, const CarveOptions &options, double cell_m, Silhouettes *silhouettes)
{
    constexpr double kRoughness = 3;
    const Eigen::Vector3d step = options.grow_share * (e.high - e.low);
    for (int round = 0;; ++round) {
        const VoxelGrid rough = grid_of(e, kRoughness * cell_m, options);
        if (round == 0) leave_out_contradicting(rough, options, silhouettes);
        if (round == options.max_regrows) return e;
        const auto met =
            met_sides(rough, carve_hull(rough, silhouettes->views, options.tolerated_misses, options.min_views));
        bool is_grown = false;
        for (int axis = 0; axis < 3; ++axis) {
            const double by = step[axis] * (1 << round);
            if (met[static_cast<std::size_t>(2 * axis)]) e.low[axis] -= by, is_grown = by > 0;
            if (met[static_cast<std::size_t>(2 * axis + 1)]) e.high[axis] += by, is_grown = by > 0;
        }
        if (!is_grown) return e;
    }
}

} // namespace

void CarveOptions::check() const
{
    demand(voxel_m >= 0 && std::isfinite(voxel_m), "carve: voxel_m");
    demand(auto_voxels >= 1e3 && max_voxels >= 1 && max_voxels <= 1e9, "carve: auto_voxels, max_voxels");
    demand(grow_share >= 0 && grow_share <= 10 && grow_m >= 0 && std::isfinite(grow_m), "carve: grow_share, grow_m");
    demand(max_regrows >= 0 && max_regrows <= 8, "carve: max_regrows");
    demand(tolerated_misses >= 0 && tolerated_misses < 65536, "carve: tolerated_misses");
    demand(min_views >= 1 && min_views < 65536 && min_views_to_judge >= 3, "carve: min_views, min_views_to_judge");
    demand(min_kept_share >= 0 && min_kept_share < 1, "carve: min_kept_share");
    demand(max_difference >= 0 && thesis_difference >= 0 && thesis_agreeing >= 0, "carve: colour differences");
    demand(min_colour_views >= 2 && min_agreeing >= 0 && min_agreeing <= 1, "carve: agreeing views");
    demand(max_sweeps >= 0 && max_removed >= 0 && max_removed <= 1, "carve: sweeps");
    demand(close_cells >= 0 && close_cells <= 64 && open_cells >= 0 && open_cells <= 64, "carve: close, open");
    demand(min_part_share >= 0 && min_part_share <= 1, "carve: min_part_share");
}

double carving_bytes(double n_voxels)
{
    // States, colours, marks of the two fills and the numbers of the parts.
    return n_voxels * (sizeof(VoxelState) + sizeof(cv::Vec3b) + 2 * sizeof(std::uint8_t) + sizeof(int));
}

VoxelGrid grid_for(const Obstacle &box, const std::vector<CarveView> &views, const CarveOptions &options)
{
    options.check();
    const Extent e = grown_extent(box, options);
    return grid_of(e, cell_size(e, views, options), options);
}

Carved carve_obstacle(const Obstacle &box, const std::vector<CarveView> &views, const CarveOptions &options)
{
    options.check();
    const std::vector<const CarveView *> in_order = sorted(views);
    const VoxelGrid first = grid_for(box, views, options); // refuses before anything is computed
    Silhouettes silhouettes = silhouettes_of(in_order);
    const Extent e = follow_volume(grown_extent(box, options), options, first.cell_m, &silhouettes);
    Carved carved;
    carved.voxels.grid = grid_of(e, cell_size(e, views, options), options);
    carved.views_left_out = silhouettes.left_out;
    carved.n_views = static_cast<int>(silhouettes.views.size());
    for (const CarveView *view : in_order) carved.n_colour_views += !view->rgb.empty();
    carved.voxels.states =
        carve_hull(carved.voxels.grid, silhouettes.views, options.tolerated_misses, options.min_views);
    if (options.method == CarveMethod::kThesis) {
        if (options.with_colour) carved.n_colour_removed = carve_by_colour_thesis(in_order, options, &carved.voxels);
    } else {
        fill_down(&carved.voxels);
        if (options.with_colour) carved.n_colour_removed = carve_by_colour(in_order, options, &carved.voxels);
        close_voxels(options.close_cells, &carved.voxels);
        open_voxels(options.open_cells, &carved.voxels);
        drop_small_parts(options.min_part_share, &carved.voxels);
    }
    colour_voxels(in_order, &carved.voxels);
    count_states(&carved);
    return carved;
}

} // namespace outcrop
