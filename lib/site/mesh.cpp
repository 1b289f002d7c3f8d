// SPDX-License-Identifier: BSD-3-Clause
// The 256 ways to cut a cube are derived here from the rule for its faces, not tabled.
#include "site/mesh.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <unordered_map>

#include <Eigen/Geometry>

namespace outcrop {
namespace {

// Corner c of a cube is at (c & 1, c >> 1 & 1, c >> 2 & 1). Edges join corners that differ in one bit.
struct CubeEdge {
    int from, to, axis;
};

// Corners of each face in order round it, counter-clockwise seen from outside.
constexpr int kFaces[6][4] = {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}};

class CubeTable {
public:
    CubeTable()
    {
        for (int axis = 0; axis < 3; axis++)
            for (int c = 0; c < 8; c++)
                if (!(c >> axis & 1)) edges_.push_back({c, c | 1 << axis, axis});
        for (int a = 0; a < 8; a++)
            for (int b = 0; b < 8; b++) edge_at_[a][b] = -1;
        for (std::size_t e = 0; e < edges_.size(); e++)
            edge_at_[edges_[e].from][edges_[e].to] = edge_at_[edges_[e].to][edges_[e].from] = static_cast<int>(e);
        for (int inside = 0; inside < 256; inside++) loops_[inside] = loops_of(inside);
    }

    const std::vector<CubeEdge> &edges() const { return edges_; }
    const std::vector<std::vector<int>> &loops(int inside) const { return loops_[inside]; }

private:
    // Round each face, each run of inside corners is cut off by a segment from where the boundary goes in to where it
    // leaves; two runs are two segments, so inside corners across a face stay apart. Seen from outside the inside lies
    // to one side of every segment, so segments of all faces join into loops.
    std::vector<std::vector<int>> loops_of(int inside) const
    {
        int next[12];
        std::fill(std::begin(next), std::end(next), -1);
        for (const auto &face : kFaces) {
            for (int i = 0; i < 4; i++) {
                const int a = face[i], b = face[(i + 1) % 4];
                if ((inside >> a & 1) || !(inside >> b & 1)) continue; // goes in between a and b
                int j = i + 1;
                while (inside >> face[(j + 1) % 4] & 1) j++;
                const int leaves = edge_at_[face[j % 4]][face[(j + 1) % 4]];
                next[leaves] = edge_at_[a][b];
            }
        }
        std::vector<std::vector<int>> loops;
        bool is_done[12] = {};
        for (int e = 0; e < 12; e++) {
            if (next[e] < 0 || is_done[e]) continue;
            std::vector<int> loop;
            for (int at = e; !is_done[at]; at = next[at]) {
                is_done[at] = true;
                loop.push_back(at);
            }
            loops.push_back(loop);
        }
        return loops;
    }

    std::vector<CubeEdge> edges_;
    int edge_at_[8][8];
    std::vector<std::vector<int>> loops_[256];
};

// Occupancy with two free layers round it.
struct Field {
    int nx, ny, nz;
    std::vector<float> value;

    float &at(int i, int j, int k)
    {
        return value[(static_cast<std::size_t>(k) * static_cast<std::size_t>(ny) + static_cast<std::size_t>(j)) *
                         static_cast<std::size_t>(nx) +
                     static_cast<std::size_t>(i)];
    }
};

constexpr int kPad = 2;

Field field_of(const VoxelGrid &grid)
{
    Field field{grid.nx + 2 * kPad, grid.ny + 2 * kPad, grid.nz + 2 * kPad, {}};
    field.value.assign(static_cast<std::size_t>(field.nx) * static_cast<std::size_t>(field.ny) *
                           static_cast<std::size_t>(field.nz),
                       0.0f);
    for (int k = 0; k < grid.nz; k++)
        for (int j = 0; j < grid.ny; j++)
            for (int i = 0; i < grid.nx; i++)
                if (grid.is_occupied(i, j, k)) field.at(i + kPad, j + kPad, k + kPad) = 1;
    return field;
}

// Mean of three along one axis, in place; the ends stay.
void smooth_along(std::vector<float> *value, std::size_t n, std::size_t pitch)
{
    for (std::size_t start = 0; start < value->size(); start++) {
        if (start / pitch % n != 0) continue;
        float before = (*value)[start];
        for (std::size_t i = 1; i + 1 < n; i++) {
            float &here = (*value)[start + i * pitch];
            const float old = here;
            here = (before + old + (*value)[start + (i + 1) * pitch]) / 3;
            before = old;
        }
    }
}

void smooth(Field *field)
{
    const auto nx = static_cast<std::size_t>(field->nx), ny = static_cast<std::size_t>(field->ny);
    smooth_along(&field->value, nx, 1);
    smooth_along(&field->value, ny, nx);
    smooth_along(&field->value, static_cast<std::size_t>(field->nz), nx * ny);
}

class Mesher {
public:
    Mesher(const VoxelGrid &grid, int smoothing) : grid_(grid), field_(field_of(grid))
    {
        for (int i = 0; i < smoothing; i++) smooth(&field_);
    }

