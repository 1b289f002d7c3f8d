// SPDX-License-Identifier: BSD-3-Clause
// Triangle meshes: what lies inside, what they cover, how far they are.
#include "mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace outcrop::eval {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Columns are moved off their centres by this share of a cell, differently in
// x and y, so that none runs exactly through an edge or a vertex, where a
// crossing would count twice or not at all.
const Vector2d kOffEdge(1.3e-6, 1.9e-6);

struct Crossing {
    std::size_t column;
    double z;
    int step; // +1 into the solid, -1 out of it, going up
};

double cross2(const Vector2d &a, const Vector2d &b)
{
    return a.x() * b.y() - a.y() * b.x();
}

// Calls visit(i, j, z, twice the signed area seen from above) for each column
// of the lattice that the triangle covers.
template <typename Visit>
void for_columns(const std::array<Vector3d, 3> &t, const Lattice &lattice, Visit visit)
{
    const Vector2d a = t[0].head<2>(), b = t[1].head<2>(), c = t[2].head<2>();
    const double area2 = cross2(b - a, c - a);
    if (area2 == 0.0) return; // seen edge-on, covers no column
    const Vector2d first = lattice.first_centre_m.head<2>() + lattice.cell_m * kOffEdge;
    const Vector2d low = (a.cwiseMin(b).cwiseMin(c) - first) / lattice.cell_m;
    const Vector2d high = (a.cwiseMax(b).cwiseMax(c) - first) / lattice.cell_m;
    const int i0 = static_cast<int>(std::clamp(std::ceil(low.x()), 0.0, 1e9));
    const int j0 = static_cast<int>(std::clamp(std::ceil(low.y()), 0.0, 1e9));
    const int i1 = static_cast<int>(std::clamp(std::floor(high.x()), -1.0, lattice.nx - 1.0));
    const int j1 = static_cast<int>(std::clamp(std::floor(high.y()), -1.0, lattice.ny - 1.0));
    for (int j = j0; j <= j1; j++) {
        for (int i = i0; i <= i1; i++) {
            const Vector2d p = first + lattice.cell_m * Vector2d(i, j);
            const double u = cross2(b - p, c - p) / area2, v = cross2(c - p, a - p) / area2;
            const double w = 1 - u - v;
            if (!(u >= 0) || !(v >= 0) || !(w >= 0)) continue;
            visit(i, j, u * t[0].z() + v * t[1].z() + w * t[2].z(), area2);
        }
    }
}

std::array<Vector3d, 3> corners(const Mesh &mesh, const std::array<std::uint32_t, 3> &t)
{
    return {mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]};
}

// Signed crossings of the vertical ray above p; not 0 means inside.
int winding(const Mesh &mesh, const Vector3d &p)
{
    int turns = 0;
    for (const auto &t : mesh.triangles) {
        const auto [a, b, c] = corners(mesh, t);
        const Vector2d q = p.head<2>();
        const double ab = cross2(a.head<2>() - q, b.head<2>() - q);
        const double bc = cross2(b.head<2>() - q, c.head<2>() - q);
        const double ca = cross2(c.head<2>() - q, a.head<2>() - q);
        const double area2 = ab + bc + ca;
        const bool is_hit = (ab > 0 && bc > 0 && ca > 0) || (ab < 0 && bc < 0 && ca < 0);
        if (!is_hit) continue;
        if ((bc * a.z() + ca * b.z() + ab * c.z()) / area2 > p.z()) turns += area2 > 0 ? 1 : -1;
    }
    return turns;
}

// Ericson, Real-Time Collision Detection, 5.1.5.
Vector3d closest_on_triangle(const Vector3d &p, const Vector3d &a, const Vector3d &b, const Vector3d &c)
{
    const Vector3d ab = b - a, ac = c - a, ap = p - a, bp = p - b, cp = p - c;
    const double d1 = ab.dot(ap), d2 = ac.dot(ap), d3 = ab.dot(bp), d4 = ac.dot(bp);
    const double d5 = ab.dot(cp), d6 = ac.dot(cp);
    if (d1 <= 0 && d2 <= 0) return a;
    if (d3 >= 0 && d4 <= d3) return b;
    if (d6 >= 0 && d5 <= d6) return c;
    const double vc = d1 * d4 - d3 * d2, vb = d5 * d2 - d1 * d6, va = d3 * d6 - d5 * d4;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
    if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    const double sum = va + vb + vc;
    return sum > 0 ? Vector3d(a + ab * (vb / sum) + ac * (vc / sum)) : a;
}

} // namespace

