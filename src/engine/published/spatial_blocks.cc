#include "published/spatial_blocks.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

namespace anchorsplat {

namespace {

constexpr int kDeepest = 20;

struct Cell {
  std::array<double, 3> corner;
  double side;
  std::vector<int64_t> rows;  // ascending
};

void Split(std::span<const float> positions, Cell cell, int depth, int64_t most, std::vector<Cell>& leaves) {
  if (cell.rows.empty()) return;
  if (static_cast<int64_t>(cell.rows.size()) <= most) {
    leaves.push_back(std::move(cell));
    return;
  }
  if (depth == kDeepest) {
    for (size_t begin = 0; begin < cell.rows.size(); begin += static_cast<size_t>(most)) {
      const auto end = std::min(cell.rows.size(), begin + static_cast<size_t>(most));
      leaves.push_back({cell.corner,
                        cell.side,
                        {cell.rows.begin() + static_cast<std::ptrdiff_t>(begin),
                         cell.rows.begin() + static_cast<std::ptrdiff_t>(end)}});
    }
    return;
  }
  const double half = cell.side / 2;
  std::array<Cell, 8> children;
  for (size_t child = 0; child < 8; ++child) {
    children[child].side = half;
    for (size_t axis = 0; axis < 3; ++axis) {
      children[child].corner[axis] = cell.corner[axis] + ((child >> (2 - axis) & 1) != 0 ? half : 0);
    }
  }
  for (const int64_t row : cell.rows) {
    size_t child = 0;
    for (size_t axis = 0; axis < 3; ++axis) {
      child = child << 1 | (positions[static_cast<size_t>(3 * row) + axis] >= cell.corner[axis] + half ? 1 : 0);
    }
    children[child].rows.push_back(row);
  }
  cell.rows = {};
  for (Cell& child : children) Split(positions, std::move(child), depth + 1, most, leaves);
}

// Maximum over the axes of the distance from a point to a cell, 0 inside.
double Distance(const float* point, const Cell& cell) {
  double distance = 0;
  for (size_t axis = 0; axis < 3; ++axis) {
    distance = std::max({distance, cell.corner[axis] - point[axis], point[axis] - cell.corner[axis] - cell.side});
  }
  return distance;
}

// Per axis 1 deep inside, 1/2 on a face, 0 at the margin's end; multiplied over the axes.
double Weight(const float* point, const Cell& cell, double margin) {
  double weight = 1;
  for (size_t axis = 0; axis < 3; ++axis) {
    const double outside = std::max(cell.corner[axis] - point[axis], point[axis] - cell.corner[axis] - cell.side);
    weight *= margin > 0 ? std::clamp((margin - outside) / (2 * margin), 0.0, 1.0) : (outside <= 0 ? 1.0 : 0.0);
  }
  return weight;
}

SpatialBlock WithMargin(std::span<const float> positions, const Cell& cell, const SpatialBlockOptions& options) {
  double margin = std::clamp(options.margin, 0.0, 0.5) * cell.side;
  struct Neighbour {
    double distance;
    int64_t row;
  };
  std::vector<Neighbour> around;
  const auto count = static_cast<int64_t>(positions.size() / 3);
  auto own = cell.rows.begin();
  for (int64_t row = 0; row < count; ++row) {
    if (own != cell.rows.end() && *own == row) {
      ++own;
      continue;
    }
    const double distance = Distance(positions.data() + 3 * row, cell);
    if (distance < margin) around.push_back({distance, row});
  }
  if (static_cast<int64_t>(around.size()) > options.most) {
    const auto first_left_out = around.begin() + options.most;
    std::nth_element(around.begin(), first_left_out, around.end(), [](const auto& a, const auto& b) {
      return a.distance != b.distance ? a.distance < b.distance : a.row < b.row;
    });
    margin = first_left_out->distance;
    around.erase(first_left_out, around.end());
  }

  SpatialBlock block;
  block.side = cell.side + 2 * margin;
  for (size_t axis = 0; axis < 3; ++axis) block.corner[axis] = cell.corner[axis] - margin;
  block.rows = cell.rows;
  for (const Neighbour& neighbour : around) block.rows.push_back(neighbour.row);
  std::sort(block.rows.begin(), block.rows.end());
  own = cell.rows.begin();
  for (const int64_t row : block.rows) {
    double weight = Weight(positions.data() + 3 * row, cell, margin);
    if (own != cell.rows.end() && *own == row) {
      ++own;
      weight = std::max(weight, 1e-3);  // for points rounded out of the root cube, or a cell without extent
    }
    block.weights.push_back(static_cast<float>(weight));
  }
  return block;
}

}  // namespace

std::vector<SpatialBlock> SplitIntoBlocks(std::span<const float> positions, const std::array<double, 3>& corner,
                                          double side, const SpatialBlockOptions& options) {
  Cell root{corner, side, std::vector<int64_t>(positions.size() / 3)};
  std::iota(root.rows.begin(), root.rows.end(), 0);
  if (root.rows.empty()) return {};
  std::vector<Cell> leaves;
  Split(positions, std::move(root), 0, std::max<int64_t>(1, options.most), leaves);
  if (leaves.size() == 1 && leaves[0].side == side) {
    std::vector<float> weights(leaves[0].rows.size(), 1.0f);
    return {{std::move(leaves[0].rows), std::move(weights), corner, side}};
  }
  std::vector<SpatialBlock> blocks;
  std::vector<double> total(positions.size() / 3, 0.0);
  for (Cell& leaf : leaves) {
    blocks.push_back(WithMargin(positions, leaf, options));
    leaf.rows = {};
    const SpatialBlock& block = blocks.back();
    for (size_t j = 0; j < block.rows.size(); ++j) total[static_cast<size_t>(block.rows[j])] += block.weights[j];
  }
  for (SpatialBlock& block : blocks) {
    for (size_t j = 0; j < block.rows.size(); ++j) {
      block.weights[j] = static_cast<float>(block.weights[j] / total[static_cast<size_t>(block.rows[j])]);
    }
  }
  return blocks;
}

}  // namespace anchorsplat
