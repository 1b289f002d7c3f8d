// SPDX-License-Identifier: BSD-3-Clause
// Paths: thesis 7.3 with its angles put right.
#include "site/path.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace outcrop {
namespace {

using json = nlohmann::json;

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180;
constexpr int kMaxSteps = 100000;

double wrapped(double angle)
{
    return std::remainder(angle, 2 * kPi);
}

// Azimuth of the motion at a waypoint: the mean direction of the legs that meet there.
double pan_along_motion(const std::vector<Waypoint> &waypoints, std::size_t i)
{
    double dx = 0, dy = 0;
    const auto add_leg = [&](const Waypoint &a, const Waypoint &b) {
        const double length = std::hypot(b.x_m - a.x_m, b.y_m - a.y_m);
        if (!(length > 0)) return;
        dx += (b.x_m - a.x_m) / length;
        dy += (b.y_m - a.y_m) / length;
    };
    if (i > 0) add_leg(waypoints[i - 1], waypoints[i]);
    if (i + 1 < waypoints.size()) add_leg(waypoints[i], waypoints[i + 1]);
    return dx == 0 && dy == 0 ? 0 : std::atan2(dx, dy);
}

void check(const std::vector<Waypoint> &waypoints, const PathOptions &o)
{
    if (waypoints.empty()) throw std::invalid_argument("a path needs at least one waypoint");
    for (const Waypoint &w : waypoints) {
        if (!(std::abs(w.x_m) < 1e6) || !(std::abs(w.y_m) < 1e6) || !std::isfinite(w.pan_rad))
            throw std::invalid_argument("a waypoint is not a finite place");
    }
    if (o.steps < 1 || o.steps > kMaxSteps) throw std::invalid_argument("\"steps\" is not within 1..100000");
    if (!(o.height_m > 0 && o.height_m < 1e4)) throw std::invalid_argument("\"height_m\" is not positive");
    if (!(o.tilt_rad >= 0 && o.tilt_rad < kPi)) throw std::invalid_argument("\"tilt_deg\" is not within 0..180");
    if (!std::isfinite(o.swing_rad)) throw std::invalid_argument("\"swing_deg\" is not a number");
    if (!(o.hfov_rad > 0.01 && o.hfov_rad < 3)) throw std::invalid_argument("\"hfov_deg\" is not within 1..170");
    const auto is_side = [](unsigned side) { return side >= OC_MIN_IMAGE_SIDE && side <= OC_MAX_IMAGE_SIDE; };
    if (!is_side(o.width_px) || !is_side(o.height_px))
        throw std::invalid_argument("\"width\" or \"height\" is not within 32..4096");
}

oc_camera_t camera_at(double x_m, double y_m, double pan_rad, const PathOptions &o)
{
    oc_camera_t camera{};
    camera.k.width_px = o.width_px;
    camera.k.height_px = o.height_px;
    camera.k.fx_px = camera.k.fy_px = 0.5 * o.width_px / std::tan(0.5 * o.hfov_rad);
    camera.k.cx_px = 0.5 * (o.width_px - 1);
    camera.k.cy_px = 0.5 * (o.height_px - 1);
    double R[9];
    oc_thesis_from_pts(pan_rad, o.tilt_rad, o.swing_rad, R);
    oc_cv_from_thesis(R, R);
    const double centre[3] = {x_m, y_m, o.height_m};
    oc_pose_from_centre(R, centre, &camera.pose);
    return camera;
}

// Values of an object, with faults that name the key.
double number(const json &object, const std::string &key)
{
    if (!object.is_object() || !object.contains(key)) throw std::runtime_error("\"" + key + "\" is missing");
    if (!object[key].is_number()) throw std::runtime_error("\"" + key + "\" is not a number");
    return object[key].get<double>();
}

double number_or(const json &object, const std::string &key, double otherwise)
{
    return object.contains(key) ? number(object, key) : otherwise;
}

// Whole and within 0..1e6; narrower ranges are checked where they mean something.
int whole(const json &object, const std::string &key)
{
    const double value = number(object, key);
    if (!(value >= 0 && value <= 1e6) || value != std::floor(value))
        throw std::runtime_error("\"" + key + "\" is not a whole number within 0..1000000");
    return static_cast<int>(value);
}

int whole_or(const json &object, const std::string &key, int otherwise)
{
    return object.contains(key) ? whole(object, key) : otherwise;
}

void read_numbers(const json &list, const std::string &key, std::size_t n, double *out)
{
    if (!list.is_array() || list.size() != n) throw std::runtime_error("\"" + key + "\" has not the right size");
    for (std::size_t i = 0; i < n; i++) {
        if (!list[i].is_number()) throw std::runtime_error("\"" + key + "\" holds what is not a number");
        out[i] = list[i].get<double>();
    }
}

const json &list_of(const json &root, const std::string &key)
{
    const json &list = root.at(key);
    if (!list.is_array()) throw std::runtime_error("\"" + key + "\" is not a list");
    return list;
}

oc_camera_t read_camera(const json &frame, double metres_per_unit)
{
    oc_camera_t camera{};
    camera.k.width_px = static_cast<std::uint32_t>(whole(frame, "width"));
    camera.k.height_px = static_cast<std::uint32_t>(whole(frame, "height"));
    camera.k.fx_px = number(frame, "fx");
    camera.k.fy_px = number(frame, "fy");
    camera.k.cx_px = number(frame, "cx");
    camera.k.cy_px = number(frame, "cy");
    if (!frame.contains("R") || !frame["R"].is_array() || frame["R"].size() != 3)
        throw std::runtime_error("\"R\" has not the right size");
    for (std::size_t row = 0; row < 3; row++) read_numbers(frame["R"][row], "R", 3, camera.pose.R + 3 * row);
    read_numbers(frame.value("t", json()), "t", 3, camera.pose.t);
    for (double &t : camera.pose.t) t *= metres_per_unit;
    if (!oc_intrinsics_is_valid(&camera.k))
        throw std::runtime_error("\"fx\", \"fy\", \"cx\", \"cy\", \"width\" or \"height\" is out of range");
    if (!oc_pose_is_valid(&camera.pose)) throw std::runtime_error("\"R\" is not a rotation or \"t\" is out of range");
    double centre[3];
    oc_pose_centre(&camera.pose, centre);
    if (!(centre[2] > 0)) throw std::runtime_error("\"R\" and \"t\" put the camera on or under the ground");
    return camera;
}

Path read_frames(const json &root)
{
    const json units = root.value("units", json("m"));
    if (units != "m" && units != "mm") throw std::runtime_error("\"units\" must be \"mm\" or \"m\"");
    Path path;
    for (const json &frame : list_of(root, "frames")) {
        try {
            path.frames.push_back(read_camera(frame, units == "mm" ? 1e-3 : 1));
        } catch (const std::exception &fault) {
            throw std::runtime_error("frame " + std::to_string(path.frames.size()) + ": " + fault.what());
        }
    }
    if (path.frames.empty() || path.frames.size() > kMaxSteps)
        throw std::runtime_error("\"frames\" must hold 1 to 100000 frames");
    return path;
}

Path read_waypoints(const json &root)
{
    std::vector<Waypoint> waypoints;
    for (const json &item : list_of(root, "waypoints")) {
        try {
            Waypoint w;
            w.x_m = number(item, "x");
            w.y_m = number(item, "y");
            w.has_pan = item.contains("pan_deg");
            if (w.has_pan) w.pan_rad = number(item, "pan_deg") * kDegree;
            waypoints.push_back(w);
        } catch (const std::exception &fault) {
            throw std::runtime_error("waypoint " + std::to_string(waypoints.size()) + ": " + fault.what());
        }
    }
    PathOptions o;
    o.steps = whole_or(root, "steps", o.steps);
    o.height_m = number_or(root, "height_m", o.height_m);
    o.tilt_rad = number_or(root, "tilt_deg", 60.0) * kDegree;
    o.swing_rad = number_or(root, "swing_deg", 0.0) * kDegree;
    o.hfov_rad = number_or(root, "hfov_deg", 60.0) * kDegree;
    o.width_px = static_cast<unsigned>(whole_or(root, "width", static_cast<int>(o.width_px)));
    o.height_px = static_cast<unsigned>(whole_or(root, "height", static_cast<int>(o.height_px)));
    return plan_path(waypoints, o);
}

} // namespace

