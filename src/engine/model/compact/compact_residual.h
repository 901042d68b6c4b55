#pragma once

#include <cstdint>
#include <span>

#include "core/gaussian_cloud.h"
#include "model/compact/compact_config.h"
#include "model/compact/compact_graph.h"
#include "model/compact/compact_start.h"

namespace anchorsplat {

// From a compact network's raw outputs to Gaussians: the filter with a strength per Gaussian, the copies of the start,
// and bounded residuals on those, in each Gaussian's own frame (docs/network.md has the formulas).
struct CompactAnchors {
  const GaussianCloud* cloud = nullptr;
  const CompactGraph* graph = nullptr;
  std::span<const float> pixel_sizes;  // p_LR, world units, one for all or one per Gaussian
  double upscale = 4;                  // u
  double strength = 0;                 // f that residuals are added to
  double offset_side = 0;              // world units: side of the cube, for OffsetUnit::kCube
};

// The cube's side for OffsetUnit::kCube: 1 in the units of NormalisationMode::kAuto. 0 where that is not defined.
double CubeSide(std::span<const float> means);

// The least that f less what the closer view's pixels add (ShownStrength) counts as, so that its logarithm is a number;
// nothing visible.
inline constexpr double kLeastGain = 1e-8;

// Copies of Gaussian i. `raw`: CompactOutputs(config) numbers, multiplied by `fade` (1: all of the residual, 0: none).
// Writes to rows row, row + stride, … of `out`, which has the cloud's SH degree.
void WriteCopies(const CompactConfig& config, const CopyStart& start, const CompactAnchors& anchors, int64_t i,
                 const float* raw, float fade, int64_t row, int64_t stride, GaussianCloud& out);

}  // namespace anchorsplat
