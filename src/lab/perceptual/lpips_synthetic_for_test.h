#pragma once

#include <cmath>
#include <cstdint>

#include "core/random.h"
#include "perceptual/lpips_weights.h"

namespace anchorsplat {

// Synthetic weights for tests: deviations that preserve the magnitude of features, biases of both signs, and positive
// heads as in the trained networks.
inline LpipsWeights SyntheticLpipsWeights(LpipsNet net) {
  LpipsWeights weights{net, {}};
  Random random(1000 + static_cast<uint64_t>(net));
  for (const LpipsTensorSpec& spec : LpipsTensors(net)) {
    int64_t elements = 1;
    for (const int64_t side : spec.shape) elements *= side;
    const bool head = spec.name.starts_with("lin");
    const double scale = spec.shape.size() == 1
                             ? 0.1
                             : std::sqrt(6 / (static_cast<double>(elements) / static_cast<double>(spec.shape[0])));
    Buffer<float> values(static_cast<size_t>(elements));
    for (float& value : values) {
      value = static_cast<float>(head ? random.Uniform() : random.Uniform(-scale, scale));
    }
    weights.tensors.push_back(std::move(values));
  }
  return weights;
}

}  // namespace anchorsplat
