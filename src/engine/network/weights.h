#pragma once

#include <functional>
#include <span>

#include "core/buffer.h"
#include "core/result.h"
#include "network/tensor_spec.h"

namespace anchorsplat {

// Source of a network's weights: fills `values` with the tensor's row-major numbers. Not called for counters.
using WeightSource = std::function<Status(const TensorSpec& tensor, std::span<float> values)>;

// Deterministic weights of realistic size derived from tensor names, for parity tests and measurements. Element i of
// tensor `name` is u = splitmix64(FNV-1a(name) + (i + 1)·golden ratio), its top 24 bits mapped to [−1, 1) and scaled by
// the kind of tensor.
WeightSource HashWeights();

}  // namespace anchorsplat
