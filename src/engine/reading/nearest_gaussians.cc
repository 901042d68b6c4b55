#include "reading/nearest_gaussians.h"

#include <algorithm>
#include <utility>

namespace anchorsplat {

namespace {

bool IsNearer(const NearestGaussians::Item& a, const NearestGaussians::Item& b) {
  return std::pair(a.squared_distance, a.row) < std::pair(b.squared_distance, b.row);
}

}  // namespace

NearestGaussians::Item NearestGaussians::ItemOf(double squared_distance, int64_t row, const CloudView& rows, size_t i) {
  Item item{squared_distance, row, {}};
  float* out = item.values.data();
  out = std::copy_n(rows.means.data() + 3 * i, 3, out);
  out = std::copy_n(rows.log_scales.data() + 3 * i, 3, out);
  out = std::copy_n(rows.quats.data() + 4 * i, 4, out);
  *out++ = rows.opacity_logits[i];
  std::copy_n(rows.sh.data() + 3 * i, 3, out);
  return item;
}

void NearestGaussians::Add(const std::vector<Item>& items) {
  if (items.empty()) return;
  const std::lock_guard lock(mutex_);
  seen_ += items.size();
  const size_t room = most_ + most_ / 2 + 2;
  for (const Item& item : items) {
    if (item.squared_distance > farthest()) continue;
    // Not doubled: that would take twice the memory while moving.
    if (items_.size() == items_.capacity()) items_.reserve(std::min(room, 2 * items_.size() + items.size()));
    items_.push_back(item);
    if (items_.size() >= room) Cut();
  }
}

// Keeps one more than `most`, so that Take knows the distance of the next one.
void NearestGaussians::Cut() {
  if (items_.size() <= most_ + 1) return;
  const auto last = items_.begin() + static_cast<std::ptrdiff_t>(most_);
  std::nth_element(items_.begin(), last, items_.end(), IsNearer);
  farthest_.store(last->squared_distance, std::memory_order_relaxed);
  items_.resize(most_ + 1);
}

GaussianCloud NearestGaussians::Take(std::optional<double>* next, std::vector<int64_t>* rows) {
  Cut();
  if (items_.size() > most_) {
    const auto last = items_.begin() + static_cast<std::ptrdiff_t>(most_);
    std::nth_element(items_.begin(), last, items_.end(), IsNearer);
    if (next != nullptr) *next = last->squared_distance;
    items_.pop_back();
  }
  std::sort(items_.begin(), items_.end(), [](const Item& a, const Item& b) { return a.row < b.row; });
  GaussianCloud out;
  out.Resize(std::ssize(items_), 0);
  for (size_t k = 0; k < items_.size(); ++k) {
    if (rows != nullptr) rows->push_back(items_[k].row);
    const float* from = items_[k].values.data();
    std::copy_n(from, 3, out.means.data() + 3 * k);
    std::copy_n(from + 3, 3, out.log_scales.data() + 3 * k);
    std::copy_n(from + 6, 4, out.quats.data() + 4 * k);
    out.opacity_logits[k] = from[10];
    std::copy_n(from + 11, 3, out.sh.data() + 3 * k);
  }
  std::vector<Item>().swap(items_);
  return out;
}

}  // namespace anchorsplat
