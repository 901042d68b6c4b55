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

// The Gaussians nearest to a point, of any number that are shown: memory for half as many more as are wanted. Which
// ones they are does not depend on the order in which they are shown: of equally far ones the first rows.
class NearestGaussians {
 public:
  explicit NearestGaussians(size_t most) : most_(most) {}

  // A Gaussian with its place.
  struct Item {
    double squared_distance = 0;
    int64_t row = 0;  // of the whole cloud
    // Mean, log-scales, quaternion, opacity logit, constant colour.
    std::array<float, 14> values{};
  };
  static Item ItemOf(double squared_distance, int64_t row, const CloudView& rows, size_t i);

  // One that is farther is none of the nearest. From any thread; falls while Gaussians are added.
  double farthest() const { return farthest_.load(std::memory_order_relaxed); }
  void Add(const std::vector<Item>& items);  // from any thread

  size_t count() const { return seen_; }  // that were added, while they were no more than the most
  // The nearest, in the order of rows, without harmonics; gives the memory back. `next`: the squared distance of the
  // nearest one that is not among them. `rows`: which they are.
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
