// SPDX-License-Identifier: BSD-3-Clause
// What is known of the ground: free, obstacle, suspected or unseen, cell by cell. Never silently free.
#include "site/ground_map.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "site/box_shadow.h"
#include "site/boxes.h"
#include "site/quality.h"
#include "site/triangulate.h"

namespace outcrop {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// A view ready to be asked about cells.
struct Eye {
    oc_camera_t camera{};
    Vector3d centre = Vector3d::Zero();
};

class Painter {
public:
    Painter(const SiteModel &model, const GroundMapOptions &options) : model_(model), options_(options)
    {
        const Area &area = model.area;
        const double longer = std::max(area.x_max - area.x_min, area.y_max - area.y_min);
        map_.metres_per_pixel = options.cell_m > 0 ? options.cell_m : longer / 400;
        map_.x_min = area.x_min;
        map_.y_max = area.y_max;
        map_.codes.create(cells(area.y_max - area.y_min), cells(area.x_max - area.x_min));
        map_.codes.setTo(static_cast<int>(GroundCode::kUnseen));
        for (const RefinedView &view : model.views) eyes_.push_back({view.camera, camera_centre(view.camera)});
        for (const RefinedView &view : model.views) {
            const auto *sigma = view.posterior.v;
            pose_sigma_ = std::max(pose_sigma_, std::max(sigma[0], sigma[1]));
        }
        blockers_ = blockers_of(model, 0);
    }

    GroundMap paint(const std::vector<Obstacle> &doubtful)
    {
        paint_free();
        paint_points();
        paint_suspects();
        for (const Obstacle &box : doubtful) paint_footprint(box, doubt(), GroundCode::kSuspected);
        paint_boxes(model_.suspected, true);
        paint_boxes(model_.obstacles, true);
        paint_boxes(model_.obstacles, false);
        return map_;
    }

private:
    int cells(double side) const
    {
        const double n = std::ceil(side / map_.metres_per_pixel - 1e-9);
        if (!(n >= 1) || !(n <= options_.max_cells_per_side))
            throw std::invalid_argument("ground map: the area and the cell size do not give 1.." +
                                        std::to_string(options_.max_cells_per_side) + " cells per side");
        return static_cast<int>(n);
    }

    Vector3d cell_centre(int row, int col) const
    {
        return {map_.x_min + (col + 0.5) * map_.metres_per_pixel, map_.y_max - (row + 0.5) * map_.metres_per_pixel, 0};
    }

    bool sees(const Eye &eye, const Vector3d &ground) const
    {
        double x, y;
        if (!(oc_camera_project(&eye.camera, ground.data(), &x, &y) > 0)) return false;
        const double border = options_.border_px;
        return x >= border && y >= border && x <= eye.camera.k.width_px - 1.0 - border &&
               y <= eye.camera.k.height_px - 1.0 - border;
    }

    void paint_free()
    {
        const GroundCode is_free = has_fault(model_) ? GroundCode::kSuspected : GroundCode::kFree;
        for (int row = 0; row < map_.codes.rows; ++row) {
            for (int col = 0; col < map_.codes.cols; ++col) {
                const Vector3d ground = cell_centre(row, col);
                int n_seen = 0;
                for (std::size_t e = 0; e < eyes_.size() && n_seen < options_.min_views; ++e)
                    n_seen += sees(eyes_[e], ground) && !is_hidden(blockers_, eyes_[e].centre, ground);
                if (n_seen >= options_.min_views) set(row, col, is_free);
            }
        }
    }

    void set(int row, int col, GroundCode code) { map_.codes(row, col) = static_cast<std::uint8_t>(code); }

    // Calls paint_cell for every cell whose centre is within `reach` of (x, y), as a square.
    template <typename PaintCell>
    void around(double x, double y, double reach, const PaintCell &paint_cell)
    {
        const double size = map_.metres_per_pixel;
        const auto clamped = [](double value, int limit) {
            return static_cast<int>(std::clamp(value, 0.0, static_cast<double>(limit)));
        };
        const int row_from = clamped(std::floor((map_.y_max - y - reach) / size), map_.codes.rows);
        const int row_to = clamped(std::ceil((map_.y_max - y + reach) / size), map_.codes.rows);
        const int col_from = clamped(std::floor((x - reach - map_.x_min) / size), map_.codes.cols);
        const int col_to = clamped(std::ceil((x + reach - map_.x_min) / size), map_.codes.cols);
        for (int row = row_from; row < row_to; ++row)
            for (int col = col_from; col < col_to; ++col) paint_cell(row, col, cell_centre(row, col));
    }

    // A point that its box leaves out as a straggler is doubtful ground, like one without a box.
    bool is_in_its_box(const SitePoint &p) const
    {
        if (p.obstacle < 0) return false;
        const Obstacle &box = model_.obstacles.at(static_cast<std::size_t>(p.obstacle));
        return footprint_contains(box, p.position.x(), p.position.y());
    }

