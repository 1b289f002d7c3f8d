// SPDX-License-Identifier: BSD-3-Clause
// Generalised voxel colouring: a voxel is judged by the views in which no other voxel hides it.
#include "site/carve_colour.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>

#include <opencv2/imgproc.hpp>

#include "site/carve_surface.h"

namespace outcrop {
namespace {

using Colours = std::vector<cv::Vec3f>;

struct ColourView {
    GridCamera camera;
    cv::Mat3b rgb;
    cv::Mat1b known;
    cv::Mat1f depth;
    cv::Vec3f gain{1, 1, 1};
};

std::vector<ColourView> prepare(const std::vector<const CarveView *> &views, const VoxelGrid &grid)
{
    std::vector<ColourView> out;
    for (const CarveView *view : views) {
        if (view->rgb.empty()) continue;
        ColourView v{GridCamera(view->camera, grid), view->rgb, {}, {}};
        // A pixel beside an unknown one has no full neighbourhood.
        cv::erode(view->known, v.known, cv::Mat::ones(3, 3, CV_8U));
        out.push_back(v);
    }
    return out;
}

// Lowest and highest of the four pixels round the voxel's image, so that an edge seen half a pixel aside is no
// disagreement, and the colour between them.
struct Sample {
    cv::Vec3f low, high, mean;
    std::size_t view;
};

Sample sample_at(const ColourView &view, double x_px, double y_px, std::size_t number)
{
    const int x0 = static_cast<int>(std::floor(x_px)), y0 = static_cast<int>(std::floor(y_px));
    const float fx = static_cast<float>(x_px - x0), fy = static_cast<float>(y_px - y0);
    Sample s{cv::Vec3f::all(1e9F), cv::Vec3f::all(-1e9F), cv::Vec3f::all(0), number};
    for (int dy = 0; dy < 2; ++dy)
        for (int dx = 0; dx < 2; ++dx) {
            const cv::Vec3f c(
                view.rgb(std::clamp(y0 + dy, 0, view.rgb.rows - 1), std::clamp(x0 + dx, 0, view.rgb.cols - 1)));
            s.mean += (dx ? fx : 1 - fx) * (dy ? fy : 1 - fy) * c;
            for (int n = 0; n < 3; ++n) s.low[n] = std::min(s.low[n], c[n]), s.high[n] = std::max(s.high[n], c[n]);
        }
    s.low = s.low.mul(view.gain), s.high = s.high.mul(view.gain), s.mean = s.mean.mul(view.gain);
    return s;
}

// What the views that see the voxel say. slack_m: so much behind the nearest splat is still seen.
void samples_of(const std::vector<ColourView> &views, const SurfaceVoxel &voxel, double slack_m,
                std::vector<Sample> *samples)
{
    samples->clear();
    for (std::size_t v = 0; v < views.size(); ++v) {
        const ColourView &view = views[v];
        const VoxelPixel at = view.camera.project(voxel.i, voxel.j, voxel.k);
        if (!(at.depth_m > 0)) continue;
        const cv::Point px(cvRound(at.x_px), cvRound(at.y_px));
        if (!view.camera.image().contains(px) || !view.known(px)) continue;
        if (at.depth_m > static_cast<double>(view.depth(px)) + slack_m) continue;
        samples->push_back(sample_at(view, at.x_px, at.y_px, v));
    }
}

// Largest channel's gap between the two ranges; 0 when they overlap.
float gap(const Sample &a, const Sample &b)
{
    float worst = 0;
    for (int c = 0; c < 3; ++c) worst = std::max({worst, a.low[c] - b.high[c], b.low[c] - a.high[c]});
    return worst;
}

bool is_consistent(const std::vector<Sample> &samples, const CarveOptions &options)
{
    const std::size_t n = samples.size();
    if (n < static_cast<std::size_t>(options.min_colour_views)) return true;
    std::size_t most = 0;
    for (const Sample &a : samples) {
        const auto agrees = [&](const Sample &b) { return static_cast<double>(gap(a, b)) <= options.max_difference; };
        most = std::max(most, static_cast<std::size_t>(std::count_if(samples.begin(), samples.end(), agrees)));
    }
    return most >= 2 && static_cast<double>(most) >= options.min_agreeing * static_cast<double>(n);
}

float median(std::vector<float> *values)
{
    const auto middle = values->begin() + static_cast<std::ptrdiff_t>(values->size() / 2);
    std::nth_element(values->begin(), middle, values->end());
    return *middle;
}

cv::Vec3f median_colour(const std::vector<Sample> &samples)
{
    cv::Vec3f colour;
    std::vector<float> values(samples.size());
    for (int c = 0; c < 3; ++c) {
        std::transform(samples.begin(), samples.end(), values.begin(), [&](const Sample &s) { return s.mean[c]; });
        colour[c] = median(&values);
    }
    return colour;
}

void see_surface(const std::vector<SurfaceVoxel> &surface, std::vector<ColourView> *views)
{
    for (ColourView &view : *views) view.depth = depth_of_surface(surface, view.camera);
}

// Exposure differs between views: each gets the factor per channel that brings it to the others' median.
void balance(const std::vector<SurfaceVoxel> &surface, double slack_m, std::vector<ColourView> *views)
{
    constexpr float kMinLevel = 8, kMaxLevel = 247, kMaxGain = 2.5F;
    constexpr std::size_t kMinSamples = 50;
    std::vector<std::array<std::vector<float>, 3>> ratios(views->size());
    std::vector<Sample> samples;
    const std::size_t step = std::max<std::size_t>(1, surface.size() / 20000);
    for (std::size_t n = 0; n < surface.size(); n += step) {
        samples_of(*views, surface[n], slack_m, &samples);
        if (samples.size() < 3) continue;
        const cv::Vec3f middle = median_colour(samples);
        for (const Sample &s : samples)
            for (int c = 0; c < 3; ++c)
                if (s.mean[c] >= kMinLevel && s.mean[c] <= kMaxLevel && middle[c] >= kMinLevel)
                    ratios[s.view][static_cast<std::size_t>(c)].push_back(middle[c] / s.mean[c]);
    }
    for (std::size_t v = 0; v < views->size(); ++v)
        for (int c = 0; c < 3; ++c) {
            auto &values = ratios[v][static_cast<std::size_t>(c)];
            if (values.size() < kMinSamples) continue;
            (*views)[v].gain[c] = std::clamp(median(&values), 1 / kMaxGain, kMaxGain);
        }
}

} // namespace

std::size_t carve_by_colour(const std::vector<const CarveView *> &views, const CarveOptions &options, Voxels *voxels)
{
    std::vector<ColourView> eyes = prepare(views, voxels->grid);
    if (eyes.size() < static_cast<std::size_t>(options.min_colour_views)) return 0;
    const double slack_m = voxels->grid.cell_m;
    const auto hull =
        static_cast<double>(std::count(voxels->states.begin(), voxels->states.end(), VoxelState::kOccupied));
    std::size_t n_removed = 0;
    std::vector<Sample> samples;
    for (int sweep = 0; sweep < options.max_sweeps; ++sweep) {
        const std::vector<SurfaceVoxel> surface = surface_of(*voxels);
        see_surface(surface, &eyes);
        if (sweep == 0) balance(surface, slack_m, &eyes);
        std::vector<std::size_t> bad;
        for (const SurfaceVoxel &voxel : surface) {
            samples_of(eyes, voxel, slack_m, &samples);
            if (!is_consistent(samples, options)) bad.push_back(voxel.at);
        }
        if (bad.empty() || static_cast<double>(n_removed + bad.size()) > options.max_removed * hull) break;
        for (const std::size_t at : bad) voxels->states[at] = VoxelState::kUnknown;
        n_removed += bad.size();
    }
    return n_removed;
}

std::size_t carve_by_colour_thesis(const std::vector<const CarveView *> &views, const CarveOptions &options,
                                   Voxels *voxels)
{
    const std::vector<ColourView> eyes = prepare(views, voxels->grid);
    if (eyes.empty()) return 0;
    const VoxelGrid &grid = voxels->grid;
    std::size_t n_removed = 0;
    std::vector<cv::Vec3i> colours;
    for (int k = 0; k < grid.nz; ++k)
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx; ++i) {
                if (!voxels->is_occupied(i, j, k)) continue;
                colours.clear();
                for (const ColourView &view : eyes) {
                    const VoxelPixel at = view.camera.project(i, j, k);
                    const cv::Point px(cvRound(at.x_px), cvRound(at.y_px));
                    if (at.depth_m > 0 && view.camera.image().contains(px) && view.known(px))
                        colours.push_back(cv::Vec3i(view.rgb(px)));
                }
                int most = 0;
                for (const cv::Vec3i &a : colours) {
                    int n = 0;
                    for (const cv::Vec3i &b : colours)
                        n += std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]) <
                             3 * options.thesis_difference;
                    most = std::max(most, n - 1); // itself not counted
                }
                if (most >= options.thesis_agreeing) continue;
                voxels->states[grid.at(i, j, k)] = VoxelState::kUnknown;
                ++n_removed;
            }
    return n_removed;
}

