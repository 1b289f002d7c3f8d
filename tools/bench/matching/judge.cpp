// SPDX-License-Identifier: BSD-3-Clause
// Matches counted against the truth.
#include "judge.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <stdexcept>
#include <tuple>

namespace outcrop::bench {

void MatchCount::add(const MatchCount &other)
{
    n += other.n;
    correct += other.correct;
    correct_on_obstacle += other.correct_on_obstacle;
    ground_n += other.ground_n;
    ground_correct += other.ground_correct;
}

Interval wilson(int correct, int n)
{
    if (n <= 0) return {};
    constexpr double kZ = 1.959964;
    const double share = static_cast<double>(correct) / n, z2 = kZ * kZ / n;
    const double middle = (share + z2 / 2) / (1 + z2);
    const double half = kZ * std::sqrt(share * (1 - share) / n + z2 / (4 * n)) / (1 + z2);
    return {std::max(0.0, middle - half), std::min(1.0, middle + half)};
}

std::vector<PixelMatch> pixel_matches(const std::vector<View> &views, const std::vector<PairMatches> &pairs)
{
    std::map<int, const View *> by_id;
    for (const View &view : views) by_id[view.id] = &view;
    const auto pixel = [](const View &view, int junction) {
        const oc_junction_t &j = view.junctions.at(static_cast<std::size_t>(junction));
        return Eigen::Vector2d(j.x_px, j.y_px);
    };
    std::vector<PixelMatch> out;
    for (const PairMatches &pair : pairs)
        for (const Match &match : pair.matches)
            out.push_back({pair.left, pair.right, pixel(*by_id.at(pair.left), match.left_junction),
                           pixel(*by_id.at(pair.right), match.right_junction), match.kind, match.score});
    return out;
}

bool is_right(const SiteCase &site, const PixelMatch &match)
{
    const eval::FoundMatch found = {static_cast<std::size_t>(match.left_view),
                                    static_cast<std::size_t>(match.right_view), match.left_px, match.right_px,
                                    eval::Label::kObstacle};
    const auto correct = eval::is_correct(found, site.truth);
    if (!correct) throw std::runtime_error(site.name + ": a view has no true depth");
    return *correct;
}

bool is_on_obstacle(const SiteCase &site, const PixelMatch &match)
{
    return eval::is_true_obstacle(*site.truth.depth.at(static_cast<std::size_t>(match.left_view)), match.left_px);
}

std::vector<PixelMatch> without_repeats(std::vector<PixelMatch> matches)
{
    std::stable_sort(matches.begin(), matches.end(), [](const PixelMatch &a, const PixelMatch &b) {
        return std::make_tuple(a.left_view, a.right_view, -a.score) <
               std::make_tuple(b.left_view, b.right_view, -b.score);
    });
    std::vector<PixelMatch> kept;
    std::size_t first = 0; // of this pair, in kept
    for (const PixelMatch &match : matches) {
        if (first < kept.size() &&
            (kept[first].left_view != match.left_view || kept[first].right_view != match.right_view))
            first = kept.size();
        const bool is_repeat =
            std::any_of(kept.begin() + static_cast<std::ptrdiff_t>(first), kept.end(), [&](const PixelMatch &other) {
                return (other.left_px - match.left_px).norm() < kOnePlacePx &&
                       (other.right_px - match.right_px).norm() < kOnePlacePx;
            });
        if (!is_repeat) kept.push_back(match);
    }
    return kept;
}

MatchCount count_matches(const SiteCase &site, const std::vector<PixelMatch> &matches)
{
    MatchCount count;
    for (const PixelMatch &match : without_repeats(matches)) {
        const bool right = is_right(site, match);
        if (match.kind == MatchKind::kGround) {
            count.ground_n++;
            count.ground_correct += right;
            continue;
        }
        count.n++;
        count.correct += right;
        count.correct_on_obstacle += right && is_on_obstacle(site, match);
    }
    return count;
}

nlohmann::ordered_json to_json(const MatchCount &count)
{
    using Json = nlohmann::ordered_json;
    const Interval interval = wilson(count.correct, count.n);
    const bool is_known = count.n > 0;
    return {{"n", count.n},
            {"correct", count.correct},
            {"precision", is_known ? Json(static_cast<double>(count.correct) / count.n) : Json(nullptr)},
            {"precision_low", is_known ? Json(interval.low) : Json(nullptr)},
            {"precision_high", is_known ? Json(interval.high) : Json(nullptr)},
            {"correct_on_obstacle", count.correct_on_obstacle},
            {"ground_n", count.ground_n},
            {"ground_correct", count.ground_correct}};
}

} // namespace outcrop::bench
