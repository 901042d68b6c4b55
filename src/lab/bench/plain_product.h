#pragma once

#include <chrono>
#include <cstdint>

#include "core/buffer.h"
#include "core/random.h"
#include "kernels/linear.h"

namespace anchorsplat {

// A matrix product as the reference rate for networks. It has the shape of the published network's widest layer on the
// demo's Gaussians.
class PlainProduct {
 public:
  explicit PlainProduct(WeightPrecision precision) : input_(kRows * kInputs), out_(kRows * kOutputs) {
    Random random(1);
    Buffer<float> weights(kInputs * kOutputs);
    for (float& v : input_) v = static_cast<float>(random.Uniform(-1, 1));
    for (float& v : weights) v = static_cast<float>(random.Uniform(-1, 1));
    weights_ = PackedWeights(weights.data(), nullptr, kOutputs, kInputs, 1, precision);
    Flops();  // touches the pages
  }

  // Floating-point operations per second of one product now.
  double Flops() {
    const auto begin = std::chrono::steady_clock::now();
    LinearCpu({.rows = kRows,
               .input = input_.data(),
               .input_stride = kInputs,
               .weights = &weights_,
               .out = out_.data(),
               .output_stride = kOutputs});
    return 2.0 * kRows * kInputs * kOutputs /
           std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  }

 private:
  static constexpr int64_t kRows = 17020, kInputs = 512, kOutputs = 2048;
  Buffer<float> input_, out_;
  PackedWeights weights_;
};

}  // namespace anchorsplat
