// SPDX-License-Identifier: BSD-3-Clause
// Blocks of voxels against labels.
#include "site/carve_hull.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace outcrop {
namespace {

constexpr int kBlock = 8;           // voxels a side
constexpr double kNearDepth = 1e-6; // metres; nothing nearer has a pixel
constexpr double kRectSlack_px = 1e-6;

struct Block {
    int i0, j0, k0, ni, nj, nk;
};

// The votes of one block's voxels.
struct Votes {
    std::array<std::uint16_t, kBlock * kBlock * kBlock> ground, obstacle;
};

void add_to(std::array<std::uint16_t, kBlock * kBlock * kBlock> *votes)
{
    for (std::uint16_t &n : *votes) ++n;
}

void vote_each(const VoxelGrid &grid, const Block &b, const LabelView &view, Votes *votes)
{
    std::uint8_t row[kBlock];
    for (int k = 0; k < b.nk; ++k)
        for (int j = 0; j < b.nj; ++j) {
            view.labels_of_row(grid.centre(b.i0, b.j0 + j, b.k0 + k), grid.cell_m, b.ni, row);
            const std::size_t at = static_cast<std::size_t>(kBlock * (j + kBlock * k));
            for (std::size_t i = 0; i < static_cast<std::size_t>(b.ni); ++i) {
                votes->ground[at + i] = static_cast<std::uint16_t>(votes->ground[at + i] + (row[i] == OC_LABEL_GROUND));
                votes->obstacle[at + i] =
                    static_cast<std::uint16_t>(votes->obstacle[at + i] + (row[i] == OC_LABEL_OBSTACLE));
            }
        }
}

// A block whose voxels are all free already needs no further view.
bool is_all_free(const Block &b, const Votes &votes, int tolerated_misses)
{
    for (int k = 0; k < b.nk; ++k)
        for (int j = 0; j < b.nj; ++j)
            for (int i = 0; i < b.ni; ++i)
                if (votes.ground[static_cast<std::size_t>(i + kBlock * (j + kBlock * k))] <= tolerated_misses)
                    return false;
    return true;
}

void carve_block(const VoxelGrid &grid, const Block &b, const std::vector<LabelView> &views, int tolerated_misses,
                 int min_views, std::vector<VoxelState> *states)
{
    Votes votes{};
    const Eigen::Vector3d first = grid.centre(b.i0, b.j0, b.k0);
    const Eigen::Vector3d last = grid.centre(b.i0 + b.ni - 1, b.j0 + b.nj - 1, b.k0 + b.nk - 1);
    std::vector<const LabelView *> mixed;
    int n_ground = 0;
    for (const LabelView &view : views) {
        const int label = view.label_of_box(first, last);
        if (label < 0) mixed.push_back(&view);
        if (label == OC_LABEL_GROUND) ++n_ground, add_to(&votes.ground);
        if (label == OC_LABEL_OBSTACLE) add_to(&votes.obstacle);
        if (n_ground > tolerated_misses) break;
    }
    for (const LabelView *view : mixed) {
        if (n_ground > tolerated_misses) break;
        vote_each(grid, b, *view, &votes);
        if (is_all_free(b, votes, tolerated_misses)) break;
    }
    for (int k = 0; k < b.nk; ++k)
        for (int j = 0; j < b.nj; ++j)
            for (int i = 0; i < b.ni; ++i) {
                const std::size_t at = static_cast<std::size_t>(i + kBlock * (j + kBlock * k));
                VoxelState state = VoxelState::kUnknown;
                if (votes.ground[at] > tolerated_misses)
                    state = VoxelState::kFree;
                else if (votes.obstacle[at] >= min_views)
                    state = VoxelState::kOccupied;
                (*states)[grid.at(b.i0 + i, b.j0 + j, b.k0 + k)] = state;
            }
}

} // namespace

LabelView::LabelView(const CarveView &view) : id_(view.id), labels_(view.labels)
{
    oc_camera_matrix(&view.camera, projection_);
    cv::integral((labels_ == OC_LABEL_GROUND) / 255, ground_, CV_32S);
    cv::integral((labels_ == OC_LABEL_OBSTACLE) / 255, obstacle_, CV_32S);
    says_anything_ =
        !labels_.empty() && ground_(labels_.rows, labels_.cols) + obstacle_(labels_.rows, labels_.cols) > 0;
}

int LabelView::count(const cv::Mat1i &sums, int x0, int y0, int x1, int y1) const
{
    return sums(y1 + 1, x1 + 1) - sums(y0, x1 + 1) - sums(y1 + 1, x0) + sums(y0, x0);
}

void LabelView::labels_of_row(const Eigen::Vector3d &p, double step, int n, std::uint8_t *labels) const
{
    const double *m = projection_;
    const double x = m[0] * p.x() + m[1] * p.y() + m[2] * p.z() + m[3];
    const double y = m[4] * p.x() + m[5] * p.y() + m[6] * p.z() + m[7];
    const double w = m[8] * p.x() + m[9] * p.y() + m[10] * p.z() + m[11];
    const double dx = m[0] * step, dy = m[4] * step, dw = m[8] * step;
    const double width = labels_.cols, height = labels_.rows;
    for (int i = 0; i < n; ++i) {
        const double wi = w + i * dw;
        const double inverse = 1 / wi;
        const double u = (x + i * dx) * inverse + 0.5, v = (y + i * dy) * inverse + 0.5;
        const bool is_inside = wi > kNearDepth && u >= 0 && v >= 0 && u < width && v < height;
        labels[i] =
            is_inside ? labels_(static_cast<int>(v), static_cast<int>(u)) : static_cast<std::uint8_t>(OC_LABEL_UNKNOWN);
    }
}

