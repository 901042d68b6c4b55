#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "model/kernels/level.h"
#include "model/kernels/packed_weights.h"
#include "model/kernels/rounding.h"
#include "model/published/published_config.h"
#include "model/published/published_profile.h"
#include "model/shared/weights.h"

namespace anchorsplat {

// The network for inference on the CPU: Point Transformer V3 and the heads as a row of kernel calls on raw arrays, with
// weights in the kernels' order and every BatchNorm folded into the linear layer before it where nothing stands
// between. The torch modules in torch/ are the same network for training and other devices; a test holds the two
// together.
class PublishedNetwork {
 public:
  // Errors: of Validate(config) and of `source`; kBadFile naming the tensor when a weight is NaN or infinite.
  //
  // kBFloat16 rounds weights and inputs of the blocks' matrices and convolutions, and the attention as
  // Rounding::kBFloat16 does; sums, the residual stream, norms and softmax stay in fp32, and so do the embedding and
  // the last layers of the heads, which cost little and show most.
  static Result<PublishedNetwork> Load(const PublishedConfig& config, const WeightSource& source,
                                       WeightPrecision precision = WeightPrecision::kFloat);

  const PublishedConfig& config() const { return config_; }
  WeightPrecision precision() const { return precision_; }

  // features [N,59] of the normalised cloud (kAttributes) → context [N, config().context_channels()]. `levels`: of
  // these N points (BuildHierarchy with HierarchyOptionsFor). `rounding`: of the attention's arithmetic; kNone leaves
  // it to the precision of the weights. The same bits for any number of threads. Needs about 40 · decoder width · N
  // bytes besides.
  Buffer<float> Context(const float* features, std::span<const Level> levels, Rounding rounding = Rounding::kNone,
                        NetworkProfile* profile = nullptr) const;

  // The Gaussians of n anchors in normalised, stored space: out [K,n,59], copy k of all anchors before copy k + 1.
  void Gaussians(const float* context, const float* features, int64_t n, float* out,
                 NetworkProfile* profile = nullptr) const;

  int64_t bytes() const;  // of the packed weights

 private:
  struct Norm {
    Buffer<float> weight, bias;
  };
  struct Block {
    int64_t heads = 1;
    PackedWeights conv, cpe_linear, qkv, proj, fc1, fc2;
    Norm cpe_norm, norm1, norm2;
  };
  struct Stage {
    PackedWeights down;         // encoder stages from the second on
    Norm down_norm;             // the BatchNorm after the maximum as scale and shift
    PackedWeights up, up_skip;  // decoder stages
    std::vector<Block> blocks;
  };
  struct Head {
    PackedWeights second, third, last;
  };
  struct Workspace;
  class Loader;

  void RunBlock(const Block& block, const Level& level, int slot, const float* conv_in, float* x, Rounding rounding,
                Workspace& workspace, NetworkProfile* profile) const;

  PublishedConfig config_;
  WeightPrecision precision_ = WeightPrecision::kFloat;
  PackedWeights embedding_;
  std::vector<Stage> encoder_;  // finest first
  std::vector<Stage> decoder_;  // finest first
  PackedWeights head_first_;    // of all six heads, one above the other: they read the same input
  std::vector<Head> heads_;
};

}  // namespace anchorsplat
