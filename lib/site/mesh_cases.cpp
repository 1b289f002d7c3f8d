// SPDX-License-Identifier: BSD-3-Clause
// Face by face: the cuts of a face, joined to loops, filled with triangles.
#include "site/mesh_cases.h"

#include <algorithm>

namespace outcrop {
namespace {

// Corners of the six faces, counter-clockwise seen from outside.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

int edge_between(int a, int b)
{
    for (std::size_t e = 0; e < kCubeEdges.size(); ++e)
        if ((kCubeEdges[e][0] == a && kCubeEdges[e][1] == b) || (kCubeEdges[e][0] == b && kCubeEdges[e][1] == a))
            return static_cast<int>(e);
    return -1;
}

bool is_inside(int bits, int corner)
{
    return (bits >> corner & 1) != 0;
}

// next[e]: the edge that follows e along a loop, or -1. Each cut of a face runs from where the face's border enters a
// run of inside corners to where it leaves it.
std::array<int, 12> successors(int bits)
{
    std::array<int, 12> next;
    next.fill(-1);
    for (const auto &face : kFaces)
        for (int n = 0; n < 4; ++n) {
            // A run of inside corners begins at n.
            if (is_inside(bits, face[(n + 3) % 4]) || !is_inside(bits, face[n])) continue;
            int last = n;
            while (is_inside(bits, face[(last + 1) % 4])) last = (last + 1) % 4;
            const int enters = edge_between(face[(n + 3) % 4], face[n]);
            const int leaves = edge_between(face[last], face[(last + 1) % 4]);
            next[static_cast<std::size_t>(enters)] = leaves;
        }
    return next;
}

CubeLoops loops_of(int bits)
{
    const std::array<int, 12> next = successors(bits);
    std::array<bool, 12> is_used{};
    CubeLoops loops;
    for (int first = 0; first < 12; ++first) {
        if (next[static_cast<std::size_t>(first)] < 0 || is_used[static_cast<std::size_t>(first)]) continue;
        std::vector<int> loop;
        for (int e = first; !is_used[static_cast<std::size_t>(e)]; e = next[static_cast<std::size_t>(e)]) {
            is_used[static_cast<std::size_t>(e)] = true;
            loop.push_back(e);
        }
        loops.push_back(loop);
    }
    return loops;
}

bool share_face(int edge_a, int edge_b)
{
    return std::any_of(std::begin(kFaces), std::end(kFaces), [&](const auto &face) {
        const auto has = [&](int corner) { return std::find(face, face + 4, corner) != face + 4; };
        const auto &a = kCubeEdges[static_cast<std::size_t>(edge_a)], &b = kCubeEdges[static_cast<std::size_t>(edge_b)];
        return has(a[0]) && has(a[1]) && has(b[0]) && has(b[1]);
    });
}

// A fan from corner n of the loop is sound when none of its diagonals lies in a face of the cube: there it might be an
// edge of the neighbour's triangles too.
bool is_sound_fan(const std::vector<int> &loop, std::size_t n)
{
    for (std::size_t i = 2; i + 1 < loop.size(); ++i)
        if (share_face(loop[n], loop[(n + i) % loop.size()])) return false;
    return true;
}

void fill(const std::vector<int> &loop, int number, std::vector<CubeTriangle> *triangles)
{
    const std::size_t size = loop.size();
    for (std::size_t n = 0; n < size; ++n) {
        if (!is_sound_fan(loop, n)) continue;
        for (std::size_t i = 1; i + 1 < size; ++i)
            triangles->push_back({{loop[n], loop[(n + i) % size], loop[(n + i + 1) % size]}, number});
        return;
    }
    for (std::size_t i = 0; i < size; ++i) triangles->push_back({{kLoopCentre, loop[i], loop[(i + 1) % size]}, number});
}

std::array<CubeCase, 256> derive()
{
    std::array<CubeCase, 256> cases;
    for (int bits = 0; bits < 256; ++bits) {
        CubeCase &c = cases[static_cast<std::size_t>(bits)];
        c.loops = loops_of(bits);
        for (std::size_t n = 0; n < c.loops.size(); ++n) fill(c.loops[n], static_cast<int>(n), &c.triangles);
    }
    return cases;
}

} // namespace

const std::array<CubeCase, 256> &cube_cases()
{
    static const std::array<CubeCase, 256> cases = derive();
    return cases;
}

} // namespace outcrop
