// SPDX-License-Identifier: BSD-3-Clause
// Reading body poses.
#include "poses.h"

#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <stdexcept>

#include <nlohmann/json.hpp>

namespace outcrop {
namespace {

namespace fs = std::filesystem;
using json = nlohmann::json;

constexpr std::int64_t kSiteEpochUs = 1072915200000000; // as outcropd plays it
constexpr double kRadPerDegree = 0.017453292519943295;

// A pose that outcropd would take: the track is the judge.
bool is_acceptable(const oc_body_pose_t &pose)
{
    oc_pose_track_t *track = oc_pose_track_create(2, 1);
    if (!track) throw std::bad_alloc();
    const bool is_ok = oc_pose_track_add(track, &pose) == OC_OK;
    oc_pose_track_destroy(track);
    return is_ok;
}

oc_body_pose_t body_of(const oc_pose_t &cam_from_world, const oc_pose_t &body_from_optical)
{
    oc_pose_t world_from_cam, optical_from_body, world_from_body;
    oc_pose_invert(&cam_from_world, &world_from_cam);
    oc_pose_invert(&body_from_optical, &optical_from_body);
    oc_pose_compose(&world_from_cam, &optical_from_body, &world_from_body);
    oc_body_pose_t out{};
    std::memcpy(out.position_m, world_from_body.t, sizeof out.position_m);
    oc_quat_from_rotation(world_from_body.R, out.q_wxyz);
    return out;
}

void set_covariance(oc_body_pose_t *pose, double position_m, double angle_rad)
{
    pose->has_covariance = true;
    for (int i = 0; i < 6; i++) {
        const double half = i < 3 ? position_m : angle_rad;
        pose->covariance[7 * i] = half * half / 3;
    }
}

oc_pose_t pose_of(const json &view, double metres_per_unit)
{
    oc_pose_t pose;
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) pose.R[3 * i + j] = view.at("R").at(i).at(j).get<double>();
        pose.t[i] = view.at("t").at(i).get<double>() * metres_per_unit;
    }
    if (!oc_pose_is_valid(&pose)) throw std::runtime_error("\"R\" is not a rotation, or \"t\" not finite");
    return pose;
}

void add_view(PoseList *list, const json &view, std::size_t index, double metres_per_unit, const json *margins,
              const oc_pose_t &body_from_optical)
{
    oc_body_pose_t pose = body_of(pose_of(view, metres_per_unit), body_from_optical);
    pose.utime_us = view.value("utime", kSiteEpochUs + static_cast<std::int64_t>(index) * 1000000);
    if (margins)
        set_covariance(&pose, margins->at("position").get<double>() * metres_per_unit,
                       margins->at("angle_deg").get<double>() * kRadPerDegree);
    if (!list->poses.empty() && pose.utime_us <= list->poses.back().utime_us)
        throw std::runtime_error("\"utime\" does not ascend");
    list->poses.push_back(pose);
    list->by_view[view.value("index", static_cast<int>(index))] = pose;
}

PoseList poses_of(const json &root, const oc_pose_t &body_from_optical)
{
    const std::string units = root.at("units").get<std::string>();
    if (units != "m" && units != "mm") throw std::runtime_error("\"units\" must be \"mm\" or \"m\"");
    const double metres_per_unit = units == "m" ? 1 : 1e-3;
    const auto margins = root.find("margins");
    PoseList list;
    std::size_t index = 0;
    for (const json &view : root.at("views")) {
        try {
            add_view(&list, view, index, metres_per_unit, margins == root.end() ? nullptr : &*margins,
                     body_from_optical);
        } catch (const std::exception &fault) {
            throw std::runtime_error("view " + std::to_string(index) + ": " + fault.what());
        }
        index++;
    }
    if (list.poses.empty()) throw std::runtime_error("has no views");
    return list;
}

std::vector<double> numbers_of(const std::string &line, std::int64_t *utime_us)
{
    std::vector<double> out;
    const char *at = line.c_str();
    for (bool is_first = true;; is_first = false) {
        char *end;
        if (is_first) {
            *utime_us = std::strtoll(at, &end, 10);
        } else {
            out.push_back(std::strtod(at, &end));
        }
        if (end == at) throw std::runtime_error("\"" + std::string(at).substr(0, 20) + "\" is not a number");
        while (std::isspace(static_cast<unsigned char>(*end))) end++;
        if (*end == '\0') return out;
        if (*end != ',') throw std::runtime_error("numbers must be divided by commas");
        at = end + 1;
    }
}

oc_body_pose_t pose_of_line(const std::string &line)
{
    oc_body_pose_t pose{};
    const std::vector<double> numbers = numbers_of(line, &pose.utime_us);
    if (numbers.size() != 7 && numbers.size() != 43)
        throw std::runtime_error("has " + std::to_string(numbers.size() + 1) +
                                 " numbers: 8 are needed, or 44 with a covariance");
    std::copy_n(numbers.begin(), 3, pose.position_m);
    std::copy_n(numbers.begin() + 3, 4, pose.q_wxyz);
    pose.has_covariance = numbers.size() == 43;
    if (pose.has_covariance) std::copy_n(numbers.begin() + 7, 36, pose.covariance);
    if (pose.utime_us < 0 || !is_acceptable(pose))
        throw std::runtime_error("is no pose: time not negative, all finite, quaternion of length 1, covariance "
                                 "symmetric and positive");
    return pose;
}

} // namespace

PoseList read_site_poses(const std::string &path, const oc_pose_t &body_from_optical)
{
    const fs::path file = fs::is_directory(path) ? fs::path(path) / "cameras.json" : fs::path(path);
    std::ifstream in(file);
    if (!in) throw std::runtime_error(file.string() + ": " + std::strerror(errno));
    try {
        return poses_of(json::parse(in), body_from_optical);
    } catch (const std::exception &fault) {
        throw std::runtime_error(file.string() + ": " + fault.what());
    }
}

PoseList read_csv_poses(const std::string &path)
{
    std::ifstream in(path);
    if (!in) throw std::runtime_error(path + ": " + std::strerror(errno));
    PoseList list;
    std::string line;
    for (int number = 1; std::getline(in, line); number++) {
        const std::size_t first = line.find_first_not_of(" \t\r");
        if (first == std::string::npos || line[first] == '#') continue;
        if (list.poses.empty() && number == 1 && std::isalpha(static_cast<unsigned char>(line[first]))) continue;
        try {
            const oc_body_pose_t pose = pose_of_line(line);
            if (!list.poses.empty() && pose.utime_us <= list.poses.back().utime_us)
                throw std::runtime_error("time does not ascend");
            list.poses.push_back(pose);
        } catch (const std::exception &fault) {
            throw std::runtime_error(path + ":" + std::to_string(number) + ": " + fault.what());
        }
    }
    if (list.poses.empty()) throw std::runtime_error(path + ": holds no pose");
    return list;
}

} // namespace outcrop
