#pragma once

#include <torch/torch.h>

#include <array>
#include <memory>
#include <vector>

#include "kernels/level.h"

namespace anchorsplat {

// The tables of a Level as tensors on the network's device. On the CPU they share its memory.
struct LevelTensors {
  std::shared_ptr<const Level> tables;
  int64_t count = 0;
  int64_t patch_size = kPatchSize;
  std::array<torch::Tensor, kCurves> patch_rows;  // int32 [PaddedCount(N)]
  std::array<torch::Tensor, kCurves> positions;   // int32 [N]
  torch::Tensor neighbours;                       // int32 [N,27]
  torch::Tensor cluster;                          // int64 [N], undefined at the coarsest level

  // Rows that each offset of the 3×3×3 convolution writes (out) and reads (in), int32 [pairs]. Built on first use.
  struct Pairs {
    torch::Tensor out, in;
  };
  const std::array<Pairs, kNeighbours>& pairs() const;

 private:
  mutable std::shared_ptr<std::array<Pairs, kNeighbours>> pairs_;
};

// Finest first.
using Hierarchy = std::vector<LevelTensors>;

Hierarchy ToTensors(std::vector<Level> levels, int64_t patch_size = kPatchSize, torch::Device device = torch::kCPU);

}  // namespace anchorsplat