Path plan_path(const std::vector<Waypoint> &waypoints, const PathOptions &options)
{
    check(waypoints, options);
    std::vector<double> way{0}, pan;
    for (std::size_t i = 0; i < waypoints.size(); i++) {
        if (i > 0)
            way.push_back(way.back() +
                          std::hypot(waypoints[i].x_m - waypoints[i - 1].x_m, waypoints[i].y_m - waypoints[i - 1].y_m));
        pan.push_back(waypoints[i].has_pan ? waypoints[i].pan_rad : pan_along_motion(waypoints, i));
    }
    Path path;
    std::size_t leg = 0;
    for (int step = 0; step < options.steps; step++) {
        const double s = options.steps == 1 ? 0 : way.back() * step / (options.steps - 1);
        while (leg + 2 < way.size() && s > way[leg + 1]) leg++;
        const std::size_t next = std::min(leg + 1, waypoints.size() - 1);
        const double length = way[next] - way[leg];
        const double t = length > 0 ? std::clamp((s - way[leg]) / length, 0.0, 1.0) : 0;
        const Waypoint &a = waypoints[leg], &b = waypoints[next];
        const double azimuth = pan[leg] + t * wrapped(pan[next] - pan[leg]);
        path.frames.push_back(camera_at(a.x_m + t * (b.x_m - a.x_m), a.y_m + t * (b.y_m - a.y_m), azimuth, options));
    }
    return path;
}

