// SPDX-License-Identifier: BSD-3-Clause
// Are the matches, and the labels `ground`, true?
#include "metrics_match.h"

#include <cmath>

namespace outcrop::eval {

namespace {

constexpr double kMatchRadiusPx = 3;
constexpr double kGroundRadiusPx = 2;
constexpr double kTransferRadiusPx = 2;

void close(ShareMetric &m)
{
    if (m.n > 0) m.precision = static_cast<double>(m.correct) / m.n;
}

std::string count_note(const std::string &what, int n)
{
    return what + ": " + std::to_string(n) + " left out, no true depth for their views";
}

// Where a true ground junction of one view lies in another, if it is seen there.
std::optional<Eigen::Vector2d> transfer(const Truth &truth, std::size_t from, std::size_t to,
                                        const Eigen::Vector2d &pixel)
{
    if (!truth.depth[to]) return std::nullopt;
    const auto point = truth.views[from].on_ground(pixel);
    if (!point) return std::nullopt;
    const auto at = truth.views[to].project(*point);
    if (!at || !truth.views[to].inside(at->pixel) || !is_visible(*truth.depth[to], *at)) return std::nullopt;
    return at->pixel;
}

ShareMetric ground_from_matches(const Truth &truth, const std::vector<FoundMatch> &matches)
{
    ShareMetric m;
    for (const FoundMatch &match : matches) {
        if (match.kind != Label::kGround) continue;
        const auto correct = is_correct(match, truth);
        if (!correct) continue;
        m.n++;
        m.correct += *correct && is_true_ground(*truth.depth[match.left_view], match.left_px);
    }
    close(m);
    return m;
}

} // namespace

std::optional<bool> is_correct(const FoundMatch &match, const Truth &truth)
{
    const auto &left_map = truth.depth[match.left_view], &right_map = truth.depth[match.right_view];
    if (!left_map || !right_map) return std::nullopt;
    const Camera &left = truth.views[match.left_view], &right = truth.views[match.right_view];
    if (!left.inside(match.left_px) || !right.inside(match.right_px)) return false;
    const int x = static_cast<int>(std::lround(match.left_px.x()));
    const int y = static_cast<int>(std::lround(match.left_px.y()));
    const Eigen::Vector3d ray = left.ray(match.left_px);
    for (int v = std::max(0, y - 1); v <= std::min(left.height - 1, y + 1); v++) {
        for (int u = std::max(0, x - 1); u <= std::min(left.width - 1, x + 1); u++) {
            const double depth = static_cast<double>(left_map->depth_m.at<float>(v, u));
            if (!(depth > 0)) continue;
            const auto at = right.project(left.centre_m() + depth * ray);
            if (at && (at->pixel - match.right_px).norm() <= kMatchRadiusPx && is_visible(*right_map, *at)) return true;
        }
    }
    return false;
}

bool is_true_ground(const DepthMap &map, const Eigen::Vector2d &pixel)
{
    const int x = static_cast<int>(std::lround(pixel.x()));
    const int y = static_cast<int>(std::lround(pixel.y()));
    if (x < 0 || y < 0 || x >= map.mask.cols || y >= map.mask.rows) return false;
    return is_ground_code(map.mask.at<std::uint8_t>(y, x)) && !is_true_obstacle(map, pixel);
}

bool is_true_obstacle(const DepthMap &map, const Eigen::Vector2d &pixel)
{
    const int x = static_cast<int>(std::lround(pixel.x()));
    const int y = static_cast<int>(std::lround(pixel.y()));
    const int reach = static_cast<int>(kGroundRadiusPx) + 1;
    for (int v = std::max(0, y - reach); v <= std::min(map.mask.rows - 1, y + reach); v++)
        for (int u = std::max(0, x - reach); u <= std::min(map.mask.cols - 1, x + reach); u++)
            if (is_obstacle_code(map.mask.at<std::uint8_t>(v, u)) &&
                (Eigen::Vector2d(u, v) - pixel).norm() <= kGroundRadiusPx)
                return true;
    return false;
}

bool is_covisible(const Truth &truth, const std::vector<ViewJunctions> &all, std::size_t order, const FoundJunction &j)
{
    for (std::size_t k = 0; k < all.size(); k++) {
        const bool is_stored = k < order || j.reference_view == all[k].view;
        if (!is_stored || all[k].view == all[order].view) continue;
        const auto at = transfer(truth, all[order].view, all[k].view, j.px);
        if (!at) continue;
        for (const FoundJunction &other : all[k].junctions)
            if ((other.px - *at).norm() <= kTransferRadiusPx) return true;
    }
    return false;
}

ShareMetric judge_ground(const Truth &truth, const std::vector<ViewJunctions> &all, Notes &notes)
{
    ShareMetric m;
    int covisible = 0, found = 0, skipped = 0, obstacle = 0, lost = 0;
    for (std::size_t order = 0; order < all.size(); order++) {
        const auto &depth = truth.depth[all[order].view];
        for (const FoundJunction &j : all[order].junctions) {
            if (!depth) {
                skipped++;
                continue;
            }
            const bool is_true = is_true_ground(*depth, j.px);
            const bool is_labelled = j.label == Label::kGround;
            m.n += is_labelled;
            m.correct += is_labelled && is_true;
            if (is_true_obstacle(*depth, j.px)) {
                obstacle++;
                lost += is_labelled;
            }
            if (!is_true || !is_covisible(truth, all, order, j)) continue;
            covisible++;
            found += is_labelled;
        }
    }
    close(m);
    if (covisible > 0) m.recall = static_cast<double>(found) / covisible;
    if (obstacle > 0) m.obstacle_as_ground = static_cast<double>(lost) / obstacle;
    if (skipped > 0) notes.push_back(count_note("ground: junctions", skipped));
    return m;
}

std::optional<ShareMetric> evaluate_matches(const Truth &truth, const Run &run, Notes &notes)
{
    if (!run.matches || !truth.has_depth()) return std::nullopt;
    ShareMetric m;
    int skipped = 0;
    for (const FoundMatch &match : *run.matches) {
        if (match.kind != Label::kObstacle) continue;
        const auto correct = is_correct(match, truth);
        skipped += !correct;
        m.n += correct.has_value();
        m.correct += correct.value_or(false);
    }
    close(m);
    if (m.n == 0) notes.push_back("matches: there is no obstacle match to judge: precision is null");
    if (skipped > 0) notes.push_back(count_note("matches", skipped));
    return m;
}

std::optional<ShareMetric> evaluate_ground(const Truth &truth, const Run &run, Notes &notes)
{
    if (!truth.has_depth()) return std::nullopt;
    if (run.junctions) return judge_ground(truth, *run.junctions, notes);
    if (run.matches) return ground_from_matches(truth, *run.matches);
    notes.push_back("ground is null: neither vehicle/junctions.json nor matches.json is there");
    return std::nullopt;
}

} // namespace outcrop::eval
