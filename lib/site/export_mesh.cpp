// SPDX-License-Identifier: BSD-3-Clause
// Carved obstacles as PLY files.
#include "site/export_mesh.h"

#include <cstring>

#include "site/atomic_file.h"

namespace outcrop {
namespace {

// Little-endian hosts only, as elsewhere in the base's files.
template <class T>
void put(const T &value, std::string *out)
{
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out->append(bytes, sizeof bytes);
}

void put_vertex(const Eigen::Vector3f &p, const cv::Vec3b &colour, std::string *out)
{
    for (int axis = 0; axis < 3; ++axis) put(p[axis], out);
    for (int c = 0; c < 3; ++c) put(colour[c], out);
}

std::string header(std::size_t n_vertices)
{
    return "ply\nformat binary_little_endian 1.0\nelement vertex " + std::to_string(n_vertices) +
           "\nproperty float x\nproperty float y\nproperty float z\n"
           "property uchar red\nproperty uchar green\nproperty uchar blue\n";
}

} // namespace

std::string voxels_ply(const Voxels &voxels)
{
    const VoxelGrid &grid = voxels.grid;
    std::string body;
    std::size_t n = 0;
    for (int k = 0; k < grid.nz; ++k)
        for (int j = 0; j < grid.ny; ++j)
            for (int i = 0; i < grid.nx; ++i) {
                if (!voxels.is_occupied(i, j, k)) continue;
                ++n;
                const cv::Vec3b colour =
                    voxels.colours.empty() ? cv::Vec3b(200, 200, 200) : voxels.colours[grid.at(i, j, k)];
                put_vertex(grid.centre(i, j, k).cast<float>(), colour, &body);
            }
    return header(n) + "end_header\n" + body;
}

std::string mesh_ply(const SurfaceMesh &mesh)
{
    std::string out = header(mesh.vertices.size()) + "element face " + std::to_string(mesh.triangles.size()) +
                      "\nproperty list uchar int vertex_indices\nend_header\n";
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) put_vertex(mesh.vertices[v], mesh.colours[v], &out);
    for (const auto &t : mesh.triangles) {
        put(static_cast<unsigned char>(3), &out);
        for (const std::uint32_t v : t) put(static_cast<std::int32_t>(v), &out);
    }
    return out;
}

void write_voxels(const std::string &dir, int index, const Voxels &voxels)
{
    write_whole(dir + "/" + std::to_string(index) + ".voxels.ply", voxels_ply(voxels));
}

void write_mesh(const std::string &dir, int index, const SurfaceMesh &mesh)
{
    write_whole(dir + "/" + std::to_string(index) + ".ply", mesh_ply(mesh));
}

} // namespace outcrop
