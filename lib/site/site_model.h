// SPDX-License-Identifier: BSD-3-Clause
// The settled model of a site: what the base believes after one solve. A plain value.
#pragma once

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "core/camera.h"
#include "site/view.h"

namespace outcrop {

enum class MatchKind { kObstacle, kGround };

// Two junctions of two views that are the same corner in space.
struct Match {
    int left_junction = 0, right_junction = 0; // index in View::junctions
    MatchKind kind = MatchKind::kObstacle;
    double score = 0;                                // of the correlation, or 1 - normalised SAD
    double margin = 0;                               // score minus that of the runner-up
    Eigen::Vector3d point = Eigen::Vector3d::Zero(); // metres, world
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
};

struct PairMatches {
    int left = 0, right = 0; // view ids
    std::vector<Match> matches;
};

// Refined pose of a view with its posterior standard deviations (X Y Z omega phi kappa).
struct RefinedView {
    int id = 0;
    oc_camera_t camera{};
    oc_margin_t posterior{};  // 1 sigma, metres and radians
    bool is_improved = false; // false: the data could not do better than the sensor
};

// A point of an obstacle, merged over every pair that saw it.
struct SitePoint {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();
    int n_views = 2;
    double score = 0;
    cv::Vec3b colour{200, 200, 200};
    bool is_doubtful = false; // a sign that something may stand here, but no match to build on
    int obstacle = -1;        // index in SiteModel::obstacles, -1: none, -2: suspected
};

// A bounding box standing on the ground.
struct Obstacle {
    int index = 0; // 1..
    Eigen::Vector3d aabb_min = Eigen::Vector3d::Zero(), aabb_max = Eigen::Vector3d::Zero();
    Eigen::Vector3d obb_centre = Eigen::Vector3d::Zero(),
                    obb_size = Eigen::Vector3d::Zero(); // size.x along the yaw direction
    double yaw_rad = 0;                                 // counter-clockwise from +X, (-pi/2, pi/2]
    int n_points = 0;
    bool is_suspected = false; // few points: shown, never dropped silently
    double voxel_m = 0;        // side of the voxels it was carved in; 0: points only
};

enum class Severity { kNote, kWarning, kFault };

// What the model says of itself; a fault: nothing in it may be relied on.
struct Statement {
    std::string code; // stable, for programs
    std::string text; // one sentence
    Severity severity = Severity::kNote;
};

struct SiteModel {
    std::vector<RefinedView> views; // ascending id
    std::vector<PairMatches> pairs; // ascending (left, right)
    std::vector<SitePoint> points;
    std::vector<Obstacle> obstacles; // is_suspected false
    std::vector<Obstacle> suspected;
    std::vector<Eigen::Vector2d> suspects; // places on the ground where something low may stand (suspects.h)
    std::vector<Statement> quality;        // no statement: no reservations
    Area area;
    std::map<std::string, double> counts; // for the report
    std::map<std::string, double> ms;     // time per step; not part of equality
};

} // namespace outcrop
