// SPDX-License-Identifier: BSD-3-Clause
// A site's truth as the carving sees it.
#include "scene.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "eval/image_file.h"

namespace outcrop::bench {
namespace {

namespace fs = std::filesystem;

oc_camera_t camera_of(const eval::Camera &from)
{
    oc_camera_t to{};
    to.k = {from.fx,
            from.fy,
            from.cx,
            from.cy,
            static_cast<std::uint32_t>(from.width),
            static_cast<std::uint32_t>(from.height)};
    for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) to.pose.R[3 * r + c] = from.rotation_cam_from_world(r, c);
        to.pose.t[r] = from.translation_m[r];
    }
    return to;
}

cv::Mat1b labels_of(const cv::Mat &mask, int obstacle)
{
    cv::Mat1b table(1, 256, static_cast<uchar>(OC_LABEL_UNKNOWN));
    for (int code = 0; code < 256; ++code)
        if (!eval::is_obstacle_code(code)) table(code) = OC_LABEL_GROUND;
    table(obstacle) = OC_LABEL_OBSTACLE;
    cv::Mat1b labels;
    cv::LUT(mask, table, labels);
    return labels;
}

Eigen::Vector3d vector_of(const nlohmann::json &node)
{
    return {node.at(0).get<double>(), node.at(1).get<double>(), node.at(2).get<double>()};
}

// Our own points.ply: binary, x y z float, red green blue uchar, obstacle int.
std::vector<SitePoint> read_points(const fs::path &file)
{
    std::ifstream in(file, std::ios::binary);
    const std::string bytes((std::istreambuf_iterator<char>(in)), {});
    const std::string mark = "end_header\n";
    const std::size_t start = bytes.find(mark);
    if (start == std::string::npos) throw std::runtime_error(file.string() + ": no PLY header");
    constexpr std::size_t kRecord = 3 * sizeof(float) + 3 + sizeof(int);
    std::vector<SitePoint> points;
    for (std::size_t at = start + mark.size(); at + kRecord <= bytes.size(); at += kRecord) {
        float xyz[3];
        std::memcpy(xyz, &bytes[at], sizeof xyz);
        SitePoint p;
        p.position = Eigen::Vector3f(xyz[0], xyz[1], xyz[2]).cast<double>();
        std::memcpy(&p.obstacle, &bytes[at + sizeof xyz + 3], sizeof p.obstacle);
        points.push_back(p);
    }
    return points;
}

} // namespace

std::vector<CarveView> views_of(const eval::Truth &truth, int obstacle, bool with_colour, const std::string &images)
{
    std::vector<CarveView> views;
    for (std::size_t i = 0; i < truth.views.size(); ++i) {
        if (!truth.depth[i]) continue;
        CarveView view;
        view.id = static_cast<int>(i);
        view.camera = camera_of(truth.views[i]);
        const cv::Mat &mask = truth.depth[i]->mask;
        view.labels = labels_of(mask, obstacle);
        if (with_colour) {
            const auto file = eval::find_image(truth.dir / images / fs::path(truth.views[i].image).filename());
            if (!file) throw std::runtime_error("no image of view " + std::to_string(i));
            cv::cvtColor(eval::read_image(*file, cv::IMREAD_COLOR), view.rgb, cv::COLOR_BGR2RGB);
            view.known = cv::Mat1b(mask.size(), 255);
        }
        views.push_back(view);
    }
    return views;
}

std::vector<PointBox> read_boxes(const fs::path &run)
{
    std::ifstream in(run / "model/obstacles.json");
    const nlohmann::json root = nlohmann::json::parse(in);
    const std::vector<SitePoint> points = read_points(run / "model/points.ply");
    std::vector<PointBox> out;
    for (const nlohmann::json &node : root.at("obstacles")) {
        PointBox b;
        b.box.index = node.at("index").get<int>();
        b.box.aabb_min = vector_of(node.at("aabb_min"));
        b.box.aabb_max = vector_of(node.at("aabb_max"));
        b.box.obb_centre = vector_of(node.at("obb").at("centre"));
        b.box.obb_size = vector_of(node.at("obb").at("size"));
        b.box.yaw_rad = node.at("obb").at("yaw_deg").get<double>() * M_PI / 180;
        for (const SitePoint &p : points)
            if (p.obstacle == static_cast<int>(out.size())) b.points.push_back(p);
        out.push_back(b);
    }
    return out;
}

Obstacle true_box(const eval::TrueObstacle &truth)
{
    Obstacle box;
    box.index = truth.index;
    box.aabb_min = truth.aabb.min_m;
    box.aabb_max = truth.aabb.max_m;
    box.obb_centre = truth.obb.centre_m;
    box.obb_size = truth.obb.size_m;
    box.yaw_rad = truth.obb.yaw_rad;
    return box;
}

double voxel_iou(const Voxels &voxels, const eval::TrueObstacle &truth)
{
    const VoxelGrid &g = voxels.grid;
    // The same cells, continued as far as the truth reaches.
    const Eigen::Vector3i before = ((g.low - truth.aabb.min_m) / g.cell_m).array().ceil().cwiseMax(0.0).cast<int>();
    const Eigen::Vector3i after = ((truth.aabb.max_m - g.high()) / g.cell_m).array().ceil().cwiseMax(0.0).cast<int>();
    eval::Lattice lattice{g.centre(0, 0, 0) - before.cast<double>() * g.cell_m, g.cell_m, g.nx + before.x() + after.x(),
                          g.ny + before.y() + after.y(), g.nz + before.z() + after.z()};
    const std::vector<std::uint8_t> inside = eval::occupancy(truth.mesh, lattice);
    std::size_t common = 0, whole = 0;
    for (int k = 0; k < lattice.nz; ++k)
        for (int j = 0; j < lattice.ny; ++j)
            for (int i = 0; i < lattice.nx; ++i) {
                const bool a = inside[lattice.index(i, j, k)] != 0;
                const bool b = voxels.is_occupied(i - before.x(), j - before.y(), k - before.z());
                common += a && b;
                whole += a || b;
            }
    return whole > 0 ? static_cast<double>(common) / static_cast<double>(whole) : 0;
}

} // namespace outcrop::bench
