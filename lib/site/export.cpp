// SPDX-License-Identifier: BSD-3-Clause
// JSON, PLY and PNG.
#include "site/export.h"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <stdexcept>

#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

#include "site/atomic_file.h"

namespace outcrop {
namespace {

using json = nlohmann::json;

constexpr double kDegree = 3.14159265358979323846 / 180;

json vector_json(const Eigen::Vector3d &v)
{
    return {v.x(), v.y(), v.z()};
}

// JSON has no NaN and no infinity; a reader would find null.
void check_finite(const std::string &file, const json &value)
{
    if (value.is_number_float() && !std::isfinite(value.get<double>()))
        throw std::runtime_error(file + ": a number is not finite, nothing is written");
    if (!value.is_structured()) return;
    for (const json &item : value) check_finite(file, item);
}

std::string text_of(const std::string &file, const json &value)
{
    check_finite(file, value);
    return value.dump(1) + "\n";
}

json pixel_json(const std::map<int, View> &views, int id, int junction)
{
    const auto at = views.find(id);
    if (at == views.end() || junction < 0 || static_cast<std::size_t>(junction) >= at->second.junctions.size())
        throw std::runtime_error("matches.json: a match names a view or a junction that is not there");
    const View &view = at->second;
    const oc_junction_t &j = view.junctions[static_cast<std::size_t>(junction)];
    double x = j.x_px, y = j.y_px;
    if (view.has_distortion) oc_distort(&view.camera.k, &view.distortion, j.x_px, j.y_px, &x, &y);
    return {x, y};
}

json matches_json(const SiteModel &model, const std::map<int, View> &views)
{
    json pairs = json::array();
    for (const PairMatches &pair : model.pairs) {
        json matches = json::array();
        for (const Match &match : pair.matches) {
            matches.push_back({{"left", pixel_json(views, pair.left, match.left_junction)},
                               {"right", pixel_json(views, pair.right, match.right_junction)},
                               {"kind", match.kind == MatchKind::kGround ? "ground" : "obstacle"},
                               {"score", match.score},
                               {"point", vector_json(match.point)}});
        }
        pairs.push_back({{"left", pair.left}, {"right", pair.right}, {"matches", matches}});
    }
    return {{"pairs", pairs}};
}

json boxes_json(const std::vector<Obstacle> &obstacles)
{
    json out = json::array();
    for (const Obstacle &o : obstacles) {
        out.push_back({{"index", o.index},
                       {"aabb_min", vector_json(o.aabb_min)},
                       {"aabb_max", vector_json(o.aabb_max)},
                       {"obb",
                        {{"centre", vector_json(o.obb_centre)},
                         {"size", vector_json(o.obb_size)},
                         {"yaw_deg", o.yaw_rad / kDegree}}},
                       {"points", o.n_points}});
        if (o.voxel_m > 0) out.back()["voxel_size"] = o.voxel_m;
    }
    return out;
}

json quality_json(const std::vector<Statement> &quality)
{
    json out = json::array();
    for (const Statement &s : quality) {
        const char *severity = s.severity == Severity::kFault     ? "fault"
                               : s.severity == Severity::kWarning ? "warning"
                                                                  : "note";
        out.push_back({{"code", s.code}, {"text", s.text}, {"severity", severity}});
    }
    return out;
}

json camera_json(const RefinedView &view)
{
    const oc_intrinsics_t &k = view.camera.k;
    const oc_pose_t &pose = view.camera.pose;
    double centre[3];
    oc_pose_centre(&pose, centre);
    json R = json::array();
    for (int row = 0; row < 3; row++) R.push_back({pose.R[3 * row], pose.R[3 * row + 1], pose.R[3 * row + 2]});
    json posterior = json::array();
    for (const double sigma : view.posterior.v) posterior.push_back(sigma);
    return {{"index", view.id},
            {"image", "view_" + std::to_string(view.id)},
            {"width", k.width_px},
            {"height", k.height_px},
            {"fx", k.fx_px},
            {"fy", k.fy_px},
            {"cx", k.cx_px},
            {"cy", k.cy_px},
            {"R", R},
            {"t", {pose.t[0], pose.t[1], pose.t[2]}},
            {"C", {centre[0], centre[1], centre[2]}},
            {"posterior_sigma", posterior},
            {"is_improved", view.is_improved}};
}

json cameras_json(const SiteModel &model)
{
    json views = json::array();
    for (const RefinedView &view : model.views) views.push_back(camera_json(view));
    const Area &a = model.area;
    return {{"units", "m"},
            {"area", {{"x", {a.x_min, a.x_max}}, {"y", {a.y_min, a.y_max}}, {"z_max", a.z_max}}},
            {"views", views}};
}

std::string points_ply(const std::vector<SitePoint> &points)
{
    std::string out = "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(points.size()) +
                      "\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
                      "property uchar green\nproperty uchar blue\nproperty int obstacle\nend_header\n";
    for (const SitePoint &point : points) {
        if (!point.position.allFinite())
            throw std::runtime_error("model/points.ply: a point is not finite, nothing is written");
        char row[19];
        for (int i = 0; i < 3; i++) {
            const auto value = static_cast<float>(point.position[i]);
            std::memcpy(row + 4 * i, &value, 4);
            row[12 + i] = static_cast<char>(point.colour[i]);
        }
        const std::int32_t obstacle = point.obstacle;
        std::memcpy(row + 15, &obstacle, 4);
        out.append(row, sizeof row);
    }
    return out;
}

json map_json(double metres_per_pixel, double x_min, double y_max, const cv::Mat &image)
{
    return {{"metres_per_pixel", metres_per_pixel},
            {"x_min", x_min},
            {"y_max", y_max},
            {"width", image.cols},
            {"height", image.rows}};
}

void write_ground(const std::string &dir, const GroundMap &ground)
{
    write_png(dir + "/model/ground.png", ground.codes);
    json description = map_json(ground.metres_per_pixel, ground.x_min, ground.y_max, ground.codes);
    description["codes"] = {{"unseen", static_cast<int>(GroundCode::kUnseen)},
                            {"free", static_cast<int>(GroundCode::kFree)},
                            {"obstacle", static_cast<int>(GroundCode::kObstacle)},
                            {"suspected", static_cast<int>(GroundCode::kSuspected)}};
    write_whole(dir + "/model/ground.json", description.dump(1) + "\n");
}

void write_overhead(const std::string &dir, const OverheadMap &overhead)
{
    cv::Mat4b bgra(overhead.rgb.size());
    for (int y = 0; y < bgra.rows; y++) {
        for (int x = 0; x < bgra.cols; x++) {
            const cv::Vec3b &rgb = overhead.rgb(y, x);
            bgra(y, x) = cv::Vec4b(rgb[2], rgb[1], rgb[0], overhead.seen(y, x));
        }
    }
    write_png(dir + "/overhead.png", bgra);
    write_whole(dir + "/overhead.json",
                map_json(overhead.metres_per_pixel, overhead.x_min, overhead.y_max, overhead.rgb).dump(1) + "\n");
}

} // namespace

void write_model_dir(const std::string &dir, const SiteModel &model, const std::map<int, View> &views,
                     const GroundMap &ground, const OverheadMap &overhead)
{
    // All texts first: a fault in one leaves the folder as it was.
    const std::string matches = text_of(dir + "/matches.json", matches_json(model, views));
    const std::string obstacles = text_of(dir + "/model/obstacles.json", {{"units", "m"},
                                                                          {"obstacles", boxes_json(model.obstacles)},
                                                                          {"suspected", boxes_json(model.suspected)},
                                                                          {"quality", quality_json(model.quality)}});
    const std::string cameras = text_of(dir + "/model/cameras.json", cameras_json(model));
    const std::string points = points_ply(model.points);
    std::filesystem::create_directories(dir + "/model");
    write_whole(dir + "/matches.json", matches);
    write_whole(dir + "/model/obstacles.json", obstacles);
    write_whole(dir + "/model/points.ply", points);
    write_whole(dir + "/model/cameras.json", cameras);
    write_ground(dir, ground);
    write_overhead(dir, overhead);
}

} // namespace outcrop
