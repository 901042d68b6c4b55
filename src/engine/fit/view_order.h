#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace anchorsplat {

// Order in which steps use the `views` (≥ 1): every epoch visits each once, in an order that depends on seed and epoch.
class ViewOrder {
 public:
  ViewOrder(int64_t views, uint64_t seed);
  int64_t At(int64_t step);  // 0 … views − 1; step ≥ 0
  // The view of `step` and the following ones of its epoch. Valid until the next call.
  std::span<const int64_t> From(int64_t step);

 private:
  uint64_t seed_;
  int64_t epoch_ = -1;  // that `order_` belongs to
  std::vector<int64_t> order_;
};

}  // namespace anchorsplat
