#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace anchorsplat {

// A part of a cloud that is enhanced at once: the Gaussians of an octree cell, and those around it as context.
struct SpatialBlock {
  std::vector<int64_t> rows;     // ascending; all Gaussians within the cell and its margin
  std::vector<float> weights;    // [rows] share of this block in each Gaussian's result; over all blocks they sum to 1
  std::array<double, 3> corner;  // of the cell with its margin, in the coordinates that were given
  double side = 1;               // of the same
};

struct SpatialBlockOptions {
  int64_t most = 200000;  // Gaussians of a cell, and of a margin
  double margin = 0.125;  // context around a cell, in sides of the cell; at most 0.5
};

// Splits `positions` [N,3] within the cube `corner`, `side` into octree cells of at most `most` Gaussians each; one
// block for the whole cube, without margin, when that is enough. A margin that holds more than `most` is made narrower:
// the nearest ones stay. Cells that hold more after 20 halvings (many Gaussians at one point) are cut by row instead.
// Weights fall linearly from 1 to 0 over a strip as far within the cell's faces as the margin lies without, so that
// blocks blend into each other. The order of the blocks is that of a depth-first walk.
std::vector<SpatialBlock> SplitIntoBlocks(std::span<const float> positions, const std::array<double, 3>& corner,
                                          double side, const SpatialBlockOptions& options = {});

}  // namespace anchorsplat
