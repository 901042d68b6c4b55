#include "model/kernels/packed_weights.h"

#include <algorithm>

#include "core/parallel.h"

namespace anchorsplat {

PackedWeights::PackedWeights(const float* weights, const float* bias, int64_t outputs, int64_t inputs, int64_t taps)
    : outputs_(outputs), inputs_(inputs), taps_(taps) {
  bias_.assign(static_cast<size_t>(panels() * kPanel), 0.0f);
  if (bias != nullptr) std::copy_n(bias, outputs, bias_.begin());
  values_.resize(static_cast<size_t>(taps * panels() * inputs * kPanel));
  ParallelFor(0, taps * panels(), 1, [&](int64_t begin, int64_t end) {
    for (int64_t index = begin; index < end; ++index) {
      const int64_t tap = index / panels();
      const int64_t first = index % panels() * kPanel;
      float* packed = values_.data() + index * inputs * kPanel;
      for (int64_t channel = 0; channel < kPanel; ++channel) {
        const float* row = first + channel < outputs ? weights + ((first + channel) * taps + tap) * inputs : nullptr;
        for (int64_t i = 0; i < inputs; ++i) packed[i * kPanel + channel] = row != nullptr ? row[i] : 0.0f;
      }
    }
  });
}

}  // namespace anchorsplat
