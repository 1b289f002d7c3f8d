// SPDX-License-Identifier: BSD-3-Clause
// Separable morphology on states, and a flood fill.
#include "site/carve_shape.h"

#include <algorithm>
#include <cmath>

namespace outcrop {
namespace {

using Solid = std::vector<std::uint8_t>;

Solid solid_of(const Voxels &voxels)
{
    Solid solid(voxels.states.size());
    std::transform(voxels.states.begin(), voxels.states.end(), solid.begin(),
                   [](VoxelState s) { return static_cast<std::uint8_t>(s == VoxelState::kOccupied); });
    return solid;
}

// Along one line of n cells `stride` apart: `value` spreads `cells` to each side. What lies outside the grid spreads nothing, so
// neither operation eats at its border.
void spread_line(std::uint8_t *line, std::size_t stride, int n, int cells, std::uint8_t value, Solid *scratch)
{
    scratch->resize(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) (*scratch)[static_cast<std::size_t>(i)] = line[static_cast<std::size_t>(i) * stride];
    int last = -cells - 1;
    for (int i = 0; i < n; ++i) {
        if ((*scratch)[static_cast<std::size_t>(i)] == value) last = i;
        if (i - last <= cells) line[static_cast<std::size_t>(i) * stride] = value;
    }
    last = n + cells;
    for (int i = n - 1; i >= 0; --i) {
        if ((*scratch)[static_cast<std::size_t>(i)] == value) last = i;
        if (last - i <= cells) line[static_cast<std::size_t>(i) * stride] = value;
    }
}

void spread(const VoxelGrid &grid, int cells, std::uint8_t value, Solid *solid)
{
    Solid scratch;
    const auto nx = static_cast<std::size_t>(grid.nx), ny = static_cast<std::size_t>(grid.ny);
    for (int k = 0; k < grid.nz; ++k)
        for (int j = 0; j < grid.ny; ++j) spread_line(&(*solid)[grid.at(0, j, k)], 1, grid.nx, cells, value, &scratch);
    for (int k = 0; k < grid.nz; ++k)
        for (int i = 0; i < grid.nx; ++i) spread_line(&(*solid)[grid.at(i, 0, k)], nx, grid.ny, cells, value, &scratch);
    for (int j = 0; j < grid.ny; ++j)
        for (int i = 0; i < grid.nx; ++i)
            spread_line(&(*solid)[grid.at(i, j, 0)], nx * ny, grid.nz, cells, value, &scratch);
}

// Calls visit(at) for the 26 neighbours that are in the grid.
template <class Visit>
void for_neighbours(const VoxelGrid &grid, std::size_t at, const Visit &visit)
{
    const int nx = grid.nx, ny = grid.ny;
    const int i = static_cast<int>(at % static_cast<std::size_t>(nx));
    const std::size_t rest = at / static_cast<std::size_t>(nx);
    const int j = static_cast<int>(rest % static_cast<std::size_t>(ny));
    const int k = static_cast<int>(rest / static_cast<std::size_t>(ny));
    for (int dk = -1; dk <= 1; ++dk)
        for (int dj = -1; dj <= 1; ++dj)
            for (int di = -1; di <= 1; ++di)
                if ((di || dj || dk) && grid.has(i + di, j + dj, k + dk)) visit(grid.at(i + di, j + dj, k + dk));
}

} // namespace

void fill_down(Voxels *voxels)
{
    const VoxelGrid &grid = voxels->grid;
    for (int j = 0; j < grid.ny; ++j) {
        for (int i = 0; i < grid.nx; ++i) {
            bool is_under = false;
            for (int k = grid.nz - 1; k >= 0; --k) {
                VoxelState &state = voxels->states[grid.at(i, j, k)];
                if (state == VoxelState::kOccupied) is_under = true;
                if (state == VoxelState::kUnknown && is_under) state = VoxelState::kOccupied;
            }
        }
    }
}

void close_voxels(int cells, Voxels *voxels)
{
    if (cells <= 0) return;
    Solid solid = solid_of(*voxels);
    spread(voxels->grid, cells, 1, &solid);
    spread(voxels->grid, cells, 0, &solid);
    for (std::size_t at = 0; at < solid.size(); ++at)
        if (solid[at] && voxels->states[at] == VoxelState::kUnknown) voxels->states[at] = VoxelState::kOccupied;
}

void open_voxels(int cells, Voxels *voxels)
{
    if (cells <= 0) return;
    Solid solid = solid_of(*voxels);
    spread(voxels->grid, cells, 0, &solid);
    spread(voxels->grid, cells, 1, &solid);
    for (std::size_t at = 0; at < solid.size(); ++at)
        if (!solid[at] && voxels->states[at] == VoxelState::kOccupied) voxels->states[at] = VoxelState::kUnknown;
}

void drop_small_parts(double min_share, Voxels *voxels)
{
    std::vector<int> part(voxels->states.size(), -1);
    std::vector<std::size_t> sizes, stack;
    for (std::size_t seed = 0; seed < part.size(); ++seed) {
        if (voxels->states[seed] != VoxelState::kOccupied || part[seed] >= 0) continue;
        const int label = static_cast<int>(sizes.size());
        std::size_t size = 0;
        part[seed] = label;
        stack.push_back(seed);
        while (!stack.empty()) {
            const std::size_t at = stack.back();
            stack.pop_back();
            ++size;
            for_neighbours(voxels->grid, at, [&](std::size_t next) {
                if (part[next] >= 0 || voxels->states[next] != VoxelState::kOccupied) return;
                part[next] = label;
                stack.push_back(next);
            });
        }
        sizes.push_back(size);
    }
    if (sizes.size() < 2) return;
    const double least = min_share * static_cast<double>(*std::max_element(sizes.begin(), sizes.end()));
    for (std::size_t at = 0; at < part.size(); ++at)
        if (part[at] >= 0 && static_cast<double>(sizes[static_cast<std::size_t>(part[at])]) < least)
            voxels->states[at] = VoxelState::kUnknown;
}

} // namespace outcrop
