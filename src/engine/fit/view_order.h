#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace anchorsplat {

// Which of `views` (≥ 1) a step uses: every epoch goes through all of them once, in an order of its own that follows
// from seed and epoch.
class ViewOrder {
 public:
  ViewOrder(int64_t views, uint64_t seed);
  int64_t At(int64_t step);  // 0 … views − 1; step ≥ 0
  // That of `step` and those of the steps after it in the same epoch. Until the next call.
  std::span<const int64_t> From(int64_t step);

 private:
  uint64_t seed_;
  int64_t epoch_ = -1;  // that `order_` belongs to
  std::vector<int64_t> order_;
};

}  // namespace anchorsplat
