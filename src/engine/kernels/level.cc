#include "kernels/level.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/parallel.h"
#include "core/text.h"

namespace anchorsplat {

namespace {

using Codes = std::array<Buffer<int64_t>, kCurves>;
using Orders = std::array<Buffer<int32_t>, kCurves>;

// Computes orders, patches and neighbours of a level from its voxels, depth and (unshuffled) codes. Returns the orders.
Orders Finish(Level& level, Codes codes, const Shuffle& shuffle, int64_t patch_size) {
  Orders orders;
  ParallelFor(0, kCurves + 1, 1, [&](int64_t task, int64_t) {
    if (task == kCurves) {
      level.neighbours = VoxelNeighbours(level.voxels);
      level.neighbour_pairs = std::count_if(level.neighbours.begin(), level.neighbours.end(),
                                            [](int32_t row) { return row != kNoNeighbour; });
      return;
    }
    const size_t slot = static_cast<size_t>(task);
    level.codes[slot] = std::move(codes[shuffle[slot]]);
    const Buffer<int32_t> order = OrderOfCodes(level.codes[slot]);
    level.patch_rows[slot] = PatchRows(order, patch_size);
    level.positions[slot].resize(order.size());
    for (size_t i = 0; i < order.size(); ++i) {
      level.positions[slot][static_cast<size_t>(order[i])] = static_cast<int32_t>(i);
    }
    orders[slot] = order;
  });
  return orders;
}

}  // namespace

Result<std::vector<Level>> BuildHierarchy(std::span<const int32_t> voxels, const HierarchyOptions& options) {
  ANCHORSPLAT_RETURN_IF_ERROR(Validate(options.shuffles));
  if (options.strides.size() + 1 > options.shuffles.size()) {
    return Error{ErrorCode::kBadArgument,
                 Cat(options.strides.size(), " poolings, but there are shuffles for ", kShuffles - 1)};
  }
  for (const int stride : options.strides) {
    if (stride < 1 || !std::has_single_bit(static_cast<unsigned>(stride))) {
      return Error{ErrorCode::kBadArgument, Cat("pooling stride ", stride, " is not a power of two")};
    }
  }
  const auto [smallest, largest] = std::minmax_element(voxels.begin(), voxels.end());
  if (!voxels.empty() && (*smallest < 0 || *largest > 1 << 20)) {
    return Error{ErrorCode::kBadArgument,
                 Cat("voxel coordinates must be 0 to ", 1 << 20, ", found ", *smallest, " to ", *largest)};
  }

  std::vector<Level> levels(1);
  levels[0].count = static_cast<int64_t>(voxels.size() / 3);
  levels[0].depth = voxels.empty() ? 0 : CurveDepth(*largest, options.depth_rule);
  levels[0].voxels.assign(voxels.begin(), voxels.end());
  Codes codes;
  for (size_t c = 0; c < codes.size(); ++c) {
    codes[c].resize(static_cast<size_t>(levels[0].count));
    CurveCodes(static_cast<Curve>(c), levels[0].depth, voxels, codes[c]);
  }
  Orders orders = Finish(levels[0], std::move(codes), options.shuffles[0], options.patch_size);

  for (size_t s = 0; s < options.strides.size(); ++s) {
    Level& fine = levels[s];
    Level coarse;
    int drop = std::countr_zero(static_cast<unsigned>(options.strides[s]));
    if (drop > fine.depth) drop = 0;
    coarse.depth = fine.depth - drop;

    // Members of a cluster are consecutive in the order of slot 0.
    Buffer<int32_t> first_member;
    fine.cluster.resize(static_cast<size_t>(fine.count));
    int64_t before = -1;
    for (const int32_t row : orders[0]) {
      const int64_t code = fine.codes[0][static_cast<size_t>(row)] >> (3 * drop);
      if (code != before) first_member.push_back(row);
      before = code;
      fine.cluster[static_cast<size_t>(row)] = static_cast<int32_t>(first_member.size()) - 1;
    }
    coarse.count = static_cast<int64_t>(first_member.size());
    coarse.voxels.resize(first_member.size() * 3);
    Codes coarse_codes;
    for (Buffer<int64_t>& row_codes : coarse_codes) row_codes.resize(first_member.size());
    for (size_t i = 0; i < first_member.size(); ++i) {
      const size_t row = static_cast<size_t>(first_member[i]);
      for (size_t axis = 0; axis < 3; ++axis) coarse.voxels[3 * i + axis] = fine.voxels[3 * row + axis] >> drop;
      for (size_t slot = 0; slot < coarse_codes.size(); ++slot) {
        coarse_codes[slot][i] = fine.codes[slot][row] >> (3 * drop);
      }
    }
    orders = Finish(coarse, std::move(coarse_codes), options.shuffles[s + 1], options.patch_size);
    levels.push_back(std::move(coarse));
  }
  return levels;
}

}  // namespace anchorsplat
