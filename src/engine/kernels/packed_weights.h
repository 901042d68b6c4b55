#pragma once

#include <cstdint>

#include "core/buffer.h"

namespace anchorsplat {

// Two consecutive bfloat16 inputs, the first in the low half, as the processor's dot products take them.
using BFloat16Pair = uint32_t;

enum class WeightPrecision : uint8_t {
  kFloat,
  kBFloat16,  // weights and inputs rounded to bfloat16, sums in fp32
};

// Matrices of a linear layer or convolution in the order in which the kernels read them, so that these stream through
// memory instead of striding. Built once per model.
//
// A panel holds kPanel output channels: [inputs][kPanel], channel fastest, or [pairs of inputs][kPanel] in bfloat16.
// Panels of a tap are contiguous. Zeros fill channels beyond the last, and the missing half of an odd number of inputs.
// The layout is the same for every SIMD width.
class PackedWeights {
 public:
  static constexpr int64_t kPanel = 16;

  PackedWeights() = default;

  // `weights`: [outputs, taps, inputs] row-major, as PyTorch stores them; 1 tap for a linear layer, 27 for a 3×3×3
  // convolution. `bias`: [outputs], or null for zeros.
  PackedWeights(const float* weights, const float* bias, int64_t outputs, int64_t inputs, int64_t taps = 1,
                WeightPrecision precision = WeightPrecision::kFloat);

  int64_t outputs() const { return outputs_; }
  int64_t inputs() const { return inputs_; }
  int64_t taps() const { return taps_; }
  WeightPrecision precision() const { return precision_; }
  int64_t panels() const { return (outputs_ + kPanel - 1) / kPanel; }
  const float* panel(int64_t tap, int64_t index) const {  // kFloat
    return values_.data() + (tap * panels() + index) * inputs_ * kPanel;
  }
  const BFloat16Pair* pair_panel(int64_t tap, int64_t index) const {  // kBFloat16
    return pairs_.data() + (tap * panels() + index) * pairs() * kPanel;
  }
  int64_t pairs() const { return (inputs_ + 1) / 2; }
  const float* bias() const { return bias_.data(); }  // [panels()·kPanel], zeros beyond the last output

 private:
  int64_t outputs_ = 0;
  int64_t inputs_ = 0;
  int64_t taps_ = 0;
  WeightPrecision precision_ = WeightPrecision::kFloat;
  Buffer<float> values_;
  Buffer<BFloat16Pair> pairs_;
  Buffer<float> bias_;
};

}  // namespace anchorsplat
