#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <mutex>
#include <optional>
#include <vector>

#include "core/cloud_view.h"
#include "core/gaussian_cloud.h"

namespace anchorsplat {

// Collects the `most` Gaussians nearest to a point from a stream of any length, in memory for 1.5 · most. The result
// does not depend on the order of the stream: ties go to the first rows.
class NearestGaussians {
 public:
  explicit NearestGaussians(size_t most) : most_(most) {}

  // A Gaussian and its place.
  struct Item {
    double squared_distance = 0;
    int64_t row = 0;  // of the whole cloud
    // Mean, log-scales, quaternion, opacity logit, SH DC.
    std::array<float, 14> values{};
  };
  static Item ItemOf(double squared_distance, int64_t row, const CloudView& rows, size_t i);

  // Squared distance beyond which a Gaussian is not among the nearest. Decreases as items are added. Thread-safe.
  double farthest() const { return farthest_.load(std::memory_order_relaxed); }
  void Add(const std::vector<Item>& items);  // thread-safe

  size_t count() const { return seen_; }  // items added; exact only up to `most`
  // Returns the nearest in row order, without harmonics, and frees the memory. `next`: receives the squared distance of
  // the nearest Gaussian not included. `rows`: receives their rows.
  GaussianCloud Take(std::optional<double>* next = nullptr, std::vector<int64_t>* rows = nullptr);

 private:
  void Cut();

  size_t most_;
  std::mutex mutex_;
  std::vector<Item> items_;
  size_t seen_ = 0;
  std::atomic<double> farthest_ = std::numeric_limits<double>::infinity();
};

}  // namespace anchorsplat
