#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "published/enhance_with_published.h"

namespace anchorsplat {

// Settings of the method "model".
struct ModelSettings {
  // Weights of either kind of network (model/any_network.h). Empty: the built-in network; in builds without one the
  // method is not ready.
  std::filesystem::path file;
  WeightPrecision precision = WeightPrecision::kFloat;  // falls back to fp32, with a warning, if bfloat16 is slower
  // Of the published network. Compact networks use only `prune_opacity` and `max_gaussians`, which limits their output
  // (CopyChoice).
  PublishedOptions options;
  // Of compact networks: see CopyChoice in compact/copy_choice.h.
  std::optional<int64_t> copies;     // unset: auto
  std::optional<double> merge_cost;  // unset: the default there
};

}  // namespace anchorsplat
