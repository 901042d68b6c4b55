#pragma once

#include <torch/torch.h>

#include <vector>

#include "published/published_config.h"
#include "published/torch/block.h"
#include "published/torch/pooling.h"

namespace anchorsplat {

// Point Transformer V3 (Wu et al., CVPR 2024): a U-Net over the levels of a cloud.
class PointTransformerV3Impl : public torch::nn::Module {
 public:
  explicit PointTransformerV3Impl(const PublishedConfig& config);

  // features [N,59] → [N, decoder_channels[0]].
  torch::Tensor forward(const torch::Tensor& features, const Hierarchy& hierarchy, const ForwardOptions& options = {});

  struct Stage {
    SerializedPooling down{nullptr};  // none in the first encoder stage
    SerializedUnpooling up{nullptr};  // decoder stages only
    std::vector<Block> blocks;
  };
  torch::nn::Linear embedding{nullptr};    // embedding.0
  PointBatchNorm embedding_norm{nullptr};  // embedding.1
  std::vector<Stage> encoder;              // finest first
  std::vector<Stage> decoder;              // finest first
};
TORCH_MODULE(PointTransformerV3);

}  // namespace anchorsplat
