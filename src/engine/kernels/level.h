#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "kernels/patches.h"
#include "kernels/serialization.h"
#include "kernels/voxel_neighbours.h"

namespace anchorsplat {

// One resolution of the U-Net: its points, their attention orders and their neighbours. Depends on the voxels alone, so
// it is built once per cloud and shared by the level's encoder and decoder blocks.
struct Level {
  int64_t count = 0;       // N points
  int depth = 0;           // bits per axis of the codes
  Buffer<int32_t> voxels;  // [N,3]
  // Per slot of the order table; which curve a slot holds depends on the shuffles.
  std::array<Buffer<int64_t>, kCurves> codes;       // [N]
  std::array<Buffer<int32_t>, kCurves> patch_rows;  // [PaddedCount(N)] point at each slot of the padded order
  std::array<Buffer<int32_t>, kCurves> positions;   // [N] position of each point in the order
  Buffer<int32_t> neighbours;                       // [N,27], see VoxelNeighbours
  int64_t neighbour_pairs = 0;                      // entries of `neighbours` that exist, centres included
  Buffer<int32_t> cluster;  // [N] row of each point in the next coarser level; empty in the last
};

struct HierarchyOptions {
  std::vector<int> strides = {1, 2, 2, 2};  // of the poolings; powers of two
  int64_t patch_size = kPatchSize;
  DepthRule depth_rule = DepthRule::kLargest;
  Shuffles shuffles = kNoShuffles;  // the first for the input, then one per pooling
};

// Builds all levels of a cloud at voxels [N,3], finest first: strides.size() + 1 of them. A pooling of stride 2^p
// merges points whose codes agree after dropping 3p bits (at most the bits left); so stride 1 merges points that share
// a voxel.
// Clusters are in the order of slot 0's codes.
//
// Errors (kBadArgument): a coordinate negative or above 2^20; a stride that is no power of two; more poolings than
// shuffles; a shuffle that is no permutation.
Result<std::vector<Level>> BuildHierarchy(std::span<const int32_t> voxels, const HierarchyOptions& options = {});

}  // namespace anchorsplat
