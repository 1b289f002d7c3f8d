// SPDX-License-Identifier: BSD-3-Clause
// outcrop-bench-carve SITE: carving from true and harmed masks, against the truth.
#include <cstdio>
#include <exception>
#include <iostream>

#include <CLI/CLI.hpp>

#include "harm.h"
#include "scene.h"
#include "site/carve_box.h"
#include "site/gltf.h"
#include "speed.h"

namespace {

using namespace outcrop;

struct Arguments {
    std::string site, run, glb, images = "images";
    std::vector<std::string> harms;
    bool is_speed = false;
    CarveOptions options;
};

void print_row(const eval::TrueObstacle &truth, const std::string &harm, const char *way, const Carved &carved)
{
    std::printf(
        "%-14s %-8s %-10s IoU %.3f  cell %5.1f mm  voxels %8zu occupied %7zu unknown %7zu removed %6zu left out %zu\n",
        truth.name.c_str(), harm.c_str(), way, bench::voxel_iou(carved.voxels, truth), carved.voxels.grid.cell_m * 1e3,
        carved.voxels.grid.size(), carved.n_occupied, carved.n_unknown, carved.n_colour_removed,
        carved.views_left_out.size());
}

void measure(const Arguments &arguments, const eval::Truth &truth, const eval::TrueObstacle &obstacle)
{
    for (const std::string &harm : arguments.harms) {
        std::vector<CarveView> views = bench::views_of(truth, obstacle.index, true, arguments.images);
        bench::harm(harm, &views);
        CarveOptions options = arguments.options;
        options.with_colour = false;
        print_row(obstacle, harm, "hull", carve_obstacle(bench::true_box(obstacle), views, options));
        options.with_colour = true;
        print_row(obstacle, harm, "colour", carve_obstacle(bench::true_box(obstacle), views, options));
        if (harm != "none") continue;
        options.method = CarveMethod::kThesis;
        print_row(obstacle, harm, "thesis", carve_obstacle(bench::true_box(obstacle), views, options));
    }
}

double box_iou(const Obstacle &box, const eval::TrueObstacle &truth)
{
    return eval::iou(eval::Box{box.aabb_min, box.aabb_max}, truth.aabb);
}

// The run's box that overlaps the obstacle most; nothing when none does.
const bench::PointBox *box_of(const std::vector<bench::PointBox> &boxes, const eval::TrueObstacle &truth)
{
    const bench::PointBox *best = nullptr;
    for (const bench::PointBox &b : boxes)
        if (box_iou(b.box, truth) > (best ? box_iou(best->box, truth) : 0)) best = &b;
    return best;
}

// The run's boxes from points beside the final ones, with the site's masks as silhouettes.
void measure_boxes(const Arguments &arguments, const eval::Truth &truth, const eval::TrueObstacle &obstacle,
                   const std::vector<bench::PointBox> &boxes, GltfSite *parts)
{
    const bench::PointBox *found = box_of(boxes, obstacle);
    if (!found) {
        std::printf("%-14s has no box\n", obstacle.name.c_str());
        return;
    }
    for (const std::string &harm : arguments.harms) {
        std::vector<CarveView> views = bench::views_of(truth, obstacle.index, true, arguments.images);
        bench::harm(harm, &views);
        const auto [carved, final, misses] = carve_with_box(found->box, found->points, views, arguments.options);
        std::printf("%-14s %-8s points %.3f final %.3f%s  hull %.3f, misses %d\n", obstacle.name.c_str(), harm.c_str(),
                    box_iou(found->box, obstacle), box_iou(final.box, obstacle),
                    final.has_volume ? "" : " (points alone)", bench::voxel_iou(carved.voxels, obstacle), misses);
        if (harm != "none") continue;
        parts->obstacles.push_back(final.box);
        parts->surfaces.push_back({obstacle.index, mesh_of(carved.voxels)});
    }
}

void run(const Arguments &arguments)
{
    eval::Notes notes;
    const eval::Truth truth = eval::read_truth(arguments.site, notes);
    if (!truth.has_depth() || !truth.obstacles) throw std::runtime_error("the site has no truth to carve from");
    if (arguments.is_speed) {
        const eval::TrueObstacle &first = truth.obstacles->front();
        bench::run_speed(bench::true_box(first), bench::views_of(truth, first.index, true, arguments.images));
        return;
    }
    if (arguments.run.empty()) {
        for (const eval::TrueObstacle &obstacle : *truth.obstacles) measure(arguments, truth, obstacle);
        return;
    }
    const std::vector<bench::PointBox> boxes = bench::read_boxes(arguments.run);
    GltfSite parts;
    for (const eval::TrueObstacle &obstacle : *truth.obstacles)
        measure_boxes(arguments, truth, obstacle, boxes, &parts);
    if (!arguments.glb.empty()) write_glb(arguments.glb, parts);
}

} // namespace

int main(int argc, char **argv)
{
    Arguments arguments;
    CLI::App app("Carves SITE's obstacles from its true masks and holds them against its meshes.",
                 "outcrop-bench-carve");
    app.add_option("SITE", arguments.site, "site folder with depth/ and obstacles/")->required();
    app.add_option("--images", arguments.images, "folder of the colours");
    app.add_option("--harm", arguments.harms, "what befalls the masks")->check(CLI::IsMember(bench::harms()));
    app.add_option("--misses", arguments.options.tolerated_misses, "views that may err about a voxel");
    app.add_option("--voxel", arguments.options.voxel_m, "side of a voxel, metres; 0: chosen");
    app.add_option("--difference", arguments.options.max_difference, "of colours, grey levels");
    app.add_option("--agreeing", arguments.options.min_agreeing, "share of the views");
    app.add_option("--run", arguments.run, "a run's folder: its boxes from points, and the final ones, instead");
    app.add_option("--glb", arguments.glb, "with --run: the carved surfaces and final boxes go there");
    app.add_flag("--speed", arguments.is_speed, "time a million voxels instead");
    CLI11_PARSE(app, argc, argv);
    if (arguments.harms.empty()) arguments.harms = bench::harms();
    try {
        run(arguments);
    } catch (const std::exception &e) {
        std::cerr << "outcrop-bench-carve: " << e.what() << '\n';
        return 1;
    }
    return 0;
}