std::vector<std::uint8_t> occupancy(const Mesh &mesh, const Lattice &lattice)
{
    std::vector<Crossing> crossings;
    for (const auto &t : mesh.triangles) {
        for_columns(corners(mesh, t), lattice, [&](int i, int j, double z, double area2) {
            crossings.push_back({lattice.index(i, j, 0), z, area2 < 0 ? 1 : -1});
        });
    }
    std::sort(crossings.begin(), crossings.end(), [](const Crossing &a, const Crossing &b) {
        return a.column != b.column ? a.column < b.column : a.z < b.z;
    });
    std::vector<std::uint8_t> inside(lattice.size(), 0);
    const std::size_t layer = lattice.index(0, 0, 1);
    for (std::size_t n = 0; n < crossings.size();) {
        const std::size_t column = crossings[n].column;
        int turns = 0;
        for (int k = 0; k < lattice.nz; k++) {
            const double z = lattice.first_centre_m.z() + lattice.cell_m * k;
            for (; n < crossings.size() && crossings[n].column == column && crossings[n].z <= z; n++)
                turns += crossings[n].step;
            inside[column + layer * std::size_t(k)] = turns != 0;
        }
        while (n < crossings.size() && crossings[n].column == column) n++;
    }
    return inside;
}

std::vector<std::uint8_t> coverage(const Mesh &mesh, const Lattice &lattice)
{
    std::vector<std::uint8_t> covered(std::size_t(lattice.nx) * std::size_t(lattice.ny), 0);
    for (const auto &t : mesh.triangles)
        for_columns(corners(mesh, t), lattice,
                    [&](int i, int j, double, double) { covered[lattice.index(i, j, 0)] = 1; });
    return covered;
}

std::vector<Vector3d> sample_surface(const Mesh &mesh, int count)
{
    std::vector<double> area;
    double total = 0;
    for (const auto &t : mesh.triangles) {
        const auto [a, b, c] = corners(mesh, t);
        area.push_back((b - a).cross(c - a).norm() / 2);
        total += area.back();
    }
    std::vector<Vector3d> points;
    if (!(total > 0)) return points;
    const double off_surface = 1e-4 * std::sqrt(total);
    double owed = 0;
    std::uint64_t n = 0;
    for (std::size_t i = 0; i < area.size(); i++) {
        const auto [a, b, c] = corners(mesh, mesh.triangles[i]);
        for (owed += count * area[i] / total; owed >= 1; owed -= 1, n++) {
            // The R2 sequence (plastic number) fills the unit square evenly.
            double u = std::fmod(0.7548776662466927 * static_cast<double>(n + 1), 1.0);
            double v = std::fmod(0.5698402909980532 * static_cast<double>(n + 1), 1.0);
            if (u + v > 1) {
                u = 1 - u;
                v = 1 - v;
            }
            const Vector3d p = a + u * (b - a) + v * (c - a);
            const Vector3d normal = (b - a).cross(c - a).normalized();
            if (winding(mesh, p + off_surface * normal) == 0) points.push_back(p);
        }
    }
    return points;
}

double mean_distance_m(const std::vector<Vector3d> &points, const Mesh &mesh)
{
    struct Ball {
        Vector3d centre;
        double radius;
    };
    std::vector<Ball> balls;
    for (const auto &t : mesh.triangles) {
        const auto [a, b, c] = corners(mesh, t);
        const Vector3d m = (a + b + c) / 3;
        balls.push_back(
            {m, std::sqrt(std::max({(a - m).squaredNorm(), (b - m).squaredNorm(), (c - m).squaredNorm()}))});
    }
    double sum = 0;
    for (const Vector3d &p : points) {
        double best = std::numeric_limits<double>::infinity();
        for (std::size_t i = 0; i < balls.size(); i++) {
            const double reach = best + balls[i].radius;
            if ((p - balls[i].centre).squaredNorm() >= reach * reach) continue;
            const auto [a, b, c] = corners(mesh, mesh.triangles[i]);
            best = std::min(best, (p - closest_on_triangle(p, a, b, c)).norm());
        }
        sum += best;
    }
    return sum / static_cast<double>(points.size());
}

Mesh cell_surface(const std::vector<std::uint8_t> &occupied, const Lattice &g)
{
    const auto filled = [&](int i, int j, int k) {
        return i >= 0 && j >= 0 && k >= 0 && i < g.nx && j < g.ny && k < g.nz && occupied[g.index(i, j, k)] != 0;
    };
    Mesh mesh;
    const auto add_face = [&](const Vector3d &centre, int axis, int side) {
        const Vector3d n = Vector3d::Unit(axis) * side * (g.cell_m / 2);
        const Vector3d u = Vector3d::Unit((axis + 1) % 3) * (g.cell_m / 2);
        const Vector3d v = Vector3d::Unit((axis + 2) % 3) * side * (g.cell_m / 2);
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vector3d &corner : {Vector3d(-u - v), Vector3d(u - v), Vector3d(u + v), Vector3d(v - u)})
            mesh.vertices.push_back(centre + n + corner);
        mesh.triangles.push_back({first, first + 1, first + 2});
        mesh.triangles.push_back({first, first + 2, first + 3});
    };
    for (int k = 0; k < g.nz; k++)
        for (int j = 0; j < g.ny; j++)
            for (int i = 0; i < g.nx; i++) {
                if (!filled(i, j, k)) continue;
                for (int axis = 0; axis < 3; axis++)
                    for (const int side : {-1, 1})
                        if (!filled(i + side * (axis == 0), j + side * (axis == 1), k + side * (axis == 2)))
                            add_face(g.centre_m(i, j, k), axis, side);
            }
    return mesh;
}

} // namespace outcrop::eval
