// SPDX-License-Identifier: BSD-3-Clause
// SIFT, AKAZE and affine SIFT in our place.
#include "rivals.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include <opencv2/core/hal/hal.hpp>
#include <opencv2/features2d.hpp>

#include "site/pair_errors.h"

namespace outcrop::bench {
namespace {

constexpr int kNarrowings = 2;     // as match_pair
constexpr double kSamePlacePx = 3; // as MatchOptions
constexpr int kCellPx = 40;        // as the spread of junctions
constexpr double kInfinite = std::numeric_limits<double>::infinity();

cv::Ptr<cv::Feature2D> make(Feature feature)
{
    switch (feature) {
    case Feature::kSift: return cv::SIFT::create();
    case Feature::kAkaze: return cv::AKAZE::create();
    case Feature::kAffineSift: return cv::AffineFeature::create(cv::SIFT::create());
    }
    return nullptr;
}

struct Scored {
    Candidate candidate;
    double distance = 0;
};

double distance_of(const cv::Mat &a, int row_a, const cv::Mat &b, int row_b)
{
    if (a.depth() == CV_8U) return cv::hal::normHamming(a.ptr(row_a), b.ptr(row_b), a.cols);
    return std::sqrt(static_cast<double>(cv::hal::normL2Sqr_(a.ptr<float>(row_a), b.ptr<float>(row_b), a.cols)));
}

// Best candidate of each point of one side, and the least distance at another place of the other view.
struct Rank {
    int best = -1;
    double runner_up = kInfinite;
};

bool is_same_place(const oc_junction_t &a, const oc_junction_t &b)
{
    return std::hypot(a.x_px - b.x_px, a.y_px - b.y_px) < kSamePlacePx;
}

std::vector<Rank> rank_by(bool by_left, const std::vector<Scored> &scored, const View &left, const View &right)
{
    const auto own = [&](const Scored &s) {
        return static_cast<std::size_t>(by_left ? s.candidate.left : s.candidate.right);
    };
    const auto other = [&](const Scored &s) -> const oc_junction_t & {
        return by_left ? right.junctions[static_cast<std::size_t>(s.candidate.right)]
                       : left.junctions[static_cast<std::size_t>(s.candidate.left)];
    };
    std::vector<Rank> ranks((by_left ? left : right).junctions.size());
    for (std::size_t i = 0; i < scored.size(); i++) {
        int &best = ranks[own(scored[i])].best;
        if (best < 0 || scored[i].distance < scored[static_cast<std::size_t>(best)].distance)
            best = static_cast<int>(i);
    }
    for (const Scored &s : scored) {
        Rank &rank = ranks[own(s)];
        if (is_same_place(other(s), other(scored[static_cast<std::size_t>(rank.best)]))) continue;
        rank.runner_up = std::min(rank.runner_up, s.distance);
    }
    return ranks;
}

struct Chosen {
    int index = 0;
    double ratio = 0;
};

std::vector<Chosen> choose(const std::vector<Scored> &scored, const View &left, const View &right, double max_ratio)
{
    const std::vector<Rank> of_left = rank_by(true, scored, left, right);
    const std::vector<Rank> of_right = rank_by(false, scored, left, right);
    std::vector<Chosen> chosen;
    for (int i = 0; i < static_cast<int>(scored.size()); i++) {
        const Scored &s = scored[static_cast<std::size_t>(i)];
        const Rank &l = of_left[static_cast<std::size_t>(s.candidate.left)];
        const Rank &r = of_right[static_cast<std::size_t>(s.candidate.right)];
        if (l.best != i || r.best != i) continue;
        const double second = std::min(l.runner_up, r.runner_up);
        const double ratio = std::isinf(second) ? 0 : s.distance / std::max(second, 1e-9);
        if (ratio <= max_ratio) chosen.push_back({i, ratio});
    }
    return chosen;
}

PairErrors::PixelPair pixels_of(const Scored &s, const View &left, const View &right)
{
    const oc_junction_t &l = left.junctions[static_cast<std::size_t>(s.candidate.left)];
    const oc_junction_t &r = right.junctions[static_cast<std::size_t>(s.candidate.right)];
    return {l.x_px, l.y_px, r.x_px, r.y_px};
}

void narrow(const oc_pair_t &pair, const View &left, const View &right, double max_ratio, std::vector<Scored> *scored)
{
    for (int round = 0; round < kNarrowings; round++) {
        std::vector<PairErrors::PixelPair> matches;
        for (const Chosen &c : choose(*scored, left, right, max_ratio))
            matches.push_back(pixels_of((*scored)[static_cast<std::size_t>(c.index)], left, right));
        PairErrors errors(pair);
        errors.fit(matches);
        const auto is_off = [&](const Scored &s) {
            return errors.deviation(pixels_of(s, left, right)) > OC_STRIP_MAX_SIGMA;
        };
        scored->erase(std::remove_if(scored->begin(), scored->end(), is_off), scored->end());
    }
}

PairMatches match_rival(const PosedView &left, const PosedView &right, const Described &of_left,
                        const Described &of_right, const Area &area, const RivalOptions &options)
{
    PairMatches out;
    out.left = left.view->id;
    out.right = right.view->id;
    oc_pair_t pair;
    if (!prepare_pair(left, right, options.strip, &pair)) return out;
    std::vector<Scored> scored;
    for (const Candidate &c : find_candidates(pair, left, right, area, options.strip))
        scored.push_back({c, distance_of(of_left.descriptors, c.left, of_right.descriptors, c.right)});
    if (options.narrows_strip)
        narrow(pair, *left.view, *right.view, std::min(options.max_ratio, options.max_ratio_to_refine), &scored);
    for (const Chosen &chosen : choose(scored, *left.view, *right.view, options.max_ratio)) {
        const Candidate &c = scored[static_cast<std::size_t>(chosen.index)].candidate;
        if (c.is_rival) continue;
        Match match;
        match.left_junction = c.left;
        match.right_junction = c.right;
        match.score = 1 - chosen.ratio;
        match.point = c.point;
        out.matches.push_back(match);
    }
    return out;
}

// Strongest first, but each cell gives its k-th before any gives its next: else rich ground takes all places.
std::vector<int> spread_order(const std::vector<cv::KeyPoint> &points, cv::Size size)
{
    std::vector<int> order(points.size());
    std::iota(order.begin(), order.end(), 0);
    const auto response = [&](int i) { return points[static_cast<std::size_t>(i)].response; };
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return response(a) > response(b); });
    const int n_x = size.width / kCellPx + 1, n_y = size.height / kCellPx + 1;
    std::vector<int> n_of_cell(static_cast<std::size_t>(n_x * n_y), 0), rank(points.size(), 0);
    for (const int i : order) {
        const cv::Point2f &at = points[static_cast<std::size_t>(i)].pt;
        const int x = std::clamp(static_cast<int>(at.x) / kCellPx, 0, n_x - 1);
        const int y = std::clamp(static_cast<int>(at.y) / kCellPx, 0, n_y - 1);
        rank[static_cast<std::size_t>(i)] = n_of_cell[static_cast<std::size_t>(y * n_x + x)]++;
    }
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
        return rank[static_cast<std::size_t>(a)] < rank[static_cast<std::size_t>(b)];
    });
    return order;
}

} // namespace

