// SPDX-License-Identifier: BSD-3-Clause
// Marching cubes.
#include "site/mesh.h"

#include <algorithm>

#include "site/mesh_cases.h"

namespace outcrop {
namespace {

constexpr float kLevel = 0.5F;
constexpr float kClearance = 0.05F; // least distance of the field from the level, on its proper side

// The field at voxel centres, one layer of outside cells round the grid.
class Field {
public:
    explicit Field(const Voxels &voxels)
        : nx_(voxels.grid.nx + 2), ny_(voxels.grid.ny + 2), nz_(voxels.grid.nz + 2),
          inside_(static_cast<std::size_t>(nx_) * static_cast<std::size_t>(ny_) * static_cast<std::size_t>(nz_), 0)
    {
        for (int k = 0; k < voxels.grid.nz; ++k)
            for (int j = 0; j < voxels.grid.ny; ++j)
                for (int i = 0; i < voxels.grid.nx; ++i) inside_[at(i, j, k)] = voxels.is_occupied(i, j, k);
    }

    std::size_t at(int i, int j, int k) const
    {
        return static_cast<std::size_t>(i + 1) +
               static_cast<std::size_t>(nx_) *
                   (static_cast<std::size_t>(j + 1) + static_cast<std::size_t>(ny_) * static_cast<std::size_t>(k + 1));
    }
    bool is_inside(int i, int j, int k) const { return inside_[at(i, j, k)] != 0; }
    std::size_t size() const { return inside_.size(); }

    // Averaged, but never across the level. Below the ground the body is thought to go on.
    float value(int i, int j, int k) const
    {
        int sum = 0;
        for (int dk = -1; dk <= 1; ++dk)
            for (int dj = -1; dj <= 1; ++dj)
                for (int di = -1; di <= 1; ++di) sum += is_inside_or_beyond(i + di, j + dj, k + dk);
        const float mean = static_cast<float>(sum) / 27;
        return is_inside(i, j, k) ? std::max(mean, kLevel + kClearance) : std::min(mean, kLevel - kClearance);
    }

private:
    bool is_inside_or_beyond(int i, int j, int k) const
    {
        if (k < 0) k = 0;
        if (i < -1 || j < -1 || i > nx_ - 2 || j > ny_ - 2 || k > nz_ - 2) return false;
        return is_inside(i, j, k);
    }

    int nx_, ny_, nz_;
    std::vector<std::uint8_t> inside_;
};

class Marcher {
public:
    explicit Marcher(const Voxels &voxels) : voxels_(voxels), field_(voxels)
    {
        for (auto &line : on_edge_) line.assign(field_.size(), kNone);
    }

    SurfaceMesh run()
    {
        const VoxelGrid &g = voxels_.grid;
        for (int k = -1; k < g.nz; ++k)
            for (int j = -1; j < g.ny; ++j)
                for (int i = -1; i < g.nx; ++i) march(i, j, k);
        return std::move(mesh_);
    }

private:
    static constexpr std::uint32_t kNone = 0xffffffffU;

    void march(int i, int j, int k)
    {
        int bits = 0;
        for (int c = 0; c < 8; ++c) bits |= field_.is_inside(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)) << c;
        if (bits == 0 || bits == 255) return;
        const CubeCase &cut = cube_cases()[static_cast<std::size_t>(bits)];
        std::array<std::uint32_t, 4> centres;
        centres.fill(kNone);
        for (const CubeTriangle &t : cut.triangles) {
            std::array<std::uint32_t, 3> triangle;
            for (std::size_t n = 0; n < 3; ++n)
                triangle[n] = t.corners[n] == kLoopCentre
                                  ? loop_centre(i, j, k, cut.loops[static_cast<std::size_t>(t.loop)],
                                                &centres[static_cast<std::size_t>(t.loop)])
                                  : vertex(i, j, k, t.corners[n]);
            mesh_.triangles.push_back(triangle);
        }
    }

    std::uint32_t vertex(int i, int j, int k, int edge)
    {
        const auto &ends = kCubeEdges[static_cast<std::size_t>(edge)];
        const int a = ends[0], b = ends[1], axis = edge / 4;
        const Eigen::Vector3i from(i + (a & 1), j + (a >> 1 & 1), k + (a >> 2));
        const Eigen::Vector3i to(i + (b & 1), j + (b >> 1 & 1), k + (b >> 2));
        std::uint32_t &number = on_edge_[static_cast<std::size_t>(axis)][field_.at(from.x(), from.y(), from.z())];
        if (number != kNone) return number;
        number = static_cast<std::uint32_t>(mesh_.vertices.size());
        double t = 0.5;
        if (from.z() >= 0) { // else between the ground's cells and what is below: at Z = 0
            const double f = static_cast<double>(field_.value(from.x(), from.y(), from.z()));
            const double g = static_cast<double>(field_.value(to.x(), to.y(), to.z()));
            t = (static_cast<double>(kLevel) - f) / (g - f);
        }
        const Eigen::Vector3d p =
            voxels_.grid.centre(from.x(), from.y(), from.z()) + t * voxels_.grid.cell_m * (to - from).cast<double>();
        mesh_.vertices.push_back(p.cast<float>());
        const Eigen::Vector3i &in = field_.is_inside(from.x(), from.y(), from.z()) ? from : to;
        mesh_.colours.push_back(voxels_.colours.empty() ? cv::Vec3b(200, 200, 200)
                                                        : voxels_.colours[voxels_.grid.at(in.x(), in.y(), in.z())]);
        return number;
    }

    std::uint32_t loop_centre(int i, int j, int k, const std::vector<int> &loop, std::uint32_t *number)
    {
        if (*number != kNone) return *number;
        Eigen::Vector3f position = Eigen::Vector3f::Zero();
        cv::Vec3f colour(0, 0, 0);
        for (const int edge : loop) {
            const std::uint32_t v = vertex(i, j, k, edge);
            position += mesh_.vertices[v];
            colour += cv::Vec3f(mesh_.colours[v]);
        }
        const float n = static_cast<float>(loop.size());
        *number = static_cast<std::uint32_t>(mesh_.vertices.size());
        mesh_.vertices.emplace_back(position / n);
        mesh_.colours.emplace_back(colour * (1 / n));
        return *number;
    }

    const Voxels &voxels_;
    Field field_;
    std::array<std::vector<std::uint32_t>, 3> on_edge_; // vertex on the edge along x, y, z from a centre
    SurfaceMesh mesh_;
};

} // namespace

SurfaceMesh mesh_of(const Voxels &voxels)
{
    return Marcher(voxels).run();
}

} // namespace outcrop
