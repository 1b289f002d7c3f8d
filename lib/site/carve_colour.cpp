// SPDX-License-Identifier: BSD-3-Clause
// Visibility by a depth buffer of the surface voxels in each view, renewed every sweep.
#include "site/carve_colour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <opencv2/imgproc.hpp>

namespace outcrop {
namespace {

using Eigen::Vector3d;

const cv::Vec3b kNoColour(150, 150, 150);

struct Cell {
    int i, j, k;
};

std::vector<Cell> surface_of(const VoxelGrid &grid)
{
    std::vector<Cell> surface;
    for (int k = 0; k < grid.nz; k++)
        for (int j = 0; j < grid.ny; j++)
            for (int i = 0; i < grid.nx; i++)
                if (grid.is_surface(i, j, k)) surface.push_back({i, j, k});
    return surface;
}

// A view with the nearest depth of the surface at each pixel.
class Eye {
public:
    Eye(const CarveView &view, int reach_px) : view_(view)
    {
        if (view.rgb.empty()) return;
        const cv::Mat kernel = cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * reach_px + 1, 2 * reach_px + 1));
        cv::Mat low = view.rgb.clone(), high = view.rgb.clone();
        low.setTo(cv::Scalar(255, 255, 255), view.known == 0); // what is not known widens nothing
        high.setTo(cv::Scalar(0, 0, 0), view.known == 0);
        cv::erode(low, low_, kernel);
        cv::dilate(high, high_, kernel);
    }

    bool has_colour() const { return !view_.rgb.empty(); }

    void see(const VoxelGrid &grid, const std::vector<Cell> &surface)
    {
        depth_ = cv::Mat1f(view_.labels.size(), std::numeric_limits<float>::infinity());
        for (const Cell &cell : surface) {
            int x, y;
            double depth;
            if (!project(grid, cell, &x, &y, &depth)) continue;
            const int half =
                std::min(20, static_cast<int>(std::ceil(0.6 * grid.size_m * view_.camera.k.fx_px / depth)));
            for (int v = std::max(0, y - half); v <= std::min(depth_.rows - 1, y + half); v++)
                for (int u = std::max(0, x - half); u <= std::min(depth_.cols - 1, x + half); u++)
                    depth_(v, u) = std::min(depth_(v, u), static_cast<float>(depth));
        }
    }

    // Where the voxel shows, if nothing is before it or that is not asked.
    bool shows(const VoxelGrid &grid, const Cell &cell, bool even_hidden, int *x, int *y) const
    {
        double depth;
        if (!project(grid, cell, x, y, &depth)) return false;
        return even_hidden || depth <= static_cast<double>(depth_(*y, *x)) + 1.8 * grid.size_m;
    }

    bool is_known(int x, int y) const { return has_colour() && view_.known(y, x) != 0; }
    const cv::Vec3b &colour(int x, int y) const { return view_.rgb(y, x); }
    bool spans(int x, int y, const cv::Vec3b &colour, int tolerance) const
    {
        const cv::Vec3b &low = low_(y, x), &high = high_(y, x);
        for (int c = 0; c < 3; c++)
            if (colour[c] < low[c] - tolerance || colour[c] > high[c] + tolerance) return false;
        return true;
    }

private:
    bool project(const VoxelGrid &grid, const Cell &cell, int *x, int *y, double *depth) const
    {
        const Vector3d at = grid.centre(cell.i, cell.j, cell.k);
        double u, v;
        *depth = oc_camera_project(&view_.camera, at.data(), &u, &v);
        if (!(*depth > 0) || !(u > -0.5 && v > -0.5)) return false;
        *x = static_cast<int>(u + 0.5), *y = static_cast<int>(v + 0.5);
        return *x < view_.labels.cols && *y < view_.labels.rows;
    }

    const CarveView &view_;
    cv::Mat3b low_, high_;
    cv::Mat1f depth_;
};

struct Glance {
    const Eye *eye;
    int x, y;
};

