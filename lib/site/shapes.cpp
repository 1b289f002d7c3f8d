// SPDX-License-Identifier: BSD-3-Clause
// From what the views say to files.
#include "site/shapes.h"

#include <cctype>
#include <filesystem>
#include <stdexcept>

#include "site/boxes.h"
#include "site/export_mesh.h"
#include "site/gltf.h"

namespace outcrop {

std::vector<Shape> carve_shapes(const std::vector<std::vector<CarveView>> &views, double asked_grow_share,
                                const CarveOptions &options, const std::function<void(const std::string &)> &tell,
                                SiteModel *model)
{
    std::vector<Shape> shapes;
    double n_silhouettes = 0, n_voxels = 0, n_by_colour = 0;
    for (std::size_t i = 0; i < views.size(); i++) {
        Obstacle &box = model->obstacles.at(i);
        n_silhouettes += static_cast<double>(views[i].size());
        if (views[i].empty()) continue;
        try {
            // The views were asked about the box grown by so much, and know nothing beyond.
            CarveOptions here = options;
            here.grow_share = 0;
            here.grow_m = asked_grow_share * largest_side(box);
            here.max_regrows = 0;
            std::vector<SitePoint> points;
            for (const SitePoint &point : model->points)
                if (point.obstacle == static_cast<int>(i)) points.push_back(point);
            CarvedBox both = carve_with_box(box, points, views[i], here);
            Carved &carved = both.carved;
            if (!carved.is_usable()) continue;
            box = both.final.box;
            box.voxel_m = carved.voxels.grid.cell_m;
            n_voxels += static_cast<double>(carved.voxels.grid.size());
            n_by_colour += static_cast<double>(carved.n_colour_removed);
            SurfaceMesh mesh = mesh_of(carved.voxels);
            shapes.push_back({box.index, std::move(carved.voxels), std::move(mesh)});
        } catch (const std::length_error &fault) {
            tell("obstacle " + std::to_string(box.index) + ": " + fault.what());
        }
    }
    model->counts["silhouettes"] = n_silhouettes;
    model->counts["voxels"] = n_voxels;
    model->counts["voxels_off_by_colour"] = n_by_colour;
    return shapes;
}

void write_shapes(const std::string &dir, const SiteModel &model, const std::vector<Shape> &shapes,
                  const OverheadMap &overhead)
{
    for (const auto &entry : std::filesystem::directory_iterator(dir)) {
        const std::string name = entry.path().filename().string();
        if (!name.empty() && std::isdigit(static_cast<unsigned char>(name[0])) && entry.path().extension() == ".ply")
            std::filesystem::remove(entry.path());
    }
    GltfSite site;
    site.ground = {overhead.rgb, overhead.seen, overhead.metres_per_pixel, overhead.x_min, overhead.y_max};
    site.obstacles = model.obstacles;
    site.suspected = model.suspected;
    for (const Shape &shape : shapes) {
        write_voxels(dir, shape.index, shape.voxels);
        write_mesh(dir, shape.index, shape.mesh);
        site.surfaces.push_back({shape.index, shape.mesh});
    }
    write_glb(dir + "/site.glb", site);
}

} // namespace outcrop
