#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "model/published/enhance_with_published.h"

namespace anchorsplat {

// What the method "model" works with.
struct ModelSettings {
  // Weights of either kind of network (model/any_network.h). Empty: the network that is part of the program; the method
  // is not ready when there is none.
  std::filesystem::path file;
  WeightPrecision precision = WeightPrecision::kFloat;  // fp32, with a warning, where bfloat16 would be slower
  // Of the published architecture; of these, compact networks look at `prune_opacity` and `max_gaussians`, which is
  // about the result there (CopyChoice).
  PublishedOptions options;
  // Of compact networks: see CopyChoice of model/compact/copy_choice.h.
  std::optional<int64_t> copies;     // nothing: auto
  std::optional<double> merge_cost;  // nothing: as model/compact/copy_choice.h says
};

}  // namespace anchorsplat
