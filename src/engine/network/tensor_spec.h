#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace anchorsplat {

// Name and shape of a tensor in a weights file.
struct TensorSpec {
  std::string name;
  std::vector<int64_t> shape;
  bool counter = false;  // num_batches_tracked: an integer that inference does not need
};

std::string ShapeText(std::span<const int64_t> shape);  // "[64, 59]"

}  // namespace anchorsplat
