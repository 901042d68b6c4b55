#pragma once

#include <cstdint>
#include <span>

#include "compact/compact_config.h"
#include "compact/compact_graph.h"
#include "compact/compact_start.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Input for turning a compact network's raw outputs into Gaussians: the filter with a strength per Gaussian, its
// initial copies (CopyStart), and bounded residuals on them in each Gaussian's frame. Formulas: docs/network.md.
struct CompactAnchors {
  const GaussianCloud* cloud = nullptr;
  const CompactGraph* graph = nullptr;
  std::span<const float> pixel_sizes;  // p_LR, world units, one for all or one per Gaussian
  double upscale = 4;                  // u
  double strength = 0;                 // f of the filter under the residuals
  double offset_side = 0;              // side of the cube for OffsetUnit::kCube, world units
};

// Side of the cube of NormalisationMode::kAuto in world units; 0 where undefined.
double CubeSide(std::span<const float> means);

// Lower bound of f minus what the closer view's pixels add (ShownStrength), so that its logarithm is finite. Too small
// to be visible.
inline constexpr double kLeastGain = 1e-8;

// Writes the copies of Gaussian i to rows row, row + stride, … of `out`, which has the cloud's SH degree. `raw`:
// CompactOutputs(config) numbers, scaled by `fade` (1: full residual, 0: none).
void WriteCopies(const CompactConfig& config, const CopyStart& start, const CompactAnchors& anchors, int64_t i,
                 const float* raw, float fade, int64_t row, int64_t stride, GaussianCloud& out);

}  // namespace anchorsplat
