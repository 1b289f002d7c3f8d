// SPDX-License-Identifier: BSD-3-Clause
// Writes the run that gets all of a site's truth right.
#include "site_maker.h"

#include "eval/image_file.h"
#include "eval/json_file.h"
#include "eval/metrics_match.h"

#include <cmath>
#include <fstream>
#include <opencv2/imgcodecs.hpp>

namespace outcrop::eval {

namespace fs = std::filesystem;

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

Json vector_json(const Vector3d &v)
{
    return {v.x(), v.y(), v.z()};
}

// What a point of view `v` at this pixel is, by the true mask.
const char *kind_at(const DepthMap &map, const Vector2d &pixel)
{
    const int code =
        map.mask.at<std::uint8_t>(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x())));
    if (is_obstacle_code(code)) return "obstacle";
    return is_true_ground(map, pixel) ? "ground" : "unknown";
}

Json matches_of(const Truth &truth, std::size_t left, std::size_t right)
{
    const DepthMap &map = *truth.depth[left];
    Json matches = Json::array();
    for (int v = 3; v < map.depth_m.rows - 3; v += 6) {
        for (int u = 3; u < map.depth_m.cols - 3; u += 6) {
            const double depth = static_cast<double>(map.depth_m.at<float>(v, u));
            const std::string kind = kind_at(map, Vector2d(u, v));
            if (!(depth > 0) || kind == "unknown") continue;
            const Camera &camera = truth.views[left];
            const Vector3d p = camera.centre_m() + depth * camera.ray(Vector2d(u, v));
            const auto at = truth.views[right].project(p);
            if (!at || !truth.views[right].inside(at->pixel) || !is_visible(*truth.depth[right], *at)) continue;
            matches.push_back({{"left", {u, v}},
                               {"right", {at->pixel.x(), at->pixel.y()}},
                               {"kind", kind},
                               {"score", 1.0},
                               {"point", vector_json(p)}});
        }
    }
    return {{"left", left}, {"right", right}, {"matches", matches}};
}

// Junctions where a lattice of ground points is seen, so that partners lie at
// each other's true transfer; obstacle pixels beside them.
Json junctions_of(const Truth &truth, std::size_t view)
{
    const DepthMap &map = *truth.depth[view];
    Json junctions = Json::array();
    const auto add = [&](const Vector2d &px) {
        junctions.push_back(
            {{"x", px.x()}, {"y", px.y()}, {"label", kind_at(map, px)}, {"reference", view > 0 ? 0 : -1}});
    };
    for (int i = -10; i <= 10; i++) {
        for (int j = -10; j <= 10; j++) {
            const auto at = truth.views[view].project({0.05 * i, 0.05 * j, 0});
            if (at && truth.views[view].inside(at->pixel) && is_visible(map, *at)) add(at->pixel);
        }
    }
    for (int v = 2; v < map.mask.rows; v += 9)
        for (int u = 2; u < map.mask.cols; u += 9)
            if (is_obstacle_code(map.mask.at<std::uint8_t>(v, u))) add(Vector2d(u, v));
    return {{"view", view}, {"junctions", junctions}};
}

void write_link_files(const Truth &truth, const fs::path &dir)
{
    Json matches = {{"pairs", Json::array()}}, junctions = {{"views", Json::array()}};
    for (std::size_t i = 0; i < truth.views.size(); i++) {
        junctions["views"].push_back(junctions_of(truth, i));
        if (i > 0) matches["pairs"].push_back(matches_of(truth, i - 1, i));
    }
    write_text(dir / "matches.json", matches.dump());
    write_text(dir / "vehicle/junctions.json", junctions.dump());
    const Json bytes = {{"view", 100}, {"overhead", 200}, {"total", 300}};
    write_text(dir / "report.json", Json({{"bytes", bytes}}).dump());
}

Lattice box_lattice(const Box &box, double cell_m)
{
    Lattice g;
    g.cell_m = cell_m;
    g.first_centre_m = box.min_m + Vector3d::Constant(cell_m / 2);
    const Vector3d n = ((box.max_m - box.min_m) / cell_m).array().ceil();
    g.nx = static_cast<int>(n.x());
    g.ny = static_cast<int>(n.y());
    g.nz = static_cast<int>(n.z());
    return g;
}

void write_voxels(const TrueObstacle &o, const Lattice &g, const fs::path &file)
{
    const auto inside = occupancy(o.mesh, g);
    std::ofstream out(file);
    out.precision(9);
    out << "ply\nformat ascii 1.0\nelement vertex " << std::count(inside.begin(), inside.end(), 1)
        << "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nend_header\n";
    for (int k = 0; k < g.nz; k++)
        for (int j = 0; j < g.ny; j++)
            for (int i = 0; i < g.nx; i++)
                if (inside[g.index(i, j, k)]) out << g.centre_m(i, j, k).transpose() << " 128\n";
}

