// SPDX-License-Identifier: BSD-3-Clause
// The time of a million voxels.
#include "speed.h"

#include <cmath>

#include <benchmark/benchmark.h>
#include <opencv2/core.hpp>

#include "site/carve_box.h"
#include "site/mesh.h"
#include "site/render_voxels.h"

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

} // namespace

void run_speed(const Obstacle &box, std::vector<CarveView> views)
{
    cv::setNumThreads(1);
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