// Do enough of the views that see it have a place nearby of one colour?
bool is_consistent(const std::vector<Glance> &glances, const CarveOptions &options)
{
    const auto needed = static_cast<std::size_t>(std::ceil(options.colour_share * static_cast<double>(glances.size())));
    for (const Glance &candidate : glances) {
        const cv::Vec3b &colour = candidate.eye->colour(candidate.x, candidate.y);
        std::size_t n = 0;
        for (const Glance &glance : glances)
            n += glance.eye->spans(glance.x, glance.y, colour, options.colour_tolerance);
        if (n >= needed) return true;
    }
    return false;
}

// Thesis Eq 6.11: how many pairs of views, hidden or not, agree; fewer than t_nI is no body.
bool is_thesis_body(const std::vector<Glance> &glances, const CarveOptions &options)
{
    int most = 0;
    for (const Glance &a : glances) {
        int n = 0;
        for (const Glance &b : glances) {
            int difference = 0;
            for (int c = 0; c < 3; c++) difference += std::abs(a.eye->colour(a.x, a.y)[c] - b.eye->colour(b.x, b.y)[c]);
            n += difference <= options.colour_tolerance;
        }
        most = std::max(most, n);
    }
    return most >= options.thesis_colours;
}

} // namespace

std::size_t carve_by_colour(const std::vector<CarveView> &views, const CarveOptions &options, VoxelGrid *grid)
{
    std::vector<Eye> eyes;
    for (const CarveView &view : views)
        if (!view.rgb.empty()) eyes.emplace_back(view, options.colour_reach_px);
    std::size_t n_gone = 0;
    for (int sweep = 0; sweep < options.colour_sweeps; sweep++) {
        const std::vector<Cell> surface = surface_of(*grid);
        for (Eye &eye : eyes) eye.see(*grid, surface);
        std::vector<std::size_t> gone;
        for (const Cell &cell : surface) {
            std::vector<Glance> glances;
            for (const Eye &eye : eyes) {
                int x, y;
                if (eye.shows(*grid, cell, options.is_thesis, &x, &y) && eye.is_known(x, y))
                    glances.push_back({&eye, x, y});
            }
            if (static_cast<int>(glances.size()) < options.min_colour_views) continue;
            const bool is_body = options.is_thesis ? is_thesis_body(glances, options) : is_consistent(glances, options);
            if (!is_body) gone.push_back(grid->index(cell.i, cell.j, cell.k));
        }
        for (const std::size_t v : gone) grid->state[v] = VoxelState::kFree;
        n_gone += gone.size();
        if (gone.size() * 1000 < surface.size()) break;
    }
    return n_gone;
}

std::size_t colour_voxels(const std::vector<CarveView> &views, VoxelGrid *grid)
{
    std::vector<Eye> eyes;
    for (const CarveView &view : views) eyes.emplace_back(view, 0);
    const std::vector<Cell> surface = surface_of(*grid);
    for (Eye &eye : eyes) eye.see(*grid, surface);
    grid->colour.assign(grid->size(), kNoColour);
    std::size_t n_seen = 0;
    for (const Cell &cell : surface) {
        std::array<std::vector<int>, 3> values;
        bool is_seen = false;
        for (const Eye &eye : eyes) {
            int x, y;
            if (!eye.shows(*grid, cell, false, &x, &y)) continue;
            is_seen = true;
            if (!eye.is_known(x, y)) continue;
            for (std::size_t c = 0; c < 3; c++) values[c].push_back(eye.colour(x, y)[static_cast<int>(c)]);
        }
        n_seen += is_seen;
        if (values[0].empty()) continue;
        cv::Vec3b &colour = grid->colour[grid->index(cell.i, cell.j, cell.k)];
        for (std::size_t c = 0; c < 3; c++) {
            auto middle = values[c].begin() + static_cast<std::ptrdiff_t>(values[c].size() / 2);
            std::nth_element(values[c].begin(), middle, values[c].end());
            colour[static_cast<int>(c)] = static_cast<std::uint8_t>(*middle);
        }
    }
    const auto n = static_cast<std::size_t>(std::count(grid->state.begin(), grid->state.end(), VoxelState::kOccupied));
    return n - n_seen;
}

} // namespace outcrop
