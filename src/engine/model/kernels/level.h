#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "model/kernels/patches.h"
#include "model/kernels/serialization.h"
#include "model/kernels/voxel_neighbours.h"

namespace anchorsplat {

// One resolution of the U-Net: its points, in which orders they are attended, and who neighbours whom. Everything here
// depends on the voxels alone, so it is built once per cloud and shared by the encoder and decoder blocks of the level.
struct Level {
  int64_t count = 0;       // N points
  int depth = 0;           // bits per axis of the codes
  Buffer<int32_t> voxels;  // [N,3]
  std::array<Buffer<int64_t>, kCurves>
      codes;  // [N] per slot of the order table (a slot's curve depends on the shuffles)
  std::array<Buffer<int32_t>, kCurves>
      patch_rows;  // [PaddedCount(N)] per slot: the point in each slot of the padded order
  std::array<Buffer<int32_t>, kCurves> positions;  // [N] per slot: where in the order each point stands
  Buffer<int32_t> neighbours;                      // [N,27], see VoxelNeighbours
  int64_t neighbour_pairs = 0;                     // entries of it that are there, centres included
  Buffer<int32_t> cluster;                         // [N] row of each point in the next coarser level; empty in the last
};

struct HierarchyOptions {
  std::vector<int> strides = {1, 2, 2, 2};  // of the poolings; powers of two
  int64_t patch_size = kPatchSize;
  DepthRule depth_rule = DepthRule::kLargest;
  Shuffles shuffles = kNoShuffles;  // the first for the input, then one per pooling
};

// All levels of a cloud at voxels [N,3], finest first, strides.size() + 1 of them. A pooling of stride 2^p merges the
// points whose codes agree after dropping 3p bits, so stride 1 merges points that share a voxel; where p exceeds the
// bits that are left, it merges those only. Clusters stand in the order of slot 0's codes.
//
// Errors (kBadArgument): a coordinate negative or above 2^20, a stride that is no power of two, more poolings than
// shuffles, shuffles that are no permutations.
Result<std::vector<Level>> BuildHierarchy(std::span<const int32_t> voxels, const HierarchyOptions& options = {});

}  // namespace anchorsplat