void write_mesh(const Mesh &mesh, const fs::path &file)
{
    std::ofstream out(file);
    out.precision(12);
    out << "ply\nformat ascii 1.0\nelement vertex " << mesh.vertices.size()
        << "\nproperty double x\nproperty double y\nproperty double z\nelement face " << mesh.triangles.size()
        << "\nproperty list uchar int vertex_indices\nend_header\n";
    for (const Vector3d &v : mesh.vertices) out << v.transpose() << '\n';
    for (const auto &t : mesh.triangles) out << "3 " << t[0] << ' ' << t[1] << ' ' << t[2] << '\n';
}

void write_model(const Truth &truth, const fs::path &dir)
{
    constexpr double kVoxelM = 0.02;
    Json list = Json::array();
    for (const TrueObstacle &o : *truth.obstacles) {
        const int index = o.index + kFoundOffset;
        const Json obb = {{"centre", vector_json(o.obb.centre_m)},
                          {"size", vector_json(o.obb.size_m)},
                          {"yaw_deg", o.obb.yaw_rad * 180 / M_PI}};
        list.push_back({{"index", index},
                        {"aabb_min", vector_json(o.aabb.min_m)},
                        {"aabb_max", vector_json(o.aabb.max_m)},
                        {"obb", obb},
                        {"points", 9},
                        {"voxel_size", kVoxelM}});
        const fs::path stem = dir / "model" / std::to_string(index);
        // Off the faces: a cell centre on one would be in or out by rounding.
        const Box grid{o.aabb.min_m - Vector3d::Constant(0.3713 * kVoxelM), o.aabb.max_m};
        write_voxels(o, box_lattice(grid, kVoxelM), stem.string() + ".voxels.ply");
        write_mesh(o.mesh, stem.string() + ".ply");
    }
    write_text(dir / "model/obstacles.json", Json({{"units", "m"}, {"obstacles", list}}).dump());
    fs::copy_file(truth.dir / "cameras.json", dir / "model/cameras.json", fs::copy_options::overwrite_existing);
}

void write_ground(const Truth &truth, const fs::path &dir)
{
    const Area &a = *truth.area;
    const double cell_m = (a.max_m - a.min_m).maxCoeff() > 3 ? 0.005 : 0.001;
    const Lattice g = box_lattice({{a.min_m.x(), a.min_m.y(), 0}, {a.max_m.x(), a.max_m.y(), cell_m}}, cell_m);
    cv::Mat codes(g.ny, g.nx, CV_8U, cv::Scalar(1));
    for (const TrueObstacle &o : *truth.obstacles) {
        const auto covered = coverage(o.mesh, g);
        for (int j = 0; j < g.ny; j++)
            for (int i = 0; i < g.nx; i++)
                if (covered[g.index(i, j, 0)]) codes.at<std::uint8_t>(g.ny - 1 - j, i) = 2;
    }
    cv::imwrite((dir / "model/ground.png").string(), codes);
    const Json legend = {{"free", 1}, {"obstacle", 2}, {"suspected", 3}, {"unseen", 0}};
    const Json json = {{"metres_per_pixel", cell_m},
                       {"x_min", a.min_m.x()},
                       {"y_max", a.min_m.y() + g.ny * cell_m},
                       {"codes", legend}};
    write_text(dir / "model/ground.json", json.dump());
}

void write_sequence(const Truth &truth, const fs::path &dir)
{
    const fs::path to = dir / "sequence/boxes";
    fs::create_directories(to);
    for (std::size_t i = 0; i < truth.frames->size(); i++) {
        const TrueFrame &f = (*truth.frames)[i];
        cv::imwrite((to / numbered("frame_", i)).string(), read_image(f.image, cv::IMREAD_COLOR));
        cv::Mat mask = read_codes(f.mask);
        for (std::uint8_t &code : cv::Mat_<std::uint8_t>(mask))
            if (is_obstacle_code(code)) code = static_cast<std::uint8_t>(code + kFoundOffset);
        cv::imwrite((to / numbered("mask_", i)).string(), mask);
    }
}

} // namespace

void write_perfect_run(const Truth &truth, const fs::path &dir)
{
    fs::create_directories(dir / "model");
    write_link_files(truth, dir);
    write_model(truth, dir);
    write_ground(truth, dir);
    write_sequence(truth, dir);
}

} // namespace outcrop::eval
