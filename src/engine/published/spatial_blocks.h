#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace anchorsplat {

// Gaussians enhanced together: those of an octree cell plus a margin of context around it.
struct SpatialBlock {
  std::vector<int64_t> rows;     // Gaussians in the cell and its margin, ascending
  std::vector<float> weights;    // [rows] blending weight of this block's result; sums to 1 over all blocks
  std::array<double, 3> corner;  // lower corner of cell plus margin, in the coordinates of `positions`
  double side = 1;               // side of cell plus margin, same unit
};

struct SpatialBlockOptions {
  int64_t most = 200000;  // Gaussians per cell, and per margin
  double margin = 0.125;  // width of the context around a cell, in cell sides; at most 0.5
};

// Splits `positions` [N,3] in the cube (`corner`, `side`) into octree cells of at most `most` Gaussians, in depth-first
// order. If the whole cube holds no more than that, returns it as one block without margin. A margin with more than
// `most` Gaussians is narrowed to the nearest ones. Cells still too full after 20 halvings (many Gaussians at one
// point) are cut by row. Neighbouring blocks blend: weights fall linearly from 1 to 0 across each face, reaching as far
// into the cell as the margin reaches out.
std::vector<SpatialBlock> SplitIntoBlocks(std::span<const float> positions, const std::array<double, 3>& corner,
                                          double side, const SpatialBlockOptions& options = {});

}  // namespace anchorsplat
