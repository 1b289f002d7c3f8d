// SPDX-License-Identifier: BSD-3-Clause
// What is known of a site: cameras, and the truth beside them if there is any.
#include "truth.h"

#include "image_file.h"
#include "json_file.h"
#include "npz.h"
#include "ply.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>

namespace outcrop::eval {

namespace fs = std::filesystem;

namespace {

constexpr double kVisibleShare = 0.01;

DepthMap read_depth(const fs::path &file, const Camera &view, double unit_m)
{
    DepthMap map;
    read_npz(file, "depth").convertTo(map.depth_m, CV_32F, unit_m);
    map.mask = read_npz(file, "mask");
    if (map.mask.type() != CV_8U) throw EvalError(file, "mask.npy: not uint8");
    if (map.depth_m.size() != map.mask.size() || map.mask.size() != cv::Size(view.width, view.height))
        throw EvalError(file, "size differs from the view's in cameras.json");
    return map;
}

void read_depths(Truth &truth, double unit_m, Notes &notes)
{
    truth.depth.resize(truth.views.size());
    if (!fs::is_directory(truth.dir / "depth")) {
        notes.push_back("the site has no depth/: matches, ground, hull and footprint.free_recall are null");
        return;
    }
    for (std::size_t i = 0; i < truth.views.size(); i++) {
        const fs::path file = truth.dir / "depth" / fs::path(truth.views[i].image).stem().concat(".npz");
        if (fs::exists(file))
            truth.depth[i] = read_depth(file, truth.views[i], unit_m);
        else
            notes.push_back(file.string() + " is not there: that view is left out of what needs depth");
    }
}

TrueObstacle read_obstacle(const Node &node, const fs::path &dir, double unit_m)
{
    TrueObstacle o;
    o.index = node.at("index").integer();
    if (!is_obstacle_code(o.index)) node.at("index").fail("not in 1..253");
    if (node.has("name")) o.name = node.at("name").text();
    o.aabb = {node.at("aabb_min").vector3() * unit_m, node.at("aabb_max").vector3() * unit_m};
    if (!(o.aabb.volume_m3() > 0)) node.fail("aabb_min is not below aabb_max");
    const fs::path mesh =
        dir / (node.has("mesh") ? node.at("mesh").text() : "obstacles/" + std::to_string(o.index) + ".ply");
    o.mesh = read_ply(mesh, unit_m);
    if (o.mesh.triangles.empty()) throw EvalError(mesh, "holds no faces");
    o.obb = min_area_box(o.mesh.vertices);
    return o;
}

void read_obstacles(Truth &truth, double default_unit_m, Notes &notes)
{
    const fs::path file = truth.dir / "obstacles.json";
    if (!fs::exists(file)) {
        notes.push_back("the site has no obstacles.json: boxes, voxels, hull and footprint are null");
        return;
    }
    const Json json = read_json(file);
    const Node root(file, json);
    const double unit_m = root.has("units") ? metres_per_unit(root) : default_unit_m;
    truth.obstacles.emplace();
    for (const Node &node : root.at("obstacles").items())
        truth.obstacles->push_back(read_obstacle(node, truth.dir, unit_m));
}

fs::path mask_of(const fs::path &image)
{
    std::string stem = image.stem().string();
    const std::size_t at = stem.find("frame");
    if (at == std::string::npos) return {};
    return image.parent_path() / (stem.replace(at, 5, "mask") + ".png");
}

void read_frames(Truth &truth, Notes &notes)
{
    const fs::path file = truth.dir / "path.json";
    if (!fs::exists(file)) {
        notes.push_back("the site has no path.json: sequence is null");
        return;
    }
    const Json json = read_json(file);
    if (!Node(file, json).has("frames")) {
        notes.push_back(file.string() + " lists no true frames: sequence is null");
        return;
    }
    std::vector<TrueFrame> frames;
    std::size_t index = 0;
    for (const Camera &camera : read_cameras(file, "frames").cameras) {
        const std::string listed = camera.image.empty() ? numbered("path/frame_", index) : camera.image;
        const auto image = find_image(truth.dir / listed);
        if (!image) {
            notes.push_back((truth.dir / listed).string() + " is not there: sequence is null");
            return;
        }
        const fs::path mask = mask_of(*image);
        frames.push_back({camera, *image, fs::exists(mask) ? mask : fs::path()});
        index++;
    }
    truth.frames = std::move(frames);
}

void read_overhead(Truth &truth, double default_unit_m, Notes &notes)
{
    const fs::path file = truth.dir / "overhead.json";
    const auto image = find_image(truth.dir / "overhead_shadows.png");
    if (!image || !fs::exists(file)) {
        notes.push_back("the site has no overhead_shadows.png with overhead.json: psnr_ground_db is null");
        return;
    }
    const Json json = read_json(file);
    const Node root(file, json);
    const double unit_m = root.has("units") ? metres_per_unit(root) : default_unit_m;
    TrueOverhead o;
    o.metres_per_pixel =
        root.has("mm_per_pixel") ? root.at("mm_per_pixel").number() * 1e-3 : root.at("metres_per_pixel").number();
    if (!(o.metres_per_pixel > 0)) root.fail("pixel size not positive");
    o.x_min_m = root.at("x_min").number() * unit_m;
    o.y_max_m = root.at("y_max").number() * unit_m;
    o.image = read_image(*image, cv::IMREAD_COLOR);
    truth.overhead = std::move(o);
}

} // namespace

bool Truth::has_depth() const
{
    return std::any_of(depth.begin(), depth.end(), [](const auto &d) { return d.has_value(); });
}

Truth read_truth(const fs::path &site, Notes &notes)
{
    if (!fs::is_directory(site)) throw EvalError(site, "not a site folder");
    Truth truth;
    truth.dir = site;
    const fs::path file = site / "cameras.json";
    CameraFile cameras = read_cameras(file, "views");
    const Json json = read_json(file);
    const double unit_m = metres_per_unit(Node(file, json));
    truth.views = std::move(cameras.cameras);
    truth.area = cameras.area;
    read_depths(truth, unit_m, notes);
    read_obstacles(truth, unit_m, notes);
    read_frames(truth, notes);
    read_overhead(truth, unit_m, notes);
    return truth;
}

bool is_visible(const DepthMap &map, const Projection &at)
{
    const int x = static_cast<int>(std::lround(at.pixel.x()));
    const int y = static_cast<int>(std::lround(at.pixel.y()));
    for (int v = std::max(0, y - 1); v <= std::min(map.depth_m.rows - 1, y + 1); v++) {
        for (int u = std::max(0, x - 1); u <= std::min(map.depth_m.cols - 1, x + 1); u++) {
            const double seen = static_cast<double>(map.depth_m.at<float>(v, u));
            if (seen > 0 && std::abs(at.depth_m - seen) <= kVisibleShare * seen) return true;
        }
    }
    return false;
}

} // namespace outcrop::eval