    void paint_points()
    {
        for (const SitePoint &p : model_.points) {
            if (is_in_its_box(p)) continue;
            const double sigma = std::sqrt(std::max(p.covariance(0, 0), p.covariance(1, 1)));
            const double reach =
                std::max(options_.point_sigmas * sigma, options_.min_point_cells * map_.metres_per_pixel);
            const Vector2d at = p.position.head<2>();
            around(at.x(), at.y(), reach, [&](int row, int col, const Vector3d &cell) {
                if ((cell.head<2>() - at).norm() <= reach) set(row, col, GroundCode::kSuspected);
            });
        }
    }

    void paint_suspects()
    {
        const double reach = options_.suspect_cells * map_.metres_per_pixel + options_.pose_sigmas * pose_sigma_;
        for (const Vector2d &at : model_.suspects)
            around(at.x(), at.y(), reach, [&](int row, int col, const Vector3d &cell) {
                if ((cell.head<2>() - at).norm() <= reach) set(row, col, GroundCode::kSuspected);
            });
    }

    // The least footprint of the same yaw that holds the box and the suspect places beside it.
    Obstacle with_suspects(const Obstacle &box) const
    {
        const double farthest = options_.ring_reach * box.obb_size.head<2>().norm();
        const Vector2d along(std::cos(box.yaw_rad), std::sin(box.yaw_rad)), across(-along.y(), along.x());
        Vector2d high = box.obb_size.head<2>() / 2, low = -high;
        for (const Vector2d &at : model_.suspects) {
            if (distance_outside(box, at.x(), at.y()) > farthest) continue;
            const Vector2d off = at - box.obb_centre.head<2>(), own(along.dot(off), across.dot(off));
            low = low.cwiseMin(own), high = high.cwiseMax(own);
        }
        Obstacle grown = box;
        const Vector2d middle = (low + high) / 2;
        grown.obb_centre.head<2>() += middle.x() * along + middle.y() * across;
        grown.obb_size.head<2>() = high - low;
        return grown;
    }

    // The fewer points a box has, the farther the body may go on beyond them.
    double ring_share(const Obstacle &box) const
    {
        const double sampled = options_.ring_sampling / std::sqrt(static_cast<double>(std::max(box.n_points, 1)));
        return std::clamp(sampled, options_.ring_share, std::max(options_.ring_share, options_.max_ring_share));
    }

    void paint_footprint(const Obstacle &box, double grow, GroundCode code)
    {
        around(box.obb_centre.x(), box.obb_centre.y(), box.obb_size.head<2>().norm() / 2 + 2 * grow,
               [&](int row, int col, const Vector3d &cell) {
                   if (footprint_contains(box, cell.x(), cell.y(), grow)) set(row, col, code);
               });
    }

    // Half a cell's diagonal, so that no cell that a box touches stays free.
    double half_cell() const { return map_.metres_per_pixel * std::sqrt(0.5); }
    double doubt() const { return half_cell() + options_.pose_sigmas * pose_sigma_; }

    void paint_boxes(const std::vector<Obstacle> &boxes, bool is_ring)
    {
        for (const Obstacle &box : boxes) {
            if (!is_ring) {
                paint_footprint(box, half_cell(), GroundCode::kObstacle);
                continue;
            }
            paint_footprint(box, doubt() + ring_share(box) * box.obb_size.head<2>().norm(), GroundCode::kSuspected);
            paint_footprint(with_suspects(box), doubt(), GroundCode::kSuspected);
        }
    }

    const SiteModel &model_;
    const GroundMapOptions &options_;
    GroundMap map_;
    std::vector<Eye> eyes_;
    std::vector<Blocker> blockers_;
    double pose_sigma_ = 0; // the least certain view's, in X or Y
};

} // namespace

void GroundMapOptions::check() const
{
    if (!(cell_m >= 0) || min_views < 1 || !(ring_share >= 0) || !(pose_sigmas >= 0) || !(point_sigmas >= 0) ||
        !(min_point_cells >= 0) || !(suspect_cells >= 0) || !(ring_reach >= 0))
        throw std::invalid_argument(
            "ground map: cell_m, ring_share, pose_sigmas and point limits must be >= 0, min_views >= 1");
    if (border_px < 0 || max_cells_per_side < 1)
        throw std::invalid_argument("ground map: border_px must be >= 0, max_cells_per_side >= 1");
}

GroundMap map_ground(const SiteModel &model, const GroundMapOptions &options, const std::vector<Obstacle> &doubtful)
{
    options.check();
    return Painter(model, options).paint(doubtful);
}

} // namespace outcrop