int LabelView::label_at(const Eigen::Vector3d &p) const
{
    std::uint8_t label;
    labels_of_row(p, 0, 1, &label);
    return label;
}

int LabelView::label_of_box(const Eigen::Vector3d &low, const Eigen::Vector3d &high) const
{
    double u0 = INFINITY, u1 = -INFINITY, v0 = INFINITY, v1 = -INFINITY;
    int n_behind = 0;
    for (int corner = 0; corner < 8; ++corner) {
        const Eigen::Vector3d p((corner & 1 ? high : low).x(), (corner & 2 ? high : low).y(),
                                (corner & 4 ? high : low).z());
        const double *m = projection_;
        const double w = m[8] * p.x() + m[9] * p.y() + m[10] * p.z() + m[11];
        if (!(w > 2 * kNearDepth)) {
            n_behind += w <= 0;
            if (n_behind < corner + 1) return -1;
            continue;
        }
        if (n_behind > 0) return -1;
        const double u = (m[0] * p.x() + m[1] * p.y() + m[2] * p.z() + m[3]) / w + 0.5;
        const double v = (m[4] * p.x() + m[5] * p.y() + m[6] * p.z() + m[7]) / w + 0.5;
        u0 = std::min(u0, u), u1 = std::max(u1, u), v0 = std::min(v0, v), v1 = std::max(v1, v);
    }
    const double width = labels_.cols, height = labels_.rows;
    u0 -= kRectSlack_px, v0 -= kRectSlack_px, u1 += kRectSlack_px, v1 += kRectSlack_px;
    if (n_behind == 8 || u1 < 0 || v1 < 0 || u0 >= width || v0 >= height) return OC_LABEL_UNKNOWN;
    const bool is_inside = u0 >= 0 && v0 >= 0 && u1 < width && v1 < height;
    const int x0 = static_cast<int>(std::max(u0, 0.0)), x1 = static_cast<int>(std::min(u1, width - 1));
    const int y0 = static_cast<int>(std::max(v0, 0.0)), y1 = static_cast<int>(std::min(v1, height - 1));
    const int n = (x1 - x0 + 1) * (y1 - y0 + 1);
    const int n_ground = count(ground_, x0, y0, x1, y1), n_obstacle = count(obstacle_, x0, y0, x1, y1);
    if (n_ground == 0 && n_obstacle == 0) return OC_LABEL_UNKNOWN;
    if (is_inside && n_ground == n) return OC_LABEL_GROUND;
    if (is_inside && n_obstacle == n) return OC_LABEL_OBSTACLE;
    return -1;
}

std::vector<VoxelState> carve_hull(const VoxelGrid &grid, const std::vector<LabelView> &views, int tolerated_misses,
                                   int min_views)
{
    std::vector<VoxelState> states(grid.size(), VoxelState::kUnknown);
    for (int k = 0; k < grid.nz; k += kBlock)
        for (int j = 0; j < grid.ny; j += kBlock)
            for (int i = 0; i < grid.nx; i += kBlock) {
                const Block block{i,
                                  j,
                                  k,
                                  std::min(kBlock, grid.nx - i),
                                  std::min(kBlock, grid.ny - j),
                                  std::min(kBlock, grid.nz - k)};
                carve_block(grid, block, views, tolerated_misses, min_views, &states);
            }
    return states;
}

std::vector<int> contradicting_views(const VoxelGrid &grid, const std::vector<LabelView> &views,
                                     const CarveOptions &options)
{
    std::vector<int> result;
    const std::size_t n_views = views.size();
    if (n_views < static_cast<std::size_t>(options.min_views_to_judge)) return result;
    // A coarse sample of the grid: who alone says ground where, and what nobody says.
    const int step = std::max(1, static_cast<int>(std::cbrt(static_cast<double>(grid.size()) / 2e4)));
    std::vector<std::size_t> alone(n_views, 0);
    std::size_t n_hull = 0;
    for (int k = step / 2; k < grid.nz; k += step)
        for (int j = step / 2; j < grid.ny; j += step)
            for (int i = step / 2; i < grid.nx; i += step) {
                int n_ground = 0, n_obstacle = 0;
                std::size_t last = 0;
                for (std::size_t v = 0; v < n_views && n_ground < 2; ++v) {
                    const int label = views[v].label_at(grid.centre(i, j, k));
                    if (label == OC_LABEL_GROUND) ++n_ground, last = v;
                    n_obstacle += label == OC_LABEL_OBSTACLE;
                }
                if (n_obstacle < std::max(2, options.min_views)) continue;
                n_hull += n_ground == 0;
                alone[last] += n_ground == 1;
            }
    for (std::size_t v = 0; v < n_views; ++v) {
        const double without = static_cast<double>(n_hull + alone[v]);
        if (alone[v] > 0 && static_cast<double>(n_hull) < options.min_kept_share * without)
            result.push_back(static_cast<int>(v));
    }
    return result;
}

} // namespace outcrop
