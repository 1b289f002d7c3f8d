// SPDX-License-Identifier: BSD-3-Clause
// The time of a million voxels.
#include "speed.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>

#include "site/carve_box.h"
#include "site/mesh.h"
#include "site/render_voxels.h"
#include "vehicle/arena.h"
#include "vehicle/silhouette.h"

namespace outcrop::bench {
namespace {

constexpr std::size_t kViews = 8;

void report_size(benchmark::State &state, const Carved &carved)
{
    state.counters["voxels"] = static_cast<double>(carved.voxels.grid.size());
    state.counters["occupied"] = static_cast<double>(carved.n_occupied);
    state.counters["surface"] = static_cast<double>(carved.n_surface);
    state.counters["views"] = carved.n_views;
}

// Side of the cells that make about n of them.
double cell_for(const Obstacle &box, const std::vector<CarveView> &views, double n, const CarveOptions &options)
{
    const VoxelGrid grid = grid_for(box, views, options);
    return std::cbrt((grid.high() - grid.low).prod() / n);
}

void draw(benchmark::State &state, const VoxelCloud &cloud, const oc_camera_t &camera)
{
    for (auto _ : state) benchmark::DoNotOptimize(render_voxels(cloud, camera).depth.data);
    state.counters["surface"] = static_cast<double>(cloud.size());
}

// One silhouette of the box in each view that shows it, from all others: the vehicle's own code.
class SilhouetteRig {
public:
    SilhouetteRig(const Obstacle &box, const std::vector<CarveView> &views)
    {
        asked_.x_m = box.obb_centre.x(), asked_.y_m = box.obb_centre.y();
        asked_.length_m = box.obb_size.x(), asked_.width_m = box.obb_size.y(), asked_.height_m = box.aabb_max.z();
        asked_.yaw_rad = box.yaw_rad < 0 ? box.yaw_rad + 3.14159265358979 : box.yaw_rad;
        asked_.is_subject = true;
        std::uint32_t width = 0, height = 0;
        for (const CarveView &view : views) {
            if (view.rgb.empty()) continue;
            const auto w = static_cast<std::uint32_t>(view.rgb.cols), h = static_cast<std::uint32_t>(view.rgb.rows);
            sights_.push_back(
                {{view.rgb.ptr<std::uint8_t>(0), w, h, static_cast<std::uint32_t>(view.rgb.step[0]), 3}, view.camera});
            width = std::max(width, w), height = std::max(height, h);
        }
        if (sights_.empty()) return;
        block_.resize(oc_silhouette_size_bytes(width, height) + OC_ARENA_ALIGN);
        oc_arena_t arena;
        if (oc_arena_init(&arena, block_.data(), block_.size()) != OC_OK ||
            oc_silhouette_init(&workspace_, &arena, width, height) != OC_OK)
            throw std::runtime_error("no room for silhouettes");
    }

    // Mean pixels of the rectangles and how many views show the box.
    void run(benchmark::State &state)
    {
        double n_px = 0, n_made = 0;
        for (auto _ : state) {
            for (std::size_t i = 0; i < sights_.size(); i++) {
                std::vector<oc_sight_t> others = sights_;
                others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
                const oc_silhouette_task_t task{&asked_, 1, 0, 0.15, OC_SILHOUETTE_BEST};
                oc_pixel_rect_t rect;
                const std::uint8_t *labels = nullptr;
                if (oc_silhouette_find(&workspace_, &sights_[i], others.data(),
                                       static_cast<std::uint32_t>(others.size()), &task, &rect, &labels) != OC_OK)
                    continue;
                n_px += static_cast<double>(rect.x1 - rect.x0) * static_cast<double>(rect.y1 - rect.y0);
                n_made++;
            }
        }
        state.counters["px_each"] = n_made > 0 ? n_px / n_made : 0;
        state.counters["seconds_each"] =
            benchmark::Counter(n_made, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
    }

private:
    oc_ground_box_t asked_{};
    std::vector<oc_sight_t> sights_;
    std::vector<std::uint8_t> block_;
    oc_silhouette_ws_t workspace_{};
};

} // namespace

void run_speed(const Obstacle &box, std::vector<CarveView> views)
{
    cv::setNumThreads(1);
    SilhouetteRig rig(box, views);
    benchmark::RegisterBenchmark("silhouettes/all_views", [&](benchmark::State &s) {
        rig.run(s);
    })->Unit(benchmark::kMillisecond);
    const std::vector<CarveView> kept = views; // the rig borrows their pixels
    if (views.size() > kViews) views.resize(kViews);
    CarveOptions plain;
    plain.with_colour = false;
    plain.max_regrows = 0; // exactly the million
    plain.voxel_m = cell_for(box, views, 1e6, plain);
    CarveOptions coloured = plain;
    coloured.with_colour = true;
    std::vector<CarveView> grey = views;
    for (CarveView &view : grey) view.rgb.release(), view.known.release();
    const auto carve = [&box](benchmark::State &state, const std::vector<CarveView> &from,
                              const CarveOptions &options) {
        Carved carved;
        for (auto _ : state) carved = carve_obstacle(box, from, options);
        report_size(state, carved);
    };
    benchmark::RegisterBenchmark("carve/silhouettes", [&](benchmark::State &s) {
        carve(s, grey, plain);
    })->Unit(benchmark::kMillisecond);
    benchmark::RegisterBenchmark("carve/colour", [&](benchmark::State &s) {
        carve(s, views, coloured);
    })->Unit(benchmark::kMillisecond);
    const Carved whole = carve_obstacle(box, views, coloured);
    benchmark::RegisterBenchmark("mesh", [&](benchmark::State &s) {
        std::size_t n = 0;
        for (auto _ : s) n = mesh_of(whole.voxels).triangles.size();
        s.counters["triangles"] = static_cast<double>(n);
    })->Unit(benchmark::kMillisecond);
    VoxelCloud cloud;
    cloud.add(1, whole.voxels);
    benchmark::RegisterBenchmark("draw/one", [&](benchmark::State &s) {
        draw(s, cloud, views.front().camera);
    })->Unit(benchmark::kMillisecond);
    // As many obstacles as a million voxels of surface take.
    VoxelCloud crowd;
    while (crowd.size() < 1000000) crowd.add(1, whole.voxels);
    benchmark::RegisterBenchmark("draw/million_surface", [&](benchmark::State &s) {
        draw(s, crowd, views.front().camera);
    })->Unit(benchmark::kMillisecond);
    const FinalBoxOptions defaults;
    benchmark::RegisterBenchmark("final_box", [&](benchmark::State &s) {
        for (auto _ : s) benchmark::DoNotOptimize(final_box(box, {}, whole, views, defaults));
    })->Unit(benchmark::kMillisecond);
    benchmark::RunSpecifiedBenchmarks();
}

} // namespace outcrop::bench
