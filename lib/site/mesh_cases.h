// SPDX-License-Identifier: BSD-3-Clause
// The 256 cases of marching cubes, derived from one rule instead of listed.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

namespace outcrop {

// Corner c of a cube lies at (c & 1, c >> 1 & 1, c >> 2). Edge e joins kCubeEdges[e]: four along x, four along y, four
// along z.
inline constexpr std::array<std::array<int, 2>, 12> kCubeEdges{
    {{0, 1}, {2, 3}, {4, 5}, {6, 7}, {0, 2}, {1, 3}, {4, 6}, {5, 7}, {0, 4}, {1, 5}, {2, 6}, {3, 7}}};

// Loops of edges that separate the inside corners (bits of a case) from the others, counter-clockwise seen from
// outside. On a face whose inside corners lie across, they are separated: both cubes at the face come to the same cut.
using CubeLoops = std::vector<std::vector<int>>;

// A triangle's corners: numbers of edges, or kLoopCentre: the centre of the loop that the triangle is of.
constexpr int kLoopCentre = 12;
struct CubeTriangle {
    std::array<int, 3> corners;
    int loop;
};

struct CubeCase {
    CubeLoops loops;
    std::vector<CubeTriangle> triangles;
};

const std::array<CubeCase, 256> &cube_cases();

} // namespace outcrop
