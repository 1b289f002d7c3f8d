// SPDX-License-Identifier: BSD-3-Clause
// Surfaces are closed, face outwards and hold what is occupied and nothing else: all cubes, random grids, a ball.
#include "site/mesh.h"

#include <cmath>
#include <map>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "site/mesh_cases.h"

namespace outcrop {
namespace {

using Eigen::Vector3d;

constexpr unsigned kSeed = 2187;

Voxels grid_of(int nx, int ny, int nz, double cell_m = 0.1)
{
    Voxels v;
    v.grid = {Vector3d(-1, 2, 0), cell_m, nx, ny, nz};
    v.states.assign(v.grid.size(), VoxelState::kFree);
    return v;
}

void expect_closed(const SurfaceMesh &mesh)
{
    std::map<std::pair<std::uint32_t, std::uint32_t>, int> directed;
    for (const auto &t : mesh.triangles)
        for (std::size_t n = 0; n < 3; ++n) {
            ASSERT_LT(t[n], mesh.vertices.size());
            ASSERT_NE(t[n], t[(n + 1) % 3]);
            ++directed[{t[n], t[(n + 1) % 3]}];
        }
    for (const auto &[edge, count] : directed) {
        ASSERT_EQ(count, 1);
        const auto back = directed.find({edge.second, edge.first});
        ASSERT_TRUE(back != directed.end());
    }
    ASSERT_EQ(mesh.colours.size(), mesh.vertices.size());
}

double volume_of(const SurfaceMesh &mesh)
{
    double six = 0;
    for (const auto &t : mesh.triangles)
        six += mesh.vertices[t[0]].cast<double>().dot(
            mesh.vertices[t[1]].cast<double>().cross(mesh.vertices[t[2]].cast<double>()));
    return six / 6;
}

// Solid angle of the surface seen from p, in whole turns: 1 inside, 0 outside.
double winding(const SurfaceMesh &mesh, const Vector3d &p)
{
    double sum = 0;
    for (const auto &t : mesh.triangles) {
        const Vector3d a = mesh.vertices[t[0]].cast<double>() - p, b = mesh.vertices[t[1]].cast<double>() - p,
                       c = mesh.vertices[t[2]].cast<double>() - p;
        const double la = a.norm(), lb = b.norm(), lc = c.norm();
        sum += 2 * std::atan2(a.dot(b.cross(c)), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
    }
    return sum / (4 * M_PI);
}

void expect_holds(const SurfaceMesh &mesh, const Voxels &v)
{
    for (int k = 0; k < v.grid.nz; ++k)
        for (int j = 0; j < v.grid.ny; ++j)
            for (int i = 0; i < v.grid.nx; ++i)
                ASSERT_NEAR(winding(mesh, v.grid.centre(i, j, k)), v.is_occupied(i, j, k) ? 1 : 0, 1e-3)
                    << i << ' ' << j << ' ' << k;
}

TEST(Mesh, EveryCubeIsClosedAndHoldsItsCorners)
{
    for (int bits = 0; bits < 256; ++bits) {
        SCOPED_TRACE(bits);
        Voxels v = grid_of(2, 2, 2);
        for (std::size_t c = 0; c < 8; ++c)
            if (bits >> c & 1) v.states[c] = VoxelState::kOccupied;
        const SurfaceMesh mesh = mesh_of(v);
        EXPECT_EQ(mesh.triangles.empty(), bits == 0);
        expect_closed(mesh);
        expect_holds(mesh, v);
        EXPECT_EQ(volume_of(mesh) > 0, bits != 0);
    }
}

TEST(Mesh, RandomGridsAreClosed)
{
    for (unsigned seed = kSeed; seed < kSeed + 16; ++seed) {
        SCOPED_TRACE(seed);
        std::mt19937 rng(seed);
        Voxels v =
            grid_of(3 + static_cast<int>(rng() % 5), 3 + static_cast<int>(rng() % 5), 3 + static_cast<int>(rng() % 5));
        const unsigned density = 10 + rng() % 80;
        for (VoxelState &s : v.states)
            if (rng() % 100 < density) s = rng() % 9 ? VoxelState::kOccupied : VoxelState::kUnknown;
        const SurfaceMesh mesh = mesh_of(v);
        expect_closed(mesh);
        expect_holds(mesh, v);
    }
}

TEST(Mesh, BallHasItsVolumeAndItsSmoothness)
{
    const double radius = 0.9;
    Voxels v = grid_of(44, 44, 44, 0.05);
    const Vector3d middle = v.grid.low + Vector3d(1.1, 1.1, 1.1);
    for (int k = 0; k < 44; ++k)
        for (int j = 0; j < 44; ++j)
            for (int i = 0; i < 44; ++i)
                if ((v.grid.centre(i, j, k) - middle).norm() < radius)
                    v.states[v.grid.at(i, j, k)] = VoxelState::kOccupied;
    const SurfaceMesh mesh = mesh_of(v);
    expect_closed(mesh);
    EXPECT_NEAR(volume_of(mesh) / (4.0 / 3 * M_PI * std::pow(radius, 3)), 1, 0.03);
    for (const Eigen::Vector3f &p : mesh.vertices) EXPECT_NEAR((p.cast<double>() - middle).norm(), radius, 0.05);
}

TEST(Mesh, StandsOnTheGround)
{
    Voxels v = grid_of(22, 22, 22);
    for (int k = 0; k < 20; ++k)
        for (int j = 1; j < 21; ++j)
            for (int i = 1; i < 21; ++i) v.states[v.grid.at(i, j, k)] = VoxelState::kOccupied;
    const SurfaceMesh mesh = mesh_of(v);
    float lowest = 1;
    for (const Eigen::Vector3f &p : mesh.vertices) lowest = std::min(lowest, p.z());
    EXPECT_NEAR(lowest, 0, 1e-6);
    EXPECT_NEAR(volume_of(mesh), 8, 0.3); // edges are rounded by about half a cell
}

TEST(Mesh, TakesColourFromTheOccupiedSide)
{
    Voxels v = grid_of(3, 3, 3);
    v.states[v.grid.at(1, 1, 1)] = VoxelState::kOccupied;
    v.colours.assign(v.grid.size(), {1, 2, 3});
    v.colours[v.grid.at(1, 1, 1)] = {10, 20, 30};
    for (const cv::Vec3b &c : mesh_of(v).colours) EXPECT_EQ(c, cv::Vec3b(10, 20, 30));
    v.states.assign(v.grid.size(), VoxelState::kUnknown);
    EXPECT_TRUE(mesh_of(v).vertices.empty());
}

// The rule behind the cases: the same cut from both sides of a face, so complementary cubes have complementary loops.
TEST(MeshCases, EveryCrossedEdgeIsInOneLoop)
{
    for (int bits = 0; bits < 256; ++bits) {
        std::array<int, 12> times{};
        for (const auto &loop : cube_cases()[static_cast<std::size_t>(bits)].loops) {
            EXPECT_GE(loop.size(), 3U);
            for (const int e : loop) ++times[static_cast<std::size_t>(e)];
        }
        for (std::size_t e = 0; e < 12; ++e) {
            const bool is_crossed = (bits >> kCubeEdges[e][0] & 1) != (bits >> kCubeEdges[e][1] & 1);
            EXPECT_EQ(times[e], is_crossed) << bits << ' ' << e;
        }
    }
}

} // namespace
} // namespace outcrop
