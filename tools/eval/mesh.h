/* SPDX-License-Identifier: BSD-3-Clause
 * Triangle meshes: what lies inside, what they cover, how far they are. */
#ifndef OUTCROP_EVAL_MESH_H
#define OUTCROP_EVAL_MESH_H

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

namespace outcrop::eval {

/* Unions of closed shells with outward normals; metres. */
struct Mesh {
    std::vector<Eigen::Vector3d> vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/* Cells of a regular lattice: cell (i, j, k) is centred on
 * first_centre_m + cell_m * (i, j, k); index i + nx * (j + ny * k). */
struct Lattice {
    Eigen::Vector3d first_centre_m = Eigen::Vector3d::Zero();
    double cell_m = 0;
    int nx = 0, ny = 0, nz = 0;

    std::size_t size() const { return std::size_t(nx) * std::size_t(ny) * std::size_t(nz); }
    std::size_t index(int i, int j, int k) const
    {
        return std::size_t(i) + std::size_t(nx) * (std::size_t(j) + std::size_t(ny) * std::size_t(k));
    }
    Eigen::Vector3d centre_m(int i, int j, int k) const { return first_centre_m + cell_m * Eigen::Vector3d(i, j, k); }
};

/* Which cell centres lie inside the mesh, by winding number along vertical
 * columns; so overlapping shells count once. 1 = inside. O(triangles +
 * columns they cover + cells). */
std::vector<std::uint8_t> occupancy(const Mesh &mesh, const Lattice &lattice);

/* Which columns (nx * ny, index i + nx * j) have their centre under the mesh
 * seen from above. */
std::vector<std::uint8_t> coverage(const Mesh &mesh, const Lattice &lattice);

/* About `count` points on the outer surface, spread evenly by area, always the
 * same ones; points that other shells of the union swallow are left out. */
std::vector<Eigen::Vector3d> sample_surface(const Mesh &mesh, int count);

/* Mean distance from points to the nearest point of the mesh's triangles.
 * Exact; O(points * triangles) with a sphere test first. */
double mean_distance_m(const std::vector<Eigen::Vector3d> &points, const Mesh &mesh);

/* The outer faces of occupied cells as a mesh. */
Mesh cell_surface(const std::vector<std::uint8_t> &occupied, const Lattice &lattice);

} // namespace outcrop::eval
#endif
