#pragma once

#include <cstdint>

#include "core/gaussian_cloud.h"
#include "core/result.h"
#include "model/published/feature_rows.h"
#include "model/published/published_network.h"
#include "model/shared/normalisation.h"

namespace anchorsplat {

struct PublishedOptions {
  // Exactly what the published inference script does, quirks included: rows in its order and number, SH of degree 1 and
  // 2 scrambled (ShPadding::kScrambled), Gaussians that rounding pushes out of the cube dropped, quaternions written as
  // the network gives them, the whole cloud at once. The default corrects these.
  bool upstream = false;

  NormalisationMode normalisation = NormalisationMode::kAuto;
  Shuffles shuffles = kNoShuffles;
  DepthRule depth_rule = DepthRule::kLargest;
  Rounding rounding = Rounding::kNone;  // of the attention's arithmetic; the release: kHalf

  // At most so many anchors, 0 = all. The largest by opacity × size (product of the two largest scales) stay, in their
  // order; upstream takes a random choice in random order (PyTorch's CPU generator, seed 918).
  int64_t max_gaussians = 0;
  // Output Gaussians of a smaller opacity are left out, 0 = none are: below 1/255 no renderer shows them.
  float prune_opacity = 0;
  // Larger clouds are enhanced in overlapping blocks, one after the other (spatial_blocks.h). Not used by `upstream`.
  int64_t block_gaussians = 200000;

  NetworkProfile* profile = nullptr;  // where times and multiply-adds are added up
};

struct PublishedReport {
  int64_t gaussians_in = 0;
  int64_t not_finite = 0;  // input rows dropped for NaN or infinity
  int64_t over_limit = 0;  // input rows dropped for max_gaussians
  int64_t outside = 0;     // input rows dropped for lying outside the cube (upstream, or NormalisationMode::kUnit)
  int64_t anchors = 0;     // what is left of them: N
  int64_t output_not_finite = 0;
  int64_t pruned = 0;         // for prune_opacity
  int64_t gaussians_out = 0;  // K·N − output_not_finite − pruned
  int64_t blocks = 0;
  Normalisation normalisation;  // of the whole cloud
};

struct PublishedResult {
  GaussianCloud cloud;
  PublishedReport report;
};

// Enhances a cloud with the network: K Gaussians of SH degree 3 for every anchor, copy k of all anchors before copy
// k + 1 (row k·N + i), in world space. Opacity logits are clamped to ±20, SH coefficients to ±10, and log-scales to at
// most 5 (the default lets a log-scale that was larger keep its anchor's value). Metadata is kept. Whatever is dropped
// is said through the log; progress is a task of the log. The same bits for any number of threads.
//
// Errors (kBadArgument): of Validate(cloud), Validate(shuffles) and FitNormalisation; no Gaussian left; more output
// than memory holds.
Result<PublishedResult> EnhanceWithPublishedNetwork(const GaussianCloud& cloud, const PublishedNetwork& network,
                                                    const PublishedOptions& options = {});

}  // namespace anchorsplat
