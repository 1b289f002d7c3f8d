// SPDX-License-Identifier: BSD-3-Clause
// Junctions matched by a vector of eight colour invariants.
#include "site/invariants.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace outcrop {
namespace {

constexpr std::array<bool, 8> kIsLevel = {true, false, true, false, true, false, false, false};

// Largest difference of two terms that is still a vote.
double allowed(std::size_t term, double a, double b, const InvariantOptions &options)
{
    if (kIsLevel[term]) return options.max_level;
    return std::max(options.least_gradient2, options.max_gradient_share * std::max(std::abs(a), std::abs(b)));
}

struct Likeness {
    int votes = 0;
    double distance = 0; // sum of the terms' differences over what is allowed

    bool is_better_than(const Likeness &other) const
    {
        return votes != other.votes ? votes > other.votes : distance < other.distance;
    }
};

Likeness likeness(const Invariants &a, const Invariants &b, const InvariantOptions &options)
{
    Likeness out;
    for (std::size_t i = 0; i < a.size(); i++) {
        const double difference = std::abs(a[i] - b[i]), most = allowed(i, a[i], b[i], options);
        out.votes += difference < most ? 1 : 0;
        out.distance += difference / most;
    }
    return out;
}

struct Channel {
    cv::Mat1f level, dx, dy;
};

Channel channel_of(const cv::Mat1b &grey, double sigma_px)
{
    Channel out;
    grey.convertTo(out.level, CV_32F);
    cv::GaussianBlur(out.level, out.level, cv::Size(), sigma_px, sigma_px, cv::BORDER_REPLICATE);
    cv::Sobel(out.level, out.dx, CV_32F, 1, 0, 1, 0.5, 0, cv::BORDER_REPLICATE);
    cv::Sobel(out.level, out.dy, CV_32F, 0, 1, 1, 0.5, 0, cv::BORDER_REPLICATE);
    return out;
}

double dot(const Channel &a, const Channel &b, int y, int x)
{
    return static_cast<double>(a.dx(y, x)) * b.dx(y, x) + static_cast<double>(a.dy(y, x)) * b.dy(y, x);
}

} // namespace

void InvariantOptions::check() const
{
    const bool is_good = sigma_px > 0 && sigma_px <= 10 && min_votes >= 1 && min_votes <= 8 && max_level > 0 &&
                         max_gradient_share >= 0 && least_gradient2 > 0;
    if (!is_good) throw std::invalid_argument("invariants: an option is out of range");
}

std::vector<Invariants> colour_invariants(const cv::Mat3b &picture, const std::vector<oc_junction_t> &junctions,
                                          const InvariantOptions &options)
{
    options.check();
    if (picture.empty()) throw std::invalid_argument("invariants: no picture");
    std::array<cv::Mat1b, 3> planes;
    std::array<Channel, 3> c;
    cv::split(picture, planes.data());
    for (std::size_t i = 0; i < 3; i++) c[i] = channel_of(planes[i], options.sigma_px);
    std::vector<Invariants> out;
    for (const oc_junction_t &junction : junctions) {
        const int x = std::clamp(static_cast<int>(std::lround(junction.x_px)), 0, picture.cols - 1);
        const int y = std::clamp(static_cast<int>(std::lround(junction.y_px)), 0, picture.rows - 1);
        out.push_back({c[0].level(y, x), dot(c[0], c[0], y, x), c[1].level(y, x), dot(c[1], c[1], y, x),
                       c[2].level(y, x), dot(c[2], c[2], y, x), dot(c[0], c[1], y, x), dot(c[0], c[2], y, x)});
    }
    return out;
}

int invariant_votes(const Invariants &a, const Invariants &b, const InvariantOptions &options)
{
    return likeness(a, b, options).votes;
}

std::vector<InvariantMatch> match_by_invariants(const std::vector<Invariants> &left,
                                                const std::vector<Invariants> &right,
                                                const std::vector<Candidate> &candidates,
                                                const InvariantOptions &options)
{
    options.check();
    std::vector<Likeness> like;
    std::vector<int> best_of_left(left.size(), -1), best_of_right(right.size(), -1);
    const auto challenge = [&](int *best, int i) {
        if (*best < 0 || like[static_cast<std::size_t>(i)].is_better_than(like[static_cast<std::size_t>(*best)]))
            *best = i;
    };
    for (int i = 0; i < static_cast<int>(candidates.size()); i++) {
        const Candidate &c = candidates[static_cast<std::size_t>(i)];
        like.push_back(
            likeness(left.at(static_cast<std::size_t>(c.left)), right.at(static_cast<std::size_t>(c.right)), options));
        challenge(&best_of_left[static_cast<std::size_t>(c.left)], i);
        challenge(&best_of_right[static_cast<std::size_t>(c.right)], i);
    }
    std::vector<InvariantMatch> out;
    for (const int i : best_of_left) {
        if (i < 0) continue;
        const Candidate &c = candidates[static_cast<std::size_t>(i)];
        const int votes = like[static_cast<std::size_t>(i)].votes;
        if (c.is_rival || votes < options.min_votes || best_of_right[static_cast<std::size_t>(c.right)] != i) continue;
        out.push_back({c.left, c.right, votes});
    }
    return out;
}

} // namespace outcrop
