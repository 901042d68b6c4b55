#pragma once

#include <filesystem>
#include <memory>

#include "core/result.h"
#include "enhance/enhance.h"
#include "model/compact/compact_network.h"
#include "model/published/enhance_with_published.h"

namespace anchorsplat {

// What the method "model" of enhance/enhance.h works with. Filled in (by the command line) before Enhance is called.
struct ModelMethod {
  // Weights of either kind of network (model/any_network.h). Empty: the network that is part of the program; the
  // method is not ready when there is none.
  std::filesystem::path file;
  WeightPrecision precision = WeightPrecision::kFloat;  // fp32, with a warning, where bfloat16 would be slower
  // Of the published architecture; of these, compact networks look at `prune_opacity` only.
  PublishedOptions options;
};

// Adds the method "model", which "auto" prefers to the filter once there is a network. It is loaded at the first cloud
// and kept for the next.
void RegisterModelMethod(const std::shared_ptr<const ModelMethod>& method);

// Enhances by a compact network, with a word in the log and in report.facts ("copies", "unlike_training",
// "partly_unlike_training", "output_not_finite", "pruned"). kBadFile: it says nothing finite about any Gaussian. A
// strength of no more than 1/u² means that there is no lost width to build on (an antialiased splat, or one that is
// seen no closer): it stays as it is.
Result<GaussianCloud> EnhanceWithCompactNetwork(EnhanceInput input, double upscale, const CompactNetwork& network,
                                                float prune_opacity, EnhanceReport& report);

}  // namespace anchorsplat
