#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "network/normalisation.h"
#include "published/feature_rows.h"
#include "published/published_network.h"

namespace anchorsplat {

struct PublishedOptions {
  // Reproduces the published inference script, quirks included: its row order and count, scrambled SH of degrees 1 and
  // 2 (ShPadding::kScrambled), Gaussians dropped that rounding pushes out of the cube, quaternions not normalised, the
  // cloud in one block. The default corrects all of these.
  bool upstream = false;

  NormalisationMode normalisation = NormalisationMode::kAuto;
  Shuffles shuffles = kNoShuffles;
  DepthRule depth_rule = DepthRule::kLargest;
  Rounding rounding = Rounding::kNone;  // of the attention's arithmetic; the release uses kHalf

  // Maximum number of anchors, 0 = no limit. Keeps the largest by opacity × size (product of the two largest scales),
  // in file order. Upstream keeps a random subset in random order (PyTorch's CPU generator, seed 918).
  int64_t max_gaussians = 0;
  // Drops output Gaussians below this opacity, 0 = keeps all. No renderer shows opacities below 1/255.
  float prune_opacity = 0;
  // Larger clouds are enhanced in overlapping blocks, one at a time (spatial_blocks.h). Ignored with `upstream`.
  int64_t block_gaussians = 200000;

  NetworkProfile* profile = nullptr;  // accumulates times and multiply-adds; may be null
};

struct PublishedReport {
  int64_t gaussians_in = 0;
  int64_t not_finite = 0;  // input rows dropped: NaN or infinity
  int64_t over_limit = 0;  // input rows dropped: max_gaussians
  int64_t outside = 0;     // input rows dropped: outside the cube (`upstream` or NormalisationMode::kUnit)
  int64_t anchors = 0;     // N, the remaining input rows
  int64_t output_not_finite = 0;
  int64_t pruned = 0;         // output rows dropped: prune_opacity
  int64_t gaussians_out = 0;  // K·N − output_not_finite − pruned
  int64_t blocks = 0;
  Normalisation normalisation;  // of the whole cloud
};

struct PublishedResult {
  GaussianCloud cloud;
  PublishedReport report;
};

// Enhances a cloud: K Gaussians of SH degree 3 per anchor, in world space. Copy k of all anchors precedes copy k + 1
// (row k·N + i). Opacity logits are clamped to ±20, SH coefficients to ±10, log-scales to at most 5 (without
// `upstream`, a larger log-scale keeps its anchor's value). Keeps metadata. Logs whatever it drops and reports
// progress. The same bits for any number of threads.
//
// Errors (kBadArgument): those of Validate(cloud), Validate(shuffles) and FitNormalisation; no Gaussian left; output
// larger than memory.
Result<PublishedResult> EnhanceWithPublishedNetwork(const GaussianCloud& cloud, const PublishedNetwork& network,
                                                    const PublishedOptions& options = {});

}  // namespace anchorsplat
