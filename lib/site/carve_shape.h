// SPDX-License-Identifier: BSD-3-Clause
// The shape of a carved volume: morphology in three dimensions and its parts.
#pragma once

#include "site/voxels.h"

namespace outcrop {

// What is unknown below something occupied becomes occupied: obstacles stand on the ground. Where an obstacle's own foot
// hides the ground from every view nothing else can be told.
void fill_down(Voxels *voxels);

// Closing by a cube of 2 cells + 1: unknown voxels in gaps between occupied ones become occupied; free ones stay free.
void close_voxels(int cells, Voxels *voxels);

// Opening by a cube of 2 cells + 1: what is taken off becomes unknown.
void open_voxels(int cells, Voxels *voxels);

// Parts joined by faces, edges or corners that have less than min_share of the largest one's voxels become unknown.
void drop_small_parts(double min_share, Voxels *voxels);

} // namespace outcrop