const char *name_of(Feature feature)
{
    switch (feature) {
    case Feature::kSift: return "SIFT + ratio";
    case Feature::kAkaze: return "AKAZE + ratio";
    case Feature::kAffineSift: return "AffineFeature(SIFT) + ratio";
    }
    return "";
}

Described describe(Feature feature, const cv::Mat1b &grey)
{
    Described found;
    make(feature)->detectAndCompute(grey, cv::noArray(), found.points, found.descriptors);
    Described out;
    out.n_found = found.points.size();
    for (const int i : spread_order(found.points, grey.size())) {
        if (out.points.size() == kMostPoints) break;
        out.points.push_back(found.points[static_cast<std::size_t>(i)]);
        out.descriptors.push_back(found.descriptors.row(i));
    }
    return out;
}

std::vector<View> with_points(const std::vector<View> &views, const std::vector<Described> &described)
{
    std::vector<View> out = views;
    for (std::size_t i = 0; i < out.size(); i++) {
        out[i].junctions.clear();
        for (const cv::KeyPoint &point : described.at(i).points) {
            oc_junction_t junction{};
            junction.x_px = point.pt.x;
            junction.y_px = point.pt.y;
            out[i].junctions.push_back(junction);
        }
    }
    return out;
}

Matcher rival_matcher(const std::vector<Described> &described, const RivalOptions &options)
{
    return [&described, options](const MatchPass &pass) {
        RivalOptions now = options;
        now.strip.angles = pass.angles;
        if (!pass.is_last) now.max_ratio = std::min(now.max_ratio, now.max_ratio_to_refine);
        std::vector<PairMatches> out;
        for (const ViewPair &pair : select_pairs(pass.views, pass.area, options.pairs)) {
            const auto l = static_cast<std::size_t>(pair.left), r = static_cast<std::size_t>(pair.right);
            out.push_back(match_rival(pass.views[l], pass.views[r], described[l], described[r], pass.area, now));
        }
        return out;
    };
}

} // namespace outcrop::bench
