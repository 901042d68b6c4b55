#pragma once

#include <torch/torch.h>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "compact/compact_config.h"
#include "compact/compact_start.h"
#include "compact/torch/edge_messages.h"
#include "core/result.h"
#include "network/torch/trainable_network.h"

namespace anchorsplat {

// Range of a splat's features: quantiles of each, [NodeFeatures(config)].
struct FeatureRange {
  torch::Tensor low, high;
};

// What Prepare computes for a splat or a part. Round r updates the first rings[rounds − r] rows, so the last round
// leaves states of the wanted rows. For a whole splat all rings end at N.
struct CompactTables {
  std::vector<int64_t> rings;
  torch::Tensor nodes;            // [rings[rounds],NodeFeatures(config)]
  torch::Tensor edges;            // [rings[rounds − 1]·m,kEdgeFeatures]
  std::vector<EdgeIndex> rounds;  // edges of each round
  // From here on N counts the wanted rows.
  torch::Tensor axes;         // [N,3,3] axis a is row a
  torch::Tensor handedness;   // [N,1] ±1
  torch::Tensor stored_axis;  // [N,3] int64
  torch::Tensor log_scales;   // [N,3] longest first
  torch::Tensor quats;        // [N,4] unit
  torch::Tensor log_pixel;    // [N,1]
  torch::Tensor start_logit;  // [N]
  torch::Tensor log_shorter;  // [N,3] longest first
  FeatureRange range;
  double offset_side = 0;  // side of the cube for OffsetUnit::kCube, world units
};

// f of the filter under the residuals.
double StrengthOf(const NetworkInput& input);

// Implement the methods of CompactTrainable; same errors.
Result<std::shared_ptr<CompactTables>> MakeCompactTables(const CompactConfig& config, const CopyStart& start,
                                                         const NetworkInput& input);
Result<std::shared_ptr<const void>> SurveySplat(const CompactConfig& config, const NetworkInput& whole);
SplatPart PartOfSplat(const CompactConfig& config, const std::shared_ptr<const void>& survey,
                      std::span<const int64_t> wanted);

}  // namespace anchorsplat
