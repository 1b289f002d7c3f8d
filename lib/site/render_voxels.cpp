// SPDX-License-Identifier: BSD-3-Clause
// A depth buffer and squares; shaded by the surface's own direction so that a grey body still has a form.
#include "site/render_voxels.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace outcrop {
namespace {

// Light from above and a little from the side, and what is left of a colour in the shade.
const Eigen::Vector3f kLight = Eigen::Vector3f(-0.35f, -0.5f, 0.8f).normalized();
constexpr float kAmbient = 0.72f;

// From where there is something to where there is nothing, over the 26 neighbours.
Eigen::Vector3f outward(const VoxelGrid &grid, int i, int j, int k)
{
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (int dk = -1; dk <= 1; dk++)
        for (int dj = -1; dj <= 1; dj++)
            for (int di = -1; di <= 1; di++)
                if (!grid.is_occupied(i + di, j + dj, k + dk)) sum += Eigen::Vector3i(di, dj, dk).cast<float>();
    const float length = sum.norm();
    return length > 0 ? Eigen::Vector3f(sum / length) : Eigen::Vector3f(0, 0, 1);
}

cv::Vec3b shaded(const cv::Vec3b &colour, const Eigen::Vector3f &normal)
{
    const float light = kAmbient + (1 - kAmbient) * std::max(0.0f, normal.dot(kLight));
    return cv::Vec3b(cv::Vec3f(colour) * light);
}

} // namespace

VoxelCloud::VoxelCloud(const std::vector<Shape> &shapes)
{
    for (const Shape &shape : shapes) {
        const VoxelGrid &grid = shape.grid;
        Body body{shape.index, static_cast<float>(grid.size_m), {}};
        for (int k = 0; k < grid.nz; k++) {
            for (int j = 0; j < grid.ny; j++) {
                for (int i = 0; i < grid.nx; i++) {
                    if (!grid.is_surface(i, j, k)) continue;
                    const cv::Vec3b colour =
                        grid.colour.empty() ? cv::Vec3b(170, 170, 170) : grid.colour[grid.index(i, j, k)];
                    body.splats.push_back({grid.centre(i, j, k).cast<float>(), shaded(colour, outward(grid, i, j, k))});
                }
            }
        }
        if (!body.splats.empty()) bodies_.push_back(std::move(body));
    }
}

bool VoxelCloud::has(int index) const
{
    return std::any_of(bodies_.begin(), bodies_.end(), [index](const Body &body) { return body.index == index; });
}

void VoxelCloud::draw(const oc_camera_t &camera, double near_m, Frame *frame) const
{
    double P[12];
    oc_camera_matrix(&camera, P);
    float p[12];
    std::copy(std::begin(P), std::end(P), std::begin(p));
    const auto fx = static_cast<float>(camera.k.fx_px), fy = static_cast<float>(camera.k.fy_px);
    const auto nearest = static_cast<float>(near_m);
    cv::Mat1f depth(frame->rgb.size(), std::numeric_limits<float>::infinity());
    for (const Body &body : bodies_) {
        // A cube seen across its diagonal is wider than its side.
        const float half_u = 0.62f * body.size_m * fx, half_v = 0.62f * body.size_m * fy;
        const auto index = static_cast<unsigned char>(std::clamp(body.index, 1, 253));
        for (const Splat &splat : body.splats) {
            const Eigen::Vector3f &a = splat.at;
            const float w = p[8] * a.x() + p[9] * a.y() + p[10] * a.z() + p[11];
            if (!(w > nearest)) continue;
            const float u = (p[0] * a.x() + p[1] * a.y() + p[2] * a.z() + p[3]) / w;
            const float v = (p[4] * a.x() + p[5] * a.y() + p[6] * a.z() + p[7]) / w;
            const float du = std::max(0.5f, half_u / w), dv = std::max(0.5f, half_v / w);
            if (!(u + du > 0 && v + dv > 0 && u - du < static_cast<float>(depth.cols) &&
                  v - dv < static_cast<float>(depth.rows)))
                continue;
            const int x0 = std::max(0, static_cast<int>(std::ceil(u - du)));
            const int x1 = std::min(depth.cols - 1, static_cast<int>(std::floor(u + du)));
            const int y0 = std::max(0, static_cast<int>(std::ceil(v - dv)));
            const int y1 = std::min(depth.rows - 1, static_cast<int>(std::floor(v + dv)));
            for (int y = y0; y <= y1; y++) {
                for (int x = x0; x <= x1; x++) {
                    if (depth(y, x) <= w) continue;
                    depth(y, x) = w;
                    frame->rgb(y, x) = splat.colour;
                    frame->mask(y, x) = index;
                }
            }
        }
    }
}

Frame render_voxels(const SiteModel &model, const VoxelCloud &voxels, const GroundTexture &ground,
                    const oc_camera_t &camera, const RenderOptions &options)
{
    SiteModel rest;
    for (const Obstacle &obstacle : model.obstacles)
        if (!voxels.has(obstacle.index)) rest.obstacles.push_back(obstacle);
    rest.suspected = model.suspected;
    Frame frame = render_boxes(rest, ground, camera, options);
    voxels.draw(camera, options.near_m, &frame);
    return frame;
}

} // namespace outcrop
