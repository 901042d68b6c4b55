#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "kernels/level.h"
#include "kernels/packed_weights.h"
#include "kernels/rounding.h"
#include "network/weights.h"
#include "published/published_config.h"
#include "published/published_profile.h"

namespace anchorsplat {

// The published network for CPU inference: Point Transformer V3 and the heads as kernel calls on raw arrays. Weights
// are packed for the kernels; each BatchNorm is folded into the linear layer before it unless something lies between.
// torch/ has the same network for training and other devices; a test compares the two.
class PublishedNetwork {
 public:
  // Loads and packs the weights. kBFloat16 rounds weights and inputs of the blocks' matrices and convolutions to
  // bfloat16, and the attention as Rounding::kBFloat16. Sums, residual stream, norms and softmax stay in fp32, as do
  // the embedding and the heads' last layers, which cost little and matter most.
  // Errors: those of Validate(config) and `source`; kBadFile naming the tensor if a weight is NaN or infinite.
  static Result<PublishedNetwork> Load(const PublishedConfig& config, const WeightSource& source,
                                       WeightPrecision precision = WeightPrecision::kFloat);

  const PublishedConfig& config() const { return config_; }
  WeightPrecision precision() const { return precision_; }

  // Runs the backbone: context [N, config().context_channels()] for features [N,59] of the normalised cloud
  // (kAttributes). `levels`: of these N points (BuildHierarchy with HierarchyOptionsFor). `rounding`: of the attention;
  // kNone follows the weights' precision. Needs about 40 · decoder width · N bytes of scratch memory. The same bits for
  // any number of threads.
  Buffer<float> Context(const float* features, std::span<const Level> levels, Rounding rounding = Rounding::kNone,
                        NetworkProfile* profile = nullptr) const;

  // Runs the heads on n anchors: out [K,n,59] in normalised, stored space; copy k of all anchors precedes copy k + 1.
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
    Norm down_norm;             // the BatchNorm after the max pooling, as scale and shift
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
  PackedWeights head_first_;    // first layers of all six heads, stacked: they share their input
  std::vector<Head> heads_;
};

}  // namespace anchorsplat