Path read_path(const std::string &file)
{
    std::ifstream in(file);
    if (!in) throw std::runtime_error(file + ": cannot be read");
    try {
        const json root = json::parse(in, nullptr, false);
        if (!root.is_object()) throw std::runtime_error("is not a JSON object");
        if (root.contains("frames")) return read_frames(root);
        if (root.contains("waypoints")) return read_waypoints(root);
        throw std::runtime_error("has neither \"frames\" nor \"waypoints\"");
    } catch (const std::exception &fault) {
        throw std::runtime_error(file + ": " + fault.what());
    }
}

Path loop_path(const SiteModel &model, int steps)
{
    const Area &area = model.area;
    Eigen::Vector2d low(0.5 * (area.x_min + area.x_max), 0.5 * (area.y_min + area.y_max)), high = low;
    double z_max = 0.25 * std::min(area.x_max - area.x_min, area.y_max - area.y_min);
    if (!model.obstacles.empty()) {
        low.setConstant(1e9);
        high.setConstant(-1e9);
        z_max = 0;
        for (const Obstacle &obstacle : model.obstacles) {
            low = low.cwiseMin(obstacle.aabb_min.head<2>());
            high = high.cwiseMax(obstacle.aabb_max.head<2>());
            z_max = std::max(z_max, obstacle.aabb_max.z());
        }
    }
    const Eigen::Vector2d centre = 0.5 * (low + high);
    const double radius = 0.5 * (high - low).norm() + 1.5 * z_max + 1e-3;
    PathOptions options;
    options.steps = 1;
    options.height_m = 0.8 * radius;
    options.tilt_rad = std::atan2(radius, options.height_m - 0.3 * z_max);
    Path path;
    for (int i = 0; i < steps; i++) {
        const double azimuth = 2 * kPi * i / steps; // of the place as seen from the centre, clockwise from +Y
        Waypoint w;
        w.x_m = centre.x() + radius * std::sin(azimuth);
        w.y_m = centre.y() + radius * std::cos(azimuth);
        w.has_pan = true;
        w.pan_rad = azimuth + kPi;
        path.frames.push_back(plan_path({w}, options).frames.front());
    }
    return path;
}

} // namespace outcrop
