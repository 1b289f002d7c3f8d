// SPDX-License-Identifier: BSD-3-Clause
// The eight colour invariants: values in closed form, turns of the picture, votes and choice.
#include "site/invariants.h"

#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace outcrop {
namespace {

oc_junction_t at(double x, double y)
{
    oc_junction_t j{};
    j.x_px = static_cast<float>(x);
    j.y_px = static_cast<float>(y);
    return j;
}

// Smooth colours of no symmetry, in integers that a turn keeps.
cv::Mat3b blobs(unsigned seed, int side)
{
    cv::Mat3b noise(side, side), out;
    cv::RNG rng(seed);
    rng.fill(noise, cv::RNG::UNIFORM, 0, 256);
    cv::GaussianBlur(noise, out, cv::Size(), 2.5);
    return out;
}

TEST(ColourInvariants, OfRampsAreTheirLevelsAndSlopes)
{
    // A Gaussian leaves a ramp alone, so that levels and slopes are known.
    cv::Mat3b picture(81, 81);
    for (int y = 0; y < 81; y++)
        for (int x = 0; x < 81; x++)
            picture(y, x) = cv::Vec3b(cv::saturate_cast<uchar>(2 * x + 10), cv::saturate_cast<uchar>(3 * y),
                                      cv::saturate_cast<uchar>(x + y + 5));
    const Invariants v = colour_invariants(picture, {at(40, 30)})[0];
    const double expected[8] = {90, 4, 90, 9, 75, 2, 0, 2};
    for (std::size_t i = 0; i < 8; i++) EXPECT_NEAR(v[i], expected[i], 1e-3) << i;
}

TEST(ColourInvariants, DoNotChangeWhenThePictureTurns)
{
    for (unsigned seed = 1; seed <= 5; seed++) {
        SCOPED_TRACE(seed);
        const cv::Mat3b picture = blobs(seed, 61);
        cv::Mat3b turned;
        cv::rotate(picture, turned, cv::ROTATE_90_CLOCKWISE); // (x, y) goes to (60 - y, x)
        for (int y = 12; y < 50; y += 9) {
            for (int x = 12; x < 50; x += 7) {
                const Invariants a = colour_invariants(picture, {at(x, y)})[0];
                const Invariants b = colour_invariants(turned, {at(60 - y, x)})[0];
                for (std::size_t i = 0; i < 8; i++) EXPECT_NEAR(a[i], b[i], 1e-2 + 1e-4 * std::abs(a[i])) << i;
            }
        }
    }
}

TEST(ColourInvariants, JunctionsAtTheBorderAndBeyondAreEndured)
{
    const cv::Mat3b picture = blobs(1, 20);
    for (const Invariants &v : colour_invariants(picture, {at(0, 0), at(19, 19), at(-4, 3), at(25, 80)}))
        for (const double value : v) EXPECT_TRUE(std::isfinite(value));
    EXPECT_THROW(colour_invariants(cv::Mat3b(), {at(1, 1)}), std::invalid_argument);
}

TEST(InvariantVotes, CountTheTermsThatAgree)
{
    const Invariants v = {100, 400, 120, 300, 90, 500, 200, -150};
    EXPECT_EQ(invariant_votes(v, v), 8);
    for (std::size_t i = 0; i < 8; i++) {
        Invariants other = v;
        other[i] += i == 0 || i == 2 || i == 4 ? 21 : 300;
        EXPECT_EQ(invariant_votes(v, other), 7) << i;
        EXPECT_EQ(invariant_votes(other, v), 7) << i;
        other[i] = v[i] + 19; // within both kinds of thresholds
        EXPECT_EQ(invariant_votes(v, other), 8) << i;
    }
}

std::vector<Candidate> all_of(int n_left, int n_right)
{
    std::vector<Candidate> out;
    for (int l = 0; l < n_left; l++) {
        for (int r = 0; r < n_right; r++) {
            Candidate c;
            c.left = l;
            c.right = r;
            out.push_back(c);
        }
    }
    return out;
}

// The choice against one by brute force over the definition.
TEST(MatchByInvariants, AreBestForBothSides)
{
    for (unsigned seed = 1; seed <= 20; seed++) {
        SCOPED_TRACE(seed);
        std::mt19937 rng(seed);
        std::uniform_real_distribution<double> level(0, 60);
        std::vector<Invariants> left(9), right(11);
        for (auto *side : {&left, &right})
            for (Invariants &v : *side)
                for (double &value : v) value = level(rng);
        const auto matches = match_by_invariants(left, right, all_of(9, 11));
        for (const InvariantMatch &m : matches) {
            const auto l = static_cast<std::size_t>(m.left), r = static_cast<std::size_t>(m.right);
            EXPECT_EQ(m.votes, invariant_votes(left[l], right[r]));
            EXPECT_GE(m.votes, 3);
            for (const Invariants &other : right) EXPECT_LE(invariant_votes(left[l], other), m.votes);
            for (const Invariants &other : left) EXPECT_LE(invariant_votes(other, right[r]), m.votes);
        }
        EXPECT_FALSE(matches.empty());
    }
}

TEST(MatchByInvariants, EachFindsItselfUnlessTooFewAgreeOrItIsARival)
{
    const std::vector<Invariants> v = {{0, 0, 0, 0, 0, 0, 0, 0}, {90, 900, 90, 900, 90, 900, 900, 900}};
    EXPECT_EQ(match_by_invariants(v, v, all_of(2, 2)).size(), 2U);
    auto candidates = all_of(2, 2);
    candidates[3].is_rival = true;
    EXPECT_EQ(match_by_invariants(v, v, candidates).size(), 1U);
    EXPECT_TRUE(match_by_invariants({v[0]}, {v[1]}, all_of(1, 1)).empty());
    InvariantOptions bad;
    bad.min_votes = 9;
    EXPECT_THROW(match_by_invariants(v, v, candidates, bad), std::invalid_argument);
}

} // namespace
} // namespace outcrop