void colour_voxels(const std::vector<const CarveView *> &views, Voxels *voxels)
{
    voxels->colours.clear();
    std::vector<ColourView> eyes = prepare(views, voxels->grid);
    if (eyes.empty()) return;
    const VoxelGrid &grid = voxels->grid;
    const std::vector<SurfaceVoxel> surface = surface_of(*voxels);
    see_surface(surface, &eyes);
    balance(surface, grid.cell_m, &eyes);
    voxels->colours.assign(grid.size(), {200, 200, 200});
    std::vector<std::uint8_t> is_done(grid.size(), 0);
    std::deque<SurfaceVoxel> front;
    std::vector<Sample> samples;
    for (const SurfaceVoxel &voxel : surface) {
        samples_of(eyes, voxel, grid.cell_m, &samples);
        if (samples.empty()) continue;
        voxels->colours[voxel.at] = cv::Vec3b(median_colour(samples));
        is_done[voxel.at] = 1;
        front.push_back(voxel);
    }
    // Inwards and along the surface, ring by ring.
    static constexpr int kSteps[6][3] = {{-1, 0, 0}, {1, 0, 0}, {0, -1, 0}, {0, 1, 0}, {0, 0, -1}, {0, 0, 1}};
    while (!front.empty()) {
        const SurfaceVoxel from = front.front();
        front.pop_front();
        for (const auto &step : kSteps) {
            const int i = from.i + step[0], j = from.j + step[1], k = from.k + step[2];
            if (!voxels->is_occupied(i, j, k)) continue;
            const std::size_t at = grid.at(i, j, k);
            if (is_done[at]) continue;
            is_done[at] = 1;
            voxels->colours[at] = voxels->colours[from.at];
            front.push_back({i, j, k, at});
        }
    }
}

} // namespace outcrop
