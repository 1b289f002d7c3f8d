// SPDX-License-Identifier: BSD-3-Clause
// What a run wrote into its DIR.
#include "run.h"

#include "image_file.h"

#include <algorithm>
#include <cmath>

namespace outcrop::eval {

namespace fs = std::filesystem;

namespace {

std::size_t view_index(const Node &node, std::size_t n_views)
{
    const int i = node.integer();
    if (i < 0 || static_cast<std::size_t>(i) >= n_views)
        node.fail("no such view (the site has " + std::to_string(n_views) + ")");
    return static_cast<std::size_t>(i);
}

Label parse_label(const Node &node)
{
    const std::string s = node.text();
    if (s == "ground") return Label::kGround;
    if (s == "obstacle") return Label::kObstacle;
    if (s == "unknown") return Label::kUnknown;
    node.fail("neither ground, obstacle nor unknown");
}

std::vector<FoundObstacle> parse_obstacles(const Node &root)
{
    const double unit_m = metres_per_unit(root);
    std::vector<FoundObstacle> out;
    for (const Node &node : root.at("obstacles").items()) {
        FoundObstacle o;
        o.index = node.at("index").integer();
        o.aabb = {node.at("aabb_min").vector3() * unit_m, node.at("aabb_max").vector3() * unit_m};
        if (!((o.aabb.max_m - o.aabb.min_m).minCoeff() >= 0)) node.fail("aabb_min is above aabb_max");
        const Node obb = node.at("obb");
        o.obb = {obb.at("centre").vector3() * unit_m, obb.at("size").vector3() * unit_m,
                 obb.at("yaw_deg").number() * M_PI / 180};
        if (!(o.obb.size_m.minCoeff() >= 0)) obb.fail("negative size");
        if (node.has("voxel_size")) {
            o.voxel_size_m = node.at("voxel_size").number() * unit_m;
            if (!(*o.voxel_size_m > 0)) node.at("voxel_size").fail("not positive");
        }
        out.push_back(o);
    }
    return out;
}

std::vector<FoundMatch> parse_matches(const Node &root, std::size_t n_views)
{
    std::vector<FoundMatch> out;
    for (const Node &pair : root.at("pairs").items()) {
        const std::size_t left = view_index(pair.at("left"), n_views);
        const std::size_t right = view_index(pair.at("right"), n_views);
        if (left == right) pair.fail("left and right are the same view");
        for (const Node &m : pair.at("matches").items())
            out.push_back({left, right, m.at("left").vector2(), m.at("right").vector2(), parse_label(m.at("kind"))});
    }
    return out;
}

std::vector<ViewJunctions> parse_junctions(const Node &root, std::size_t n_views)
{
    std::vector<ViewJunctions> out;
    for (const Node &view : root.at("views").items()) {
        ViewJunctions v;
        v.view = view_index(view.at("view"), n_views);
        for (const Node &node : view.at("junctions").items()) {
            FoundJunction j{
                {node.at("x").number(), node.at("y").number()}, parse_label(node.at("label")), std::nullopt};
            // A negative number also means that no view decided it.
            if (node.has("reference") && node.at("reference").integer() >= 0)
                j.reference_view = view_index(node.at("reference"), n_views);
            v.junctions.push_back(j);
        }
        out.push_back(std::move(v));
    }
    return out;
}

GroundMap parse_ground(const Node &root, const fs::path &image)
{
    GroundMap g;
    g.metres_per_pixel = root.at("metres_per_pixel").number();
    if (!(g.metres_per_pixel > 0)) root.at("metres_per_pixel").fail("not positive");
    g.x_min_m = root.at("x_min").number();
    g.y_max_m = root.at("y_max").number();
    const Node codes = root.at("codes");
    g.free = codes.at("free").integer();
    g.obstacle = codes.at("obstacle").integer();
    g.suspected = codes.at("suspected").integer();
    g.unseen = codes.at("unseen").integer();
    g.codes = read_codes(image);
    for (const std::uint8_t code : cv::Mat_<std::uint8_t>(g.codes))
        if (code != g.free && code != g.obstacle && code != g.suspected && code != g.unseen)
            throw EvalError(image, "code " + std::to_string(code) + " is not in ground.json");
    return g;
}

// The parsed file, or nothing and a note when it is not there.
template <typename Parse>
auto read_optional(const fs::path &file, const std::string &figures, Notes &notes, Parse parse)
    -> std::optional<decltype(parse(std::declval<Node>()))>
{
    if (!fs::exists(file)) {
        notes.push_back(file.string() + " is not there: " + figures);
        return std::nullopt;
    }
    const Json json = read_json(file);
    return parse(Node(file, json));
}

std::vector<std::string> list_sequences(const fs::path &dir)
{
    std::vector<std::string> names;
    if (!fs::is_directory(dir)) return names;
    for (const auto &entry : fs::directory_iterator(dir))
        if (entry.is_directory()) names.push_back(entry.path().filename().string());
    std::sort(names.begin(), names.end());
    return names;
}

} // namespace

Run read_run(const fs::path &dir, std::size_t n_views, Notes &notes)
{
    if (!fs::is_directory(dir)) throw EvalError(dir, "not a run's folder");
    Run run;
    run.dir = dir;
    run.obstacles = read_optional(dir / "model/obstacles.json", "boxes, missed, false, voxels and hull are null", notes,
                                  parse_obstacles);
    run.matches = read_optional(dir / "matches.json", "matches is null", notes,
                                [&](const Node &n) { return parse_matches(n, n_views); });
    run.junctions = read_optional(dir / "vehicle/junctions.json", "ground is counted from matches.json, without recall",
                                  notes, [&](const Node &n) { return parse_junctions(n, n_views); });
    const fs::path cameras = dir / "model/cameras.json";
    if (fs::exists(cameras))
        run.cameras = read_cameras(cameras, "views").cameras;
    else
        notes.push_back(cameras.string() + " is not there: poses is null");
    if (!fs::exists(dir / "model/ground.png"))
        notes.push_back((dir / "model/ground.png").string() + " is not there: footprint is null");
    else
        run.ground = read_optional(dir / "model/ground.json", "footprint is null", notes,
                                   [&](const Node &n) { return parse_ground(n, dir / "model/ground.png"); });
    run.bytes = read_optional(dir / "report.json", "bytes is null", notes, [](const Node &n) {
        if (!n.at("bytes").json().is_object()) n.at("bytes").fail("not an object");
        n.at("bytes").at("total").number();
        return n.at("bytes").json();
    });
    run.sequences = list_sequences(dir / "sequence");
    if (run.sequences.empty()) notes.push_back((dir / "sequence").string() + " holds no sequence: sequence is null");
    return run;
}

} // namespace outcrop::eval
