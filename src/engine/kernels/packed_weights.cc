#include "kernels/packed_weights.h"

#include <algorithm>
#include <bit>

#include "core/parallel.h"

namespace anchorsplat {

namespace {

uint32_t NearestBFloat16(float x) {
  const auto bits = std::bit_cast<uint32_t>(x);
  if (x != x) return bits >> 16 | 0x40;  // keeps NaN from becoming infinity
  return (bits + 0x7fff + (bits >> 16 & 1)) >> 16;
}

}  // namespace

PackedWeights::PackedWeights(const float* weights, const float* bias, int64_t outputs, int64_t inputs, int64_t taps,
                             WeightPrecision precision)
    : outputs_(outputs), inputs_(inputs), taps_(taps), precision_(precision) {
  bias_.assign(static_cast<size_t>(panels() * kPanel), 0.0f);
  if (bias != nullptr) std::copy_n(bias, outputs, bias_.begin());
  const bool floats = precision == WeightPrecision::kFloat;
  if (floats) {
    values_.resize(static_cast<size_t>(taps * panels() * inputs * kPanel));
  } else {
    pairs_.resize(static_cast<size_t>(taps * panels() * pairs() * kPanel));
  }
  ParallelFor(0, taps * panels(), 1, [&](int64_t begin, int64_t end) {
    for (int64_t index = begin; index < end; ++index) {
      const int64_t tap = index / panels();
      const int64_t first = index % panels() * kPanel;
      for (int64_t channel = 0; channel < kPanel; ++channel) {
        const float* row = first + channel < outputs ? weights + ((first + channel) * taps + tap) * inputs : nullptr;
        const auto weight = [&](int64_t i) { return row != nullptr && i < inputs ? row[i] : 0.0f; };
        if (floats) {
          float* packed = values_.data() + index * inputs * kPanel + channel;
          for (int64_t i = 0; i < inputs; ++i) packed[i * kPanel] = weight(i);
        } else {
          BFloat16Pair* packed = pairs_.data() + index * pairs() * kPanel + channel;
          for (int64_t i = 0; i < pairs(); ++i) {
            packed[i * kPanel] = NearestBFloat16(weight(2 * i)) | NearestBFloat16(weight(2 * i + 1)) << 16;
          }
        }
      }
    }
  });
}

}  // namespace anchorsplat
