#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "core/buffer.h"
#include "core/result.h"
#include "model/kernels/level.h"
#include "model/kernels/patches.h"
#include "model/shared/tensor_spec.h"

namespace anchorsplat {

// The attributes of a Gaussian as the network sees them, in the order of the input row and of the heads: stored
// (pre-activation) values of the normalised cloud. features_rest is coefficient-major, rgb fastest.
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

// ε: how far an output Gaussian's mean may lie from its anchor, per axis, in the normalised cube.
inline constexpr float kAnchorOffsetScale = 0.015f;

inline constexpr double kBatchNormEpsilon = 1e-3;
inline constexpr double kBatchNormMomentum = 0.01;

// Shape of the network. The defaults are the published ones; K, widths and block counts of other checkpoints are read
// from their tensors.
struct PublishedConfig {
  int64_t copies = 20;  // K: Gaussians that come out per anchor
  std::vector<int64_t> encoder_channels = {64, 96, 128, 256, 512};
  std::vector<int64_t> encoder_blocks = {2, 2, 2, 6, 2};
  std::vector<int64_t> encoder_heads = {2, 4, 8, 16, 32};
  std::vector<int64_t> decoder_channels = {96, 96, 128, 256};  // finest first, one fewer than the encoder has
  std::vector<int64_t> decoder_blocks = {2, 2, 2, 2};
  std::vector<int64_t> decoder_heads = {4, 4, 8, 16};
  std::vector<int> strides = {1, 2, 2, 2};
  int64_t patch_size = kPatchSize;
  int64_t head_hidden = 128;
  double drop_path = 0.3;  // of the deepest block, while training; rates rise linearly

  int64_t stages() const { return static_cast<int64_t>(encoder_channels.size()); }
  int64_t context_channels() const { return stages() > 1 ? decoder_channels[0] : encoder_channels[0]; }
};

// kBadArgument: lists of different lengths, more stages than there are shuffles, widths that their heads do not divide.
Status Validate(const PublishedConfig& config);

// All tensors of a network of this shape, named and ordered as in published checkpoints.
std::vector<TensorSpec> PublishedTensors(const PublishedConfig& config);

// The shape of the network that a checkpoint of these tensors belongs to: K from point_embeddings.means, stages, blocks
// and widths from the backbone. Numbers of heads are in no tensor: they are the published ones per stage, so a stage's
// width must be a multiple of them.
//
// Errors (kBadFile): a tensor that every network has is missing, or the widths allow no such heads. Messages name the
// tensor; the caller puts the file before it.
Result<PublishedConfig> ConfigOfTensors(std::span<const TensorSpec> tensors);

// The voxel of each of N means (rows of `features`, `stride` floats apart) of the normalised cloud: floor(x·384),
// [N,3].
Buffer<int32_t> GridVoxels(const float* features, int64_t count, int64_t stride);

// Options of BuildHierarchy that fit the network.
HierarchyOptions HierarchyOptionsFor(const PublishedConfig& config, const Shuffles& shuffles = kNoShuffles,
                                     DepthRule depth_rule = DepthRule::kLargest);

}  // namespace anchorsplat
