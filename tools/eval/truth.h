/* SPDX-License-Identifier: BSD-3-Clause
 * What is known of a site: cameras, and the truth beside them if there is any. */
#ifndef OUTCROP_EVAL_TRUTH_H
#define OUTCROP_EVAL_TRUTH_H

#include "camera.h"
#include "error.h"
#include "geometry.h"
#include "mesh.h"

#include <filesystem>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

namespace outcrop::eval {

/* Mask codes of a site (docs/operating.md, section 8). */
constexpr int kMaskGround = 0;
constexpr int kMaskLitter = 254; /* under 8 mm high: counts as ground */
constexpr int kMaskNothing = 255;

inline bool is_ground_code(int code)
{
    return code == kMaskGround || code == kMaskLitter;
}
inline bool is_obstacle_code(int code)
{
    return code > 0 && code < kMaskLitter;
}

struct TrueObstacle {
    int index = 0; /* its code in the masks */
    std::string name;
    Box aabb;
    YawBox obb; /* least ground area round the mesh's vertices */
    Mesh mesh;
};

/* Per pixel of a view: z-depth (CV_32F, metres, 0 = nothing hit) and mask (CV_8U). */
struct DepthMap {
    cv::Mat depth_m, mask;
};

/* One virtual camera of path.json and the files of what it really sees. */
struct TrueFrame {
    Camera camera;
    std::filesystem::path image, mask; /* exist; mask may be empty */
};

/* The true ground seen from above, shadows in, obstacles out: BGR, row 0 at y_max. */
struct TrueOverhead {
    cv::Mat image;
    double metres_per_pixel = 0, x_min_m = 0, y_max_m = 0;
};

struct Truth {
    std::filesystem::path dir;
    std::vector<Camera> views;
    std::optional<Area> area;
    std::vector<std::optional<DepthMap>> depth; /* one per view; all empty without depth/ */
    std::optional<std::vector<TrueObstacle>> obstacles;
    std::optional<std::vector<TrueFrame>> frames;
    std::optional<TrueOverhead> overhead;

    bool has_depth() const;
};

/* Reads a site folder. Only cameras.json must be there; truth that is absent
 * stays empty and is noted. EvalError for a file that is there and cannot be
 * used. */
Truth read_truth(const std::filesystem::path &site, Notes &notes);

/* Some true depth in the 3x3 pixels round `pixel` is within 1 % of `depth_m`:
 * the point that projects there is what that view sees. */
bool is_visible(const DepthMap &map, const Projection &at);

} // namespace outcrop::eval
#endif
