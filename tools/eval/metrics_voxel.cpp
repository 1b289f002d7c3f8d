// SPDX-License-Identifier: BSD-3-Clause
// How well the carved volume fills the true one.
#include "metrics_voxel.h"

#include "ply.h"

#include <cmath>

namespace outcrop::eval {

namespace fs = std::filesystem;

namespace {

using Eigen::Vector3d;
using Cells = std::vector<std::uint8_t>;

constexpr int kSurfaceSamples = 3000;
constexpr double kMaxCells = 64e6; // of one obstacle's grid, a byte each

// The found grid, grown so that it also holds the whole true obstacle.
Lattice common_lattice(const std::vector<Vector3d> &centres, double cell_m, const Box &truth, const fs::path &file)
{
    Vector3d low = centres.front(), high = low;
    for (const Vector3d &c : centres) {
        low = low.cwiseMin(c);
        high = high.cwiseMax(c);
    }
    const Vector3d before = ((low - truth.min_m) / cell_m).array().ceil().cwiseMax(0.0);
    const Vector3d after = ((truth.max_m - high) / cell_m).array().ceil().cwiseMax(0.0);
    const Vector3d count = ((high - low) / cell_m).array().round() + 1 + before.array() + after.array();
    if (!(count.prod() <= kMaxCells)) throw EvalError(file, "spans too many voxels of its voxel_size");
    Lattice g;
    g.cell_m = cell_m;
    g.first_centre_m = low - before * cell_m;
    g.nx = static_cast<int>(count.x());
    g.ny = static_cast<int>(count.y());
    g.nz = static_cast<int>(count.z());
    return g;
}

Cells fill(const std::vector<Vector3d> &centres, const Lattice &g)
{
    Cells cells(g.size(), 0);
    for (const Vector3d &c : centres) {
        const Eigen::Vector3i at = ((c - g.first_centre_m) / g.cell_m).array().round().cast<int>();
        cells[g.index(at.x(), at.y(), at.z())] = 1;
    }
    return cells;
}

double iou(const Cells &a, const Cells &b)
{
    std::size_t common = 0, whole = 0;
    for (std::size_t i = 0; i < a.size(); i++) {
        common += a[i] && b[i];
        whole += a[i] || b[i];
    }
    return whole > 0 ? static_cast<double>(common) / static_cast<double>(whole) : 0;
}

// May the point belong to the obstacle, as far as this view's true mask says?
bool survives(const Camera &view, const DepthMap &map, int index, const Vector3d &p)
{
    const auto at = view.project(p);
    if (!at || !view.inside(at->pixel)) return true;
    const int x = static_cast<int>(std::lround(at->pixel.x()));
    const int y = static_cast<int>(std::lround(at->pixel.y()));
    const int code = map.mask.at<std::uint8_t>(y, x);
    if (code == index) return true;
    return is_obstacle_code(code) && static_cast<double>(map.depth_m.at<float>(y, x)) < at->depth_m;
}

Cells hull_of(const Truth &truth, int index, const Lattice &g)
{
    Cells cells(g.size(), 0);
    for (int k = 0; k < g.nz; k++)
        for (int j = 0; j < g.ny; j++)
            for (int i = 0; i < g.nx; i++) {
                bool is_kept = true;
                for (std::size_t v = 0; is_kept && v < truth.views.size(); v++)
                    is_kept = !truth.depth[v] || survives(truth.views[v], *truth.depth[v], index, g.centre_m(i, j, k));
                cells[g.index(i, j, k)] = is_kept;
            }
    return cells;
}

std::optional<double> chamfer(const Mesh &found, const Mesh &truth)
{
    const auto on_found = sample_surface(found, kSurfaceSamples);
    const auto on_truth = sample_surface(truth, kSurfaceSamples);
    if (on_found.empty() || on_truth.empty()) return std::nullopt;
    return (mean_distance_m(on_found, truth) + mean_distance_m(on_truth, found)) / 2;
}

} // namespace

std::optional<std::vector<VoxelMetric>> evaluate_voxels(const Truth &truth, const Run &run, const BoxMetrics &boxes,
                                                        Notes &notes)
{
    std::vector<VoxelMetric> out;
    for (const FoundObstacle &o : *run.obstacles) {
        const fs::path file = run.dir / "model" / (std::to_string(o.index) + ".voxels.ply");
        const TrueObstacle *t = truth_of(o.index, boxes, truth);
        if (!t || !fs::exists(file)) continue;
        if (!o.voxel_size_m)
            throw EvalError(run.dir / "model/obstacles.json",
                            "obstacle " + std::to_string(o.index) + " has voxels but no voxel_size");
        const std::vector<Vector3d> centres = read_ply(file, 1.0).vertices;
        if (centres.empty()) {
            notes.push_back(file.string() + " holds no voxels: left out");
            continue;
        }
        const Lattice g = common_lattice(centres, *o.voxel_size_m, t->aabb, file);
        const Cells found = fill(centres, g), truly = occupancy(t->mesh, g);
        VoxelMetric m;
        m.truth = t->index;
        m.iou = iou(found, truly);
        const fs::path mesh = run.dir / "model" / (std::to_string(o.index) + ".ply");
        m.chamfer_m = chamfer(fs::exists(mesh) ? read_ply(mesh, 1.0) : cell_surface(found, g), t->mesh);
        if (truth.has_depth()) m.hull_iou = iou(hull_of(truth, t->index, g), truly);
        out.push_back(m);
    }
    if (!out.empty()) return out;
    notes.push_back("voxels and hull are null: no model/K.voxels.ply of a box given to a true obstacle");
    return std::nullopt;
}

} // namespace outcrop::eval
