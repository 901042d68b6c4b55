#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "kernels/level.h"
#include "kernels/patches.h"
#include "network/tensor_spec.h"

namespace anchorsplat {

// Attributes of a Gaussian in the order of the input row and of the heads: stored (pre-activation) values of the
// normalised cloud. features_rest is coefficient-major, rgb fastest.
struct Attribute {
  const char* name;  // as in published checkpoints
  int64_t offset;    // first column of the feature row
  int64_t channels;
};
inline constexpr Attribute kAttributes[] = {{"means", 0, 3}, {"scales", 3, 3},       {"opacities", 6, 1},
                                            {"quats", 7, 4}, {"features_dc", 11, 3}, {"features_rest", 14, 45}};
inline constexpr int64_t kFeatures = 59;

// Voxels per axis of the normalised cube [0,1]³.
inline constexpr int kGridResolution = 384;

// ε: maximum distance of an output mean from its anchor, per axis, in the normalised cube.
inline constexpr float kAnchorOffsetScale = 0.015f;

inline constexpr double kBatchNormEpsilon = 1e-3;
inline constexpr double kBatchNormMomentum = 0.01;

// Architecture of the network. Defaults are the published ones; for other checkpoints K, widths and block counts are
// read from tensor shapes.
struct PublishedConfig {
  int64_t copies = 20;  // K: output Gaussians per anchor
  std::vector<int64_t> encoder_channels = {64, 96, 128, 256, 512};
  std::vector<int64_t> encoder_blocks = {2, 2, 2, 6, 2};
  std::vector<int64_t> encoder_heads = {2, 4, 8, 16, 32};
  std::vector<int64_t> decoder_channels = {96, 96, 128, 256};  // finest first, one fewer than the encoder has
  std::vector<int64_t> decoder_blocks = {2, 2, 2, 2};
  std::vector<int64_t> decoder_heads = {4, 4, 8, 16};
  std::vector<int> strides = {1, 2, 2, 2};
  int64_t patch_size = kPatchSize;
  int64_t head_hidden = 128;
  double drop_path = 0.3;  // in training: drop rate of the deepest block; rates rise linearly to it

  int64_t stages() const { return static_cast<int64_t>(encoder_channels.size()); }
  int64_t context_channels() const { return stages() > 1 ? decoder_channels[0] : encoder_channels[0]; }
};

// kBadArgument: lists of different lengths, more stages than shuffles, widths not divisible by their heads.
Status Validate(const PublishedConfig& config);

// All tensors of this architecture, named and ordered as in published checkpoints.
std::vector<TensorSpec> PublishedTensors(const PublishedConfig& config);

// Infers the architecture from a checkpoint's tensors: K from point_embeddings.means; stages, blocks and widths from
// the backbone. No tensor encodes the number of heads, so each stage is assumed to have the published number, which
// must divide its width.
//
// Errors (kBadFile): a required tensor is missing, or a width is not divisible. Messages name the tensor; the caller
// prepends the file.
Result<PublishedConfig> ConfigOfTensors(std::span<const TensorSpec> tensors);

// Voxels [N,3] of N normalised means: floor(x·384). `features`: the means are the first three of every `stride` floats.
Buffer<int32_t> GridVoxels(const float* features, int64_t count, int64_t stride);

// BuildHierarchy options for this architecture.
HierarchyOptions HierarchyOptionsFor(const PublishedConfig& config, const Shuffles& shuffles = kNoShuffles,
                                     DepthRule depth_rule = DepthRule::kLargest);

}  // namespace anchorsplat
