#pragma once

#include <cstdint>

#include "core/buffer.h"

namespace anchorsplat {

// The matrices of a linear layer or of a convolution in the order in which the matrix kernels read them. Made once per
// model: the kernels then stream through memory instead of striding over it.
//
// A panel holds kPanel output channels: [inputs][kPanel], channel fastest. Panels of a tap stand one after the other;
// channels beyond the last are zeros. The layout is the same for every SIMD width.
class PackedWeights {
 public:
  static constexpr int64_t kPanel = 16;

  PackedWeights() = default;

  // `weights` as PyTorch stores them, [outputs, taps, inputs] row-major: a linear layer has one tap, a 3×3×3
  // convolution 27. `bias` [outputs] may be null: zeros.
  PackedWeights(const float* weights, const float* bias, int64_t outputs, int64_t inputs, int64_t taps = 1);

  int64_t outputs() const { return outputs_; }
  int64_t inputs() const { return inputs_; }
  int64_t taps() const { return taps_; }
  int64_t panels() const { return (outputs_ + kPanel - 1) / kPanel; }
  const float* panel(int64_t tap, int64_t index) const {
    return values_.data() + (tap * panels() + index) * inputs_ * kPanel;
  }
  const float* bias() const { return bias_.data(); }  // [panels()·kPanel], zeros beyond the last output

 private:
  int64_t outputs_ = 0;
  int64_t inputs_ = 0;
  int64_t taps_ = 0;
  Buffer<float> values_;
  Buffer<float> bias_;
};

}  // namespace anchorsplat
