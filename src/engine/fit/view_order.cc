#include "fit/view_order.h"

#include <cstddef>
#include <numeric>
#include <utility>

#include "fit/random_streams.h"

namespace anchorsplat {

ViewOrder::ViewOrder(int64_t views, uint64_t seed) : seed_(seed), order_(static_cast<size_t>(views)) {}

int64_t ViewOrder::At(int64_t step) { return From(step).front(); }

std::span<const int64_t> ViewOrder::From(int64_t step) {
  const auto views = static_cast<int64_t>(order_.size());
  if (epoch_ != step / views) {
    epoch_ = step / views;
    std::iota(order_.begin(), order_.end(), int64_t{0});
    Random random = RandomStream(seed_, RandomPurpose::kViewOrder, epoch_);
    for (int64_t left = views; left > 1; --left) {
      std::swap(order_[static_cast<size_t>(left - 1)], order_[static_cast<size_t>(random.Below(left))]);
    }
  }
  return std::span(order_).subspan(static_cast<size_t>(step % views));
}

}  // namespace anchorsplat
