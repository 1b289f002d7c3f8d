/* SPDX-License-Identifier: BSD-3-Clause
 * What a run wrote into its DIR (docs/operating.md, section 6). */
#ifndef OUTCROP_EVAL_RUN_H
#define OUTCROP_EVAL_RUN_H

#include "camera.h"
#include "error.h"
#include "geometry.h"
#include "json_file.h"

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace outcrop::eval {

struct FoundObstacle {
    int index = 0;
    Box aabb;
    YawBox obb;
    std::optional<double> voxel_size_m;
};

enum class Label { kUnknown, kGround, kObstacle };

struct FoundMatch {
    std::size_t left_view = 0, right_view = 0; /* in the site's cameras.json */
    Eigen::Vector2d left_px, right_px;
    Label kind = Label::kObstacle;
};

struct FoundJunction {
    Eigen::Vector2d px;
    Label label = Label::kUnknown;
    std::optional<std::size_t> reference_view; /* whose comparison decided the label */
};

struct ViewJunctions {
    std::size_t view = 0; /* in the site's cameras.json */
    std::vector<FoundJunction> junctions;
};

/* The ground map: CV_8U codes, row 0 at y_max. */
struct GroundMap {
    cv::Mat codes;
    double metres_per_pixel = 0, x_min_m = 0, y_max_m = 0;
    int free = 0, obstacle = 0, suspected = 0, unseen = 0;
};

struct Run {
    std::filesystem::path dir;
    std::optional<std::vector<FoundObstacle>> obstacles;
    std::optional<std::vector<FoundMatch>> matches;
    std::optional<std::vector<ViewJunctions>> junctions;
    std::optional<std::vector<Camera>> cameras;
    std::optional<GroundMap> ground;
    std::optional<Json> bytes;          /* report.json's object as it stands */
    std::vector<std::string> sequences; /* names under sequence/, sorted */
};

/* Reads a run's DIR against a site of `n_views` views. What is absent stays
 * empty and is noted; EvalError for a file that is there and ill-formed, or
 * when DIR is no folder.
 *
 * vehicle/junctions.json: {"views":[{"view":i, "junctions":[{"x","y","label":
 * "ground"|"obstacle"|"unknown","reference"?:view, ...}]}]}. */
Run read_run(const std::filesystem::path &dir, std::size_t n_views, Notes &notes);

} // namespace outcrop::eval
#endif
