// SPDX-License-Identifier: BSD-3-Clause
// A made-up site without images: the thesis' eight cameras (table 7.3), corners on the ground and on boxes.
#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <Eigen/Core>

#include "core/camera.h"
#include "site/site_model.h"
#include "site/triangulate.h"
#include "site/view.h"

namespace outcrop::synthetic {

inline constexpr double kDegree = 3.14159265358979323846 / 180;

// X, Y, Z in millimetres, omega, phi, kappa in degrees.
inline constexpr double kTable73[8][6] = {{-386.8721, 91.3538, 761.427, 2.5962, -30.9155, -83.5224},
                                          {83.8084, -317.5293, 763.2127, 30.5821, -0.6745, 0.3239},
                                          {351.8765, -349.7548, 749.8407, 29.6836, 12.3346, 21.088},
                                          {509.2151, -238.66, 742.8595, 24.9641, 23.0747, 40.9618},
                                          {620.7139, 77.2922, 742.3834, 7.5144, 32.0715, 82.2833},
                                          {577.4111, 422.39, 753.2084, -15.2744, 28.9333, 125.6392},
                                          {170.9942, 657.6221, 752.5581, -31.5844, -7.1256, -165.1466},
                                          {-220.2339, 531.4125, 755.2014, -21.567, -22.6891, -130.9459}};

inline oc_camera_t thesis_camera(int index)
{
    const double *row = kTable73[index];
    oc_camera_t camera{};
    camera.k = oc_intrinsics_from_format(3.6, 3.5311, 2.7446, 640, 480);
    oc_pose6_t six;
    for (int i = 0; i < 3; ++i) six.v[i] = row[i] * 1e-3, six.v[i + 3] = row[i + 3] * kDegree;
    oc_pose_from_6(&six, &camera.pose);
    return camera;
}

// Moves every parameter by a uniform error of at most the margin.
inline oc_camera_t disturbed(const oc_camera_t &camera, const oc_margin_t &margin, std::mt19937 *rng)
{
    std::uniform_real_distribution<double> uniform(-1, 1);
    oc_pose6_t six;
    oc_pose_to_6(&camera.pose, &six);
    for (int i = 0; i < 6; ++i) six.v[i] += uniform(*rng) * margin.v[i];
    oc_camera_t result = camera;
    oc_pose_from_6(&six, &result.pose);
    return result;
}

inline oc_margin_t margin_of(double position_m, double angle_rad)
{
    return {{position_m, position_m, position_m, angle_rad, angle_rad, angle_rad}};
}

struct Corner {
    Eigen::Vector3d position;
    bool is_ground = false;
    int object = -1;
};

struct Scene {
    std::vector<oc_camera_t> truth;
    std::vector<Corner> corners;
    std::vector<View> views; // junction k of a view is the corner shown[view][k]
    std::vector<std::vector<int>> shown;
};

// Views with disturbed poses and noisy junctions; each is shown only where it falls into the image.
inline Scene make_scene(const std::vector<Corner> &corners, const oc_margin_t &margin, double noise_px,
                        std::mt19937 *rng)
{
    std::normal_distribution<double> noise(0, noise_px > 0 ? noise_px : 1);
    Scene scene;
    scene.corners = corners;
    for (int v = 0; v < 8; ++v) {
        scene.truth.push_back(thesis_camera(v));
        View view;
        view.id = 10 + 3 * v;
        view.camera = disturbed(scene.truth.back(), margin, rng);
        view.margin = margin;
        scene.shown.emplace_back();
        for (std::size_t i = 0; i < corners.size(); ++i) {
            double x, y;
            if (!(oc_camera_project(&scene.truth.back(), corners[i].position.data(), &x, &y) > 0)) continue;
            if (noise_px > 0) x += noise(*rng), y += noise(*rng);
            if (x < 0 || y < 0 || x > 639 || y > 479) continue;
            oc_junction_t junction{};
            junction.x_px = static_cast<float>(x), junction.y_px = static_cast<float>(y);
            view.junctions.push_back(junction);
            scene.shown.back().push_back(static_cast<int>(i));
        }
        scene.views.push_back(view);
    }
    return scene;
}

// Matches of neighbouring views (one and two steps round the circle); a share of them is wrong: the right junction of
// another corner, not farther than reach_px.
inline std::vector<PairMatches> make_matches(const Scene &scene, double wrong_share, double reach_px, std::mt19937 *rng)
{
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<PairMatches> pairs;
    const int n = static_cast<int>(scene.views.size());
    for (int step = 1; step <= 2; ++step) {
        for (int a = 0; a < n; ++a) {
            const int left = std::min(a, (a + step) % n), right = std::max(a, (a + step) % n);
            const auto &l = scene.shown[static_cast<std::size_t>(left)];
            const auto &r = scene.shown[static_cast<std::size_t>(right)];
            PairMatches pair;
            pair.left = scene.views[static_cast<std::size_t>(left)].id;
            pair.right = scene.views[static_cast<std::size_t>(right)].id;
            for (std::size_t i = 0; i < l.size(); ++i) {
                const auto found = std::find(r.begin(), r.end(), l[i]);
                if (found == r.end()) continue;
                Match match;
                match.left_junction = static_cast<int>(i);
                match.right_junction = static_cast<int>(found - r.begin());
                match.kind =
                    scene.corners[static_cast<std::size_t>(l[i])].is_ground ? MatchKind::kGround : MatchKind::kObstacle;
                match.score = 0.8 + 0.2 * uniform(*rng);
                if (uniform(*rng) < wrong_share) {
                    const auto &junctions = scene.views[static_cast<std::size_t>(right)].junctions;
                    const oc_junction_t &good = junctions[static_cast<std::size_t>(match.right_junction)];
                    std::vector<int> near;
                    for (std::size_t k = 0; k < junctions.size(); ++k)
                        if (static_cast<int>(k) != match.right_junction &&
                            std::hypot(static_cast<double>(junctions[k].x_px - good.x_px),
                                       static_cast<double>(junctions[k].y_px - good.y_px)) < reach_px)
                            near.push_back(static_cast<int>(k));
                    const double pick = uniform(*rng) * 0.999999 * static_cast<double>(near.size());
                    if (!near.empty()) match.right_junction = near[static_cast<std::size_t>(pick)];
                }
                pair.matches.push_back(match);
            }
            pairs.push_back(pair);
        }
    }
    return pairs;
}

inline std::vector<Corner> random_corners(int n_ground, int n_obstacle, std::mt19937 *rng)
{
    std::uniform_real_distribution<double> uniform(0, 1);
    std::vector<Corner> corners;
    for (int i = 0; i < n_ground; ++i)
        corners.push_back({{-0.15 + 0.6 * uniform(*rng), -0.2 + 0.65 * uniform(*rng), 0}, true, -1});
    for (int i = 0; i < n_obstacle; ++i)
        corners.push_back(
            {{-0.05 + 0.4 * uniform(*rng), -0.1 + 0.5 * uniform(*rng), 0.02 + 0.18 * uniform(*rng)}, false, -1});
    return corners;
}

} // namespace outcrop::synthetic