    Mesh make()
    {
        static const CubeTable table;
        for (int k = 0; k + 1 < field_.nz; k++)
            for (int j = 0; j + 1 < field_.ny; j++)
                for (int i = 0; i + 1 < field_.nx; i++) add_cube(table, i, j, k);
        return std::move(mesh_);
    }

private:
    void add_cube(const CubeTable &table, int i, int j, int k)
    {
        float values[8];
        int inside = 0;
        for (int c = 0; c < 8; c++) {
            values[c] = field_.at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1));
            if (values[c] > 0.5f) inside |= 1 << c;
        }
        if (inside == 0 || inside == 255) return;
        for (const std::vector<int> &loop : table.loops(inside)) {
            std::vector<std::uint32_t> corners;
            for (const int e : loop) {
                const CubeEdge &edge = table.edges()[static_cast<std::size_t>(e)];
                corners.push_back(vertex(i + (edge.from & 1), j + (edge.from >> 1 & 1), k + (edge.from >> 2 & 1),
                                         edge.axis, values[edge.from], values[edge.to]));
            }
            // Fans round a point of its own, so that no diagonal can lie on another's.
            if (corners.size() > 3) {
                add_fan(corners);
            } else {
                mesh_.triangles.push_back({corners[0], corners[1], corners[2]});
            }
        }
    }

    void add_fan(const std::vector<std::uint32_t> &corners)
    {
        Eigen::Vector3f middle = Eigen::Vector3f::Zero();
        for (const std::uint32_t c : corners) middle += mesh_.vertices[c];
        middle /= static_cast<float>(corners.size());
        const auto centre = static_cast<std::uint32_t>(mesh_.vertices.size());
        mesh_.vertices.push_back(middle);
        mesh_.colours.push_back(mesh_.colours[corners[0]]);
        for (std::size_t c = 0; c < corners.size(); c++)
            mesh_.triangles.push_back({centre, corners[c], corners[(c + 1) % corners.size()]});
    }

    // On the field's edge from (i, j, k) along an axis.
    std::uint32_t vertex(int i, int j, int k, int axis, float from, float to)
    {
        const std::uint64_t key =
            ((static_cast<std::uint64_t>(k) * static_cast<std::uint64_t>(field_.ny) + static_cast<std::uint64_t>(j)) *
                 static_cast<std::uint64_t>(field_.nx) +
             static_cast<std::uint64_t>(i)) *
                3 +
            static_cast<std::uint64_t>(axis);
        const auto [known, is_new] = vertices_.try_emplace(key, static_cast<std::uint32_t>(mesh_.vertices.size()));
        if (!is_new) return known->second;
        // Never quite at a corner: vertices of two edges must not fall together.
        const float t = std::clamp((0.5f - from) / (to - from), 0.02f, 0.98f);
        Eigen::Vector3d at(i - kPad + 0.5, j - kPad + 0.5, k - kPad + 0.5);
        at[axis] += static_cast<double>(t);
        mesh_.vertices.push_back((grid_.min_m + grid_.size_m * at).cast<float>());
        mesh_.colours.push_back(colour_near(i - kPad, j - kPad, k - kPad));
        return known->second;
    }

    cv::Vec3b colour_near(int i, int j, int k) const
    {
        const cv::Vec3b none(150, 150, 150);
        if (grid_.colour.empty()) return none;
        cv::Vec3b best = none;
        int least = 1 << 20;
        for (int dk = -1; dk <= 1; dk++) {
            for (int dj = -1; dj <= 1; dj++) {
                for (int di = -1; di <= 1; di++) {
                    if (!grid_.is_surface(i + di, j + dj, k + dk)) continue;
                    const cv::Vec3b &colour = grid_.colour[grid_.index(i + di, j + dj, k + dk)];
                    const int distance = 4 * (di * di + dj * dj + dk * dk) + (colour == none ? 100 : 0);
                    if (distance < least) least = distance, best = colour;
                }
            }
        }
        return best;
    }

    const VoxelGrid &grid_;
    Field field_;
    Mesh mesh_;
    std::unordered_map<std::uint64_t, std::uint32_t> vertices_;
};

} // namespace

Mesh mesh_of(const VoxelGrid &grid, int smoothing)
{
    return Mesher(grid, smoothing).make();
}

double volume_of(const Mesh &mesh)
{
    double six = 0;
    for (const auto &t : mesh.triangles) {
        const Eigen::Vector3d a = mesh.vertices[t[0]].cast<double>(), b = mesh.vertices[t[1]].cast<double>(),
                              c = mesh.vertices[t[2]].cast<double>();
        six += a.dot(b.cross(c));
    }
    return six / 6;
}

} // namespace outcrop
