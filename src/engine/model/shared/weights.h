#pragma once

#include <functional>
#include <span>

#include "core/buffer.h"
#include "core/result.h"
#include "model/shared/tensor_spec.h"

namespace anchorsplat {

// Where a network takes its weights from: fills `values` (as many as the shape says) with the tensor's row-major
// numbers. Counters are not asked for.
using WeightSource = std::function<Status(const TensorSpec& tensor, std::span<float> values)>;

// Numbers made from the tensors' names, the same on every machine: parity tests and measurements need weights of a
// realistic size that need not be stored. Element i of tensor `name` is u = splitmix64(FNV-1a(name) + (i + 1)·golden
// ratio), its top 24 bits mapped to [−1, 1), scaled by the kind of tensor.
WeightSource HashWeights();

}  // namespace anchorsplat
